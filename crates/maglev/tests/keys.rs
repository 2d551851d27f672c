//! Inputs over time, events, stop conditions, objectives and limits in every way of running.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;
use std::time::Duration;

use serde_json::{Value, json};
use support::{Bench, with_states};

/// A scenario with all keys: y of `d` is the integral of an input that steps from 1 to 3 at 0.5 s. It passes 1 at 2/3 s,
/// which makes z = gain · u of `d` six, and 2.03 at 1.01 s, which ends the run. `b` follows `d`.
fn story() -> Value {
    json!({
        "units": { "unit": "unit.fmu" },
        "instances": { "b": { "unit": "unit" }, "d": { "unit": "unit", "input_derivatives": 3 } },
        "connections": [{ "from": "d.y", "to": "b.u" }],
        "inputs": [{ "to": "d.u", "signal": { "type": "step", "time": 0.5, "before": 1, "after": 3 } }],
        "events": [
            { "name": "faster", "when": { "signal": "d.y", "rising": 1.0 }, "set": { "d.gain": 2.0 } },
            { "name": "planned", "at": 0.85, "set": { "b.gain": 4.0 } },
        ],
        "stop_when": [{ "name": "far", "when": { "signal": "d.y", "above": 2.03 } }],
        "objectives": { "way": { "signal": "d.y", "figure": "final" } },
        "limits": {
            "rate": { "signal": "d.z", "figure": "max", "max": 7.0, "source": "our choice" },
            "follower": { "signal": "b.y", "figure": "max", "min": 0.5, "source": "our choice" },
        },
        "experiment": { "stop": 2.0, "step": 0.1 },
        "record": { "signals": ["d.z"] },
    })
}

/// A way of running: its name, members that the scenario gets, options, and whether steps can be divided.
type Way = (&'static str, Value, &'static [&'static str], bool);

fn ways() -> Vec<Way> {
    let b = |key: &str, value: u32| json!({ "instances": { "b": { "unit": "unit", key: value } } });
    vec![
        ("plain", json!({}), &[], true),
        ("isolated", json!({}), &["--isolate"], true),
        ("threads", json!({}), &["--threads", "2"], true),
        ("variable", json!({ "algorithm": { "variable": { "tolerance": 1e-6 } } }), &[], true),
        ("iterated", json!({}), &["--algorithm", "iterated"], true),
        ("newton", json!({}), &["--algorithm", "newton"], true),
        ("steps", b("steps", 3), &[], true),
        ("every", b("every", 2), &[], false),
        ("set", json!({}), &["--set", "b.fail_time=9", "--set", "d.gain=1.5"], true),
        ("parquet", json!({}), &["--format", "parquet,csv"], true),
    ]
}

fn bench((_, members, ..): &Way) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    let mut scenario = story();
    for (key, value) in members.as_object().unwrap() {
        match (key.as_str(), value) {
            ("instances", Value::Object(changed)) => {
                changed.iter().for_each(|(name, it)| scenario[key][name] = it.clone());
            }
            _ => scenario[key] = value.clone(),
        }
    }
    bench.scenario(&scenario);
    bench
}

/// Each key does its work, and shows in the report and in the verdict.
#[test]
fn analytic_all_keys_work_in_every_way_of_running() {
    for way in ways() {
        let bench = bench(&way);
        let (name, _, options, divides) = way;
        let ran = bench.run(options);
        ran.succeeds();
        let summary = bench.summary();
        assert_eq!(summary["status"], "stopped", "{name}");
        assert_eq!(summary["events"]["event"], 2, "{name}");
        // the next communication point, at which the slow unit need not be
        let end = if divides { 1.01 } else { 1.1 };
        let reached = summary["reached"].as_f64().unwrap();
        assert!((reached - end).abs() < 1e-5, "{name}: {reached}");
        let events = bench.result("events.csv");
        for part in [
            "faster: d.gain = 2 (d.y has risen above 1 m",
            "planned: b.gain = 4",
            "far: d.y is above",
        ] {
            assert_eq!(events.matches(part).count(), 1, "{name}: {part}\n{events}");
        }
        let metrics: Value = serde_json::from_str(&bench.result("metrics.json")).unwrap();
        let metric = |key: &str| metrics[key].as_f64().unwrap();
        assert!((metric("way") - (0.5 + 3.0 * (end - 0.5))).abs() < 1e-4, "{name}: {metrics}");
        assert!((metric("rate") - 6.0).abs() < 1e-9, "{name}: {metrics}");
        assert!(ran.stdout().contains("our choice"), "{name}: {}", ran.stdout());
        bench.maglev(&["check", "out"]).succeeds();
        bench.maglev(&["report", "out"]).succeeds();
        let report = bench.result("report.html");
        for part in ["planned", "far: d.y is above", "follower"] {
            assert!(report.contains(part), "{name}: {part}");
        }
    }
}

/// Starts a run that takes a second or more, and kills it after its first checkpoints.
fn killed(bench: &Bench, options: &[&str]) {
    let mut arguments = vec!["run", "scenario.json", "--out", "part", "--quiet", "--no-report"];
    arguments.extend(["--checkpoint-every", "0.2", "--real-time", "0.8"]);
    arguments.extend(options);
    let mut child = bench.start(&arguments);
    let file = bench.path("part/checkpoint.bin");
    let written = || fs::metadata(&file).and_then(|it| it.modified()).ok();
    let (mut first, mut changes) = (None, 0);
    while changes < 4 && child.try_wait().unwrap().is_none() {
        let now = written();
        changes += u32::from(now.is_some() && now != first);
        first = now.or(first);
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(file.exists(), "the run was not killed in time");
}

/// A run that is killed and resumed has the results of one that is not.
#[test]
fn invariant_all_keys_survive_a_resume_in_every_way_of_running() {
    for way in ways() {
        let bench = bench(&way);
        let (name, _, options, _) = way;
        let mut whole = vec!["--quiet", "--no-report", "--checkpoint-every", "0.2"];
        whole.extend(options);
        bench.run(&whole).succeeds();
        killed(&bench, options);
        bench.maglev(&["resume", "part", "--quiet"]).succeeds();
        let part = |file: &str| fs::read_to_string(bench.path("part").join(file)).unwrap();
        assert!(part("results.csv") == bench.result("results.csv"), "{name}");
        assert!(part("metrics.json") == bench.result("metrics.json"), "{name}");
        assert_eq!(part("events.csv").matches(",event,").count(), 2, "{name}");
    }
}

/// A file of an input that is not what it was when the run began.
#[test]
fn refusal_a_changed_input_file_cannot_be_resumed() {
    let mut scenario = story();
    scenario["inputs"] =
        json!([{ "to": "d.u", "signal": { "type": "csv", "file": "u.csv", "column": "u" } }]);
    let bench = bench(&("csv", json!({}), &[], true));
    bench.scenario(&scenario);
    fs::write(bench.path("u.csv"), "time,u\n0,1\n0.5,1\n0.6,3\n").unwrap();
    killed(&bench, &[]);
    fs::write(bench.path("u.csv"), "time,u\n0,1\n0.5,1\n0.6,4\n").unwrap();
    let texts = ["files with signals of inputs", "changed since the run began"];
    bench.maglev(&["resume", "part"]).fails(2, &texts);
    fs::write(bench.path("u.csv"), "time,u\n0,1\n0.5,1\n0.6,3\n").unwrap();
    bench.maglev(&["resume", "part", "--quiet"]).succeeds();
}
