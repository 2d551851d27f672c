//! What changes while a bundle steps.

use bundle_table::Value;
use master::SimulationState;
use serde::{Deserialize, Serialize};

/// What the importer sets up before initialization.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Times {
    /// Start time (s).
    pub(crate) start: f64,
    /// Stop time (s).
    pub(crate) stop: Option<f64>,
    /// Relative tolerance.
    pub(crate) tolerance: Option<f64>,
}

/// The state of a bundle. The units keep theirs; it is put here when the state is saved.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct State {
    pub(crate) times: Times,
    /// values of tunable parameters and discrete inputs that the units have
    pub(crate) applied: Vec<Value>,
    /// time of the saved state (s)
    pub(crate) time: f64,
    pub(crate) saved: Option<SimulationState>,
}
