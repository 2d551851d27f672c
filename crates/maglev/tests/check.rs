//! Figures and limits of runs: metrics.json, the table at the end of a run, and `maglev check`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use maglev::run::{Job, Observer, Unobserved, resume};
use scenario::{Checkpoints, Scenario};
use serde_json::{Value, json};
use support::{Bench, with_states};

/// Ramps a.y = t and b.y = 2 t, of which only the first is named under record.
fn ramps() -> Value {
    json!({
        "units": { "unit": "unit.fmu" },
        "instances": {
            "a": { "unit": "unit", "start": { "u": 1.0 } },
            "b": { "unit": "unit", "start": { "u": 2.0 } }
        },
        "experiment": { "stop": 1.0, "step": 0.125 },
        "record": { "signals": ["a.y"] },
        "objectives": {
            "mean": { "signal": "a.y", "figure": "mean" },
            "late mean": { "signal": "b.y", "figure": "mean", "from": 0.5 },
            "settling": { "signal": "a.y", "figure": "settling_time", "band": 0.3 }
        },
        "limits": {
            "top": {
                "title": "largest y", "signal": "*.y", "figure": "max", "max": 1.5, "source": "a test"
            },
            "median": { "signal": "a.y", "figure": "percentile", "percentile": 50, "min": 0.25 }
        }
    })
}

fn bench(scenario: &Value) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    bench.scenario(scenario);
    bench
}

fn metrics(bench: &Bench) -> Value {
    serde_json::from_str(&bench.result("metrics.json")).unwrap()
}

/// All times are multiples of 1/8, so that the figures are exact.
#[test]
fn analytic_a_run_leaves_its_figures() {
    let bench = bench(&ramps());
    let ran = bench.run(&["--no-report"]);
    ran.succeeds();
    let expected =
        json!({ "mean": 0.5, "late mean": 1.5, "settling": 0.75, "top": 2.0, "median": 0.5 });
    assert_eq!(metrics(&bench), expected);
    // b.y is recorded for its figure
    assert!(bench.result("results.csv").starts_with("time,a.y,b.y\n"));
    let top = &bench.summary()["metrics"][3];
    assert_eq!((&top["outcome"], &top["place"]), (&json!("failed"), &json!("b.y")));
    assert_eq!((&top["time"], &top["beyond_since"]), (&json!(1.0), &json!(0.875)));
    assert_eq!((&top["judged"], &top["failing"]), (&json!(2), &json!(1)));
    let shown = ran.stdout();
    for text in [
        "largest y: 2 m at b.y, at 1 s, is above the limit of 1.5 m, for the first time at 0.875 s; 1 of 2 fail",
        "FAILED",
        "out/metrics.json",
    ] {
        assert!(shown.contains(text), "{shown}");
    }
    // a run without figures has no such file
    let mut plain = ramps();
    for key in ["objectives", "limits"] {
        plain.as_object_mut().unwrap().remove(key).unwrap();
    }
    bench.scenario(&plain);
    bench.run(&["--no-report"]).succeeds();
    assert!(!bench.path("out/metrics.json").exists());
    assert!(bench.summary().get("metrics").is_none());
}

/// The same numbers come from text and Parquet, from an isolated unit, and after a change by `--set`.
#[test]
fn invariant_check_gives_the_numbers_of_the_run() {
    let bench = bench(&ramps());
    for options in [
        &["--format", "csv"][..],
        &["--format", "parquet"],
        &["--isolate"],
        &["--set", "b.u=1.25", "--set", "a.u=0.1"],
    ] {
        bench.run(&[&["--no-report"], options].concat()).succeeds();
        let checked = bench.maglev(&["check", "out", "--json"]);
        let verdicts: Value = serde_json::from_str(&checked.stdout()).unwrap();
        let criteria = verdicts[0]["criteria"].as_array().unwrap();
        let names = criteria
            .iter()
            .map(|it| (it["name"].as_str().unwrap().to_owned(), it["value"].clone()));
        assert_eq!(metrics(&bench), Value::Object(names.collect()), "{options:?}");
        assert_eq!(verdicts[0]["criteria"], bench.summary()["metrics"], "{options:?}");
        assert_eq!(checked.status(), 1, "{options:?}");
    }
}

