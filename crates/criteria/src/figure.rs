//! Figures of one signal, from its recorded values.

use thiserror::Error;

use crate::{Figure, Metric};

/// A figure of one signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The figure, not divided by anything yet.
    pub value: f64,
    /// Time of an extreme (s); of `peak_to_peak` the later one of both.
    pub time: Option<f64>,
}

/// Why a signal has no such figure.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum FigureError {
    /// No value lies in the time that counts.
    #[error("no value is recorded from {from} s to {to} s; it ends at {end} s")]
    Empty {
        /// Start of the time that counts.
        from: f64,
        /// Its end.
        to: f64,
        /// Time of the last value.
        end: f64,
    },
    /// A value is NaN or infinite.
    #[error("it is {value} at {time} s")]
    NotFinite {
        /// The value.
        value: f64,
        /// Its time.
        time: f64,
    },
    /// The signal leaves the band until the end.
    #[error("it has not settled: at {time} s it is still {deviation} away, and the band is {band}")]
    Unsettled {
        /// Time of the last value outside.
        time: f64,
        /// Its distance from the reference.
        deviation: f64,
        /// The allowed one.
        band: f64,
    },
}

/// Times differ from their decimals by rounding: this fraction of a time.
const SLACK: f64 = 1e-9;

/// Computes the figure of a signal. Means over time use the trapezoidal rule, so that variable steps have their weight.
///
/// # Errors
/// There are no values in the time that counts, one of them is not finite, or the signal has not settled.
pub fn compute(metric: &Metric, times: &[f64], values: &[f64]) -> Result<Found, FigureError> {
    let (t, y) = within(metric, times, values)?;
    let last = y.len() - 1;
    let timeless = |value| Found { value, time: None };
    let shift = metric.reference.unwrap_or(0.0);
    let x = |k: usize| y[k] - shift;
    // the first one of equal values
    let extreme = |of: &dyn Fn(f64) -> f64| {
        let best = (1..=last).fold(0, |best, k| if of(x(k)) > of(x(best)) { k } else { best });
        Found { value: x(best), time: Some(t[best]) }
    };
    Ok(match metric.figure.unwrap_or(Figure::Final) {
        Figure::Max => extreme(&|it| it),
        Figure::Min => extreme(&|it: f64| -it),
        Figure::MaxAbs => {
            let found = extreme(&f64::abs);
            Found { value: found.value.abs(), ..found }
        }
        Figure::PeakToPeak => {
            let (high, low) = (extreme(&|it| it), extreme(&|it: f64| -it));
            let time = high.time.zip(low.time).map(|(a, b)| a.max(b));
            Found { value: high.value - low.value, time }
        }
        Figure::Mean => timeless(mean(t, x)),
        Figure::Rms => timeless(mean(t, |k| x(k) * x(k)).sqrt()),
        Figure::StandardDeviation => {
            let centre = mean(t, x);
            timeless(mean(t, |k| (x(k) - centre) * (x(k) - centre)).sqrt())
        }
        Figure::Percentile => timeless(percentile(t, x, metric.percentile.unwrap_or(50.0) / 100.0)),
        Figure::SettlingTime => {
            let (goal, band) = (metric.reference.unwrap_or(y[last]), metric.band.unwrap_or(0.0));
            match (0..=last).rev().find(|&k| (y[k] - goal).abs() > band) {
                Some(k) if k == last => {
                    let deviation = (y[k] - goal).abs();
                    return Err(FigureError::Unsettled { time: t[k], deviation, band });
                }
                Some(k) => Found { value: t[k + 1] - t[0], time: Some(t[k + 1]) },
                None => Found { value: 0.0, time: Some(t[0]) },
            }
        }
        Figure::Final => Found { value: x(last), time: Some(t[last]) },
    })
}

/// The first time at which the value of an extreme is beyond a bound; none for other figures.
pub(crate) fn first_beyond(
    metric: &Metric,
    times: &[f64],
    values: &[f64],
    beyond: impl Fn(f64) -> bool,
) -> Option<f64> {
    let magnitude = match metric.figure? {
        Figure::Max | Figure::Min => |it: f64| it,
        Figure::MaxAbs => f64::abs,
        _ => return None,
    };
    let (t, y) = within(metric, times, values).ok()?;
    let shift = metric.reference.unwrap_or(0.0);
    t.iter().zip(y).find(|(_, y)| beyond(magnitude(**y - shift))).map(|(t, _)| *t)
}

