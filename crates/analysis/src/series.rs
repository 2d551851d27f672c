//! Checks of a signal: finite samples at a constant rate.

use crate::error::{Error, require};

/// Smallest number of samples for a meaningful spectrum.
pub const FEWEST: usize = 8;

/// Largest deviation of a sample from its expected time, in intervals: far above the rounding of a
/// printed time, far below a visible effect on a spectrum.
const UNEVEN: f64 = 1e-6;

/// The rate in Hz of an evenly spaced time axis in s (in 1/m, of one in m).
///
/// # Errors
///
/// Fewer than [`FEWEST`] times, one that is not finite, or one that deviates by more than a
/// millionth of the mean interval.
pub fn rate(times: &[f64]) -> Result<f64, Error> {
    enough(times, FEWEST)?;
    let (first, last) = (times[0], times[times.len() - 1]);
    let interval = (last - first) / (times.len() - 1) as f64;
    // a time in s has this many digits, for any interval
    let digits = 4.0 * f64::EPSILON * first.abs().max(last.abs());
    let allowed = (UNEVEN * interval).max(digits);
    for (index, &time) in times.iter().enumerate() {
        let expected = first + index as f64 * interval;
        // also true if the axis runs backwards or is constant
        if (time - expected).abs() > allowed || interval <= digits {
            return Err(Error::Uneven { index, time, expected, interval });
        }
    }
    Ok(1.0 / interval)
}

/// Checks that a signal has enough samples, and that all are finite.
pub(crate) fn enough(values: &[f64], needed: usize) -> Result<(), Error> {
    if values.len() < needed {
        return Err(Error::TooShort { samples: values.len(), needed });
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Error::NotFinite { index, value: values[index] }),
        None => Ok(()),
    }
}

/// Checks a rate.
pub(crate) fn check_rate(rate: f64) -> Result<(), Error> {
    require(rate.is_finite() && rate > 0.0, "the sampling rate", rate, "above zero and finite")
}
