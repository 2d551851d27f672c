//! One-sided amplitude spectra, power spectral densities by Welch's method, and spectrograms.
//!
//! With N samples x_n at the rate f_s, a window w_n and X_k = Σ w_n x_n e^(-2πikn/N), k = 0 … N/2:
//!
//! - **amplitude**: A_k = c_k |X_k| / Σ w_n, with c_k = 2 but c = 1 at DC and (N even) at Nyquist. A sine
//!   of amplitude 1 on a bin reads 1, and a constant 1 reads 1.
//! - **density**: P_k = c_k |X_k|² / (f_s Σ w_n²), in unit²/Hz. Σ P_k Δf is the mean square of the windowed
//!   signal over that of the window: the variance, for a stationary signal without its mean.
//!
//! Source: P. D. Welch, *The use of fast Fourier transform for the estimation of power spectra*, IEEE
//! Trans. Audio Electroacoust. AU-15 (1967) 70-73; scaling as in G. Heinzel, A. Rüdiger and R. Schilling,
//! *Spectrum and spectral density estimation by the DFT* (2002). The numbers are those of
//! `scipy.signal.welch` and `scipy.signal.spectrogram` (`scaling="density"`) within rounding.

use std::ops::Range;

use crate::error::{Error, require};
use crate::fourier::Transform;
use crate::series::{FEWEST, check_rate, enough};

pub use crate::fourier::Detrend;
pub use crate::peaks::{Peak, PeakSearch, peaks};
pub use crate::window::Window;

/// Meaning of the values of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Amplitudes of sines, in the signal's unit.
    Amplitude,
    /// Power spectral density, in the signal's unit squared per Hz.
    Density,
}

/// A one-sided spectrum: `values[k]` belongs to the frequency k · `resolution`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Distance of two bins, in Hz.
    pub resolution: f64,
    /// One value per bin, from DC to Nyquist.
    pub values: Vec<f64>,
    /// Meaning of the values.
    pub scale: Scale,
    /// The window applied to the samples.
    pub window: Window,
}

impl Spectrum {
    /// The frequency of bin `k`, in Hz.
    #[must_use]
    pub fn frequency(&self, k: usize) -> f64 {
        k as f64 * self.resolution
    }

    /// The bins from `from` to `to` Hz, both included.
    #[must_use]
    pub fn bins(&self, from: f64, to: f64) -> Range<usize> {
        // tolerance of a millionth of a bin, so that the frequency of a bin selects that bin
        let first = (from / self.resolution - 1e-6).ceil().max(0.0) as usize;
        let end = (to / self.resolution + 1e-6).floor().max(-1.0) + 1.0;
        let end = (end as usize).min(self.values.len());
        first.min(end)..end
    }

    /// Mean square of the signal's part from `from` to `to` Hz, of a density: Σ P_k Δf; of
    /// amplitudes, Σ A_k²/2, which is correct only for sines on bins. DC and Nyquist are also
    /// counted as sines.
    #[must_use]
    pub fn mean_square(&self, from: f64, to: f64) -> f64 {
        let values = &self.values[self.bins(from, to)];
        match self.scale {
            Scale::Density => values.iter().sum::<f64>() * self.resolution,
            Scale::Amplitude => values.iter().map(|a| 0.5 * a * a).sum(),
        }
    }
}

/// How a signal is divided into pieces for [`welch`] and [`spectrogram`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Welch {
    /// Samples of a piece; the resolution is the rate divided by it.
    pub segment: usize,
    /// Fraction of a piece that overlaps the next one, from 0 to below 1. Rounded down to whole
    /// samples.
    pub overlap: f64,
    /// Window of each piece.
    pub window: Window,
    /// What is subtracted from each piece first.
    pub detrend: Detrend,
}

impl Welch {
    /// Pieces that give the `resolution` in Hz at `rate` in Hz: Hann window, half overlapping, mean
    /// removed.
    #[must_use]
    pub fn of_resolution(rate: f64, resolution: f64) -> Self {
        Self::of_segment((rate / resolution).round() as usize)
    }

    /// Pieces of this many samples: Hann window, half overlapping, mean removed.
    #[must_use]
    pub fn of_segment(segment: usize) -> Self {
        Self { segment, overlap: 0.5, window: Window::Hann, detrend: Detrend::Constant }
    }

    /// Samples from the beginning of a piece to that of the next.
    #[must_use]
    pub fn step(&self) -> usize {
        self.segment - (self.overlap * self.segment as f64) as usize
    }

    fn check(&self, values: &[f64], rate: f64) -> Result<(), Error> {
        check_rate(rate)?;
        let rule = "8 or more samples";
        require(self.segment >= FEWEST, "the length of a piece", self.segment as f64, rule)?;
        let overlap = self.overlap;
        require((0.0..1.0).contains(&overlap), "the overlap", overlap, "0 or more and below 1")?;
        enough(values, self.segment)
    }
}

/// Spectra of successive pieces of a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrogram {
    /// Middle of the first piece, in s after the signal's first sample.
    pub start: f64,
    /// Time between pieces, in s.
    pub step: f64,
    /// Distance of two bins, in Hz.
    pub resolution: f64,
    /// Meaning of the values.
    pub scale: Scale,
    /// One spectrum per piece, from DC to Nyquist.
    pub slices: Vec<Vec<f64>>,
}

