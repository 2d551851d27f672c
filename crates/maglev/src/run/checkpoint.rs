//! The checkpoint of a run: everything that is needed to go on from it in another process.
//!
//! The file `checkpoint.bin`: the line `maglev checkpoint`, then, with the lowest byte first, the
//! version of the format (4 bytes), the length of the content (8 bytes), its CRC-32 (4 bytes), and
//! the content in postcard's encoding.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::journal::JournalState;
use super::output::OutputState;
use super::totals::Earlier;
use master::SimulationState;
use master::system::System;
use master::{Misfit, StateError};
use results::write_whole;
use results::{CHECKPOINT, Fingerprint, FolderError, fingerprint};
use scenario::{Override, Scenario, ScenarioError};

/// First line of a checkpoint.
const MAGIC: &[u8] = b"maglev checkpoint\n";
/// Version of the format; another one is not read.
const VERSION: u32 = 2;
const HEADER: usize = MAGIC.len() + 4 + 8 + 4;

/// Why a run cannot go on from a checkpoint.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// There is none.
    #[error("there is no checkpoint in {folder}")]
    Missing {
        /// Where it was looked for.
        folder: PathBuf,
    },
    /// It cannot be read.
    #[error("{path} cannot be read")]
    Read {
        /// Path of the checkpoint.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// It is another kind of file.
    #[error("this is no checkpoint of maglev")]
    Foreign,
    /// Another version of the format.
    #[error("the checkpoint is of format {found}; this program reads format {VERSION}")]
    Version {
        /// Format version that the file states.
        found: u32,
    },
    /// Its size is not what it says.
    #[error("the checkpoint is cut or too long: {found} bytes instead of {expected}")]
    Size {
        /// Bytes that it says to have.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// Its bytes have changed.
    #[error("the checkpoint is damaged: its checksum is wrong")]
    Damaged,
    /// Its content makes no sense.
    #[error("the checkpoint's content cannot be read: {message}")]
    Content {
        /// What is damaged, in words.
        message: String,
    },
    /// The scenario in it is unusable.
    #[error("the checkpoint's scenario cannot be used")]
    Scenario(#[from] ScenarioError),
    /// A unit is not what it was.
    #[error("unit {name}: {path} is not the file that the run began with: {what} differs")]
    Unit {
        /// Key in `units`.
        name: String,
        /// Path of the .fmu file, as it was given.
        path: PathBuf,
        /// GUID or content.
        what: &'static str,
    },
    /// What is restored does not fit.
    #[error(transparent)]
    State(#[from] StateError),
    /// The folder cannot be taken.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A results file is not the one that the checkpoint was written with.
    #[error("the results {path} cannot be continued")]
    Results {
        /// Path of the checkpoint.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
}

impl CheckpointError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Missing { .. } => {
                "a run writes checkpoints if asked to with --checkpoint-every, and a finished one leaves \
                 none"
            }
            Self::Unit { .. } => {
                "put back the file that the run began with, or run the scenario again"
            }
            Self::Scenario(error) => return error.help(),
            Self::Read { .. } => "check the folder and the files in it",
            _ => "run the scenario again",
        })
    }
}

/// A unit's file by what tells that it has changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct UnitStamp {
    name: String,
    path: PathBuf,
    guid: String,
    bytes: u64,
    checksum: u32,
}

/// A run's state at a communication point, with all that it takes to start it anew.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Identifier of the run.
    pub(super) run: String,
    /// The scenario's file name without ending.
    pub(super) name: String,
    /// The scenario with its changes from the command line, as JSON.
    scenario: String,
    /// Targets and values.
    overrides: Vec<(String, String)>,
    units: Vec<UnitStamp>,
    pub(super) simulation: SimulationState,
    pub(super) output: OutputState,
    pub(super) journal: JournalState,
    pub(super) earlier: Earlier,
}

/// The part of all checkpoints of a run that stays the same.
#[derive(Debug, Clone)]
pub(super) struct Origin {
    /// identifier of the run, which gets it with its folder
    pub(super) run: String,
    name: String,
    scenario: String,
    overrides: Vec<(String, String)>,
    units: Vec<UnitStamp>,
}

impl Origin {
    pub(super) fn new(
        name: &str,
        scenario: &Scenario,
        system: &System,
    ) -> Result<Self, CheckpointError> {
        let mut scenario = scenario.clone();
        let given = std::mem::take(&mut scenario.overrides);
        let mut units = Vec::new();
        for (name, path) in &mut scenario.units {
            // a resumed run may start in another folder
            let read = |source| CheckpointError::Read { path: path.clone(), source };
            let absolute = std::path::absolute(&*path).map_err(read)?;
            if let Some(plan) = system.instances.iter().find(|plan| plan.package.path() == path) {
                let Fingerprint { bytes, crc32: checksum } = fingerprint(path).map_err(read)?;
                units.push(UnitStamp {
                    name: name.clone(),
                    path: absolute.clone(),
                    guid: plan.description().guid.clone(),
                    bytes,
                    checksum,
                });
            }
            *path = absolute;
        }
        // a scenario came from JSON or from a program's own values; both print
        let scenario = serde_json::to_string(&scenario)
            .map_err(|error| CheckpointError::Content { message: error.to_string() })?;
        let overrides = given.iter().map(|it| (it.target.clone(), it.value.clone())).collect();
        Ok(Self { run: String::new(), name: name.to_owned(), scenario, overrides, units })
    }

