//! The assembled guideway: geometry, modes, profile, chirp.

use crate::check::{bounded, unique_names};
use crate::description::GuidewayDescription;
use crate::propagator::NODES;
use crate::shapes::ShapeRow;
use crate::{ChirpForce, Error, Girder, GirderMode, InitialDeflection, Pole, Profile, Rails};

/// Most magnets: the size of a unit's description grows with their square.
const MAX_MAGNETS: usize = 4096;
/// Most spans.
const MAX_SPANS: usize = 100_000;

/// One span in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Where it begins (m).
    pub start: f64,
    /// Where it ends (m).
    pub end: f64,
    /// Index of its kind in [`Guideway::girders`].
    pub girder: usize,
    /// Index of its first mode in [`State`](crate::State).
    pub first_mode: usize,
}

/// A named point of a girder.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackPoint {
    /// Name.
    pub name: String,
    /// Index of its span.
    pub span: usize,
    /// Place (m from the start of the span).
    pub x: f64,
}

/// A guideway ready for simulation. It never changes while stepping.
#[derive(Debug, Clone, PartialEq)]
pub struct Guideway {
    magnets: usize,
    pole: Pole,
    girders: Vec<Girder>,
    spans: Vec<Span>,
    /// All modes, span by span.
    modes: Vec<GirderMode>,
    points: Vec<TrackPoint>,
    initial: InitialDeflection,
    profile: Option<Profile>,
    rails: Option<Rails>,
    joints: bool,
    chirp: Option<ChirpForce>,
    wavenumber: f64,
    /// Largest distance from a magnet's centre at which its force acts (m).
    reach: f64,
}

impl Guideway {
    /// Checks and assembles a description. `profile_file` is the text of the file that
    /// `irregularity.file` names; it is ignored if none is named.
    ///
    /// # Errors
    /// The first invalid entry, with its path.
    pub fn new(given: &GuidewayDescription, profile_file: Option<&str>) -> Result<Self, Error> {
        check_counts(given)?;
        let pole = Pole::new(given.pole.length, given.pole.forces)?;
        let factors = (given.stiffness_factor, given.mass_factor);
        let names: Vec<&str> = given.girders.keys().map(String::as_str).collect();
        let girders = given
            .girders
            .iter()
            .map(|(name, girder)| Girder::new(girder, factors, &pole, &format!("girders.{name}")))
            .collect::<Result<Vec<_>, _>>()?;
        let (spans, modes) = place(given, &names, &girders)?;
        let points = points(given, &spans, &girders)?;
        let track = (given.start, spans.last().map_or(given.start, |s| s.end));
        let mut irregularity = given.irregularity.clone();
        if profile_file.is_none() && irregularity.on && irregularity.file.is_some() {
            return Err(Error::invalid(
                "irregularity.file",
                "the file is named, but its content was not passed",
                "read the file and pass its text",
            ));
        }
        irregularity.on &= !(irregularity.file.is_none() && irregularity.amplitude == 0.0);
        let file = profile_file.filter(|_| irregularity.file.is_some());
        let profile = Profile::new(&irregularity, track, pole.length(), file)?;
        if given.rails.is_none()
            && let Some((name, _)) = names.iter().zip(&girders).find(|(_, g)| g.is_spatial())
        {
            return Err(Error::invalid(
                "rails",
                format!("missing, although girder `{name}` bends laterally or twists"),
                "give `rails` with half_gauge and height, {} for those of the paper's train",
            ));
        }
        let rails = |rails| Rails::new(rails, given.magnets, track, pole.length());
        let rails = given.rails.as_ref().map(rails).transpose()?;
        let chirp = ChirpForce::new(&given.chirp, middle(&spans))?;
        let wavenumber = girders.iter().map(Girder::wavenumber).fold(0.0, f64::max);
        let spread_evenly = girders.iter().any(Girder::spread_evenly);
        let reach = if spread_evenly { 0.5 * pole.length() } else { pole.reach() };
        let guideway = Self {
            magnets: given.magnets,
            pole,
            girders,
            spans,
            modes,
            points,
            initial: given.initial,
            profile,
            rails,
            joints: given.joints,
            chirp,
            wavenumber,
            reach,
        };
        guideway.check_start()?;
        Ok(guideway)
    }

