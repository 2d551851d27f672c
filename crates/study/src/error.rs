//! Why a study cannot be used.

use std::path::PathBuf;

use scenario::ScenarioError;
use thiserror::Error;

/// Why a study cannot be read, checked or computed.
#[derive(Debug, Error)]
pub enum StudyError {
    /// The study file cannot be read.
    #[error("cannot read the study {path}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// The study file is invalid by itself.
    #[error("invalid study")]
    File(#[source] ScenarioError),
    /// A key of the study file has a value that is not allowed.
    #[error("{path}: at {at}: {problem}")]
    Key {
        /// Path of the file.
        path: PathBuf,
        /// JSON path.
        at: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
    /// The base scenario cannot be read.
    #[error("cannot use the scenario of the study")]
    Scenario(#[source] ScenarioError),
    /// A table of points cannot be read.
    #[error("cannot read the table of points {path}: {problem}")]
    Table {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// A file that the points depend on cannot be read.
    #[error("cannot read {path}, which the points depend on")]
    Input {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// There is no point of that number.
    #[error("there is no point {number}: the study has the points 1 to {count}")]
    NoPoint {
        /// The number.
        number: u64,
        /// Number of points.
        count: u64,
    },
    /// A point does not make a valid scenario.
    #[error("point {number}: {problem}")]
    Point {
        /// Its number.
        number: u64,
        /// What is wrong.
        problem: String,
    },
    /// The scenario of the first point does not fit its units.
    #[error("the scenario of point {number} is invalid")]
    Setup {
        /// Its number.
        number: u64,
        /// What is wrong.
        #[source]
        source: master::Error,
    },
}

impl StudyError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Read { .. } => "give the path of a study file (.json)",
            Self::File(error) | Self::Scenario(error) => return error.help(),
            Self::Key { .. } => {
                "docs/studies.md explains the format; `maglev schema study` prints its schema"
            }
            Self::Table { .. } => "give a CSV or Parquet file with a column for each factor",
            Self::Input { .. } | Self::Point { .. } => return None,
            Self::NoPoint { .. } => "`maglev study points` lists the points",
            Self::Setup { source, .. } => return source.help(),
        })
    }

    /// The messages of this error and of its sources, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        results::causes(self)
    }
}
