//! `maglev floquet` against long runs: one bogie over a long row of spans.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::fs;

use serde_json::{Value, json};
use system_tests::{FinishedRun, root, start};

/// m/s, and m.
const SPEED: f64 = 40.0;
const SPAN: f64 = 25.0;
const SPANS: usize = 32;
/// Interval of the results (s).
const INTERVAL: f64 = 0.005;

/// The growth rate of what changes from one span to the next, over the second half of a run.
fn measured(run: &FinishedRun) -> f64 {
    let columns = run.columns().unwrap();
    let gaps: Vec<&Vec<f64>> =
        columns.iter().filter(|(name, _)| name.contains("gap_")).map(|(_, it)| it).collect();
    assert_eq!(gaps.len(), 8);
    let period = (SPAN / SPEED / INTERVAL).round() as usize;
    let difference = |span: usize| {
        let change = |gap: &&Vec<f64>, k: usize| gap[k + period] - gap[k];
        let rows = span * period..(span + 1) * period;
        let sum: f64 =
            gaps.iter().flat_map(|gap| rows.clone().map(move |k| change(gap, k).powi(2))).sum();
        sum.sqrt()
    };
    let (first, last) = (SPANS / 2, SPANS - 4);
    (difference(last) / difference(first)).ln() / (SPAN / SPEED * (last - first) as f64)
}

/// The coefficients of the loaded magnet, and a gain of the gap on both sides of the boundary at 16.92.
#[test]
fn crosstool_a_long_run_grows_as_the_multiplier_says() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("row.json");
    let root = root().display().to_string();
    let unit = |name: &str| format!("{root}/target/fmu/{name}.fmu");
    let row = json!({ "spans": [{ "girder": "table_3", "count": SPANS }] });
    let scenario = json!({
        "extends": format!("{root}/scenarios/one-bogie.json"),
        "units": {
            "vehicle": unit("vehicle-one-bogie"), "ems": unit("ems"),
            "guideway": { "fmu": unit("guideway-one-bogie"), "resources": { "guideway.json": row } },
        },
        "instances": { "vehicle": { "parameters": { "travel_speed": SPEED, "initial_position": -5.0 } } },
        "experiment": { "stop": (SPANS - 1) as f64 * SPAN / SPEED, "step": 0.001 },
        "record": { "interval": INTERVAL, "signals": ["vehicle.gap_[01..08]"] },
        "plots": [],
    });
    fs::write(&file, scenario.to_string()).unwrap();
    for (gain, grows) in [("16.5", false), ("17.1", true)] {
        let gain = format!("ems_[01..08].gain_gap={gain}");
        let set = ["--set", "ems_[01..08].operating_current=14.353", "--set", gain.as_str()];
        let measured = measured(&FinishedRun::of(&file, &set).unwrap());
        let path = file.display().to_string();
        let mut arguments =
            vec!["floquet", path.as_str(), "--speeds", "40", "--above", "2", "--json"];
        arguments.extend(set);
        let output = start(&arguments).unwrap();
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let growth = report["points"][0][0]["growth"].as_f64().unwrap();
        // the run's step of 1 ms costs the last thousandths
        assert!((growth - measured).abs() < 0.01, "{gain}: {growth} {measured}");
        assert_eq!(growth > 0.0, grows, "{growth}");
    }
}
