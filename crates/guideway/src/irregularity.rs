//! Vertical irregularity of the track surface: random with a given spectrum, or from a file.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::description::IrregularityDescription;
use crate::harmonics::{self, Harmonic, KNOTS_PER_WAVE};
use crate::{Error, Spline};

/// Most knots of a tabulated profile (24 bytes each).
const MAX_KNOTS: f64 = 8e6;

/// Poles shorter than this fraction of the knots' spacing feel the profile at their centre. Their mean
/// differs from it by (Ωℓ)²/24 < 2e-9, not more than the interpolation.
const SHORTEST_POLE: f64 = 1e-3;

/// Default distance that the profile extends beyond the last span (m).
pub const RUN_OUT: f64 = 100.0;

/// A profile r(x), twice continuously differentiable, zero outside its range.
///
/// Tabulated with value, slope and curvature at equidistant knots and interpolated by quintic
/// Hermite polynomials, so that a lookup costs the same for any number of harmonics.
///
/// A magnet feels the mean over its pole, as it feels the girder's deflection: a wave of wavenumber Ω
/// counts sin(Ωℓ/2)/(Ωℓ/2) of its height under an evenly loaded pole of length ℓ.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    start: f64,
    spacing: f64,
    /// `[r, r′, r″]` at start + i·spacing.
    knots: Vec<[f64; 3]>,
}

impl Profile {
    /// The profile that `given` describes for a guideway from `track.0` to `track.1` (m) and poles of
    /// length `pole` (m), or none if it is off. `file` is the text of the profile file, if `given`
    /// names one.
    pub(crate) fn new(
        given: &IrregularityDescription,
        track: (f64, f64),
        pole: f64,
        file: Option<&str>,
    ) -> Result<Option<Self>, Error> {
        if !given.on {
            return Ok(None);
        }
        check(given)?;
        let window = FadeWindow {
            start: given.start.unwrap_or(track.0),
            end: given.end.unwrap_or(track.1 + RUN_OUT),
            fade: given.fade_length,
        };
        let profile = match file {
            None => random(given, window)?,
            Some(text) => from_spline(&parse(text, "irregularity.file")?, window)?,
        };
        Ok(Some(if given.averaged { profile.averaged(pole)? } else { profile }))
    }

    /// `[r, r′, r″]` at x (m, 1, 1/m).
    pub fn at(&self, x: f64) -> [f64; 3] {
        let d = self.spacing;
        let s = (x - self.start) / d;
        // Also false for NaN.
        if !(s >= 0.0 && s < (self.knots.len() - 1) as f64) {
            return [0.0; 3];
        }
        let i = s as usize;
        quintic(self.knots[i], self.knots[i + 1], s - i as f64, d)
    }

    /// Where the profile begins and ends (m); zero outside.
    pub fn range(&self) -> (f64, f64) {
        (self.start, self.start + self.spacing * (self.knots.len() - 1) as f64)
    }

    /// The sum of harmonics and of a measured profile within the window; none if there is neither. The measured one is
    /// faded at its own ends.
    pub(crate) fn sum(
        harmonics: &[Harmonic],
        measured: Option<&Spline>,
        window: FadeWindow,
    ) -> Result<Option<Self>, Error> {
        let measured = measured.map(|spline| from_spline(spline, window)).transpose()?;
        let highest = harmonics.iter().map(|h| h.wavenumber).fold(0.0, f64::max);
        if highest == 0.0 {
            return Ok(measured);
        }
        let finest = measured.as_ref().map_or(f64::INFINITY, |m| m.spacing);
        let cells = window.cells((TAU / highest / KNOTS_PER_WAVE).min(finest))?;
        let spacing = (window.end - window.start) / cells as f64;
        let sums = harmonics::tabulate(harmonics, window.start, spacing, cells);
        let mut profile = Self::tabulate(window, cells, |i, _| sums[i]);
        if let Some(measured) = &measured {
            for (i, knot) in profile.knots.iter_mut().enumerate() {
                let more = measured.at(profile.start + profile.spacing * i as f64);
                *knot = std::array::from_fn(|k| knot[k] + more[k]);
            }
        }
        Ok(Some(profile))
    }

