//! Amplitude spectra and power spectral densities of the recorded signals, reduced without losing peaks, and
//! their highest peaks.

use analysis::Error;
use analysis::series::rate;
use analysis::spectrum::{Peak, PeakSearch, Spectrum, Welch, Window, amplitude, peaks, welch};
use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};

/// A density is the mean over 7 segments of a quarter of the record that overlap by half.
const PIECES: usize = 4;
/// Most peaks in a list.
const PEAKS: usize = 6;
/// Factor by which the amplitude of a peak exceeds the valleys beside it: 6 dB.
const PROMINENCE: f64 = 2.0;
/// Lowest amplitude in the list, as a fraction of half the range of the signal.
const FLOOR: f64 = 1e-3;
/// Lowest amplitude in the list, as a fraction of the largest value of the signal. Without excitation the
/// amplitudes of a gap are far below it.
const NOISE: f64 = 1e-5;
/// Lowest amplitude in the list of signals in m: a tenth of a micrometre.
const PERCEPTIBLE: f64 = 1e-7;
/// Width in bins of the noise that a Hann window collects: the density of a sine of amplitude A is A²/2 over it.
const HANN_WIDTH: f64 = 1.5;

/// Spectra of one signal, before they are embedded.
#[derive(Debug, Clone)]
pub struct ComputedSpectra {
    amplitude: Spectrum,
    density: Spectrum,
    amplitude_peaks: Vec<Peak>,
    density_peaks: Vec<Peak>,
}

/// Spectra of one signal in the page.
#[derive(Debug, Serialize)]
pub struct Spectra {
    amplitude: SpectrumCurve,
    density: SpectrumCurve,
}

/// One spectrum.
#[derive(Debug, Serialize)]
struct SpectrumCurve {
    /// Distance between bins (Hz).
    resolution: f64,
    /// Index of its frequencies among those of the run.
    frequencies: usize,
    values: ArrayRef,
    peaks: Vec<SpectrumPeak>,
}

/// A peak in the page.
#[derive(Debug, Serialize)]
struct SpectrumPeak {
    frequency: f64,
    value: f64,
    damping: Option<f64>,
}

impl ComputedSpectra {
    /// Computes the spectra with their highest peaks, and in addition the highest peaks above the frequency
    /// `resonances` (Hz), which the slow deflection under a passing train would hide.
    ///
    /// # Errors
    /// The times are uneven, or the signal is too short or not finite.
    pub fn new(
        times: &[f64],
        values: &[f64],
        unit: Option<&str>,
        resonances: Option<f64>,
    ) -> Result<Self, Error> {
        let (times, values) = analysis::series::without_early_end(times, values);
        let rate = rate(times)?;
        let amplitude = amplitude(values, rate, Window::Hann)?;
        let segment = (values.len() / PIECES).max(analysis::series::FEWEST);
        let density = welch(values, rate, &Welch::of_segment(segment))?;
        let least = visible(values, unit);
        let amplitude_peaks = highest(&amplitude, 1, least, resonances);
        let least = least * least / (2.0 * HANN_WIDTH * density.resolution);
        let density_peaks = highest(&density, 2, least, resonances);
        Ok(Self { amplitude, density, amplitude_peaks, density_peaks })
    }
}

/// The smallest amplitude in a signal that is worth listing.
fn visible(values: &[f64], unit: Option<&str>) -> f64 {
    let perceptible = if unit == Some("m") { PERCEPTIBLE } else { 0.0 };
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (FLOOR * 0.5 * (high - low)).max(NOISE * high.abs().max(low.abs())).max(perceptible)
}

/// Peaks from `least` on, by frequency; `power` is 1 for amplitudes and 2 for densities.
fn highest(spectrum: &Spectrum, power: i32, least: f64, resonances: Option<f64>) -> Vec<Peak> {
    // the lowest bins contain leakage of the mean
    let lowest = 3.0 * spectrum.resolution;
    let search = |from: f64| PeakSearch {
        from: from.max(lowest),
        count: PEAKS,
        prominence: PROMINENCE.powi(power),
        floor: 0.0,
        ..PeakSearch::default()
    };
    let mut found = peaks(spectrum, &search(0.0));
    found.extend(resonances.into_iter().flat_map(|from| peaks(spectrum, &search(from))));
    found.retain(|peak| peak.value >= least);
    found.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    found.dedup_by(|a, b| a.frequency == b.frequency);
    found
}

/// Lists of frequencies, without duplicates.
#[derive(Debug, Default, Serialize)]
#[serde(transparent)]
pub struct Frequencies {
    list: Vec<ArrayRef>,
    #[serde(skip)]
    known: Vec<Vec<f64>>,
}

impl Frequencies {
    fn find(&mut self, frequencies: Vec<f64>, arrays: &mut Arrays) -> usize {
        if let Some(index) = self.known.iter().position(|it| *it == frequencies) {
            return index;
        }
        self.list.push(arrays.f32(&frequencies));
        self.known.push(frequencies);
        self.known.len() - 1
    }