/// The part in the time that counts, which has values, all of them finite.
fn within<'a>(
    metric: &Metric,
    times: &'a [f64],
    values: &'a [f64],
) -> Result<(&'a [f64], &'a [f64]), FigureError> {
    let slack = |t: f64| SLACK * t.abs();
    let first = metric.from.map_or(0, |from| times.partition_point(|t| *t < from - slack(from)));
    let end = metric.to.map_or(times.len(), |to| times.partition_point(|t| *t <= to + slack(to)));
    if first >= end {
        let (start, stop) = (times.first().copied(), times.last().copied());
        return Err(FigureError::Empty {
            from: metric.from.or(start).unwrap_or(0.0),
            to: metric.to.or(stop).unwrap_or(0.0),
            end: stop.unwrap_or(0.0),
        });
    }
    let (times, values) = (&times[first..end], &values[first..end]);
    match values.iter().position(|value| !value.is_finite()) {
        Some(k) => Err(FigureError::NotFinite { value: values[k], time: times[k] }),
        None => Ok((times, values)),
    }
}

/// The mean over time by the trapezoidal rule; of a single point its value.
fn mean(t: &[f64], x: impl Fn(usize) -> f64) -> f64 {
    let span = t[t.len() - 1] - t[0];
    if span <= 0.0 {
        return x(t.len() - 1);
    }
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for k in 1..t.len() {
        // compensated, so that millions of points keep their digits
        let part = 0.5 * (t[k] - t[k - 1]) * (x(k) + x(k - 1)) - lost;
        let next = sum + part;
        lost = (next - sum) - part;
        sum = next;
    }
    sum / span
}

