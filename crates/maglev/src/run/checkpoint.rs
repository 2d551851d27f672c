//! The checkpoint of a run: everything that is needed to continue it in another process.
//!
//! The file `checkpoint.bin` consists of the line `maglev checkpoint`; the version of the format
//! (4 bytes), the length of the content (8 bytes) and its CRC-32 (4 bytes), little-endian; and the
//! content, encoded by postcard.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use fmi2_import::package::Package;

use super::journal::JournalState;
use super::output::OutputState;
use super::totals::Earlier;
use master::SimulationState;
use master::system::System;
use master::{Misfit, StateError};
use results::summary::AccuracyReport;
use results::write_whole;
use results::{CHECKPOINT, Fingerprint, FolderError, fingerprint};
use scenario::{Override, Scenario, ScenarioError, UnitSource};

/// First line of a checkpoint.
const MAGIC: &[u8] = b"maglev checkpoint\n";
/// Version of the format. Other versions are refused.
pub const VERSION: u32 = 4;
const HEADER: usize = MAGIC.len() + 4 + 8 + 4;

/// Why a run cannot continue from a checkpoint.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The folder contains none.
    #[error("there is no checkpoint in {folder}")]
    Missing {
        /// The results folder.
        folder: PathBuf,
    },
    /// It cannot be read.
    #[error("cannot read {path}")]
    Read {
        /// Path of the checkpoint.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// The file is something else.
    #[error("checkpoint.bin is not a checkpoint of maglev")]
    Foreign,
    /// The file has another version of the format.
    #[error("the checkpoint has format version {found}, but this program reads version {VERSION}")]
    Version {
        /// Version in the file.
        found: u32,
    },
    /// The file has the wrong length.
    #[error("the checkpoint is damaged: {found} bytes instead of {expected}")]
    Size {
        /// Bytes according to its header.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// The checksum is wrong.
    #[error("the checkpoint is damaged: its checksum is wrong")]
    Damaged,
    /// The content cannot be decoded.
    #[error("cannot read the content of the checkpoint: {message}")]
    Content {
        /// What the decoder reported.
        message: String,
    },
    /// The scenario in it is invalid.
    #[error("the checkpoint contains an invalid scenario")]
    Scenario(#[from] ScenarioError),
    /// The file of a unit has changed since the start of the run.
    #[error("unit {name}: {path} has changed since the start of the run: {what} differs")]
    Unit {
        /// Key in `units`.
        name: String,
        /// Path of the .fmu file, as it was given.
        path: PathBuf,
        /// What differs: the GUID or the content.
        what: &'static str,
    },
    /// The units do not accept the saved states.
    #[error(transparent)]
    State(#[from] StateError),
    /// The run cannot continue in the folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A results file has changed since the checkpoint was written.
    #[error("cannot continue the results in {path}")]
    Results {
        /// Path of the results file.
        path: PathBuf,
        /// What differs, or what the operating system reported.
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
                "a run writes checkpoints only with --checkpoint-every, and removes the last one when it \
                 finishes"
            }
            Self::Unit { .. } => "restore the original file, or run the scenario again",
            Self::Scenario(error) => return error.help(),
            Self::Read { .. } => "check the permissions of the folder and its files",
            _ => "run the scenario again",
        })
    }
}

/// Identifies the file of a unit, to notice that it has changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct UnitStamp {
    name: String,
    path: PathBuf,
    guid: String,
    bytes: u64,
    checksum: u32,
}

/// The state of a run at a communication point, with everything that is needed to start it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Identifier of the run.
    pub(super) run: String,
    /// File name of the scenario, without its extension.
    pub(super) name: String,
    /// The scenario as JSON, without overrides.
    scenario: String,
    /// Overrides from the command line: targets and values.
    overrides: Vec<(String, String)>,
    units: Vec<UnitStamp>,
    /// How step and algorithm were chosen, as JSON: postcard cannot read what leaves out fields.
    accuracy: Option<String>,
    pub(super) simulation: SimulationState,
    pub(super) output: OutputState,
    pub(super) journal: JournalState,
    pub(super) earlier: Earlier,
}

/// Fingerprint of a unit: of its .fmu file, and of the resources that the scenario changes. The GUID depends only on
/// those that the unit reads before it is instantiated.
fn contents(package: &Package, unit: &UnitSource) -> io::Result<Fingerprint> {
    let mut whole = fingerprint(package.path())?;
    for name in unit.resources.keys() {
        let Fingerprint { bytes, crc32 } = fingerprint(&package.resources().join(name))?;
        whole.bytes += bytes;
        whole.crc32 = crc32fast::hash(&[whole.crc32.to_le_bytes(), crc32.to_le_bytes()].concat());
    }
    Ok(whole)
}

