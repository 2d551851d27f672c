//! Why a record cannot be compared with a run.

use std::path::PathBuf;

use fmi2_import::description::UnitMismatch;
use sources::SourceError;
use thiserror::Error;

/// Why a record cannot be compared with a run.
#[derive(Debug, Error)]
pub enum MeasuredError {
    /// The file with columns and signals cannot be read.
    #[error("cannot read {path}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// The file with columns and signals is invalid.
    #[error("{path}: {problem}")]
    Spec {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// The record cannot be read.
    #[error("cannot use the record")]
    Record(#[from] SourceError),
    /// No column of the record belongs to a signal.
    #[error("no column of {path} has the name of a recorded signal; its columns: {}", columns.join(", "))]
    NothingMapped {
        /// Path of the record.
        path: PathBuf,
        /// Its columns.
        columns: Vec<String>,
    },
    /// A signal is not recorded.
    #[error("the run has not recorded \"{signal}\", to which the column \"{column}\" is mapped{}",
        suggestion.as_ref().map(|it| format!("; did you mean \"{it}\"?")).unwrap_or_default())]
    Signal {
        /// The signal.
        signal: String,
        /// The column.
        column: String,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// Two columns are mapped to one signal.
    #[error("two columns are mapped to \"{signal}\"")]
    Twice {
        /// The signal.
        signal: String,
    },
    /// Units cannot be converted.
    #[error("{path}, column \"{column}\": cannot convert to the unit of {signal}")]
    Unit {
        /// Path of the record.
        path: PathBuf,
        /// The column.
        column: String,
        /// The signal.
        signal: String,
        /// Why.
        #[source]
        source: UnitMismatch,
    },
    /// Record and run have no time in common.
    #[error(
        "{column} of {path} has {inside} values during the run: the record with its offset of {offset} s is from {from} to \
         {to} s, the run from {start} to {stop} s"
    )]
    NoOverlap {
        /// Path of the record.
        path: PathBuf,
        /// The column.
        column: String,
        /// Values of the record during the run.
        inside: usize,
        /// The offset (s).
        offset: f64,
        /// Begin of the record in the run's time (s).
        from: f64,
        /// End of the record (s).
        to: f64,
        /// Begin of the run's signal (s).
        start: f64,
        /// End of the run's signal (s).
        stop: f64,
    },
    /// The offset cannot be found.
    #[error("cannot find the offset of {path} by cross-correlation")]
    Offset {
        /// Path of the record.
        path: PathBuf,
        /// Why.
        #[source]
        source: analysis::Error,
    },
    /// The best correlation is too low to be an alignment.
    #[error(
        "cannot find the offset of {path} by cross-correlation: the best correlation coefficient is {correlation:.2}, at \
         an offset of {offset:.4} s"
    )]
    Unrelated {
        /// Path of the record.
        path: PathBuf,
        /// The coefficient.
        correlation: f64,
        /// Its offset (s).
        offset: f64,
    },
}

impl MeasuredError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Read { .. } | Self::Spec { .. } => {
                "docs/measured.md explains the format: \"file\", \"time\", \"offset\", \"signals\""
            }
            Self::Record(SourceError::Csv { .. } | SourceError::Open { .. }) => {
                "give the path of a CSV file with a header line, or of a Parquet file (.parquet)"
            }
            Self::Record(SourceError::Column { .. }) => {
                "name the column of times with --time-column COLUMN, and columns with --map 'COLUMN=INSTANCE.VARIABLE'"
            }
            Self::Record(error) => return error.help(),
            Self::NothingMapped { .. } => {
                "map columns to signals: --map 'COLUMN=INSTANCE.VARIABLE', with a unit as in 'gap=vehicle.gap_01:mm'"
            }
            Self::Signal { .. } => "record it (\"record\" in the scenario), or map another signal",
            Self::Twice { .. } => "map one column to a signal",
            Self::Unit { .. } => {
                "name the unit of the column after the signal: --map 'gap=vehicle.gap_01:mm'"
            }
            Self::NoOverlap { .. } => {
                "give the seconds to add to the record's times with --offset, or find them with --offset find"
            }
            Self::Offset { .. } | Self::Unrelated { .. } => "give it with --offset SECONDS",
        })
    }

    /// The messages of this error and of its sources, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        results::causes(self)
    }
}