    /// A mode without stiffness has no static state.
    fn check_start(&self) -> Result<(), Error> {
        if self.initial != InitialDeflection::Undeformed
            && self.modes.iter().any(|m| m.omega == 0.0)
        {
            return Err(Error::invalid(
                "initial",
                "a mode of frequency 0 has no static deflection",
                "set `initial` to \"undeformed\" or give positive frequencies",
            ));
        }
        Ok(())
    }

    /// Number of magnets (moving loads).
    pub fn magnets(&self) -> usize {
        self.magnets
    }

    /// How each magnet's force is spread.
    pub fn pole(&self) -> &Pole {
        &self.pole
    }

    /// Kinds of span, in the alphabetical order of their names.
    pub fn girders(&self) -> &[Girder] {
        &self.girders
    }

    /// The spans, along the track.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// All modes, span by span.
    pub fn modes(&self) -> &[GirderMode] {
        &self.modes
    }

    /// The named points, in the order of the description.
    pub fn points(&self) -> &[TrackPoint] {
        &self.points
    }

    /// State at the start that was asked for.
    pub fn initial(&self) -> InitialDeflection {
        self.initial
    }

    /// The irregularity, if it is on.
    pub fn profile(&self) -> Option<&Profile> {
        self.profile.as_ref()
    }

    /// The two rails, if the track has them.
    pub fn rails(&self) -> Option<&Rails> {
        self.rails.as_ref()
    }

    /// Whether kinks and steps at joints are asked for.
    pub fn joints(&self) -> bool {
        self.joints
    }

    /// Largest distance from a magnet's centre at which its force acts (m).
    pub(crate) fn reach(&self) -> f64 {
        self.reach
    }

    /// The chirp of eq. 13, if it is on.
    pub fn chirp(&self) -> Option<&ChirpForce> {
        self.chirp.as_ref()
    }

    /// Where the first span begins and the last ends (m).
    pub fn track(&self) -> (f64, f64) {
        (self.spans[0].start, self.spans[self.spans.len() - 1].end)
    }

    /// Middle of the middle span (m), the default position of the chirp.
    pub fn middle(&self) -> f64 {
        middle(&self.spans)
    }

    /// Largest wavenumber of any mode shape (rad/m).
    pub(crate) fn wavenumber(&self) -> f64 {
        self.wavenumber
    }

    /// Modes of the largest kind of span.
    pub(crate) fn most_modes(&self) -> usize {
        self.girders.iter().map(|g| g.modes().len()).max().unwrap_or(0)
    }

    /// The span at x, or none on rigid ground. At a joint it is the span that begins there.
    pub(crate) fn span_at(&self, x: f64) -> Option<&Span> {
        let next = self.spans.partition_point(|s| s.start <= x);
        let span = &self.spans[next.checked_sub(1)?];
        (x < span.end).then_some(span)
    }

    /// The span, with its length and pole filter, if poles centred at all of `places` are entirely on
    /// it and its modes are sines.
    pub(crate) fn sines_under_poles(&self, places: &[f64; NODES]) -> Option<(&Span, f64, &[f64])> {
        let span = self.span_at(places[0] - self.reach)?;
        let girder = &self.girders[span.girder];
        let filter = girder.shapes().sine_filter()?;
        let inside = |x: &f64| x - self.reach >= span.start && x + self.reach <= span.end;
        places.iter().all(inside).then_some((span, girder.length(), filter))
    }

    /// Calls `visit(span, row, share)` for every span that the pole centred at x touches: Σ share
    /// times row is the mean of the mode shapes over the pole.
    pub(crate) fn under_pole(
        &self,
        x: f64,
        row: &mut ShapeRow,
        mut visit: impl FnMut(&Span, &ShapeRow, f64),
    ) {
        let (from, to) = (x - self.reach, x + self.reach);
        if let Some(span) = self.span_at(from)
            && to <= span.end
        {
            self.girders[span.girder].shapes().under_pole(x - span.start, &self.pole, row);
            visit(span, row, 1.0);
            return;
        }
        // across a joint or an end of the guideway
        let first = self.spans.partition_point(|s| s.end <= from);
        for span in self.spans[first..].iter().take_while(|s| s.start < to) {
            let girder = &self.girders[span.girder];
            if girder.shapes().spread_evenly() && self.reach > 0.0 {
                girder.shapes().under_pole(x - span.start, &self.pole, row);
                visit(span, row, 1.0);
                continue;
            }
            // each discrete force alone
            for &(offset, share) in self.pole.points() {
                let place = x + offset;
                if place >= span.start && place < span.end {
                    girder.shape_at(place - span.start, row);
                    visit(span, row, share);
                }
            }
        }
    }

