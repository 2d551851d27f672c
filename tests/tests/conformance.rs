//! Every packaged unit keeps the standard: no finding of any rule, no error or warning of any check
//! that drives it through its C functions.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::path::PathBuf;

use serde_json::Value;
use system_tests::{root, start};

fn units() -> Vec<PathBuf> {
    let folder = root().join("target/fmu");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut units: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|ending| ending == "fmu")).collect();
    // bundles have tests of their own (tests/python/test_bundle.py)
    let bundles = ["magnet-on-girder", "train"];
    units.retain(|path| !bundles.iter().any(|bundle| path.ends_with(format!("{bundle}.fmu"))));
    units.sort();
    assert!(units.len() >= 10, "{units:?}");
    units
}

#[test]
fn invariant_packaged_units_break_no_rule() {
    for unit in units() {
        let output = start(&["validate", "--json", &unit.display().to_string()]).unwrap();
        let found = String::from_utf8(output.stdout).unwrap();
        assert_eq!(found.trim(), "[]", "{}", unit.display());
        assert!(output.status.success());
    }
}

#[test]
fn invariant_packaged_units_pass_every_check() {
    for unit in units() {
        let path = unit.display().to_string();
        let output = start(&["validate", "--dynamic", "--json", &path]).unwrap();
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let checks = report["checks"].as_array().unwrap();
        let findings = checks.iter().flat_map(|check| check["findings"].as_array().unwrap());
        let grave: Vec<&Value> = findings.filter(|it| it["severity"] != "note").collect();
        assert!(grave.is_empty(), "{path}: {grave:#?}");
        // units of the kit promise every capability: what is left out has no variables to try
        let skipped = checks.iter().filter(|check| check["skipped"].is_string()).count();
        assert!(checks.len() > 50 && skipped < 10, "{path}: {} checks", checks.len());
    }
}
