//! How a run feels to its passengers.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// How a run feels, in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RideQuality {
    /// Units of measurement of the numbers.
    pub units: IndexMap<String, String>,
    /// Points in the order of the scenario.
    pub points: Vec<PointQuality>,
}

/// How a run feels at one point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointQuality {
    /// Its name in the scenario.
    pub name: String,
    /// Up and down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical: Option<DirectionQuality>,
    /// To the sides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<DirectionQuality>,
    /// Along the track.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitudinal: Option<DirectionQuality>,
    /// Root of the sum of the squared r.m.s. values of all directions, if all could be judged (m/s²).
    pub vibration_total: Option<f64>,
    /// How people are likely to call it, ISO 2631-1 annex C; empty without a total.
    pub comfort: Vec<String>,
    /// Why numbers are missing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// How a run feels in one direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DirectionQuality {
    /// The recorded acceleration.
    pub signal: String,
    /// Frequency weighting of ISO 2631.
    pub weighting: String,
    /// Begin of what was judged (s).
    pub from: f64,
    /// End of it (s).
    pub to: f64,
    /// r.m.s. of the weighted acceleration, a_w.
    pub weighted_rms: f64,
    /// Largest r.m.s. of any second of it, MTVV.
    pub maximum_transient: f64,
    /// Fourth power vibration dose value, VDV.
    pub vibration_dose: f64,
    /// Largest magnitude of the weighted acceleration.
    pub weighted_peak: f64,
    /// Peak over r.m.s.
    pub crest_factor: f64,
    /// Sperling's ride index for comfort, W_z.
    pub sperling_index: f64,
    /// What the index means.
    pub sperling_comfort: String,
}
