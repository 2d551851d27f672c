//! Errors of linear analysis.

use thiserror::Error;

use fmi2_import::instance::FmuError;
use master::Error;

/// A system cannot be linearised, or its modes cannot be computed.
#[derive(Debug, Error)]
pub enum LinearError {
    /// The scenario does not start.
    #[error(transparent)]
    Start(#[from] Error),
    /// A unit does not report its linearisation.
    #[error("{instance} does not report its linearisation, which is needed for the modes")]
    Silent {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// A unit reports no linearisation, and none can be identified.
    #[error("{instance} reports no linearisation, and its steps cannot be used instead: {why}")]
    Unidentified {
        /// The instance, by its name in the scenario.
        instance: String,
        /// What is missing.
        why: String,
    },
    /// A step for an identification failed.
    #[error("{instance} cannot be identified: a step from its saved state failed")]
    Steps {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// A unit does not give the directional derivatives that it declares.
    #[error("{instance} does not give the directional derivatives of its states")]
    Derivatives {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// A unit does not step in every communication step.
    #[error(
        "{instance} does not step in every communication step (\"every\"), which is needed for the modes"
    )]
    Slow {
        /// The instance, by its name in the scenario.
        instance: String,
    },
    /// A report cannot be used.
    #[error("the linearisation that {instance} reports cannot be used: {message}")]
    Report {
        /// The instance, by its name in the scenario.
        instance: String,
        /// What is wrong with the linearisation, in words.
        message: String,
    },
    /// A connected output is not in the report.
    #[error("the linearisation that {instance} reports leaves out its connected output {output}")]
    Missing {
        /// The instance, by its name in the scenario.
        instance: String,
        /// Connected output that the report lacks.
        output: String,
    },
    /// The inputs of a unit cannot be read.
    #[error("cannot read the inputs of {instance} at the point of linearisation")]
    Inputs {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// No unit has this input or output.
    #[error("no unit reports the {kind} {name} in its linearisation")]
    NoPort {
        /// As `instance.variable`.
        name: String,
        /// `input` or `output`.
        kind: &'static str,
    },
    /// An algebraic loop without a solution.
    #[error("the linearised system has an algebraic loop that cannot be solved")]
    Loop,
    /// The product of entries of the reports is too large.
    #[error(
        "the matrix of the coupled system is not finite: entries of the units' linearisations are too large"
    )]
    Infinite,
    /// A unit is too fast for the step.
    #[error(
        "{instance} has an eigenvalue of {rate:.1e} 1/s, too fast for the modes as stepped at {step} s"
    )]
    Fast {
        /// The instance, by its name in the scenario.
        instance: String,
        /// Size of its largest eigenvalue (1/s).
        rate: f64,
        /// Communication step (s).
        step: f64,
    },
    /// A step gives a value that is not finite.
    #[error(
        "a step of {step} s of the linearised system gives a value of {instance} that is not finite"
    )]
    Overflow {
        /// The instance, by its name in the scenario.
        instance: String,
        /// Communication step (s).
        step: f64,
    },
    /// The iteration for eigenvalues failed.
    #[error("the computation of the eigenvalues of the linearised system did not converge")]
    Eigenvalues,
}

impl LinearError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Start(error) => error.help(),
            Self::Silent { .. } | Self::Missing { .. } => Some(
                "modes need units with the report \"linear\" (docs/coupled-modes.md); \
                 `maglev run` does not need it",
            ),
            Self::Fast { .. } | Self::Overflow { .. } => {
                Some("check the parameters of that unit, or choose a smaller --step")
            }
            _ => None,
        }
    }
}
