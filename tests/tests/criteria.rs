//! `maglev check` on the real units: spans, frequencies, and the sentence on a girder that is too soft.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests

use serde_json::{Value, json};
use system_tests::{FinishedRun, scenario, start};

/// The verdicts on a run by criteria, by their names, and the exit status.
fn check(run: &FinishedRun, criteria: &str) -> (Value, i32) {
    let folder = run.folder().to_str().unwrap();
    let done = start(&["check", folder, "--json", "--criteria", criteria]).unwrap();
    let verdicts: Vec<Value> = serde_json::from_slice(&done.stdout).unwrap();
    let named = verdicts[0]["criteria"].as_array().unwrap().iter();
    let named = named.map(|it| (it["name"].as_str().unwrap().to_owned(), it.clone()));
    (Value::Object(named.collect()), done.status.code().unwrap())
}

/// A girder of 1/25 of the stiffness, under one bogie.
#[test]
fn issue_a_girder_that_is_too_soft_is_named_with_place_and_time() {
    let soft = ["--stop", "8", "--set", "guideway.stiffness_factor=0.04"];
    let run = FinishedRun::of(&scenario("one-bogie.json"), &soft).unwrap();
    let (verdicts, status) = check(&run, "cjj-t-262,frequency");
    assert_eq!(status, 1);
    let it = &verdicts["deflection_over_span"];
    let lowest = run.statistic("guideway.midspan_displacement_01", "min").unwrap();
    assert_eq!(it["value"].as_f64().unwrap(), lowest.abs() / 25.0);
    assert_eq!(
        it["time"],
        run.statistic("guideway.midspan_displacement_01", "time_of_min").unwrap()
    );
    assert!(it["beyond_since"].as_f64().unwrap() < it["time"].as_f64().unwrap());
    assert_eq!(it["outcome"], "failed");
    let frequency = verdicts["frequency_times_span_over_speed"]["value"].as_f64().unwrap();
    // 7.1 Hz by √0.04, 25 m, 5 km/h
    assert!((frequency - 7.1 * 0.2 * 25.0 / (5.0 / 3.6)).abs() < 1e-9, "{frequency}");

    let folder = run.folder().to_str().unwrap();
    let done = start(&["check", folder, "--criteria", "cjj-t-262"]).unwrap();
    let text = String::from_utf8(done.stdout).unwrap();
    let place = "at guideway.midspan_displacement_01 (middle of span 1, x = 12.5 m, L = 25 m), at ";
    assert!(text.contains(place) && text.contains(" for the first time at "), "{text}");
}

/// The middle of a girder over two fields is its pier: it says nothing about the deflection of a field.
#[test]
fn issue_the_middle_of_a_continuous_girder_is_not_judged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two-fields.json");
    let guideway = json!({
        "fmu": scenario("../target/fmu/guideway-one-bogie.fmu"),
        "resources": { "guideway.json": {
            "girders": { "table_3": null, "two": {
                "length": 50, "mass_per_length": 2780.8, "bending_stiffness": 2.2e10, "damping": [0.01],
                "supports": [{ "x": 0 }, { "x": 25 }, { "x": 50 }]
            } },
            "spans": [{ "girder": "two" }],
            "points": [{ "name": "second_field", "span": 1, "x": 35 }]
        } }
    });
    let text = json!({ "extends": scenario("one-bogie.json"), "units": { "guideway": guideway } });
    std::fs::write(&path, text.to_string()).unwrap();
    let criteria = folder.path().join("mine.json");
    let mine = json!({ "criteria": {
        "pier": { "signal": "guideway.midspan_displacement_01", "figure": "max_abs", "over": "span_length",
                  "max": "1/3800", "source": "a test" },
        "field": { "signal": "guideway.second_field_displacement", "figure": "max_abs", "over": "span_length",
                   "max": "1/3800", "source": "a test" },
        "frequency": { "quantity": "frequency_times_span", "min": 1, "source": "a test" }
    } });
    std::fs::write(&criteria, mine.to_string()).unwrap();
    let record = r#"{ "extends": "two-fields.json", "record": { "signals": [
        "guideway.midspan_displacement_01", "guideway.second_field_displacement"] } }"#;
    let recorded = folder.path().join("recorded.json");
    std::fs::write(&recorded, record).unwrap();
    let run = FinishedRun::of(&recorded, &["--stop", "0.5"]).unwrap();
    let (verdicts, status) = check(&run, criteria.to_str().unwrap());
    assert_eq!(status, 1);
    assert_eq!(verdicts["pier"]["outcome"], "not_judged");
    assert!(verdicts["pier"]["reason"].as_str().unwrap().contains("over a support"), "{verdicts}");
    assert_eq!(verdicts["field"]["outcome"], "passed");
    let detail = "point second_field of span 1, x = 35 m, L = 25 m";
    assert_eq!(verdicts["field"]["detail"], detail);
    assert!(verdicts["frequency"]["detail"].as_str().unwrap().ends_with("L = 25 m"), "{verdicts}");
    // two equal fields swing as one of them: f₁ L = π/(2 L) √(EI/m)
    let expected = std::f64::consts::PI / 50.0 * (2.2e10_f64 / 2780.8).sqrt();
    let product = verdicts["frequency"]["value"].as_f64().unwrap();
    // beam elements are stiffer by less than 1e-5
    assert!((product / expected - 1.0).abs() < 1e-5, "{product} instead of {expected}");
}
