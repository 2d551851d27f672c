//! How the units were coupled.

use serde::{Deserialize, Serialize};

/// The algorithm as it ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AlgorithmSummary {
    /// Its name.
    pub name: String,
    /// Degree of the extrapolation.
    pub extrapolation: usize,
    /// Whether output derivatives were asked for.
    pub derivatives: bool,
    /// Sequence of the instances, for algorithms that have one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<String>,
    /// Signals in loops of direct feed-through, which are cut by extrapolation.
    pub algebraic_loops: Vec<String>,
    /// How the coupling went.
    #[serde(flatten)]
    pub coupling: CouplingSummary,
}

/// How the coupling went.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CouplingSummary {
    /// Threads that stepped units.
    pub threads: usize,
    /// Which capability of which unit limits the coupling.
    pub limits: Vec<String>,
    /// Of the algorithms that iterate, one after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub iterations: Vec<Iteration>,
    /// Of a variable step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<ControlReport>,
    /// Residual energy of the pairs of effort and flow that the scenario names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<PowerReport>,
}

/// How an iterating algorithm fares.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Iteration {
    /// Steps made.
    pub steps: u64,
    /// Sweeps made; one per step is the least.
    pub sweeps: u64,
    /// Most sweeps in one step.
    pub most: u32,
    /// Steps that had not settled when their sweeps were used up.
    pub unsettled: u64,
    /// Largest residual left in such a step, in units of what the tolerance allows.
    pub worst: f64,
    /// Jacobians made.
    pub jacobians: u64,
    /// Whether the last step settled.
    #[serde(skip)]
    pub settled: bool,
}

/// How step control fares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ControlReport {
    /// Steps that stand.
    pub accepted: u64,
    /// Steps made again.
    pub rejected: u64,
    /// Steps that stand although the estimate was beyond the tolerance: the smallest allowed, or of
    /// units that cannot go back.
    pub forced: u64,
    /// Smallest step that stands (s).
    pub smallest: f64,
    /// Largest step that stands (s).
    pub largest: f64,
}

/// The residual energy of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PowerReport {
    /// Number of pairs.
    pub pairs: usize,
    /// Energy transmitted, ∑ |e f| h (J).
    pub transmitted: f64,
    /// Residual energy, ∑ |δP| h (J).
    pub residual: f64,
    /// The same with signs, ∑ δP h (J): what the coupling adds to (positive) or takes out of the
    /// system.
    pub net: f64,
    /// Largest |δP| (W).
    pub largest: f64,
    /// When that was (s).
    pub time_of_largest: f64,
}

/// A loop that was solved.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SolvedLoop {
    /// Its signals.
    pub signals: String,
    /// Sweeps that it took.
    pub sweeps: u32,
    /// How many of them Newton's method followed.
    pub newton: u32,
}
