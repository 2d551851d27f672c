//! Errors.

use thiserror::Error;

/// A map or a part of it cannot be computed.
#[derive(Debug, Error)]
pub enum MapError {
    /// The iteration for eigenvalues or singular values failed.
    #[error("the computation of the eigenvalues of {what} did not converge")]
    Eigenvalues {
        /// The matrix, in words.
        what: &'static str,
    },
    /// Eigenvectors that are too close to parallel.
    #[error(
        "the eigenvectors of the vehicle side of the loop are nearly parallel: its frequency response from them is off by {error:.1e}"
    )]
    Defective {
        /// Relative error of the response at the frequency of the check.
        error: f64,
    },
    /// An algebraic loop without a solution.
    #[error("the system has an algebraic loop that cannot be solved")]
    Loop,
    /// Matrices that do not fit.
    #[error("matrices of different systems: {0}")]
    Shape(String),
}
