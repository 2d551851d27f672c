//! Signals that flow between instances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
