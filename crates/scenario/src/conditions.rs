//! Initialization, isolation and checkpoints of a run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How loops between units are solved during initialization.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Initialization {
    /// Relative tolerance. A loop is solved when every value changes by less than this fraction of the value or of a
    /// thousandth of its nominal value, whichever is larger.
    pub tolerance: f64,
    /// Largest number of iterations. A loop that has not converged by then is an error.
    pub iterations: u32,
}

impl Default for Initialization {
    fn default() -> Self {
        Self { tolerance: 1e-9, iterations: 100 }
    }
}

/// Units in separate processes, so that a crash, an exit or an endless step does not end the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Isolation")]
pub struct IsolationSettings {
    /// Isolate all instances, except those with `isolate: false`.
    pub all: bool,
    /// Longest wall time of a step of an isolated instance (s). Default: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_timeout: Option<f64>,
    /// Longest wall time of any other call (s). Default: 60 s or `step_timeout`, whichever is longer; without
    /// `step_timeout`, no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub call_timeout: Option<f64>,
    /// Largest address space of the process of an isolated instance (bytes). Default: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<u64>,
}

/// Saved states of a run. `maglev resume` continues from the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkpoints {
    /// Simulated time between two checkpoints (s), rounded to whole steps, at least one.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
}
