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

/// A signal without a last sample that comes too early, such as that of a run that a condition has stopped. Everything
/// else remains, even or not.
#[must_use]
pub fn without_early_end<'a>(times: &'a [f64], values: &'a [f64]) -> (&'a [f64], &'a [f64]) {
    let Some(whole) = times.len().checked_sub(1).filter(|_| values.len() == times.len()) else {
        return (times, values);
    };
    let early = rate(times).is_err()
        && rate(&times[..whole]).is_ok_and(|rate| (times[whole] - times[whole - 1]) * rate < 1.0);
    if early { (&times[..whole], &values[..whole]) } else { (times, values) }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A last sample that comes early goes; a late one, and one of too few, remain.
    #[test]
    fn analytic_an_early_last_sample_is_left_out() {
        let times: Vec<f64> = (0..10).map(|n| f64::from(n) * 0.1).collect();
        let values = vec![1.0; 11];
        let length = |last: f64| {
            let times = [&times[..], &[last]].concat();
            without_early_end(&times, &values).0.len()
        };
        assert_eq!([0.93, 1.0, 1.1].map(length), [10, 11, 11]);
        assert_eq!(without_early_end(&times[..3], &values[..3]).0.len(), 3);
        assert_eq!(without_early_end(&[], &[]).1.len(), 0);
    }
}
