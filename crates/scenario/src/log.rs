//! Which messages of units are asked for, and which are shown.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which messages of units are shown on the terminal. FMI 2.0 knows no levels, only the status of each
/// message and whether debug messages are on; events.csv has all messages that arrive.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum LogLevel {
    /// Those of status fmi2Error or fmi2Fatal.
    Error,
    /// The first of each instance that is worse than fmi2OK.
    #[default]
    Warning,
    /// All messages that FMUs log.
    Info,
    /// All, and debug messages are on (loggingOn) for instances that do not say otherwise.
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
                "there is no level \"{text}\"; there are error, warning, info and debug"
            )),
        }
    }
}

/// Debug messages of a unit: true, false, or the categories to have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected true, false or a list of log categories")]
pub enum DebugLog {
    /// All or none.
    All(bool),
    /// Those of these categories, which the unit's description declares (`LogCategories`).
    Categories(Vec<String>),
}

impl DebugLog {
    /// The categories, none meaning all; `None` if there are to be no debug messages.
    #[must_use]
    pub fn categories(&self) -> Option<&[String]> {
        match self {
            Self::All(true) => Some(&[]),
            Self::All(false) => None,
            Self::Categories(list) => Some(list).filter(|it| !it.is_empty()).map(Vec::as_slice),
        }
    }
}
