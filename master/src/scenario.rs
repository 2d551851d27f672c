//! The scenario file: which units, how connected, how stepped, what to record.
//!
//! JSON, described by the schema that `maglev schema` prints and `scenarios/schema.json` holds.
//! Unknown and doubled keys are errors, and every error names the JSON path it concerns.

use std::fmt;
use std::hash::Hash;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::time::Duration;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use crate::coupling::settings::{
    Acceleration, Algorithm, AlgorithmName, Estimate, Group, IterationSettings, JacobianSource,
    OnDiscard, PowerPair, Variable,
};
pub use crate::ride::{RidePoint, VerticalWeighting};

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
    #[serde(deserialize_with = "unique")]
    #[schemars(with = "IndexMap<String, PathBuf>")]
    pub units: IndexMap<String, PathBuf>,
    /// Instances by name; `ems_[01..64]` makes 64 alike.
    #[serde(deserialize_with = "unique")]
    #[schemars(with = "IndexMap<String, Instance>")]
    pub instances: IndexMap<String, Instance>,
    /// From outputs to inputs.
    #[serde(default)]
    pub connections: Vec<Connection>,
    /// Start, stop and communication step.
    pub experiment: Experiment,
    /// How the units are coupled.
    #[serde(default)]
    pub algorithm: Algorithm,
    /// How loops between units are solved before the start.
    #[serde(default)]
    pub initialization: Initialization,
    /// Units in processes of their own, where their crashes are caught.
    #[serde(default)]
    pub isolation: Isolation,
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
    /// Refuse units with any defect of archive or description, which are tolerated with a warning
    /// otherwise.
    #[serde(default)]
    pub strict: bool,
}

/// One instance of a unit, or an array of equal ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Instance {
    /// Key in `units`.
    pub unit: String,
    /// Values of the unit's parameters. Names may be patterns (`gain_[1..5]`).
    #[serde(default, deserialize_with = "unique", skip_serializing_if = "IndexMap::is_empty")]
    #[schemars(with = "IndexMap<String, Setting>")]
    pub parameters: IndexMap<String, Setting>,
    /// Start values of inputs, and of other variables that accept one.
    #[serde(default, deserialize_with = "unique", skip_serializing_if = "IndexMap::is_empty")]
    #[schemars(with = "IndexMap<String, Setting>")]
    pub start: IndexMap<String, Setting>,
    /// Steps that it makes per communication step, each on its part of the inputs' polynomials.
    #[serde(default = "one_step", skip_serializing_if = "is_one_step")]
    #[schemars(range(min = 1))]
    pub steps: u32,
    /// Run it in a process of its own, or not; left out: as `isolation.all` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolate: Option<bool>,
    /// A remark, not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// A value for a variable: a number, true, false or a text; for an Enumeration the item's name or
/// number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, true, false or a text")]
pub enum Setting {
    /// For Boolean variables.
    Boolean(bool),
    /// For Real, Integer and Enumeration variables.
    Number(f64),
    /// For String variables, and for Enumerations by name.
    Text(String),
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Boolean(value) => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value}"),
            Self::Text(value) => write!(f, "{value:?}"),
        }
    }
}

impl Setting {
    /// Reads a value from the command line: true, false, a number, else a text.
    #[must_use]
    pub fn from_text(text: &str) -> Self {
        match text {
            "true" => Self::Boolean(true),
            "false" => Self::Boolean(false),
            _ => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Self::Number(number),
                _ => Self::Text(text.trim_matches('"').to_owned()),
            },
        }
    }
}

/// Signals that flow from one unit to others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connection {
    /// `instance.output`, patterns allowed.
    pub from: String,
    /// `instance.input`, or several; each stands for as many signals as `from`, or `from` is one
    /// signal that feeds all.
    pub to: Targets,
    /// Degree of the extrapolation for these targets instead of `algorithm.extrapolation`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 3))]
    pub extrapolation: Option<u8>,
    /// Connect values as they are, whatever their units of measurement.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ignore_units: bool,
    /// A remark, not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// One or several targets of a connection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"instance.input\" or a list of these")]
pub enum Targets {
    /// One target.
    One(String),
    /// Several.
    Many(Vec<String>),
}

impl Targets {
    /// All targets.
    #[must_use]
    pub fn as_slice(&self) -> &[String] {
        match self {
            Self::One(target) => std::slice::from_ref(target),
            Self::Many(targets) => targets,
        }
    }
}

