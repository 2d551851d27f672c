//! Why a report cannot be made.

use std::path::PathBuf;

use thiserror::Error;

/// Why a report cannot be made.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The folder is not there, or nothing in it is a result.
    #[error("{folder} is no folder with results: it has neither summary.json nor a table")]
    NoResults {
        /// Folder that was given as results.
        folder: PathBuf,
    },
    /// The folder has files of several runs.
    #[error(
        "the files in {folder} are not of one run: {file} {found}, and run-files.json is of run {run}"
    )]
    Mixed {
        /// Folder that was given as results.
        folder: PathBuf,
        /// The file that does not fit.
        file: String,
        /// What it is instead.
        found: String,
        /// The run that the folder belongs to.
        run: String,
    },
    /// A file of the results cannot be read.
    #[error("{path} cannot be read")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// A JSON file is not what it should be.
    #[error("{path} is not as a run writes it: {message}")]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, with line and column.
        message: String,
    },
    /// The table is not as a run writes it.
    #[error("{path} is not as a run writes it: row {row}, column {column}: {message}")]
    Table {
        /// Path of the file.
        path: PathBuf,
        /// Row, the header is 1.
        row: usize,
        /// Header of the column, the name of a signal.
        column: String,
        /// What is wrong with the file, in words.
        message: String,
    },
    /// results.parquet cannot be read.
    #[error("{path} cannot be read")]
    Parquet {
        /// Path of the file.
        path: PathBuf,
        /// What the Parquet library reported.
        #[source]
        source: parquet::errors::ParquetError,
    },
    /// A unit's file is not as it should be.
    #[error("the unit {path} cannot be used for the report: {message}")]
    Unit {
        /// Path of the .fmu file.
        path: PathBuf,
        /// What is wrong with the file, in words.
        message: String,
    },
    /// A figure cannot be drawn.
    #[error("the figure {name} cannot be drawn: {message}")]
    Picture {
        /// File name of the picture.
        name: String,
        /// What the drawing library reported.
        message: String,
    },
    /// The report cannot be written.
    #[error("the report cannot be written to {path}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
}

impl ReportError {
    /// Whether the cause lies in what was asked for, not in the machine.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Write { .. })
    }

    /// All causes, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        let mut chain = Vec::new();
        let mut next: Option<&dyn std::error::Error> = Some(self);
        while let Some(error) = next {
            chain.push(error.to_string());
            next = error.source();
        }
        chain
    }

    /// How to mend it, where that can be said.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::NoResults { .. } => Some(
                "give the folder that `maglev run SCENARIO --out DIR` wrote: it has summary.json and \
                 results.csv or results.parquet",
            ),
            Self::Mixed { .. } => Some(
                "put back the files of one run, or run the scenario again; a table that was edited \
                 belongs in another folder",
            ),
            Self::Json { .. } | Self::Table { .. } | Self::Parquet { .. } => {
                Some("run the scenario again; files of results are not meant to be edited")
            }
            Self::Unit { .. } => Some("run `maglev validate` on the unit"),
            Self::Read { .. } | Self::Picture { .. } => None,
            Self::Write { .. } => Some("choose another file with --out"),
        }
    }
}
