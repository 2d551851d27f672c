//! Results: formats, intervals of single signals, events, statistics of instances, real time.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::json;
use support::{Bench, ring, with_states};

/// A value stands in a row where its signal is due, once; the row is there where any signal is due.
#[test]
fn analytic_signals_have_intervals_of_their_own() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0 });
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    scenario["record"] = json!({
        "interval": 0.2,
        "signals": [{ "signals": ["b.y", "b.u"], "interval": 0.5 }, "a.y", "b.*"],
        "format": ["csv", "parquet"]
    });
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    let csv = bench.result("results.csv");
    let mut lines = csv.lines();
    let header = lines.next().unwrap();
    assert!(header.starts_with("time,b.y,b.u,a.y,b.z,b.fail_time,"), "{header}");
    let times: Vec<f64> =
        lines.clone().map(|l| l.split(',').next().unwrap().parse().unwrap()).collect();
    let due = [0, 2, 4, 5, 6, 8, 10].map(|n| f64::from(n) * 0.1);
    assert_eq!(times, due);
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let n = (fields[0].parse::<f64>().unwrap() / 0.1).round() as i32;
        assert_eq!(fields[1].is_empty(), n % 5 != 0, "{line}");
        assert_eq!(fields[3].is_empty(), n % 2 != 0, "{line}");
    }
    // statistics know every point, whatever is written
    assert_eq!(bench.summary()["signals"]["b.y"]["points"], 11);
    assert!(bench.path("out/results.parquet").exists());
    scenario["record"]["signals"][0]["interval"] = json!(0.25);
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["record.signals[0].interval is 0.25 s, which is not a multiple"]);
}

#[test]
fn issue_only_the_formats_asked_for_are_left() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let there = |name: &str| bench.path("out").join(name).exists();
    bench.run(&["--format", "parquet"]).succeeds();
    assert!(there("results.parquet") && !there("results.csv"));
    assert_eq!(bench.summary()["tables"], json!(["results.parquet"]));
    let ran = bench.run(&["--format", "csv,parquet"]);
    ran.succeeds();
    assert!(ran.stdout().contains("results.parquet") && there("results.csv"));
    bench.run(&["--format", "hdf5"]).fails(2, &["invalid value 'hdf5'"]);
}

/// Every warning is logged at the end of the step that it arrived in; a unit that only returns
/// fmi2Warning is told once.
#[test]
fn issue_events_have_simulated_times() {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench.run(&["--set", "b.fault=2", "--set", "b.fail_time=0.65"]).succeeds();
    let log = bench.result("events.csv");
    let mut lines = log.lines();
    assert_eq!(lines.next(), Some("time,kind,instance,text"));
    let warnings: Vec<&str> = lines.filter(|line| line.contains(",warning,b,")).collect();
    let times: Vec<&str> = warnings.iter().map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(times, ["0.7000000000000001", "0.7000000000000001", "0.8", "0.9", "1.0"], "{log}");
    assert!(warnings[0].contains("first in the step from 0.6000000000000001 s"), "{log}");
    assert!(warnings[1].contains("u is odd at 100 #"), "{log}");
    let summary = bench.summary();
    assert_eq!(summary["events"]["warning"], 5);
    assert_eq!(summary["messages"][0]["time"], 0.700_000_000_000_000_1);
    let ran = bench.run(&["--set", "b.fault=4", "--set", "b.fail_time=0.65"]);
    ran.fails(1, &["the model broke"]);
    let log = bench.result("events.csv");
    assert!(log.lines().last().unwrap().starts_with("0.6000000000000001,failed,,"), "{log}");
}

#[test]
fn issue_instances_have_statistics_of_their_own() {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench.run(&[]).succeeds();
    let summary = bench.summary();
    for name in ["a", "b"] {
        let instance = &summary["instances"][name];
        assert_eq!((&instance["unit"], &instance["steps"]), (&json!("unit"), &json!(10)));
        assert!(instance["step_seconds"].is_number() && instance["exchange_seconds"].is_number());
    }
}

/// A unit that refuses steps above 0.03 s makes those of 0.1 s in four parts, after two refusals.
#[test]
fn issue_discarded_steps_are_counted_and_logged() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &["-DLARGEST_STEP=0.03"]);
    bench.scenario(&ring());
    bench.run(&[]).succeeds();
    let summary = bench.summary();
    for name in ["a", "b"] {
        let instance = &summary["instances"][name];
        assert_eq!((&instance["steps"], &instance["discarded_steps"]), (&json!(40), &json!(10)));
    }
    assert_eq!(summary["events"]["retry"], 20);
    let log = bench.result("events.csv");
    let of_b: Vec<&str> = log.lines().filter(|line| line.contains(",retry,b,")).collect();
    assert!(of_b.len() == 10 && of_b[3].starts_with("0.30000000000000004,retry,b,"), "{log}");
    assert!(of_b[3].contains("made in 4 parts"), "{log}");
}

/// Steps of variable size that are taken back are logged at the communication point that they led to.
#[test]
fn issue_rejected_steps_are_logged() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "y": 1.0 });
    scenario["algorithm"] = json!({ "variable": { "tolerance": 1e-9 } });
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    let rejected = bench.summary()["algorithm"]["steps"]["rejected"].as_u64().unwrap();
    let log = bench.result("events.csv");
    let counts = log.lines().filter(|line| line.contains(",rejected,,"));
    let counts = counts.map(|line| line.split([',', ' ']).nth(3).unwrap().parse::<u64>().unwrap());
    assert!(rejected > 0 && counts.sum::<u64>() == rejected, "{rejected} {log}");
}

/// A run cannot be faster than its clock: 1 s at ten times real time takes 0.1 s or more.
#[test]
fn invariant_real_time_is_a_lower_bound() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let ran = bench.run(&["--real-time", "10"]);
    ran.succeeds();
    assert!(ran.stdout().contains("late for 10 times real time"), "{}", ran.stdout());
    let summary = bench.summary();
    assert!(summary["wall_time"]["run_seconds"].as_f64().unwrap() >= 0.1);
    let real_time = &summary["real_time"];
    assert_eq!((&real_time["factor"], &real_time["steps"]), (&json!(10.0), &json!(10)));
    let classes = real_time["distribution"].as_array().unwrap();
    let sum: u64 = classes.iter().map(|class| class["count"].as_u64().unwrap()).sum();
    assert_eq!(real_time["overruns"], sum);
    assert_eq!(summary["events"]["overrun"].as_u64().unwrap_or(0), sum);
    bench.run(&["--real-time", "0"]).fails(2, &["real_time is 0"]);
}
