//! The checkpoint of a run: everything that is needed to go on from it in another process.
//!
//! The file `checkpoint.bin`: the line `maglev checkpoint`, then, with the lowest byte first, the
//! version of the format (4 bytes), the length of the content (8 bytes), its CRC-32 (4 bytes), and
//! the content in postcard's encoding.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::journal::JournalState;
use super::output::OutputState;
use super::simulation::SimulationState;
use super::totals::Earlier;
use crate::instance::UnitError;
use crate::record::write_whole;
use crate::scenario::{Scenario, ScenarioError};
use crate::system::{Override, System};

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
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// It is another kind of file.
    #[error("this is no checkpoint of maglev")]
    Foreign,
    /// Another version of the format.
    #[error("the checkpoint is of format {found}; this program reads format {VERSION}")]
    Version {
        /// Its version.
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
        /// Why.
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
        /// The .fmu file.
        path: PathBuf,
        /// GUID or content.
        what: &'static str,
    },
    /// What is restored does not fit.
    #[error("the checkpoint does not fit: other {what}")]
    Misfit {
        /// What differs.
        what: &'static str,
    },
    /// The folder holds the files of another run.
    #[error(
        "the files in {folder} are of two runs: checkpoint.bin is of run {run}, run-files.json of \
         run {other}"
    )]
    OtherRun {
        /// The results folder.
        folder: PathBuf,
        /// The checkpoint's run.
        run: String,
        /// The run that the folder belongs to.
        other: String,
    },
    /// A unit refuses its state.
    #[error("a unit does not take its state back")]
    State {
        /// Why.
        #[source]
        source: UnitError,
    },
    /// A results file is not the one that the checkpoint was written with.
    #[error("the results {path} cannot be continued")]
    Results {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
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
    /// Name of the scenario.
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
        overrides: &[Override],
        system: &System,
    ) -> Result<Self, CheckpointError> {
        let mut scenario = scenario.clone();
        let mut units = Vec::new();
        for (name, path) in &mut scenario.units {
            // a resumed run may start in another folder
            let read = |source| CheckpointError::Read { path: path.clone(), source };
            let absolute = std::path::absolute(&*path).map_err(read)?;
            if let Some(plan) = system.instances.iter().find(|plan| plan.package.path() == path) {
                let (bytes, checksum) = fingerprint(path).map_err(read)?;
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
        let overrides =
            overrides.iter().map(|entry| (entry.target.clone(), entry.value.clone())).collect();
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

/// Length and CRC-32 of a file.
pub(super) fn fingerprint(path: &Path) -> io::Result<(u64, u32)> {
    let mut file = File::open(path)?;
    let mut hasher = crc32fast::Hasher::new();
    let mut buffer = vec![0; 1 << 16];
    let mut length = 0;
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((length, hasher.finalize())),
            n => {
                hasher.update(&buffer[..n]);
                length += n as u64;
            }
        }
    }
}

impl Checkpoint {
    /// Where the checkpoint of a folder is.
    #[must_use]
    pub fn path(folder: &Path) -> PathBuf {
        folder.join("checkpoint.bin")
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

    /// The scenario that the run began with; paths of units are absolute.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn scenario(&self, folder: &Path) -> Result<Scenario, ScenarioError> {
        Scenario::parse(&self.scenario, &Self::path(folder))
    }

    /// Settings that were given besides the scenario.
    #[must_use]
    pub fn overrides(&self) -> Vec<Override> {
        let entry = |(target, value): &(String, String)| Override {
            target: target.clone(),
            value: value.clone(),
        };
        self.overrides.iter().map(entry).collect()
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
        let mut origin = Origin::new(&self.name, scenario, &self.overrides(), system)?;
        origin.run.clone_from(&self.run);
        if origin.units.len() != self.units.len() {
            return Err(CheckpointError::Misfit { what: "units" });
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
