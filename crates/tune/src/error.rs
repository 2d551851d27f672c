//! Errors of tuning.

use std::io;
use std::path::PathBuf;

use linear::LinearError;
use response::ResponseError;
use results::JournalError;
use stability_map::MapError;
use strict_json::JsonError;
use thiserror::Error;

/// A controller cannot be tuned.
#[derive(Debug, Error)]
pub enum TuneError {
    /// The tuning file cannot be read.
    #[error("cannot read the tuning file {path}")]
    Read {
        /// Its path.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// The tuning file is not JSON, or has other keys or values than the format.
    #[error("invalid tuning file {path}")]
    Json {
        /// Its path.
        path: PathBuf,
        /// What is wrong, and where.
        #[source]
        source: JsonError,
    },
    /// A value of the file or of an option.
    #[error("{key}: {problem}")]
    Value {
        /// What has the value: a key of the file.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The scenario under a condition.
    #[error("condition {name}")]
    Condition {
        /// Its name.
        name: String,
        /// The reason.
        #[source]
        source: Box<Self>,
    },
    /// The scenario.
    #[error(transparent)]
    Master(#[from] master::Error),
    /// The linearisation.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// A unit alone with other values.
    #[error(transparent)]
    Unit(#[from] maps::Error),
    /// Margins.
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// Eigenvalues.
    #[error(transparent)]
    Numerics(#[from] MapError),
    /// Units that cannot be tuned.
    #[error("cannot tune {instance}: {problem}")]
    Units {
        /// The instance.
        instance: String,
        /// Why.
        problem: String,
    },
    /// No point to start from.
    #[error("no stable set of values was found: {tried} were tried within the bounds")]
    Unstable {
        /// How many.
        tried: usize,
    },
    /// The minimiser failed.
    #[error("the search ended without a result: {status}")]
    Search {
        /// What it reported.
        status: String,
    },
    /// Evaluations that an earlier run has finished.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

impl TuneError {
    pub(crate) fn value(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Value { key: key.into(), problem: problem.into() }
    }

    /// What to do.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Condition { source, .. } => source.help(),
            Self::Master(error) => error.help(),
            Self::Linear(error) => error.help(),
            Self::Unit(error) => error.help(),
            Self::Response(error) => error.help(),
            Self::Json { .. } | Self::Value { .. } => {
                Some("docs/tuning.md explains the keys; `maglev schema tuning` prints their schema")
            }
            Self::Unstable { .. } => Some(
                "widen the bounds, or vary other parameters; `maglev map` shows where modes grow",
            ),
            Self::Journal(error) => error.help(),
            _ => None,
        }
    }

    /// The error of the scenario itself.
    ///
    /// # Errors
    /// It is another one, which is returned.
    pub fn into_master(self) -> Result<master::Error, Self> {
        match self {
            Self::Master(error) | Self::Linear(LinearError::Start(error)) => Ok(error),
            Self::Unit(maps::Error::Master(error)) => Ok(error),
            other => Err(other),
        }
    }
}