/// Steps of 1/128 to 1/8, at whose ends the ramps are exact.
#[test]
fn analytic_variable_steps_give_the_same_figures() {
    let mut scenario = ramps();
    scenario["algorithm"] = json!({ "variable": { "tolerance": 1e-9, "min_step": 0.0078125 } });
    let bench = bench(&scenario);
    bench.run(&["--no-report"]).succeeds();
    let metrics = metrics(&bench);
    for (name, expected) in [("mean", 0.5), ("late mean", 1.5), ("top", 2.0), ("median", 0.5)] {
        let value = metrics[name].as_f64().unwrap();
        assert!((value - expected).abs() < 1e-12, "{name}: {value}");
    }
}

#[test]
fn invariant_a_resumed_run_has_the_same_figures() {
    struct Impatient;
    impl Observer for Impatient {
        fn interrupted(&self) -> bool {
            true
        }
    }
    let bench = bench(&ramps());
    let mut scenario = Scenario::load(&bench.path("scenario.json")).unwrap();
    let run = |scenario: &Scenario, folder: &str, observer: &mut dyn Observer| {
        let folder = bench.path(folder);
        Job { scenario, name: "scenario", folder: &folder }.run(observer).unwrap();
        fs::read_to_string(folder.join("metrics.json")).unwrap()
    };
    let whole = run(&scenario, "whole", &mut Unobserved);
    scenario.checkpoint = Some(Checkpoints { every: 0.5 });
    let short = run(&scenario, "out", &mut Impatient);
    assert_ne!(short, whole);
    // what is there of an interrupted run does not pass
    let checked = bench.maglev(&["check", "out"]);
    assert_eq!(checked.status(), 1);
    assert!(
        checked.stdout().contains("the run was interrupted at 0.125 s"),
        "{}",
        checked.stdout()
    );
    resume(&bench.path("out"), &mut Unobserved).unwrap();
    assert_eq!(bench.result("metrics.json"), whole);
}

#[test]
fn refusal_figures_that_do_not_fit_end_before_the_run() {
    let refused = |key: &str, metric: Value, texts: &[&str]| {
        let mut scenario = ramps();
        scenario[key] = json!({ "x": metric });
        let bench = bench(&scenario);
        bench.run(&[]).fails(2, texts);
        assert!(!bench.path("out").exists(), "{texts:?}");
    };
    let of = |signal: &str, figure: &str| json!({ "signal": signal, "figure": figure });
    refused("objectives", of("a.yy", "max"), &["objectives.x.signal", "did you mean"]);
    refused("objectives", of("c*.y", "max"), &["objectives.x.signal", "\"c*.y\" matches nothing"]);
    let mixed = ["objectives.x.signal", "\"*.*ai*\" mixes units of measure", "a.fail_time has s"];
    refused("objectives", of("*.*ai*", "max"), &mixed);
    refused("objectives", of("a.t", "max"), &["objectives.x.signal", "a.t"]);
    refused("objectives", of("a.y", "maxx"), &["objectives.x.figure", "maxx", "max"]);
    refused("limits", of("a.y", "max"), &["limits.x.max", "\"objectives\""]);
    let mut limit = of("a.y", "max");
    limit["max"] = json!("1/0");
    refused("limits", limit, &["limits.x.max", "1/3800"]);
}

