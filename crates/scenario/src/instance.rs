//! Instances of units, and the values of their variables.

use std::fmt;
use std::path::PathBuf;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::DebugLog;

/// An instance of a unit, or a row of equal instances.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Instance")]
pub struct InstanceSettings {
    /// The unit, by its key in `units`.
    pub unit: String,
    /// Values of parameters. Names may be patterns (`gain_[1..5]`).
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub parameters: IndexMap<String, Setting>,
    /// Start values of inputs and of other variables that can be set before initialization.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub start: IndexMap<String, Setting>,
    /// Number of steps per communication step. Each step uses its part of the input polynomials.
    #[serde(default = "one_step", skip_serializing_if = "is_one_step")]
    #[schemars(range(min = 1))]
    pub steps: u32,
    /// Number of communication steps per step: with n, the instance steps in every n-th communication step, by n times
    /// its size. Outputs are held in between.
    #[serde(default = "one_step", skip_serializing_if = "is_one_step")]
    #[schemars(range(min = 1))]
    pub every: u32,
    /// Relative tolerance for the internal integration of the unit. Default: `experiment.tolerance`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: Option<f64>,
    /// Debug messages: true, false, or a list of log categories. Default: true if `log_level` is `debug`, otherwise
    /// false.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub debug_log: Option<DebugLog>,
    /// Highest derivative of inputs that is sent to the unit, 0 to 3; 0 holds inputs during a step. Default: 1 if the
    /// unit declares canInterpolateInputs, otherwise 0; units made with fmi2-export receive up to 3. Give a higher one
    /// only for a unit that is known to accept it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 3))]
    pub input_derivatives: Option<u8>,
    /// Run the instance in a separate process. Default: `isolation.all`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolate: Option<bool>,
    /// A comment, ignored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// The value of a variable: a number, true, false or a text. For an Enumeration: the name or the number of an item. For
/// a String that is the path of a file: `{"path": "..."}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, true, false, a text or {\"path\": \"...\"}")]
pub enum Setting {
    /// For Boolean variables.
    Boolean(bool),
    /// For Real, Integer and Enumeration variables.
    Number(f64),
    /// For String variables, and for Enumerations by name.
    Text(String),
    /// The path of a file or folder, for String variables.
    File(FileSetting),
}

/// A file or folder. The String variable receives the absolute path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSetting {
    /// Path, relative to the scenario file.
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
    /// The value of a text from the command line: true, false, a number, or else the text.
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
