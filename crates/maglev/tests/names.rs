//! Names of variables that look like patterns: a name that exists is itself, everywhere.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION};

/// y is called `y[1..2]`, z `z*`, gain `gain[1..3]`, u `u.[01..02]*`; there are a `y1` and a `zz`, too.
fn description() -> String {
    let odd = DESCRIPTION
        .replace("name=\"y\"", "name=\"y[1..2]\"")
        .replace("name=\"z\"", "name=\"z*\"")
        .replace("name=\"gain\"", "name=\"gain[1..3]\"")
        .replace("name=\"u\"", "name=\"u.[01..02]*\"")
        .replace("name=\"m\" valueReference=\"2\"", "name=\"zz\" valueReference=\"2\"")
        .replace("name=\"c\" valueReference=\"1\"", "name=\"y1\" valueReference=\"1\"");
    assert!(odd.contains("y1") && odd.contains("zz"));
    odd
}

fn scenario() -> Value {
    json!({
        "units": { "unit": "unit.fmu" },
        "instances": {
            "a_[1..2]": {
                "unit": "unit",
                "parameters": { "gain[1..3]": 2.0 },
                "start": { "u.[01..02]*": 3.0 }
            },
            "b_[1..2]": { "unit": "unit" }
        },
        "connections": [
            { "from": "a_[1..2].z*", "to": "b_[1..2].u.[01..02]*" }
        ],
        "experiment": { "stop": 0.1, "step": 0.1 },
        "algorithm": {
            "name": "iterated",
            "sizes": { "a_*.z*": 2.0 },
            "power": [ { "effort": "a_[1..2].z*", "flow": "a_[1..2].z*" } ]
        },
        "record": { "signals": ["a_1.y[1..2]", "b_[1..2].y[1..2]", "*.z*", "a_*.u.[01..02]*"] },
        "plots": [ { "file": "z.svg", "panels": [ { "ylabel": "z", "signals": ["a_1.z*"] } ] } ]
    })
}

#[test]
fn issue_names_that_look_like_patterns_are_themselves() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &description(), &[]);
    bench.scenario(&scenario());
    let ran = bench.run(&["--set", "a_2.gain[1..3]=5", "--set", "a_1.u.[01..02]*=4"]);
    ran.succeeds();
    let header = bench.result("results.csv").lines().next().unwrap().to_owned();
    assert_eq!(
        header,
        "time,a_1.y[1..2],b_1.y[1..2],b_2.y[1..2],a_1.z*,a_2.z*,b_1.z*,b_2.z*,\
         a_1.u.[01..02]*,a_2.u.[01..02]*"
    );
    // a_1: u = 4 and gain 2; a_2: u = 3 and gain 5; b: the integrals of z, gain 1
    let row = &bench.rows()[1];
    let expected = [0.4, 0.8, 1.5, 8.0, 15.0, 8.0, 15.0, 4.0, 3.0];
    for (value, expected) in row[1..].iter().zip(expected) {
        assert!((value - expected).abs() < 1e-12, "{row:?}");
    }
    // what ran runs again
    let first = bench.result("results.csv");
    std::fs::copy(bench.path("out/scenario-as-run.json"), bench.path("again.json")).unwrap();
    bench.maglev(&["run", "again.json", "--out", "out"]).succeeds();
    assert_eq!(bench.result("results.csv"), first);
    let report = bench.result("report.html");
    assert!(report.contains("a_1.z*"));
}

/// Where a unit has no such name, the pattern is one.
#[test]
fn issue_patterns_are_patterns_where_no_variable_has_their_name() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &description(), &[]);
    bench.unit("plain.fmu", DESCRIPTION, &[]);
    let mut scenario = scenario();
    scenario["units"]["plain"] = json!("plain.fmu");
    scenario["instances"]["c"] = json!({ "unit": "plain" });
    scenario["record"]["signals"] = json!(["*.z*", "c.*"]);
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    let header = bench.result("results.csv").lines().next().unwrap().to_owned();
    assert_eq!(
        header,
        "time,a_1.z*,a_2.z*,b_1.z*,b_2.z*,c.z,c.u,c.y,c.fail_time,c.gain,c.fault,c.n,c.m,c.b,c.c"
    );
    bench.run(&["--set", "c.gain[1..3]=1"]).fails(2, &["no variable \"gain1\" in c"]);
    bench.run(&["--set", "c.q*=1"]).fails(2, &["\"c.q*\" matches nothing"]);
    bench.run(&["--set", "d*.z=1"]).fails(2, &["\"d*.z\" matches nothing"]);
    bench.run(&["--set", "c_[2..1].z=1"]).fails(2, &["[2..1] runs backwards"]);
}

/// A value for an input that a connection feeds would have no effect: it is refused on the command
/// line, and remarked in a scenario.
#[test]
fn issue_values_for_connected_inputs_are_refused() {
    let bench = Bench::new();
    let mut scenario = support::ring();
    scenario["connections"] = json!([ { "from": "a.y", "to": "b.u" } ]);
    bench.scenario(&scenario);
    let texts = ["--set b.u=3: the value has no effect, because b.u is connected to a.y", "help:"];
    bench.run(&["--set", "b.u=3"]).fails(2, &texts);
    bench.run(&["--set", "*.u=3"]).fails(2, &["--set *.u=3: the value has no effect, because b.u"]);
    bench.run(&["--set", "a.u=3"]).succeeds();
    assert!((bench.rows()[10][1] - 3.0).abs() < 1e-12);
    scenario["instances"]["b"]["start"] = json!({ "u": 3.0 });
    bench.scenario(&scenario);
    let ran = bench.run(&[]);
    ran.succeeds();
    let note = "note: instances.b.start: the value has no effect, because b.u is connected to a.y";
    assert!(ran.stderr().contains(note), "{}", ran.stderr());
}

/// In a loop of the initialization it is a first guess, and has one: z = gain·u of both units leads
/// back, so with gains of 0.5 the loop settles at 0 from anywhere, in more sweeps from afar.
#[test]
fn issue_first_guesses_in_loops_are_taken() {
    let bench = Bench::new();
    let mut scenario = support::ring();
    scenario["connections"] =
        json!([ { "from": "a.z", "to": "b.u" }, { "from": "b.z", "to": "a.u" } ]);
    scenario["instances"]["a"]["parameters"] = json!({ "gain": 0.5 });
    scenario["instances"]["b"]["parameters"] = json!({ "gain": 0.5 });
    scenario["record"]["signals"] = json!(["a.z"]);
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    let sweeps = |bench: &Bench| bench.summary()["initial_loops"][0]["sweeps"].as_u64().unwrap();
    let from_zero = sweeps(&bench);
    bench.run(&["--set", "a.u=1000"]).succeeds();
    assert!(sweeps(&bench) > from_zero, "{} {from_zero}", sweeps(&bench));
}
