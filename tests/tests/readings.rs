//! The dataset of the study of readings, docs/paper/readings.csv, is that of today's units.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::collections::BTreeMap;

use system_tests::{FinishedRun, root, scenario};

/// The rows of a table without quotes, by the names of its columns.
fn rows(file: &str) -> Vec<BTreeMap<String, String>> {
    let text = std::fs::read_to_string(root().join(file)).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let values: Vec<&str> = line.split(',').collect();
        assert_eq!(values.len(), names.len(), "{line}");
        names.iter().zip(values).map(|(name, value)| ((*name).into(), value.into())).collect()
    };
    lines.map(row).collect()
}

/// What each factor of `examples/studies/readings.json` sets.
fn targets() -> BTreeMap<String, String> {
    let text = std::fs::read(root().join("examples/studies/readings.json")).unwrap();
    let study: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let factors = study["factors"].as_object().unwrap();
    let variables = factors.iter().filter_map(|(name, factor)| {
        factor["target"].as_str().map(|target| (name.clone(), target.to_owned()))
    });
    variables.collect()
}

/// Girders of figure 14 in three readings, run up to their largest gap: at 28 A, with the nonlinear law, and lighter.
#[test]
fn golden_the_dataset_of_readings_is_not_stale() {
    let (points, dataset) =
        (rows("examples/studies/readings.csv"), rows("docs/paper/readings.csv"));
    let targets = targets();
    for case in [
        "28 A | 2781 kg/m | standstill | 5 Hz by stiffness",
        "nonlinear | 2781 kg/m | standstill | 5 Hz by mass",
        "24 A | 2336 kg/m | standstill | 6 Hz by stiffness",
    ] {
        let point = points.iter().find(|it| it["case"] == case).unwrap();
        let row =
            dataset.iter().find(|it| it["study"] == "readings" && it["case"] == case).unwrap();
        let step: f64 = point["step"].parse().unwrap();
        let time: f64 = row["gap_time"].parse().unwrap();
        // the largest value is the last row or earlier
        let stop = ((time / step).round() + 1.0) * step;
        let mut options = vec![
            format!("--stop={stop:.3}"),
            format!("--step={step}"),
            format!("--record-interval={step}"),
            "--set=guideway.chirp_amplitude=10000".to_owned(),
        ];
        let settings = targets.iter().map(|(name, it)| format!("--set={it}={}", point[name]));
        options.extend(settings);
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        let run = FinishedRun::of(&scenario("low-speed.json"), &options).unwrap();
        let columns = run.columns().unwrap();
        let mut largest = 0.0_f64;
        for gap in (1..=64).map(|k| format!("vehicle.gap_{k:02}")) {
            let values = &columns[&gap];
            largest = values.iter().fold(largest, |most, c| most.max((c - values[0]).abs()));
        }
        let committed: f64 = row["gap"].parse().unwrap();
        // six digits are committed
        assert!(
            (largest / committed - 1.0).abs() < 1e-5,
            "{case}: {largest} m, committed {committed} m; run `cargo xtask readings`"
        );
    }
}
