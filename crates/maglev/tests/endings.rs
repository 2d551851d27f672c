//! How runs end, and what they leave: rows on the disk whatever happens, files before the units' last
//! calls, an exit status that a unit cannot choose, nothing in the folder for temporary files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]
#![cfg(target_os = "linux")]

mod support;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use support::{Bench, ring, with_states};

/// A ring that is recorded in both formats and drawn.
fn scenario() -> Value {
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0 });
    scenario["record"]["format"] = json!(["csv", "parquet"]);
    scenario["plots"] = json!([{ "file": "p.svg", "panels": [{ "signals": ["a.y"] }] }]);
    scenario
}

fn bench(defines: &[&str]) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[&["-DHOSTILE"], defines].concat());
    bench.scenario(&scenario());
    bench
}

/// Starts `maglev run` with a unit that does mischief, and with a folder of its own for temporary files.
fn start(bench: &Bench, mischief: &str, arguments: &[&str]) -> Child {
    fs::create_dir_all(bench.path("tmp")).unwrap();
    Command::new(env!("CARGO_BIN_EXE_maglev"))
        .args(["run", "scenario.json", "--no-report"])
        .args(arguments)
        .env("HOSTILE", mischief)
        .env("HOSTILE_LOG", bench.path("calls.log"))
        .env("TMPDIR", bench.path("tmp"))
        .current_dir(bench.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

/// Whole rows below the header.
fn rows(path: &Path) -> usize {
    let text = fs::read_to_string(path).unwrap_or_default();
    text.matches('\n').count().saturating_sub(1)
}

#[track_caller]
fn wait_until(what: &str, seconds: f64, reached: impl Fn() -> bool) {
    let begin = Instant::now();
    while !reached() {
        assert!(begin.elapsed().as_secs_f64() < seconds, "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Steps of 50 ms fill no buffer: of a killed run, the rows of at most the last second are missing.
#[test]
fn issue_a_slow_run_keeps_its_rows_when_killed() {
    let bench = bench(&[]);
    let mut child = start(&bench, "b fmi2DoStep slow -1", &["--out", "out", "--stop", "1000"]);
    let steps = || fs::metadata(bench.path("calls.log")).map_or(0, |it| it.len() as usize);
    wait_until("50 steps", 60.0, || steps() >= 50);
    child.kill().unwrap();
    child.wait().unwrap();
    let rows = rows(&bench.path("out/results.csv.partial"));
    assert!(rows + 20 >= steps() && rows <= steps() + 1, "{rows} rows of {} steps", steps());
}

/// All rows before a step that never ends are there while it hangs, though they were quick.
#[test]
fn issue_a_hanging_step_holds_no_rows_back() {
    let bench = bench(&[]);
    let mut child = start(&bench, "b fmi2DoStep hang 0.35", &["--out", "out"]);
    let table = bench.path("out/results.csv.partial");
    // up to 0.3 s, or 0.4 if b is stepped first
    wait_until("four rows", 20.0, || rows(&table) >= 4);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(rows(&table) <= 5);
}

/// A crash in a step loses none of the rows before it; nor does an exit.
#[test]
fn issue_a_crash_loses_no_rows() {
    let bench = bench(&[]);
    for word in ["null", "abort", "quit", "quit-now"] {
        bench.hostile(&format!("b fmi2DoStep {word} 0.35"), &[]);
        assert!((4..=5).contains(&rows(&bench.path("out/results.csv.partial"))), "{word}");
        assert!(!bench.path("out/summary.json").exists());
    }
}

/// The files of a finished run are complete before a unit is called again: whatever the unit does
/// when it is terminated or freed, table, Parquet with its end, picture, events and summary are there.
#[test]
fn issue_files_are_complete_before_units_are_terminated() {
    let bench = bench(&[]);
    let last = ["fmi2Terminate", "fmi2FreeInstance"];
    for (call, word) in
        last.iter().flat_map(|call| ["null", "quit", "quit-now"].map(|w| (*call, w)))
    {
        let mischief = format!("b {call} {word} 0.35");
        let ran = bench.hostile(&mischief, &[]);
        if word == "null" {
            assert_eq!(ran.signal(), Some(11), "{mischief}");
        } else {
            ran.fails(1, &["unit b ended the process in", call]);
        }
        assert!(ran.stderr().contains(&format!("{call} at 1 s")), "{}", ran.stderr());
        assert_eq!(bench.rows().len(), 11, "{mischief}");
        assert_eq!(bench.summary()["status"], "finished", "{mischief}");
        assert!(fs::read(bench.path("out/results.parquet")).unwrap().ends_with(b"PAR1"));
        assert!(bench.result("p.svg").ends_with("</svg>\n"), "{mischief}");
        assert!(bench.result("events.csv").starts_with("time,kind"), "{mischief}");
        bench.maglev(&["report", "out"]).succeeds();
    }
}

/// What a unit says or does in fmi2Terminate is added to the files: the run has finished, the status
/// of the command is that of a failure, and the summary holds the error.
#[test]
fn issue_errors_of_terminate_are_reported_beside_complete_results() {
    let bench = bench(&[]);
    for (mischief, isolation, text) in [
        ("b fmi2Terminate 3 0", &[][..], "fmi2Terminate returned fmi2Error"),
        ("b fmi2Terminate null 0", &["--isolate"], "crashed: signal 11 (SIGSEGV) in fmi2Terminate"),
        (
            "b fmi2Terminate quit 0",
            &["--isolate"],
            "ended its process with status 0 in fmi2Terminate",
        ),
    ] {
        bench.hostile(mischief, isolation).fails(1, &["unit b", text, "help:"]);
        let summary = bench.summary();
        assert_eq!((&summary["status"], &summary["rows"]), (&json!("finished"), &json!(11)));
        assert!(summary["error"]["causes"].to_string().contains(text), "{summary}");
        let events = bench.result("events.csv");
        assert!(events.contains("1.0,failed,,") && events.contains(text), "{events}");
        assert_eq!(summary["events"]["failed"], 1);
        bench.maglev(&["report", "out"]).succeeds();
    }
}

/// No way to end the process makes a run that did not finish look like one that did.
#[test]
fn issue_a_unit_cannot_end_the_run_with_success() {
    let bench = bench(&[]);
    let words = ["quit", "quit-now", "quit-C99", "quit-fast"];
    for call in ["fmi2Instantiate", "fmi2EnterInitializationMode", "fmi2DoStep", "fmi2GetReal"] {
        for word in words {
            let mischief = format!("b {call} {word} -1e301");
            let ran = bench.hostile(&mischief, &[]);
            ran.fails(1, &[&format!("unit b ended the process in {call}"), "--isolate"]);
            let ran = bench.hostile(&mischief, &["--isolate"]);
            ran.fails(1, &[&format!("unit b ended its process with status 0 in {call}")]);
        }
    }
    // processes that a unit starts may end as they like
    bench.hostile("b fmi2DoStep children -1", &[]).succeeds();
    assert_eq!(bench.rows().len(), 11);
    bench.unit("unit.fmu", &with_states(), &["-DHOSTILE", "-DEXIT_WHILE_LOADING"]);
    bench.run(&[]).fails(1, &["unit.fmu ended the process in dlopen", "--isolate"]);
    bench.run(&["--isolate"]).fails(1, &["unit a ended its process with status 0 in dlopen"]);
    bench.scenario(&ring());
}

/// A unit that crashes when the process ends spoils no finished run. It has its say before: other
/// units close their files there.
#[test]
fn issue_a_crash_at_the_end_of_the_process_is_no_failure() {
    let bench = bench(&["-DCRASH_AT_EXIT"]);
    for isolation in [&[][..], &["--isolate"]] {
        let _ = fs::remove_file(bench.path("calls.log"));
        let ran = bench.hostile("", isolation);
        ran.succeeds();
        let log = fs::read_to_string(bench.path("calls.log")).unwrap();
        assert!(log.ends_with('.'), "{log}");
        assert_eq!(ran.stderr().contains("crashed when the process ended"), isolation.is_empty());
        assert!(ran.stdout().contains("summary.json"), "{}", ran.stdout());
        assert_eq!(bench.summary()["status"], "finished");
    }
    // nor does it turn a failure into a crash
    bench.hostile("b fmi2DoStep 3 0.35", &[]).fails(1, &["the model broke"]);
}

/// The folder for temporary files is empty after every end, after a kill and a crash with the help of
/// the next start, which leaves alone what a running one needs.
#[test]
fn issue_nothing_is_left_in_the_folder_for_temporary_files() {
    let bench = bench(&[]);
    let tmp = bench.path("tmp");
    let run = |mischief: &str| start(&bench, mischief, &["--out", "out"]).wait().unwrap();
    assert!(run("").success());
    assert_eq!(entries(&tmp), 0);
    assert_eq!(run("b fmi2DoStep quit 0.35").code(), Some(1));
    assert_eq!(entries(&tmp), 0);
    fs::remove_file(bench.path("calls.log")).unwrap();
    let mut slow = start(&bench, "b fmi2DoStep slow -1", &["--out", "slow", "--stop", "1000"]);
    wait_until("a step", 60.0, || bench.path("calls.log").exists());
    assert_eq!(entries(&tmp), 1);
    for mischief in ["b fmi2DoStep null 0.35", "b fmi2DoStep quit-now 0.35"] {
        assert!(!run(mischief).success());
        assert_eq!(entries(&tmp), 2);
        assert!(run("").success());
        assert_eq!(entries(&tmp), 1, "that of the running one");
    }
    assert!(slow.try_wait().unwrap().is_none());
    slow.kill().unwrap();
    slow.wait().unwrap();
    assert_eq!(entries(&tmp), 1);
    let inspected = Command::new(env!("CARGO_BIN_EXE_maglev"))
        .args(["inspect", "unit.fmu"])
        .env("TMPDIR", &tmp)
        .current_dir(bench.path(""))
        .output()
        .unwrap();
    assert!(inspected.status.success());
    assert_eq!(entries(&tmp), 0);
}