/// The part that all checkpoints of a run have in common.
#[derive(Debug, Clone)]
pub(super) struct CheckpointOrigin {
    /// identifier of the run, which is known once its folder is prepared
    pub(super) run: String,
    name: String,
    scenario: String,
    overrides: Vec<(String, String)>,
    units: Vec<UnitStamp>,
    accuracy: Option<String>,
}

impl CheckpointOrigin {
    pub(super) fn new(
        name: &str,
        scenario: &Scenario,
        system: &System,
    ) -> Result<Self, CheckpointError> {
        let mut scenario = scenario.clone();
        let given = std::mem::take(&mut scenario.overrides);
        let mut units = Vec::new();
        for (name, unit) in &mut scenario.units {
            // a resumed run may start in another working directory
            let given = unit.fmu.clone();
            let read = |source| CheckpointError::Read { path: given.clone(), source };
            unit.map_paths(|path| std::path::absolute(path)).map_err(read)?;
            if let Some(plan) = system.instances.iter().find(|plan| plan.unit == *name) {
                let Fingerprint { bytes, crc32: checksum } =
                    contents(&plan.package, unit).map_err(read)?;
                units.push(UnitStamp {
                    name: name.clone(),
                    path: unit.fmu.clone(),
                    guid: plan.description().guid.clone(),
                    bytes,
                    checksum,
                });
            }
        }
        // a scenario can always be printed as JSON
        let scenario = serde_json::to_string(&scenario)
            .map_err(|error| CheckpointError::Content { message: error.to_string() })?;
        let overrides = given.iter().map(|it| (it.target.clone(), it.value.clone())).collect();
        let (run, name) = (String::new(), name.to_owned());
        Ok(Self { run, name, scenario, overrides, units, accuracy: None })
    }

    /// Keeps how step and algorithm were chosen.
    pub(super) fn keep(&mut self, report: Option<&AccuracyReport>) {
        // a report can always be printed as JSON
        self.accuracy = report.and_then(|it| serde_json::to_string(it).ok());
    }

    pub(super) fn checkpoint(
        &self,
        simulation: SimulationState,
        output: OutputState,
        journal: JournalState,
        earlier: Earlier,
    ) -> Checkpoint {
        let Self { run, name, scenario, overrides, units, accuracy } = self.clone();
        Checkpoint {
            run,
            name,
            scenario,
            overrides,
            units,
            accuracy,
            simulation,
            output,
            journal,
            earlier,
        }
    }
}

impl Checkpoint {
    /// Path of the checkpoint in a results folder.
    #[must_use]
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(CHECKPOINT)
    }

    /// Reads the checkpoint of a results folder.
    ///
    /// # Errors
    /// There is no checkpoint, or it cannot be used.
    pub fn read(folder: &Path) -> Result<Self, CheckpointError> {
        let path = Self::path(folder);
        let bytes = fs::read(&path).map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => CheckpointError::Missing { folder: folder.to_owned() },
            _ => CheckpointError::Read { path: path.clone(), source },
        })?;
        Self::decode(&bytes)
    }

    /// Writes the checkpoint into the results folder and replaces an earlier one.
    ///
    /// # Errors
    /// The file cannot be written. Then the earlier one is unchanged.
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
    /// The bytes are not a checkpoint, have another version, or are damaged.
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

    /// The scenario of the run, with its overrides. Paths of units are absolute.
    ///
    /// # Errors
    /// The scenario in the checkpoint is invalid.
    pub fn scenario(&self, folder: &Path) -> Result<Scenario, ScenarioError> {
        let mut scenario = Scenario::parse(&self.scenario, &Self::path(folder))?;
        let given = |(target, value): &(String, String)| Override {
            target: target.clone(),
            value: value.clone(),
        };
        scenario.overrides = self.overrides.iter().map(given).collect();
        Ok(scenario)
    }

    /// How step and algorithm were chosen, if the scenario asked for an accuracy.
    pub(super) fn accuracy(&self) -> Option<AccuracyReport> {
        self.accuracy.as_ref().and_then(|text| serde_json::from_str(text).ok())
    }

    /// The part that all further checkpoints of the run have in common. Checks that the units are the
    /// original ones.
    ///
    /// # Errors
    /// A unit has changed.
    pub(super) fn origin(
        &self,
        scenario: &Scenario,
        system: &System,
    ) -> Result<CheckpointOrigin, CheckpointError> {
        let mut origin = CheckpointOrigin::new(&self.name, scenario, system)?;
        origin.run.clone_from(&self.run);
        origin.accuracy.clone_from(&self.accuracy);
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
