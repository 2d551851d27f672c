//! What can go wrong with a run as a whole, and how to mend it.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::archive::ArchiveError;
use crate::description::{DescriptionError, UnitMismatch};
use crate::initialize::InitializeError;
use crate::instance::{UnitError, UnitFault};
use crate::library::LibraryError;
#[cfg(feature = "modes")]
use crate::modes::ModesError;
use crate::package::PackageError;
use crate::plot::PlotError;
use crate::record::ParquetError;
use crate::reference::ReferenceError;
use crate::run::CheckpointError;
use crate::scenario::ScenarioError;
use crate::system::SystemError;

/// Why a run did not take place or did not end well.
#[derive(Debug, Error)]
pub enum Error {
    /// The scenario file.
    #[error("the scenario cannot be used")]
    Scenario(#[from] ScenarioError),
    /// What the scenario describes.
    #[error("the scenario does not make a system")]
    System(#[from] SystemError),
    /// A unit's archive.
    #[error("the unit cannot be used")]
    Package(#[from] PackageError),
    /// A file that is no unit, because it cannot be read.
    #[error("the unit cannot be checked")]
    Unreadable(#[from] crate::validate::Unreadable),
    /// No such check.
    #[error("there is no check \"{id}\"; there are: {known}")]
    UnknownCheck {
        /// What was asked for.
        id: String,
        /// What there is.
        known: String,
    },
    /// A unit's binary.
    #[error("a unit cannot be loaded")]
    Library(#[from] LibraryError),
    /// A unit that refuses to be instantiated.
    #[error("a unit cannot be instantiated")]
    Instantiate(#[source] UnitError),
    /// A report that the unit does not give.
    #[error("the unit does not answer")]
    Report(#[source] UnitError),
    /// Modes of the coupled system.
    #[cfg(feature = "modes")]
    #[error("the system's modes cannot be found")]
    Modes(#[from] ModesError),
    /// Initialization.
    #[error("the run could not start")]
    Initialize(#[from] InitializeError),
    /// Stepping.
    #[error("the run failed at {time} s")]
    Step {
        /// Time at the beginning of the step (s).
        time: f64,
        /// Why.
        #[source]
        source: UnitError,
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
        /// What a unit said in the end.
        #[source]
        source: Option<UnitError>,
    },
    /// The trace of calls cannot be begun.
    #[error("the trace of calls cannot be written to {path}")]
    Trace {
        /// Where.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// Results cannot be written.
    #[error("the results cannot be written to {path}")]
    Output {
        /// Where.
        path: PathBuf,
        /// Whether the run had begun.
        running: bool,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The user insisted on the end, and another thread has completed the results.
    #[error("the run was given up")]
    GivenUp,
    /// The Parquet copy of the results cannot be written.
    #[error("the results in {folder} are complete as results.csv, but not as results.parquet")]
    Parquet {
        /// Where.
        folder: PathBuf,
        /// Why.
        #[source]
        source: ParquetError,
    },
    /// Checkpoints are asked for, and units cannot give their states.
    #[error(
        "checkpoints cannot be made: {} (canSerializeFMUstate is not true)",
        cannot_serialize(units)
    )]
    NoCheckpoints {
        /// The .fmu files.
        units: Vec<PathBuf>,
    },
    /// A run cannot go on from its checkpoint.
    #[error("the run cannot be resumed")]
    Checkpoint(#[from] CheckpointError),
    /// Reference results.
    #[error("the reference results cannot be compared")]
    Reference(#[from] ReferenceError),
    /// A picture cannot be drawn.
    #[error("{file}")]
    Plot {
        /// Which picture.
        file: String,
        /// Why.
        #[source]
        source: PlotError,
    },
}

impl Error {
    /// The fault of a unit whose call was given up, as the user insisted on the end of the run.
    #[must_use]
    pub fn given_up(&self) -> Option<&UnitFault> {
        let first: Option<&(dyn std::error::Error + 'static)> = Some(self);
        std::iter::successors(first, |error| error.source())
            .find_map(|error| error.downcast_ref::<UnitError>())
            .map(UnitError::fault)
            .filter(|fault| matches!(fault, UnitFault::GivenUp { .. }))
    }

    /// 2 for bad usage or input, 1 for a run that failed.
    #[must_use]
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Initialize(_)
            | Self::Step { .. }
            | Self::Diverged { .. }
            | Self::Plot { .. }
            | Self::GivenUp => 1,
            Self::Instantiate(error) if error.fault().is_loss() => 1,
            Self::Output { running: true, .. } | Self::Parquet { .. } => 1,
            Self::Reference(ReferenceError::Unit(_)) => 1,
            _ => 2,
        }
    }

    /// The same, with the folder of results as it was given.
    pub(crate) fn with_folder(mut self, absolute: &Path, given: &Path) -> Self {
        if let Self::Output { path, .. } | Self::Parquet { folder: path, .. } = &mut self
            && let Ok(rest) = path.strip_prefix(absolute)
        {
            // nothing joined would be a slash
            let nothing = rest.as_os_str().is_empty();
            *path = if nothing { given.to_owned() } else { given.join(rest) };
        }
        self
    }

    /// All causes, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        let mut chain = Vec::new();
        let mut next: Option<&dyn std::error::Error> = Some(self);
        while let Some(error) = next {
            chain.push(error.to_string());
            next = error.source();
        }
        chain
    }

    /// How to mend it, where that can be said.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Scenario(error) => return scenario_help(error),
            Self::System(error) => return system_help(error),
            Self::Package(error) => return package_help(error),
            Self::UnknownCheck { .. } => "`maglev validate --dynamic --rules` lists the checks",
            Self::Unreadable(_) => "give the path of a .fmu file",
            Self::Library(error) => library_help(error),
            Self::Instantiate(error) if !matches!(error.fault(), UnitFault::Refused { .. }) => {
                return unit_help(error);
            }
            Self::Instantiate(_) => {
                "a unit refuses when its modelDescription.xml and its binary do not belong together \
                 (different GUID) or its resources are missing; package it anew"
            }
            Self::Report(_) => {
                "what a unit reports is not of the FMI standard: see the documentation of the unit"
            }
            #[cfg(feature = "modes")]
            Self::Modes(ModesError::Silent { .. } | ModesError::Missing { .. }) => {
                "modes need units that answer the report \"linear\" (docs/coupled-modes.md); \
                 `maglev run` needs nothing of it"
            }
            #[cfg(feature = "modes")]
            Self::Modes(_) => return None,
            Self::Initialize(InitializeError::Loop { .. }) => {
                "give start values nearer to the solution, or raise initialization.iterations or \
                 initialization.tolerance in the scenario"
            }
            Self::Initialize(InitializeError::Unit(error)) | Self::Step { source: error, .. } => {
                return unit_help(error);
            }
            Self::Diverged { .. } => {
                "use the algorithm \"newton\" (or \"iterated\"), which solves such loops in every \
                 step; a smaller step does not help"
            }
            Self::Trace { .. } => "choose another file with --trace",
            Self::Parquet { .. } => "free space on the disk",
            Self::NoCheckpoints { .. } => {
                "run it without checkpoints, or ask who exported the units for serialized states"
            }
            Self::Checkpoint(error) => return checkpoint_help(error),
            Self::Output { source, .. } if source.kind() == ErrorKind::NotFound => {
                "the folder is gone: do not move or remove it while a run writes to it"
            }
            Self::Reference(error) => return reference_help(error),
            Self::Output { .. } => "choose another folder with --out, or free space on the disk",
            Self::GivenUp => return None,
            Self::Plot { .. } => "check the plot's signals and scale in the scenario",
        })
    }
}

fn scenario_help(error: &ScenarioError) -> Option<&'static str> {
    Some(match error {
        ScenarioError::Read { source, .. } => match source.kind() {
            ErrorKind::IsADirectory => "give the path of a scenario's .json file in this folder",
            ErrorKind::InvalidData => {
                "give the path of a scenario's .json file; a unit to run alone is a .fmu file"
            }
            _ => "give the path of a scenario's .json file",
        },
        ScenarioError::NotJson { .. } => {
            "mend it where it says, or give the path of a scenario's .json file"
        }
        ScenarioError::Json { .. } => "`maglev schema` prints what a scenario may contain",
        ScenarioError::Base { .. } => {
            "\"extends\" is the path of a scenario's .json file, relative to the file that it is in"
        }
        ScenarioError::Circle { .. } => {
            "a file cannot extend itself, not by way of others either: take out one \"extends\""
        }
        ScenarioError::ExtendsInText { .. } => {
            "load it from a file, or write the two as one scenario"
        }
        ScenarioError::StepDoesNotDivide { .. } => {
            "choose stop and step such that stop - start is a whole number of steps"
        }
        ScenarioError::Suggestions { source, .. } => return package_help(source),
        ScenarioError::NotSuggested { key: "stop", .. } => {
            "give \"stop\" under \"experiment\", or --stop"
        }
        ScenarioError::NotSuggested { .. } => "give \"step\" under \"experiment\", or --step",
        ScenarioError::Interval { .. } => "choose a recording interval of a whole number of steps",
        ScenarioError::Experiment { .. } => "stop must be greater than start, and step positive",
        ScenarioError::NothingIsolated => {
            "a step without end can only be stopped in a process of its own: add --isolate, or \
             \"isolate\": true to instances in the scenario"
        }
        ScenarioError::Every { .. } => {
            "let stop - start be a whole number of times \"every\" communication steps, of equal size"
        }
        ScenarioError::Range { .. } => return None,
    })
}

fn reference_help(error: &ReferenceError) -> Option<&'static str> {
    Some(match error {
        ReferenceError::Library(error) => library_help(error),
        ReferenceError::Unit(error) => return unit_help(error),
        ReferenceError::None { .. } => {
            "units packed by `cargo xtask package` carry them; run others in a scenario"
        }
        _ => "the unit's files of reference results are damaged; package it anew",
    })
}

fn system_help(error: &SystemError) -> Option<&'static str> {
    Some(match error {
        SystemError::Package { source, .. } => match source {
            PackageError::Archive { source: ArchiveError::Open(error), .. }
                if error.kind() != ErrorKind::IsADirectory =>
            {
                "check the path (units are looked for relative to the scenario), and build the unit"
            }
            _ => return package_help(source),
        },
        SystemError::Unknown { what: "variable", .. } => {
            "`maglev inspect UNIT.fmu` lists the variables of a unit"
        }
        SystemError::Unknown { what: "instance", .. } => {
            "instances are named under \"instances\" in the scenario"
        }
        SystemError::Unit { source, .. } => match source {
            UnitMismatch::Dimension { .. } => "connect quantities of the same kind",
            UnitMismatch::Undefined { .. } => {
                "the unit's description should define its units; \"ignore_units\": true in the \
                 connection takes the values as they are"
            }
        },
        SystemError::Unconnected { .. } => {
            "connect it, or give it a value under \"start\" of its instance"
        }
        SystemError::Idle { .. } => {
            "set what the output is computed from, or remove the connection or the value"
        }
        SystemError::DrivenTwice { .. } => {
            "remove one of the connections, or make them one whose \"from\" is a list: a sum"
        }
        SystemError::Type { .. } => {
            "a connection passes numbers to Reals, whole numbers and Booleans to Integers, Integers and \
             Enumerations to Enumerations; for others a unit in between has to decide"
        }
        SystemError::NotLinear { .. } => {
            "leave them out, or compute the value in a unit in between"
        }
        SystemError::NoCommonItem { .. } => {
            "Enumerations are connected by the names of their items; check that these belong together"
        }
        SystemError::Causality { .. } => "connections go from an output to an input",
        SystemError::Pattern { .. } => {
            "both sides of a connection must stand for equally many signals, or the source for one"
        }
        SystemError::File { .. } => {
            "paths of the form {\"path\": \"...\"} are relative to the scenario file that has them"
        }
        SystemError::Form { .. } => "write instance.variable, such as motor.speed",
        _ => return None,
    })
}

fn cannot_serialize(units: &[PathBuf]) -> String {
    let names: Vec<String> = units.iter().map(|path| path.display().to_string()).collect();
    match names.len() {
        1 => format!("the unit {} cannot serialize its state", names[0]),
        _ => format!("the units {} cannot serialize their states", names.join(", ")),
    }
}

fn checkpoint_help(error: &CheckpointError) -> Option<&'static str> {
    Some(match error {
        CheckpointError::Missing { .. } => {
            "a run writes checkpoints if asked to with --checkpoint-every, and a finished one leaves \
             none"
        }
        CheckpointError::Unit { .. } => {
            "put back the file that the run began with, or run the scenario anew"
        }
        CheckpointError::Scenario(error) => return scenario_help(error),
        CheckpointError::Read { .. } => "check the folder and the files in it",
        _ => "run the scenario anew",
    })
}

fn package_help(error: &PackageError) -> Option<&'static str> {
    Some(match error {
        PackageError::Archive { source, .. } => match source {
            ArchiveError::Open(error) if error.kind() == ErrorKind::IsADirectory => {
                "give the .fmu file itself, not the folder that it is in or was unpacked to"
            }
            ArchiveError::Open(_) => "check the path, and build the unit",
            ArchiveError::Zip(_) | ArchiveError::Entry { .. } => {
                "the file is damaged or no FMU; build or download it anew"
            }
            ArchiveError::NoDescription { .. } | ArchiveError::NotText => {
                "an FMU has a modelDescription.xml at its top level; pack the folder's contents, \
                 not the folder"
            }
            ArchiveError::Write { .. } => "free space in the folder for temporary files (TMPDIR)",
            _ => "do not run it unless you trust its origin; ask who exported it",
        },
        PackageError::Description { source, .. } => match source {
            DescriptionError::Version(_) | DescriptionError::NoCoSimulation { .. } => {
                "export it for co-simulation with FMI 2.0"
            }
            _ => "ask who exported it; `maglev validate` lists what is wrong",
        },
        PackageError::Defects { .. } => {
            "`maglev validate` says more; without --strict (or \"strict\" in the scenario) they are \
             tolerated"
        }
        PackageError::Folder { .. } => "set TMPDIR to a folder that can be written",
    })
}

fn library_help(error: &LibraryError) -> &'static str {
    match error {
        LibraryError::Missing { .. } => {
            "export or build the unit for this system; its binary is named after the modelIdentifier"
        }
        LibraryError::Load { .. } => {
            "a binary for another processor, or one that needs a newer C library or other \
             libraries, does not load; build it on this system"
        }
        LibraryError::NoExecution { .. } => {
            "set TMPDIR to a folder that allows execution, such as TMPDIR=$HOME/tmp"
        }
        LibraryError::Symbol { .. } => "export it for co-simulation, with all functions visible",
        LibraryError::Version { .. } => "export it for FMI 2.0",
        LibraryError::Copy { .. } => "free space in the folder for temporary files (TMPDIR)",
    }
}

