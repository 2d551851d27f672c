//! Statistics of a signal over every communication point.

use serde::{Deserialize, Deserializer, Serialize};

/// Extremes and means of one signal over all communication points at which it is finite.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Statistics {
    /// Smallest value.
    #[serde(deserialize_with = "number")]
    pub min: f64,
    /// Time of the smallest value (s).
    #[serde(deserialize_with = "number")]
    pub time_of_min: f64,
    /// Largest value.
    #[serde(deserialize_with = "number")]
    pub max: f64,
    /// Time of the largest value (s).
    #[serde(deserialize_with = "number")]
    pub time_of_max: f64,
    /// Mean of the values at the points.
    #[serde(deserialize_with = "number")]
    pub mean: f64,
    /// Root mean square of the values at the points.
    #[serde(deserialize_with = "number")]
    pub rms: f64,
    /// Last value.
    #[serde(rename = "final", deserialize_with = "number")]
    pub last: f64,
    /// Number of points.
    pub points: u64,
}

/// A number. JSON has null for one that is NaN or infinite.
fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Statistics among the members of a larger object; none without points.
pub(crate) fn if_any<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Statistics>, D::Error> {
    let statistics = Statistics::deserialize(deserializer)?;
    Ok((statistics.points > 0).then_some(statistics))
}

/// Computes [`Statistics`] point by point. Compensated sums (Neumaier) keep full precision over millions
/// of points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Gatherer {
    min: (f64, f64),
    max: (f64, f64),
    sum: CompensatedSum,
    squares: CompensatedSum,
    last: f64,
    points: u64,
    /// points with NaN or an infinite value
    odd: u64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct CompensatedSum {
    total: f64,
    lost: f64,
}

impl CompensatedSum {
    #[inline]
    fn add(&mut self, x: f64) {
        let next = self.total + x;
        self.lost += if self.total.abs() >= x.abs() {
            (self.total - next) + x
        } else {
            (x - next) + self.total
        };
        self.total = next;
    }

    fn value(self) -> f64 {
        self.total + self.lost
    }
}

impl Gatherer {
    /// Takes one point.
    #[inline]
    pub fn take(&mut self, time: f64, value: f64) {
        if !value.is_finite() {
            self.odd += 1;
            return;
        }
        if self.points == 0 || value < self.min.0 {
            self.min = (value, time);
        }
        if self.points == 0 || value > self.max.0 {
            self.max = (value, time);
        }
        self.sum.add(value);
        self.squares.add(value * value);
        self.last = value;
        self.points += 1;
    }

    /// Number of points left out because the value was NaN or infinite.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        self.odd
    }

    /// The statistics so far; `None` before the first point.
    #[must_use]
    pub fn statistics(&self) -> Option<Statistics> {
        #[expect(clippy::cast_precision_loss, reason = "2^53 points are out of reach")]
        let n = self.points as f64;
        (self.points > 0).then(|| Statistics {
            min: self.min.0,
            time_of_min: self.min.1,
            max: self.max.0,
            time_of_max: self.max.1,
            mean: self.sum.value() / n,
            rms: (self.squares.value() / n).sqrt(),
            last: self.last,
            points: self.points,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_statistics_of_a_ramp() {
        let mut gatherer = Gatherer::default();
        assert!(gatherer.statistics().is_none());
        for k in 0..=4 {
            gatherer.take(f64::from(k) * 0.5, f64::from(k) - 1.0);
        }
        let s = gatherer.statistics().unwrap();
        assert_eq!((s.min, s.time_of_min, s.max, s.time_of_max), (-1.0, 0.0, 3.0, 2.0));
        assert_eq!((s.mean, s.rms, s.last, s.points), (1.0, 3.0_f64.sqrt(), 3.0, 5));
    }

    #[test]
    fn issue_values_that_are_not_finite_are_left_out_and_counted() {
        let mut gatherer = Gatherer::default();
        gatherer.take(0.0, f64::NAN);
        assert!(gatherer.statistics().is_none());
        for (time, value) in [(1.0, 3.0), (2.0, f64::INFINITY), (3.0, -1.0), (4.0, f64::NAN)] {
            gatherer.take(time, value);
        }
        let s = gatherer.statistics().unwrap();
        assert_eq!((s.min, s.time_of_min, s.max, s.time_of_max), (-1.0, 3.0, 3.0, 1.0));
        assert_eq!((s.mean, s.rms, s.last, s.points), (1.0, 5.0_f64.sqrt(), -1.0, 2));
        assert_eq!(gatherer.left_out(), 3);
    }

    /// A plain sum of 1e16 and ten ones loses all ten.
    #[test]
    fn analytic_sums_are_compensated() {
        let mut sum = CompensatedSum::default();
        sum.add(1e16);
        (0..10).for_each(|_| sum.add(1.0));
        sum.add(-1e16);
        assert_eq!(sum.value(), 10.0);
    }
}
