//! Errors of the analysis.

use thiserror::Error;

/// The stability of the periodic system cannot be computed.
#[derive(Debug, Error)]
pub enum FloquetError {
    /// The iteration for eigenvalues, or for singular values, failed.
    #[error("the computation of the {0} did not converge")]
    Eigenvalues(&'static str),
    /// The constant part cannot be written in its modes.
    #[error(
        "the train on a rigid track has modes that are too nearly equal to be separated: its response is off by {error:.1e}"
    )]
    Defective {
        /// Largest relative error of the frequency response.
        error: f64,
    },
    /// The motion grows beyond all numbers within one period.
    #[error("the motion over one period of {period} s is not finite")]
    Overflow {
        /// Time of one period (s).
        period: f64,
    },
    /// No number of steps is enough.
    #[error(
        "the growth rate at {speed} m/s still changes by {error:.1e} 1/s between {} and {steps} steps a period",
        steps / 2
    )]
    Tolerance {
        /// Speed (m/s).
        speed: f64,
        /// Change of the growth rate (1/s).
        error: f64,
        /// Most steps that were tried.
        steps: usize,
    },
}
