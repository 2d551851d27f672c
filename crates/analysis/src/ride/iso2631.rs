//! Whole-body vibration after ISO 2631-1:1997, with the weightings of its annex A.
//!
//! H(p) = H_h H_l H_t H_s with p = 2πjf, ω_i = 2πf_i (annex A, equations A.1 to A.4; the same in ISO
//! 8041-1:2017, equations 1 to 4):
//!
//! - high pass H_h = 1 / (1 + √2 ω₁/p + (ω₁/p)²), low pass H_l = 1 / (1 + √2 p/ω₂ + (p/ω₂)²),
//! - acceleration-velocity transition H_t = K (1 + p/ω₃) / (1 + p/(Q₄ω₄) + (p/ω₄)²),
//! - upward step H_s = (1 + p/(Q₅ω₅) + (p/ω₅)²) / (1 + p/(Q₆ω₆) + (p/ω₆)²) · (ω₅/ω₆)².
//!
//! They are applied directly in the frequency domain, without a discretisation that would distort
//! them near half the sampling rate. The tests compare them with the standards' tables.

use std::f64::consts::SQRT_2;

use realfft::num_complex::Complex64;

use super::MEMORY;
use crate::error::{Error, require};
use crate::fourier::filter;
use crate::series::{FEWEST, check_rate, enough};

/// Integration time of the running r.m.s., in s (6.3.1).
const RUNNING: f64 = 1.0;

/// The lowest sampling rate, in Hz, at which the weighted range ends within half of it: that of the third
/// octave about 80 Hz, 2 · 80 · 2^(1/6).
pub const LOWEST_RATE: f64 = 180.0;

/// Direction of the vibration, and standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighting {
    /// Vertical (z), ISO 2631-1.
    Wk,
    /// Vertical (z) in railway vehicles and the like, ISO 2631-4.
    Wb,
    /// Lateral and longitudinal (y, x), ISO 2631-1.
    Wd,
}

/// Corner frequencies in Hz, quality factors and gain of a weighting.
struct Parameters {
    gain: f64,
    /// f₃ and f₄ are equal in all
    transition: f64,
    q4: f64,
    /// f₅, Q₅, f₆, Q₆
    step: Option<[f64; 4]>,
}

/// f₁ and f₂, of all weightings here.
const BAND: [f64; 2] = [0.4, 100.0];

impl Weighting {
    /// Table A.1 of ISO 2631-1 and of ISO 2631-4, as table 3 of ISO 8041-1 has them.
    fn parameters(self) -> Parameters {
        match self {
            Self::Wk => Parameters {
                gain: 1.0,
                transition: 12.5,
                q4: 0.63,
                step: Some([2.37, 0.91, 3.35, 0.91]),
            },
            Self::Wb => Parameters {
                gain: 1.024,
                transition: 16.0,
                q4: 0.55,
                step: Some([2.5, 0.9, 4.0, 0.95]),
            },
            Self::Wd => Parameters { gain: 1.0, transition: 2.0, q4: 0.63, step: None },
        }
    }

    /// H at a frequency in Hz.
    fn response(self, frequency: f64) -> Complex64 {
        if frequency == 0.0 {
            return Complex64::ZERO;
        }
        // p/ω of a corner frequency
        let over = |corner: f64| Complex64::new(0.0, frequency / corner);
        let second = |q: f64, r: Complex64| 1.0 + r / q + r * r;
        let Parameters { gain, transition, q4, step } = self.parameters();
        let high = 1.0 / second(1.0 / SQRT_2, over(BAND[0]).inv());
        let low = 1.0 / second(1.0 / SQRT_2, over(BAND[1]));
        let transition = gain * (1.0 + over(transition)) / second(q4, over(transition));
        let step = step.map_or(Complex64::ONE, |[f5, q5, f6, q6]| {
            second(q5, over(f5)) / second(q6, over(f6)) * (f5 / f6).powi(2)
        });
        high * low * transition * step
    }

    /// The weighting factor |H| at a frequency in Hz.
    #[must_use]
    pub fn factor(self, frequency: f64) -> f64 {
        self.response(frequency).norm()
    }

