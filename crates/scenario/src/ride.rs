//! Points of ride quality, as a scenario names them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A point at which people sit, and the accelerations that shake them. After the run they are judged by ISO
/// 2631-1 and by Sperling's index, in the summary under `ride_quality`. All must be recorded, at 180 Hz or more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RidePoint {
    /// What the point is called in the summary and the report.
    pub name: String,
    /// The vertical acceleration, `instance.variable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical: Option<String>,
    /// The acceleration to the side, `instance.variable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<String>,
    /// The acceleration along the track, `instance.variable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitudinal: Option<String>,
    /// Frequency weighting of the vertical acceleration.
    #[serde(default)]
    pub vertical_weighting: VerticalWeighting,
    /// Begin of what is judged (s); left out: where the run starts. The filters run from the start of the
    /// run all the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// End of what is judged (s); left out: where the run ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
}

/// How a vertical acceleration is weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum VerticalWeighting {
    /// ISO 2631-1, for all purposes.
    #[default]
    Wk,
    /// ISO 2631-4, for guided transport.
    Wb,
}

impl RidePoint {
    /// The setting that is out of its range, with its value and what is allowed.
    pub(crate) fn out_of_range(&self) -> Option<(&'static str, String, &'static str)> {
        let given = [&self.vertical, &self.lateral, &self.longitudinal];
        if given.iter().all(|signal| signal.is_none()) {
            return Some(("vertical", "left out".to_owned(), "a point with any direction"));
        }
        let from = self.from.unwrap_or(f64::NEG_INFINITY);
        // also false for what is no number
        let ordered = self.to.is_none_or(|to| from < to) && !from.is_nan();
        (!ordered).then(|| ("from", from.to_string(), "times before \"to\""))
    }
}
