//! Checks FMI 2.0 co-simulation units.
//!
//! [`rules`] look at what a unit says: its archive, its description, the symbols of its binary. Nothing is
//! loaded. [`harness`] drives a unit through its C functions with the [`checks`], each in a process of its
//! own. [`reference`] repeats the experiments whose results a unit carries.

#![expect(clippy::result_large_err, reason = "errors name all that they concern, and end a check")]

mod checks;
mod error;
mod harness;
pub mod reference;
mod rules;
pub mod runner;

use fmi2_import::description::Severity;
use fmi2_import::package::Package;

pub use checks::checks;
pub use error::{CheckError, Defects};
pub use harness::{Check, Observation};
pub use rules::{Rule, Unreadable, check, rules};

/// Refuses a unit in which a rule finds an error: something that the standard forbids.
///
/// # Errors
/// All of them.
pub fn refuse_defects(package: &Package) -> Result<(), Defects> {
    let findings: Vec<String> = match check(package.path()) {
        Ok(found) => found
            .into_iter()
            .filter(|finding| finding.severity == Severity::Error)
            .map(|finding| finding.message)
            .collect(),
        Err(error) => vec![error.to_string()],
    };
    if findings.is_empty() {
        return Ok(());
    }
    Err(Defects { path: package.path().to_owned(), findings })
}
