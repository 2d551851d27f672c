//! Ride quality in the summary: of accelerations that are known, after stops, and why it is not there.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::f64::consts::{PI, SQRT_2};
use std::fs;

use analysis::ride::sperling::Direction;
use analysis::ride::{Weighting, comfort};
use maglev::run::{Job, Observer, Unobserved, resume};
use scenario::{Checkpoints, Scenario};
use serde_json::{Value, json};
use support::{Bench, ring, with_states};

/// An oscillator of 5 Hz: a.y = cos 10πt, with the unit of an acceleration; c.u is in metres.
fn bench(points: &Value) -> Bench {
    let bench = Bench::new();
    let unit = "<Unit name=\"m\"><BaseUnit m=\"1\"/></Unit>";
    let accelerations = with_states()
        .replace(unit, "<Unit name=\"m/s2\"><BaseUnit m=\"1\" s=\"-2\"/></Unit>")
        .replace("unit=\"m\"", "unit=\"m/s2\"");
    bench.unit("unit.fmu", &accelerations, &[]);
    bench.unit("metres.fmu", &with_states(), &[]);
    let mut scenario = ring();
    scenario["units"]["metres"] = json!("metres.fmu");
    scenario["instances"]["m"] = json!({ "unit": "metres" });
    scenario["instances"]["a"]["start"] = json!({ "y": 1.0 });
    for (name, gain) in [("c", -10.0), ("d", 10.0), ("e", PI * PI)] {
        scenario["instances"][name] = json!({ "unit": "unit", "parameters": { "gain": gain } });
    }
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" },
        { "from": "b.y", "to": "c.u" },
        { "from": "c.z", "to": "d.u" },
        { "from": "d.z", "to": "e.u" },
        { "from": "e.z", "to": "a.u" },
    ]);
    scenario["experiment"] = json!({ "stop": 15.0, "step": 0.001 });
    scenario["algorithm"] = json!({ "extrapolation": 3 });
    scenario["record"] = json!({
        "interval": 0.005,
        "signals": ["a.y", "m.y", { "signals": ["b.y"], "interval": 0.01 }],
        "format": ["parquet"]
    });
    scenario["ride_quality"].clone_from(points);
    bench.scenario(&scenario);
    bench
}

#[test]
fn analytic_ride_quality_of_a_sine() {
    let bench = bench(&json!([
        { "name": "seat", "vertical": "a.y", "lateral": "a.y", "from": 5.0, "to": 14.995 },
        { "name": "rail", "vertical": "a.y", "vertical_weighting": "Wb", "from": 5.0 },
    ]));
    let ran = bench.run(&[]);
    ran.succeeds();
    assert!(!ran.stderr().contains("ride quality"), "{}", ran.stderr());
    let quality = &bench.summary()["ride_quality"];
    assert_eq!(quality["units"]["vibration_dose"], "m/s1.75");
    let close = |value: &Value, expected: f64| {
        // the coupled oscillation keeps its amplitude to 1e-4 in 15 s
        let error = value.as_f64().unwrap() / expected - 1.0;
        assert!(error.abs() < 2e-3, "{value} instead of {expected}");
    };
    let [wk, wb, wd] = [Weighting::Wk, Weighting::Wb, Weighting::Wd].map(|it| it.factor(5.0));
    let seat = &quality["points"][0];
    assert_eq!(seat["name"], "seat");
    let vertical = &seat["vertical"];
    assert_eq!((&vertical["signal"], &vertical["weighting"]), (&json!("a.y"), &json!("Wk")));
    assert_eq!(vertical["from"], 5.0);
    close(&vertical["to"], 14.995);
    close(&vertical["weighted_rms"], wk / SQRT_2);
    close(&vertical["maximum_transient"], wk / SQRT_2);
    // the mean of cos⁴ is 3/8, over ten seconds
    close(&vertical["vibration_dose"], wk * (10.0_f64 * 3.0 / 8.0).powf(0.25));
    close(&vertical["crest_factor"], SQRT_2);
    close(&seat["lateral"]["weighted_rms"], wd / SQRT_2);
    // (a B)^0.3 with a in cm/s²
    close(&vertical["sperling_index"], (100.0 * Direction::Vertical.factor(5.0)).powf(0.3));
    close(
        &seat["lateral"]["sperling_index"],
        (100.0 * Direction::Horizontal.factor(5.0)).powf(0.3),
    );
    let total = (wk * wk + wd * wd).sqrt() / SQRT_2;
    close(&seat["vibration_total"], total);
    assert_eq!(seat["comfort"], json!(comfort(total)));
    assert_eq!(seat["longitudinal"], Value::Null);
    close(&quality["points"][1]["vertical"]["weighted_rms"], wb / SQRT_2);
    assert_eq!(quality["points"][1]["vertical"]["to"], 15.0);
}