/// The span of time and its division.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Start time (s).
    #[serde(default)]
    pub start: f64,
    /// Stop time (s).
    pub stop: f64,
    /// Communication step (s); `stop - start` must be a multiple of it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step: f64,
}

impl Experiment {
    /// Number of communication steps.
    ///
    /// # Errors
    /// The numbers make no sense, or the step does not divide the span within 1e-9 relative.
    pub fn steps(&self) -> Result<u64, ScenarioError> {
        let Self { start, stop, step } = *self;
        let span = stop - start;
        if !(step > 0.0 && step.is_finite() && span.is_finite() && span > 0.0) {
            return Err(ScenarioError::Experiment { start, stop, step });
        }
        let count = (span / step).round();
        // 2^53: beyond it, not every integer is a float
        if count > 9.007_199_254_740_992e15 {
            return Err(ScenarioError::Experiment { start, stop, step });
        }
        if count < 1.0 || (count * step - span).abs() > 1e-9 * span {
            return Err(ScenarioError::StepDoesNotDivide { start, stop, step });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 2^53")]
        Ok(count as u64)
    }
}

/// Units in processes of their own, where a crash, an exit or a step without end is caught.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Isolation {
    /// Isolate all instances that do not say otherwise.
    pub all: bool,
    /// Longest wall time for one step of an isolated instance (s); left out: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_timeout: Option<f64>,
    /// Longest wall time for any other call (s); left out: 60 s or `step_timeout`, whichever is
    /// longer, or no limit without `step_timeout`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub call_timeout: Option<f64>,
    /// Address space that an isolated instance may have (bytes); left out: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<u64>,
}

/// How loops between units are solved before the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Initialization {
    /// A loop is solved when every value changes by less than this, relative to itself or to a
    /// thousandth of its nominal value, whichever is larger.
    pub tolerance: f64,
    /// Sweeps over a loop before it counts as not solvable.
    pub iterations: u32,
}

impl Default for Initialization {
    fn default() -> Self {
        Self { tolerance: 1e-9, iterations: 100 }
    }
}

/// What is written to the results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// Interval between rows (s), a multiple of the step; left out: every step. Statistics are
    /// taken at every communication point all the same.
    pub interval: Option<f64>,
    /// `instance.variable`, patterns and `*` allowed, or an object with an interval of its own. A
    /// signal that several entries name is recorded as the first of them says.
    pub signals: Vec<Recorded>,
    /// Files to write: csv for results.csv, parquet for results.parquet.
    pub format: Vec<Format>,
}

impl Default for Record {
    fn default() -> Self {
        Self { interval: None, signals: Vec::new(), format: vec![Format::Csv] }
    }
}

/// Signals to record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"instance.variable\" or {\"signals\": [...], \"interval\": ...}"
)]
pub enum Recorded {
    /// One pattern, at the interval of all.
    Signal(String),
    /// Several, at an interval of their own.
    Group(RecordedGroup),
}

/// Signals recorded at an interval of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedGroup {
    /// `instance.variable`, patterns and `*` allowed.
    pub signals: Vec<String>,
    /// Interval between their values (s), a multiple of the step.
    pub interval: f64,
}

/// A format of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// results.csv
    Csv,
    /// results.parquet
    Parquet,
}

impl std::str::FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "csv" => Ok(Self::Csv),
            "parquet" => Ok(Self::Parquet),
            _ => Err(format!("there is no format \"{text}\"; there are csv and parquet")),
        }
    }
}

/// States of a run that are kept, so that `maglev resume` can go on from the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkpoints {
    /// Simulated time between two of them (s), rounded to whole steps, at least one.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub every: f64,
}

/// One picture: panels above each other over a common time axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// File name in the results folder, ending in .svg.
    pub file: String,
    /// Heading.
    #[serde(default)]
    pub title: String,
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

/// One panel of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Label of the vertical axis, with the unit after `scale`.
    #[serde(default)]
    pub ylabel: String,
    /// Factor from SI units to what is drawn.
    #[serde(default = "one")]
    pub scale: f64,
    /// Signals to draw, patterns and `*` allowed.
    pub signals: Vec<String>,
    /// Legend texts in the order of the signals; left out: their names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
}

const fn one_step() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
const fn is_one_step(steps: &u32) -> bool {
    *steps == 1
}

const fn one() -> f64 {
    1.0
}

