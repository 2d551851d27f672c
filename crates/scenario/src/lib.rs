//! Scenario files: which units, how connected, how stepped, what to record.
//!
//! JSON, described by the schema that `maglev schema` prints and `scenarios/schema.json` holds. A
//! file may extend another one (RFC 7396) and hold `"$comment"` members. Unknown and doubled keys are
//! errors, and every error names the file and the JSON path it concerns.

pub mod algorithm;
mod alone;
mod check;
mod comment;
mod conditions;
mod connection;
mod error;
mod experiment;
mod instance;
mod json;
mod log;
mod merge;
mod overrides;
mod read;
mod record;
mod ride;
mod schema;
mod suggestions;

use std::path::PathBuf;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use algorithm::{
    Acceleration, AlgorithmGroup, AlgorithmName, AlgorithmSettings, Estimate, IterationSettings,
    JacobianSource, OnDiscard, PowerPair, VariableStep,
};
pub use alone::alone;
pub use conditions::{Checkpoints, Initialization, IsolationSettings};
pub use connection::{Connection, Sources, Targets, Term, WeightedTerm};
pub use error::ScenarioError;
pub use experiment::Experiment;
pub use instance::{FileSetting, InstanceSettings, Setting};
pub use log::{DebugLog, LogLevel};
pub use overrides::Override;
pub use record::{Plot, PlotPanel, Record, Recorded, RecordedGroup, ResultFormat};
pub use ride::{RidePoint, VerticalWeighting};
pub use suggestions::GivenTimes;

/// A co-simulation to run: units, instances, connections, experiment, algorithm, record, plots.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Co-simulation scenario")]
pub struct Scenario {
    /// Where the schema of this file is, for editors.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// A line that names the scenario.
    #[serde(default)]
    pub title: String,
    /// What it shows, for whoever reads the file.
    #[serde(default)]
    pub description: String,
    /// The .fmu files by the names that instances use; relative to the scenario file.
    pub units: IndexMap<String, PathBuf>,
    /// Instances by name; `ems_[01..64]` makes 64 alike.
    pub instances: IndexMap<String, InstanceSettings>,
    /// From outputs to inputs.
    #[serde(default)]
    pub connections: Vec<Connection>,
    /// Start, stop and communication step.
    pub experiment: Experiment,
    /// How the units are coupled.
    #[serde(default)]
    pub algorithm: AlgorithmSettings,
    /// How loops between units are solved before the start.
    #[serde(default)]
    pub initialization: Initialization,
    /// Units in processes of their own, where their crashes are caught.
    #[serde(default)]
    pub isolation: IsolationSettings,
    /// What is written to the results, and as which files.
    #[serde(default)]
    pub record: Record,
    /// States to go on from after a crash.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<Checkpoints>,
    /// Simulated seconds per second of wall time that the run is held to; left out: as fast as
    /// possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub real_time: Option<f64>,
    /// Pictures to draw.
    #[serde(default)]
    pub plots: Vec<Plot>,
    /// Points at which ride quality is judged after the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ride_quality: Vec<RidePoint>,
    /// Refuse units in which `maglev validate` finds an error: something that the standard forbids.
    /// Otherwise they are tolerated with a warning.
    #[serde(default)]
    pub strict: bool,
    /// Which messages of units are shown.
    #[serde(default, skip_serializing_if = "LogLevel::is_default")]
    pub log_level: LogLevel,
    /// File in which every C call to every unit is noted, relative to the scenario file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace: Option<PathBuf>,
    /// What was completed while it was read, to be told when it runs.
    #[serde(skip)]
    pub notes: Vec<String>,
    /// Values that replace those of the file, later ones those before: `--set`.
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
    fn issue_unknown_and_doubled_keys_name_their_path() {
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
        for (stop, step) in [(0.0, 0.1), (1.0, 0.0), (1.0, -0.1), (f64::NAN, 0.1), (1e300, 1e-300)]
        {
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
