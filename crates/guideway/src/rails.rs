//! The two rails: where they are, which magnet meets which, and their irregularity.

use std::f64::consts::TAU;

use crate::check::positive;
use crate::description::{
    GuidewayDescription, MeasuredProfile, RailIrregularityDescription, RailProfileDescription,
    RailsDescription, WhichRail,
};
use crate::harmonics::Harmonic;
use crate::irregularity::{FadeWindow, Profile, parse};
use crate::spectrum::{self, Direction};
use crate::{Error, RUN_OUT, Spline};

/// Longest pattern of sides.
const MAX_SIDES: usize = 4096;

/// Rails, checked and ready for use.
#[derive(Debug, Clone, PartialEq)]
pub struct Rails {
    half_gauge: f64,
    height: f64,
    /// +1 left, −1 right, of each magnet.
    sides: Vec<f64>,
    /// Vertical and lateral, of the left and of the right rail.
    profiles: [[Option<Profile>; 2]; 2],
}

impl Rails {
    /// Checks a description for a number of magnets; `track` is where the first span begins and the last ends (m), `pole`
    /// the length of a pole (m).
    pub(crate) fn new(
        given: &RailsDescription,
        magnets: usize,
        track: (f64, f64),
        pole: f64,
    ) -> Result<Self, Error> {
        positive(given.half_gauge, "rails", "half_gauge", "m")?;
        if !given.height.is_finite() {
            return Err(Error::invalid(
                "rails.height",
                format!("{} m", given.height),
                "give a finite height over the shear centre, negative below it",
            ));
        }
        if !(1..=MAX_SIDES).contains(&given.sides.len()) {
            return Err(Error::invalid(
                "rails.sides",
                format!("{} of them", given.sides.len()),
                format!("give 1 to {MAX_SIDES}, \"left\" or \"right\" magnet by magnet"),
            ));
        }
        let side = |(k, side): (usize, &WhichRail)| match side {
            WhichRail::Left => Ok(1.0),
            WhichRail::Right => Ok(-1.0),
            WhichRail::Both => Err(Error::invalid(
                format!("rails.sides[{k}]"),
                "\"both\"",
                "a magnet meets one rail: give \"left\" or \"right\"",
            )),
        };
        let pattern = given.sides.iter().enumerate().map(side).collect::<Result<Vec<f64>, _>>()?;
        let sides = pattern.iter().copied().cycle().take(magnets).collect();
        let irregularity = &given.irregularity;
        let profiles = if irregularity.on {
            let pair = |part: &Option<_>, direction| match part {
                Some(part) => pair(irregularity, part, direction, track, pole),
                None => Ok([None, None]),
            };
            [
                pair(&irregularity.vertical, Direction::Vertical)?,
                pair(&irregularity.lateral, Direction::Lateral)?,
            ]
        } else {
            Default::default()
        };
        Ok(Self { half_gauge: given.half_gauge, height: given.height, sides, profiles })
    }

    /// Distance of each rail from the middle of the track (m).
    pub fn half_gauge(&self) -> f64 {
        self.half_gauge
    }

    /// Height of the rails over the shear centre (m).
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Which rail magnet `k` (from 0) meets: +1 the left one, −1 the right one.
    pub fn side(&self, k: usize) -> f64 {
        self.sides.get(k).copied().unwrap_or_else(|| self.sides[k % self.sides.len()])
    }

    /// `[r, r′, r″]` of the vertical and of the lateral irregularity of a rail at x.
    pub fn irregularity(&self, side: f64, x: f64) -> [[f64; 3]; 2] {
        let rail = usize::from(side < 0.0);
        let at = |pair: &[Option<Profile>; 2]| pair[rail].as_ref().map_or([0.0; 3], |p| p.at(x));
        [at(&self.profiles[0]), at(&self.profiles[1])]
    }
}

fn name(direction: Direction) -> &'static str {
    match direction {
        Direction::Vertical => "vertical",
        Direction::Lateral => "lateral",
    }
}