/// Why a scenario cannot be used.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("the scenario {path} cannot be read")]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The text is no JSON.
    #[error("{path} is not JSON: {message}")]
    NotJson {
        /// Which file.
        path: PathBuf,
        /// What is wrong, with line and column.
        message: String,
    },
    /// The JSON is not what a scenario should be.
    #[error("{path}: at {at}: {message}")]
    Json {
        /// Which file.
        path: PathBuf,
        /// JSON path.
        at: String,
        /// What is wrong, with line and column.
        message: String,
    },
    /// Start, stop or step make no sense.
    #[error("experiment: start {start} s, stop {stop} s, step {step} s do not make a run")]
    Experiment {
        /// Start time (s).
        start: f64,
        /// Stop time (s).
        stop: f64,
        /// Step (s).
        step: f64,
    },
    /// The span is no multiple of the step.
    #[error(
        "experiment: the step {step} s does not divide the span from {start} s to {stop} s: \
         {} steps", (stop - start) / step
    )]
    StepDoesNotDivide {
        /// Start time (s).
        start: f64,
        /// Stop time (s).
        stop: f64,
        /// Step (s).
        step: f64,
    },
    /// A recording interval is no multiple of the step.
    #[error("{place} {interval} s is not a multiple of the step {step} s")]
    Interval {
        /// JSON path.
        place: String,
        /// Interval (s).
        interval: f64,
        /// Step (s).
        step: f64,
    },
    /// Limits for isolated instances, and no such instance.
    #[error("isolation: there are limits for isolated instances, but no instance is isolated")]
    NothingIsolated,
    /// A setting is outside of its range.
    #[error("{what} is {value}, which is outside of {range}")]
    Range {
        /// JSON path of the setting.
        what: String,
        /// Its value.
        value: String,
        /// What is allowed.
        range: &'static str,
    },
}

