//! Errors of scenarios.

use std::io::ErrorKind;
use std::path::PathBuf;

use thiserror::Error;

use fmi2_derive::DeriveError;

/// Why a scenario is invalid or cannot be read.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("cannot read the scenario {path}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// The text is not JSON.
    #[error("{path} is not JSON: {message}")]
    NotJson {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, with line and column.
        message: String,
    },
    /// A key or value that the scenario format does not allow.
    #[error("{path}: at {at}: {message}")]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// JSON path.
        at: String,
        /// What is wrong, with line and column.
        message: String,
    },
    /// A figure or its bounds are invalid.
    #[error("{place}: {problem}")]
    Metric {
        /// Its JSON path.
        place: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
    /// The file that a scenario extends cannot be read.
    #[error("{path}: at extends: cannot read {base}")]
    Base {
        /// The file that extends the other.
        path: PathBuf,
        /// The other.
        base: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// Files extend each other in a cycle.
    #[error("\"extends\" forms a cycle: {}", chain(files))]
    Cycle {
        /// The files from the first one to the one that occurs again.
        files: Vec<PathBuf>,
    },
    /// A scenario that is not in a file extends one.
    #[error("{path}: at extends: a scenario given as text cannot extend a file")]
    ExtendsInText {
        /// Name of the text in messages.
        path: PathBuf,
    },
    /// The experiment is incomplete, and a unit whose `DefaultExperiment` could complete it cannot be read.
    #[error("units.{name}: cannot complete the experiment from this unit")]
    Suggestions {
        /// Key in `units`.
        name: String,
        /// Why the unit cannot be read.
        #[source]
        source: Box<DeriveError>,
    },
    /// A member of the experiment is missing, and no unit has a default.
    #[error(
        "experiment.{key} is missing, and no unit has a default ({attribute} in DefaultExperiment)"
    )]
    NotSuggested {
        /// `stop` or `step`.
        key: &'static str,
        /// Attribute of `DefaultExperiment`.
        attribute: &'static str,
    },
    /// More steps than can be counted.
    #[error("experiment: stop - start is {count:e} steps, more than 9e15")]
    TooManySteps {
        /// Number of steps.
        count: f64,
    },
    /// Start, stop and step do not describe a run.
    #[error("experiment: start {start} s, stop {stop} s and step {step} s do not describe a run")]
    Experiment {
        /// Start time (s).
        start: f64,
        /// Stop time (s).
        stop: f64,
        /// Step (s).
        step: f64,
    },
    /// The span is not a multiple of the step.
    #[error(
        "experiment: the span from {start} s to {stop} s is not a multiple of the step {step} s: \
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
    /// A recording interval is not a multiple of the step.
    #[error("{place} is {interval} s, which is not a multiple of the step {step} s")]
    Interval {
        /// JSON path.
        place: String,
        /// Interval (s).
        interval: f64,
        /// Step (s).
        step: f64,
    },
    /// Limits for isolated instances without an isolated instance.
    #[error("isolation has limits, but no instance is isolated")]
    NothingIsolated,
    /// `every` does not fit the run.
    #[error("instances.{instance}.every is {every}: {why}")]
    Every {
        /// The instance, by its key in `instances`.
        instance: String,
        /// Communication steps per step.
        every: u32,
        /// What does not fit, in words.
        why: String,
    },
    /// A setting is outside its range.
    #[error("{what} is {value}; it must be {range}")]
    Range {
        /// JSON path of the setting.
        what: String,
        /// The setting's value as given.
        value: String,
        /// What is allowed.
        range: &'static str,
    },
}

fn chain(files: &[PathBuf]) -> String {
    let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
    names.join(" extends ")
}

impl ScenarioError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Read { source, .. } => match source.kind() {
                ErrorKind::IsADirectory => "this is a folder; give the path of a .json file in it",
                ErrorKind::InvalidData => {
                    "a scenario is a .json file; a unit that runs alone is a .fmu file, and a system (.ssp) becomes \
                     a scenario by `maglev export SYSTEM.ssp --scenario DIR`"
                }
                _ => "give the path of a scenario file (.json)",
            },
            Self::NotJson { .. } => {
                "correct the syntax there, or give the path of a scenario file (.json)"
            }
            Self::Metric { .. } => "docs/criteria.md explains figures and their bounds",
            Self::Json { .. } => "`maglev schema` prints what a scenario may contain",
            Self::Base { .. } => {
                "\"extends\" is the path of a scenario file, relative to the file that contains it"
            }
            Self::Cycle { .. } => "remove one \"extends\"",
            Self::ExtendsInText { .. } => {
                "load the scenario from a file, or merge the two scenarios"
            }
            Self::StepDoesNotDivide { .. } => {
                "choose stop and step so that stop - start is a whole number of steps"
            }
            Self::Suggestions { source, .. } => return source.help(),
            Self::NotSuggested { .. } => "give it under \"experiment\", or with --stop or --step",
            Self::Interval { .. } => "choose an interval that is a whole number of steps",
            Self::TooManySteps { .. } => "choose a shorter run or a larger step",
            Self::Experiment { .. } => "stop must be greater than start, and step must be positive",
            Self::NothingIsolated => {
                "limits work for instances in separate processes only: add --isolate, or \"isolate\": true to \
                 instances in the scenario"
            }
            Self::Every { .. } => {
                "stop - start must be a whole number of \"every\" communication steps of equal size"
            }
            Self::Range { .. } => return None,
        })
    }
}
