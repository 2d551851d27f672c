//! Errors of setting up, starting and stepping a co-simulation.

use std::path::PathBuf;

use fmi2_import::instance::FmuError;
use fmi2_import::library::LibraryError;
use scenario::ScenarioError;
use thiserror::Error;

use crate::initialize::InitializeError;
use crate::system::SystemError;

/// A co-simulation cannot be set up, started or stepped.
#[derive(Debug, Error)]
pub enum Error {
    /// The scenario is invalid by itself.
    #[error("invalid scenario")]
    Scenario(#[from] ScenarioError),
    /// The scenario does not fit its units.
    #[error("invalid scenario")]
    System(#[from] SystemError),
    /// A unit's library cannot be loaded.
    #[error("cannot load a unit")]
    Library(#[from] LibraryError),
    /// A unit cannot be instantiated.
    #[error("cannot instantiate a unit")]
    Instantiate(#[source] FmuError),
    /// Initialization failed.
    #[error("the run could not start")]
    Initialize(#[from] InitializeError),
    /// A step failed.
    #[error("the run failed at {time} s")]
    Step {
        /// Time at the beginning of the step (s).
        time: f64,
        /// The failure of the unit.
        #[source]
        source: FmuError,
    },
    /// An algebraic loop that the algorithm cuts has become unstable.
    #[error(
        "the run failed at {time} s: values grew without bound in the algebraic loop through {loops}"
    )]
    Diverged {
        /// Time at the beginning of the step (s).
        time: f64,
        /// Names of the loop's outputs.
        loops: String,
        /// The failure of a unit that these values caused, if any.
        #[source]
        source: Option<FmuError>,
    },
    /// The trace of calls cannot be written.
    #[error("cannot write the trace of calls to {path}")]
    Trace {
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
}

impl Error {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Scenario(error) => return error.help(),
            Self::System(error) => return error.help(),
            Self::Library(error) => error.help(),
            Self::Instantiate(error) => return error.fault().help(),
            Self::Initialize(error) => return error.help(),
            Self::Step { source, .. } => return source.fault().help(),
            Self::Diverged { .. } => {
                "use the algorithm \"newton\" or \"iterated\", which solve such loops in every step; a \
                 smaller step does not help"
            }
            Self::Trace { .. } => "choose another file with --trace",
        })
    }

    /// Whether the run itself failed, rather than what it was given.
    #[must_use]
    pub fn is_failed_run(&self) -> bool {
        match self {
            Self::Initialize(_) | Self::Step { .. } | Self::Diverged { .. } => true,
            Self::Instantiate(error) => error.fault().is_loss(),
            _ => false,
        }
    }
}

/// A simulation cannot continue from a saved state.
#[derive(Debug, Error)]
pub enum StateError {
    /// The state belongs to another system.
    #[error("the checkpoint does not fit this scenario: different {what}")]
    Misfit {
        /// What differs.
        what: Misfit,
    },
    /// A unit refuses its state.
    #[error("a unit refused its saved state")]
    Refused {
        /// The failure of the unit.
        #[source]
        source: FmuError,
    },
}

/// Difference between a saved state and the system that is to continue from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misfit {
    /// The instances, or the number of steps.
    Instances,
    /// The steps of a unit that does not step in every communication step.
    OwnSteps,
    /// The signals between the units.
    Signals,
    /// Events, conditions, or files with signals for inputs.
    Story,
    /// The recorded signals.
    Recorded,
    /// The units.
    Units,
}

impl std::fmt::Display for Misfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Instances => "instances or steps",
            Self::OwnSteps => "own steps of a unit",
            Self::Signals => "signals between the units",
            Self::Story => {
                "events, conditions, or files with signals of inputs, which have changed since the run began"
            }
            Self::Recorded => "recorded signals",
            Self::Units => "units",
        })
    }
}
