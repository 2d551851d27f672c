//! Ctrl-C and SIGTERM: the first ends a run after its step, the second one ends a step that hangs.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::json;
use support::{Bench, ring, with_states};

/// A ring whose `b` hangs in its fifth step.
const HANGS: &str = "b fmi2DoStep loop 0.35";

fn bench() -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &["-DHOSTILE"]);
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "y": 1.0 });
    bench.scenario(&scenario);
    bench
}

fn start(bench: &Bench, mischief: &str, further: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_maglev"))
        .args(["run", "scenario.json", "--out", "out"])
        .args(further)
        .env("HOSTILE", mischief)
        .current_dir(bench.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Waits until the run has begun: its file of events is there, by its own name once the results are
/// complete.
fn begun(bench: &Bench) {
    let begin = Instant::now();
    let there = |name| bench.path(name).exists();
    while !there("out/events.csv.partial") && !there("out/events.csv") {
        assert!(begin.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(10));
    }
    // four steps of some microseconds are done soon
    std::thread::sleep(Duration::from_millis(400));
}

/// Exit status and what was said on stderr.
fn end(mut child: Child) -> (Option<i32>, String) {
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begin.elapsed() > Duration::from_secs(30) {
            child.kill().unwrap();
            panic!("the run does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// The first signal waits for the step, the second one ends it, in this process and in one of its own,
/// with one thread and with two: exit status 1, status `interrupted`, the rows of the four finished
/// steps and of the start, and an event that names unit, call and time.
#[test]
fn issue_a_second_signal_ends_a_step_that_hangs() {
    let cases: [(&str, &[&str]); 6] = [
        ("-INT", &[]),
        ("-TERM", &[]),
        ("-INT", &["--algorithm", "jacobi", "--threads", "2"]),
        ("-INT", &["--isolate"]),
        ("-TERM", &["--isolate"]),
        ("-INT", &["--isolate", "--algorithm", "jacobi"]),
    ];
    for (name, further) in cases {
        let bench = bench();
        let mut child = start(&bench, HANGS, further);
        begun(&bench);
        signal(&child, name);
        std::thread::sleep(Duration::from_millis(1500));
        assert!(child.try_wait().unwrap().is_none(), "the first one waits for the step");
        signal(&child, name);
        let (status, told) = end(child);
        assert_eq!(status, Some(1), "{further:?}: {told}");
        assert!(told.contains("another Ctrl-C ends a step that hangs"), "{told}");
        assert!(told.contains("interrupted"), "{further:?}: {told}");
        let summary = bench.summary();
        assert_eq!(summary["status"], "interrupted", "{further:?}");
        assert_eq!(summary["steps"], 4, "{further:?}");
        assert_eq!(summary["rows"], 5, "{further:?}");
        let rows = bench.rows();
        assert_eq!(rows.len(), 5, "{further:?}");
        let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
        assert_eq!(times, [0.0, 0.1, 0.2, 0.1 * 3.0, 0.4], "{further:?}");
        let events = bench.result("events.csv");
        let event = events.lines().find(|line| line.contains(",interrupted,")).unwrap();
        let threads = further.contains(&"--threads");
        for text in ["by the user", "unit b", "fmi2DoStep at 0.4 s", "had not returned"] {
            // which of several threads hangs is not known
            assert!(threads || event.contains(text), "{further:?}: {event}");
        }
    }
}

/// Calls before the first step and after the last one hang as well.
#[test]
fn issue_other_calls_that_hang_are_ended_too() {
    for mischief in ["b fmi2EnterInitializationMode loop -1", "b fmi2Terminate loop 0"] {
        for further in [&[][..], &["--isolate"]] {
            let bench = bench();
            let child = start(&bench, mischief, further);
            begun(&bench);
            signal(&child, "-INT");
            std::thread::sleep(Duration::from_millis(300));
            signal(&child, "-INT");
            let (status, told) = end(child);
            assert_eq!(status, Some(1), "{mischief} {further:?}: {told}");
            let rows = bench.rows().len();
            let expected = if mischief.contains("Terminate") { 11 } else { 0 };
            assert_eq!(rows, expected, "{mischief} {further:?}");
        }
    }
}

/// With checkpoints, a run that was given up goes on from the last one to the results of a run without
/// a stop.
#[test]
fn invariant_a_run_that_was_given_up_can_be_resumed() {
    let bench = bench();
    bench.run(&["--quiet", "--no-report"]).succeeds();
    let whole = bench.result("results.csv");
    std::fs::remove_dir_all(bench.path("out")).unwrap();
    for further in [&["--checkpoint-every", "0.2"][..], &["--checkpoint-every", "0.2", "--isolate"]]
    {
        let child = start(&bench, HANGS, further);
        begun(&bench);
        signal(&child, "-INT");
        std::thread::sleep(Duration::from_millis(300));
        signal(&child, "-INT");
        assert_eq!(end(child).0, Some(1));
        bench.maglev(&["resume", "out", "--quiet", "--no-report"]).succeeds();
        assert!(bench.result("results.csv") == whole, "{further:?}");
        std::fs::remove_dir_all(bench.path("out")).unwrap();
    }
}