    pub(super) fn checkpoint(
        &self,
        simulation: SimulationState,
        output: OutputState,
        journal: JournalState,
        earlier: Earlier,
    ) -> Checkpoint {
        let Self { run, name, scenario, overrides, units } = self.clone();
        Checkpoint { run, name, scenario, overrides, units, simulation, output, journal, earlier }
    }
}

impl Checkpoint {
    /// Where the checkpoint of a folder is.
    #[must_use]
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(CHECKPOINT)
    }

    /// Reads the checkpoint of a results folder.
    ///
    /// # Errors
    /// There is none, or it cannot be used.
    pub fn read(folder: &Path) -> Result<Self, CheckpointError> {
        let path = Self::path(folder);
        let bytes = fs::read(&path).map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => CheckpointError::Missing { folder: folder.to_owned() },
            _ => CheckpointError::Read { path: path.clone(), source },
        })?;
        Self::decode(&bytes)
    }

    /// Writes it into the results folder in place of an earlier one.
    ///
    /// # Errors
    /// The file cannot be written; then the earlier one is still there.
    pub(super) fn write(&self, folder: &Path) -> Result<(), io::Error> {
        write_whole(&Self::path(folder), &self.encode().map_err(io::Error::other)?)
    }

    /// The bytes of the file.
    fn encode(&self) -> Result<Vec<u8>, postcard::Error> {
        let content = postcard::to_stdvec(self)?;
        let mut bytes = Vec::with_capacity(HEADER + content.len());
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&(content.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&crc32fast::hash(&content).to_le_bytes());
        bytes.extend_from_slice(&content);
        Ok(bytes)
    }

    /// Reads the bytes of a checkpoint.
    ///
    /// # Errors
    /// They are not a checkpoint, of another version, cut or damaged.
    pub fn decode(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let rest = bytes.strip_prefix(MAGIC).ok_or(CheckpointError::Foreign)?;
        let cut = || CheckpointError::Size { expected: HEADER as u64, found: bytes.len() as u64 };
        let (version, rest) = rest.split_first_chunk().ok_or_else(cut)?;
        let found = u32::from_le_bytes(*version);
        if found != VERSION {
            return Err(CheckpointError::Version { found });
        }
        let (length, rest) = rest.split_first_chunk().ok_or_else(cut)?;
        let (checksum, content) = rest.split_first_chunk().ok_or_else(cut)?;
        let (expected, found) = (u64::from_le_bytes(*length), content.len() as u64);
        if expected != found {
            return Err(CheckpointError::Size { expected, found });
        }
        if crc32fast::hash(content) != u32::from_le_bytes(*checksum) {
            return Err(CheckpointError::Damaged);
        }
        let (checkpoint, left) = postcard::take_from_bytes(content)
            .map_err(|error| CheckpointError::Content { message: error.to_string() })?;
        if !left.is_empty() {
            let message = format!("{} bytes too many", left.len());
            return Err(CheckpointError::Content { message });
        }
        Ok(checkpoint)
    }

    /// The scenario that the run began with, and the values given besides it; paths of units are
    /// absolute.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn scenario(&self, folder: &Path) -> Result<Scenario, ScenarioError> {
        let mut scenario = Scenario::parse(&self.scenario, &Self::path(folder))?;
        let given = |(target, value): &(String, String)| Override {
            target: target.clone(),
            value: value.clone(),
        };
        scenario.overrides = self.overrides.iter().map(given).collect();
        Ok(scenario)
    }

    /// What stays the same in all checkpoints of the run, if the units are those that it began with.
    ///
    /// # Errors
    /// A unit has changed.
    pub(super) fn origin(
        &self,
        scenario: &Scenario,
        system: &System,
    ) -> Result<Origin, CheckpointError> {
        let mut origin = Origin::new(&self.name, scenario, system)?;
        origin.run.clone_from(&self.run);
        if origin.units.len() != self.units.len() {
            return Err(StateError::Misfit { what: Misfit::Units }.into());
        }
        for (now, then) in origin.units.iter().zip(&self.units) {
            let differs = |what| {
                let (name, path) = (now.name.clone(), now.path.clone());
                Err(CheckpointError::Unit { name, path, what })
            };
            if now.guid != then.guid {
                return differs("the GUID");
            }
            if (now.bytes, now.checksum) != (then.bytes, then.checksum) {
                return differs("the content");
            }
        }
        Ok(origin)
    }
}
