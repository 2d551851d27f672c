//! `maglev tune` on the packaged units: results that hold in a new start, the same bits, files, bad input.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_path_buf()
}

fn maglev(subcommand: &str, arguments: &[&str]) -> Output {
    let maglev = env!("CARGO_BIN_EXE_maglev");
    Command::new(maglev).arg(subcommand).args(arguments).current_dir(root()).output().unwrap()
}

fn tuned(arguments: &[&str]) -> Value {
    let output = maglev("tune", arguments);
    assert!(output.status.code().unwrap() < 2, "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

const MAGNET: &str = "scenarios/one-magnet.json";
/// One bogie at three places, empty and full, with nonlinear magnets whose current follows the load: the worst condition
/// becomes better, the new starts agree, and a load changes the modes.
#[test]
fn issue_18_gains_are_tuned_over_positions_and_loads() {
    let found = tuned(&[
        "scenarios/one-bogie.json",
        "--file",
        "examples/tuning/bogie.json",
        "--samples",
        "2",
        "--evaluations",
        "12",
        "--json",
    ]);
    let conditions = found["conditions"].as_array().unwrap();
    assert_eq!(conditions.len(), 4);
    let number = |it: &Value| it.as_f64().unwrap();
    let damping = |k: usize, when: &str| number(&conditions[k][when]["damping"]);
    let worst = |when| (0..4).map(|k| damping(k, when)).fold(f64::INFINITY, f64::min);
    assert!(worst("after") > 1.2 * worst("before"), "{} {}", worst("before"), worst("after"));
    // table 2's gains, by `maglev modes`: 0.0161 empty and 0.0272 full at midspan, 0.0143 at a quarter
    for (k, wanted) in [(0, 0.0161), (1, 0.0272), (2, 0.0143)] {
        assert!((damping(k, "before") - wanted).abs() < 2e-4, "{k}: {}", damping(k, "before"));
    }
    for it in conditions {
        let verified = &it["verified"];
        assert!(number(&verified["distance"]) < 1e-5, "{verified}");
    }
}

/// The r.m.s. voltage of the table is that of a run with noise of the sensors, and of a run over the irregularity on stiff
/// girders. Both are sums over random phases, which the seeds fix: twenty parts of the run give the statistical error.
#[test]
fn issue_18_the_voltage_is_that_of_runs_with_noise_and_irregularity() {
    let quiet = ["--set", "guideway.chirp_on=false", "--set", "guideway.stiffness_factor=1000"];
    let asked = "--vary ems_*.gain_gap=6:8 --noise gap=1e-5:200 --noise acceleration=0.05:200 \
                 --irregularity 1.3888889 --samples 1 --starts 1 --evaluations 10 --min-modulus 0 \
                 --front 0 --json";
    let asked: Vec<&str> = asked.split_whitespace().collect();
    let predicted = tuned(&[&[MAGNET], &asked[..], &quiet[..]].concat());
    let noisy =
        "ems_01.gap_sensor_noise=1e-5 ems_01.acceleration_sensor_noise=0.05 ems_01.noise_seed=1";
    let rough = "guideway.irregularity_on=true guideway.irregularity_start=-500 \
                 guideway.irregularity_end=500 vehicle.initial_position=5 vehicle.travel_speed=1.3888889";
    for (key, set, allowed) in [("voltage_noise", noisy, 0.01), ("voltage_track", rough, 0.08)] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().display().to_string();
        let set = set.split_whitespace().flat_map(|it| ["--set", it]);
        let mut arguments = vec![MAGNET, "--stop", "50", "--no-report", "-q", "--out", &out];
        arguments.extend(set.chain(quiet));
        let output = maglev("run", &arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let (rms, error) = root_mean_square(&folder.path().join("results.csv"), "ems_01.voltage");
        let wanted = predicted["conditions"][0]["before"][key].as_f64().unwrap();
        assert!(error < allowed, "{key}: {error}");
        assert!((rms / wanted - 1.0).abs() < 2.5 * error, "{key}: {rms} {wanted} {error}");
    }
}

/// R.m.s. about the mean of a signal from 5 s on, and its relative statistical error by the scatter of twenty parts.
fn root_mean_square(file: &Path, signal: &str) -> (f64, f64) {
    let mut reader = csv::Reader::from_path(file).unwrap();
    let column = reader.headers().unwrap().iter().position(|it| it.starts_with(signal)).unwrap();
    let rows = reader.records().map(Result::unwrap);
    let rows = rows.filter(|it| it[0].parse::<f64>().unwrap() > 5.0);
    let all: Vec<f64> = rows.map(|it| it[column].parse().unwrap()).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let power = |it: &[f64]| it.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / it.len() as f64;
    let parts: Vec<f64> = all.chunks(all.len().div_ceil(20)).map(power).collect();
    let whole = power(&all);
    let scatter = parts.iter().map(|it| (it - whole).powi(2)).sum::<f64>();
    let error = (scatter / (parts.len() * (parts.len() - 1)) as f64).sqrt() / whole;
    (whole.sqrt(), 0.5 * error)
}

/// A bound that holds the damping back is named.
#[test]
fn issue_18_active_bounds_are_reported() {
    let found = tuned(&[
        MAGNET,
        "--vary",
        "ems_*.gain_gap_velocity=38:42",
        "--min-modulus",
        "0",
        "--min-delay",
        "0",
        "--front",
        "0",
        "--samples",
        "2",
        "--starts",
        "1",
        "--json",
        "--influence",
        "0",
    ]);
    let active = found["active"].as_array().unwrap();
    let named =
        |it: &Value| it["what"].as_str().unwrap().contains("ems_*.gain_gap_velocity at its");
    assert!(active.iter().any(named), "{found}");
}

#[test]
fn refusal_bad_input_is_named_with_status_2() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tuning.json");
    std::fs::write(&file, r#"{"vary": {"ems_*.gain_gap": {"from": 2, "upto": 14}}}"#).unwrap();
    let file = file.display().to_string();
    let vary = ["--vary", "ems_*.gain_gap=2:14"];
    let cases: [(&[&str], &str); 11] = [
        (&[], "no parameter is given"),
        (&["--vary", "ems_*.gain_gap=14:2"], "14 to 2 is not a range"),
        (&["--vary", "ems_*.gain_gap=2"], "not of the form"),
        (&["--vary", "ems_*.gian_gap=2:14"], "gain_gap"),
        (
            &["--vary", "ems_*.gain_gap=2:14", "--vary", "ems_01.gain_gap=2:14"],
            "changes the same parameter",
        ),
        (&["--file", &file], "upto"),
        (&["--file", "nowhere.json"], "cannot read the tuning file nowhere.json"),
        (&["--objective", "speed", vary[0], vary[1]], "not an objective"),
        (&["--max-voltage", "5", vary[0], vary[1]], "needs noise"),
        (&["--noise", "gab=1e-5:100", vary[0], vary[1]], "they measure gap, acceleration"),
        (&["--condition", "soft:guideway.frequency_01=-5", vary[0], vary[1]], "frequency_01"),
    ];
    for (options, wanted) in cases {
        let output = maglev("tune", &[&[MAGNET], options].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(wanted), "{options:?}: {said}");
        assert!(matches!(output.status.code(), Some(1 | 2)), "{options:?}: {said}");
    }
}
