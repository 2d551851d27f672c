//! Units in worker processes: the same bits as in this process, for everything an instance can do.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use fmi2_import::instance::{FmuError, Instance};
use fmi2_import::isolate::Isolation;
use fmi2_import::library::Functions;
use fmi2_import::package::Package;
use serde_json::json;
use support::{Bench, ring, with_states};

fn isolation() -> Isolation {
    Isolation { program: Some(env!("CARGO_BIN_EXE_maglev").into()), ..Isolation::default() }
}

/// One of each kind, initialized.
fn pair(bench: &Bench) -> [Instance; 2] {
    bench.unit("unit.fmu", &with_states(), &[]);
    let package = Arc::new(Package::open(&bench.path("unit.fmu")).unwrap());
    let functions = Functions::load(&package).unwrap();
    let here = Instance::new(&package, functions, &Arc::default(), "a").unwrap();
    let elsewhere = Instance::isolated(&package, &isolation(), "a").unwrap();
    assert!(elsewhere.is_isolated() && !here.is_isolated());
    [here, elsewhere].map(|mut unit| {
        unit.setup_experiment(None, 0.0, 1.0).unwrap();
        unit.set_real(&[4], &[1.5]).unwrap();
        unit.enter_initialization_mode().unwrap();
        unit.set_real(&[0], &[0.1]).unwrap();
        unit.exit_initialization_mode().unwrap();
        unit
    })
}

fn texts<T: std::fmt::Debug>(result: Result<T, FmuError>) -> String {
    match result {
        Ok(value) => format!("{value:?}"),
        Err(error) => error.to_string(),
    }
}

fn reals(unit: &mut Instance) -> Vec<u64> {
    let mut values = [0.0; 3];
    unit.get_real(&[0, 1, 2], &mut values).unwrap();
    values.map(f64::to_bits).to_vec()
}

/// Everything an instance can do, done in both: values, texts, states, errors, messages.
#[test]
fn invariant_isolated_instances_do_the_same() {
    let bench = Bench::new();
    let done = pair(&bench).map(|mut unit| {
        let mut seen: Vec<String> = Vec::new();
        unit.set_integer(&[1], &[-7]).unwrap();
        unit.set_boolean(&[0], &[1]).unwrap();
        unit.set_string(0, c"text \u{fc}").unwrap();
        unit.set_real_input_derivatives(&[0], &[1], &[0.3]).unwrap();
        unit.do_step(0.0, 0.1).unwrap();
        let (mut integer, mut boolean, mut slope) = ([0], [0], [0.0]);
        unit.get_integer(&[2], &mut integer).unwrap();
        unit.get_boolean(&[1], &mut boolean).unwrap();
        unit.get_real_output_derivatives(&[1], &[1], &mut slope).unwrap();
        seen.push(format!("{integer:?} {boolean:?} {:?} {slope:?}", unit.get_string(1).unwrap()));
        seen.push(format!("{:?}", reals(&mut unit)));
        // states: saved, serialized, restored, freed
        let saved = unit.save_state(None).unwrap();
        let bytes = unit.serialize_state(saved).unwrap();
        seen.push(format!("{}", bytes.len()));
        unit.do_step(0.1, 0.1).unwrap();
        let after = reals(&mut unit);
        unit.restore_state(saved).unwrap();
        unit.do_step(0.1, 0.1).unwrap();
        assert_eq!(reals(&mut unit), after);
        let again = unit.deserialize_state(&bytes).unwrap();
        unit.restore_state(again).unwrap();
        unit.do_step(0.1, 0.1).unwrap();
        assert_eq!(reals(&mut unit), after);
        unit.free_state(saved).unwrap();
        seen.push(texts(unit.restore_state(saved)));
        seen.push(texts(unit.report("anything")));
        seen.push(format!("{after:?}"));
        // errors and messages
        let mut out = [0.0];
        seen.push(texts(unit.get_directional_derivative(&[1], &[0], &[1.0], &mut out)));
        unit.set_integer(&[0], &[2]).unwrap();
        unit.set_real(&[3], &[0.0]).unwrap();
        unit.do_step(0.2, 0.1).unwrap();
        assert!(unit.warnings().count() > 0);
        seen.push(format!("{:?}", unit.take_messages()));
        unit.set_integer(&[0], &[4]).unwrap();
        seen.push(texts(unit.do_step(0.3, 0.1)));
        seen.push(texts(unit.terminate()));
        seen
    });
    assert_eq!(done[0], done[1]);
    assert!(done[0].iter().any(|text| text.contains("u is odd at 100 #")), "{:?}", done[0]);
}

/// Whole runs, all types, both algorithms, with and without own processes: the same bytes.
#[test]
fn invariant_isolated_runs_give_the_same_bytes() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    let mut scenario = ring();
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" }, { "from": "b.z", "to": "a.u" },
        { "from": "a.m", "to": "b.n" }, { "from": "a.t", "to": "b.s" },
    ]);
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0, "n": 7, "s": "ü" });
    scenario["record"]["signals"] = json!(["a.*", "b.*"]);
    for mixed in [false, true] {
        if mixed {
            scenario["instances"]["b"]["isolate"] = json!(true);
        }
        bench.scenario(&scenario);
        for algorithm in ["jacobi", "gauss-seidel"] {
            let mut results = Vec::new();
            for further in [&[][..], &["--isolate"]] {
                let choice = [&["--algorithm", algorithm, "--step", "0.001"], further].concat();
                bench.run(&choice).succeeds();
                results.push(bench.result("results.csv"));
            }
            assert!(results[0] == results[1], "{algorithm}");
        }
    }
}

