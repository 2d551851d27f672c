//! `maglev report --measured` and `maglev fit`: files, figures, bad input.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::f64::consts::TAU;
use std::fs;

use serde_json::{Value, json};
use support::{Bench, bench_of, oscillator};

/// An oscillation with ω² = 8/s² and an amplitude of 1 m in steps of 10 ms until 10 s; and a record of it in mm with even
/// noise of ± 1 mm, from 0.5 s on, whose clock is 0.25 s behind. Also the name of the signal.
fn measured() -> (Bench, String) {
    let mut scenario = oscillator(0.01);
    scenario["experiment"]["stop"] = json!(10.0);
    scenario["instances"]["c"]["parameters"]["gain"] = json!(-8.0);
    scenario["algorithm"] =
        json!({ "name": "gauss-seidel", "extrapolation": 2, "derivatives": true });
    let bench = bench_of(&scenario);
    bench.run(&["--no-report"]).succeeds();
    let signal =
        bench.result("results.csv").lines().next().unwrap().split(',').nth(1).unwrap().to_owned();
    let mut text = "t (ms),x (mm)\n".to_owned();
    let mut state = 1_u64;
    let mut noise = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    };
    for row in bench.rows().iter().skip(50) {
        text += &format!("{},{}\n", 1e3 * (row[0] - 0.25), 1e3 * row[1] + 2.0 * noise());
    }
    fs::write(bench.path("record.csv"), text).unwrap();
    (bench, signal)
}

#[test]
fn analytic_a_record_beside_a_run() {
    let (bench, signal) = measured();
    let map = format!("x (mm)={signal}");
    let record = ["--measured", "record.csv", "--time-column", "t (ms)", "--map", &map];
    let ran = bench.maglev(&[&["report", "out", "--offset", "0.25"], &record[..]].concat());
    ran.succeeds();
    assert!(ran.stdout().contains("0.25 s, as given"), "{}", ran.stdout());
    let found: Value = serde_json::from_str(&bench.result("measured.json")).unwrap();
    let it = &found[0]["signals"][0];
    // even noise of ± 1 mm
    let rms = it["rms_error"].as_f64().unwrap();
    assert!((rms / (1e-3 / 3_f64.sqrt()) - 1.0).abs() < 0.1, "{rms}");
    assert_eq!((it["file_unit"].as_str(), it["unit"].as_str()), (Some("mm"), Some("m")));
    let page = bench.result("report.html");
    assert!(page.contains("Measured data") && page.contains("record.csv"));
    // the clock is found, but for whole periods of the oscillation, which the report says
    let ran = bench.maglev(&[&["report", "out", "--offset", "find"], &record[..]].concat());
    ran.succeeds();
    let found: Value = serde_json::from_str(&bench.result("measured.json")).unwrap();
    let offset = found[0]["alignment"]["offset"].as_f64().unwrap();
    let periods = (offset - 0.25) / (TAU / 8_f64.sqrt());
    assert!((periods - periods.round()).abs() < 2e-3, "{offset}");
    assert!(ran.stdout().contains("AMBIGUOUS"), "{}", ran.stdout());
}

#[test]
fn refusal_records_that_cannot_be_used_are_bad_input() {
    let (bench, signal) = measured();
    let map = format!("x (mm)={signal}");
    let report = |more: &[&str]| bench.maglev(&[&["report", "out"], more].concat());
    let time = ["--time-column", "t (ms)"];
    report(&["--measured", "record.csv"]).fails(2, &["no column", "--map"]);
    report(&["--map", &map]).fails(2, &["add --measured"]);
    let kilonewtons = format!("{map}:kN");
    let wrong = ["--measured", "record.csv", "--map", &kilonewtons];
    report(&[&wrong[..], &time].concat()).fails(2, &["kN is kg.m.s-2", "column \"x (mm)\""]);
    let far = ["--measured", "record.csv", "--map", &map, "--offset", "100"];
    report(&[&far[..], &time].concat()).fails(2, &["has 0 values during the run", "--offset find"]);
    report(&["--measured", "none.csv"]).fails(2, &["none.csv"]);
    report(&["--measured", "record.csv", "--map", "x"]).fails(2, &["COLUMN=INSTANCE.VARIABLE"]);
    fs::write(bench.path("bad.json"), r#"{"file": "record.csv", "columns": {}}"#).unwrap();
    report(&["--measured", "bad.json"]).fails(2, &["bad.json", "columns"]);
}

/// ω² is the gain of a unit, which comes back within its interval; the residual is white.
#[test]
fn analytic_a_gain_is_fitted_to_a_record() {
    let (bench, signal) = measured();
    let map = format!("x (mm)={signal}");
    let vary = "c.gain=-10:-4";
    let record =
        ["--measured", "record.csv", "--time-column", "t (ms)", "--map", &map, "--offset", "0.25"];
    let fit = |more: &[&str]| {
        bench.maglev(&[&["fit", "scenario.json", "--out", "fit"], &record[..], more].concat())
    };
    let ran = fit(&["--vary", vary]);
    ran.succeeds();
    let found: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("fit/fit.json")).unwrap()).unwrap();
    let it = &found["parameters"][0];
    let (value, half) = (it["value"].as_f64().unwrap(), it["half_width"].as_f64().unwrap());
    // 1.5 times the interval: a fixed record may be one of the twenty outside of it
    assert!((value + 8.0).abs() < 1.5 * half && half < 0.01, "{value} ± {half}");
    assert_eq!(found["signals"][0]["whiteness"]["white"], true);
    // the patch runs, and gives the fitted run
    bench.maglev(&["run", "fit/fitted.json", "--out", "again", "--no-report"]).succeeds();
    let column = |file: &str| fs::read_to_string(bench.path(file)).unwrap();
    let (fitted, again) = (column("fit/fitted/results.csv"), column("again/results.csv"));
    assert_eq!(
        fitted.lines().next().unwrap().split(',').nth(1),
        again.lines().next().unwrap().split(',').nth(1)
    );
    let report = column("fit/report.html");
    assert!(report.contains("Fitted parameters") && report.contains("Measured data"));
    // one thread or many
    let single: Value =
        serde_json::from_str(&fit(&["--vary", vary, "--threads", "1", "--json"]).stdout()).unwrap();
    assert_eq!(single["parameters"], found["parameters"]);
    // the value before is that of --set, which also gives other variables theirs
    let set = ["--set", "*.fail_time=1e9", "--set", "c.gain=-6", "--vary", vary, "--json"];
    let other: Value = serde_json::from_str(&fit(&set).stdout()).unwrap();
    assert_eq!(other["parameters"][0]["before"], -6.0);
    assert!((other["parameters"][0]["value"].as_f64().unwrap() - value).abs() < 1e-6);
    // bad input
    fit(&[]).fails(2, &["--vary"]);
    fit(&["--vary", "c.gian=1:2"]).fails(2, &["gian"]);
    fit(&["--vary", "c.gain=-11:2"]).fails(2, &["exceed those of the unit, -10 to 10"]);
    fit(&["--vary", "c.fault=0:2"]).fails(2, &["not a Real"]);
    fit(&["--vary", vary, "--vary", vary]).fails(2, &["varied twice"]);
    fit(&["--vary", "c.gain=2:1"]).fails(2, &["not below"]);
}