fn unit_help(error: &UnitError) -> Option<&'static str> {
    Some(match error.fault() {
        UnitFault::NotFinite { .. } => {
            "the model has left the range that it is valid in: check parameters and start values, \
             or take a smaller step"
        }
        UnitFault::NoItem { .. } => {
            "the two sides count different items: ask who made the units which value means what"
        }
        UnitFault::Discarded { terminated: true, .. } => "the unit has ended the simulation itself",
        UnitFault::Discarded { can_retry: true, .. } => {
            "take a smaller step (--step); with \"on_discard\": \"retry\" under \"algorithm\", such \
             steps are tried in parts"
        }
        UnitFault::Discarded { .. } => {
            "take a smaller step (--step); a unit that can save its state would be tried in parts"
        }
        UnitFault::Status { status, .. } if status == "fmi2Fatal" => {
            "the unit gave up for good: check its parameters and inputs, or ask who made it"
        }
        UnitFault::Status { call: "fmi2SetRealInputDerivatives", .. } => {
            "the unit declares that it takes derivatives of inputs (canInterpolateInputs) and does not: \
             give its instance \"input_derivatives\": 0 in the scenario, then its inputs are held over a \
             step"
        }
        UnitFault::Status { call: "fmi2GetRealOutputDerivatives", .. } => {
            "the unit declares derivatives of outputs (maxOutputDerivativeOrder) and fails to give them: \
             with \"derivatives\": false under \"algorithm\" they are taken from history"
        }
        UnitFault::Status { call: "fmi2GetDirectionalDerivative", .. } => {
            "the unit declares directional derivatives (providesDirectionalDerivative) and fails to give \
             them: with \"iteration\": { \"jacobian\": \"steps\" } under \"algorithm\" Newton's method \
             takes differences of steps"
        }
        UnitFault::Stalled { .. } => {
            "the unit has ended on its own: its messages in events.csv say why; results from that time \
             on are worth nothing"
        }
        UnitFault::Status { .. } => {
            "check the unit's parameters and inputs; a smaller step may help"
        }
        UnitFault::Crashed { signal: 9, .. } => {
            "who did not end it by hand should look at the memory: the system ends processes that \
             want too much of it"
        }
        UnitFault::Crashed { .. } => {
            "the unit has a fault: ask who made it, or run it under a debugger; parameters, inputs \
             or a smaller step may avoid it"
        }
        UnitFault::Exited { .. } => {
            "a unit must not end its process: its license, resources or another program that it \
             needs may be missing"
        }
        UnitFault::TimedOut { call, .. } if *call == "fmi2DoStep" => {
            "if the step is no endless loop, allow more time (--step-timeout)"
        }
        UnitFault::TimedOut { .. } => {
            "if it is no endless loop, allow more time (isolation.call_timeout in the scenario)"
        }
        UnitFault::Hanging { .. } => "if the unit still works on the step, allow more time",
        UnitFault::NoProcess { .. } => {
            "check the limits of processes and memory, or run without --isolate"
        }
        UnitFault::CannotIsolate { .. } => "run without --isolate",
        UnitFault::Lacks { .. } => {
            "the unit's binary is incomplete; `maglev validate` lists what is missing"
        }
        _ => return None,
    })
}
