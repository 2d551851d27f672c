//! Sperling's ride index W_z for passenger comfort.
//!
//! W_z = 4.42 a_w^0.3, where a_w is the r.m.s. of the acceleration in m/s² weighted by
//! B(f) = k √((1.911 f² + (0.25 f²)²) / ((1 - 0.277 f²)² + (1.563 f - 0.0368 f³)²)), f in Hz, k = 0.588
//! vertically and 0.737 laterally, from 0.5 to 30 Hz. For one sine of amplitude a in cm/s² that is
//! W_z = (a B)^0.3, because (100 √2)^0.3 = 4.42.
//!
//! Sources: V. K. Garg and R. V. Dukkipati, *Dynamics of Railway Vehicle Systems* (1984), for B(f)
//! and the terms; J. Förstberg, *Ride comfort and motion sickness in tilting trains* (KTH, 2000),
//! for the form with the r.m.s. Sperling's first formula (1956), 0.896 (a³ F(f)/f)^0.1,
//! approximates the same curve piecewise by powers of f, within 20 %; a test compares them.

use realfft::num_complex::Complex64;

use super::MEMORY;
use crate::error::{Error, require};
use crate::fourier::filter;
use crate::series::{FEWEST, check_rate, enough};

/// Frequency range of the index, in Hz.
const RANGE: std::ops::RangeInclusive<f64> = 0.5..=30.0;

/// The lowest sampling rate, in Hz: twice the upper end of the range.
pub const LOWEST_RATE: f64 = 60.0;

/// Direction of the vibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Vertical.
    Vertical,
    /// Lateral or longitudinal.
    Horizontal,
}

impl Direction {
    /// B as a filter: the formula above is |B| of this rational function of p = jf.
    fn response(self, frequency: f64) -> Complex64 {
        let gain = match self {
            Self::Vertical => 0.588,
            Self::Horizontal => 0.737,
        };
        let p = Complex64::new(0.0, frequency);
        let above = p * (1.911_f64.sqrt() + 0.25 * p);
        let below = 1.0 + p * (1.563 + p * (0.277 + 0.0368 * p));
        gain * above / below
    }

    /// The weighting factor B at a frequency in Hz.
    #[must_use]
    pub fn factor(self, frequency: f64) -> f64 {
        self.response(frequency).norm()
    }

    /// The weighted acceleration within 0.5 to 30 Hz, for a signal that is zero before its first
    /// sample.
    ///
    /// # Errors
    ///
    /// A rate below [`LOWEST_RATE`], fewer than 8 samples, or a sample that is not finite.
    pub fn apply(self, acceleration: &[f64], rate: f64) -> Result<Vec<f64>, Error> {
        check_rate(rate)?;
        let rule = "60 Hz or more: the index counts what is below 30 Hz";
        require(rate > LOWEST_RATE * (1.0 - 1e-9), "the sampling rate", rate, rule)?;
        enough(acceleration, FEWEST)?;
        let cut = |f| if RANGE.contains(&f) { self.response(f) } else { Complex64::ZERO };
        filter(acceleration, rate, MEMORY, cut)
    }
}

/// The ride index of an acceleration in m/s² that [`Direction::apply`] has weighted; 0 at rest.
#[must_use]
pub fn index(weighted: &[f64]) -> f64 {
    let mean_square = weighted.iter().map(|a| a * a).sum::<f64>() / weighted.len().max(1) as f64;
    4.42 * mean_square.sqrt().powf(0.3)
}

/// Terms for passenger comfort, each with the index from which it applies.
const WORDS: [(f64, &str); 8] = [
    (4.0, "extremely unpleasant, harmful if prolonged"),
    (3.5, "extremely irregular, unpleasant, intolerable if prolonged"),
    (3.25, "very irregular"),
    (3.0, "strong, irregular, but still tolerable"),
    (2.5, "more pronounced but not unpleasant"),
    (2.0, "clearly noticeable"),
    (1.0, "just noticeable"),
    (0.0, "not noticeable"),
];

/// The term for an index.
#[must_use]
pub fn comfort(index: f64) -> &'static str {
    WORDS.iter().find(|(from, _)| index >= *from).map_or("not noticeable", |(_, word)| word)
}
