//! How step and algorithm were chosen for an accuracy.

use serde::{Deserialize, Serialize};

/// The step and the algorithm that were chosen, and what was measured for it.
///
/// An error is that of the recorded signal that is worst: the RMS of the difference between a run and one with
/// half the step, relative to the RMS of the signal's deviation from its mean. It is an estimate, over the first
/// part of the run only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyReport {
    /// The error that the scenario allows.
    pub wanted: f64,
    /// The error that was estimated for what was chosen.
    pub estimate: f64,
    /// The signal that has it.
    pub signal: String,
    /// Time from the start over which it was measured (s).
    pub over: f64,
    /// What was chosen and what that means, in sentences.
    pub explanation: String,
    /// Everything that was tried, in order.
    pub trials: Vec<AccuracyTrial>,
}

/// An algorithm with a step, compared with half the step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AccuracyTrial {
    /// Name of the algorithm.
    pub algorithm: String,
    /// Communication step (s).
    pub step: f64,
    /// The largest error of a signal; none if a run failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// The signal that has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<String>,
    /// Wall time per simulated time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// Why a run failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}
