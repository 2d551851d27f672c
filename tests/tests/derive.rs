//! Other layouts of the packaged units: `maglev derive`, and `resources` in scenarios.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::{Value, json};
use system_tests::{root, scenario, start};

fn unit(name: &str) -> String {
    root().join(format!("target/fmu/{name}.fmu")).display().to_string()
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

fn succeeds(arguments: &[&str]) -> String {
    let output = start(arguments).unwrap();
    assert!(output.status.success(), "{}", errors(&output));
    String::from_utf8(output.stdout).unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Derives a unit by a patch of its layout; returns its path in the folder.
fn derived(folder: &Path, unit: &str, layout: &str, patch: &Value) -> Result<String, String> {
    let file = folder.join("patch.json");
    fs::write(&file, patch.to_string()).unwrap();
    let (change, out) = (format!("{layout}={}", file.display()), text(&folder.join("new.fmu")));
    let output = start(&["derive", unit, "--patch", &change, "--out", &out]).unwrap();
    if output.status.success() { Ok(out) } else { Err(errors(&output)) }
}

/// Natural frequency of the magnet on a spring of 1e6 N/m (Hz).
fn frequency(unit: &str) -> f64 {
    let held = r#"{"magnet_stiffness": 1e6, "magnet_damping": 0}"#;
    let printed = succeeds(&["inspect", "--modes", unit, "--options", held, "--json"]);
    let report: Value = serde_json::from_str(&printed).unwrap();
    report["modes"][0]["imaginary"].as_f64().unwrap() / std::f64::consts::TAU
}

/// One mass on a spring: f = √(k/m)/2π.
#[test]
fn analytic_a_derived_vehicle_has_the_mass_of_its_layout() {
    let folder = tempfile::tempdir().unwrap();
    let original = unit("vehicle-one-magnet");
    let patch = json!({ "bodies": { "mass": { "mass": 1000.0 } } });
    let heavier = derived(folder.path(), &original, "vehicle.json", &patch).unwrap();
    for (unit, mass) in [(&original, 250.0_f64), (&heavier, 1000.0)] {
        let expected = (1e6 / mass).sqrt() / std::f64::consts::TAU;
        let found = frequency(unit);
        // eigenvalues of a 2 by 2 matrix to round-off
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
}

/// The rules include that the GUID is the hash of the description and the resources.
#[test]
fn invariant_derived_units_break_no_rule() {
    let folder = tempfile::tempdir().unwrap();
    let girder = json!({ "girders": { "table_3": { "frequencies": [4.8, 17.0] } } });
    for (name, layout, patch) in [
        (
            "vehicle-one-bogie",
            "vehicle.json",
            json!({ "name": "mine", "bodies": { "car_1": { "mass": 2800.0 } } }),
        ),
        ("guideway-one-bogie", "guideway.json", girder),
    ] {
        let new = derived(folder.path(), &unit(name), layout, &patch).unwrap();
        assert_eq!(succeeds(&["validate", "--json", &new]).trim(), "[]", "{name}");
        succeeds(&["validate", "--dynamic", "--only", "run", "--only", "guid-wrong", &new]);
        // reference results of the old layout would be wrong
        let reference = start(&["reference", &new]).unwrap();
        assert_eq!(reference.status.code(), Some(2), "{}", errors(&reference));
    }
}

/// A layout that is written anew by an empty patch is the same layout: the same bits, in a scenario too.
#[test]
fn invariant_an_empty_patch_changes_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let base = text(&scenario("one-magnet.json"));
    let path = folder.path().join("patched.json");
    let change = json!({ "resources": { "vehicle.json": {} } });
    let patched = json!({ "extends": base, "units": { "vehicle": change } });
    fs::write(&path, patched.to_string()).unwrap();
    let table = |file: &str, out: &str| {
        let out = folder.path().join(out);
        succeeds(&["run", file, "--stop", "0.5", "--no-report", "--quiet", "--out", &text(&out)]);
        fs::read(out.join("results.csv")).unwrap()
    };
    assert!(table(&base, "a") == table(&text(&path), "b"));
    // the modes of the system see the layout of the scenario: 251 kg need another bias, and stay stable
    fs::write(&path, patched.to_string().replace("{}", r#"{"bodies": {"mass": {"mass": 251.0}}}"#))
        .unwrap();
    let modes = |file: &str| {
        let found: Value = serde_json::from_str(&succeeds(&["modes", file, "--json"])).unwrap();
        found["modes"].to_string()
    };
    assert_ne!(modes(&base), modes(&text(&path)));
}

#[test]
fn refusal_of_a_layout_names_the_path_and_the_nearest_key() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |patch: Value| {
        derived(folder.path(), &unit("vehicle-one-magnet"), "vehicle.json", &patch).unwrap_err()
    };
    let error = refused(json!({ "bodies": { "mass": { "maas": 3.0 } } }));
    for part in ["resource vehicle.json", "bodies[0].maas", "did you mean `mass`?", "help:"] {
        assert!(error.contains(part), "{error}");
    }
    let error = refused(json!({ "bodies": { "mas": { "mass": 3.0 } } }));
    for part in ["bodies[1]", "missing field", "the patch adds bodies.mas"] {
        assert!(error.contains(part), "{error}");
    }
}
