//! Step and algorithm by the accuracy that a scenario asks for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use maglev::run::{Job, Observer, Unobserved, resume};
use results::summary::Status;
use scenario::{Checkpoints, Scenario};
use serde_json::{Value, json};
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

/// The summary of a run that was interrupted says how its step was chosen, and the resumed run makes the same rows.
#[test]
fn issue_21_a_resumed_run_says_how_its_step_was_chosen() {
    /// Ends the run after its first step, but lets the step be chosen.
    #[derive(Default)]
    struct Impatient {
        begun: bool,
    }
    impl Observer for Impatient {
        fn begin(&mut self, _: u64) {
            self.begun = true;
        }
        fn interrupted(&self) -> bool {
            self.begun
        }
    }
    let mut json = oscillator(0.01);
    json["accuracy"] = json!(1e-4);
    let bench = bench_of(&json);
    let mut scenario = Scenario::load(&bench.path("scenario.json")).unwrap();
    scenario.checkpoint = Some(Checkpoints { every: 1.0 });
    let folder = bench.path("out");
    let job = Job { scenario: &scenario, name: "scenario", folder: &folder };
    let first = job.run(&mut Impatient::default()).unwrap();
    let second = resume(&folder, &mut Impatient::default()).unwrap();
    let last = resume(&folder, &mut Unobserved).unwrap();
    assert_eq!((second.status, last.status), (Status::Interrupted, Status::Finished));
    let report = first.algorithm.accuracy.unwrap();
    assert!(report.wanted == 1e-4 && !report.trials.is_empty());
    assert_eq!(second.algorithm.accuracy.unwrap(), report);
    assert_eq!(last.algorithm.accuracy.unwrap(), report);
    assert_eq!(bench.summary()["algorithm"]["accuracy"]["wanted"], 1e-4);
    assert_eq!((last.step, last.algorithm.name), (first.step, first.algorithm.name));
}

/// A study of the oscillator's stiffness and first value.
fn study() -> Value {
    json!({
        "scenario": "scenario.json",
        "factors": {
            "stiffness": { "target": "c.gain", "values": [-1, -4, -9] },
            "start": { "target": "a.y", "values": [1, 2] }
        },
        "objectives": { "last": { "signal": "a.y", "figure": "final" } }
    })
}

fn study_bench(study: &Value) -> Bench {
    let mut scenario = oscillator(0.01);
    scenario["accuracy"] = json!(1e-4);
    scenario["record"]["signals"] = json!(["a.y", "b.y"]);
    let bench = bench_of(&scenario);
    fs::write(bench.path("study.json"), study.to_string()).unwrap();
    bench
}

