//! Start, stop and communication step of a run.

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};

use crate::ScenarioError;
use fmi2_import::span::between;

/// Start, stop and communication step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = allow_to_leave_out)]
pub struct Experiment {
    /// Start time (s). Default: 0; if `stop` is left out too, the smallest `startTime` in the units'
    /// `DefaultExperiment`.
    #[serde(default)]
    pub start: f64,
    /// Stop time (s). Default: the largest `stopTime` in the units' `DefaultExperiment`.
    pub stop: f64,
    /// Communication step (s). `stop - start` must be a multiple of it. Default: the smallest `stepSize` in the units'
    /// `DefaultExperiment`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step: f64,
    /// Relative tolerance for the internal integration of all units. Default: the `tolerance` in each unit's
    /// `DefaultExperiment`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: Option<f64>,
}

/// Members may be left out of a file: [`suggestions`](super::suggestions) completes them.
fn allow_to_leave_out(schema: &mut Schema) {
    schema.remove("required");
}

impl Experiment {
    /// Number of communication steps.
    ///
    /// # Errors
    /// The times do not describe a run, or the span is not a multiple of the step within 1e-9 relative.
    pub fn steps(&self) -> Result<u64, ScenarioError> {
        let Self { start, stop, step, .. } = *self;
        let span = stop - start;
        if !(step > 0.0 && step.is_finite() && span.is_finite() && span > 0.0) {
            return Err(ScenarioError::Experiment { start, stop, step });
        }
        let count = (span / step).round();
        // 2^53: beyond it, not every integer is a float
        if count > 9.007_199_254_740_992e15 {
            return Err(ScenarioError::TooManySteps { count });
        }
        if count < 1.0 || (count * step - span).abs() > 1e-9 * span {
            return Err(ScenarioError::StepDoesNotDivide { start, stop, step });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 2^53")]
        Ok(count as u64)
    }

    /// Time of a communication point (s), counted from the start; never after the stop time.
    #[must_use]
    pub fn time(&self, point: u64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "steps() allows at most 2^53")]
        let elapsed = point as f64 * self.step;
        (self.start + elapsed).min(self.stop)
    }

    /// Size of the step from a communication point to the next (s).
    #[inline]
    #[must_use]
    pub fn size(&self, point: u64) -> f64 {
        between(self.time(point), self.time(point + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Common steps and spans from several start times. Where the step divides the span, no step ends after the stop
    /// time as a unit computes it. The last one ends at the stop time, or before it by the rounding of n·h. From a
    /// start at 0, every step begins where the one before ended.
    #[test]
    fn invariant_no_step_ends_beyond_the_stop_time() {
        let mut steps = vec![1e-1, 1e-2, 1e-3, 2e-3, 5e-3, 2.5e-3, 4e-3, 2e-2, 5e-2, 2e-1, 0.7e-3];
        steps.extend([3.0, 7.0, 24.0, 30.0, 50.0, 60.0].map(|rate| 1.0 / rate));
        let stops =
            [0.3, 0.6, 0.7, 1.0, 1.1, 2.0, 3.0, 5.0, 7.0, 10.0, 12.6, 20.0, 30.0, 60.0, 100.0];
        let (mut spans, mut beyond) = (0, 0);
        for step in steps {
            for (start, stop) in stops
                .iter()
                .flat_map(|stop| [0.0, 0.1, -1.0, 2.7, 1e3].map(|start: f64| (start, start + stop)))
            {
                let experiment = Experiment { start, stop, step, tolerance: None };
                let Ok(count) = experiment.steps() else { continue };
                spans += 1;
                let last = experiment.time(count - 1);
                beyond += u32::from(last + step > stop);
                let mut ended = start;
                for n in 0..count {
                    let (time, size) = (experiment.time(n), experiment.size(n));
                    assert!(time + size <= stop && size > 0.0, "{start} {stop} {step} {n}");
                    assert!((size - step).abs() < 1e-9 * step, "{start} {stop} {step} {n}");
                    assert!(start != 0.0 || time == ended, "{start} {stop} {step} {n}");
                    ended = time + size;
                }
                let rounding = f64::EPSILON * stop.abs().max(start.abs());
                assert!(stop - ended <= 2.0 * rounding, "{start} {stop} {step}: {ended}");
            }
        }
        // the fault is common: a constant step would have gone beyond in many of them
        assert!(spans > 300 && beyond > 60, "{beyond} of {spans}");
    }
}
