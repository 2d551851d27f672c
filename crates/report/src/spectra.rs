//! Amplitude spectra and power spectral densities of the recorded signals, reduced without losing peaks, and
//! their highest peaks.

use analysis::Error;
use analysis::series::rate;
use analysis::spectrum::{Peak, PeakSearch, Spectrum, Welch, Window, amplitude, peaks, welch};
use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};

/// Lowest bins, which are kept individually.
const SINGLE: usize = 1600;
/// Slices of equal frequency ratio above these bins.
const SLICES: usize = 500;
/// A density is the mean over 7 segments of a quarter of the record that overlap by half.
const PIECES: usize = 4;
/// Most peaks in a list.
const PEAKS: usize = 6;
/// Factor by which the amplitude of a peak exceeds the valleys beside it: 6 dB.
const PROMINENCE: f64 = 2.0;
/// Lowest amplitude in the list, as a fraction of the highest. The slow deflection under a passing train
/// is far higher than the resonances of a girder.
const FLOOR: f64 = 1e-6;

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
    pub fn new(times: &[f64], values: &[f64], resonances: Option<f64>) -> Result<Self, Error> {
        let rate = rate(times)?;
        let amplitude = amplitude(values, rate, Window::Hann)?;
        let segment = (values.len() / PIECES).max(analysis::series::FEWEST);
        let density = welch(values, rate, &Welch::of_segment(segment))?;
        let amplitude_peaks = highest(&amplitude, 1, resonances);
        let density_peaks = highest(&density, 2, resonances);
        Ok(Self { amplitude, density, amplitude_peaks, density_peaks })
    }
}

/// Peaks by frequency; `power` is 1 for amplitudes and 2 for densities.
fn highest(spectrum: &Spectrum, power: i32, resonances: Option<f64>) -> Vec<Peak> {
    let search = |from: f64| PeakSearch {
        // the lowest bins contain leakage of the mean
        from: from.max(3.0 * spectrum.resolution),
        count: PEAKS,
        prominence: PROMINENCE.powi(power),
        floor: FLOOR.powi(power),
        ..PeakSearch::default()
    };
    let mut found = peaks(spectrum, &search(0.0));
    found.extend(resonances.into_iter().flat_map(|from| peaks(spectrum, &search(from))));
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
    pub fn embed(&mut self, it: &ComputedSpectra, arrays: &mut Arrays) -> Spectra {
        let mut curve = |spectrum: &Spectrum, peaks: &[Peak]| {
            let (frequencies, values) = reduce(spectrum);
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

/// Reduces a spectrum: keeps the low bins except the first, which a logarithmic axis cannot show, and the
/// largest value in each slice of higher bins, at the middle of the slice.
fn reduce(spectrum: &Spectrum) -> (Vec<f64>, Vec<f64>) {
    let count = spectrum.values.len();
    let mut reduced = (Vec::new(), Vec::new());
    let mut first = 1;
    while first < count {
        let end = slice_end(first, count);
        let values = &spectrum.values[first..end];
        let middle = 0.5 * (spectrum.frequency(first) + spectrum.frequency(end - 1));
        reduced.0.push(middle);
        reduced.1.push(values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        first = end;
    }
    reduced
}

/// End of the slice that begins with this bin.
fn slice_end(first: usize, count: usize) -> usize {
    if first < SINGLE {
        return first + 1;
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let ratio = (count as f64 / SINGLE as f64).powf(1.0 / SLICES as f64);
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive and far below 2^53"
    )]
    let end = (first as f64 * ratio).ceil() as usize;
    end.clamp(first + 1, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

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
        let it = ComputedSpectra::new(&times, &values, None).unwrap();
        let (frequencies, values) = reduce(&it.amplitude);
        assert!(frequencies.len() <= SINGLE + SLICES && frequencies[0] > 0.0);
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
        let all = ComputedSpectra::new(&times, &sines().1, Some(100.0)).unwrap();
        assert_eq!(all.amplitude_peaks, it.amplitude_peaks);
    }

    #[test]
    fn invariant_signals_of_one_table_share_their_frequencies() {
        let (times, values) = sines();
        let (mut frequencies, mut arrays) = (Frequencies::default(), Arrays::default());
        let it = ComputedSpectra::new(&times, &values, None).unwrap();
        let (a, b) = (frequencies.embed(&it, &mut arrays), frequencies.embed(&it, &mut arrays));
        assert_eq!(a.amplitude.frequencies, b.amplitude.frequencies);
        assert_eq!(frequencies.list.len(), 2);
    }

    #[test]
    fn issue_signals_without_a_spectrum_have_a_reason() {
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        let broken = vec![f64::INFINITY; 100];
        assert!(
            ComputedSpectra::new(&times, &broken, None).unwrap_err().to_string().contains("finite")
        );
        assert!(
            ComputedSpectra::new(&[0.0], &[1.0], None).unwrap_err().to_string().contains("samples")
        );
    }
}