    /// Tabulates `f` over the window, faded in and out. The number of cells is an argument: from their length
    /// rounding would sometimes give one more.
    fn tabulate(
        window: FadeWindow,
        cells: usize,
        mut f: impl FnMut(usize, f64) -> [f64; 3],
    ) -> Self {
        let spacing = (window.end - window.start) / cells as f64;
        let knots = (0..=cells)
            .map(|i| {
                let x = window.start + spacing * i as f64;
                let (r, w) = (f(i, x), window.at(x));
                [
                    r[0] * w[0],
                    r[1] * w[0] + r[0] * w[1],
                    r[2] * w[0] + 2.0 * r[1] * w[1] + r[0] * w[2],
                ]
            })
            .collect();
        Self { start: window.start, spacing, knots }
    }

    /// The mean over a pole of length `pole` (m) as a function of the pole's centre,
    ///
    /// r̄(x) = 1/ℓ·∫ r dx from x − ℓ/2 to x + ℓ/2, r̄′ = (r(x + ℓ/2) − r(x − ℓ/2))/ℓ,
    ///
    /// and so r̄″ from r′: exact at the knots, whatever the length of pole and waves. The discrete
    /// forces of the pole would not do: eight of them feel half of a wave of 0.1 m, of which a pole of
    /// 0.65 m feels a twentieth.
    pub(crate) fn averaged(self, pole: f64) -> Result<Self, Error> {
        if pole < SHORTEST_POLE * self.spacing {
            return Ok(self);
        }
        let (start, end) = self.range();
        let cells = ((end - start + pole) / self.spacing).ceil();
        if cells > MAX_KNOTS {
            return Err(too_long(cells));
        }
        let start = start - 0.5 * pole;
        let areas = self.areas();
        let knots = (0..=cells as usize)
            .map(|i| {
                let x = start + self.spacing * i as f64;
                let (rear, front) = (x - 0.5 * pole, x + 0.5 * pole);
                let area = self.area(&areas, front) - self.area(&areas, rear);
                let (a, b) = (self.at(rear), self.at(front));
                [area / pole, (b[0] - a[0]) / pole, (b[1] - a[1]) / pole]
            })
            .collect();
        Ok(Self { start, spacing: self.spacing, knots })
    }

    /// ∫ r dx (m²) from the start of the profile to each knot.
    fn areas(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let cells = self.knots.windows(2).map(|cell| {
            sum += quintic_area(cell[0], cell[1], 1.0, self.spacing);
            sum
        });
        std::iter::once(0.0).chain(cells).collect()
    }

    /// ∫ r dx (m²) from the start of the profile to x, with what [`areas`](Self::areas) gave.
    fn area(&self, areas: &[f64], x: f64) -> f64 {
        let s = ((x - self.start) / self.spacing).clamp(0.0, (areas.len() - 1) as f64);
        let i = (s as usize).min(areas.len() - 2);
        areas[i] + quintic_area(self.knots[i], self.knots[i + 1], s - i as f64, self.spacing)
    }
}

/// Coefficients of the quintic Hermite polynomial through `[r, r′, r″]` at both ends of a cell of
/// width d, in powers of s = x/d, 0 ≤ s ≤ 1.
fn coefficients(a: [f64; 3], b: [f64; 3], d: f64) -> [f64; 6] {
    // p = a0 + v0·s + c0/2·s² + s³(α + β·s + γ·s²), with the cubic's gaps at s = 1.
    let (v0, c0, v1, c1) = (a[1] * d, a[2] * d * d, b[1] * d, b[2] * d * d);
    let gap = b[0] - a[0] - v0 - 0.5 * c0;
    let slope_gap = v1 - v0 - c0;
    let curvature_gap = c1 - c0;
    let alpha = 10.0 * gap - 4.0 * slope_gap + 0.5 * curvature_gap;
    let beta = -15.0 * gap + 7.0 * slope_gap - curvature_gap;
    let gamma = 6.0 * gap - 3.0 * slope_gap + 0.5 * curvature_gap;
    [a[0], v0, 0.5 * c0, alpha, beta, gamma]
}