/// The value that the points do not exceed for a fraction of the time. Each point counts for half the intervals beside
/// it; between points in the order of their values the result is linear.
fn percentile(t: &[f64], x: impl Fn(usize) -> f64, fraction: f64) -> f64 {
    let last = t.len() - 1;
    let mut points: Vec<(f64, f64)> = (0..=last)
        .map(|k| (x(k), if last == 0 { 1.0 } else { 0.5 * (t[last.min(k + 1)] - t[k.max(1) - 1]) }))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = points.iter().map(|point| point.1).sum();
    let (mut reached, mut before) = (0.0, None);
    for &(value, weight) in &points {
        let centre = reached + 0.5 * weight;
        if centre >= fraction * whole {
            return match before {
                Some((at, lower)) if centre > at => {
                    lower + (value - lower) * (fraction * whole - at) / (centre - at)
                }
                _ => value,
            };
        }
        before = Some((centre, value));
        reached += weight;
    }
    points[last].0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn metric(figure: Figure) -> Metric {
        let (percentile, band) = (Some(95.0), Some(0.1));
        Metric { figure: Some(figure), percentile, band, ..Metric::default() }
    }

    fn value(metric: &Metric, t: &[f64], y: &[f64]) -> f64 {
        compute(metric, t, y).unwrap().value
    }

    /// y = 2t - 1 on 0 to 1, in unequal steps: mean 0, mean square 1/3, and the 95th percentile 0.9.
    #[test]
    fn analytic_figures_of_a_ramp_in_unequal_steps() {
        let t: Vec<f64> = (0..=1000).map(|k| (f64::from(k) / 1000.0).powi(2)).collect();
        let y: Vec<f64> = t.iter().map(|t| 2.0 * t - 1.0).collect();
        let of = |figure| compute(&metric(figure), &t, &y).unwrap();
        assert_eq!(of(Figure::Max), Found { value: 1.0, time: Some(1.0) });
        assert_eq!(of(Figure::Min), Found { value: -1.0, time: Some(0.0) });
        assert_eq!(of(Figure::MaxAbs), Found { value: 1.0, time: Some(0.0) });
        assert_eq!(of(Figure::PeakToPeak), Found { value: 2.0, time: Some(1.0) });
        assert_eq!(of(Figure::Final), Found { value: 1.0, time: Some(1.0) });
        // the trapezoidal rule is exact for lines, and errs by h²/6 of the mean square, h at most 0.004
        assert!(of(Figure::Mean).value.abs() < 1e-14);
        assert!((of(Figure::Rms).value.powi(2) - 1.0 / 3.0).abs() < 3e-6);
        assert!((of(Figure::StandardDeviation).value.powi(2) - 1.0 / 3.0).abs() < 3e-6);
        // exact for a ramp but for the difference of neighbouring steps
        assert!((of(Figure::Percentile).value - 0.9).abs() < 1e-6);
    }

    #[test]
    fn analytic_reference_and_window() {
        let t = [0.0, 0.1, 0.2, 0.1 + 0.2, 0.4];
        let y = [5.0, 1.0, 2.0, 4.0, 9.0];
        let mut it = Metric { from: Some(0.1), to: Some(0.3), ..metric(Figure::Max) };
        // 0.1 + 0.2 is above 0.3 by rounding only
        assert_eq!(compute(&it, &t, &y), Ok(Found { value: 4.0, time: Some(t[3]) }));
        it.reference = Some(3.5);
        it.figure = Some(Figure::MaxAbs);
        assert_eq!(compute(&it, &t, &y), Ok(Found { value: 2.5, time: Some(0.1) }));
        assert_eq!(first_beyond(&it, &t, &y, |x| x > 1.0), Some(0.1));
        it.figure = Some(Figure::Rms);
        assert_eq!(first_beyond(&it, &t, &y, |x| x > 1.0), None);
    }

    /// e^(-t) enters a band of 0.1 around 0 at ln 10 = 2.303.
    #[test]
    fn analytic_settling_of_an_exponential() {
        let t: Vec<f64> = (0..=10_000).map(|k| f64::from(k) * 1e-3).collect();
        let y: Vec<f64> = t.iter().map(|t| (-t).exp()).collect();
        let mut it = Metric { reference: Some(0.0), ..metric(Figure::SettlingTime) };
        let found = value(&it, &t, &y);
        assert!((found - 10.0_f64.ln()).abs() <= 1e-3, "{found}");
        it.from = Some(1.0);
        assert!((value(&it, &t, &y) - (10.0_f64.ln() - 1.0)).abs() <= 1e-3);
        it.band = Some(1e-9);
        let error = compute(&it, &t, &y).unwrap_err();
        assert!(matches!(error, FigureError::Unsettled { time: 10.0, .. }), "{error}");
        it.band = Some(2.0);
        assert_eq!(value(&it, &t, &y), 0.0);
    }

    #[test]
    fn refusal_values_that_are_missing_or_not_finite() {
        let it = Metric { from: Some(2.0), ..metric(Figure::Max) };
        let error = compute(&it, &[0.0, 1.0], &[0.0, 0.0]).unwrap_err();
        assert_eq!(error, FigureError::Empty { from: 2.0, to: 1.0, end: 1.0 });
        assert!(compute(&metric(Figure::Max), &[], &[]).is_err());
        let error = compute(&metric(Figure::Min), &[0.0, 1.0], &[0.0, f64::NAN]).unwrap_err();
        assert!(error.to_string().contains("NaN at 1 s"), "{error}");
        // outside of the window it does not matter
        let it = Metric { to: Some(0.5), ..metric(Figure::Min) };
        assert_eq!(value(&it, &[0.0, 1.0], &[3.0, f64::NAN]), 3.0);
    }

    proptest! {
        #[test]
        fn invariant_figures_lie_between_the_extremes(
            points in prop::collection::vec((0.001_f64..1.0, -5.0_f64..5.0), 1..40), p in 0.0_f64..100.0
        ) {
            let t: Vec<f64> = points.iter().scan(0.0, |t, (h, _)| { *t += h; Some(*t) }).collect();
            let y: Vec<f64> = points.iter().map(|point| point.1).collect();
            let (low, high) = (value(&metric(Figure::Min), &t, &y), value(&metric(Figure::Max), &t, &y));
            let it = Metric { percentile: Some(p), ..metric(Figure::Percentile) };
            for x in [value(&it, &t, &y), value(&metric(Figure::Mean), &t, &y)] {
                prop_assert!(low - 1e-12 <= x && x <= high + 1e-12);
            }
            let rms = value(&metric(Figure::Rms), &t, &y);
            prop_assert!(rms <= low.abs().max(high.abs()) + 1e-12);
        }
    }
}
