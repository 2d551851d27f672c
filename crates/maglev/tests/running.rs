//! Runs of real units through the command: results, conversions, all types, determinism.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use serde_json::json;
use support::{Bench, DESCRIPTION, ring};

/// x' = u with u = 2 held: x = 2t to rounding, ten additions of 0.2.
#[test]
fn analytic_a_constant_is_integrated() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    scenario["instances"]["a"]["start"] = json!({ "u": 2.0 });
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    let rows = bench.rows();
    assert_eq!(rows.len(), 11);
    for row in &rows {
        assert!((row[1] - 2.0 * row[0]).abs() < 1e-14, "{row:?}");
    }
    // a's output has derivative 2 on offer, so b sees a straight line: y = t² to rounding
    assert!((rows[10][2] - 1.0).abs() < 1e-14, "{:?}", rows[10]);
}

/// The same with every algorithm and each limit of input derivatives: a line needs order 1 only.
#[test]
fn analytic_lines_pass_through_every_coupling() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    scenario["instances"]["a"]["start"] = json!({ "u": 2.0 });
    bench.scenario(&scenario);
    for limit in ["1", "2", "3"] {
        bench.unit("unit.fmu", DESCRIPTION, &[&format!("-DMAX_INPUT_ORDER={limit}")]);
        for (algorithm, degree) in [("jacobi", "1"), ("jacobi", "3"), ("gauss-seidel", "0")] {
            bench.run(&["--algorithm", algorithm, "--extrapolation", degree]).succeeds();
            let last = bench.rows()[10][2];
            assert!((last - 1.0).abs() < 1e-14, "{limit} {algorithm} {degree}: {last}");
        }
    }
    // held: the sum of 2·t_n·h is 0.9
    bench.run(&["--algorithm", "jacobi", "--extrapolation", "0"]).succeeds();
    assert!((bench.rows()[10][2] - 0.9).abs() < 1e-14);
}

/// A unit that takes no input derivatives gets held values: Jacobi the old one, Gauss-Seidel the
/// new one.
#[test]
fn analytic_units_that_do_not_interpolate_get_held_values() {
    let bench = Bench::new();
    let plain = DESCRIPTION.replace("canInterpolateInputs=\"true\"", "");
    bench.unit("unit.fmu", &plain, &["-DMAX_INPUT_ORDER=0"]);
    let mut scenario = ring();
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    scenario["instances"]["a"]["start"] = json!({ "u": 2.0 });
    bench.scenario(&scenario);
    for (algorithm, expected) in [("jacobi", 0.9), ("gauss-seidel", 1.1)] {
        bench.run(&["--algorithm", algorithm]).succeeds();
        let last = bench.rows()[10][2];
        assert!((last - expected).abs() < 1e-14, "{algorithm}: {last}");
    }
}

/// An output in mm feeds an input in m; results.csv is in SI units.
#[test]
fn analytic_millimetres_become_metres() {
    let bench = Bench::new();
    let mm = DESCRIPTION.replacen(
        "name=\"y\" valueReference=\"1\" causality=\"output\" initial=\"calculated\">\n      <Real unit=\"m\"/>",
        "name=\"y\" valueReference=\"1\" causality=\"output\" initial=\"calculated\">\n      <Real unit=\"mm\"/>",
        1,
    );
    assert_ne!(mm, DESCRIPTION);
    bench.unit("unit.fmu", &mm, &[]);
    let mut scenario = ring();
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    scenario["instances"]["a"]["start"] = json!({ "u": 2.0 });
    scenario["record"]["signals"] = json!(["a.y", "b.u"]);
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    let last = bench.rows().pop().unwrap();
    // a.y counts millimetres: 2 mm after 1 s
    assert!((last[1] - 2e-3).abs() < 1e-17 && (last[2] - 2e-3).abs() < 1e-17, "{last:?}");
    assert_eq!(bench.summary()["signals"]["a.y"]["unit"], "m");
}

#[test]
fn issue_values_of_all_types_pass_through_connections() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" },
        { "from": "a.m", "to": "b.n" },
        { "from": "a.c", "to": "b.b" },
        { "from": "a.t", "to": "b.s" },
    ]);
    scenario["instances"]["a"]["start"] = json!({ "n": 7, "b": true, "s": "hello ü" });
    scenario["record"]["signals"] = json!(["b.m", "b.c", "b.*"]);
    bench.scenario(&scenario);
    for algorithm in ["jacobi", "gauss-seidel"] {
        bench.run(&["--algorithm", algorithm]).succeeds();
        let header = bench.result("results.csv").lines().next().unwrap().to_owned();
        assert!(header.starts_with("time,b.m,b.c,b.u,"), "{header}");
        for row in bench.rows() {
            assert_eq!((row[1], row[2]), (7.0, 1.0));
        }
    }
}