#[test]
fn invariant_a_resumed_run_has_the_same_ride_quality() {
    /// Ends every run at once.
    struct Impatient;
    impl Observer for Impatient {
        fn interrupted(&self) -> bool {
            true
        }
    }
    let bench = bench(&json!([{ "name": "seat", "vertical": "a.y" }]));
    let mut scenario = Scenario::load(&bench.path("scenario.json")).unwrap();
    let run = |scenario: &Scenario, folder: &str, observer: &mut dyn Observer| {
        let folder = bench.path(folder);
        Job { scenario, name: "scenario", folder: &folder }.run(observer).unwrap()
    };
    let whole = run(&scenario, "whole", &mut Unobserved).ride_quality.unwrap();
    assert!(whole.points[0].vertical.is_some());
    scenario.checkpoint = Some(Checkpoints { every: 1.0 });
    let short = run(&scenario, "out", &mut Impatient).ride_quality.unwrap();
    // after one step there is too little to judge
    assert!(short.points[0].vertical.is_none() && short.points[0].warnings.len() == 1);
    let resumed = resume(&bench.path("out"), &mut Unobserved).unwrap().ride_quality.unwrap();
    assert_eq!(resumed, whole);
    let read = |folder: &str| {
        let text = fs::read_to_string(bench.path(folder).join("summary.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["ride_quality"].clone()
    };
    assert_eq!(read("out"), read("whole"));
}

#[test]
fn issue_missing_ride_quality_is_explained_and_the_run_succeeds() {
    let bench = bench(&json!([
        { "name": "forgotten", "vertical": "a.u", "lateral": "a.y" },
        { "name": "coarse", "vertical": "b.y" },
        { "name": "short", "vertical": "a.y", "from": 11.0 },
        { "name": "late", "vertical": "a.y", "from": 100.0 },
        { "name": "metres", "vertical": "m.y" },
    ]));
    let ran = bench.run(&[]);
    ran.succeeds();
    let summary = bench.summary();
    let points = summary["ride_quality"]["points"].as_array().unwrap();
    for (point, text) in points.iter().zip([
        "a.u is not recorded: add it to record.signals",
        "signals are recorded every 0.01 s: set record.interval to 0.0055 s or less",
        "only 4.005 s are in its time span, and 5 s are needed",
        "only 0.000 s are in its time span, and 5 s are needed",
        "m.y is not an acceleration: its unit is m",
    ]) {
        assert_eq!(point["warnings"], json!([text]));
        assert_eq!((&point["vertical"], &point["vibration_total"]), (&Value::Null, &Value::Null));
        let note =
            format!("ride quality is not judged at {}: {text}", point["name"].as_str().unwrap());
        assert!(ran.stderr().contains(&note), "{}", ran.stderr());
        assert!(bench.result("events.csv").contains(&note));
    }
    // what could be judged is
    assert!(points[0]["lateral"]["weighted_rms"].is_number());
    assert_eq!(points[0]["comfort"], json!([]));
}

/// A record interval that is too long for every point, or a run that is too short, is one note.
#[test]
fn issue_one_reason_for_many_points_is_one_note() {
    let points: Vec<Value> = (1..=8)
        .map(|k| json!({ "name": format!("seat {k}"), "vertical": "a.y", "lateral": "a.y" }))
        .collect();
    let bench = bench(&json!(points));
    for (change, reason) in [
        (["--record-interval", "0.1"], "signals are recorded every 0.1 s: set record.interval to"),
        (["--stop", "3"], "only 3.005 s are in its time span"),
    ] {
        let report = bench.run(&change).stderr();
        let notes: Vec<&str> = report.lines().filter(|it| it.contains("ride quality")).collect();
        let note = format!("note: ride quality is not judged at 8 points: {reason}");
        assert!(notes.len() == 1 && notes[0].starts_with(&note), "{notes:?}");
    }
}

#[test]
fn issue_points_that_make_no_sense_are_refused() {
    let point = |point: Value| bench(&json!([point]));
    let refused = |bench: Bench, text: &str| bench.run(&[]).fails(2, &[text]);
    refused(point(json!({ "name": "x" })), "ride_quality[0].vertical is missing");
    let backwards = json!({ "name": "x", "vertical": "a.y", "from": 3.0, "to": 1.0 });
    refused(point(backwards), "ride_quality[0].from is 3");
    refused(point(json!({ "name": "x", "vertical": "a.y", "too": 1.0 })), "unknown field `too`");
}
