//! Spectra of record and run beside each other.

use analysis::Error;
use analysis::compare::coherence;
use analysis::series::rate;
use analysis::spectrum::{PeakSearch, Welch, Window, amplitude, peaks, welch};
use serde::Serialize;

use crate::Interpolated;
use crate::align::spacing;

/// Half-overlapping pieces for the mean of densities and coherence.
const PIECES: usize = 8;
/// Fewest samples of a piece.
const PIECE: usize = 32;

/// Power spectral densities (Welch, Hann window, half-overlapping pieces) of record and run, and their coherence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpectraCompared {
    /// Samples per second; of a record with uneven times, of its median interval.
    pub rate: f64,
    /// Whether the times of the record are uneven, so that both signals were resampled.
    pub resampled: bool,
    /// Distance of two frequencies (Hz).
    pub resolution: f64,
    /// Pieces that the means are taken over; of unrelated signals the coherence is about 1/pieces.
    pub pieces: usize,
    /// Frequency of the highest peak of the record's amplitude spectrum (Hz), if it has one.
    pub peak_measured: Option<f64>,
    /// The same of the run.
    pub peak_run: Option<f64>,
    /// Mean coherence, weighted by the record's density.
    pub mean_coherence: f64,
    /// Density of the record at k · `resolution`, in the signal's unit squared per Hz.
    pub measured: Vec<f64>,
    /// The same of the run.
    pub run: Vec<f64>,
    /// Coherence, from 0 to 1.
    pub coherence: Vec<f64>,
}

impl SpectraCompared {
    /// Of record and run at the same times (s).
    ///
    /// # Errors
    /// Too few samples, or one that is not finite.
    pub(crate) fn new(times: &[f64], measured: &[f64], run: &[f64]) -> Result<Self, Error> {
        let (rate, resampled, measured, run) = match rate(times) {
            Ok(rate) => (rate, false, measured.to_vec(), run.to_vec()),
            Err(Error::Uneven { .. }) => {
                let step = spacing(times);
                let even = |values: &[f64]| {
                    let it = Interpolated::new(times.to_vec(), values.to_vec());
                    let count = ((times[times.len() - 1] - times[0]) / step) as usize + 1;
                    it.map(|it| (0..count).map(|k| it.at(times[0] + k as f64 * step)).collect())
                        .unwrap_or_default()
                };
                (1.0 / step, true, even(measured), even(run))
            }
            Err(error) => return Err(error),
        };
        let needed = PIECE * (PIECES + 1) / 2;
        if measured.len() < needed {
            return Err(Error::TooShort { samples: measured.len(), needed });
        }
        let settings = Welch::of_segment(2 * measured.len() / (PIECES + 1));
        let densities = (welch(&measured, rate, &settings)?, welch(&run, rate, &settings)?);
        let coherence = coherence(&measured, &run, rate, &settings)?;
        let peak = |values: &[f64]| {
            let spectrum = amplitude(values, rate, Window::Hann)?;
            // the lowest bins contain leakage of the mean
            let search =
                PeakSearch { from: 3.0 * spectrum.resolution, count: 1, ..PeakSearch::default() };
            Ok(peaks(&spectrum, &search).first().map(|it| it.frequency))
        };
        let power: f64 = densities.0.values[1..].iter().sum();
        let weighted = coherence.values.iter().zip(&densities.0.values).skip(1).map(|(a, b)| a * b);
        Ok(Self {
            rate,
            resampled,
            resolution: densities.0.resolution,
            pieces: coherence.pieces,
            peak_measured: peak(&measured)?,
            peak_run: peak(&run)?,
            mean_coherence: if power > 0.0 { weighted.sum::<f64>() / power } else { 0.0 },
            measured: densities.0.values,
            run: densities.1.values,
            coherence: coherence.values,
        })
    }

    /// Frequency (Hz) up to which the spectra are worth a look: twice that below which 99.9 % of either power are.
    pub(crate) fn top(&self) -> f64 {
        let edge = |values: &[f64]| {
            let all: f64 = values.iter().skip(1).sum();
            let mut sum = 0.0;
            let mut below = |it: &f64| {
                sum += it;
                sum < 0.999 * all
            };
            2.0 * (1 + values.iter().skip(1).take_while(|it| below(it)).count()) as f64
                * self.resolution
        };
        edge(&self.measured).max(edge(&self.run)).max(10.0 * self.resolution).min(self.rate / 2.0)
    }
}
