//! Why a command failed, and with which exit status.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use bundle::BundleError;
use figure::PlotError;
use floquet::FloquetError;
use fmi2_conformance::Unreadable;
use fmi2_conformance::reference::ReferenceError;
use fmi2_conformance::{CheckError, Defects};
use fmi2_derive::DeriveError;
use fmi2_import::instance::{FmuError, FmuFault, Loss};
use fmi2_import::library::LibraryError;
use fmi2_import::package::PackageError;
use in_memory::accuracy::AccuracyError;
use linear::LinearError;
use response::ResponseError;
use results::{JournalError, ParquetError};
use scenario::ScenarioError;
use ssp::SspError;
use study::StudyError;
use thiserror::Error;
use tune::TuneError;

use crate::run::CheckpointError;

/// Why a command failed.
#[derive(Debug, Error)]
pub enum Error {
    /// The co-simulation: its setup, its start or a step.
    #[error(transparent)]
    Master(#[from] master::Error),
    /// Step and algorithm for an accuracy.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
    /// A study.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The stability of the moving train.
    #[error("cannot find the stability of the moving train")]
    Floquet(#[source] FloquetError),
    /// A system as one unit.
    #[error("cannot pack the system into one unit")]
    Bundle(#[source] BundleError),
    /// Parameters from a record.
    #[error("cannot fit the scenario to the record")]
    Fit(#[source] fit::FitError),
    /// A report.
    #[error("cannot make the report")]
    Page(#[from] report::ReportError),
    /// A stability map.
    #[error("cannot make the map")]
    Map(#[source] maps::Error),
    /// Points of a map that an earlier run has finished.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A tuning.
    #[error("cannot tune the controllers")]
    Tune(#[source] TuneError),
    /// The linearised system, or its modes.
    #[error("cannot linearise the system")]
    Modes(#[source] LinearError),
    /// No parameter for `--positions`.
    #[error(
        "{found} a parameter initial_position: name one, as --positions INSTANCE.PARAMETER=FIRST:LAST:STEP"
    )]
    NoPosition {
        /// Which units have it.
        found: String,
    },
    /// Orders that `--orders` cannot compare.
    #[error(
        "--orders compares the orders of at most {most} kinds of units that step as one group; the scenario has {kinds} \
         kinds{groups}"
    )]
    NoOrders {
        /// Kinds of units.
        kinds: usize,
        /// Most kinds that are compared.
        most: usize,
        /// Says that there are groups.
        groups: &'static str,
    },
    /// A file name without a known ending.
    #[error("cannot write {path}: the name must end with .json, .mat or .npz")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Frequency responses and margins.
    #[error("cannot compute the response of the system")]
    Response(#[source] ResponseError),
    /// `maglev response` without anything to compute.
    #[error("nothing to compute: neither --from and --to, nor --loop, nor --root-locus is given")]
    NothingAsked,
    /// A root locus over the gain of loops that are not broken.
    #[error("a root locus over the gain of loops needs --loop, which says where they are broken")]
    NoLoop,
    /// A unit's archive or description.
    #[error("cannot use the unit")]
    Package(#[from] PackageError),
    /// A unit cannot get other resources.
    #[error("cannot make the new unit")]
    Derive(#[from] DeriveError),
    /// A system in an SSP archive.
    #[error("cannot use the system")]
    Ssp(#[from] SspError),
    /// `export --scenario` of something else.
    #[error("{path} is not a system (.ssp or .ssd)")]
    NoSystem {
        /// The file.
        path: PathBuf,
    },
    /// `validate --dynamic` of a whole system.
    #[error("--dynamic checks one unit, not a system")]
    SystemDynamic,
    /// A temporary folder.
    #[error("cannot make a temporary folder")]
    Temporary(#[source] std::io::Error),
    /// A unit's binary.
    #[error("cannot load the unit")]
    Library(#[from] LibraryError),
    /// A unit refuses to be instantiated.
    #[error("cannot instantiate the unit")]
    Instantiate(#[source] FmuError),
    /// A file is not a readable unit.
    #[error("cannot check the unit")]
    Unreadable(#[from] Unreadable),
    /// A unit has defects, and `--strict` tolerates none.
    #[error("cannot use the unit")]
    Defects(#[from] Defects),
    /// The checks of behaviour.
    #[error(transparent)]
    Check(#[from] CheckError),
    /// A unit does not answer a report.
    #[error("the unit does not provide this report")]
    Report(#[source] FmuError),
    /// Results cannot be written.
    #[error("cannot write the results to {path}")]
    Output {
        /// The folder or file.
        path: PathBuf,
        /// Whether the run had started.
        running: bool,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// A file outside of a run's results, or the standard output, cannot be written.
    #[error("cannot write {path}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// `validate --dynamic` cannot start itself.
    #[error("cannot find the path of this program")]
    Program(#[source] std::io::Error),
    /// The user ended a hanging step, and another thread has completed the results.
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
    /// The run should write checkpoints, but units cannot serialize their states.
    #[error(
        "cannot write checkpoints: {} (canSerializeFMUstate is not true)",
        cannot_serialize(units)
    )]
    NoCheckpoints {
        /// Paths of the .fmu files, as they were given.
        units: Vec<PathBuf>,
    },
    /// A run cannot be resumed from its checkpoint.
    #[error("cannot resume the run")]
    Checkpoint(#[from] CheckpointError),
    /// Reference results cannot be read or reproduced.
    #[error("cannot compare the reference results")]
    Reference(#[from] ReferenceError),
    /// A picture cannot be drawn.
    #[error("cannot draw {file}")]
    Plot {
        /// Its file.
        file: String,
        /// The reason.
        #[source]
        source: PlotError,
    },
    /// A picture cannot be rendered.
    #[error("cannot draw {file}: {message}")]
    Pixels {
        /// Its file.
        file: String,
        /// The reason, in words.
        message: String,
    },
}

impl From<ScenarioError> for Error {
    fn from(error: ScenarioError) -> Self {
        master::Error::from(error).into()
    }
}

impl From<maps::Error> for Error {
    fn from(error: maps::Error) -> Self {
        match error {
            maps::Error::Master(error) => error.into(),
            maps::Error::Linear(error) => error.into(),
            error => Self::Map(error),
        }
    }
}

impl From<BundleError> for Error {
    fn from(error: BundleError) -> Self {
        match error {
            BundleError::Master(error) => Self::Master(error),
            error => Self::Bundle(error),
        }
    }
}

impl From<TuneError> for Error {
    fn from(error: TuneError) -> Self {
        error.into_master().map_or_else(Self::Tune, Self::from)
    }
}

impl From<LinearError> for Error {
    fn from(error: LinearError) -> Self {
        match error {
            LinearError::Start(error) => error.into(),
            error => Self::Modes(error),
        }
    }
}

impl From<FloquetError> for Error {
    fn from(error: FloquetError) -> Self {
        match error {
            FloquetError::Start(error) => error.into(),
            FloquetError::Linear(LinearError::Start(error)) => error.into(),
            error => Self::Floquet(error),
        }
    }
}

impl From<ResponseError> for Error {
    fn from(error: ResponseError) -> Self {
        match error {
            ResponseError::Linear(error) => error.into(),
            error => Self::Response(error),
        }
    }
}

impl Error {
    /// The fault of a unit whose call was given up because the user ended a hanging step.
    #[must_use]
    pub fn given_up(&self) -> Option<&FmuFault> {
        let first: Option<&(dyn std::error::Error + 'static)> = Some(self);
        std::iter::successors(first, |error| error.source())
            .find_map(|error| error.downcast_ref::<FmuError>())
            .map(FmuError::fault)
            .filter(|fault| matches!(fault, FmuFault::Lost { how: Loss::GivenUp, .. }))
    }

    /// 1 for a failed run, 2 for bad usage or input.
    #[must_use]
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Master(error) if error.is_failed_run() => 1,
            Self::Accuracy(error)
            | Self::Study(StudyError::Accuracy { source: error, .. })
            | Self::Bundle(BundleError::Accuracy(error))
                if error.is_failed_run() =>
            {
                1
            }
            Self::Plot { .. } | Self::Pixels { .. } | Self::GivenUp => 1,
            Self::Study(StudyError::Output { .. } | StudyError::Worker { .. }) => 1,
            Self::Instantiate(error) if error.fault().is_loss() => 1,
            Self::Output { running: true, .. } | Self::Parquet { .. } => 1,
            Self::Tune(TuneError::Unstable { .. } | TuneError::Search { .. }) => 1,
            Self::Journal(JournalError::Write { .. })
            | Self::Map(maps::Error::Journal(JournalError::Write { .. }))
            | Self::Tune(TuneError::Journal(JournalError::Write { .. })) => 1,
            Self::Write { .. } | Self::Program(_) => 1,
            Self::Temporary(_) | Self::Ssp(SspError::Write { .. }) => 1,
            Self::Page(error) if !error.is_bad_input() => 1,
            Self::Reference(ReferenceError::Unit(_)) => 1,
            _ => 2,
        }
    }

    /// The same error, with the results folder as the user wrote it.
    pub(crate) fn with_folder(mut self, absolute: &Path, given: &Path) -> Self {
        if let Self::Output { path, .. } | Self::Parquet { folder: path, .. } = &mut self
            && let Ok(rest) = path.strip_prefix(absolute)
        {
            // joining an empty path would add a slash
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

    /// How to fix it, if that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Master(error) => return error.help(),
            Self::Accuracy(error) => return error.help(),
            Self::Study(error) => return error.help(),
            Self::Modes(error) => return error.help(),
            Self::Floquet(error) => return error.help(),
            Self::Fit(error) => return error.help(),
            Self::Page(error) => return error.help(),
            Self::Map(error) => return error.help(),
            Self::Tune(error) => return error.help(),
            Self::Journal(error) => return error.help(),
            Self::Response(error) => return error.help(),
            Self::NothingAsked | Self::NoLoop => "see `maglev response --help` for examples",
            Self::Package(error) => return error.help(),
            Self::Bundle(error) => return error.help(),
            Self::Derive(error) => return error.help(),
            Self::Ssp(error) => return error.help(),
            Self::NoSystem { .. } => "write an archive with --ssp FILE",
            Self::SystemDynamic => {
                "write its units into a folder with `maglev export SYSTEM.ssp --scenario DIR`, and check each"
            }
            Self::Temporary(_) => "set TMPDIR to a folder that is writable",
            Self::Library(error) => error.help(),
            Self::Instantiate(error) => return error.fault().help(),
            Self::Unreadable(_) => "give the path of a .fmu file",
            Self::Defects(error) => error.help(),
            Self::Check(error) => return error.help(),
            Self::Report(_) => {
                "reports are not part of the FMI standard; see the unit's documentation"
            }
            Self::Parquet { .. } => "free space on the disk",
            Self::NoCheckpoints { .. } => {
                "run without checkpoints, or export the units with canSerializeFMUstate"
            }
            Self::Checkpoint(error) => return error.help(),
            Self::Output { source, .. } if source.kind() == ErrorKind::NotFound => {
                "the folder no longer exists or cannot be made; choose another with --out, and do not move or remove it \
                 while a run writes to it"
            }
            Self::Reference(error) => return error.help(),
            Self::Output { .. } => "choose another folder with --out, or free space on the disk",
            Self::GivenUp
            | Self::Write { .. }
            | Self::Program(_)
            | Self::Pixels { .. }
            | Self::NoPosition { .. }
            | Self::NoOrders { .. }
            | Self::UnknownFormat { .. } => return None,
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
