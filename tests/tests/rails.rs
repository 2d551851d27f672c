//! A bogie on a girder that twists and bends sideways, against the same girder as a line.

#![allow(clippy::unwrap_used, reason = "a test program")]

use serde_json::{Value, json};
use system_tests::rails::{bogie_on_rails, with_rails};
use system_tests::{FinishedRun, scenario};

/// The shipped bogie on its span with rails; `rails` is their description.
fn on_rails(folder: &std::path::Path, name: &str, rails: &Value) -> FinishedRun {
    FinishedRun::of(&bogie_on_rails(folder, name, &with_rails(rails)).unwrap(), &[]).unwrap()
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