impl Spectrogram {
    /// The time of slice `i`, in s after the signal's first sample.
    #[must_use]
    pub fn time(&self, i: usize) -> f64 {
        self.start + i as f64 * self.step
    }
}

/// Amplitude spectrum of the whole signal: a sine of amplitude 1 reads 1.
///
/// The (window-weighted) mean is subtracted before the window is applied and reported in the first
/// bin, so that it does not leak into the next ones. The reading of a sine between two bins depends
/// on the window, see [`Window`].
///
/// # Errors
///
/// An invalid rate, fewer than 8 samples, or a sample that is not finite.
pub fn amplitude(values: &[f64], rate: f64, window: Window) -> Result<Spectrum, Error> {
    check_rate(rate)?;
    enough(values, FEWEST)?;
    let mut piece = Piece::new(values.len(), rate, window, Scale::Amplitude);
    let weighted: f64 = values.iter().zip(&piece.weights).map(|(x, w)| x * w).sum();
    let mean = weighted / piece.weights.iter().sum::<f64>();
    let mut result = vec![0.0; values.len() / 2 + 1];
    piece.transform(|input| {
        for (to, x) in input.iter_mut().zip(values) {
            *to = x - mean;
        }
    })?;
    piece.add_to(&mut result);
    result[0] = mean.abs();
    let resolution = rate / values.len() as f64;
    Ok(Spectrum { resolution, values: result, scale: Scale::Amplitude, window })
}

/// Power spectral density by Welch's method: the mean of the densities of overlapping pieces.
///
/// Samples after the last whole piece are not used. With one piece, the standard deviation of a
/// random signal's density equals the density; with n independent pieces, it is 1/√n of it.
///
/// # Errors
///
/// An invalid rate or setting, fewer samples than one piece, or a sample that is not finite.
pub fn welch(values: &[f64], rate: f64, settings: &Welch) -> Result<Spectrum, Error> {
    settings.check(values, rate)?;
    let mut sum = vec![0.0; settings.segment / 2 + 1];
    let mut pieces = 0;
    each_piece(values, rate, settings, Scale::Density, |piece| {
        piece.add_to(&mut sum);
        pieces += 1;
    })?;
    sum.iter_mut().for_each(|value| *value /= f64::from(pieces));
    let resolution = rate / settings.segment as f64;
    Ok(Spectrum { resolution, values: sum, scale: Scale::Density, window: settings.window })
}

/// Spectra of successive pieces: [`welch`] without the mean over them, or amplitudes.
///
/// # Errors
///
/// As for [`welch`].
pub fn spectrogram(
    values: &[f64],
    rate: f64,
    settings: &Welch,
    scale: Scale,
) -> Result<Spectrogram, Error> {
    settings.check(values, rate)?;
    let mut slices = Vec::new();
    each_piece(values, rate, settings, scale, |piece| {
        let mut slice = vec![0.0; settings.segment / 2 + 1];
        piece.add_to(&mut slice);
        slices.push(slice);
    })?;
    Ok(Spectrogram {
        start: 0.5 * (settings.segment - 1) as f64 / rate,
        step: settings.step() as f64 / rate,
        resolution: rate / settings.segment as f64,
        scale,
        slices,
    })
}

/// Transforms piece after piece and passes each to a function.
fn each_piece(
    values: &[f64],
    rate: f64,
    settings: &Welch,
    scale: Scale,
    mut show: impl FnMut(&Piece),
) -> Result<(), Error> {
    let mut piece = Piece::new(settings.segment, rate, settings.window, scale);
    for samples in values.windows(settings.segment).step_by(settings.step()) {
        piece.transform(|input| {
            input.copy_from_slice(samples);
            settings.detrend.remove(input);
        })?;
        show(&piece);
    }
    Ok(())
}

/// One windowed piece and its power |X_k|².
struct Piece {
    weights: Vec<f64>,
    transform: Transform,
    power: Vec<f64>,
    scale: Scale,
    /// Scale of |X_k| or |X_k|² between DC and Nyquist.
    factor: f64,
}

impl Piece {
    fn new(length: usize, rate: f64, window: Window, scale: Scale) -> Self {
        let weights = window.samples(length);
        let factor = match scale {
            Scale::Amplitude => 2.0 / weights.iter().sum::<f64>(),
            Scale::Density => 2.0 / (rate * weights.iter().map(|w| w * w).sum::<f64>()),
        };
        Self { weights, transform: Transform::new(length), power: Vec::new(), scale, factor }
    }

    fn transform(&mut self, fill: impl FnOnce(&mut [f64])) -> Result<(), Error> {
        fill(&mut self.transform.input);
        for (x, w) in self.transform.input.iter_mut().zip(&self.weights) {
            *x *= w;
        }
        self.power.clear();
        self.power.extend(self.transform.run()?.iter().map(|x| x.norm_sqr()));
        Ok(())
    }

    /// Adds the one-sided values of the piece that was transformed last.
    fn add_to(&self, sum: &mut [f64]) {
        let length = self.weights.len();
        for (k, (to, &power)) in sum.iter_mut().zip(&self.power).enumerate() {
            // DC and Nyquist are their own mirror images
            let sides = if k == 0 || 2 * k == length { 0.5 } else { 1.0 };
            *to += sides
                * self.factor
                * match self.scale {
                    Scale::Amplitude => power.sqrt(),
                    Scale::Density => power,
                };
        }
    }
}
