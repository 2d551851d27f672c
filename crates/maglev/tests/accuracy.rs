//! Step and algorithm by the accuracy that a scenario asks for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::json;
use support::{Bench, bench_of, last, oscillator, with_states};

/// a = cos t and b = sin t: the run keeps the accuracy that was chosen from it, says so, and the scenario that
/// ran gives the same bytes.
#[test]
fn analytic_the_chosen_step_has_the_accuracy() {
    let mut scenario = oscillator(0.01);
    scenario["record"]["interval"] = json!(0.5);
    scenario["record"]["signals"] = json!(["a.y", "b.y"]);
    for accuracy in [1e-3, 1e-6] {
        scenario["accuracy"] = json!(accuracy);
        let bench = bench_of(&scenario);
        bench.run(&[]).succeeds();
        let summary = bench.summary();
        let report = &summary["algorithm"]["accuracy"];
        assert_eq!(report["wanted"], accuracy);
        let estimate = report["estimate"].as_f64().unwrap();
        assert!(estimate <= accuracy && report["over"] == 2.0, "{report}");
        let text = report["explanation"].as_str().unwrap();
        assert!(text.contains("estimated") && text.contains("over the first 2 s only"), "{text}");
        // the last trial of the algorithm is what was chosen, and the one before was not good enough
        let trials = report["trials"].as_array().unwrap();
        let (name, step) = (&summary["algorithm"]["name"], &summary["step"]);
        let own: Vec<_> = trials
            .iter()
            .filter(|it| it["algorithm"].as_str().unwrap().starts_with(name.as_str().unwrap()))
            .collect();
        assert_eq!(own.last().unwrap()["step"], *step);
        for trial in &own[..own.len() - 1] {
            assert!(trial["error"].as_f64().unwrap() > accuracy, "{trial}");
        }
        // at t = 2; the deviations from the mean are about 0.7 and 0.35
        let row = last(&bench);
        let error = f64::max((row[1] - 2.0_f64.cos()).abs(), (row[2] - 2.0_f64.sin()).abs());
        assert!(error < 3.0 * accuracy, "{error:e} at {accuracy:e}: {report}");
        let (results, as_run) = (bench.result("results.csv"), bench.result("scenario-as-run.json"));
        assert!(!as_run.contains("accuracy"), "{as_run}");
        bench.scenario(&serde_json::from_str(&as_run).unwrap());
        bench.run(&["--quiet"]).succeeds();
        assert_eq!(bench.result("results.csv"), results);
        assert!(bench.summary()["algorithm"].get("accuracy").is_none());
    }
}

/// Without saved states nothing can be iterated. That is said.
#[test]
fn invariant_units_without_saved_states_are_named() {
    let mut scenario = oscillator(0.01);
    scenario["accuracy"] = json!(1e-3);
    let bench = Bench::new();
    let stateless =
        with_states().replace("canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"", "");
    bench.unit("unit.fmu", &stateless, &[]);
    bench.scenario(&scenario);
    bench.run(&["--quiet"]).succeeds();
    let summary = bench.summary();
    let text = summary["algorithm"]["accuracy"]["explanation"].as_str().unwrap().to_owned();
    assert!(text.contains("iterated was not tried: a cannot save its state"), "{text}");
    assert_eq!(summary["algorithm"]["name"], "gauss-seidel");
}

#[test]
fn refusal_what_cannot_be_chosen_is_said() {
    let mut scenario = oscillator(0.01);
    scenario["accuracy"] = json!(2.0);
    let bench = bench_of(&scenario);
    bench.run(&[]).fails(2, &["accuracy is 2", "between 0 and 1"]);
    scenario["accuracy"] = json!(1e-15);
    bench.scenario(&scenario);
    bench
        .run(&[])
        .fails(1, &["no step gives the accuracy", "the best estimate is", "larger accuracy"]);
    scenario["accuracy"] = json!(1e-3);
    scenario["algorithm"] = json!({ "variable": { "tolerance": 1e-4 } });
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["algorithm.variable chooses the steps already"]);
    scenario["algorithm"] = json!({});
    scenario["record"]["signals"] = json!([]);
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["no signals are recorded"]);
    let scenario = scenario.as_object_mut().unwrap();
    scenario.remove("accuracy");
    scenario.insert("accuracy_over".to_owned(), json!(1.0));
    bench.scenario(&json!(scenario));
    bench.run(&[]).fails(2, &["accuracy_over", "only together with accuracy"]);
}
