//! `maglev map` on the packaged units, compared with `maglev modes`.

#![allow(clippy::unwrap_used, reason = "a test program")]

use serde_json::Value;
use system_tests::{scenario, start};

fn mapped(name: &str, options: &[&str]) -> Value {
    let file = scenario(name).display().to_string();
    let mut all = vec!["map", &file, "--json"];
    all.extend(options);
    let output = start(&all).unwrap();
    assert!(output.status.code().unwrap() < 2, "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Least damping ratio and its frequency by `maglev modes`.
fn least(name: &str, settings: &[String]) -> (f64, f64) {
    let file = scenario(name).display().to_string();
    let mut all = vec!["modes", &file, "--json"];
    for setting in settings {
        all.extend(["--set", setting]);
    }
    let output = start(&all).unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    // sorted by damping ratio
    let mode = &found["modes"]["modes"][0]["continuous"];
    (mode["damping_ratio"].as_f64().unwrap(), mode["frequency_hz"].as_f64().unwrap())
}

/// One magnet, gain by frequency of the girder: every point is that of `maglev modes` with these values.
#[test]
fn analytic_every_point_of_a_map_is_that_of_the_modes() {
    let options = ["--x", "ems_*.gain_gap=1:9:4", "--y", "guideway.frequency_01=5:9:3"];
    let map = mapped("one-magnet.json", &options);
    for (row, f) in [5.0, 7.0, 9.0].into_iter().enumerate() {
        for column in 0..4 {
            let gain = map["x"]["values"][column].as_f64().unwrap();
            let settings = [format!("ems_*.gain_gap={gain}"), format!("guideway.frequency_01={f}")];
            let (damping, frequency) = least("one-magnet.json", &settings);
            let cell = &map["cells"][row][column];
            let (d, hz) =
                (cell["damping"].as_f64().unwrap(), cell["frequency_hz"].as_f64().unwrap());
            assert!((d - damping).abs() < 1e-6, "{settings:?}: {d} {damping}");
            assert!((hz - frequency).abs() < 1e-6 * frequency, "{settings:?}: {hz} {frequency}");
        }
    }
}

/// The train: points agree with all eigenvalues to 1e-6, and most are counted.
#[test]
fn analytic_the_map_of_the_train_agrees_with_all_eigenvalues() {
    let options = ["--x", "ems_*.gain_gap=5:14:6", "--y", "guideway.frequency_01=5:9:5"];
    let map = mapped("standstill.json", &options);
    let checks = map["checks"].as_array().unwrap();
    assert_eq!(checks.len(), 20);
    for check in checks {
        assert!(check["distance"].as_f64().unwrap() < 1e-6, "{check}");
        let grows = |key: &str| check[key].as_u64().unwrap() > 0;
        assert_eq!(grows("growing"), grows("mapped"), "{check}");
    }
}

/// The exit status says whether a mode grows; wrong axes are refused with status 2 and a reason.
#[test]
fn refusal_wrong_axes_are_named() {
    let file = scenario("one-magnet.json").display().to_string();
    let status = |options: &[&str]| {
        let mut all = vec!["map", &file];
        all.extend(options);
        let output = start(&all).unwrap();
        (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(status(&["--x", "ems_*.gain_gap=6,7"]).0, 0);
    for (options, reason) in [
        (vec!["--x", "ems_*.gain_gap=1:1:5"], "two different ends"),
        (vec!["--x", "ems_*.gain_gapp=1:2:5"], "gain_gap"),
        (vec!["--x", "ems_*.nonlinear=0,1"], "nonlinear"),
        (vec!["--x", "ems_*.gain_gap=1,2", "--y", "ems_01.gain_gap=1,2"], "two axes"),
        (vec!["--x", "guideway.damping_01=-1,2"], "damping_01"),
    ] {
        let (code, text) = status(&options);
        assert_eq!(code, 2, "{options:?}: {text}");
        assert!(text.contains(reason), "{options:?}: {text}");
    }
}

/// An interrupted map continues with the rows that it has; a folder of another map is refused.
#[test]
fn issue_a_map_continues_from_its_journal() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().display().to_string();
    let options =
        ["--x", "ems_*.gain_gap=5:9:3", "--y", "guideway.frequency_01=5:9:3", "--out", &out];
    let map = mapped("one-magnet.json", &options);
    for name in ["map.json", "map.parquet", "map.svg", "map.png"] {
        assert!(folder.path().join(name).exists(), "{name}");
    }
    let journal = folder.path().join("map-rows.jsonl");
    assert!(!journal.exists());
    std::fs::write(&journal, "another map\n").unwrap();
    let file = scenario("one-magnet.json").display().to_string();
    let mut all = vec!["map", &file];
    all.extend(options);
    let output = start(&all).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("belongs to another map"));
    std::fs::remove_file(&journal).unwrap();
    assert_eq!(mapped("one-magnet.json", &options)["cells"], map["cells"]);
}
