//! Instances of units and the values given to their variables.

use std::fmt;
use std::path::PathBuf;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::DebugLog;

/// One instance of a unit, or an array of equal ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Instance")]
pub struct InstanceSettings {
    /// Key in `units`.
    pub unit: String,
    /// Values of the unit's parameters. Names may be patterns (`gain_[1..5]`).
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub parameters: IndexMap<String, Setting>,
    /// Start values of inputs, and of other variables that accept one.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub start: IndexMap<String, Setting>,
    /// Steps that it makes per communication step, each on its part of the inputs' polynomials.
    #[serde(default = "one_step", skip_serializing_if = "is_one_step")]
    #[schemars(range(min = 1))]
    pub steps: u32,
    /// Communication steps per step: n makes one step of n times the size in every n-th one. Its
    /// outputs are held in between.
    #[serde(default = "one_step", skip_serializing_if = "is_one_step")]
    #[schemars(range(min = 1))]
    pub every: u32,
    /// Relative tolerance that the unit is told; left out: as `experiment.tolerance` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: Option<f64>,
    /// Debug messages: true, false, or the log categories to have; left out: as `log_level` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub debug_log: Option<DebugLog>,
    /// Highest derivative of inputs to send, 0 to 3; 0: values that are held over a step. Left out: 1 if
    /// the unit's description says canInterpolateInputs, else 0; up to 3 for units of fmi2-export. Higher
    /// ones only for a unit that is known to take them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 3))]
    pub input_derivatives: Option<u8>,
    /// Run it in a process of its own, or not; left out: as `isolation.all` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolate: Option<bool>,
    /// A remark, not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// A value for a variable: a number, true, false or a text; for an Enumeration the item's name or
/// number; for a String that names a file, `{"path": "..."}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, true, false, a text or {\"path\": \"...\"}")]
pub enum Setting {
    /// For Boolean variables.
    Boolean(bool),
    /// For Real, Integer and Enumeration variables.
    Number(f64),
    /// For String variables, and for Enumerations by name.
    Text(String),
    /// For String variables.
    File(FileSetting),
}

/// A file or folder that a String names. The unit is given the absolute path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSetting {
    /// Its path, relative to the scenario file.
    pub path: PathBuf,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Boolean(value) => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value}"),
            Self::Text(value) => write!(f, "{value:?}"),
            Self::File(file) => write!(f, "the path {}", file.path.display()),
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

const fn one_step() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
const fn is_one_step(steps: &u32) -> bool {
    *steps == 1
}