/// A unit that allows one instance per process gets one for each.
#[test]
fn issue_one_instance_per_process() {
    let bench = Bench::new();
    let once = "canBeInstantiatedOnlyOncePerProcess=\"true\" canInterpolateInputs";
    let once = support::DESCRIPTION.replace("canInterpolateInputs", once);
    bench.unit("unit.fmu", &once, &[]);
    bench.scenario(&ring());
    bench.run(&["--isolate"]).succeeds();
    let isolated = bench.result("results.csv");
    bench.run(&[]).succeeds();
    assert!(isolated == bench.result("results.csv"));
}

/// What cannot be loaded says why, as in this process.
#[test]
fn issue_what_cannot_be_loaded_says_why() {
    let bench = Bench::new();
    let place = "binaries/linux64/unit.so";
    let description = ("modelDescription.xml", support::DESCRIPTION.as_bytes());
    bench.scenario(&ring());
    bench.pack("unit.fmu", &[description, (place, b"no library")]);
    bench.run(&["--isolate"]).fails(2, &["unit a cannot be loaded", "cannot be loaded; because"]);
    bench.pack("unit.fmu", &[description]);
    bench.run(&["--isolate"]).fails(2, &["has no binary for linux64"]);
    bench.unit("unit.fmu", support::DESCRIPTION, &["-DGUID=\"other\""]);
    bench.run(&["--isolate"]).fails(2, &["unit a refused", "GUID test-unit does not fit"]);
}

fn processes(text: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir("/proc").unwrap().flatten().map(|entry| entry.path());
    let named = |path: &PathBuf| {
        let line = fs::read(path.join("cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&line).contains(text)
    };
    entries.filter(named).collect()
}

/// Workers die with their master, also when they are in an endless loop and it is killed.
#[test]
fn issue_no_worker_is_left_behind() {
    let bench = Bench::new();
    bench.unit("unit.fmu", support::DESCRIPTION, &["-DHOSTILE"]);
    let name = format!("lonely{}", std::process::id());
    let mut scenario = ring();
    scenario["instances"][&name] = json!({ "unit": "unit" });
    bench.scenario(&scenario);
    let mut master = Command::new(env!("CARGO_BIN_EXE_maglev"))
        .args(["run", "scenario.json", "--out", "out", "--isolate", "--quiet"])
        .env("HOSTILE", format!("{name} fmi2DoStep loop 0.35"))
        .current_dir(bench.path("."))
        .spawn()
        .unwrap();
    let wait = |there: bool| {
        let begin = Instant::now();
        while processes(&name).is_empty() == there {
            assert!(begin.elapsed() < Duration::from_secs(60), "worker there: {}", !there);
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    wait(true);
    std::thread::sleep(Duration::from_millis(200));
    master.kill().unwrap();
    master.wait().unwrap();
    wait(false);
}

/// Prints what isolation and saved states cost per unit and step (docs/survival.md):
/// `cargo test --release -p maglev-cli --test isolate -- --ignored --nocapture measure`
#[test]
#[ignore = "a measurement, for an idle machine"]
fn measure_cost_per_unit_and_step() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    println!("µs per unit and step; ring of small units");
    println!("units  algorithm     in process  with saved states  isolated  with saved states");
    for units in [1, 2, 16, 64] {
        let name = |k: usize| format!("u{:02}", k % units);
        let mut scenario = json!({
            "units": { "unit": "unit.fmu" },
            "instances": {}, "connections": [],
            "experiment": { "stop": if units < 16 { 20.0 } else { 2.0 }, "step": 0.001 },
            "record": { "interval": 1.0, "signals": ["u00.y"] }
        });
        for k in 0..units {
            scenario["instances"][name(k)] = json!({ "unit": "unit", "start": { "u": 0.1 } });
            let link =
                json!({ "from": format!("{}.y", name(k)), "to": format!("{}.u", name(k + 1)) });
            scenario["connections"].as_array_mut().unwrap().push(link);
        }
        for algorithm in ["jacobi", "gauss-seidel"] {
            let mut row = format!("{units:>5}  {algorithm:<12}");
            for (isolation, discard) in [
                (&[][..], "fail"),
                (&[], "retry"),
                (&["--isolate"], "fail"),
                (&["--isolate"], "retry"),
            ] {
                scenario["algorithm"] = json!({ "name": algorithm, "on_discard": discard });
                bench.scenario(&scenario);
                let mut best = f64::INFINITY;
                for _ in 0..3 {
                    bench.run(&[&["--quiet"], isolation].concat()).succeeds();
                    let summary = bench.summary();
                    let seconds = summary["wall_time"]["run_seconds"].as_f64().unwrap();
                    let steps = summary["steps"].as_f64().unwrap() * units as f64;
                    best = best.min(1e6 * seconds / steps);
                }
                row += &format!("{best:>12.2}");
            }
            println!("{row}");
        }
    }
}
