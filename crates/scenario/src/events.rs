//! Events and stop conditions: what changes during a run, and what ends it.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::condition::{Condition, WITHIN};
use crate::{Experiment, Setting};

/// Something that happens once: at a time, or when a condition becomes true, variables get other values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Event {
    /// Name of the event, for events.csv and messages.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Time of the event (s). Either this or `when`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// The event happens at the first communication point at which this condition is true. Either this or `at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<Condition>,
    /// The new values: `instance.variable`, patterns allowed, of tunable parameters and of inputs without a source.
    pub set: IndexMap<String, Setting>,
}

/// A condition that ends the run. The run is then complete, with status `stopped`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopCondition {
    /// Name of the condition, for the summary and messages.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The run ends at the first communication point at which this condition is true.
    pub when: Condition,
}

/// A setting that is not allowed: its key, its value and what is allowed.
pub(crate) type Fault = (&'static str, String, &'static str);

/// The times of a run (s).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    start: f64,
    stop: f64,
}

impl Span {
    pub(crate) fn of(experiment: &Experiment) -> Self {
        Self { start: experiment.start, stop: experiment.stop }
    }

    /// Whether something that happens then can have an effect.
    pub(crate) fn contains(self, time: f64) -> bool {
        (self.start..self.stop).contains(&time)
    }
}

impl Event {
    /// The first setting that is not allowed.
    pub(crate) fn out_of_range(&self, within: Span) -> Option<Fault> {
        if self.set.is_empty() {
            return Some(("set", "empty".to_owned(), "at least one variable with its new value"));
        }
        if self.set.values().any(|it| matches!(it, Setting::File(_))) {
            let value = "the path of a file".to_owned();
            return Some(("set", value, "given as numbers, true, false or texts"));
        }
        match (self.at, &self.when) {
            (Some(_), Some(_)) => {
                Some(("at", "given together with \"when\"".to_owned(), "given without \"when\""))
            }
            (None, None) => {
                Some(("at", "missing".to_owned(), "a time (s), unless \"when\" is given"))
            }
            (Some(at), None) => (!within.contains(at)).then(|| ("at", at.to_string(), WITHIN)),
            (None, Some(when)) => when.out_of_range(within),
        }
    }
}

impl StopCondition {
    /// The first setting that is not allowed.
    pub(crate) fn out_of_range(&self, within: Span) -> Option<Fault> {
        self.when.out_of_range(within)
    }
}
