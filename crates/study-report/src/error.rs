//! Why the report of a study cannot be made.

use std::path::PathBuf;

use thiserror::Error;

/// Why the report of a study cannot be made.
#[derive(Debug, Error)]
pub enum StudyReportError {
    /// A file of the study cannot be read.
    #[error("cannot read {path}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// A file of the study does not have its form.
    #[error("{path} is damaged: {message}")]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with it, in words.
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

impl StudyReportError {
    /// Whether the input is the cause, not the machine.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Write { .. })
    }

    /// How to fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::Read { .. } => {
                "give the results folder of a study, which `maglev study run` writes"
            }
            Self::Damaged { .. } => {
                "run `maglev study run` again: it completes the files of a study"
            }
            Self::Write { .. } => "choose another file with --out",
        }
    }
}
