//! Why a unit could not be checked at all.

use std::path::PathBuf;

use fmi2_import::library::LibraryError;
use fmi2_import::package::PackageError;
use thiserror::Error;

/// Why the checks of behaviour could not run.
#[derive(Debug, Error)]
pub enum CheckError {
    /// The unit's archive or description.
    #[error("cannot open the unit")]
    Package(#[from] PackageError),
    /// The unit's binary.
    #[error("cannot load the unit")]
    Library(#[from] LibraryError),
    /// No check has this name.
    #[error("there is no check \"{id}\"; the checks are: {known}")]
    Unknown {
        /// The name asked for.
        id: String,
        /// The names of all checks.
        known: String,
    },
    /// A temporary folder or a file in it.
    #[error("cannot write {path}")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
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
            Self::Write { .. } => Some("set TMPDIR to a folder that can be written"),
        }
    }
}

/// Errors that `maglev validate` finds in a unit, where a run tolerates none.
#[derive(Debug, Error)]
#[error(
    "{path} has {} that a strict run does not tolerate: {}",
    if findings.len() == 1 { "a defect".to_owned() } else { format!("{} defects", findings.len()) },
    findings.join("; ")
)]
pub struct Defects {
    /// Path of the .fmu file, as it was given.
    pub path: PathBuf,
    /// One message per defect.
    pub findings: Vec<String>,
}

impl Defects {
    /// How to fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        "`maglev validate` says more; without --strict (or \"strict\" in the scenario) they are tolerated"
    }
}
