//! Runs that are stopped, by a kill, a signal, a full disk, and go on from their checkpoints to the
//! same bytes; and checkpoints that cannot be used.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "a test program")]
#![cfg(unix)]

mod support;

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION, ring, with_states};

/// An oscillator, two integrators and a change of sign, with signals of all types, recorded at two intervals, drawn.
fn scenario(step: f64) -> Value {
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "y": 1.0, "n": 7, "b": true, "s": "ü, \"x\"" });
    scenario["instances"]["c"] = json!({ "unit": "unit", "parameters": { "gain": -1.0 } });
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" },
        { "from": "b.y", "to": "c.u" },
        { "from": "c.z", "to": "a.u" },
        { "from": "a.m", "to": "b.n" },
        { "from": "a.c", "to": "b.b" },
        { "from": "a.t", "to": "b.s" },
    ]);
    scenario["experiment"] = json!({ "stop": 2.0, "step": step });
    scenario["algorithm"] = json!({ "extrapolation": 3 });
    scenario["record"] = json!({
        "signals": ["a.y", { "signals": ["b.*"], "interval": 8.0 * step }],
        "format": ["csv", "parquet"]
    });
    scenario["plots"] =
        json!([{ "file": "p.svg", "panels": [{ "signals": ["a.y", "b.y", "a.z"] }] }]);
    scenario
}

fn bench(step: f64) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    bench.scenario(&scenario(step));
    bench
}

/// Everything that must not depend on stops.
#[derive(PartialEq)]
struct Results {
    csv: Vec<u8>,
    parquet: Vec<u8>,
    picture: Vec<u8>,
    signals: String,
}

fn results(bench: &Bench, folder: &str) -> Results {
    let read = |name: &str| fs::read(bench.path(folder).join(name)).unwrap();
    let summary: Value = serde_json::from_slice(&read("summary.json")).unwrap();
    assert_eq!(summary["status"], "finished");
    // an oscillation, of which not everything is seen at every point
    assert!(summary["signals"]["a.y"]["min"].as_f64().unwrap() < -0.3);
    Results {
        csv: read("results.csv"),
        parquet: read("results.parquet"),
        picture: read("p.svg"),
        signals: summary["signals"].to_string(),
    }
}

#[track_caller]
fn assert_same(bench: &Bench, folder: &str, reference: &Results) {
    let now = results(bench, folder);
    assert!(now.csv == reference.csv, "results.csv differs");
    assert!(now.parquet == reference.parquet, "results.parquet differs");
    assert!(now.picture == reference.picture, "the picture differs");
    assert_eq!(now.signals, reference.signals);
    let leftover = fs::read_dir(bench.path(folder)).unwrap().any(|entry| {
        let name = entry.unwrap().file_name().into_string().unwrap();
        name.ends_with(".partial") || name.starts_with("checkpoint")
    });
    assert!(!leftover, "a finished run leaves neither checkpoint nor temporary files");
}

/// Kills a run, and the runs that go on from it, at random moments; the results are those of a run
/// that nobody stopped. The moments are spread over a quarter of that run's time, from the start of
/// the process on, so that loading, stepping, writing of checkpoints and the end are all hit.
fn killed(kills: u32) {
    let bench = bench(1e-5);
    let order = ["run", "scenario.json", "--checkpoint-every", "0.04", "--quiet", "--out"];
    let begin = Instant::now();
    bench.maglev(&[&order[..], &["whole"]].concat()).succeeds();
    let quarter = begin.elapsed().as_secs_f64() / 4.0;
    let reference = results(&bench, "whole");
    let fresh = [&order[..], &["out"]].concat();
    let resume = vec!["resume", "out", "--quiet"];
    let checkpoint = bench.path("out/checkpoint.bin");
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    let (mut done, mut finished, mut resumed) = (0, 0, 0);
    while done < kills {
        let goes_on = checkpoint.exists();
        resumed += u32::from(goes_on);
        let mut child = bench.start(if goes_on { &resume } else { &fresh });
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let share = (random >> 11) as f64 / (1_u64 << 53) as f64;
        std::thread::sleep(Duration::from_secs_f64(share * quarter));
        child.kill().unwrap();
        let output = child.wait_with_output().unwrap();
        match output.status.code() {
            None => done += 1,
            Some(0) => {
                finished += 1;
                assert_same(&bench, "out", &reference);
                fs::remove_dir_all(bench.path("out")).unwrap();
            }
            Some(code) => panic!("{code}: {}", String::from_utf8_lossy(&output.stderr)),
        }
    }
    let last = if checkpoint.exists() { &resume } else { &fresh };
    bench.maglev(last).succeeds();
    assert_same(&bench, "out", &reference);
    println!("{kills} kills, {resumed} resumed, {finished} runs finished in between");
    assert!(resumed > 0);
}

#[test]
fn invariant_killed_runs_resume_to_the_same_bytes() {
    killed(8);
}

/// `cargo test -p maglev-cli --test checkpoint -- --ignored --nocapture`, two minutes.
#[test]
#[ignore = "two minutes"]
fn invariant_runs_killed_a_hundred_times_resume_to_the_same_bytes() {
    killed(100);
}

