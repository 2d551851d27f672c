//! The shipped car in curves.

use std::fs;
use std::path::{Path, PathBuf};

use magnet::{Law, MagnetParameters};
use serde_json::{Value, json};

use crate::monolithic::{MonolithicSetup, Quantity};
use crate::root;

const MAGNETS: usize = 32;

/// The law of magnets in curves.
#[must_use]
pub fn with_lift_loss() -> MagnetParameters {
    MagnetParameters { law: Law::Nonlinear, lift_loss: true, ..MagnetParameters::default() }
}

/// One car that follows a track line.
#[derive(Debug, Clone)]
pub struct CarOnLine {
    /// The line, as in line.json.
    pub line: Value,
    /// A patch of the layout of the girder from 0 to 25 m, which must give it rails; rigid ground if none.
    pub girder: Option<Value>,
    /// Whether an offset costs lift, with the nonlinear law; otherwise the paper's linear magnets.
    pub lift_loss: bool,
    /// Speed (m/s).
    pub speed: f64,
    /// Place at the start (m).
    pub place: f64,
}

impl CarOnLine {
    /// The car as one system of equations.
    ///
    /// # Errors
    /// A layout or the line is invalid.
    pub fn setup(&self) -> Result<MonolithicSetup, String> {
        let none = json!({});
        let patch = self.girder.as_ref().unwrap_or(&none);
        let line = track_line::LineDescription::from_json(&self.line.to_string());
        let mut setup = MonolithicSetup::of_layouts("one-car", "one-car", patch)?;
        setup.line = Some(line.map_err(|e| e.to_string())?);
        setup.guideway = setup.guideway.filter(|_| self.girder.is_some());
        if self.lift_loss {
            setup.magnet = with_lift_loss();
        }
        (setup.travel_speed, setup.initial_position) = (self.speed, self.place);
        Ok(setup)
    }

    /// Writes the car's scenario, with the settings of the shipped ones, into a folder.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn written(&self, folder: &Path) -> Result<PathBuf, String> {
        let line = written(folder, "line.json", &self.line)?;
        let file = |name: &str| root().join(format!("target/fmu/{name}.fmu"));
        let mut units = json!({
            "vehicle": { "fmu": file("vehicle-one-car"), "resources": { "line.json": line } },
            "ems": file("ems"),
        });
        let row = format!("[01..{MAGNETS}]");
        let mut instances = json!({
            "vehicle": { "unit": "vehicle", "parameters":
                { "travel_speed": self.speed, "initial_position": self.place, "lift_loss": self.lift_loss } },
        });
        instances[format!("ems_{row}")] = json!({ "unit": "ems", "parameters": { "nonlinear": self.lift_loss, "lift_loss": self.lift_loss } });
        let mut connections: Vec<Value> = [
            ("gap", "gap"),
            ("gap_rate", "gap_rate"),
            ("acceleration", "acceleration"),
            ("lateral_offset", "lateral_offset"),
            ("static_load", "static_force"),
        ]
        .map(|(from, to)| json!({ "from": format!("vehicle.{from}_{row}"), "to": format!("ems_{row}.{to}") }))
        .into();
        let force = |name: &str, to: &str| {
            let (from, to) = (format!("ems_{row}.{name}"), format!("{to}.{name}_{row}"));
            json!({ "from": from, "to": to })
        };
        connections.extend(["force", "lateral_force"].map(|name| force(name, "vehicle")));
        let mut order = json!([format!("ems_{row}"), "vehicle"]);
        if let Some(girder) = &self.girder {
            units["guideway"] = json!({ "fmu": file("guideway-one-car"), "resources": { "guideway.json": girder } });
            instances["guideway"] = json!({ "unit": "guideway" });
            order = json!([format!("ems_{row}"), "vehicle", "guideway"]);
            connections.extend(["force", "lateral_force"].map(|name| force(name, "guideway")));
            connections.push(json!({ "from": "vehicle.speed", "to": "guideway.speed" }));
            for (from, to) in [
                ("vehicle.position", "guideway.position"),
                ("guideway.displacement", "vehicle.track_displacement"),
                ("guideway.rate", "vehicle.track_rate"),
                ("guideway.lateral_displacement", "vehicle.track_lateral_displacement"),
                ("guideway.lateral_rate", "vehicle.track_lateral_rate"),
            ] {
                connections
                    .push(json!({ "from": format!("{from}_{row}"), "to": format!("{to}_{row}") }));
            }
        }
        let scenario = json!({
            "units": units,
            "instances": instances,
            "connections": connections,
            "experiment": { "start": 0.0, "stop": 2.0, "step": 0.001 },
            "algorithm": { "name": "gauss-seidel", "extrapolation": 2, "derivatives": true, "order": order },
            "record": Quantity::recorded(MAGNETS),
        });
        written(folder, "car.json", &scenario)
    }
}

/// Writes JSON into a folder.
///
/// # Errors
/// The file cannot be written.
pub fn written(folder: &Path, name: &str, value: &Value) -> Result<PathBuf, String> {
    let file = folder.join(name);
    fs::write(&file, value.to_string()).map_err(|e| format!("{}: {e}", file.display()))?;
    Ok(file)
}