    /// The weighted acceleration; the signal is zero before its first sample.
    ///
    /// # Errors
    ///
    /// A rate below [`LOWEST_RATE`], fewer than 8 samples, or a sample that is not finite.
    pub fn apply(self, acceleration: &[f64], rate: f64) -> Result<Vec<f64>, Error> {
        check_rate(rate)?;
        let rule = "180 Hz or more: the weightings reach to the third octave about 80 Hz";
        // a rate computed from printed times may be too low by rounding
        require(rate > LOWEST_RATE * (1.0 - 1e-9), "the sampling rate", rate, rule)?;
        enough(acceleration, FEWEST)?;
        filter(acceleration, rate, MEMORY, |f| self.response(f))
    }

    /// Name in the standards, such as `Wk`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Wk => "Wk",
            Self::Wb => "Wb",
            Self::Wd => "Wd",
        }
    }
}

/// Measures of a weighted acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Weighted r.m.s. acceleration a_w, in m/s² (6.1).
    pub rms: f64,
    /// Maximum transient vibration value MTVV: the largest r.m.s. of any second, in m/s² (6.3.1).
    pub transient: f64,
    /// Fourth power vibration dose value VDV, in m/s^1.75 (6.3.2).
    pub dose: f64,
    /// Largest magnitude of the weighted acceleration, in m/s².
    pub peak: f64,
}

impl Exposure {
    /// Computes the measures of a weighted acceleration in m/s² at a rate in Hz.
    ///
    /// # Errors
    ///
    /// The signal is shorter than a second, or not finite.
    pub fn of(weighted: &[f64], rate: f64) -> Result<Self, Error> {
        check_rate(rate)?;
        let second = ((RUNNING * rate).round() as usize).max(FEWEST);
        enough(weighted, second)?;
        let count = weighted.len() as f64;
        let squares = weighted.iter().map(|a| a * a);
        let fourth: f64 = squares.clone().map(|square| square * square).sum();
        Ok(Self {
            rms: (squares.sum::<f64>() / count).sqrt(),
            transient: largest_mean_square(weighted, second).sqrt(),
            dose: (fourth / rate).sqrt().sqrt(),
            peak: weighted.iter().fold(0.0, |peak, a| peak.max(a.abs())),
        })
    }

    /// Crest factor: peak over r.m.s. (6.2.1); 0 at rest. Above 9 the r.m.s. is not sufficient, and
    /// the standard also requires the transient value or the dose.
    #[must_use]
    pub fn crest_factor(&self) -> f64 {
        if self.rms > 0.0 { self.peak / self.rms } else { 0.0 }
    }
}

/// The largest mean square of `length` successive samples.
fn largest_mean_square(values: &[f64], length: usize) -> f64 {
    // differences of one running sum would cancel after a large peak
    let mut sum: f64 = 0.0;
    let mut largest: f64 = 0.0;
    for start in 0..=values.len() - length {
        sum = if start % length == 0 {
            values[start..start + length].iter().map(|a| a * a).sum()
        } else {
            sum - values[start - 1].powi(2) + values[start + length - 1].powi(2)
        };
        largest = largest.max(sum);
    }
    largest / length as f64
}

/// Terms of annex C.2.3 with their ranges of the vibration total value in m/s², for public
/// transport.
const COMFORT: [(&str, f64, f64); 6] = [
    ("not uncomfortable", 0.0, 0.315),
    ("a little uncomfortable", 0.315, 0.63),
    ("fairly uncomfortable", 0.5, 1.0),
    ("uncomfortable", 0.8, 1.6),
    ("very uncomfortable", 1.25, 2.5),
    ("extremely uncomfortable", 2.0, f64::INFINITY),
];

/// Likely reactions to a vibration total value in m/s²: one term or two, because the ranges of ISO
/// 2631-1, annex C.2.3, overlap.
#[must_use]
pub fn comfort(total: f64) -> Vec<&'static str> {
    let fits = |(_, from, to): &&(&str, f64, f64)| (*from..*to).contains(&total);
    COMFORT.iter().filter(fits).map(|(word, ..)| *word).collect()
}

/// Vibration total value a_v = √Σ a_w², in m/s², of r.m.s. values in several directions (6.5; the factors k
/// are 1 for comfort on a seat).
#[must_use]
pub fn total(rms: impl IntoIterator<Item = f64>) -> f64 {
    rms.into_iter().map(|a| a * a).sum::<f64>().sqrt()
}