/// The profiles of the left and the right rail in one direction.
fn pair(
    all: &RailIrregularityDescription,
    given: &RailProfileDescription,
    direction: Direction,
    track: (f64, f64),
    pole: f64,
) -> Result<[Option<Profile>; 2], Error> {
    let path = format!("rails.irregularity.{}", name(direction));
    if !(all.fade_length > 0.0 && all.fade_length.is_finite()) {
        return Err(Error::invalid(
            "rails.irregularity.fade_length",
            format!("{} m", all.fade_length),
            "give a positive length",
        ));
    }
    let window = FadeWindow {
        start: all.start.unwrap_or(track.0),
        end: all.end.unwrap_or(track.1 + RUN_OUT),
        fade: all.fade_length,
    };
    let rails = spectrum::harmonics(given, direction, all.seed, &path)?;
    let periodic = periodic(given, track.0, &path)?;
    let measured = [(&given.left, "left"), (&given.right, "right")];
    let mut profiles = [None, None];
    for (k, (mut harmonics, (points, rail))) in rails.into_iter().zip(measured).enumerate() {
        harmonics.retain(|h| h.amplitude != 0.0);
        let own = if k == 0 { WhichRail::Left } else { WhichRail::Right };
        harmonics.extend(
            periodic.iter().filter(|(r, _)| *r == own || *r == WhichRail::Both).map(|p| p.1),
        );
        let spline =
            points.as_ref().map(|p| points_of(p, &format!("{path}.{rail}"))).transpose()?;
        let profile = Profile::sum(&harmonics, spline.as_ref(), window)
            .map_err(|error| of_rails(error, &path))?;
        profiles[k] = match profile {
            Some(profile) if all.averaged => Some(profile.averaged(pole)?),
            profile => profile,
        };
    }
    Ok(profiles)
}

/// Errors of profiles name `irregularity`: those of rails are elsewhere.
fn of_rails(error: Error, path: &str) -> Error {
    match error {
        Error::Invalid { path: at, found, remedy } if at == "irregularity" => {
            Error::invalid(path, found, remedy)
        }
        Error::Invalid { path: at, found, remedy } if at.starts_with("irregularity.") => {
            Error::invalid(format!("rails.{at}"), found, remedy)
        }
        error => error,
    }
}

fn periodic(
    given: &RailProfileDescription,
    start: f64,
    path: &str,
) -> Result<Vec<(WhichRail, Harmonic)>, Error> {
    let mut all = Vec::new();
    for (k, part) in given.periodic.iter().enumerate() {
        let path = format!("{path}.periodic[{k}]");
        positive(part.wavelength, &path, "wavelength", "m")?;
        let sound = part.amplitudes.iter().chain(&part.phases).all(|v| v.is_finite());
        if part.amplitudes.is_empty() || part.phases.len() > part.amplitudes.len() || !sound {
            return Err(Error::invalid(
                path,
                format!("{} amplitudes and {} phases", part.amplitudes.len(), part.phases.len()),
                "give at least one amplitude (m), and at most as many phases (rad), all finite",
            ));
        }
        for (n, &amplitude) in part.amplitudes.iter().enumerate().filter(|(_, a)| **a != 0.0) {
            let wavenumber = TAU * (n + 1) as f64 / part.wavelength;
            let phase = part.phases.get(n).copied().unwrap_or(0.0) - wavenumber * start;
            // a sine is a cosine a quarter turn later
            let phase = phase - 0.25 * TAU;
            all.push((part.rail, Harmonic { amplitude, wavenumber, phase }));
        }
    }
    Ok(all)
}

fn points_of(given: &MeasuredProfile, path: &str) -> Result<Spline, Error> {
    if let Some(file) = &given.file {
        return Err(Error::invalid(
            format!("{path}.file"),
            format!("the content of `{file}` was not passed"),
            "read the file and pass its text, or give `x` and `value`",
        ));
    }
    Spline::new(&given.x, &given.value, path)
}

impl GuidewayDescription {
    fn measured(&mut self) -> impl Iterator<Item = &mut MeasuredProfile> {
        let parts = self.rails.iter_mut().flat_map(|rails| {
            [rails.irregularity.vertical.as_mut(), rails.irregularity.lateral.as_mut()]
        });
        parts.flatten().flat_map(|part| [part.left.as_mut(), part.right.as_mut()]).flatten()
    }

    /// Names of the files with measured profiles of rails, each once.
    #[must_use]
    pub fn rail_files(&self) -> Vec<String> {
        let mut copy = self.clone();
        let mut names: Vec<String> = copy.measured().filter_map(|m| m.file.take()).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Puts the content of a file with the measured profile of a rail in place of its name.
    ///
    /// # Errors
    /// A line that cannot be used; points given together with the file.
    pub fn set_rail_file(&mut self, file: &str, text: &str) -> Result<(), Error> {
        let spline = parse(text, file)?;
        let (x, value) = spline.points();
        for measured in self.measured().filter(|m| m.file.as_deref() == Some(file)) {
            if !measured.x.is_empty() || !measured.value.is_empty() {
                return Err(Error::invalid(
                    "rails.irregularity",
                    format!("`{file}` given together with points"),
                    "give `file`, or `x` and `value`",
                ));
            }
            *measured = MeasuredProfile { file: None, x: x.to_vec(), value: value.to_vec() };
        }
        Ok(())
    }
}
