//! How the units were coupled.

use serde::{Deserialize, Serialize};

use super::AccuracyReport;

/// The algorithm as it ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AlgorithmSummary {
    /// Its name.
    pub name: String,
    /// Degree of the extrapolation.
    pub extrapolation: usize,
    /// Whether output derivatives were used.
    pub derivatives: bool,
    /// Order of the instances, for algorithms that step them one after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<String>,
    /// How step and algorithm were chosen, if the scenario asks for an accuracy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyReport>,
    /// Algebraic loops by their signals. Extrapolation breaks them.
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
    /// Convergence of each iterating algorithm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub iterations: Vec<Iteration>,
    /// Step control, if the step is variable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<ControlReport>,
    /// Residual energy of the scenario's pairs of effort and flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<PowerReport>,
}

/// Convergence of an iterating algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Iteration {
    /// Number of steps.
    pub steps: u64,
    /// Number of sweeps, at least one per step.
    pub sweeps: u64,
    /// Largest number of sweeps in one step.
    pub most: u32,
    /// Steps that did not converge within the allowed number of sweeps.
    pub unsettled: u64,
    /// Largest residual of such a step, relative to the tolerance.
    pub worst: f64,
    /// Number of Jacobians.
    pub jacobians: u64,
    /// Whether the last step converged.
    #[serde(skip)]
    pub settled: bool,
}

/// Accepted and rejected steps of a variable step size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ControlReport {
    /// Accepted steps.
    pub accepted: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Accepted steps whose error estimate exceeded the tolerance: steps of the smallest size, or of units
    /// that cannot undo a step.
    pub forced: u64,
    /// Smallest accepted step (s).
    pub smallest: f64,
    /// Largest accepted step (s).
    pub largest: f64,
}

/// The residual energy of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PowerReport {
    /// Number of pairs.
    pub pairs: usize,
    /// Transmitted energy, ∑ |e f| h (J).
    pub transmitted: f64,
    /// Residual energy, ∑ |δP| h (J).
    pub residual: f64,
    /// Net residual energy, ∑ δP h (J): positive if the coupling adds energy to the system.
    pub net: f64,
    /// Largest |δP| (W).
    pub largest: f64,
    /// Time of the largest |δP| (s).
    pub time_of_largest: f64,
}

/// An algebraic loop that was solved.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SolvedLoop {
    /// Its signals.
    pub signals: String,
    /// Number of sweeps.
    pub sweeps: u32,
    /// Number of sweeps followed by a step of Newton's method.
    pub newton: u32,
}
