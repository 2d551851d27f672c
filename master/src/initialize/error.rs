//! Errors during initialization.

use thiserror::Error;

use fmi2_import::instance::FmuError;

/// An error during initialization.
#[derive(Debug, Error)]
pub enum InitializeError {
    /// A unit fails.
    #[error("initialization failed")]
    Unit(#[from] FmuError),
    /// A loop does not converge.
    #[error(
        "initialization: the loop through {signals} did not converge in {iterations} sweeps; \
         still changing: {residuals}"
    )]
    Loop {
        /// Signals of the loop.
        signals: String,
        /// Number of sweeps.
        iterations: u32,
        /// The signals that change most in one more sweep, and their changes.
        residuals: String,
    },
}

impl InitializeError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Unit(error) => error.fault().help_at_start(),
            Self::Loop { .. } => Some(
                "give start values closer to the solution, or raise initialization.iterations or \
                 initialization.tolerance in the scenario",
            ),
        }
    }
}
