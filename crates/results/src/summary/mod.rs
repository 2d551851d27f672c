//! summary.json: which scenario ran, how the run ended, how long it took, and the statistics of the signals.

mod accuracy;
mod coupling;
mod real_time;
mod ride;

use std::collections::BTreeMap;
use std::path::Path;

use criteria::Verdict;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

pub use accuracy::{AccuracyReport, AccuracyTrial};
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
    /// It reached its stop time.
    Finished,
    /// The user stopped it.
    Interrupted,
    /// A stop condition of the scenario ended it.
    Stopped,
    /// A unit terminated it: `fmi2Discard` with `fmi2Terminated`.
    Terminated,
    /// An error stopped it.
    Failed,
}

/// An error as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunFailure {
    /// Messages of the error and its causes, outermost first.
    pub causes: Vec<String>,
    /// How to fix it, if that is known.
    pub help: Option<String>,
}

/// An FMU of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FmuSummary {
    /// The .fmu file.
    pub path: String,
    /// Its resources that the scenario changes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resources: Vec<String>,
    /// Name of the model.
    pub model: String,
    /// Version of the model.
    pub version: Option<String>,
    /// GUID of the description.
    pub guid: String,
    /// Name of the exporting tool.
    pub generation_tool: Option<String>,
    /// Number of instances.
    pub instances: usize,
    /// Completed steps of all instances.
    pub steps: u64,
    /// Wall time in `fmi2DoStep` of all instances (s), extrapolated from every seventh step.
    pub step_seconds: f64,
    /// Wall time in calls that set inputs and get outputs (s), extrapolated likewise.
    pub exchange_seconds: f64,
}

/// An instance of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InstanceSummary {
    /// Key of its FMU in `units`.
    pub unit: String,
    /// Relative tolerance passed to `fmi2SetupExperiment`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Completed steps, including rejected ones and each part of a subdivided step.
    pub steps: u64,
    /// Steps that returned `fmi2Warning`.
    pub warned_steps: u64,
    /// Time (s) since which its steps have returned `fmi2Warning` without changing anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stalled_since: Option<f64>,
    /// Steps that it discarded and that were repeated in smaller steps.
    pub discarded_steps: u64,
    /// Number of its messages.
    pub messages: u64,
    /// Wall time in `fmi2DoStep` (s), extrapolated from every seventh step.
    pub step_seconds: f64,
    /// Wall time in calls that set inputs and get outputs (s), extrapolated likewise.
    pub exchange_seconds: f64,
}

/// Wall times (s).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WallTime {
    /// From opening the units to the end; of a resumed run, its last part.
    pub total_seconds: f64,
    /// Opening, loading, instantiating and initializing the units, of the same part.
    pub start_seconds: f64,
    /// Stepping, including recording, checkpoints and waiting for real time; of all parts of a resumed run.
    pub run_seconds: f64,
    /// Part of `run_seconds` spent in the code of the units: the sum over all instances, extrapolated from
    /// every seventh step. On several threads it may exceed `run_seconds`.
    pub units_seconds: f64,
    /// Part of `run_seconds` spent in the master: coupling, recording, showing progress. Unknown if units
    /// stepped on several threads, or if `units_seconds` exceeds `run_seconds`.
    pub master_seconds: Option<f64>,
}

/// A recorded signal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalSummary {
    /// Its unit of measure, in SI base units if the description defines it.
    pub unit: Option<String>,
    /// Last value of a String signal, which has no statistics.
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
    /// Status, by its name in the standard.
    pub status: String,
    /// Text of the message.
    pub text: String,
}

/// Everything in summary.json.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Summary {
    /// Identifier of the run, as in run-files.json.
    pub run: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Title of the scenario.
    pub title: String,
    /// How the run ended.
    pub status: Status,
    /// Why the run ended before its stop time: the stop condition, or what the unit that terminated it reported.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_by: Option<String>,
    /// The error if the run failed, or if a unit failed when it was terminated after a complete run.
    pub error: Option<RunFailure>,
    /// Start time (s).
    pub start: f64,
    /// Intended stop time (s).
    pub stop: f64,
    /// Communication step (s).
    pub step: f64,
    /// Completed communication steps.
    pub steps: u64,
    /// Simulated time at the end (s).
    pub reached: f64,
    /// Rows in the results.
    pub rows: u64,
    /// How often the run was resumed from a checkpoint.
    pub resumed: u64,
    /// Simulated time divided by the wall time of stepping.
    pub real_time_factor: f64,
    /// How units were coupled.
    pub algorithm: AlgorithmSummary,
    /// Algebraic loops solved before the start.
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
    /// How well the run kept up with real time, if that was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_time: Option<RealTime>,
    /// Number of events of each kind. events.csv contains the events.
    pub events: BTreeMap<EventKind, u64>,
    /// Recorded signals.
    pub signals: IndexMap<String, SignalSummary>,
    /// Ride quality at the points of the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ride_quality: Option<RideQuality>,
    /// Named figures of the scenario, and the verdicts on those with limits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub metrics: Vec<Verdict>,
    /// The first messages of the units.
    pub messages: Vec<FmuMessage>,
    /// Number of further messages of the units.
    pub omitted_messages: u64,
    /// File names of the tables.
    pub tables: Vec<String>,
    /// File names of the pictures.
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
