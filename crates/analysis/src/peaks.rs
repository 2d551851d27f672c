//! Peaks of a spectrum: where they are between the bins, and the damping that their width tells.
//!
//! **Frequency and height** are those of the parabola through the logarithms of the highest bin and its two
//! neighbours; through a flat top, the height is the bin's own. Of a sine seen through a Hann window, the
//! frequency is then within 0.02 bins and the height within 4 % (rectangular: 0.17 bins and 28 %, flat top:
//! 0.14 bins and 0.12 %); of a resonance over many bins both are as good as the spectrum.
//!
//! **Damping** is the half-power bandwidth's, ζ = (f₂ - f₁) / (f₂ + f₁), where f₁ and f₂ are the frequencies
//! on both sides at which the power is half the peak's. Between bins they are interpolated as 1/power over
//! (f - f₀)², which is exact for the line 1 / ((f - f₀)² + (ζ f₀)²) of a lightly damped resonance. The
//! method errs by about ζ² relative; neighbouring resonances must be further away than the width.
//!
//! Every window widens a line. A stationary random response seen through a window of half-power width w
//! shows the width m of the resonance's width Δ, which obeys m = αΔ + √((1-α)²Δ² + w²) (the form of
//! Olivero and Longbothum for the Voigt profile, J. Quant. Spectrosc. Radiat. Transfer 17 (1977) 233-236,
//! with α fitted to each window's own autocorrelation; within 1 % of Δ, rectangular 4 %). Densities are
//! corrected by it, and the damping is `None` where m is less than twice w, because the difference would be
//! mostly error: then take longer pieces. Amplitude spectra give a damping only through the rectangular
//! window, where they are those of a decay that begins and ends within the record, if the line is two bins
//! wide or more; a decay that was weighted by another window has lost its width.

use crate::spectrum::{Scale, Spectrum};
use crate::window::Window;

/// The least half-power width that is believed, in half-power widths of the window (densities).
const RESOLVED: f64 = 2.0;
/// The least half-power width that is believed, in bins (amplitudes). A decay with this width ends at
/// e^(-2π), 0.2 %, of where it began.
const RESOLVED_BINS: f64 = 2.0;

/// Which peaks are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakSearch {
    /// Lowest frequency, in Hz. The first and the last bin of a spectrum are never peaks.
    pub from: f64,
    /// Highest frequency, in Hz.
    pub to: f64,
    /// How many times higher than the higher one of the two valleys beside it, in the spectrum's values, a
    /// peak must be. A valley reaches to the next higher value or to the end of the search.
    pub prominence: f64,
    /// How high a peak must be, as a share of the highest value within the search.
    pub floor: f64,
    /// At most so many, the highest first.
    pub count: usize,
}

impl Default for PeakSearch {
    /// Ten peaks anywhere, each twice as high as its valleys and a thousandth of the highest or more.
    fn default() -> Self {
        Self { from: 0.0, to: f64::INFINITY, prominence: 2.0, floor: 1e-3, count: 10 }
    }
}

/// A peak of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Where, in Hz, between the bins.
    pub frequency: f64,
    /// How high, in the spectrum's unit.
    pub value: f64,
    /// Damping ratio from the half-power width, where there is one that can be believed.
    pub damping: Option<f64>,
}

/// The peaks of a spectrum, the highest first.
#[must_use]
pub fn peaks(spectrum: &Spectrum, search: &PeakSearch) -> Vec<Peak> {
    let bins = spectrum.bins(search.from, search.to);
    let values = &spectrum.values[bins.clone()];
    let valleys = valleys(values);
    let lowest = search.floor * values.iter().copied().fold(0.0, f64::max);
    let is_peak = |k: &usize| {
        let (k, value) = (*k, values[*k]);
        let inner = k + bins.start > 0 && k + bins.start + 1 < spectrum.values.len();
        inner
            && spectrum.values[k + bins.start - 1] < value
            && spectrum.values[k + bins.start + 1] <= value
            && value > search.prominence * valleys[k]
            && value >= lowest
    };
    let mut found: Vec<usize> = (0..values.len()).filter(is_peak).collect();
    found.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    found.truncate(search.count);
    found.into_iter().map(|k| peak(spectrum, k + bins.start)).collect()
}

