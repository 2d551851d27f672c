//! How a check ends, and what it found.

use serde::{Deserialize, Serialize};

use fmi2_import::description::Severity;

/// Why a check returned early.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Stop {
    /// A finding after which the check cannot continue.
    Fault(String),
    /// The check does not apply to this FMU, and why.
    Skip(String),
}

/// The end of a check. Findings that did not end it are with the bench.
pub(crate) type CheckResult = Result<(), Stop>;

/// A finding of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Observation {
    /// Severity, which decides the exit status.
    pub severity: Severity,
    /// What the FMU did, and what the standard expects.
    pub message: String,
    /// The last calls before the finding, oldest first.
    pub calls: Vec<String>,
}

/// Ends a check with a finding.
pub(crate) fn fault<T>(message: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::Fault(message.into()))
}

/// Ends a check that does not apply to the FMU.
pub(crate) fn skip<T>(reason: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::Skip(reason.into()))
}
