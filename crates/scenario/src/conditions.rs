//! How a run starts, is kept apart and is saved.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How loops between units are solved before the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Initialization {
    /// A loop is solved when every value changes by less than this, relative to itself or to a
    /// thousandth of its nominal value, whichever is larger.
    pub tolerance: f64,
    /// Sweeps over a loop before it counts as not solvable.
    pub iterations: u32,
}

impl Default for Initialization {
    fn default() -> Self {
        Self { tolerance: 1e-9, iterations: 100 }
    }
}

/// Units in processes of their own, where a crash, an exit or a step without end is caught.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Isolation")]
pub struct IsolationSettings {
    /// Isolate all instances that do not say otherwise.
    pub all: bool,
    /// Longest wall time for one step of an isolated instance (s); left out: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_timeout: Option<f64>,
    /// Longest wall time for any other call (s); left out: 60 s or `step_timeout`, whichever is
    /// longer, or no limit without `step_timeout`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub call_timeout: Option<f64>,
    /// Address space that an isolated instance may have (bytes); left out: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<u64>,
}

/// States of a run that are kept, so that `maglev resume` can go on from the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkpoints {
    /// Simulated time between two of them (s), rounded to whole steps, at least one.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
}