impl Scenario {
    /// Reads and checks a scenario file. Paths of units become relative to the working directory.
    ///
    /// # Errors
    /// The file cannot be read or is no valid scenario.
    pub fn load(path: &Path) -> Result<Self, ScenarioError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ScenarioError::Read { path: path.to_owned(), source })?;
        let mut scenario = Self::parse(&text, path)?;
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        for unit in scenario.units.values_mut() {
            *unit = folder.join(&*unit);
        }
        Ok(scenario)
    }

    /// Reads a scenario's text; `path` is for messages only.
    ///
    /// # Errors
    /// The text is no valid scenario.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ScenarioError> {
        let mut json = serde_json::Deserializer::from_str(text);
        let not_json = |error: &serde_json::Error| ScenarioError::NotJson {
            path: path.to_owned(),
            message: error.to_string(),
        };
        let scenario: Self = serde_path_to_error::deserialize(&mut json).map_err(|error| {
            if error.inner().is_syntax() || error.inner().is_eof() {
                return not_json(error.inner());
            }
            let at = match error.path().to_string() {
                top if top == "." => "the top level".to_owned(),
                at => at,
            };
            ScenarioError::Json {
                path: path.to_owned(),
                at,
                message: error.into_inner().to_string(),
            }
        })?;
        json.end().map_err(|error| not_json(&error))?;
        Ok(scenario)
    }

    /// Checks what the types cannot: ranges and multiples.
    ///
    /// # Errors
    /// A value is out of its range.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let range = |what: &str, value: String, range| ScenarioError::Range {
            what: what.to_owned(),
            value,
            range,
        };
        self.experiment.steps()?;
        for entry in 0..self.record.signals.len().max(1) {
            self.stride(entry)?;
        }
        for (name, instance) in &self.instances {
            if instance.steps == 0 {
                let what = format!("instances.{name}.steps");
                return Err(range(&what, "0".to_owned(), "whole numbers from 1"));
            }
        }
        if self.record.format.is_empty() {
            return Err(range("record.format", "empty".to_owned(), "csv, parquet, or both"));
        }
        let positive = "finite numbers above zero";
        for (what, value) in [
            ("checkpoint.every", self.checkpoint.map(|it| it.every)),
            ("real_time", self.real_time),
        ] {
            if let Some(value) = value.filter(|&value| !(value > 0.0 && value.is_finite())) {
                return Err(range(what, value.to_string(), positive));
            }
        }
        if let Some((what, value, allowed)) = self.algorithm.out_of_range() {
            return Err(range(what, value, allowed));
        }
        for (k, connection) in self.connections.iter().enumerate() {
            if let Some(degree) = connection.extrapolation.filter(|degree| *degree > 3) {
                let what = format!("connections[{k}].extrapolation");
                return Err(range(&what, degree.to_string(), "0 to 3"));
            }
        }
        let tolerance = self.initialization.tolerance;
        if !(tolerance > 0.0 && tolerance < 1.0) {
            let value = tolerance.to_string();
            return Err(range("initialization.tolerance", value, "0 to 1, both exclusive"));
        }
        let limits = [
            ("isolation.step_timeout", self.isolation.step_timeout),
            ("isolation.call_timeout", self.isolation.call_timeout),
        ];
        for (what, limit) in limits {
            if let Some(limit) = limit
                && !Duration::try_from_secs_f64(limit).is_ok_and(|it| !it.is_zero())
            {
                return Err(range(what, limit.to_string(), "positive numbers of seconds"));
            }
        }
        for (k, plot) in self.plots.iter().enumerate() {
            let name = Path::new(&plot.file);
            let plain = name.file_name().is_some_and(|only| only == name.as_os_str());
            if !plain || name.extension().is_none_or(|end| end != "svg") {
                let what = format!("plots[{k}].file");
                return Err(range(&what, plot.file.clone(), "plain file names ending in .svg"));
            }
            for (j, panel) in plot.panels.iter().enumerate() {
                if !panel.scale.is_finite() || panel.scale == 0.0 {
                    let what = format!("plots[{k}].panels[{j}].scale");
                    let value = panel.scale.to_string();
                    return Err(range(&what, value, "finite numbers other than zero"));
                }
            }
        }
        for (k, point) in self.ride_quality.iter().enumerate() {
            if let Some((what, value, allowed)) = point.out_of_range() {
                return Err(range(&format!("ride_quality[{k}].{what}"), value, allowed));
            }
        }
        Ok(())
    }

    /// Number of steps between two values of what an entry of `record.signals` names.
    ///
    /// # Errors
    /// The interval is no multiple of the step.
    pub fn stride(&self, entry: usize) -> Result<u64, ScenarioError> {
        let step = self.experiment.step;
        let (place, interval) = match self.record.signals.get(entry) {
            Some(Recorded::Group(group)) => {
                (format!("record.signals[{entry}].interval"), group.interval)
            }
            _ => match self.record.interval {
                Some(interval) => ("record.interval".to_owned(), interval),
                None => return Ok(1),
            },
        };
        let count = (interval / step).round();
        let fits =
            (1.0..9e15).contains(&count) && (count * step - interval).abs() <= 1e-9 * interval;
        if !fits {
            return Err(ScenarioError::Interval { place, interval, step });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 9e15")]
        Ok(count as u64)
    }

    /// Number of steps between two checkpoints, if there are any.
    #[must_use]
    pub fn checkpoint_stride(&self) -> Option<u64> {
        let count = (self.checkpoint?.every / self.experiment.step).round().clamp(1.0, 9e15);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 9e15")]
        Some(count as u64)
    }

    /// The JSON schema of a scenario file, as text with a final line feed.
    #[must_use]
    pub fn schema() -> String {
        let schema = schemars::schema_for!(Self);
        // a schema is a plain JSON value, which always prints
        let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text.push('\n');
        text
    }
}

/// Reads a map and refuses doubled keys, of which serde would silently keep the last.
fn unique<'de, D, K, V>(deserializer: D) -> Result<IndexMap<K, V>, D::Error>
where
    D: Deserializer<'de>,
    K: Deserialize<'de> + Eq + Hash + fmt::Display,
    V: Deserialize<'de>,
{
    struct Unique<K, V>(PhantomData<(K, V)>);
    impl<'de, K, V> Visitor<'de> for Unique<K, V>
    where
        K: Deserialize<'de> + Eq + Hash + fmt::Display,
        V: Deserialize<'de>,
    {
        type Value = IndexMap<K, V>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an object")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Self::Value, A::Error> {
            let mut map = IndexMap::new();
            while let Some(key) = access.next_key::<K>()? {
                if map.contains_key(&key) {
                    return Err(de::Error::custom(format!("the key \"{key}\" occurs twice")));
                }
                let value = access.next_value()?;
                map.insert(key, value);
            }
            Ok(map)
        }
    }
    deserializer.deserialize_map(Unique(PhantomData))
}

#[cfg(test)]
mod tests {
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
        let steps = |start, stop, step| Experiment { start, stop, step }.steps();
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

    #[test]
    fn golden_published_schema_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/schema.json");
        let published = std::fs::read_to_string(path).unwrap();
        let current = published == Scenario::schema();
        assert!(current, "stale; run: maglev schema > scenarios/schema.json");
    }
}
