//! How well a run kept up with real time.

use serde::{Deserialize, Serialize};

/// How well a run kept up with real time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealTime {
    /// Requested simulated seconds per second of wall time.
    pub factor: f64,
    /// Number of steps.
    pub steps: u64,
    /// Steps that finished late.
    pub overruns: u64,
    /// Largest delay (s).
    pub worst_seconds: f64,
    /// Mean delay of the late steps (s).
    pub mean_seconds: f64,
    /// Late steps by their delay.
    pub distribution: Vec<OverrunClass>,
}

/// Number of late steps in a range of delays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OverrunClass {
    /// Upper limit of the delay (s); none for the last range.
    pub below_seconds: Option<f64>,
    /// Number of late steps.
    pub count: u64,
}
