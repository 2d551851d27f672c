//! Spectrograms as pictures: power spectral density over time and frequency, in bytes of decibels.

use analysis::Error;
use analysis::series::rate;
use analysis::spectrum::{Detrend, Scale, Welch, spectrogram};
use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};

/// Most columns and rows of a picture.
const COLUMNS: usize = 220;
const ROWS: usize = 150;
/// Number of segments, without overlap, in a signal.
const PIECES: usize = 32;
/// The brightest shade is the largest density from this bin on. Lower bins may exceed it.
const LOWEST: usize = 3;
/// Spectrograms end where densities stay below this fraction of the highest: 40 dB.
const CONTENT: f64 = 1e-4;
/// Difference between the brightest and the darkest shade (dB).
pub const DEPTH: f64 = 80.0;

/// A spectrogram, before it is embedded.
#[derive(Debug, Clone, PartialEq)]
pub struct ComputedSpectrogram {
    /// Times of the middle of the first and the last column (s).
    from: f64,
    to: f64,
    /// Upper end of the top row (Hz). The lowest row begins at 0.
    top: f64,
    rows: usize,
    /// Density of the brightest shade (unit²/Hz).
    brightest: f64,
    /// Row by row from the lowest frequency.
    shades: Vec<u8>,
}

/// A spectrogram in the page.
#[derive(Debug, Serialize)]
pub struct EmbeddedSpectrogram {
    from: f64,
    to: f64,
    top: f64,
    rows: usize,
    brightest: f64,
    shades: ArrayRef,
}

impl ComputedSpectrogram {
    /// Computes the spectrogram up to where densities stay [`CONTENT`] below the highest, at least up to the
    /// frequency `reach` (Hz), at most to the Nyquist frequency.
    ///
    /// # Errors
    /// The times are uneven, or the signal is too short or not finite.
    pub fn new(times: &[f64], values: &[f64], reach: f64) -> Result<Self, Error> {
        let (times, values) = analysis::series::without_early_end(times, values);
        let rate = rate(times)?;
        let segment = (values.len() / PIECES).max(analysis::series::FEWEST);
        let step = (values.len().saturating_sub(segment) / COLUMNS).max(1);
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let overlap = (1.0 - step as f64 / segment as f64).max(0.0);
        let settings = Welch { overlap, detrend: Detrend::Linear, ..Welch::of_segment(segment) };
        let it = spectrogram(values, rate, &settings, Scale::Density)?;
        let all = it.slices[0].len();
        let lowest = LOWEST.min(all - 1);
        let highest: Vec<f64> = (0..all)
            .map(|bin| it.slices.iter().map(|slice| slice[bin]).fold(0.0, f64::max))
            .collect();
        let floor = CONTENT * highest[lowest..].iter().copied().fold(0.0, f64::max);
        let content = highest.iter().rposition(|value| *value > floor).unwrap_or(0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive")]
        let reach = (reach / it.resolution).ceil() as usize;
        let bins = all.min((content + content / 5).max(reach).saturating_add(1)).max(2);
        let rows = bins.min(ROWS);
        // slow changes, such as a passing train, have far higher densities than everything else
        let first = LOWEST.min(bins - 1);
        let brightest = it.slices.iter().flat_map(|slice| &slice[first..bins]);
        let brightest = brightest.copied().fold(0.0, f64::max);
        let mut shades = Vec::with_capacity(rows * it.slices.len());
        for row in 0..rows {
            let part = row * bins / rows..(row + 1) * bins / rows;
            shades.extend(it.slices.iter().map(|slice| {
                shade(slice[part.clone()].iter().copied().fold(0.0, f64::max), brightest)
            }));
        }
        let start = times[0] + it.start;
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let (last, end) = ((it.slices.len() - 1) as f64, bins as f64);
        Ok(Self {
            from: start,
            to: start + last * it.step,
            top: (end - 0.5) * it.resolution,
            rows,
            brightest,
            shades,
        })
    }

    /// Size in bytes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.shades.len()
    }

    /// Embeds the spectrogram.
    pub fn embed(&self, arrays: &mut Arrays) -> EmbeddedSpectrogram {
        let Self { from, to, top, rows, brightest, .. } = *self;
        EmbeddedSpectrogram { from, to, top, rows, brightest, shades: arrays.u8(&self.shades) }
    }
}

/// A density as a shade: 255 for the brightest, 0 for `DEPTH` decibels below it and less.
fn shade(density: f64, brightest: f64) -> u8 {
    if brightest <= 0.0 {
        return 0;
    }
    let below = 10.0 * (density / brightest).log10();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255")]
    let shade = (255.0 * (1.0 + below / DEPTH)).round().clamp(0.0, 255.0) as u8;
    shade
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// In each column of a chirp sin(π t²), the brightest row is at the frequency t.
    #[test]
    fn analytic_a_chirp_is_a_line() {
        let times: Vec<f64> = (0..40_000).map(|k| f64::from(k) * 1e-3).collect();
        let values: Vec<f64> = times.iter().map(|t| (PI * t * t).sin()).collect();
        let it = ComputedSpectrogram::new(&times, &values, 60.0).unwrap();
        let columns = it.shades.len() / it.rows;
        let height = it.top / it.rows as f64;
        for column in (columns / 10)..(columns * 9 / 10) {
            let time = it.from + (it.to - it.from) * column as f64 / (columns - 1) as f64;
            let brightest = (0..it.rows).max_by_key(|row| it.shades[row * columns + column]);
            let frequency = (brightest.unwrap() as f64 + 0.5) * height;
            // within a row and the resolution of a piece of 1.25 s
            assert!((frequency - time).abs() < height + 0.8, "{time}: {frequency}");
        }
    }

    #[test]
    fn analytic_shades_are_decibels() {
        assert_eq!((shade(1.0, 1.0), shade(1e-8, 1.0), shade(0.0, 1.0)), (255, 0, 0));
        // 40 dB below: half of the depth
        assert_eq!(shade(1e-4, 1.0), 128);
        assert_eq!(shade(0.0, 0.0), 0);
    }

    #[test]
    fn issue_the_frequency_limit_follows_the_content() {
        let times: Vec<f64> = (0..40_000).map(|k| f64::from(k) * 1e-3).collect();
        let values: Vec<f64> = times.iter().map(|t| (40.0 * PI * t).sin()).collect();
        let top = |reach: f64| ComputedSpectrogram::new(&times, &values, reach).unwrap().top;
        // a line at 20 Hz, which the Hann window of 1.25 s widens
        assert!((20.0..60.0).contains(&top(0.0)), "{}", top(0.0));
        assert!((100.0..102.0).contains(&top(100.0)) && top(1e6) > 499.0);
    }

    #[test]
    fn issue_short_and_constant_signals_have_a_picture() {
        let times: Vec<f64> = (0..10).map(f64::from).collect();
        let it = ComputedSpectrogram::new(&times, &[1.0; 10], f64::INFINITY).unwrap();
        // up to Nyquist's frequency, 5 bins of pieces of 8 samples
        assert!(it.shades.iter().all(|&shade| shade == 0) && it.rows == 5);
    }
}
