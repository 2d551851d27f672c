//! Why reference results cannot be used or computed.

use thiserror::Error;

use fmi2_import::instance::FmuError;
use fmi2_import::library::LibraryError;
use fmi2_import::package::REFERENCE_RESULTS;

/// Why reference results cannot be used or computed.
#[derive(Debug, Error)]
pub enum ReferenceError {
    /// A file of reference results is damaged or cannot be read.
    #[error("{file}: {message}")]
    File {
        /// Name of the reference file.
        file: String,
        /// What is wrong with the file, in words.
        message: String,
    },
    /// The FMU contains no reference results.
    #[error("{unit} contains no reference results (no experiment in {})", REFERENCE_RESULTS)]
    None {
        /// Path of the .fmu file, as it was given.
        unit: String,
    },
    /// A column that is not a Real variable of the FMU.
    #[error(
        "a reference file has a column {variable}, but the unit has no Real variable of that name"
    )]
    Unknown {
        /// Column that names no variable of the FMU.
        variable: String,
    },
    /// A time of the reference that is not a communication point.
    #[error("{0}")]
    Times(String),
    /// The binary cannot be loaded.
    #[error("cannot load the unit")]
    Library(#[from] LibraryError),
    /// The FMU failed while it repeated the experiment.
    #[error("the unit failed")]
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
                "units packed by `cargo xtask package` contain them; run other units in a scenario"
            }
            _ => "package the unit again with correct files of reference results",
        })
    }
}
