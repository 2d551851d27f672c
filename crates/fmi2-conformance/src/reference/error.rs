//! Why reference results cannot be used or computed.

use thiserror::Error;

use fmi2_import::instance::FmuError;
use fmi2_import::library::LibraryError;
use fmi2_import::package::REFERENCE_RESULTS;

/// Why reference results cannot be used or computed.
#[derive(Debug, Error)]
pub enum ReferenceError {
    /// A file cannot be read.
    #[error("{file}: {message}")]
    File {
        /// Name of the reference file.
        file: String,
        /// What is wrong with the file, in words.
        message: String,
    },
    /// The unit carries no reference results.
    #[error("unit {unit} carries no reference results (no experiment in {})", REFERENCE_RESULTS)]
    None {
        /// Path of the .fmu file, as it was given.
        unit: String,
    },
    /// A column that is no Real variable of the unit.
    #[error("the unit has no Real variable {variable}, which a reference file names")]
    Unknown {
        /// Column that names no variable of the FMU.
        variable: String,
    },
    /// Times that do not fit.
    #[error("{0}")]
    Times(String),
    /// The unit's binary.
    #[error("the unit cannot be loaded")]
    Library(#[from] LibraryError),
    /// The FMU failed while it repeated the experiment.
    #[error("the unit fails")]
    Unit(#[from] FmuError),
}

impl ReferenceError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Library(error) => error.help(),
            Self::Unit(error) => return error.fault().help(),
            Self::None { .. } => {
                "units packed by `cargo xtask package` carry them; run others in a scenario"
            }
            _ => "the unit's files of reference results are damaged; package it again",
        })
    }
}
