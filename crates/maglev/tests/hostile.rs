//! Units that fail on purpose: every status in every call, and what no status tells, in this process
//! and in one of their own. Each run must end as documented, name unit, call and time, and keep its
//! results.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use serde_json::{Value, json};
use support::{Bench, Ran, ring, with_states};

/// Two units that exchange all types, with derivatives and saved states.
fn scenario() -> Value {
    let mut scenario = ring();
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" }, { "from": "b.y", "to": "a.u" },
        { "from": "a.m", "to": "b.n" }, { "from": "a.c", "to": "b.b" },
        { "from": "a.t", "to": "b.s" }, { "from": "b.m", "to": "a.n" },
        { "from": "b.c", "to": "a.b" }, { "from": "b.t", "to": "a.s" },
    ]);
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0, "n": 7, "b": true, "s": "ü" });
    scenario["checkpoint"] = json!({ "every": 0.2 });
    scenario
}

fn bench(scenario: &Value) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &["-DHOSTILE"]);
    bench.scenario(scenario);
    bench
}

/// Calls of a run, and from which time on the mischief is done: from 0.35 s, the step that fails
/// first begins at 0.3 s or ends there.
const STEPPING: &[&str] = &[
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2SetString",
    "fmi2SetRealInputDerivatives",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2GetBoolean",
    "fmi2GetString",
    "fmi2GetRealOutputDerivatives",
    "fmi2GetFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate",
    "fmi2DoStep",
];
const STARTING: &[&str] = &[
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2SetReal",
    "fmi2SetString",
    "fmi2GetReal",
    "fmi2GetString",
];

const STATUSES: [(&str, &str); 7] = [
    ("0", "fmi2OK"),
    ("1", "fmi2Warning"),
    ("2", "fmi2Discard"),
    ("3", "fmi2Error"),
    ("4", "fmi2Fatal"),
    ("5", "fmi2Pending"),
    ("99", "unknown status 99"),
];

/// What is common to all runs that failed while stepping: complete results until then.
#[track_caller]
fn ended_while_stepping(bench: &Bench, ran: &Ran, what: &str) {
    assert_eq!(ran.status(), 1, "{what}: {}", ran.stderr());
    let rows = bench.rows();
    assert!((4..=5).contains(&rows.len()), "{what}: {} rows", rows.len());
    assert!(rows.iter().all(|row| row.len() == 3 && row.iter().all(|x| x.is_finite())), "{what}");
    let summary = bench.summary();
    assert_eq!(summary["status"], "failed", "{what}");
    assert_eq!(summary["rows"], rows.len(), "{what}");
    assert!(!bench.path("out/results.csv.partial").exists(), "{what}");
    assert!(ran.stderr().contains("help:"), "{what}: {}", ran.stderr());
    // the step from 0.3 (3·0.1, which is not 0.3) to 0.4 s, or what belongs to its end
    let report = ran.stderr();
    assert!(report.contains(" at 0.30000000000000004 s") || report.contains(" at 0.4 s"), "{what}");
}

/// Every status in every call of a run.
fn statuses(isolation: &[&str]) {
    let bench = bench(&scenario());
    bench.hostile("", isolation).succeeds();
    let honest = bench.result("results.csv");
    let stepping = STEPPING.iter().map(|call| (*call, "0.35"));
    let starting = STARTING.iter().map(|call| (*call, "-1"));
    for (call, from) in stepping.chain(starting) {
        for (number, status) in STATUSES {
            let mischief = format!("b {call} {number} {from}");
            let ran = bench.hostile(&mischief, isolation);
            let report = ran.stderr();
            let what = format!("{mischief}: {report}");
            match status {
                "fmi2OK" => assert!(ran.status() == 0 && !report.contains("unit b"), "{what}"),
                "fmi2Warning" => {
                    let told = format!("unit b warns: {call} returned fmi2Warning");
                    assert_eq!(report.matches(&told).count(), 1, "{what}");
                }
                "fmi2Pending" if call == "fmi2DoStep" => {}
                _ if from == "-1" => {
                    let texts = [format!("unit b: {call} returned {status}")];
                    ran.fails(1, &[&texts[0], "the run could not start", "help:"]);
                }
                _ => {
                    assert!(
                        report.contains(&format!("unit b: {call} returned {status}")),
                        "{what}"
                    );
                    ended_while_stepping(&bench, &ran, &mischief);
                }
            }
            if ran.status() == 0 {
                assert!(bench.result("results.csv") == honest, "{what}");
            }
        }
    }
}

#[test]
fn issue_every_status_in_every_call_ends_the_run_as_documented() {
    statuses(&[]);
}

#[test]
fn issue_every_status_in_every_call_of_an_isolated_fmu_ends_the_run_as_documented() {
    statuses(&["--isolate"]);
}

