//! Why parameters cannot be fitted.

use measured::MeasuredError;
use thiserror::Error;

use crate::least_squares::SolveError;

/// Why parameters cannot be fitted.
#[derive(Debug, Error)]
pub enum FitError {
    /// Nothing varies.
    #[error("nothing to fit: no parameter is varied")]
    NothingVaried,
    /// A parameter is varied twice.
    #[error("{target} is varied twice")]
    Twice {
        /// The parameter.
        target: String,
    },
    /// The scenario does not fit its units, or a varied parameter does not exist.
    #[error("cannot run the scenario")]
    Setup(#[source] master::Error),
    /// A varied variable is not a number.
    #[error("{target} is not a Real variable, so it cannot be fitted")]
    NotReal {
        /// The variable.
        target: String,
    },
    /// A bound is not allowed by the unit.
    #[error("{target}: the bounds {low} to {high} exceed those of the unit, {min} to {max}")]
    Bounds {
        /// The variable.
        target: String,
        /// Lower bound given.
        low: f64,
        /// Upper bound given.
        high: f64,
        /// Lower bound of the unit.
        min: f64,
        /// Upper bound of the unit.
        max: f64,
    },
    /// The record cannot be used.
    #[error(transparent)]
    Record(#[from] MeasuredError),
    /// The record has too few values during the run.
    #[error("{column} has {count} values during the run, and 8 are needed")]
    TooFew {
        /// The column.
        column: String,
        /// Values.
        count: usize,
    },
    /// The run that should show the offset fails.
    #[error(
        "cannot find the offset of the record: the scenario with its own values does not run: {reason}"
    )]
    FirstRun {
        /// Why.
        reason: String,
    },
    /// The fit itself.
    #[error("cannot fit the parameters")]
    Solve(#[source] SolveError),
    /// Threads cannot be started.
    #[error("cannot start threads for the runs")]
    Threads(#[source] std::io::Error),
}

impl FitError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::NothingVaried => "add --vary 'INSTANCE.VARIABLE=LOW:HIGH'",
            Self::Twice { .. } => "vary it once",
            Self::Setup(error) => return error.help(),
            Self::NotReal { .. } | Self::Bounds { .. } => {
                "`maglev inspect UNIT` shows the parameters with their ranges"
            }
            Self::Record(error) => return error.help(),
            Self::TooFew { .. } => {
                "give the seconds to add to the record's times with --offset, or find them with --offset find"
            }
            Self::FirstRun { .. } => "give the offset with --offset SECONDS",
            Self::Solve(SolveError::NoValues { .. } | SolveError::NoDerivatives { .. }) => {
                "choose narrower bounds, within which the system is stable"
            }
            Self::Solve(_) => "vary fewer parameters, or give a longer record",
            Self::Threads(_) => "run it again when the machine has room",
        })
    }

    /// The messages of this error and of its sources, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        results::causes(self)
    }
}