    /// Embeds the spectra of one signal.
    pub fn embed(
        &mut self,
        it: &ComputedSpectra,
        thinning: Thinning,
        arrays: &mut Arrays,
    ) -> Spectra {
        let mut curve = |spectrum: &Spectrum, peaks: &[Peak]| {
            let (frequencies, values) = reduce(spectrum, thinning);
            let top = |it: &Peak| SpectrumPeak {
                frequency: it.frequency,
                value: it.value,
                damping: it.damping,
            };
            SpectrumCurve {
                resolution: spectrum.resolution,
                frequencies: self.find(frequencies, arrays),
                values: arrays.f32(&values),
                peaks: peaks.iter().map(top).collect(),
            }
        };
        Spectra {
            amplitude: curve(&it.amplitude, &it.amplitude_peaks),
            density: curve(&it.density, &it.density_peaks),
        }
    }
}

/// How spectra are thinned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thinning {
    /// Frequency up to which spectra are shown first (Hz). Up to there all slices are equally wide.
    pub top: f64,
    /// Most values below it.
    pub below: usize,
    /// Slices of equal frequency ratio above it, with two values each.
    pub slices: usize,
}

/// Reduces a spectrum without its first bin, which a logarithmic axis cannot show: the smallest and the largest value
/// in each slice of neighbouring bins in their order, as they would be seen if all bins were drawn. They are at the
/// first and the middle bin of the slice, so that all signals of a table share their frequencies.
fn reduce(spectrum: &Spectrum, thinning: Thinning) -> (Vec<f64>, Vec<f64>) {
    let count = spectrum.values.len();
    let border = spectrum.bins(0.0, thinning.top).end.clamp(2, count.max(2));
    let even = match border.div_ceil((thinning.below / 2).max(1)) {
        0..=2 => 1,
        bins => bins,
    };
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let ratio = (count as f64 / border as f64).powf(1.0 / thinning.slices as f64);
    let mut reduced = (Vec::new(), Vec::new());
    let mut first = 1;
    while first < count {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive")]
        let end = match first < border {
            true => first + even,
            false => ((first as f64 * ratio).ceil() as usize).max(first + 2),
        };
        let end = end.min(count);
        let values = &spectrum.values[first..end];
        let (mut low, mut high) = (0, 0);
        for (k, value) in values.iter().enumerate() {
            low = if *value < values[low] { k } else { low };
            high = if *value > values[high] { k } else { high };
        }
        let ends = [low.min(high), low.max(high)].map(|k| values[k]);
        let places = [first, usize::midpoint(first, end)].map(|k| spectrum.frequency(k));
        let kept = values.len().min(2);
        reduced.0.extend(&places[..kept]);
        reduced.1.extend(&ends[..kept]);
        first = end;
    }
    reduced
}

