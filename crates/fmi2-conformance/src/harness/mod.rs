//! Dynamic conformance suite: drives a unit through its C functions as no sane importer would.
//!
//! A [`Check`] is one small named function with its place in the FMI 2.0.5 text. [`checks`] lists
//! all of them. [`run`] starts each check in a process of its own with a limit of time, so that a
//! unit that crashes, exits or hangs is a finding, and not the end of the suite; [`child`] is what
//! runs there.
//!
//! Checks know nothing of what a unit models. They use its description: capabilities that it does
//! not promise are not tested, and that is said.

pub(crate) mod bench;
pub(crate) mod drive;
pub(crate) mod log;
pub(crate) mod raw;
pub(crate) mod resume;
mod runner;
pub(crate) mod trace;

use serde::{Deserialize, Serialize};

pub use crate::checks::checks;
pub use bench::Bench;
use fmi2_import::description::Severity;
pub use resume::resume;
pub use runner::{CheckOutcome, ConformanceOptions, ConformanceReport, child, run};

/// One check.
pub struct Check {
    /// Name for `--only` and in findings, such as `step-past-stop`.
    pub id: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// How grave a finding is, unless the check says otherwise.
    pub severity: Severity,
    /// What it does and expects.
    pub expects: &'static str,
    /// Runs it.
    pub run: fn(&Bench) -> CheckResult,
}

/// Why a check ended before its end.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stop {
    /// A finding.
    Fault(String),
    /// There is nothing to test.
    Skip(String),
}

/// End of a check; findings so far are with the bench.
pub type CheckResult = Result<(), Stop>;

/// A finding of a check, with the calls that lead to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Observation {
    /// Severity, which decides the exit status.
    pub severity: Severity,
    /// What the FMU did, and what the standard expects.
    pub message: String,
    /// The last calls, oldest first.
    pub calls: Vec<String>,
}

/// Ends a check with a finding.
pub(crate) fn fault<T>(message: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::Fault(message.into()))
}

/// Ends a check that has nothing to test.
pub(crate) fn skip<T>(reason: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::Skip(reason.into()))
}
