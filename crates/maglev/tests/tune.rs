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
/// All gains of one magnet, with enough room for a modulus margin of one half, and few evaluations.
const GAINS: [&str; 18] = [
    MAGNET,
    "--vary",
    "ems_*.gain_acceleration=1:40",
    "--vary",
    "ems_*.gain_gap_velocity=10:120",
    "--vary",
    "ems_*.gain_velocity=10:160",
    "--noise",
    "gap=1e-5:200",
    "--noise",
    "acceleration=0.05:200",
    "--samples",
    "20",
    "--starts",
    "2",
    "--evaluations",
    "120",
    "--json",
];

/// The result keeps its limits, its figures are those of `maglev modes` and `maglev response` with the values found,
/// and one thread or two give the same bits.
#[test]
fn issue_18_gains_are_tuned_within_limits_and_verified() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().display().to_string();
    let mut arguments = GAINS.to_vec();
    arguments.extend(["--front", "3", "--max-voltage", "10"]);
    let one = tuned(&[&arguments[..], &["--threads", "1", "--out", &out]].concat());
    let two = tuned(&[&arguments[..], &["--threads", "2"]].concat());
    for key in ["parameters", "conditions", "active", "front", "evaluations"] {
        assert_eq!(one[key], two[key], "{key}");
    }
    let condition = &one["conditions"][0];
    let (before, after) = (&condition["before"], &condition["after"]);
    let number = |it: &Value, key: &str| it[key].as_f64().unwrap();
    // table 2 has a modulus margin of 0.319
    assert!((number(before, "modulus_one") - 0.319).abs() < 0.003, "{before}");
    assert!(one["kept"].as_bool().unwrap(), "{one}");
    assert!(number(after, "modulus_one") >= 0.5 && number(after, "voltage") <= 10.0, "{after}");
    assert!(number(after, "damping") > number(before, "damping"), "{before} {after}");
    let verified = &condition["verified"];
    assert!(number(verified, "distance") < 1e-8, "{verified}");
    let exact = verified["margins"][0].as_f64().unwrap();
    assert!((exact / number(after, "modulus_one") - 1.0).abs() < 0.02, "{verified} {after}");
    // the scenario that is written is the one that was found
    let modes = maglev("modes", &[folder.path().join("tuned.json").to_str().unwrap(), "--json"]);
    let modes: Value = serde_json::from_slice(&modes.stdout).unwrap();
    let all = modes["modes"]["modes"].as_array().unwrap();
    let damping = number(after, "damping");
    let near =
        all.iter().any(|it| (number(&it["continuous"], "damping_ratio") - damping).abs() < 1e-6);
    assert!(near, "{damping}");
    assert!(!one["front"].as_array().unwrap().is_empty());
    for file in ["tune.json", "front.svg", "front.png"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    assert!(!folder.path().join("tune-evaluations.jsonl").exists());
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
