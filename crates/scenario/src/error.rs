//! Why a scenario cannot be used.

use std::io::ErrorKind;
use std::path::PathBuf;

use thiserror::Error;

use fmi2_import::package::PackageError;

/// Why a scenario cannot be used.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("the scenario {path} cannot be read")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// The text is no JSON.
    #[error("{path} is not JSON: {message}")]
    NotJson {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, with line and column.
        message: String,
    },
    /// The JSON is not what a scenario should be.
    #[error("{path}: at {at}: {message}")]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// JSON path.
        at: String,
        /// What is wrong, with line and column.
        message: String,
    },
    /// The file that a scenario extends cannot be read.
    #[error("{path}: at extends: {base} cannot be read")]
    Base {
        /// The file that extends the other.
        path: PathBuf,
        /// The other.
        base: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// Files extend each other in a circle.
    #[error("at extends: {}", chain(files))]
    Circle {
        /// From the first file on, until one comes again.
        files: Vec<PathBuf>,
    },
    /// A scenario that is no file extends one.
    #[error("{path}: at extends: a scenario given as text cannot extend a file")]
    ExtendsInText {
        /// What the text is called.
        path: PathBuf,
    },
    /// A unit that may suggest what the experiment leaves out cannot be read.
    #[error("units.{name}: the experiment is incomplete, and the unit cannot be asked for it")]
    Suggestions {
        /// Key in `units`.
        name: String,
        /// What is wrong with the .fmu file.
        #[source]
        source: PackageError,
    },
    /// The experiment leaves out what no unit suggests.
    #[error(
        "experiment.{key} is missing, and no unit suggests one ({attribute} of DefaultExperiment)"
    )]
    NotSuggested {
        /// `stop` or `step`.
        key: &'static str,
        /// Attribute of a unit's description.
        attribute: &'static str,
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
    /// An instance cannot step in every so many communication steps.
    #[error("instances.{instance}.every is {every}: {why}")]
    Every {
        /// The instance, by its key in `instances`.
        instance: String,
        /// Communication steps per step.
        every: u32,
        /// Why this number of steps is not possible, in words.
        why: String,
    },
    /// A setting is outside of its range.
    #[error("{what} is {value}, which is outside of {range}")]
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
                ErrorKind::IsADirectory => {
                    "give the path of a scenario's .json file in this folder"
                }
                ErrorKind::InvalidData => {
                    "give the path of a scenario's .json file; a unit to run alone is a .fmu file"
                }
                _ => "give the path of a scenario's .json file",
            },
            Self::NotJson { .. } => {
                "correct the text there, or give the path of a scenario's .json file"
            }
            Self::Json { .. } => "`maglev schema` prints what a scenario may contain",
            Self::Base { .. } => {
                "\"extends\" is the path of a scenario's .json file, relative to the file that contains it"
            }
            Self::Circle { .. } => "remove one \"extends\"",
            Self::ExtendsInText { .. } => "load it from a file, or write the two as one scenario",
            Self::StepDoesNotDivide { .. } => {
                "choose stop and step such that stop - start is a whole number of steps"
            }
            Self::Suggestions { source, .. } => return source.help(),
            Self::NotSuggested { .. } => "give it under \"experiment\", or with --stop or --step",
            Self::Interval { .. } => "choose a recording interval of a whole number of steps",
            Self::Experiment { .. } => "stop must be greater than start, and step positive",
            Self::NothingIsolated => {
                "a step without end can only be stopped in a process of its own: add --isolate, or \
                 \"isolate\": true to instances in the scenario"
            }
            Self::Every { .. } => {
                "choose stop such that stop - start is a whole number of \"every\" equal communication steps"
            }
            Self::Range { .. } => return None,
        })
    }
}