impl ComputedSpectra {
    /// Frequency (Hz) above which all amplitudes are below a thousandth of the highest.
    pub(crate) fn content(&self) -> f64 {
        let values = &self.amplitude.values;
        let floor = 1e-3 * values[1..].iter().copied().fold(0.0, f64::max);
        self.amplitude.frequency(values.iter().rposition(|value| *value > floor).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const THINNING: Thinning = Thinning { top: 100.0, below: 1600, slices: 350 };

    fn sines() -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let value = |t: &f64| 8.0 + 0.5 * (TAU * 6.4 * t).sin() + 0.02 * (TAU * 180.3 * t).sin();
        let values = times.iter().map(value).collect();
        (times, values)
    }

    /// Amplitudes read as such after the reduction; 180.3 Hz lies among the slices, on a bin (0.05 Hz).
    #[test]
    fn analytic_reduced_spectra_keep_their_peaks() {
        let (times, values) = sines();
        let it = ComputedSpectra::new(&times, &values, None, None).unwrap();
        let (frequencies, values) = reduce(&it.amplitude, THINNING);
        assert!(frequencies.len() <= 1600 + 2 * 350 + 4 && frequencies[0] > 0.0);
        assert!(frequencies.windows(2).all(|w| w[0] < w[1]));
        let near = |f: f64| {
            let near = frequencies.iter().zip(&values).filter(|(x, _)| (*x - f).abs() < 2.0);
            near.map(|(_, value)| *value).fold(0.0, f64::max)
        };
        assert!((near(6.4) - 0.5).abs() < 1e-6, "{}", near(6.4));
        assert!((near(180.3) - 0.02).abs() < 1e-6, "{}", near(180.3));
        // a Hann window places a sine within 0.02 bins
        assert!((it.amplitude_peaks[0].frequency - 6.4).abs() < 0.02 * 0.05);
        assert_eq!(it.amplitude_peaks.len(), 2);
        // the higher one alone, and with it what is above 100 Hz: each once
        let all = ComputedSpectra::new(&times, &sines().1, None, Some(100.0)).unwrap();
        assert_eq!(all.amplitude_peaks, it.amplitude_peaks);
    }

    #[test]
    fn invariant_signals_of_one_table_share_their_frequencies() {
        let (times, values) = sines();
        let (mut frequencies, mut arrays) = (Frequencies::default(), Arrays::default());
        let it = ComputedSpectra::new(&times, &values, None, None).unwrap();
        let (a, b) = (
            frequencies.embed(&it, THINNING, &mut arrays),
            frequencies.embed(&it, THINNING, &mut arrays),
        );
        assert_eq!(a.amplitude.frequencies, b.amplitude.frequencies);
        assert_eq!(frequencies.list.len(), 2);
    }

    /// Below the border a spectrum is whole or evenly thinned, and noise has about the same range of values on both
    /// sides of it.
    #[test]
    fn issue_a_thinned_spectrum_keeps_its_character() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let values: Vec<f64> = (0..200_000).map(|_| noise()).collect();
        let times: Vec<f64> = (0..values.len()).map(|k| k as f64 * 1e-3).collect();
        let it = ComputedSpectra::new(&times, &values, None, None).unwrap();
        let (whole, _) = reduce(&it.amplitude, Thinning { top: 7.9, ..THINNING });
        let step = it.amplitude.resolution;
        assert!(whole[..1500].windows(2).all(|w| (w[1] - w[0] - step).abs() < 1e-9));
        let (even, _) = reduce(&it.amplitude, Thinning { top: 400.0, ..THINNING });
        let width = even[2] - even[0];
        assert!(even[..1500].windows(3).all(|w| (w[2] - w[0] - width).abs() < 1e-9));
        let (frequencies, values) = reduce(&it.amplitude, Thinning { top: 7.9, ..THINNING });
        assert!(frequencies.windows(2).all(|w| w[0] < w[1]));
        let mean = |list: &[f64]| list.iter().map(|it| it.ln()).sum::<f64>() / list.len() as f64;
        // largest values alone would be e^1.5 times higher; smallest ones pull the mean of logarithms down
        let (single, thinned) = (mean(&values[..1500]), mean(&values[1700..]));
        assert!((thinned - single).abs() < 1.3, "{single} {thinned}");
        let above = |list: &[f64]| {
            list.iter().filter(|it| it.ln() > single).count() as f64 / list.len() as f64
        };
        // as many values above the middle as below, within a fifth
        assert!((above(&values[1700..]) - 0.5).abs() < 0.2, "{}", above(&values[1700..]));
    }

    /// A girder that a train deflects by 3.5 mm, with a resonance of 0.01 mm and a line of 1e-5 mm: the latter is
    /// no peak to list. Nor is anything in a gap that changes by 1e-8 of itself.
    #[test]
    fn issue_peaks_of_a_hundredth_of_a_micrometre_are_not_listed() {
        let times: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let deflection = |t: &f64| {
            let under_train = -3.5e-3 * (-((t - 10.0) / 2.0).powi(2)).exp();
            under_train + 1e-5 * (TAU * 6.4 * t).sin() + 1e-8 * (TAU * 70.3 * t).sin()
        };
        let values: Vec<f64> = times.iter().map(deflection).collect();
        let it = ComputedSpectra::new(&times, &values, None, Some(4.0)).unwrap();
        for peaks in [&it.amplitude_peaks, &it.density_peaks] {
            assert!(peaks.iter().any(|it| (it.frequency - 6.4).abs() < 0.05), "{peaks:?}");
            assert!(peaks.iter().all(|it| (it.frequency - 70.3).abs() > 1.0), "{peaks:?}");
        }
        // a resonance of 0.04 micrometres of a deflection of 0.03 mm
        let small: Vec<f64> = values.iter().map(|it| 4e-3 * it).collect();
        let it = ComputedSpectra::new(&times, &small, Some("m"), Some(4.0)).unwrap();
        assert!(it.amplitude_peaks.is_empty() && it.density_peaks.is_empty());
        let gap: Vec<f64> = times.iter().map(|t| 8e-3 + 8e-11 * (TAU * 6.4 * t).sin()).collect();
        let it = ComputedSpectra::new(&times, &gap, None, None).unwrap();
        assert!(it.amplitude_peaks.is_empty() && it.density_peaks.is_empty());
    }

    #[test]
    fn issue_signals_without_a_spectrum_have_a_reason() {
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        let broken = vec![f64::INFINITY; 100];
        assert!(
            ComputedSpectra::new(&times, &broken, None, None)
                .unwrap_err()
                .to_string()
                .contains("finite")
        );
        assert!(
            ComputedSpectra::new(&[0.0], &[1.0], None, None)
                .unwrap_err()
                .to_string()
                .contains("samples")
        );
    }
}
