//! Why a command did not do what it was asked to.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use figure::PlotError;
use fmi2_conformance::reference::ReferenceError;
use fmi2_conformance::rules::Unreadable;
use fmi2_conformance::{CheckError, Defects};
use fmi2_import::instance::{FmuError, FmuFault, Loss};
use fmi2_import::library::LibraryError;
use fmi2_import::package::PackageError;
use results::ParquetError;
use scenario::ScenarioError;
use thiserror::Error;

use crate::run::CheckpointError;

/// Why a command did not do what it was asked to.
#[derive(Debug, Error)]
pub enum Error {
    /// The co-simulation: its setup, its start or a step.
    #[error(transparent)]
    Master(#[from] master::Error),
    /// A unit's archive or description.
    #[error("cannot use the unit")]
    Package(#[from] PackageError),
    /// A unit's binary.
    #[error("cannot load the unit")]
    Library(#[from] LibraryError),
    /// A unit that refuses to be instantiated.
    #[error("cannot instantiate the unit")]
    Instantiate(#[source] FmuError),
    /// A file that cannot be read as a unit.
    #[error("cannot check the unit")]
    Unreadable(#[from] Unreadable),
    /// Defects of a unit, where none are tolerated.
    #[error("cannot use the unit")]
    Defects(#[from] Defects),
    /// The checks of behaviour.
    #[error(transparent)]
    Check(#[from] CheckError),
    /// A report that the unit does not give.
    #[error("the unit does not answer")]
    Report(#[source] FmuError),
    /// Results cannot be written.
    #[error("cannot write the results to {path}")]
    Output {
        /// The folder or file.
        path: PathBuf,
        /// Whether the run had begun.
        running: bool,
        /// The system's reason.
        #[source]
        source: std::io::Error,
    },
    /// The user insisted on the end, and another thread has completed the results.
    #[error("the run was abandoned")]
    GivenUp,
    /// The Parquet copy of the results cannot be written.
    #[error("the results in {folder} are complete as results.csv, but not as results.parquet")]
    Parquet {
        /// The results folder.
        folder: PathBuf,
        /// The reason.
        #[source]
        source: ParquetError,
    },
    /// Checkpoints are asked for, and units cannot give their states.
    #[error(
        "cannot write checkpoints: {} (canSerializeFMUstate is not true)",
        cannot_serialize(units)
    )]
    NoCheckpoints {
        /// Paths of the .fmu files, as they were given.
        units: Vec<PathBuf>,
    },
    /// A run cannot continue from its checkpoint.
    #[error("cannot resume the run")]
    Checkpoint(#[from] CheckpointError),
    /// Reference results.
    #[error("cannot compare the reference results")]
    Reference(#[from] ReferenceError),
    /// A picture cannot be drawn.
    #[error("{file}")]
    Plot {
        /// Its file.
        file: String,
        /// The reason.
        #[source]
        source: PlotError,
    },
}

impl From<ScenarioError> for Error {
    fn from(error: ScenarioError) -> Self {
        master::Error::from(error).into()
    }
}

impl Error {
    /// The fault of a unit whose call was given up, as the user insisted on the end of the run.
    #[must_use]
    pub fn given_up(&self) -> Option<&FmuFault> {
        let first: Option<&(dyn std::error::Error + 'static)> = Some(self);
        std::iter::successors(first, |error| error.source())
            .find_map(|error| error.downcast_ref::<FmuError>())
            .map(FmuError::fault)
            .filter(|fault| matches!(fault, FmuFault::Lost { how: Loss::GivenUp, .. }))
    }

    /// 2 for bad usage or input, 1 for a run that failed.
    #[must_use]
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Master(error) if error.is_failed_run() => 1,
            Self::Plot { .. } | Self::GivenUp => 1,
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
        results::causes(self)
    }

    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Master(error) => return error.help(),
            Self::Package(error) => return error.help(),
            Self::Library(error) => error.help(),
            Self::Instantiate(error) => return error.fault().help(),
            Self::Unreadable(_) => "give the path of a .fmu file",
            Self::Defects(error) => error.help(),
            Self::Check(error) => return error.help(),
            Self::Report(_) => {
                "reports are not part of the FMI standard: see the documentation of the unit"
            }
            Self::Parquet { .. } => "free space on the disk",
            Self::NoCheckpoints { .. } => {
                "run it without checkpoints, or ask who exported the units for serialized states"
            }
            Self::Checkpoint(error) => return error.help(),
            Self::Output { source, .. } if source.kind() == ErrorKind::NotFound => {
                "the folder is gone: do not move or remove it while a run writes to it"
            }
            Self::Reference(error) => return error.help(),
            Self::Output { .. } => "choose another folder with --out, or free space on the disk",
            Self::GivenUp => return None,
            Self::Plot { .. } => "check the plot's signals and scale in the scenario",
        })
    }
}

fn cannot_serialize(units: &[PathBuf]) -> String {
    let names: Vec<String> = units.iter().map(|path| path.display().to_string()).collect();
    match names.len() {
        1 => format!("the unit {} cannot serialize its state", names[0]),
        _ => format!("the units {} cannot serialize their states", names.join(", ")),
    }
}
