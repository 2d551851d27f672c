//! A results folder belongs to one run, at any moment.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]
#![cfg(unix)]

mod support;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use support::{Bench, ring, with_states};

/// A ring with pictures, of 4000 steps, so that a kill may come before, in and after them.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "y": 1.0 });
    scenario["experiment"]["step"] = json!(2.5e-4);
    bench.scenario(&scenario);
    scenario["plots"] = json!([{ "file": "p.svg", "panels": [{ "signals": ["a.y"] }] }]);
    scenario["record"]["format"] = json!(["csv", "parquet"]);
    fs::write(bench.path("drawn.json"), scenario.to_string()).unwrap();
    bench
}

fn json(path: &Path) -> Option<Value> {
    fs::read(path).ok().map(|text| serde_json::from_slice(&text).unwrap())
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// The run that a folder says to be of. Every file that carries a mark must carry this one.
#[track_caller]
fn run_of(folder: &Path) -> String {
    let run = text(&json(&folder.join("run-files.json")).unwrap()["run"]);
    assert_eq!(run.len(), 36);
    if let Some(summary) = json(&folder.join("summary.json")) {
        assert_eq!(text(&summary["run"]), run);
    }
    if let Some(scenario) = json(&folder.join("scenario-as-run.json")) {
        assert_eq!(text(&scenario["$comment"]), format!("run {run}"));
    }
    run
}

const DRAWN: [&str; 6] = ["run", "drawn.json", "--out", "out", "--checkpoint-every", "0.1"];

/// Kills a second run in a folder at moments from its start to its end: nothing of the first one is
/// beside anything of the second, and a report of what is there is one of one run.
#[test]
fn issue_a_killed_second_run_leaves_nothing_of_the_first() {
    let bench = bench();
    let out = bench.path("out");
    let second = ["run", "scenario.json", "--out", "out", "--set", "a.gain=2"];
    // the first run unpacks the units
    bench.maglev(&second).succeeds();
    let begin = Instant::now();
    bench.maglev(&second).succeeds();
    let whole = begin.elapsed().as_secs_f64();
    let (mut before, mut between, mut after) = (0, 0, 0);
    for k in 0..96 {
        // more moments where a busy machine left none in between
        if k >= 16 && before > 0 && between > 0 {
            break;
        }
        bench.maglev(&DRAWN).succeeds();
        fs::write(out.join("notes.txt"), "mine").unwrap();
        bench.maglev(&["report", "out", "--format", "svg"]).succeeds();
        assert!(out.join("figures").is_dir());
        let first = run_of(&out);
        let mut child = bench.start(&second);
        std::thread::sleep(Duration::from_secs_f64(whole * f64::from(k % 16) / 14.0));
        child.kill().unwrap();
        child.wait().unwrap();
        let there = |name: &str| out.join(name).exists();
        assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
        let report = bench.maglev(&["report", "out"]);
        assert!(!report.stderr().contains("different runs"), "{}", report.stderr());
        if run_of(&out) == first {
            before += 1;
            // as it was, or on its way out
            assert!(there("results.csv") || !there("summary.json"));
            continue;
        }
        for name in ["p.svg", "results.parquet", "figures", "checkpoint.bin"] {
            assert!(!there(name), "{name} is the first run's");
        }
        if there("summary.json") {
            after += 1;
            report.succeeds();
        } else {
            between += 1;
            assert!(report.status() == 0 || report.stderr().contains("not a results folder"));
        }
    }
    println!("killed before: {before}, in between: {between}, after: {after}");
    assert!(before > 0 && between > 0);
}

/// What the first run wrote and the second does not is gone when the second has ended, whatever its
/// status; files of the user stay.
#[test]
fn issue_pictures_and_parquet_of_an_earlier_run_do_not_survive() {
    let bench = bench();
    let out = bench.path("out");
    for (stop, status) in [("1", 0), ("0.3", 1)] {
        bench.maglev(&DRAWN).succeeds();
        fs::write(out.join("mine.svg"), "mine").unwrap();
        assert!(out.join("p.svg").exists() && out.join("results.parquet").exists());
        let first = run_of(&out);
        let fault = if status == 0 { "b.fault=0" } else { "b.fault=4" };
        let settings = ["--no-report", "--set", fault, "--set", "b.fail_time=0.2"];
        let ran = bench.run(&[&["--stop", stop], &settings[..]].concat());
        assert_eq!(ran.status(), status, "{}", ran.stderr());
        assert_ne!(run_of(&out), first);
        for name in ["p.svg", "results.parquet", "report.html"] {
            assert!(!out.join(name).exists(), "{name}");
        }
        assert!(out.join("mine.svg").exists());
        let list = json(&out.join("run-files.json")).unwrap();
        assert_eq!(list["files"]["results.csv"]["bytes"], bench.result("results.csv").len());
    }
}

/// Files of two runs that somebody has put together are refused, and named.
#[test]
fn issue_files_of_two_runs_are_refused() {
    let bench = bench();
    let drawn = |out: &str, more: &[&str]| {
        let order = ["run", "drawn.json", "--checkpoint-every", "0.1", "--no-report", "--out", out];
        bench.maglev(&[&order[..], more].concat())
    };
    let failing = ["--set", "b.fault=4", "--set", "b.fail_time=0.55"];
    drawn("one", &failing).fails(1, &["the model broke"]);
    drawn("two", &[&failing[..], &["--set", "a.y=2"]].concat()).fails(1, &["the model broke"]);
    let names = ["results.csv", "results.parquet", "p.svg", "summary.json", "scenario-as-run.json"];
    for name in names {
        let (mine, other) = (bench.path("one").join(name), bench.path("two").join(name));
        let own = fs::read(&mine).unwrap();
        fs::copy(other, &mine).unwrap();
        bench.maglev(&["report", "one"]).fails(2, &["files in one belong to different runs", name]);
        fs::write(mine, own).unwrap();
    }
    bench.maglev(&["report", "one"]).succeeds();
    let own = fs::read(bench.path("one/checkpoint.bin")).unwrap();
    fs::copy(bench.path("two/checkpoint.bin"), bench.path("one/checkpoint.bin")).unwrap();
    let ran = bench.maglev(&["resume", "one"]);
    ran.fails(2, &["one belong to two runs", &run_of(&bench.path("two")), "help:"]);
    fs::write(bench.path("one/checkpoint.bin"), own).unwrap();
    // resumed, it is the same run still
    let run = run_of(&bench.path("one"));
    bench.maglev(&["resume", "one"]).fails(1, &["the model broke"]);
    assert_eq!(run_of(&bench.path("one")), run);
    bench.maglev(&["report", "one"]).succeeds();
}