/// Crash, abort, exit and endless loop in every call of an isolated unit: the run names unit, call,
/// time and signal, and its results are complete.
#[test]
fn issue_crashes_exits_and_hangs_are_caught_in_a_worker_process() {
    let mut scenario = scenario();
    scenario["isolation"] = json!({ "all": true, "step_timeout": 0.5, "call_timeout": 0.5 });
    let bench = bench(&scenario);
    let ends = [
        ("null", "crashed: signal 11 (SIGSEGV)"),
        ("wild", "crashed: signal 11 (SIGSEGV)"),
        ("abort", "crashed: signal 6 (SIGABRT)"),
        ("trample", "crashed: signal 6 (SIGABRT)"),
        ("exit", "ended its process with status 3"),
        ("loop", "took longer than 0.5 s"),
    ];
    for call in STEPPING {
        for (word, end) in ends {
            // most of the time goes into loops: the calls of a step take the same way
            if word == "loop" && !["fmi2DoStep", "fmi2GetReal", "fmi2SetString"].contains(call) {
                continue;
            }
            let mischief = format!("b {call} {word} 0.35");
            let ran = bench.hostile(&mischief, &[]);
            let report = ran.stderr();
            assert!(report.contains(&format!("unit b {end}")) || report.contains(end), "{report}");
            // what has trampled on the shared memory has also trampled on the name of the call
            assert!(word == "trample" || report.contains(call), "{mischief}: {report}");
            assert!(report.contains("unit b"), "{mischief}: {report}");
            ended_while_stepping(&bench, &ran, &mischief);
        }
    }
    for call in STARTING.iter().copied().chain(["fmi2Instantiate"]) {
        for (word, end) in [ends[0], ends[4], ends[5]] {
            let ran = bench.hostile(&format!("b {call} {word} -1e301"), &[]);
            ran.fails(1, &["unit b", call, end, "help:"]);
        }
    }
    for (word, end) in [ends[0], ends[4], ends[5]] {
        let ran = bench.hostile(&format!("b fmi2Terminate {word} 0"), &[]);
        ran.fails(1, &["unit b", "fmi2Terminate", end, "help:"]);
        assert_eq!(bench.rows().len(), 11, "all steps were made");
        bench.hostile(&format!("b fmi2FreeInstance {word} 0"), &[]).succeeds();
        assert_eq!(bench.rows().len(), 11, "all steps were made");
    }
}

#[test]
fn issue_values_that_are_no_numbers_stop_the_run() {
    let bench = bench(&scenario());
    for isolation in [&[][..], &["--isolate"]] {
        for (word, text) in [("nan", "is NaN"), ("inf", "is -inf")] {
            for call in ["fmi2GetReal", "fmi2GetRealOutputDerivatives"] {
                let mischief = format!("b {call} {word} 0.35");
                let ran = bench.hostile(&mischief, isolation);
                ran.fails(1, &[&format!("unit b: y {text} at 0.4 s"), "help:"]);
                ended_while_stepping(&bench, &ran, &mischief);
            }
        }
    }
}

