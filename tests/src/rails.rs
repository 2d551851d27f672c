//! The shipped bogie on its girder with two rails.

use std::{fs, path::Path, path::PathBuf};

use serde_json::{Value, json};

use crate::{root, scenario};

/// The girder's lateral bending and torsion, and `rails`, as a patch of the guideway's layout.
#[must_use]
pub fn with_rails(rails: &Value) -> Value {
    let girder = json!({
        "lateral": { "bending_stiffness": 2.99e10 },
        "torsion": { "torsional_stiffness": 1.44e10, "polar_inertia": 3776 },
    });
    json!({ "girders": { "table_3": girder }, "rails": rails })
}

/// Writes the scenario of a bogie on a girder with this layout, which has rails, into a folder.
///
/// # Errors
/// A file cannot be read or written.
pub fn bogie_on_rails(folder: &Path, name: &str, layout: &Value) -> Result<PathBuf, String> {
    let unit = |name: &str| root().join(format!("target/fmu/{name}.fmu"));
    let shipped = scenario("one-bogie.json");
    let text = fs::read_to_string(&shipped).map_err(|e| e.to_string())?;
    let base: Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let mut connections = base["connections"].as_array().cloned().unwrap_or_default();
    for (from, to) in [
        ("ems_[01..08].lateral_force", "guideway.lateral_force_[01..08]"),
        ("guideway.lateral_displacement_[01..08]", "vehicle.track_lateral_displacement_[01..08]"),
        ("guideway.lateral_rate_[01..08]", "vehicle.track_lateral_rate_[01..08]"),
    ] {
        connections.push(json!({ "from": from, "to": to }));
    }
    let patched = json!({
        "extends": shipped,
        "units": {
            "vehicle": unit("vehicle-one-bogie"), "ems": unit("ems"),
            "guideway": { "fmu": unit("guideway-one-bogie"), "resources": { "guideway.json": layout } },
        },
        "connections": connections,
        "experiment": { "stop": 8.0 },
        "record": { "signals": ["vehicle.gap_[01..08]", "guideway.midspan_displacement_01",
            "guideway.midspan_twist_01", "guideway.midspan_lateral_01", "vehicle.lateral_offset_[01..08]"] },
        "plots": [],
    });
    let file = folder.join(format!("{name}.json"));
    fs::write(&file, patched.to_string()).map_err(|e| e.to_string())?;
    Ok(file)
}