/// Ctrl-C leaves a checkpoint at the step that it fell into, and complete results until then.
#[test]
fn issue_an_interrupted_run_leaves_a_checkpoint() {
    let bench = bench(1e-4);
    // slowly, so that it does not end by itself before
    let order = ["run", "scenario.json", "--out", "out", "--real-time", "0.1"];
    let child = bench.start(&[&order[..], &["--checkpoint-every", "100"]].concat());
    wait_for(&bench.path("out/checkpoint.bin"));
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("maglev resume out"), "{told}");
    let summary = bench.summary();
    assert_eq!(summary["status"], "interrupted");
    assert_eq!(bench.result("results.csv").lines().count() as u64 - 1, summary["rows"]);
}

/// The same without a clock, and with every algorithm: runs that are interrupted in each of their first
/// steps end with the same bytes. Algorithms that iterate or choose their steps have memories too.
#[test]
fn invariant_every_algorithm_goes_on_from_any_step() {
    use maglev::run::{Job, Observer, Unobserved, resume};
    use results::summary::Status;
    use scenario::{AlgorithmName, Checkpoints, Scenario};
    struct Impatient;
    impl Observer for Impatient {
        fn interrupted(&self) -> bool {
            true
        }
    }
    let bench = bench(2e-2);
    let variable = json!({ "name": "gauss-seidel", "variable": { "tolerance": 1e-6 } });
    let names = AlgorithmName::ALL.map(|name| json!({ "name": name.as_str(), "extrapolation": 3 }));
    for algorithm in names.into_iter().chain([variable]) {
        let mut json = scenario(2e-2);
        json["algorithm"].clone_from(&algorithm);
        bench.scenario(&json);
        let mut scenario = Scenario::load(&bench.path("scenario.json")).unwrap();
        let run = |scenario: &Scenario, folder: &str, observer: &mut dyn Observer| {
            let folder = bench.path(folder);
            Job { scenario, name: "scenario", folder: &folder }.run(observer).unwrap()
        };
        run(&scenario, "whole", &mut Unobserved);
        let reference = results(&bench, "whole");
        scenario.checkpoint = Some(Checkpoints { every: 1.0 });
        let folder = bench.path("out");
        let mut summary = run(&scenario, "out", &mut Impatient);
        for steps in 1..10 {
            assert_eq!(
                (summary.status, summary.steps),
                (Status::Interrupted, steps),
                "{algorithm}"
            );
            summary = resume(&folder, &mut Impatient).unwrap();
        }
        assert_eq!(summary.resumed, 9);
        let summary = resume(&folder, &mut Unobserved).unwrap();
        assert_eq!((summary.status, summary.resumed), (Status::Finished, 10));
        assert!(summary.instances["a"].steps >= summary.steps);
        println!("{algorithm}");
        assert_same(&bench, "out", &reference);
    }
}

fn wait_for(path: &Path) {
    while !path.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn issue_units_that_cannot_serialize_are_named_at_the_start() {
    let bench = bench(1e-2);
    bench.unit("plain.fmu", DESCRIPTION, &[]);
    let mut scenario = scenario(1e-2);
    scenario["units"]["plain"] = json!("plain.fmu");
    scenario["instances"]["b"]["unit"] = json!("plain");
    scenario["checkpoint"] = json!({ "every": 0.1 });
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["plain.fmu cannot serialize its state", "help: "]);
    assert!(!bench.path("out").exists());
    // one that says it can, and cannot
    scenario["instances"]["b"] = json!({ "unit": "unit", "parameters": { "fault": 9 } });
    bench.scenario(&scenario);
    bench.run(&[]).fails(1, &["unit b", "fmi2SerializeFMUstate", "no bytes today"]);
}

/// A run that failed at a checkpointed state of 0.1 s.
fn stopped() -> Bench {
    let bench = bench(1e-2);
    let every = ["--checkpoint-every", "0.1", "--set", "b.fault=4", "--set", "b.fail_time=0.55"];
    bench.run(&every).fails(1, &["the model broke", "maglev resume out"]);
    assert_eq!(bench.summary()["reached"], 0.54);
    bench
}

#[test]
fn issue_useless_checkpoints_are_told_apart() {
    let bench = stopped();
    let path = bench.path("out/checkpoint.bin");
    let good = fs::read(&path).unwrap();
    let resumed = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        bench.maglev(&["resume", "out"])
    };
    resumed(b"time,a.y\n").fails(2, &["not a checkpoint of maglev"]);
    resumed(&good[..20]).fails(2, &["bytes instead of"]);
    resumed(&good[..good.len() - 1]).fails(2, &["bytes instead of"]);
    resumed(&[&good[..], b"x"].concat()).fails(2, &["bytes instead of"]);
    let mut bad = good.clone();
    bad[18] = 99;
    resumed(&bad).fails(2, &["format version 99"]);
    let mut bad = good.clone();
    *bad.last_mut().unwrap() ^= 1;
    resumed(&bad).fails(2, &["damaged", "help: "]);
    fs::remove_file(&path).unwrap();
    bench.maglev(&["resume", "out"]).fails(2, &["there is no checkpoint in out", "help: "]);
    bench.maglev(&["resume", "nowhere"]).fails(2, &["there is no checkpoint in nowhere"]);
    // the good one fails where the run failed
    resumed(&good).fails(1, &["the run failed at 0.54 s"]);
}