/// Value and derivatives of the cell's polynomial at s.
fn quintic(a: [f64; 3], b: [f64; 3], s: f64, d: f64) -> [f64; 3] {
    let [a0, v0, half_c0, alpha, beta, gamma] = coefficients(a, b, d);
    let c0 = 2.0 * half_c0;
    let value = a0 + s * (v0 + s * (half_c0 + s * (alpha + s * (beta + s * gamma))));
    let slope = v0 + s * (c0 + s * (3.0 * alpha + s * (4.0 * beta + s * 5.0 * gamma)));
    let curvature = c0 + s * (6.0 * alpha + s * (12.0 * beta + s * 20.0 * gamma));
    [value, slope / d, curvature / (d * d)]
}

/// Integral of the cell's polynomial over x from its start to s.
fn quintic_area(a: [f64; 3], b: [f64; 3], s: f64, d: f64) -> f64 {
    let p = coefficients(a, b, d);
    let terms = (0..6).rev().fold(0.0, |sum, k| s * (p[k] / (k + 1) as f64 + sum));
    d * terms
}

/// Where the profile lives, with its fades.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FadeWindow {
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) fade: f64,
}

impl FadeWindow {
    /// Weight and its derivatives: 0 at the ends, 1 inside, in between 6t⁵ − 15t⁴ + 10t³, whose
    /// first and second derivatives vanish at both ends: no jump in gap, gap rate or acceleration.
    fn at(&self, x: f64) -> [f64; 3] {
        let (from, to) = (x - self.start, self.end - x);
        let (t, sign) = if from <= to { (from, 1.0) } else { (to, -1.0) };
        let t = (t / self.fade).clamp(0.0, 1.0);
        let rest = t * (1.0 - t);
        [
            t * t * t * (10.0 + t * (6.0 * t - 15.0)),
            sign * 30.0 * rest * rest / self.fade,
            60.0 * rest * (1.0 - 2.0 * t) / (self.fade * self.fade),
        ]
    }

    fn cells(&self, spacing: f64) -> Result<usize, Error> {
        let length = self.end - self.start;
        // False for NaN as well.
        let long_enough = length >= 2.0 * self.fade && length.is_finite();
        if !long_enough {
            return Err(Error::invalid(
                "irregularity.end",
                format!(
                    "profile from {} m to {} m, fades of {} m",
                    self.start, self.end, self.fade
                ),
                "make it at least two fade lengths long",
            ));
        }
        let cells = (length / spacing).ceil();
        if cells > MAX_KNOTS {
            return Err(too_long(cells));
        }
        Ok(cells as usize)
    }
}

fn too_long(cells: f64) -> Error {
    Error::invalid(
        "irregularity",
        format!("{cells:.3e} table points"),
        format!("shorten the profile or lengthen its shortest wave (limit {MAX_KNOTS:.0e} points)"),
    )
}

fn check(given: &IrregularityDescription) -> Result<(), Error> {
    let fail = |name: &str, found: String, remedy: &str| {
        Err(Error::invalid(format!("irregularity.{name}"), found, remedy))
    };
    if !(given.fade_length > 0.0 && given.fade_length.is_finite()) {
        return fail("fade_length", format!("{} m", given.fade_length), "give a positive length");
    }
    if given.file.is_some() {
        return Ok(());
    }
    if !(given.amplitude >= 0.0 && given.amplitude.is_finite()) {
        return fail("amplitude", format!("{}", given.amplitude), "give a finite A of at least 0");
    }
    let waves = (given.shortest_wave, given.longest_wave);
    if !(waves.0 > 0.0 && waves.0 < waves.1 && waves.1.is_finite()) {
        return fail(
            "shortest_wave",
            format!("waves from {} m to {} m", waves.0, waves.1),
            "give 0 < shortest < longest",
        );
    }
    if !(1..=100_000).contains(&given.lines) {
        return fail("lines", format!("{} harmonics", given.lines), "give 1 to 100000");
    }
    Ok(())
}

