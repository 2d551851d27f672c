//! `maglev floquet` on the packaged units: verdicts, JSON, pictures, bad input.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_path_buf()
}

fn floquet(arguments: &[&str]) -> Output {
    let maglev = env!("CARGO_BIN_EXE_maglev");
    Command::new(maglev).arg("floquet").args(arguments).current_dir(root()).output().unwrap()
}

const MAGNET: &str = "scenarios/one-magnet.json";

/// Table 2's gains are stable at every speed; with 14.353 A and a large gain of the gap a motion grows.
#[test]
fn issue_18_the_verdict_is_the_exit_status() {
    let fine = floquet(&[MAGNET, "--speeds", "2,20"]);
    assert!(fine.status.success(), "{}", String::from_utf8_lossy(&fine.stderr));
    let page = String::from_utf8(fine.stdout).unwrap();
    assert!(page.contains("1 magnets") && page.contains("repeats after each span, 25 m"), "{page}");
    let set = ["--set", "ems_01.operating_current=14.353", "--set", "ems_01.gain_gap=14"];
    let mut arguments = vec![MAGNET, "--speeds", "2", "--json"];
    arguments.extend(set);
    let grows = floquet(&arguments);
    assert_eq!(grows.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&grows.stdout).unwrap();
    let point = &report["points"][0][0];
    assert!(point["growth"].as_f64().unwrap() > 1.0, "{point}");
    assert!((point["frequency_hz"].as_f64().unwrap() - 6.07).abs() < 0.1, "{point}");
}

/// A map: the girders alone are read again, values are written with a picture.
#[test]
fn issue_18_a_map_has_a_picture_and_all_points() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().display().to_string();
    let map = floquet(&[
        MAGNET,
        "--speeds",
        "2:20:3",
        "--y",
        "guideway.stiffness_factor=0.5,1",
        "--out",
        &out,
    ]);
    assert!(map.status.success(), "{}", String::from_utf8_lossy(&map.stderr));
    let text = std::fs::read_to_string(folder.path().join("floquet.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let points = report["points"].as_array().unwrap();
    assert_eq!((points.len(), points[0].as_array().unwrap().len()), (2, 3));
    // a girder of half the stiffness has 1/√2 of the frequency
    let frequency = |k: usize| points[k][0]["frequency_hz"].as_f64().unwrap();
    assert!((frequency(0) / frequency(1) - 0.5_f64.sqrt()).abs() < 0.03, "{text}");
    let picture = std::fs::read_to_string(folder.path().join("floquet.svg")).unwrap();
    assert!(picture.contains("guideway.stiffness_factor") && picture.contains("speed (m/s)"));
}

/// A map that could not be written is not computed again: its points are taken from the journal, which another map
/// refuses.
#[test]
fn issue_18_an_interrupted_map_continues() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().display().to_string();
    let result = folder.path().join("floquet.json");
    std::fs::create_dir(&result).unwrap();
    let arguments = [MAGNET, "--speeds", "5,20", "--out", &out];
    assert_eq!(floquet(&arguments).status.code(), Some(1));
    let journal = folder.path().join("floquet-points.jsonl");
    let kept = std::fs::read_to_string(&journal).unwrap();
    assert_eq!(kept.lines().count(), 3);
    let other = floquet(&[MAGNET, "--speeds", "2,20", "--out", &out]);
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("belongs to another map"));
    // a mark shows that a point is read; the other is lost
    let lines: Vec<&str> = kept.lines().collect();
    let mut point: Value = serde_json::from_str(lines[1]).unwrap();
    point["motion"]["error"] = 0.125.into();
    std::fs::write(&journal, format!("{}\n{point}\n{}", lines[0], &lines[2][..40])).unwrap();
    std::fs::remove_dir(&result).unwrap();
    assert!(floquet(&arguments).status.success());
    let report: Value = serde_json::from_str(&std::fs::read_to_string(result).unwrap()).unwrap();
    let errors: Vec<f64> = report["points"][0]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| it["error"].as_f64().unwrap())
        .collect();
    assert_eq!(errors.iter().filter(|it| **it == 0.125).count(), 1, "{errors:?}");
    assert!(errors.iter().all(|it| it.is_finite()) && !journal.exists());
}

#[test]
fn refusal_speeds_axes_and_systems_that_do_not_fit() {
    for (arguments, wanted) in [
        (vec![MAGNET, "--speeds", "0:5:3"], "maglev modes"),
        (vec![MAGNET, "--speeds", "5:1:3"], "increase"),
        (vec![MAGNET, "--speeds", "5", "--y", "stiffness=1:2:3"], "INSTANCE.VARIABLE=A:B:N"),
        (vec![MAGNET, "--speeds", "5", "--tolerance", "0"], "positive"),
        (vec![MAGNET, "--speeds", "5", "--above=-1"], "at least 0"),
        (vec![MAGNET, "--speeds", "5", "--y", "guideway.stifness_factor=1:2:3"], "stifness_factor"),
        (vec!["scenarios/levitation.json", "--speeds", "5"], "does not report its linearisation"),
        (vec!["missing.json", "--speeds", "5"], "missing.json"),
    ] {
        let output = floquet(&arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?} {text}");
        assert!(text.contains(wanted), "{arguments:?} {text}");
    }
}

/// Two kinds of span: the row repeats after both; a beam over two fields is one span.
#[test]
fn issue_18_the_period_of_a_row_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.json");
    let write = |spans: &str| {
        let root = root().display().to_string();
        let text = format!(
            r#"{{"extends": "{root}/{MAGNET}", "units": {{"vehicle": "{root}/target/fmu/vehicle-one-magnet.fmu",
            "ems": "{root}/target/fmu/ems.fmu", "guideway": {{"fmu": "{root}/target/fmu/guideway-one-magnet.fmu",
            "resources": {{"guideway.json": {{"girders": {{"short": {{"length": 20, "modes": 2, "mass_per_length": 2800,
            "frequencies": [9, 33], "damping": [0.01]}}}}, "spans": {spans}}}}}}}}}}}"#
        );
        std::fs::write(&file, text).unwrap();
        let output = floquet(&[file.to_str().unwrap(), "--speeds", "20"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let page = write(
        r#"[{"girder": "table_3"}, {"girder": "short"}, {"girder": "table_3"}, {"girder": "short"}]"#,
    );
    assert!(page.contains("repeats after every 2 spans, 45 m; 4 modes"), "{page}");
    let page = write(r#"[{"girder": "table_3", "count": 2}, {"girder": "short"}]"#);
    assert!(page.contains("repeats after every 3 spans, 70 m, the whole layout"), "{page}");
    let page = write(r#"[{"girder": "short", "count": 3}]"#);
    assert!(page.contains("repeats after each span, 20 m; 2 modes"), "{page}");
}