/// After an error of one unit the others are ended in order; after a fatal one nothing of that
/// library is called, not even for another instance (any call would abort).
#[test]
fn issue_other_units_are_terminated_and_freed() {
    let bench = bench(&scenario());
    let log = || {
        let log = fs::read_to_string(bench.path("calls.log")).unwrap_or_default();
        let _ = fs::remove_file(bench.path("calls.log"));
        let mut lines: Vec<String> = log.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    let all = ["a fmi2FreeInstance", "a fmi2Terminate", "b fmi2FreeInstance", "b fmi2Terminate"];
    bench.hostile("", &[]).succeeds();
    assert_eq!(log(), all);
    bench.hostile("b fmi2DoStep 3 0.35", &[]).fails(1, &["fmi2Error"]);
    assert_eq!(log(), all[..3]);
    bench.hostile("b fmi2DoStep 4 0.35", &[]).fails(1, &["fmi2Fatal"]);
    assert!(log().is_empty());
    // each library stands alone in its process
    bench.hostile("b fmi2DoStep 4 0.35", &["--isolate"]).fails(1, &["fmi2Fatal"]);
    assert_eq!(log(), all[..2]);
    bench.hostile("b fmi2DoStep null 0.35", &["--isolate"]).fails(1, &["SIGSEGV"]);
    assert_eq!(log(), all[..2]);
}

/// A unit that asks to end does so in order: the run is no failure.
#[test]
fn issue_a_unit_that_reports_terminated_ends_the_run_with_success() {
    let bench = bench(&scenario());
    for isolation in [&[][..], &["--isolate"]] {
        let ran = bench.hostile("b fmi2DoStep ended 0.35", isolation);
        ran.succeeds();
        assert!(ran.stderr().contains("unit b: fmi2DoStep returned fmi2Discard at 0.4 s"));
        assert!(ran.stderr().contains("asks to end the simulation"), "{}", ran.stderr());
        let summary = bench.summary();
        assert_eq!(summary["status"], "terminated");
        assert_eq!(summary["steps"], 4);
        assert_eq!(bench.rows().len(), 5);
    }
}

/// Steps above 0.03 s are discarded: each of 0.1 s is made in four parts. The unit integrates
/// polynomials exactly, so the result is that of whole steps to rounding, and the parts must have
/// got the same input function.
#[test]
fn analytic_discarded_steps_are_made_in_parts() {
    let bench = bench(&scenario());
    bench.hostile("", &[]).succeeds();
    let whole = bench.rows();
    for isolation in [&[][..], &["--isolate"]] {
        for algorithm in ["gauss-seidel", "jacobi"] {
            let choice = [isolation, &["--algorithm", algorithm]].concat();
            bench.hostile("", &choice).succeeds();
            let whole = bench.rows();
            bench.hostile("b fmi2DoStep coarse 0.35", &choice).succeeds();
            for (row, expected) in bench.rows().iter().zip(&whole) {
                for (x, y) in row.iter().zip(expected) {
                    // ten steps of values around 1: some units in the last place each
                    assert!((x - y).abs() < 1e-14, "{algorithm}: {row:?} {expected:?}");
                }
            }
            let events = bench.result("events.csv");
            let retries = events.lines().filter(|line| line.contains("in 4 parts")).count();
            assert_eq!(retries, 6, "{events}");
        }
    }
    assert_eq!(whole.len(), 11);
}

/// Where steps cannot be made in parts, the report says what would help.
#[test]
fn issue_a_discarded_step_that_cannot_be_made_in_parts_names_what_would_help() {
    let mut scenario = scenario();
    scenario["algorithm"] = json!({ "on_discard": "fail" });
    let bench = bench(&scenario);
    let ran = bench.hostile("b fmi2DoStep coarse 0.35", &[]);
    ran.fails(1, &["fmi2Discard at 0.4 s", "could not finish the step of 0.1 s", "on_discard"]);
    bench.unit("unit.fmu", support::DESCRIPTION, &["-DHOSTILE"]);
    scenario["algorithm"] = json!({});
    scenario["checkpoint"] = Value::Null;
    bench.scenario(&scenario);
    let ran = bench.hostile("b fmi2DoStep coarse 0.35", &[]);
    ran.fails(1, &["fmi2Discard at 0.4 s", "the unit cannot save its state"]);
}

/// A step that stays pending is given up: the unit is asked to cancel, and not freed if it cannot.
#[test]
fn issue_a_step_pending_for_ever_is_given_up() {
    let bench = bench(&scenario());
    let limit = ["--isolate", "--step-timeout", "0.3"];
    let ran = bench.hostile("b fmi2DoStep stuck 0.35", &limit);
    ran.fails(1, &["unit b: fmi2DoStep at 0.4 s is still pending after 0.3 s", "help:"]);
    ended_while_stepping(&bench, &ran, "stuck");
}

/// Memory has a limit where one is set.
#[test]
fn issue_a_huge_allocation_is_refused() {
    let mut scenario = scenario();
    scenario["isolation"] = json!({ "all": true, "memory": 4_000_000_000_u64 });
    let bench = bench(&scenario);
    bench.hostile("", &[]).succeeds();
    let ran = bench.hostile("b fmi2DoStep hoard 0.35", &[]);
    ran.fails(1, &["unit b: fmi2DoStep returned fmi2Error at 0.4 s"]);
}

/// Limits without an isolated instance would be no limits.
#[test]
fn issue_a_time_limit_without_an_isolated_instance_is_refused() {
    let bench = bench(&scenario());
    bench.run(&["--step-timeout", "1"]).fails(2, &["no instance is isolated", "add --isolate"]);
    bench.run(&["--isolate", "--step-timeout", "0"]).fails(2, &["isolation.step_timeout"]);
    let mut mixed = scenario();
    mixed["instances"]["b"]["isolate"] = json!(true);
    bench.scenario(&mixed);
    bench.run(&["--step-timeout", "60"]).succeeds();
}

/// In this process nothing can be saved, but the last words name unit, call and time.
#[test]
fn issue_a_crash_in_the_masters_process_names_unit_call_and_time() {
    let bench = bench(&scenario());
    for (call, word, signal, text) in [
        ("fmi2DoStep", "null", Some(11), "crashed: signal 11 (SIGSEGV) in fmi2DoStep at 0.4 s"),
        ("fmi2GetReal", "abort", Some(6), "crashed: signal 6 (SIGABRT) in fmi2GetReal at 0.4 s"),
        ("fmi2SetString", "exit", None, "ended the process in fmi2SetString at 0.4 s"),
        ("fmi2FreeInstance", "null", Some(11), "in fmi2FreeInstance at 1 s"),
    ] {
        let ran = bench.hostile(&format!("b {call} {word} 0.35"), &[]);
        assert_eq!(ran.signal(), signal, "{}", ran.stderr());
        assert!(signal.is_some() || ran.status() == 1);
        let report = ran.stderr();
        assert!(report.contains("error: unit b ") && report.contains(text), "{report}");
        assert!(report.contains("--isolate"), "{report}");
        assert!(bench.path("out/results.csv.partial").exists() || call == "fmi2FreeInstance");
    }
}
