//! Messages of units: which are requested, and which are shown.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which messages of units are shown on the terminal. FMI 2.0 has no log levels: the level follows from the status of a
/// message. events.csv has all messages.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum LogLevel {
    /// Messages with status fmi2Error or fmi2Fatal.
    Error,
    /// The first message of each instance with a status worse than fmi2OK.
    #[default]
    Warning,
    /// All messages.
    Info,
    /// All messages; debug messages are on (loggingOn) for all instances without `debug_log`.
    Debug,
}

impl LogLevel {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl std::str::FromStr for LogLevel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "error" => Ok(Self::Error),
            "warning" => Ok(Self::Warning),
            "info" => Ok(Self::Info),
            "debug" => Ok(Self::Debug),
            _ => Err(format!(
                "unknown log level \"{text}\"; choose one of error, warning, info, debug"
            )),
        }
    }
}

/// Debug messages of a unit: true, false, or a list of log categories.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected true, false or a list of log categories")]
pub enum DebugLog {
    /// Debug messages of all categories, or none.
    All(bool),
    /// Debug messages of these categories, which the unit must declare (`LogCategories`).
    Categories(Vec<String>),
}

impl DebugLog {
    /// The categories; an empty list stands for all. `None`: no debug messages.
    #[must_use]
    pub fn categories(&self) -> Option<&[String]> {
        match self {
            Self::All(true) => Some(&[]),
            Self::All(false) => None,
            Self::Categories(list) => Some(list).filter(|it| !it.is_empty()).map(Vec::as_slice),
        }
    }
}
