//! A bogie on a girder that twists and bends sideways, against the same girder as a line.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::fs;

use serde_json::{Value, json};
use system_tests::{FinishedRun, root, scenario};

/// The shipped bogie on its span with rails; `rails` is their description.
fn on_rails(folder: &std::path::Path, name: &str, rails: &Value) -> FinishedRun {
    let root = root().display().to_string();
    let unit = |name: &str| format!("{root}/target/fmu/{name}.fmu");
    let mut base: Value =
        serde_json::from_str(&fs::read_to_string(scenario("one-bogie.json")).unwrap()).unwrap();
    let connections = base["connections"].as_array_mut().unwrap();
    for (from, to) in [
        ("ems_[01..08].lateral_force", "guideway.lateral_force_[01..08]"),
        ("guideway.lateral_displacement_[01..08]", "vehicle.track_lateral_displacement_[01..08]"),
        ("guideway.lateral_rate_[01..08]", "vehicle.track_lateral_rate_[01..08]"),
    ] {
        connections.push(json!({ "from": from, "to": to }));
    }
    let girder = json!({
        "lateral": { "bending_stiffness": 2.99e10 },
        "torsion": { "torsional_stiffness": 1.44e10, "polar_inertia": 3776 },
    });
    let layout = json!({ "girders": { "table_3": girder }, "rails": rails });
    let file = folder.join(format!("{name}.json"));
    let patched = json!({
        "extends": format!("{root}/scenarios/one-bogie.json"),
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
    fs::write(&file, patched.to_string()).unwrap();
    FinishedRun::of(&file, &[]).unwrap()
}

fn largest(columns: &std::collections::BTreeMap<String, Vec<f64>>, part: &str) -> f64 {
    let found = columns.iter().filter(|(name, _)| name.contains(part)).flat_map(|(_, v)| v);
    found.fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// Loads that both rails share alike do not twist the girder: the run is that of the line.
#[test]
fn invariant_a_symmetric_load_on_two_rails_is_the_load_of_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let line =
        FinishedRun::of(&scenario("one-bogie.json"), &["--stop", "8"]).unwrap().columns().unwrap();
    let rails = on_rails(folder.path(), "alike", &json!({ "height": 1.2 })).columns().unwrap();
    for (name, values) in
        line.iter().filter(|(name, _)| name.contains("gap_") || name.contains("midspan"))
    {
        for (a, b) in values.iter().zip(&rails[name]) {
            // sums in another order: some 1e-16 of displacements, which a stable loop does not amplify
            assert!((a - b).abs() < 1e-11, "{name}: {a} {b}");
        }
    }
    assert!(largest(&rails, "twist") < 1e-11 && largest(&rails, "offset") < 1e-9);
}

/// A rough left rail: the girder twists, and the magnets leave the middle of their rails.
#[test]
fn issue_one_rough_rail_twists_the_girder_and_moves_the_magnets_aside() {
    let folder = tempfile::tempdir().unwrap();
    let part = json!({ "psd": { "form": "inverse-square", "amplitude": 7e-7 }, "right_factor": 0 });
    let rails =
        json!({ "height": 1.2, "irregularity": { "on": true, "vertical": part, "lateral": part } });
    let rough = on_rails(folder.path(), "rough", &rails).columns().unwrap();
    let gap = |of: std::ops::RangeInclusive<usize>| {
        of.map(|k| {
            rough[&format!("vehicle.gap_{k:02}")]
                .iter()
                .fold(0.0, |m: f64, g| m.max((g - 8e-3).abs()))
        })
        .fold(0.0, f64::max)
    };
    assert!(gap(1..=4) > 4.0 * gap(5..=8), "{} {}", gap(1..=4), gap(5..=8));
    assert!(largest(&rough, "twist") > 1e-8 && largest(&rough, "offset") > 1e-4);
    assert!(largest(&rough, "midspan_lateral") > 1e-8);
}