/// For each value, the higher one of the lowest values on the way to the next higher value on either side;
/// the highest has the higher one of the lowest on both sides.
fn valleys(values: &[f64]) -> Vec<f64> {
    let left = lowest_before(values.iter().copied());
    let mut right = lowest_before(values.iter().rev().copied());
    right.reverse();
    left.into_iter().zip(right).map(|(a, b)| a.max(b)).collect()
}

/// For each value, the lowest since the last higher one.
fn lowest_before(values: impl Iterator<Item = f64>) -> Vec<f64> {
    // values that are higher than all after them, each with the lowest since the one before it
    let mut higher: Vec<(f64, f64)> = Vec::new();
    let lowest = |value: f64| {
        let mut lowest = value;
        while let Some((_, low)) = higher.pop_if(|(top, _)| *top <= value) {
            lowest = lowest.min(low);
        }
        higher.push((value, lowest));
        lowest
    };
    values.map(lowest).collect()
}

fn peak(spectrum: &Spectrum, k: usize) -> Peak {
    let [before, top, after] =
        [k - 1, k, k + 1].map(|i| spectrum.values[i].max(f64::MIN_POSITIVE).ln());
    let (offset, height) = vertex(before, top, after);
    let value = match spectrum.window {
        Window::FlatTop => spectrum.values[k],
        Window::Hann | Window::Rectangular => height.exp(),
    };
    Peak {
        frequency: (k as f64 + offset) * spectrum.resolution,
        value,
        damping: damping(spectrum, k),
    }
}

/// Where the parabola through (-1, `before`), (0, `top`), (1, `after`) has its vertex, and its height there.
fn vertex(before: f64, top: f64, after: f64) -> (f64, f64) {
    let curvature = before - 2.0 * top + after;
    if curvature == 0.0 {
        return (0.0, top);
    }
    let offset = 0.5 * (before - after) / curvature;
    (offset, top - 0.25 * (before - after) * offset)
}

/// Damping ratio of the peak at bin `k`, where its half-power points are found and resolved.
fn damping(spectrum: &Spectrum, k: usize) -> Option<f64> {
    let inverse = |i: usize| match spectrum.scale {
        Scale::Density => 1.0 / spectrum.values[i],
        Scale::Amplitude => spectrum.values[i].powi(-2),
    };
    let (offset, least) = vertex(inverse(k - 1), inverse(k), inverse(k + 1));
    let (centre, half) = (k as f64 + offset, 2.0 * least);
    let reaches = |i: &usize| inverse(*i) >= half;
    // DC is no part of a resonance
    let below = (1..k).rev().find(reaches)?;
    let above = (k + 1..spectrum.values.len()).find(reaches)?;
    let crossing = |inside: usize, outside: usize| {
        let square = |i: usize| (i as f64 - centre).powi(2);
        let share = (half - inverse(inside)) / (inverse(outside) - inverse(inside));
        (square(inside) + share * (square(outside) - square(inside))).max(0.0).sqrt()
    };
    let (low, high) = (centre - crossing(below + 1, below), centre + crossing(above - 1, above));
    let width = resonance_width(spectrum, high - low)?;
    Some(width / (high + low)).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
}

/// The width in bins of the resonance that shows `measured` bins of width.
fn resonance_width(spectrum: &Spectrum, measured: f64) -> Option<f64> {
    match (spectrum.scale, spectrum.window) {
        (Scale::Amplitude, Window::Rectangular) => Some(measured).filter(|m| *m >= RESOLVED_BINS),
        (Scale::Amplitude, _) => None,
        (Scale::Density, window) => {
            let own = window.half_power_width();
            let share = window.linear_share();
            // the positive root of (m - αΔ)² = (1-α)²Δ² + w²; of two, the smaller
            let (a, b) = (1.0 - 2.0 * share, measured * share);
            let c = measured * measured - own * own;
            let root = (b * b + a * c).sqrt();
            Some(c / (b + root)).filter(|_| measured >= RESOLVED * own)
        }
    }
}
