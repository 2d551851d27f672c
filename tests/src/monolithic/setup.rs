//! What a monolithic system is made of.

use std::fs;

use serde_json::Value;

use super::told;
use crate::root;

/// The coupled parts and the travel of the vehicle.
#[derive(Debug, Clone)]
pub struct MonolithicSetup {
    /// The vehicle.
    pub vehicle: multibody::VehicleDescription,
    /// The line that the vehicle follows; straight if none.
    pub line: Option<track_line::LineDescription>,
    /// The guideway, with or without rails; rigid ground if none.
    pub guideway: Option<guideway::GuidewayDescription>,
    /// Every magnet: any law, but continuous and without limits, sensors' errors and failures.
    pub magnet: magnet::MagnetParameters,
    /// Nominal speed (m/s).
    pub travel_speed: f64,
    /// Place of the vehicle's origin on the track at the start (m).
    pub initial_position: f64,
}

fn read(path: &str) -> Result<String, String> {
    fs::read_to_string(root().join(path)).map_err(|e| format!("{path}: {e}"))
}

impl MonolithicSetup {
    /// The layouts that units are packed with, `patch` merged into that of the guideway; at rest at 0 m,
    /// with the paper's magnets.
    ///
    /// # Errors
    /// A layout cannot be read.
    pub fn of_layouts(vehicle: &str, guideway: &str, patch: &Value) -> Result<Self, String> {
        let vehicle = read(&format!("fmu-vehicle/resources/{vehicle}/vehicle.json"))?;
        let guideway = read(&format!("fmu-guideway/resources/{guideway}/guideway.json"))?;
        let mut guideway: Value = serde_json::from_str(&guideway).map_err(told)?;
        merge(&mut guideway, patch);
        let guideway = guideway::GuidewayDescription::from_json(&guideway.to_string());
        Ok(Self {
            vehicle: multibody::VehicleDescription::from_json(&vehicle).map_err(told)?,
            line: None,
            guideway: Some(guideway.map_err(told)?),
            magnet: magnet::MagnetParameters::default(),
            travel_speed: 0.0,
            initial_position: 0.0,
        })
    }
}

/// Merges a patch as scenarios do with resources (RFC 7396): objects key by key, `null` removes a key,
/// everything else replaces.
pub fn merge(base: &mut Value, patch: &Value) {
    let Value::Object(patch) = patch else {
        *base = patch.clone();
        return;
    };
    if !base.is_object() {
        *base = Value::Object(serde_json::Map::new());
    }
    let Value::Object(base) = base else { return };
    for (key, value) in patch {
        if value.is_null() {
            base.remove(key);
        } else {
            merge(base.entry(key.clone()).or_insert(Value::Null), value);
        }
    }
}
