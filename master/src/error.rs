//! Why a co-simulation could not be set up, started or stepped.

use std::path::PathBuf;

use fmi2_import::instance::FmuError;
use fmi2_import::library::LibraryError;
use scenario::ScenarioError;
use thiserror::Error;

use crate::initialize::InitializeError;
use crate::modes::ModesError;
use crate::system::SystemError;

/// Why a co-simulation could not be set up, started or stepped.
#[derive(Debug, Error)]
pub enum Error {
    /// The scenario file.
    #[error("invalid scenario")]
    Scenario(#[from] ScenarioError),
    /// What the scenario describes.
    #[error("invalid scenario")]
    System(#[from] SystemError),
    /// A unit's binary.
    #[error("cannot load a unit")]
    Library(#[from] LibraryError),
    /// A unit that refuses to be instantiated.
    #[error("cannot instantiate a unit")]
    Instantiate(#[source] FmuError),
    /// Modes of the coupled system.
    #[error("cannot find the modes of the system")]
    Modes(#[from] ModesError),
    /// Initialization.
    #[error("the run could not start")]
    Initialize(#[from] InitializeError),
    /// Stepping.
    #[error("the run failed at {time} s")]
    Step {
        /// Time at the beginning of the step (s).
        time: f64,
        /// The unit's failure.
        #[source]
        source: FmuError,
    },
    /// A loop of direct feed-through that the algorithm cuts has become unstable.
    #[error(
        "the run failed at {time} s: values grew without bound in the loop of direct feed-through \
         through {loops}"
    )]
    Diverged {
        /// Time at the beginning of the step (s).
        time: f64,
        /// The loop, by its outputs.
        loops: String,
        /// The failure of a unit that the values led to.
        #[source]
        source: Option<FmuError>,
    },
    /// The trace of calls cannot be written.
    #[error("cannot write the trace of calls to {path}")]
    Trace {
        /// The file.
        path: PathBuf,
        /// The system's reason.
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
            Self::Modes(error) => return error.help(),
            Self::Initialize(error) => return error.help(),
            Self::Step { source, .. } => return source.fault().help(),
            Self::Diverged { .. } => {
                "use the algorithm \"newton\" (or \"iterated\"), which solves such loops in every \
                 step; a smaller step does not help"
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

/// Why a simulation cannot continue from a saved state.
#[derive(Debug, Error)]
pub enum StateError {
    /// The state is of another system.
    #[error("the checkpoint does not fit: other {what}")]
    Misfit {
        /// What differs.
        what: Misfit,
    },
    /// A unit refuses its state.
    #[error("a unit refuses its saved state")]
    Refused {
        /// The unit's failure.
        #[source]
        source: FmuError,
    },
}

/// What differs between a saved state and the system that should continue from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misfit {
    /// The instances, or the number of steps.
    Instances,
    /// The steps of a unit that steps less often than the others.
    OwnSteps,
    /// The signals between the units.
    Signals,
    /// The recorded signals.
    Recorded,
    /// The units.
    Units,
}

impl std::fmt::Display for Misfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Instances => "instances or steps",
            Self::OwnSteps => "steps of a unit's own",
            Self::Signals => "signals between the units",
            Self::Recorded => "recorded signals",
            Self::Units => "units",
        })
    }
}
