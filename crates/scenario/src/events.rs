//! Events and stop conditions: what changes during a run, and what ends it.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::condition::{Condition, WITHIN};
use crate::{Experiment, Scenario, Setting};

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
    /// The event happens when this condition becomes true. Either this or `at`.
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
    /// The run ends when this condition becomes true.
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

    /// Whether something may be planned for then. It may be after the stop time, which `--stop` may have shortened.
    pub(crate) fn allows(self, time: f64) -> bool {
        time >= self.start && time.is_finite()
    }

    /// Whether something that happens then has no effect on the run.
    fn ends_before(self, time: f64) -> bool {
        time >= self.stop
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
            (Some(at), None) => (!within.allows(at)).then(|| ("at", at.to_string(), WITHIN)),
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

impl Scenario {
    /// Sentences about events and conditions that are planned for after the stop time.
    #[must_use]
    pub fn out_of_time(&self) -> Vec<String> {
        let (span, stop) = (Span::of(&self.experiment), self.experiment.stop);
        let late = |time: Option<f64>| time.filter(|it| span.ends_before(*it));
        let after = |when: &Condition| late(when.after);
        let mut texts = Vec::new();
        for (k, event) in self.events.iter().enumerate() {
            let place = format!("events[{k}]");
            if let Some(at) = late(event.at) {
                texts.push(format!(
                    "{place}.at is {at} s, and the run ends at {stop} s: it does not happen"
                ));
            }
            if let Some(time) = event.when.as_ref().and_then(after) {
                texts.push(unchecked(&place, time, stop));
            }
        }
        for (k, condition) in self.stop_when.iter().enumerate() {
            if let Some(time) = after(&condition.when) {
                texts.push(unchecked(&format!("stop_when[{k}]"), time, stop));
            }
        }
        texts
    }
}

fn unchecked(place: &str, time: f64, stop: f64) -> String {
    format!(
        "{place}.when.after is {time} s, and the run ends at {stop} s: the condition is not checked"
    )
}
