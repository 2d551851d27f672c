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
