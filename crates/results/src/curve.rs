//! Curves of plots, reduced while they are recorded.

use serde::{Deserialize, Serialize};

/// A curve reduced while it is recorded: the smallest and the largest value of each slice of time. No peak
/// is lost, and memory stays bounded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    points_per_slice: u64,
    slice: Option<Slice>,
    points: Vec<(f64, f64)>,
    taken: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Slice {
    min: (f64, f64),
    max: (f64, f64),
}

impl Curve {
    /// A curve for a given number of points, with at most two points per slice.
    #[must_use]
    pub fn new(points: u64, slices: u64) -> Self {
        let points_per_slice = if points <= 2 * slices { 1 } else { points.div_ceil(slices) };
        Self { points_per_slice, slice: None, points: Vec::new(), taken: 0 }
    }

    /// Whether the other curve keeps more points.
    #[must_use]
    pub fn is_coarser_than(&self, other: &Self) -> bool {
        self.points_per_slice > other.points_per_slice
    }

    /// Takes one point. NaN and infinite values are left out.
    #[inline]
    pub fn take(&mut self, time: f64, value: f64) {
        let point = (time, value);
        match &mut self.slice {
            _ if !value.is_finite() => {}
            Some(slice) => {
                if value < slice.min.1 {
                    slice.min = point;
                }
                if value > slice.max.1 {
                    slice.max = point;
                }
            }
            None => self.slice = Some(Slice { min: point, max: point }),
        }
        self.taken += 1;
        if self.taken.is_multiple_of(self.points_per_slice) {
            self.flush();
        }
    }

    fn flush(&mut self) {
        if let Some(Slice { min, max }) = self.slice.take() {
            let (first, second) = if min.0 <= max.0 { (min, max) } else { (max, min) };
            self.points.push(first);
            if first != second {
                self.points.push(second);
            }
        }
    }

    /// The reduced curve: time and value.
    #[must_use]
    pub fn finish(mut self) -> Vec<(f64, f64)> {
        self.flush();
        self.points
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn issue_values_that_are_not_finite_are_left_out() {
        for slices in [2, 100] {
            let mut curve = Curve::new(20, slices);
            for k in 0..20 {
                let value = f64::from(k);
                curve.take(value, if k % 3 == 0 { f64::NAN } else { value });
            }
            let points = curve.finish();
            assert!(points.iter().all(|point| point.1.is_finite()), "{points:?}");
            assert_eq!((points[0].1, points[points.len() - 1].1), (1.0, 19.0));
        }
        let mut curve = Curve::new(2, 100);
        (0..2).for_each(|k| curve.take(f64::from(k), f64::INFINITY));
        assert!(curve.finish().is_empty());
    }

    proptest! {
        #[test]
        fn invariant_reduction_keeps_every_peak(
            values in proptest::collection::vec(-1e3..1e3_f64, 1..2000), slices in 1_u64..100
        ) {
            let mut curve = Curve::new(values.len() as u64, slices);
            for (k, &value) in values.iter().enumerate() {
                curve.take(k as f64, value);
            }
            let points = curve.finish();
            prop_assert!(points.len() as u64 <= 2 * slices + 2);
            let extreme = |pick: fn(f64, f64) -> f64, list: &mut dyn Iterator<Item = f64>| {
                list.fold(f64::NAN, pick)
            };
            for pick in [f64::min as fn(f64, f64) -> f64, f64::max] {
                let all = extreme(pick, &mut values.iter().copied());
                let kept = extreme(pick, &mut points.iter().map(|p| p.1));
                prop_assert_eq!(all, kept);
            }
            prop_assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
        }
    }
}
