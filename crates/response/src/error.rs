//! Errors of frequency responses.

use linear::LinearError;
use thiserror::Error;

/// A response or a margin cannot be computed.
#[derive(Debug, Error)]
pub enum ResponseError {
    /// The system cannot be linearised or coupled.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// A name with ranges and stars finds nothing.
    #[error("\"{pattern}\": {message}")]
    Pattern {
        /// As given.
        pattern: String,
        /// What is wrong, in words.
        message: String,
    },
    /// Nothing receives the signal.
    #[error("no loop can be broken at {name}: nothing receives it")]
    NotFed {
        /// The signal, `instance.variable`.
        name: String,
    },
    /// Nothing feeds the input.
    #[error("no loop can be broken at {name}: nothing is connected to it")]
    NotConnected {
        /// The input, `instance.variable`.
        name: String,
    },
    /// The closed loop has an algebraic loop without a solution.
    #[error("the loops broken at {at} have an algebraic loop that cannot be solved")]
    Algebraic {
        /// The signals, for people.
        at: String,
    },
    /// A sampled loop with feed-through.
    #[error(
        "the loop at {at} cannot be sampled: its signal returns without delay, so its value at a sample is \
         ambiguous"
    )]
    FeedThrough {
        /// The signal.
        at: String,
    },
    /// A sample time that is not positive.
    #[error("{value} s is not a valid sample time: it must be positive and finite")]
    Period {
        /// As given (s).
        value: f64,
    },
    /// Eigenvalues or singular values did not converge.
    #[error("the computation of {of} did not converge")]
    Convergence {
        /// Of which matrix.
        of: &'static str,
    },
}

impl ResponseError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Linear(error) => error.help(),
            Self::NotFed { .. } | Self::NotConnected { .. } => {
                Some("break the loop at a connected output or input, or at the voltage of a magnet")
            }
            Self::FeedThrough { .. } => {
                Some("break the loop at the voltage, which a controller holds")
            }
            _ => None,
        }
    }
}