fn as_run(bench: &Bench, folder: &str) -> Value {
    let text = fs::read_to_string(bench.path(folder).join("study.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["as_run"].clone()
}

/// One step for all points, the smallest that one of those tried needs; the same bytes for any number of processes, for
/// points that are computed apart, and when the study continues.
#[test]
fn issue_21_a_study_has_one_step_for_all_points() {
    let mut study = study();
    study["keep"] = json!({ "runs": "all" });
    let bench = study_bench(&study);
    let order = ["study", "run", "study.json", "--workers"];
    let ran = bench.maglev(&[&order[..], &["1", "--out", "one"]].concat());
    ran.succeeds();
    let told = ran.stderr();
    assert!(told.contains("point 1: accuracy: gauss-seidel, "), "{told}");
    assert!(
        told.contains("note: accuracy: One step for all points; tried at points 1, 3, 6 only"),
        "{told}"
    );
    let found = as_run(&bench, "one");
    let step = found["chosen"]["step"].as_f64().unwrap();
    let report = &found["chosen"]["accuracy"];
    // that of a stiffer point than the first
    let text = report["explanation"].as_str().unwrap();
    assert!(
        !text.contains("that of point 1.") && text.contains("no other one was tried"),
        "{text}"
    );
    assert!(report["wanted"] == 1e-4 && report["estimate"].as_f64().unwrap() <= 1e-4, "{report}");
    assert!(report["trials"].as_array().unwrap().iter().all(|it| it.get("cost").is_none()));
    for entry in fs::read_dir(bench.path("one/runs")).unwrap() {
        let text = fs::read_to_string(entry.unwrap().path().join("summary.json")).unwrap();
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["step"], step);
    }
    // y = s cos(2 w), w² the stiffness
    let text = fs::read_to_string(bench.path("one/metrics.csv")).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let [stiffness, start, last] = ["stiffness", "start", "last"]
            .map(|name| head.iter().position(|it| *it == name).unwrap())
            .map(|k| cells[k].parse::<f64>().unwrap());
        let error = (last - start * (2.0 * (-stiffness).sqrt()).cos()).abs();
        assert!(error < 1e-3 * start, "{line}: {error:e}");
    }
    bench.maglev(&[&order[..], &["3", "--quiet", "--out", "three"]].concat()).succeeds();
    let metrics =
        |folder: &str| fs::read_to_string(bench.path(folder).join("metrics.csv")).unwrap();
    assert_eq!(metrics("three"), text);
    assert_eq!(as_run(&bench, "three")["chosen"], found["chosen"]);
    for points in ["1..2", "3..6"] {
        bench
            .maglev(&[&order[..], &["1", "--quiet", "--points", points, "--out", "apart"]].concat())
            .succeeds();
    }
    bench.maglev(&["study", "merge", "apart"]).succeeds();
    assert_eq!(metrics("apart"), text);
    assert_eq!(as_run(&bench, "apart")["chosen"], found["chosen"]);
    // it continues with the step that it has
    let ran = bench.maglev(&[&order[..], &["1", "--out", "one"]].concat());
    ran.succeeds();
    assert!(!ran.stderr().contains("against half of it"), "{}", ran.stderr());
    bench.maglev(&["study", "report", "one", "--out", "report.html"]).succeeds();
    assert!(
        fs::read_to_string(bench.path("report.html")).unwrap().contains("One step for all points")
    );
}

#[test]
fn refusal_of_a_study_that_varies_what_is_chosen() {
    for key in ["experiment.step", "algorithm.extrapolation", "accuracy", "record.interval"] {
        let mut study = study();
        study["factors"]["start"] = json!({ "target": { "key": key }, "values": [1] });
        let bench = study_bench(&study);
        let named = format!("factors.start.target: \"{}\"", key.split('.').next().unwrap());
        bench
            .maglev(&["study", "run", "study.json"])
            .fails(2, &[named.trim_end_matches('"'), "cannot be a factor", "remove the factor"]);
    }
    // no point has that accuracy
    let bench = study_bench(&study());
    let mut scenario = oscillator(0.01);
    scenario["accuracy"] = json!(1e-15);
    bench.scenario(&scenario);
    bench.maglev(&["study", "run", "study.json", "--quiet"]).fails(
        1,
        &[
            "cannot choose the step of all points at point 1",
            "no step gives the accuracy",
            "larger accuracy",
        ],
    );
}

/// A fit has one step for all its runs, and says which.
#[test]
fn issue_21_a_fit_chooses_its_step_once() {
    let mut scenario = oscillator(0.01);
    scenario["accuracy"] = json!(1e-5);
    scenario["record"]["signals"] = json!(["a.y", "b.y"]);
    let bench = bench_of(&scenario);
    let rows = (0..=20).map(|k| f64::from(k) * 0.1).map(|t| format!("{t},{}\n", (1.5 * t).cos()));
    fs::write(bench.path("record.csv"), format!("time,y\n{}", rows.collect::<String>())).unwrap();
    let ran = bench.maglev(&[
        "fit",
        "scenario.json",
        "--measured",
        "record.csv",
        "--map",
        "y=a.y",
        "--vary",
        "c.gain=-4:-1",
        "--out",
        "fit",
    ]);
    ran.succeeds();
    assert!(ran.stderr().contains("note: accuracy: gauss-seidel, steps of "), "{}", ran.stderr());
    let found: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("fit/fit.json")).unwrap()).unwrap();
    let gain = found["parameters"][0]["value"].as_f64().unwrap();
    assert!((gain + 2.25).abs() < 1e-3, "{gain}");
}
