//! Errors of maps.

use std::io;
use std::path::PathBuf;

use fmi2_import::instance::FmuError;
use fmi2_import::library::LibraryError;
use linear::LinearError;
use results::JournalError;
use stability_map::MapError;
use thiserror::Error;

/// A map cannot be computed.
#[derive(Debug, Error)]
pub enum Error {
    /// The scenario.
    #[error(transparent)]
    Master(#[from] master::Error),
    /// The linearisation.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// The numerics.
    #[error(transparent)]
    Map(#[from] MapError),
    /// A unit refuses a value of an axis.
    #[error("{instance} does not accept {target} = {value}")]
    Value {
        /// The instance.
        instance: String,
        /// The parameter.
        target: String,
        /// Its value.
        value: f64,
        /// What the unit answered.
        #[source]
        source: Box<FmuError>,
    },
    /// A unit cannot be loaded again.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// Only Real parameters have ranges.
    #[error("{target} is not a Real parameter: a map needs one")]
    NotReal {
        /// The parameter.
        target: String,
    },
    /// Two axes change the same parameter.
    #[error("{target} is on two axes")]
    Twice {
        /// The parameter.
        target: String,
    },
    /// A file of the map.
    #[error("cannot write {path}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// Rows that an earlier run has finished.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

impl Error {
    /// What to do.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Linear(error) => error.help(),
            Self::Master(error) => error.help(),
            Self::NotReal { .. } => Some("`maglev inspect` lists the parameters of a unit"),
            Self::Journal(error) => error.help(),
            _ => None,
        }
    }
}
