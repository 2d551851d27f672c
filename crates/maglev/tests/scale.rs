//! Large systems: the time to start and to end grows with the number of instances, connections and
//! recorded signals, not with its square.
//!
//! Processor time counts, so that other load on the machine does not matter. Four times the size may
//! cost eight times the time; the square would be sixteen. With `SCALE=40000,200000` the sizes are these,
//! and the times are printed (`--nocapture`).

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test program")]

mod support;

use std::fmt::Write as _;
use std::fs;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION};

/// Processor time of `maglev run scenario.json` (s).
fn seconds(bench: &Bench, scenario: &Value) -> f64 {
    bench.scenario(scenario);
    let timed = "TIMEFORMAT='%U %S'; time maglev run scenario.json --out out --no-report --quiet";
    let ran = bench.shell(&format!(
        "{{ {timed} 2>errors; }} 2>times; status=$?; cat errors >&2; exit $status"
    ));
    ran.succeeds();
    let times = fs::read_to_string(bench.path("times")).unwrap();
    times.split_whitespace().map(|number| number.parse::<f64>().unwrap()).sum()
}

/// Sizes of this run: a quarter of the largest, and the largest.
fn sizes(which: usize, largest: usize) -> [usize; 2] {
    let wanted = std::env::var("SCALE").ok();
    let largest = wanted.map_or(largest, |it| it.split(',').nth(which).unwrap().parse().unwrap());
    [largest / 4, largest]
}

#[track_caller]
fn grows_like_its_size(what: &str, [small, large]: [usize; 2], seconds: impl Fn(usize) -> f64) {
    let times = [seconds(small), seconds(large)];
    eprintln!("{what}: {small} in {:.2} s, {large} in {:.2} s", times[0], times[1]);
    // the start of the program itself
    assert!(times[1] < 8.0 * times[0].max(0.05), "{what}: {times:?}");
}

/// A chain of instances: y of each is u of the next, and everything is recorded.
fn chain(n: usize, algorithm: &str) -> Value {
    json!({
        "units": { "unit": "unit.fmu" },
        "instances": { format!("a_[1..{n}]"): { "unit": "unit" } },
        "connections": [
            { "from": format!("a_[1..{}].y", n - 1), "to": format!("a_[2..{n}].u") }
        ],
        "experiment": { "stop": 0.2, "step": 0.1 },
        "algorithm": { "name": algorithm },
        "record": { "signals": ["a_*.y"] },
        "plots": [ { "file": "y.svg", "panels": [ { "ylabel": "y", "signals": ["a_[1..9].y"] } ] } ]
    })
}

#[test]
fn order_the_start_of_many_instances_is_linear() {
    let bench = Bench::new();
    for algorithm in ["gauss-seidel", "jacobi"] {
        grows_like_its_size(algorithm, sizes(0, 8000), |n| seconds(&bench, &chain(n, algorithm)));
    }
    let summary = bench.summary();
    assert_eq!(summary["units"]["unit"]["instances"], sizes(0, 8000)[1]);
}

/// Each instance and each connection by a line of its own, with a value of its own.
#[test]
fn order_the_start_of_many_lines_is_linear() {
    let bench = Bench::new();
    let scenario = |n: usize| {
        let mut scenario = chain(n, "gauss-seidel");
        let instances: serde_json::Map<_, _> = (1..=n)
            .map(|k| (format!("a_{k}"), json!({ "unit": "unit", "parameters": { "gain": 2.0 } })))
            .collect();
        scenario["instances"] = instances.into();
        scenario["connections"] = (1..n)
            .map(|k| json!({ "from": format!("a_{k}.z"), "to": format!("a_{}.u", k + 1) }))
            .collect();
        scenario["record"]["signals"] = (1..=n).map(|k| json!(format!("a_{k}.z"))).collect();
        scenario["algorithm"]["order"] = (1..=n).map(|k| json!(format!("a_{k}"))).collect();
        scenario
    };
    grows_like_its_size("lines", sizes(0, 8000), |n| seconds(&bench, &scenario(n)));
}

#[test]
fn order_the_start_of_many_recorded_signals_is_linear() {
    let bench = Bench::new();
    let run = |n: usize| {
        let (mut variables, mut outputs) = (String::new(), String::new());
        for k in 0..n {
            write!(
                variables,
                "<ScalarVariable name=\"y_{k}\" valueReference=\"{k}\" causality=\"output\" \
                 initial=\"calculated\"><Real unit=\"m\"/></ScalarVariable>"
            )
            .unwrap();
            write!(outputs, "<Unknown index=\"{}\" dependencies=\"\"/>", k + 1).unwrap();
        }
        let begin = DESCRIPTION.find("<ModelVariables>").unwrap();
        let description = format!(
            "{}<ModelVariables>{variables}</ModelVariables><ModelStructure><Outputs>{outputs}\
             </Outputs><InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure>\
             </fmiModelDescription>",
            &DESCRIPTION[..begin]
        );
        bench.source("wide.fmu", "wide.c", &description, &[]);
        let scenario = json!({
            "units": { "wide": "wide.fmu" },
            "instances": { "a": { "unit": "wide" } },
            "experiment": { "stop": 0.2, "step": 0.1 },
            "record": { "signals": [format!("a.y_[0..{}]", n / 2), "a.*"] }
        });
        seconds(&bench, &scenario)
    };
    grows_like_its_size("signals", sizes(1, 40_000), run);
    assert_eq!(bench.rows().len(), 3);
    assert_eq!(bench.rows()[2].len(), sizes(1, 40_000)[1] + 1);
}
