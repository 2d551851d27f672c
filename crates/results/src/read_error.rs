//! Why a results folder cannot be read.

use std::path::PathBuf;

use thiserror::Error;

/// Why a results folder cannot be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The folder does not exist, or a run has written nothing to it.
    #[error("{folder} is not a results folder: it contains neither summary.json nor a table")]
    NoResults {
        /// The folder, as it was given.
        folder: PathBuf,
    },
    /// The folder contains files of several runs.
    #[error(
        "the files in {folder} belong to different runs: run-files.json names run {run}, but {file} {found}"
    )]
    Mixed {
        /// The folder, as it was given.
        folder: PathBuf,
        /// Name of the file that does not belong to the run.
        file: String,
        /// What it is instead.
        found: String,
        /// The run that the folder belongs to.
        run: String,
    },
    /// The operating system does not let a file be read.
    #[error("cannot read {path}")]
    File {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// A JSON file is damaged, or another program wrote it.
    #[error("{path} is damaged: {message}")]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// The error with line and column.
        message: String,
    },
    /// The table is damaged, or another program wrote it.
    #[error("{path} is damaged: row {row}, column {column}: {message}")]
    Table {
        /// Path of the file.
        path: PathBuf,
        /// Number of the row; the header is 1.
        row: usize,
        /// Header of the column, the name of a signal.
        column: String,
        /// What is wrong there.
        message: String,
    },
    /// The Parquet library cannot read results.parquet.
    #[error("cannot read {path}")]
    Parquet {
        /// Path of the file.
        path: PathBuf,
        /// What the library reported.
        #[source]
        source: parquet::errors::ParquetError,
    },
}

impl ReadError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::NoResults { .. } => Some(
                "give the folder that `maglev run SCENARIO --out DIR` wrote: it contains summary.json and \
                 results.csv or results.parquet",
            ),
            Self::Mixed { .. } => Some(
                "put back the files of one run, or run the scenario again; keep edited tables in another \
                 folder",
            ),
            Self::Json { .. } | Self::Table { .. } | Self::Parquet { .. } => {
                Some("run the scenario again; results files are not meant to be edited")
            }
            Self::File { .. } => None,
        }
    }
}
