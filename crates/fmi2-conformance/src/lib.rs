//! Checks whether FMI 2.0 co-simulation FMUs conform to the standard.
//!
//! [`check()`] applies the [`rules()`] to a file: archive, description, symbols of the binary. It loads nothing.
//! [`runner::run`] loads the FMU and calls its C functions as the [`checks()`] demand, each check in a separate
//! process. [`mod@reference`] repeats the experiments whose results an FMU contains.

#![expect(clippy::result_large_err, reason = "errors carry their context, and are rare")]

mod checks;
mod error;
mod harness;
pub mod reference;
mod rules;
pub mod runner;

use std::path::Path;

use fmi2_import::description::Severity;

pub use checks::checks;
pub use error::{CheckError, Defects};
pub use harness::{Check, Observation};
pub use rules::{Rule, Unreadable, check, rules};

/// Refuses an FMU that violates the standard. `file` is its archive, and `path` the unit in messages.
///
/// # Errors
/// All findings of severity error.
pub fn refuse_defects(path: &Path, file: &Path) -> Result<(), Defects> {
    let findings: Vec<String> = match check(file) {
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
    Err(Defects { path: path.to_owned(), findings })
}