#[test]
fn invariant_two_runs_give_identical_bytes() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0 });
    scenario["plots"] = json!([{ "file": "p.svg", "panels": [{ "signals": ["a.*"] }] }]);
    bench.scenario(&scenario);
    let read = || {
        bench.run(&["--quiet", "--step", "0.001", "--set", "b.y=0"]).fails(2, &["cannot be set"]);
        bench.run(&["--quiet", "--step", "0.001"]).succeeds();
        (bench.result("results.csv"), bench.result("p.svg"))
    };
    let first = read();
    assert!(first == read());
    assert!(first.1.contains("<svg"));
}

#[test]
fn issue_patterns_connect_rows_and_statistics_take_every_step() {
    let bench = Bench::new();
    bench.scenario(&json!({
        "units": { "unit": "unit.fmu" },
        "instances": {
            "source": { "unit": "unit", "start": { "u": 1.0 } },
            "m_[01..03]": { "unit": "unit", "parameters": { "gain": 2.0 } }
        },
        "connections": [{ "from": "source.y", "to": "m_[01..03].u" }],
        "experiment": { "stop": 1.0, "step": 0.01 },
        "algorithm": { "order": ["source", "m_*"] },
        "record": { "interval": 0.5, "signals": ["m_[01..02].z", "m_*.z"] }
    }));
    let ran = bench.run(&["--set", "m_*.gain=3", "--set", "m_[02..03].gain=4"]);
    ran.succeeds();
    assert!(ran.stdout().contains("100 steps of 0.01 s"), "{}", ran.stdout());
    let csv = bench.result("results.csv");
    assert_eq!(csv.lines().next().unwrap(), "time,m_01.z,m_02.z,m_03.z");
    assert_eq!(csv.lines().count(), 4);
    let summary = bench.summary();
    // z = gain·t at 101 points: mean gain/2, square mean gain²·(2n+1)/(6n) with n = 100
    let z = &summary["signals"]["m_02.z"];
    let close = |key: &str, expected: f64| {
        let value = z[key].as_f64().unwrap();
        assert!((value - expected).abs() < 1e-13 * expected.max(1.0), "{key}: {value} {expected}");
    };
    close("max", 4.0);
    close("time_of_max", 1.0);
    close("min", 0.0);
    close("mean", 2.0);
    close("rms", 4.0 * (201.0_f64 / 600.0).sqrt());
    close("final", 4.0);
    assert_eq!(z["points"], 101);
    assert_eq!(summary["status"], "finished");
    assert_eq!(summary["units"]["unit"]["instances"], 4);
    assert_eq!(summary["units"]["unit"]["steps"], 400);
    assert_eq!(summary["algorithm"]["order"][0], "source");
}

/// One library, one instance each: copies are loaded where the unit asks for it.
#[test]
fn issue_units_that_allow_one_instance_per_process_run_side_by_side() {
    let bench = Bench::new();
    let once = "canBeInstantiatedOnlyOncePerProcess=\"true\" canInter";
    bench.unit("unit.fmu", &DESCRIPTION.replace("canInter", once), &[]);
    bench.scenario(&ring());
    bench.run(&[]).succeeds();
}

/// Ctrl-C ends the run with what was recorded.
#[cfg(unix)]
#[test]
fn issue_interrupted_runs_keep_their_results() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["experiment"] = json!({ "stop": 100_000.0, "step": 0.001 });
    scenario["record"]["interval"] = json!(1.0);
    bench.scenario(&scenario);
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_maglev"))
        .args(["run", "scenario.json", "--out", "out"])
        .current_dir(bench.path("."))
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(500));
    let killed =
        std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    let summary = bench.summary();
    assert_eq!(summary["status"], "interrupted");
    let rows = bench.rows();
    assert!(!rows.is_empty() && rows.len() as u64 == summary["rows"].as_u64().unwrap());
}

#[test]
fn issue_inspect_shows_what_the_unit_offers() {
    let bench = Bench::new();
    let ran = bench.maglev(&["inspect", "unit.fmu"]);
    ran.succeeds();
    let page = ran.stdout();
    for text in ["integrator", "test-unit", "gain", "[-10 … 10] (tunable)", "depends on 1 input"]
    {
        assert!(page.contains(text), "{text} is missing in:\n{page}");
    }
    let json = bench.maglev(&["inspect", "unit.fmu", "--json"]).stdout();
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["variables"][4]["name"], "gain");
    assert_eq!(value["coSimulation"]["canInterpolateInputs"], true);
}

#[test]
fn golden_the_printed_schema_is_the_committed_one() {
    let bench = Bench::new();
    let ran = bench.maglev(&["schema"]);
    ran.succeeds();
    let published = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/schema.json");
    assert!(ran.stdout() == fs::read_to_string(published).unwrap());
}
