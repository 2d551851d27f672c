//! What the checks of behaviour work with.
//!
//! [`Bench`] holds the loaded FMU, [`raw::Raw`] calls the C functions of one instance without preventing any
//! call, and [`drive`] has the ordinary run that most checks start from. Checks know nothing of what an FMU models.
//! They use its description, and skip capabilities that it does not declare.

pub(crate) mod bench;
pub(crate) mod drive;
pub(crate) mod log;
pub(crate) mod raw;
pub(crate) mod resume;
pub(crate) mod trace;
mod verdict;

use fmi2_import::description::Severity;

use bench::Bench;
pub use verdict::Observation;
pub(crate) use verdict::{CheckResult, Stop, fault, skip};

/// A check of an FMU's behaviour: one small function with its place in the standard.
pub struct Check {
    /// Name for `--only` and in findings, such as `step-past-stop`.
    pub id: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// Severity of its findings, unless the check reports another one.
    pub severity: Severity,
    /// The expected behaviour, one line of the table of checks.
    pub expects: &'static str,
    pub(crate) run: fn(&Bench) -> CheckResult,
}

/// Declares the checks of a file as `CHECKS`.
macro_rules! table {
    ($($id:literal, $section:literal, $severity:ident, $expects:literal, $run:expr;)*) => {
        pub(super) const CHECKS: &[$crate::harness::Check] = &[$($crate::harness::Check {
            id: $id,
            section: $section,
            severity: fmi2_import::description::Severity::$severity,
            expects: $expects,
            run: $run,
        }),*];
    };
}
pub(crate) use table;
