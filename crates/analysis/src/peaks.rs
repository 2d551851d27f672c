//! Peaks of a spectrum: their frequency between the bins, and the damping from their width.
//!
//! **Frequency and height** are those of the parabola through the logarithms of the highest bin and
//! its two neighbours; through a flat top, the height is the bin's own. Of a sine seen through a
//! Hann window, the frequency is then within 0.02 bins and the height within 4 % (rectangular: 0.17
//! bins and 28 %, flat top: 0.14 bins and 0.12 %); of a resonance over many bins both are as
//! accurate as the spectrum.
//!
//! **Damping** is the half-power bandwidth's, ζ = Δ / 2f₀. The line's half-power points are those
//! of the curve 1/P = a + b f + c f², which is that of a lightly damped resonance, P ~ 1 / ((f -
//! f₀)² + (Δ/2)²): fitted to the bins from f₀ - m to f₀ + m, with m the half-power width that it
//! shows itself, weighted by P, so that bins with the same relative uncertainty have the same
//! weight. In a spectrum without noise that is the classical bandwidth; with noise, using the first
//! bins below half power instead would make the damping too small. It errs by about ζ² relative;
//! neighbouring resonances must be further away than m.
//!
//! Every window widens a line. A stationary random response seen through a window of half-power
//! width w shows the width m of a resonance of width Δ as m² = Δ² + β w², with β = 1.12 (Hann) and
//! 0.8 (flat top), and m = Δ + 0.39 w (rectangular), fitted to each window's own autocorrelation
//! times e^(-πΔτ); within 1 % of Δ. Densities are corrected by it, and the damping is `None` if m
//! is less than twice w, because the difference would be mostly error: longer pieces help.
//! Amplitude spectra give a damping only through the rectangular window, where they are those of a
//! decay that begins and ends within the record, if the line is two bins wide or more; with another
//! window the width of a decay is lost.
//!
//! Noise: of n pieces that overlap by half, a bin is uncertain by about 1/√n of itself. With seven
//! pieces, two of three dampings of a random response are within 0.63 to 1.26 of their true value
//! (median 0.95); with 180, within 3 %.

use std::ops::RangeInclusive;

use crate::spectrum::{Scale, Spectrum};
use crate::window::Window;

/// Smallest half-power width that is evaluated, in half-power widths of the window (densities).
const RESOLVED: f64 = 2.0;
/// Smallest half-power width that is evaluated, in bins (amplitudes). A decay with this width ends
/// at e^(-2π), 0.2 %, of its initial value.
const RESOLVED_BINS: f64 = 2.0;
/// Number of fits of a line, each to the bins within the width of the previous fit.
const FITS: usize = 3;

/// Criteria for peaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakSearch {
    /// Lowest frequency, in Hz. The first and the last bin of a spectrum are never peaks.
    pub from: f64,
    /// Highest frequency, in Hz.
    pub to: f64,
    /// Smallest ratio of a peak to the higher one of the two valleys beside it, in the spectrum's
    /// values. A valley extends to the next higher value or to the end of the search.
    pub prominence: f64,
    /// Smallest height of a peak, as a fraction of the highest value within the search.
    pub floor: f64,
    /// Largest number of peaks, the highest first.
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
    /// Frequency in Hz, interpolated between the bins.
    pub frequency: f64,
    /// Height in the spectrum's unit.
    pub value: f64,
    /// Damping ratio from the half-power width, if the width is resolved.
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

/// For each value, the higher one of the lowest values on the way to the next higher value on
/// either side; for the highest value, the higher one of the lowest values on both sides.
fn valleys(values: &[f64]) -> Vec<f64> {
    let left = lowest_before(values.iter().copied());
    let mut right = lowest_before(values.iter().rev().copied());
    right.reverse();
    left.into_iter().zip(right).map(|(a, b)| a.max(b)).collect()
}