#[test]
fn issue_runs_are_judged_by_files() {
    let bench = bench(&ramps());
    bench.run(&["--no-report"]).succeeds();
    bench
        .maglev(&["run", "scenario.json", "--set", "b.u=0.5", "--no-report", "--out", "low"])
        .succeeds();
    let file = |name: &str, criterion: &str, metric: Value| {
        let text = json!({ "criteria": { criterion: metric } }).to_string();
        fs::write(bench.path(name), text).unwrap();
    };
    let limit =
        |max: f64| json!({ "signal": "b.y", "figure": "max", "max": max, "source": "mine" });
    file("c.json", "top", limit(1.0));
    let check = |arguments: &[&str]| bench.maglev(&[&["check"], arguments].concat());
    let low = check(&["low", "--criteria", "c.json"]);
    low.succeeds();
    for text in ["0.5 m", "max 1 m", "50.0 %", "mine", "passed"] {
        let text = text.replace("0.5 m", "500 mm");
        assert!(low.stdout().contains(&text), "{text}: {}", low.stdout());
    }
    // one run that fails is enough
    let both = check(&["low", "out", "--criteria", "c.json", "--json"]);
    assert_eq!(both.status(), 1);
    let verdicts: Value = serde_json::from_str(&both.stdout()).unwrap();
    assert_eq!((&verdicts[0]["passed"], &verdicts[1]["passed"]), (&json!(true), &json!(false)));
    assert_eq!(verdicts[1]["criteria"][0]["relative_margin"], -1.0);
    // a figure that is missing does not pass, unless it is optional
    let mut other = json!({ "signal": "b.z", "figure": "max", "max": 1, "source": "mine" });
    file("d.json", "other", other.clone());
    let missing = check(&["low", "--criteria", "c.json,d.json"]);
    assert_eq!(missing.status(), 1);
    assert!(missing.stdout().contains("other is not judged: \"b.z\" is not recorded"));
    other["optional"] = json!(true);
    file("d.json", "other", other);
    check(&["low", "--criteria", "c.json,d.json"]).succeeds();
    file("e.json", "top", limit(2.0));
    check(&["low", "--criteria", "c.json,e.json"])
        .fails(2, &["top occurs in c.json and in e.json"]);
    check(&["low", "--criteria", "f.json"]).fails(2, &["f.json", "cjj-t-262"]);
    check(&["nowhere"]).fails(2, &["nowhere"]);
    // the shipped criteria are for trains on girders
    let shipped = check(&["low", "--criteria", "cjj-t-262"]);
    assert_eq!(shipped.status(), 1);
    assert!(shipped.stdout().contains("\"*.midspan_displacement_*\" is not recorded"));
    // the report has them too
    bench.maglev(&["report", "out", "--criteria", "c.json"]).succeeds();
    assert!(bench.result("report.html").contains("\"source\":\"mine\""));
}

#[test]
fn issue_a_run_that_failed_does_not_pass() {
    let bench = bench(&ramps());
    bench.run(&["--set", "a.fail_time=0.5", "--set", "a.fault=4", "--no-report"]).fails(1, &[]);
    assert!(!bench.path("out/metrics.json").exists());
    let checked = bench.maglev(&["check", "out"]);
    assert_eq!(checked.status(), 1);
    assert!(checked.stdout().contains("the run failed at"), "{}", checked.stdout());
}

/// `maglev run --criteria` records what criteria need, and judges by them; what is optional need not exist.
#[test]
fn issue_16_criteria_of_a_run_are_recorded_and_judged() {
    let bench = bench(&ramps());
    let file = json!({ "$comment": "two of our own", "criteria": {
        "rate": { "signal": "b.z", "figure": "max_abs", "max": 9, "source": "mine" },
        "none": {
            "signal": "*.no_such_signal", "figure": "max", "max": 9, "source": "mine", "optional": true
        },
    }});
    fs::write(bench.path("own.json"), file.to_string()).unwrap();
    bench.run(&["--quiet", "--no-report"]).succeeds();
    assert!(!bench.result("results.csv").lines().next().unwrap().contains("b.z"));
    let unrecorded = bench.maglev(&["check", "out", "--criteria", "own.json"]);
    assert_eq!(unrecorded.status(), 1);
    let hint = "`maglev run SCENARIO --criteria NAMES` records what criteria need";
    assert!(unrecorded.stdout().contains(hint), "{}", unrecorded.stdout());
    let ran = bench.run(&["--criteria", "own.json", "--no-report"]);
    ran.succeeds();
    assert!(ran.stdout().contains("rate"), "{}", ran.stdout());
    assert!(bench.result("results.csv").lines().next().unwrap().contains("b.z"));
    let judged = bench.maglev(&["check", "out", "--criteria", "own.json"]);
    judged.succeeds();
    assert!(judged.stdout().contains("mine"), "{}", judged.stdout());
    bench.run(&["--criteria", "nowhere.json"]).fails(2, &["cannot read the criteria nowhere.json"]);
}
