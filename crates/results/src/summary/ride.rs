//! Ride quality in summary.json.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Ride quality at the points of the scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RideQuality {
    /// Units of measure of the numbers.
    pub units: IndexMap<String, String>,
    /// Points in the order of the scenario.
    pub points: Vec<PointQuality>,
}

/// Ride quality at one point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointQuality {
    /// Its name in the scenario.
    pub name: String,
    /// Vertical direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical: Option<DirectionQuality>,
    /// Lateral direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<DirectionQuality>,
    /// Direction along the track.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitudinal: Option<DirectionQuality>,
    /// Root of the sum of the squared r.m.s. values of all directions (m/s²); none if a direction is missing.
    pub vibration_total: Option<f64>,
    /// Likely reactions according to ISO 2631-1, annex C; empty without a total.
    pub comfort: Vec<String>,
    /// Why numbers are missing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// Ride quality in one direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DirectionQuality {
    /// The recorded acceleration.
    pub signal: String,
    /// Frequency weighting of ISO 2631.
    pub weighting: String,
    /// Start of the judged time (s).
    pub from: f64,
    /// End of the judged time (s).
    pub to: f64,
    /// r.m.s. of the weighted acceleration, a_w.
    pub weighted_rms: f64,
    /// Largest r.m.s. value over one second, MTVV.
    pub maximum_transient: f64,
    /// Fourth-power vibration dose value, VDV.
    pub vibration_dose: f64,
    /// Largest magnitude of the weighted acceleration.
    pub weighted_peak: f64,
    /// Peak divided by r.m.s. value.
    pub crest_factor: f64,
    /// Sperling's comfort index, W_z.
    pub sperling_index: f64,
    /// Rating that belongs to the index.
    pub sperling_comfort: String,
}
