//! Scenario files: the units of a co-simulation, their connections, how they step and what is recorded.
//!
//! A scenario is JSON. `maglev schema` prints its schema, and `scenarios/schema.json` is a copy. A file may extend
//! another one (JSON Merge Patch, RFC 7396), and every object may have a `"$comment"`. Unknown and duplicate keys are
//! errors. Every error names the file, the JSON path and the line.
//!
//! [`Scenario::load`] reads a file, [`Scenario::check`] checks ranges, [`Scenario::schema`] is the schema.

pub mod algorithm;
mod alone;
mod chained;
mod check;
mod condition;
mod conditions;
mod connection;
mod error;
mod events;
mod exceptions;
mod experiment;
mod file;
mod inputs;
mod instance;
mod log;
mod objectives;
mod overrides;
mod read;
mod record;
mod ride;
mod schema;
mod suggestions;
pub mod table;
mod units;

use std::path::PathBuf;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use algorithm::{
    Acceleration, AlgorithmGroup, AlgorithmName, AlgorithmSettings, Estimate, IterationSettings,
    JacobianSource, OnDiscard, PowerPair, VariableStep,
};
pub use alone::alone;
pub use chained::read_chain;
pub use condition::{Comparison, Condition};
pub use conditions::{Checkpoints, Initialization, IsolationSettings};
pub use connection::{Connection, Sources, Targets, Term, WeightedTerm};
pub use criteria::Metric;
pub use error::ScenarioError;
pub use events::{Event, StopCondition};
pub use experiment::Experiment;
pub use fmi2_derive::UnitSource;
pub use inputs::{
    ChirpSignal, FileSignal, InputSignal, Interpolation, NoiseSignal, PulseSignal, RampSignal,
    SignalOverTime, SineSignal, StepSignal, TableSignal,
};
pub use instance::{FileSetting, InstanceSettings, Setting};
pub use log::{DebugLog, LogLevel};
pub use objectives::MetricSignal;
pub use overrides::Override;
pub use record::{Plot, PlotPanel, Record, Recorded, RecordedGroup, ResultFormat};
pub use ride::{RidePoint, VerticalWeighting};
pub use suggestions::GivenTimes;

