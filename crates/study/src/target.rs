//! What a factor changes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a factor changes: one target or a list of them, which all get its value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a target, such as \"vehicle.travel_speed\", or a list of targets"
)]
pub enum Targets {
    /// One target.
    One(Target),
    /// Several targets.
    All(Vec<Target>),
}

impl Targets {
    /// The targets.
    #[must_use]
    pub fn all(&self) -> &[Target] {
        match self {
            Self::One(target) => std::slice::from_ref(target),
            Self::All(targets) => targets,
        }
    }
}

/// A place in a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"instance.variable\", {\"unit\", \"file\", \"key\"}, {\"event\"} or {\"key\"}"
)]
pub enum Target {
    /// `instance.variable` of a parameter or start value, patterns allowed, as `maglev run --set` names it.
    Variable(String),
    /// A key of a JSON file in the resources of a unit, such as the layout of a vehicle.
    Layout(LayoutTarget),
    /// The time of an event, or the value that it sets.
    Event(EventTarget),
    /// Any other key of the scenario.
    Key(KeyTarget),
}

/// A key of a JSON file in the resources of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayoutTarget {
    /// Key of the unit in the scenario's `units`.
    pub unit: String,
    /// Name of the file in its resources, such as `vehicle.json`.
    pub file: String,
    /// Path of the key, with dots: `bodies.car.mass`. An item of a list is named by its `name`, and `*` stands for any
    /// text.
    pub key: String,
}

/// The time of an event, or a value that it sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EventTarget {
    /// Name of the event in the scenario.
    pub event: String,
    /// A variable that the event sets, as in its `set`. Default: none, the factor is the time of the event (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sets: Option<String>,
}

/// A key of the scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyTarget {
    /// Path of the key, with dots: `experiment.step`. Items of lists have their number, from 0.
    pub key: String,
}