    /// Calls `visit(span, row)` with the mode shapes at x, if x is on a span.
    pub(crate) fn under_point(
        &self,
        x: f64,
        row: &mut ShapeRow,
        visit: impl FnOnce(&Span, &ShapeRow),
    ) {
        if let Some(span) = self.span_at(x) {
            self.girders[span.girder].shape_at(x - span.start, row);
            visit(span, row);
        }
    }
}

fn middle(spans: &[Span]) -> f64 {
    let span = spans[spans.len() / 2];
    0.5 * (span.start + span.end)
}

fn points(
    given: &GuidewayDescription,
    spans: &[Span],
    girders: &[Girder],
) -> Result<Vec<TrackPoint>, Error> {
    unique_names(given.points.iter().map(|p| Some(p.name.as_str())), "points")?;
    let check = |(k, point): (usize, &crate::description::PointDescription)| {
        let path = format!("points[{k}]");
        let mut letters = point.name.chars();
        let starts = letters.next().is_some_and(|c| c.is_ascii_alphabetic());
        if !starts || !letters.all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(Error::invalid(
                format!("{path}.name"),
                format!("`{}`", point.name),
                "use letters, digits and underscores, a letter first",
            ));
        }
        let span = point.span.checked_sub(1).and_then(|k| spans.get(k)).ok_or_else(|| {
            Error::invalid(
                format!("{path}.span"),
                format!("there is no span {}", point.span),
                format!("give a number from 1 to {}", spans.len()),
            )
        })?;
        bounded(point.x, girders[span.girder].length(), &path, "x")?;
        Ok(TrackPoint { name: point.name.clone(), span: point.span - 1, x: point.x })
    };
    given.points.iter().enumerate().map(check).collect()
}

fn check_counts(given: &GuidewayDescription) -> Result<(), Error> {
    if !(1..=MAX_MAGNETS).contains(&given.magnets) {
        return Err(Error::invalid(
            "magnets",
            format!("{}", given.magnets),
            format!("give a number from 1 to {MAX_MAGNETS}"),
        ));
    }
    let spans = given.spans.iter().fold(0, |sum: usize, run| sum.saturating_add(run.count));
    if spans > MAX_SPANS {
        return Err(Error::invalid(
            "spans",
            format!("{spans} spans"),
            format!("give at most {MAX_SPANS} in all"),
        ));
    }
    if given.spans.iter().all(|run| run.count == 0) {
        return Err(Error::invalid("spans", "none", "give at least one span"));
    }
    if !given.start.is_finite() {
        return Err(Error::invalid(
            "start",
            format!("{} m", given.start),
            "give a finite position",
        ));
    }
    for (name, value) in
        [("stiffness_factor", given.stiffness_factor), ("mass_factor", given.mass_factor)]
    {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::invalid(name, format!("{value}"), "give a positive finite factor"));
        }
    }
    Ok(())
}

fn place(
    given: &GuidewayDescription,
    names: &[&str],
    girders: &[Girder],
) -> Result<(Vec<Span>, Vec<GirderMode>), Error> {
    unique_names(given.spans.iter().map(|run| run.name.as_deref()), "spans")?;
    let (mut spans, mut modes) = (Vec::new(), Vec::new());
    let mut start = given.start;
    for (run, kind) in given.spans.iter().map(|run| run.girder.as_str()).enumerate() {
        let girder = names.iter().position(|name| *name == kind).ok_or_else(|| {
            Error::invalid(
                format!("spans[{run}].girder"),
                format!("there is no girder `{kind}`"),
                format!("use one of: {}", names.join(", ")),
            )
        })?;
        for _ in 0..given.spans[run].count {
            let end = start + girders[girder].length();
            spans.push(Span { start, end, girder, first_mode: modes.len() });
            modes.extend_from_slice(girders[girder].modes());
            start = end;
        }
    }
    Ok((spans, modes))
}
