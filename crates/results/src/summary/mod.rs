//! summary.json: what ran, how it ended, how long it took, and the statistics of the signals.

mod coupling;
mod real_time;
mod ride;

use std::collections::BTreeMap;
use std::path::Path;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

pub use coupling::{
    AlgorithmSummary, ControlReport, CouplingSummary, Iteration, PowerReport, SolvedLoop,
};
pub use real_time::{OverrunClass, RealTime};
pub use ride::{DirectionQuality, PointQuality, RideQuality};

use crate::{EventKind, SUMMARY, Statistics, write_whole};

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// At its stop time.
    Finished,
    /// By the user.
    Interrupted,
    /// A unit asked to end it: `fmi2Discard` with `fmi2Terminated`.
    Terminated,
    /// By an error.
    Failed,
}

/// An error as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunFailure {
    /// What happened, outermost first.
    pub causes: Vec<String>,
    /// How to mend it.
    pub help: Option<String>,
}

/// A unit that took part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FmuSummary {
    /// The .fmu file.
    pub path: String,
    /// Name of the model.
    pub model: String,
    /// Version of the model.
    pub version: Option<String>,
    /// Fingerprint.
    pub guid: String,
    /// What exported it.
    pub generation_tool: Option<String>,
    /// Number of instances.
    pub instances: usize,
    /// Finished steps of all instances.
    pub steps: u64,
    /// Wall time in `fmi2DoStep` of all instances (s), extrapolated from every seventh step.
    pub step_seconds: f64,
    /// Wall time in calls that set inputs and get outputs (s), extrapolated likewise.
    pub exchange_seconds: f64,
}

/// An instance that took part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InstanceSummary {
    /// Its unit's name in the scenario.
    pub unit: String,
    /// Relative tolerance that it was told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Finished steps, also those that others took back, and each part of a step made in parts.
    pub steps: u64,
    /// Steps that returned `fmi2Warning`.
    pub warned_steps: u64,
    /// Since when its steps have returned `fmi2Warning` and changed nothing (s), if they did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stalled_since: Option<f64>,
    /// Steps that it discarded, and that were tried again in parts.
    pub discarded_steps: u64,
    /// Messages that it sent.
    pub messages: u64,
    /// Wall time in `fmi2DoStep` (s), extrapolated from every seventh step.
    pub step_seconds: f64,
    /// Wall time in calls that set inputs and get outputs (s), extrapolated likewise.
    pub exchange_seconds: f64,
}

/// Wall times (s).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WallTime {
    /// From opening the units to the end, of the last part of a resumed run.
    pub total_seconds: f64,
    /// Opening, loading, instantiating and initializing, likewise.
    pub start_seconds: f64,
    /// Stepping, with recording, checkpoints and waiting for real time; all parts of a resumed run.
    pub run_seconds: f64,
    /// Thereof in the units' code.
    pub units_seconds: f64,
    /// Thereof in the master: coupling, recording, drawing of progress.
    pub master_seconds: f64,
}

/// A recorded signal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalSummary {
    /// Its unit, in SI base units where the description defines it.
    pub unit: Option<String>,
    /// Of a String, which has no statistics, the last text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub final_text: Option<String>,
    /// Statistics over every communication point at which it is finite.
    #[serde(flatten, deserialize_with = "crate::statistics::if_any")]
    pub statistics: Option<Statistics>,
    /// Number of communication points at which it is NaN or infinite.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub not_finite: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// A message of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FmuMessage {
    /// Simulated time at the end of the step in which it arrived (s).
    pub time: f64,
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// Status by its name in the standard.
    pub status: String,
    /// The text.
    pub text: String,
}

/// Everything in summary.json.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Summary {
    /// Identifier of the run, as in run-files.json.
    pub run: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Its title.
    pub title: String,
    /// How the run ended.
    pub status: Status,
    /// Why, if it failed; of a run that came to its end, the unit that failed when it was terminated.
    pub error: Option<RunFailure>,
    /// Start time (s).
    pub start: f64,
    /// Intended stop time (s).
    pub stop: f64,
    /// Communication step (s).
    pub step: f64,
    /// Finished communication steps.
    pub steps: u64,
    /// Simulated time at the end (s).
    pub reached: f64,
    /// Rows in the results.
    pub rows: u64,
    /// How often the run went on from a checkpoint.
    pub resumed: u64,
    /// Simulated time over wall time of the stepping.
    pub real_time_factor: f64,
    /// How units were coupled.
    pub algorithm: AlgorithmSummary,
    /// Loops solved before the start.
    pub initial_loops: Vec<SolvedLoop>,
    /// Wall times.
    pub wall_time: WallTime,
    /// Version of this program.
    pub master_version: String,
    /// Settings given on the command line.
    pub overrides: Vec<String>,
    /// Units by their name in the scenario.
    pub units: IndexMap<String, FmuSummary>,
    /// Instances by their name.
    pub instances: IndexMap<String, InstanceSummary>,
    /// How well the run kept to real time, if it was held to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_time: Option<RealTime>,
    /// Number of events by their kind; events.csv has them all.
    pub events: BTreeMap<EventKind, u64>,
    /// Recorded signals.
    pub signals: IndexMap<String, SignalSummary>,
    /// How the run feels at the points that the scenario names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ride_quality: Option<RideQuality>,
    /// The units' first messages.
    pub messages: Vec<FmuMessage>,
    /// Number of the units' messages that are not among these.
    pub omitted_messages: u64,
    /// Results in the folder.
    pub tables: Vec<String>,
    /// Pictures in the folder.
    pub pictures: Vec<String>,
}

impl Summary {
    /// Writes summary.json into the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        write_whole(&folder.join(SUMMARY), text.as_bytes())
    }
}