/// A co-simulation: units, instances, connections, experiment, algorithm, recorded signals and plots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Co-simulation scenario")]
pub struct Scenario {
    /// Path or URL of the schema, for editors.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Title of the scenario, one line.
    #[serde(default)]
    pub title: String,
    /// Description of the scenario for its readers.
    #[serde(default)]
    pub description: String,
    /// The units: paths of the .fmu files, relative to the scenario file, or objects that also change resources of the
    /// unit, such as the layout of a vehicle. The keys are the names that instances refer to.
    pub units: IndexMap<String, UnitSource>,
    /// Instances by name. `ems_[01..64]` is a row of 64 equal instances.
    pub instances: IndexMap<String, InstanceSettings>,
    /// Connections from outputs to inputs.
    #[serde(default)]
    pub connections: Vec<Connection>,
    /// Signals over time for inputs without a connection.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<InputSignal>,
    /// What changes during the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<Event>,
    /// Conditions that end the run early, as a result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop_when: Vec<StopCondition>,
    /// Start, stop and communication step.
    pub experiment: Experiment,
    /// How the units are coupled.
    #[serde(default)]
    pub algorithm: AlgorithmSettings,
    /// Accuracy of the recorded signals, for example 1e-4: `maglev run` then chooses step and algorithm before it runs.
    /// It simulates the first part of the run, with steps up to 32 times `experiment.step`, halved until the difference
    /// from the run with half the step is within the accuracy: the RMS of the difference relative to the RMS of the
    /// deviation from the mean, of the worst signal. Studies, fits and bundles choose one step and keep the algorithm;
    /// analyses without a run (modes, maps) use step and algorithm as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub accuracy: Option<f64>,
    /// Time from the start that is simulated to choose the step (s). Default: 5, or the whole run if it is shorter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub accuracy_over: Option<f64>,
    /// How loops between units are solved during initialization.
    #[serde(default)]
    pub initialization: Initialization,
    /// Units in separate processes, so that a crash of a unit does not end the run.
    #[serde(default)]
    pub isolation: IsolationSettings,
    /// Recorded signals and the format of the results.
    #[serde(default)]
    pub record: Record,
    /// Saved states, from which `maglev resume` continues a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<Checkpoints>,
    /// Speed of the run: simulated seconds per second of wall time. Default: as fast as possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub real_time: Option<f64>,
    /// Pictures that are drawn after the run.
    #[serde(default)]
    pub plots: Vec<Plot>,
    /// Points at which ride quality is evaluated after the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ride_quality: Vec<RidePoint>,
    /// Figures of signals that are computed after the run, by name. They go to metrics.json.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub objectives: IndexMap<String, Metric>,
    /// Figures with bounds, by name. They go to metrics.json, and `maglev check` judges the run by them.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub limits: IndexMap<String, Metric>,
    /// Refuse units in which `maglev validate` finds an error. Otherwise such units run with a warning.
    #[serde(default)]
    pub strict: bool,
    /// Which messages of units are shown on the terminal.
    #[serde(default, skip_serializing_if = "LogLevel::is_default")]
    pub log_level: LogLevel,
    /// File for a trace of all C calls to all units, relative to the scenario file. Default: no trace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace: Option<PathBuf>,
    /// Notes for the user on values that were completed while the file was read.
    #[serde(skip)]
    pub notes: Vec<String>,
    /// Values of `--set`, which replace those of the file. The last one for a variable counts.
    #[serde(skip)]
    pub overrides: Vec<Override>,
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const MINIMAL: &str = r#"{"units": {"a": "a.fmu"}, "instances": {"a": {"unit": "a"}},
        "experiment": {"stop": 1.0, "step": 0.1}}"#;

    fn parse(text: &str) -> Result<Scenario, ScenarioError> {
        Scenario::parse(text, Path::new("s.json"))
    }

    #[test]
    fn issue_unknown_and_duplicate_keys_name_their_path() {
        let error = parse(&MINIMAL.replace("\"unit\"", "\"unti\"")).unwrap_err().to_string();
        assert!(error.contains("instances.a") && error.contains("unti"), "{error}");
        let doubled = MINIMAL.replace("\"a\": \"a.fmu\"", "\"a\": \"a.fmu\", \"a\": \"b.fmu\"");
        let error = parse(&doubled).unwrap_err().to_string();
        assert!(error.contains("units") && error.contains("twice"), "{error}");
        let error = parse(&format!("{MINIMAL} x")).unwrap_err().to_string();
        assert!(error.contains("trailing"), "{error}");
    }

    #[test]
    fn analytic_steps_are_counted() {
        let steps = |start, stop, step| Experiment { start, stop, step, tolerance: None }.steps();
        assert_eq!(steps(0.0, 75.0, 0.001).unwrap(), 75_000);
        assert_eq!(steps(0.1, 0.4, 0.1).unwrap(), 3);
        assert!(matches!(steps(0.0, 1.0, 0.3), Err(ScenarioError::StepDoesNotDivide { .. })));
        assert!(matches!(steps(0.0, 1.0, 3.0), Err(ScenarioError::StepDoesNotDivide { .. })));
        assert!(matches!(steps(0.0, 1e18, 0.1), Err(ScenarioError::TooManySteps { .. })));
        for (stop, step) in [(0.0, 0.1), (1.0, 0.0), (1.0, -0.1), (f64::NAN, 0.1)] {
            assert!(matches!(steps(0.0, stop, step), Err(ScenarioError::Experiment { .. })));
        }
    }

    #[test]
    fn invariant_scenarios_survive_a_round_trip() {
        let scenario = parse(MINIMAL).unwrap();
        let text = serde_json::to_string(&scenario).unwrap();
        assert_eq!(parse(&text).unwrap(), scenario);
    }
}