/// For each value, the lowest since the last higher one.
fn lowest_before(values: impl Iterator<Item = f64>) -> Vec<f64> {
    // values that are higher than all later ones, each with the lowest value since the previous one
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

/// Position and height of the vertex of the parabola through (-1, `before`), (0, `top`), (1,
/// `after`).
fn vertex(before: f64, top: f64, after: f64) -> (f64, f64) {
    let curvature = before - 2.0 * top + after;
    if curvature == 0.0 {
        return (0.0, top);
    }
    let offset = 0.5 * (before - after) / curvature;
    (offset, top - 0.25 * (before - after) * offset)
}

/// Power of a bin.
fn power(spectrum: &Spectrum, k: usize) -> f64 {
    match spectrum.scale {
        Scale::Density => spectrum.values[k],
        Scale::Amplitude => spectrum.values[k].powi(2),
    }
}

/// Damping ratio of the peak at bin `k`, if its half-power points are found and resolved.
fn damping(spectrum: &Spectrum, k: usize) -> Option<f64> {
    let below_half = |i: &usize| power(spectrum, *i) <= 0.5 * power(spectrum, k);
    let last = spectrum.values.len() - 1;
    // DC is not part of a resonance
    let mut bins = (1..k).rev().find(below_half)?..=(k + 1..=last).find(below_half)?;
    let mut fitted = line(spectrum, k, bins)?;
    for _ in 0..FITS {
        let Line { centre, width } = fitted;
        let first = (centre - width).ceil().clamp(1.0, (k - 1).max(1) as f64);
        let end = (centre + width).floor().clamp((k + 1) as f64, last as f64);
        bins = first as usize..=end as usize;
        fitted = line(spectrum, k, bins)?;
    }
    let width = resonance_width(spectrum, fitted.width)?;
    Some(0.5 * width / fitted.centre).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
}

/// A resonance's line: both in bins.
struct Line {
    centre: f64,
    /// half-power width
    width: f64,
}

/// The line whose 1/P = a + b x + c x², x in bins from `k`, fits best: Σ (P (a + b x + c x²) - 1)² is least.
fn line(spectrum: &Spectrum, k: usize, bins: RangeInclusive<usize>) -> Option<Line> {
    let top = power(spectrum, k);
    // half the range as the unit of x, which keeps the equations well conditioned
    let unit = bins.end().abs_diff(*bins.start()).max(1) as f64 / 2.0;
    // moments Σ P² x^n and Σ P x^n
    let (mut squares, mut sums) = ([0.0; 5], [0.0; 3]);
    for i in bins {
        let x = (i as f64 - k as f64) / unit;
        let p = power(spectrum, i) / top;
        let powers = [1.0, x, x * x, x.powi(3), x.powi(4)];
        squares.iter_mut().zip(powers).for_each(|(sum, x)| *sum += p * p * x);
        sums.iter_mut().zip(powers).for_each(|(sum, x)| *sum += p * x);
    }
    let column = |n: usize| [squares[n], squares[n + 1], squares[n + 2]];
    let columns = [column(0), column(1), column(2)];
    // Cramer's rule; the common denominator cancels in the ratios below
    let solved = |n: usize| {
        let mut replaced = columns;
        replaced[n] = sums;
        determinant(replaced)
    };
    let (a, b, c) = (solved(0), solved(1), solved(2));
    let centre = -0.5 * b / c;
    let quarter = a / c - centre * centre;
    let found = quarter > 0.0 && quarter.is_finite();
    found.then(|| Line { centre: k as f64 + unit * centre, width: 2.0 * unit * quarter.sqrt() })
}

/// Determinant of a matrix of three columns.
fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// The width in bins of the resonance that shows `measured` bins of width.
fn resonance_width(spectrum: &Spectrum, measured: f64) -> Option<f64> {
    let own = spectrum.window.half_power_width();
    let square = |share: f64| (measured * measured - share * own * own).sqrt();
    let (least, width) = match (spectrum.scale, spectrum.window) {
        (Scale::Amplitude, Window::Rectangular) => (RESOLVED_BINS, measured),
        (Scale::Amplitude, _) => return None,
        (Scale::Density, Window::Rectangular) => (RESOLVED * own, measured - 0.39 * own),
        (Scale::Density, Window::Hann) => (RESOLVED * own, square(1.12)),
        (Scale::Density, Window::FlatTop) => (RESOLVED * own, square(0.8)),
    };
    (measured >= least).then_some(width)
}