/// No byte of a checkpoint can be changed, and none be left out, without an error.
#[test]
fn invariant_every_damage_to_a_checkpoint_is_an_error() {
    let bench = stopped();
    let good = fs::read(bench.path("out/checkpoint.bin")).unwrap();
    maglev::run::Checkpoint::decode(&good).unwrap();
    for k in 0..good.len() {
        let mut bad = good.clone();
        bad[k] ^= 1 << (k % 8);
        maglev::run::Checkpoint::decode(&bad).unwrap_err();
        maglev::run::Checkpoint::decode(&good[..k]).unwrap_err();
    }
}

#[test]
fn issue_changed_units_and_results_are_refused() {
    let bench = stopped();
    let unit = fs::read(bench.path("unit.fmu")).unwrap();
    let other = with_states().replace("integrator", "Integrator");
    bench.unit("unit.fmu", &other, &[]);
    bench.maglev(&["resume", "out"]).fails(2, &["unit.fmu has changed", "content"]);
    let other = with_states().replace("test-unit", "other");
    bench.unit("unit.fmu", &other, &["-DGUID=\"other\""]);
    bench.maglev(&["resume", "out"]).fails(2, &["unit.fmu has changed", "GUID"]);
    fs::remove_file(bench.path("unit.fmu")).unwrap();
    bench.maglev(&["resume", "out"]).fails(2, &["unit.fmu", "No such file"]);
    fs::write(bench.path("unit.fmu"), unit).unwrap();
    let csv = bench.result("results.csv");
    fs::write(bench.path("out/results.csv"), csv.replacen("0.1", "0.2", 1)).unwrap();
    bench
        .maglev(&["resume", "out"])
        .fails(2, &["cannot continue the results in", "results.csv", "content"]);
    fs::write(bench.path("out/results.csv"), &csv[..40]).unwrap();
    bench
        .maglev(&["resume", "out"])
        .fails(2, &["cannot continue the results in", "results.csv", "40 bytes"]);
    fs::remove_file(bench.path("out/results.csv")).unwrap();
    bench.maglev(&["resume", "out"]).fails(2, &["results.csv", "No such file"]);
}

/// A limit on the size of files stands for a full disk: writing fails in the midst of a row. What
/// is there has whole rows only, and the run goes on when there is room again.
#[test]
fn issue_a_full_disk_ends_the_run_and_resume_completes_it() {
    let bench = bench(1e-4);
    bench.maglev(&["run", "scenario.json", "--quiet", "--out", "whole"]).succeeds();
    let reference = results(&bench, "whole");
    let order = "maglev run scenario.json --out out --checkpoint-every 0.1";
    // 300 kB, of the 800 kB that the table will have
    let ran = bench.shell(&format!("trap '' XFSZ; ulimit -f 300; {order}"));
    ran.fails(1, &["cannot write the results to out", "File too large", "help: ", "resume"]);
    let csv = fs::read_to_string(bench.path("out/results.csv")).unwrap();
    assert!(csv.ends_with('\n') && reference.csv.starts_with(csv.as_bytes()));
    assert_eq!(bench.summary()["rows"], csv.lines().count() as u64 - 1);
    assert_eq!(bench.summary()["status"], "failed");
    bench.maglev(&["resume", "out"]).succeeds();
    assert_same(&bench, "out", &reference);
}

/// No room from the first byte on.
#[cfg(target_os = "linux")]
#[test]
fn issue_a_disk_full_at_the_start_is_told_before_the_units_run() {
    let bench = bench(1e-2);
    fs::create_dir(bench.path("out")).unwrap();
    std::os::unix::fs::symlink("/dev/full", bench.path("out/results.csv.partial")).unwrap();
    bench.run(&[]).fails(2, &["cannot write the results to out", "No space left", "help: "]);
    // a folder that nothing can be written to
    let ran = bench.maglev(&["run", "scenario.json", "--out", "/sys/maglev"]);
    ran.fails(2, &["cannot write the results to /sys/maglev", "help: "]);
}

/// A folder that is moved away under a run.
#[test]
fn issue_a_results_folder_that_is_moved_away_is_reported() {
    let bench = bench(1e-3);
    let order = ["run", "scenario.json", "--out", "out", "--real-time", "1"];
    let child = bench.start(&[&order[..], &["--checkpoint-every", "0.01"]].concat());
    wait_for(&bench.path("out/checkpoint.bin"));
    fs::rename(bench.path("out"), bench.path("moved")).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        told.contains("results to out") && told.contains("the folder no longer exists"),
        "{told}"
    );
    // what was moved is a whole checkpoint with its rows
    bench.maglev(&["resume", "moved", "--quiet"]).succeeds();
}
