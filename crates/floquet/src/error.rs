//! Errors of the analysis.

use fmi2_import::instance::FmuError;
use linear::LinearError;
use thiserror::Error;

/// The stability of the periodic system cannot be computed.
#[derive(Debug, Error)]
pub enum FloquetError {
    /// The scenario does not start.
    #[error(transparent)]
    Start(#[from] master::Error),
    /// A unit cannot be linearised.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// A call to the guideway fails.
    #[error("{instance} does not answer at chosen places of the magnets")]
    Unit {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// The scenario has nothing to move over.
    #[error(
        "no unit of the scenario has inputs position_NN and outputs displacement_NN, as a guideway has"
    )]
    NoGuideway,
    /// The guideway is not of the known kind.
    #[error(
        "{instance} has no {variable}, so that it cannot be continued as an endless row of spans"
    )]
    Lacks {
        /// The instance, by its name in the scenario.
        instance: String,
        /// What is missing.
        variable: String,
    },
    /// The guideway's states are not modes of spans.
    #[error(
        "the states that {instance} reports are not modal displacements and their rates, equally many for each span"
    )]
    NoModes {
        /// The instance, by its name in the scenario.
        instance: String,
    },
    /// The train feels the rate of the track.
    #[error(
        "the train feels {output}: a stop or skid is in contact with the track, which this analysis does not include"
    )]
    Rate {
        /// As `instance.variable`.
        output: String,
    },
    /// The train feels another output of the guideway.
    #[error("{output} acts on other units; only the track's displacement under the magnets may")]
    Feeds {
        /// As `instance.variable`.
        output: String,
    },
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

impl FloquetError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Start(error) => error.help(),
            Self::Linear(error) => error.help(),
            Self::NoGuideway | Self::Lacks { .. } | Self::NoModes { .. } | Self::Feeds { .. } => {
                Some(
                    "the guideway must have the variables of guideway.fmu (docs/reference/guideway.md)",
                )
            }
            Self::Rate { .. } => Some("start the scenario with all magnets levitated"),
            Self::Defective { .. } => Some("change a parameter of the train slightly"),
            Self::Tolerance { .. } => Some("allow a larger --tolerance"),
            Self::Eigenvalues(_) | Self::Overflow { .. } | Self::Unit { .. } => None,
        }
    }
}
