//! The irregularity at a magnet over its position on the track, and its power spectral density compared with
//! the target A/Ω².

use std::f64::consts::TAU;

use analysis::spectrum::{Welch, welch};
use results::RunResults;
use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};
use crate::knowledge::{GuidewayFacts, TargetDensity};
use crate::names;

/// Distance between points of the profile (m): a tenth of the usual shortest wave of 0.5 m.
const GRID: f64 = 0.05;
/// The density is a mean over segments of a third of the profile that overlap by half.
const PIECES: usize = 3;
/// Shortest profile (m) that has a density.
const SHORTEST: f64 = 10.0;

/// The profile and its density in the page.
#[derive(Debug, Serialize)]
pub struct RecordedIrregularity {
    signal: String,
    /// Position of the first point and distance between points (m).
    start: f64,
    step: f64,
    heights: ArrayRef,
    /// Wavenumbers Ω (rad/m) and one-sided density (m²/(rad/m)).
    wavenumbers: ArrayRef,
    densities: ArrayRef,
    target: Option<TargetDensity>,
}

impl RecordedIrregularity {
    /// Uses the first recorded irregularity whose magnet moves and has a recorded position.
    pub fn of(
        run: &RunResults,
        guideway: Option<&GuidewayFacts>,
        arrays: &mut Arrays,
    ) -> Option<Self> {
        let (signal, places, heights) = run.table.names.iter().find_map(|signal| {
            let (row, number) = signal.split_once('.')?.1.rsplit_once('_')?;
            if row != names::IRREGULARITY {
                return None;
            }
            let places = position(run, number)?;
            Some((signal.clone(), places, run.table.column(signal)?))
        })?;
        let (start, heights) = over_track(places, heights)?;
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        if GRID * (heights.len() as f64) < SHORTEST {
            return None;
        }
        let (wavenumbers, densities) = density(&heights)?;
        Some(Self {
            signal,
            start,
            step: GRID,
            heights: arrays.f32(&heights),
            wavenumbers: arrays.f32(&wavenumbers),
            densities: arrays.f32(&densities),
            target: guideway.and_then(|it| it.irregularity),
        })
    }
}

/// The recorded position of a magnet by its number.
fn position<'a>(run: &'a RunResults, number: &str) -> Option<&'a [f64]> {
    let ending = format!(".{}_{number}", names::POSITION);
    let name = run.table.names.iter().find(|name| name.ends_with(&ending))?;
    run.table.column(name)
}

/// Heights at equal distances, interpolated between the positions of a magnet that moves forward.
fn over_track(places: &[f64], heights: &[f64]) -> Option<(f64, Vec<f64>)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (&place, &height) in places.iter().zip(heights) {
        let further = points.last().is_none_or(|(last, _)| place > *last);
        if further && height.is_finite() {
            points.push((place, height));
        }
    }
    let (&(start, _), &(end, _)) = (points.first()?, points.last()?);
    let mut result = Vec::new();
    let mut next = 1;
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    while let place = start + result.len() as f64 * GRID
        && place < end
    {
        while points[next].0 < place {
            next += 1;
        }
        let ((x0, y0), (x1, y1)) = (points[next - 1], points[next]);
        result.push(y0 + (y1 - y0) * (place - x0) / (x1 - x0));
    }
    Some((start, result))
}

/// Wavenumbers Ω = 2πn (rad/m) and the one-sided density S(Ω) = G(n)/2π, where n is in cycles per metre.
fn density(heights: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let settings = Welch::of_segment(heights.len() / PIECES);
    let spectrum = welch(heights, 1.0 / GRID, &settings).ok()?;
    let bins = 1..spectrum.values.len();
    let wavenumbers = bins.clone().map(|k| TAU * spectrum.frequency(k));
    let densities = bins.map(|k| spectrum.values[k] / TAU);
    Some((wavenumbers.collect(), densities.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_profile_is_found_again_at_any_speed() {
        // stands, then moves faster and faster: x = t²
        let times: Vec<f64> = (0..2000).map(|k| f64::from(k) * 0.01 - 5.0).collect();
        let places: Vec<f64> = times.iter().map(|t| 3.0 + t.max(0.0) * t).collect();
        let heights: Vec<f64> = places.iter().map(|x| (0.3 * x).sin()).collect();
        let (start, profile) = over_track(&places, &heights).unwrap();
        assert_eq!(start, 3.0);
        for (k, height) in profile.iter().enumerate() {
            let place = start + k as f64 * GRID;
            // chords of up to 0.3 m: 0.3²·0.3²/8
            assert!((height - (0.3 * place).sin()).abs() < 1.1e-3, "{place}: {height}");
        }
        assert!(over_track(&[1.0, 1.0], &[0.0, 0.0]).unwrap().1.is_empty());
        assert!(over_track(&[], &[]).is_none());
    }

    /// A wave of amplitude a and wavenumber Ω: the density's integral over Ω is a²/2.
    #[test]
    fn analytic_the_density_integrates_to_the_variance() {
        let heights: Vec<f64> =
            (0..6000).map(|k| 0.002 * (1.7 * f64::from(k) * GRID).sin()).collect();
        let (wavenumbers, densities) = density(&heights).unwrap();
        let step = wavenumbers[1] - wavenumbers[0];
        let variance = densities.iter().sum::<f64>() * step;
        assert!((variance / 2e-6 - 1.0).abs() < 1e-3, "{variance}");
        let top = densities.iter().zip(&wavenumbers).max_by(|a, b| a.0.total_cmp(b.0)).unwrap();
        assert!((top.1 - 1.7).abs() < step);
    }
}
