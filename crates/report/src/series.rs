//! Time histories for the page: all points if there is room, otherwise the smallest and the largest value of
//! equal slices, so that no peak is lost.

use serde::Serialize;

use crate::embed::{ArrayRef, Arrays};

/// Times of consecutive points.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum SignalClock {
    /// Equally spaced times: start + k·step.
    Uniform {
        /// Time of the first point (s).
        start: f64,
        /// Step (s).
        step: f64,
        /// Number of points.
        len: usize,
    },
    /// Other times.
    Listed {
        /// The times (s).
        times: ArrayRef,
    },
}

/// The time history of one signal.
#[derive(Debug, Clone, Serialize)]
pub struct EmbeddedSeries {
    /// Index of its clock among those of the run.
    pub clock: usize,
    /// Values.
    pub values: ArrayRef,
    /// Points of the table per pair of values; 1 if no points are left out.
    pub points_per_pair: usize,
}

/// The clocks of one run, without duplicates.
#[derive(Debug, Default)]
pub struct SignalClocks {
    list: Vec<SignalClock>,
    known: Vec<Vec<f64>>,
}

impl SignalClocks {
    /// The clocks.
    #[must_use]
    pub fn into_list(self) -> Vec<SignalClock> {
        self.list
    }

    fn find(&mut self, times: Vec<f64>, arrays: &mut Arrays) -> usize {
        if let Some(index) = self.known.iter().position(|it| *it == times) {
            return index;
        }
        self.list.push(match uniform(&times) {
            Some(step) => SignalClock::Uniform { start: times[0], step, len: times.len() },
            None => SignalClock::Listed { times: arrays.f64(&times) },
        });
        self.known.push(times);
        self.known.len() - 1
    }

    /// Embeds a signal with at most `most` values.
    pub fn embed(
        &mut self,
        times: &[f64],
        values: &[f64],
        most: usize,
        arrays: &mut Arrays,
    ) -> EmbeddedSeries {
        let points_per_pair = points_per_pair(values.len(), most);
        let (times, values) = reduced(times, values, most);
        EmbeddedSeries {
            clock: self.find(times, arrays),
            values: arrays.f32(&values),
            points_per_pair,
        }
    }
}

/// Reduces a signal to at most `most` values, without losing a peak.
#[must_use]
pub fn reduced(times: &[f64], values: &[f64], most: usize) -> (Vec<f64>, Vec<f64>) {
    match points_per_pair(values.len(), most) {
        1 => (times.to_vec(), values.to_vec()),
        points => reduce(times, values, points),
    }
}

/// Points per slice, of which two are kept, so that at most `most` values remain; 1 if all remain. Even, so
/// that reduced times are equally spaced, too.
fn points_per_pair(points: usize, most: usize) -> usize {
    if points <= most { 1 } else { points.div_ceil((most / 2).max(1)).next_multiple_of(2) }
}

/// The step of equally spaced times, with a tolerance of a millionth of it.
#[must_use]
pub fn uniform(times: &[f64]) -> Option<f64> {
    let (first, last) = (*times.first()?, *times.last()?);
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 rows")]
    let step = (last - first) / (times.len() - 1).max(1) as f64;
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 rows")]
    let fits = |(k, time): (usize, &f64)| (first + k as f64 * step - time).abs() <= 1e-6 * step;
    let grows = step > 0.0 || times.len() == 1;
    (grows && times.iter().enumerate().all(fits)).then_some(step)
}

/// The smallest and the largest value of each slice in the order of their times, at the first and the middle
/// time of the slice, so that all signals of a table share their times.
fn reduce(times: &[f64], values: &[f64], points: usize) -> (Vec<f64>, Vec<f64>) {
    let mut reduced = (Vec::new(), Vec::new());
    for (time, slice) in times.chunks(points).zip(values.chunks(points)) {
        let (mut low, mut high) = (0, 0);
        for (k, value) in slice.iter().enumerate() {
            if *value < slice[low] {
                low = k;
            }
            if *value > slice[high] {
                high = k;
            }
        }
        let pair = if low <= high { [slice[low], slice[high]] } else { [slice[high], slice[low]] };
        reduced.0.extend([time[0], time[time.len() / 2]]);
        reduced.1.extend(pair);
        if time.len() == 1 {
            reduced.0.pop();
            reduced.1.pop();
        }
    }
    reduced
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn invariant_reduction_keeps_every_peak_and_the_order_of_time(
            values in proptest::collection::vec(-1e3..1e3_f64, 1..2000), most in 2_usize..300
        ) {
            let times: Vec<f64> = (0..values.len()).map(|k| k as f64 * 0.1).collect();
            let points = points_per_pair(values.len(), most);
            if points > 1 {
                let (t, v) = reduce(&times, &values, points);
                prop_assert!(v.len() <= most && t.len() == v.len());
                prop_assert!(t.windows(2).all(|w| w[0] < w[1]));
                for pick in [f64::min as fn(f64, f64) -> f64, f64::max] {
                    let fold = |list: &[f64]| list.iter().copied().fold(f64::NAN, pick);
                    prop_assert_eq!(fold(&values), fold(&v));
                }
            } else {
                prop_assert!(values.len() <= most);
            }
        }
    }

    #[test]
    fn invariant_signals_of_one_table_share_their_clock() {
        let (mut clocks, mut arrays) = (SignalClocks::default(), Arrays::default());
        let times: Vec<f64> = (0..1000).map(|k| 0.5 + f64::from(k) * 0.001).collect();
        let a = clocks.embed(&times, &times, 100, &mut arrays);
        let falling: Vec<f64> = times.iter().map(|t| -t).collect();
        let b = clocks.embed(&times, &falling, 100, &mut arrays);
        let c = clocks.embed(&times, &falling, 1000, &mut arrays);
        assert_eq!((a.clock, b.clock, c.clock), (0, 0, 1));
        assert_eq!((a.points_per_pair, c.points_per_pair), (20, 1));
        let list = clocks.into_list();
        assert!(matches!(list[0], SignalClock::Uniform { len: 100, .. }), "{list:?}");
    }

    #[test]
    fn issue_uneven_times_are_listed() {
        assert_eq!(uniform(&[0.0, 1.0, 2.5]), None);
        assert_eq!(uniform(&[0.0, 0.0]), None);
        assert_eq!(uniform(&[]), None);
        assert_eq!(uniform(&[3.0]), Some(0.0));
    }
}
