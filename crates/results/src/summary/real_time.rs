//! How well a run kept to real time.

use serde::{Deserialize, Serialize};

/// How well a run kept to real time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealTime {
    /// Simulated seconds per second of wall time that were asked for.
    pub factor: f64,
    /// Steps that were held to it.
    pub steps: u64,
    /// Steps that ended later than due.
    pub overruns: u64,
    /// By how much the latest one was late (s).
    pub worst_seconds: f64,
    /// Mean lateness of the overruns (s).
    pub mean_seconds: f64,
    /// Overruns by their lateness.
    pub distribution: Vec<OverrunClass>,
}

/// Overruns of about the same lateness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OverrunClass {
    /// Upper limit (s); none for the last class.
    pub below_seconds: Option<f64>,
    /// Number of overruns.
    pub count: u64,
}
