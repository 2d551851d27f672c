//! Points at which ride quality is evaluated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A point where passengers sit, with its accelerations. After the run they are evaluated by ISO 2631-1 and by
/// Sperling's index; the summary has the result under `ride_quality`. All signals must be recorded at 180 Hz or more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RidePoint {
    /// Name of the point in the summary and the report.
    pub name: String,
    /// Vertical acceleration, `instance.variable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical: Option<String>,
    /// Lateral acceleration, `instance.variable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<String>,
    /// Longitudinal acceleration, `instance.variable`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitudinal: Option<String>,
    /// Frequency weighting of the vertical acceleration.
    #[serde(default)]
    pub vertical_weighting: VerticalWeighting,
    /// Start of the evaluated interval (s). Default: the start of the run. The filters always run from the start of the
    /// run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// End of the evaluated interval (s). Default: the end of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
}

/// Frequency weighting of the vertical acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum VerticalWeighting {
    /// ISO 2631-1, for general use.
    #[default]
    Wk,
    /// ISO 2631-4, for rail vehicles and other guided transport.
    Wb,
}

impl RidePoint {
    /// The first setting outside its range: its key, its value and what is allowed.
    pub(crate) fn out_of_range(&self) -> Option<(&'static str, String, &'static str)> {
        let given = [&self.vertical, &self.lateral, &self.longitudinal];
        if given.iter().all(|signal| signal.is_none()) {
            return Some((
                "vertical",
                "missing".to_owned(),
                "given, if lateral and longitudinal are missing",
            ));
        }
        let from = self.from.unwrap_or(f64::NEG_INFINITY);
        // also false for NaN
        let ordered = self.to.is_none_or(|to| from < to) && !from.is_nan();
        (!ordered).then(|| ("from", from.to_string(), "before \"to\""))
    }
}
