//! Errors that prevent a check.

use std::path::PathBuf;

use fmi2_import::library::LibraryError;
use fmi2_import::package::PackageError;
use thiserror::Error;

/// Why the checks of behaviour cannot run.
#[derive(Debug, Error)]
pub enum CheckError {
    /// The archive or the description is damaged.
    #[error("cannot open the unit")]
    Package(#[from] PackageError),
    /// The binary cannot be loaded.
    #[error("cannot load the unit")]
    Library(#[from] LibraryError),
    /// No check has this name.
    #[error(
        "there is no check \"{id}\"{}",
        suggestion.map(|it| format!("; did you mean \"{it}\"?")).unwrap_or_default()
    )]
    Unknown {
        /// The name asked for.
        id: String,
        /// The nearest name.
        suggestion: Option<&'static str>,
    },
    /// A temporary folder or file cannot be written.
    #[error("cannot write {path}")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
}

impl CheckError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Package(error) => error.help(),
            Self::Library(error) => Some(error.help()),
            Self::Unknown { .. } => Some("`maglev validate --dynamic --rules` lists the checks"),
            Self::Write { .. } => Some("set TMPDIR to a writable folder"),
        }
    }
}

/// Violations of the standard in an FMU, in a run that does not tolerate them.
#[derive(Debug, Error)]
#[error(
    "{path} has {}, which a strict run does not allow: {}",
    if findings.len() == 1 { "an error".to_owned() } else { format!("{} errors", findings.len()) },
    findings.join("; ")
)]
pub struct Defects {
    /// Path of the .fmu file, as it was given.
    pub path: PathBuf,
    /// One message per violation.
    pub findings: Vec<String>,
}

impl Defects {
    /// How to fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        "`maglev validate` has the details; without --strict (or \"strict\" in the scenario) such units \
         run with a warning"
    }
}
