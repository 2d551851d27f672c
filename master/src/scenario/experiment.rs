//! The span of time of a run and its division.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ScenarioError;

/// The span of time and its division.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Start time (s).
    #[serde(default)]
    pub start: f64,
    /// Stop time (s).
    pub stop: f64,
    /// Communication step (s); `stop - start` must be a multiple of it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step: f64,
}

impl Experiment {
    /// Number of communication steps.
    ///
    /// # Errors
    /// The numbers make no sense, or the step does not divide the span within 1e-9 relative.
    pub fn steps(&self) -> Result<u64, ScenarioError> {
        let Self { start, stop, step } = *self;
        let span = stop - start;
        if !(step > 0.0 && step.is_finite() && span.is_finite() && span > 0.0) {
            return Err(ScenarioError::Experiment { start, stop, step });
        }
        let count = (span / step).round();
        // 2^53: beyond it, not every integer is a float
        if count > 9.007_199_254_740_992e15 {
            return Err(ScenarioError::Experiment { start, stop, step });
        }
        if count < 1.0 || (count * step - span).abs() > 1e-9 * span {
            return Err(ScenarioError::StepDoesNotDivide { start, stop, step });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 2^53")]
        Ok(count as u64)
    }
}
