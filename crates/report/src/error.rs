//! Why a report cannot be made.

use std::path::PathBuf;

use results::ReadError;
use thiserror::Error;

/// Why a report cannot be made.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The results cannot be read.
    #[error(transparent)]
    Results(#[from] ReadError),
    /// The file of a unit is damaged or not what it was.
    #[error("cannot read the unit {path} for the report: {message}")]
    Fmu {
        /// Path of the .fmu file.
        path: PathBuf,
        /// What is wrong with the file, in words.
        message: String,
    },
    /// A figure cannot be drawn.
    #[error("cannot draw the figure {name}: {message}")]
    Picture {
        /// File name of the picture.
        name: String,
        /// What the drawing library reported.
        message: String,
    },
    /// The report cannot be written.
    #[error("cannot write the report to {path}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
}

impl ReportError {
    /// Whether the input is the cause, not the machine.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Write { .. })
    }

    /// All causes, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        results::causes(self)
    }

    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Results(error) => error.help(),
            Self::Fmu { .. } => Some("run `maglev validate` on the unit"),
            Self::Picture { .. } => None,
            Self::Write { .. } => Some("choose another file with --out"),
        }
    }
}