/// Sum of harmonics with S(Ω) = A/Ω² and random phases.
///
/// The band is divided into bands of equal ratio; each gives one harmonic at its geometric mean Ωₖ
/// with amplitude √(2·S(Ωₖ)·ΔΩₖ). With 1/Ω² that is exactly the band's variance. Equal ratios
/// resolve the long waves, and make the wavenumbers incommensurable, so that the profile does not
/// repeat. Source: Shinozuka & Deodatis, *Appl. Mech. Rev.* 44 (1991) 191.
fn harmonics(given: &IrregularityDescription) -> Vec<Harmonic> {
    let (low, high) = (TAU / given.longest_wave, TAU / given.shortest_wave);
    let ratio = libm::pow(high / low, 1.0 / given.lines as f64);
    // The generator's stream is fixed by its specification; the conversion to [0, 1) is defined
    // here.
    let mut random = ChaCha8Rng::seed_from_u64(given.seed);
    let mut edge = low;
    (1..=given.lines)
        .map(|k| {
            let next = low * libm::pow(ratio, k as f64);
            let wavenumber = (edge * next).sqrt();
            let density = given.amplitude / (wavenumber * wavenumber);
            let amplitude = (2.0 * density * (next - edge)).sqrt();
            let uniform = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            edge = next;
            Harmonic { amplitude, wavenumber, phase: TAU * uniform }
        })
        .collect()
}

fn random(given: &IrregularityDescription, window: FadeWindow) -> Result<Profile, Error> {
    let cells = window.cells(given.shortest_wave / KNOTS_PER_WAVE)?;
    let spacing = (window.end - window.start) / cells as f64;
    let sums = harmonics::tabulate(&harmonics(given), window.start, spacing, cells);
    Ok(Profile::tabulate(window, cells, |i, _| sums[i]))
}

/// A file's profile within the window and its own range, whichever is narrower.
fn from_spline(spline: &Spline, window: FadeWindow) -> Result<Profile, Error> {
    let (first, last) = spline.range();
    let window =
        FadeWindow { start: window.start.max(first), end: window.end.min(last), fade: window.fade };
    let cells = window.cells(spline.finest_spacing() / 4.0)?;
    Ok(Profile::tabulate(window, cells, |_, x| spline.at(x)))
}

/// Reads two columns x, z (m) of the file `name`, separated by comma, semicolon, tab or blanks. Empty lines, lines
/// that begin with `#` and one heading line before the numbers are skipped.
pub(crate) fn parse(text: &str, name: &str) -> Result<Spline, Error> {
    let (mut xs, mut zs) = (Vec::new(), Vec::new());
    let mut heading_allowed = true;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let numbers: Option<Vec<f64>> = line
            .split([',', ';', '\t', ' '])
            .filter(|field| !field.is_empty())
            .map(|field| field.parse::<f64>().ok().filter(|v| v.is_finite()))
            .collect();
        match numbers.as_deref() {
            Some(&[x, z]) if xs.last().is_none_or(|&last| x > last) => {
                xs.push(x);
                zs.push(z);
            }
            None if heading_allowed => {}
            _ => return Err(Error::ProfileLine { line: index + 1, found: format!("`{line}`") }),
        }
        heading_allowed = false;
    }
    Spline::new(&xs, &zs, name)
}

#[cfg(test)]
#[path = "irregularity_tests.rs"]
mod tests;
