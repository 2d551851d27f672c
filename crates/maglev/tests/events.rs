//! Signals that change at communication points only, connections between types, sums, and loops of
//! direct feed-through.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{Bench, with_states};

/// The description of `events.c`.
const EVENTS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="events" guid="events">
  <CoSimulation modelIdentifier="unit" canHandleVariableCommunicationStepSize="true"
    canGetAndSetFMUstate="true"/>
  <TypeDefinitions>
    <SimpleType name="Mode"><Enumeration>
      <Item name="off" value="1"/><Item name="slow" value="3"/><Item name="fast" value="5"/>
    </Enumeration></SimpleType>
    <SimpleType name="Other"><Enumeration>
      <Item name="fast" value="0"/><Item name="off" value="1"/>
    </Enumeration></SimpleType>
    <SimpleType name="Strange"><Enumeration>
      <Item name="red" value="1"/><Item name="green" value="5"/>
    </Enumeration></SimpleType>
  </TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name="step" valueReference="0" causality="output" variability="discrete"><Real/></ScalarVariable>
    <ScalarVariable name="noise" valueReference="1" causality="output" variability="discrete"><Real/></ScalarVariable>
    <ScalarVariable name="count" valueReference="0" causality="output" variability="discrete"><Integer/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="1" causality="output" variability="discrete">
      <Enumeration declaredType="Mode"/></ScalarVariable>
    <ScalarVariable name="mode_in" valueReference="2" causality="input" variability="discrete">
      <Enumeration declaredType="INPUT" start="1"/></ScalarVariable>
    <ScalarVariable name="mode_out" valueReference="3" causality="output" variability="discrete"><Integer/></ScalarVariable>
    <ScalarVariable name="on" valueReference="0" causality="output" variability="discrete"><Boolean/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="1" dependencies=""/><Unknown index="2" dependencies=""/><Unknown index="3" dependencies=""/>
      <Unknown index="4" dependencies=""/><Unknown index="6" dependencies="5"/><Unknown index="7" dependencies=""/>
    </Outputs>
    <InitialUnknowns>
      <Unknown index="1" dependencies=""/><Unknown index="2" dependencies=""/><Unknown index="3" dependencies=""/>
      <Unknown index="4" dependencies=""/><Unknown index="6" dependencies="5"/><Unknown index="7" dependencies=""/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;

/// A bench with `events.fmu`, whose `mode_in` is of the type given, and `unit.fmu`, which saves states.
fn bench(input: &str) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    bench.source("events.fmu", "events.c", &EVENTS.replace("INPUT", input), &[]);
    bench
}

/// `e` is events.fmu; a, b, c are integrators y' = u with z = gain · u. One second in steps of 0.1 s.
fn scenario(connections: Value, signals: Value) -> Value {
    json!({
        "units": { "unit": "unit.fmu", "events": "events.fmu" },
        "instances": {
            "e": { "unit": "events" },
            "a": { "unit": "unit" }, "b": { "unit": "unit" }, "c": { "unit": "unit" }
        },
        "connections": connections,
        "experiment": { "stop": 1.0, "step": 0.1 },
        "algorithm": { "order": ["e", "a", "b", "c"] },
        "record": { "signals": signals }
    })
}

const ALGORITHMS: [&str; 4] = ["jacobi", "gauss-seidel", "iterated", "newton"];

/// Sums of ten terms of size 12.
const ROUNDING: f64 = 1e-13;

#[track_caller]
fn close(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() < ROUNDING, "{what}: {found} instead of {expected}");
}

/// Whatever the algorithm and sequence: 12 V from 0.3 s on are 8.4 Vs at 1 s. Interpolated between
/// communication points they would be a ramp that begins at 0.2 s, extrapolated up to 36 V.
#[test]
fn analytic_a_discrete_output_reaches_its_receiver_as_a_step() {
    let bench = bench("Mode");
    for order in [["e", "a"], ["a", "e"]] {
        let connections = json!([{ "from": "e.step", "to": "a.u" }]);
        let mut scenario = scenario(connections, json!(["a.y"]));
        scenario["algorithm"]["order"] = json!(order);
        bench.scenario(&scenario);
        for algorithm in ALGORITHMS {
            bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
            for (n, row) in bench.rows().iter().enumerate() {
                let expected = 12.0 * (n as f64 / 10.0 - 0.3).max(0.0);
                close(row[1], expected, &format!("{algorithm} {order:?} {n}"));
            }
        }
    }
}

/// White noise is integrated as it is: the sum of what was there at the beginning of each step.
#[test]
fn analytic_noise_is_not_amplified() {
    let bench = bench("Mode");
    let connections = json!([{ "from": "e.noise", "to": "a.u" }]);
    bench.scenario(&scenario(connections, json!(["e.noise", "a.y", "a.z"])));
    for algorithm in ALGORITHMS {
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        let mut sum = 0.0;
        for (row, next) in bench.rows().iter().zip(&bench.rows()[1..]) {
            sum += 0.1 * row[1];
            close(next[2], sum, algorithm);
            close(next[3], row[1], algorithm);
        }
    }
}

/// What depends directly on a discrete signal jumps with it; what integrates it, kinks. Behind a unit
/// with feed-through, a unit that steps later has the jump in the same step, others in the next one:
/// by z the step passes through `a`, and `b` integrates it. y of `a` has a kink, which `c` integrates to
/// 6 (t − 0.3)²: exactly where it is interpolated; by Jacobi the step's first 0.1 s are extrapolated
/// from before the kink, which lacks 12 · 0.1²/2 for good, and nothing more.
#[test]
fn analytic_jumps_and_kinks_pass_through_units() {
    let bench = bench("Mode");
    let connections = json!([
        { "from": "e.step", "to": "a.u" }, { "from": "a.z", "to": "b.u" }, { "from": "a.y", "to": "c.u" }
    ]);
    bench.scenario(&scenario(connections, json!(["b.y", "c.y"])));
    for algorithm in ALGORITHMS {
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        let late = if algorithm == "jacobi" { 0.1 } else { 0.0 };
        for (n, row) in bench.rows().iter().enumerate() {
            let since = n as f64 / 10.0 - 0.3;
            close(row[1], 12.0 * (since - late).max(0.0), &format!("{algorithm} jump {n}"));
            let kink = 6.0 * since.max(0.0).powi(2);
            let lacking = if since > 0.05 { 6.0 * late * late } else { 0.0 };
            close(row[2], kink - lacking, &format!("{algorithm} kink {n}"));
        }
    }
}

/// Integers and Booleans are held from the beginning of the step too, and feed Reals and Integers.
#[test]
fn analytic_whole_numbers_and_booleans_feed_reals() {
    let bench = bench("Mode");
    let connections = json!([
        { "from": "e.count", "to": "a.u", "factor": 2.0, "offset": 1.0 },
        { "from": "e.on", "to": ["b.u", "b.n"] },
        { "from": "e.mode", "to": "c.u" },
        { "from": "e.mode", "to": "c.n" }
    ]);
    bench.scenario(&scenario(connections, json!(["a.y", "b.y", "b.m", "c.y", "c.m"])));
    for algorithm in ALGORITHMS {
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        for (n, row) in bench.rows().iter().enumerate() {
            let (time, on) = (n as f64 / 10.0, (n as f64 / 10.0 - 0.3).max(0.0));
            close(row[1], time + 14.0 * on, algorithm);
            close(row[2], on, algorithm);
            // given back at the end of the step that has it as input
            assert_eq!(row[3], f64::from(u8::from(n > 3)), "{algorithm} {n}");
            close(row[4], time + 4.0 * on, algorithm);
            assert_eq!(row[5], if n > 3 { 5.0 } else { 1.0 }, "{algorithm} {n}");
        }
    }
}

/// A sum with factors and an offset: 2 · 12 − t + 0.5, also in initialization.
#[test]
fn analytic_an_input_takes_the_sum_of_its_sources() {
    let bench = bench("Mode");
    let connections = json!([
        { "from": [{ "signal": "e.step", "factor": 2.0 }, { "signal": "b.y", "factor": -1.0 }, "e.on"],
          "to": "a.u", "offset": 0.5 }
    ]);
    let mut scenario = scenario(connections, json!(["a.y", "a.z"]));
    scenario["instances"]["b"]["start"] = json!({ "u": 1.0 });
    scenario["algorithm"]["order"] = json!(["e", "b", "a"]);
    bench.scenario(&scenario);
    for algorithm in ALGORITHMS {
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        let rows = bench.rows();
        close(rows[0][2], 0.5, "the input after initialization");
        for (n, row) in rows.iter().enumerate() {
            let (time, on) = (n as f64 / 10.0, (n as f64 / 10.0 - 0.3).max(0.0));
            close(row[1], 0.5 * time - time * time / 2.0 + 25.0 * on, algorithm);
        }
    }
}

/// Enumerations pass by the names of their items: "fast" is 5 here and 0 there.
#[test]
fn analytic_enumerations_pass_by_their_items() {
    let bench = bench("Other");
    let mut scenario =
        scenario(json!([{ "from": "f.mode", "to": "e.mode_in" }]), json!(["e.mode_out"]));
    scenario["instances"]["f"] = json!({ "unit": "events" });
    bench.scenario(&scenario);
    let ran = bench.run(&[]);
    ran.succeeds();
    assert!(ran.stderr().contains("no item \"slow\" (3) of f.mode"), "{}", ran.stderr());
    let modes: Vec<f64> = bench.rows().iter().map(|row| row[1]).collect();
    assert_eq!(modes, [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

/// Tables replace values from the initialization on; what they do not list passes as without them.
#[test]
fn analytic_tables_replace_values() {
    let bench = bench("Other");
    let mut scenario = scenario(
        json!([
            { "from": "f.mode", "to": "e.mode_in", "map": { "slow": "off", "off": "fast" } },
            { "from": "f.count", "to": "a.n", "map": { "7": 100, "8": 9 } },
            { "from": "f.on", "to": "a.b", "map": { "false": true, "true": false } },
            { "from": "f.on", "to": "b.b", "map": { "true": false } }
        ]),
        json!(["e.mode_out", "a.m", "a.c", "b.c"]),
    );
    scenario["instances"]["f"] = json!({ "unit": "events" });
    scenario["algorithm"]["order"] = json!(["f", "e", "a", "b", "c"]);
    bench.scenario(&scenario);
    for algorithm in ALGORITHMS {
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        let rows = bench.rows();
        assert_eq!(rows[0][1..], [0.0, 0.0, 1.0, 0.0], "after initialization: off has become fast");
        // fast is 5 there and 0 here
        assert_eq!(rows[10][1..], [0.0, 100.0, 0.0, 0.0], "{algorithm}");
    }
    for (to, table, parts) in [
        ("a.n", json!({ "7": "on" }), ["\"on\" is not a value of the input", "Integer"]),
        ("e.mode_in", json!({ "7": 2 }), ["2 is not a value", "\"fast\" (0), \"off\" (1)"]),
        ("a.u", json!({ "7": 2 }), ["f.count to a.u", "not for Integer to Real"]),
    ] {
        scenario["connections"] = json!([{ "from": "f.count", "to": to, "map": table }]);
        bench.scenario(&scenario);
        bench.run(&["--quiet"]).fails(2, &parts);
    }
    scenario["connections"][0] =
        json!({ "from": "f.count", "to": "a.n", "map": { "7": 2 }, "factor": 2.0 });
    bench.scenario(&scenario);
    bench.run(&["--quiet"]).fails(2, &["factor, offset and sums need a Real input"]);
}

/// A number that is no item stops the run where it arises; Enumerations without a common item, and what
/// would need rounding, do not connect.
#[test]
fn issue_values_that_are_no_items_are_refused() {
    let bench = bench("Other");
    let with = |from: &str, to: &str| {
        let mut scenario = scenario(json!([{ "from": from, "to": to }]), json!(["e.mode_out"]));
        scenario["instances"]["f"] = json!({ "unit": "events" });
        bench.scenario(&scenario);
        bench.run(&["--quiet"])
    };
    with("f.count", "e.mode_in").fails(1, &["f", "count is 7 at 0.3", "not an item of e.mode_in"]);
    with("a.m", "e.mode_in").succeeds();
    for (from, to) in [("f.step", "a.n"), ("f.count", "a.b"), ("f.on", "e.mode_in"), ("a.t", "a.u")]
    {
        with(from, to).fails(2, &[from, to, "is of type"]);
    }
    let strange = self::bench("Strange");
    strange.scenario(&{
        let mut scenario =
            scenario(json!([{ "from": "f.mode", "to": "e.mode_in" }]), json!(["e.mode_out"]));
        scenario["instances"]["f"] = json!({ "unit": "events" });
        scenario
    });
    strange.run(&["--quiet"]).fails(2, &["no item in common", "\"fast\" (5)", "\"green\" (5)"]);
    let mut sum =
        scenario(json!([{ "from": ["e.count", "e.count"], "to": "a.n" }]), json!(["a.m"]));
    bench.scenario(&sum);
    bench.run(&["--quiet"]).fails(2, &["a.n is of type Integer", "sums need a Real"]);
    sum["connections"] = json!([{ "from": "e.count", "to": "a.n", "kinks": true }]);
    bench.scenario(&sum);
    let expected = ["kinks is for connections of a Real to a Real", "e.count", "a.n"];
    bench.run(&["--quiet"]).fails(2, &expected);
    sum["connections"] =
        json!([{ "from": "e.on", "to": "a.u" }, { "from": "e.count", "to": "a.u" }]);
    bench.scenario(&sum);
    bench.run(&["--quiet"]).fails(2, &["a.u", "\"from\" is a list"]);
}

/// a.u = t + k · b.z and b.u = a.z: a loop of direct feed-through with the solution a.z = t/(1 − k).
fn looped(k: f64) -> Value {
    let connections = json!([
        { "from": ["c.y", { "signal": "b.z", "factor": k }], "to": "a.u" }, { "from": "a.z", "to": "b.u" }
    ]);
    let mut scenario = scenario(connections, json!(["a.z"]));
    scenario["instances"]["c"]["start"] = json!({ "u": 1.0 });
    scenario["experiment"] = json!({ "stop": 20.0, "step": 0.01 });
    scenario
}

/// In a loop that the algorithm does not solve, inputs are held, and it settles to within some steps'
/// worth of the ramp; extrapolated to degree 2 it would grow without bound. Newton solves it.
#[test]
fn analytic_loops_of_feed_through_settle_by_default() {
    let bench = bench("Mode");
    bench.scenario(&looped(-0.9));
    for (algorithm, allowed) in
        [("jacobi", 0.02), ("gauss-seidel", 0.02), ("iterated", 1e-4), ("newton", 1e-4)]
    {
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        let end = bench.rows()[2000][1];
        assert!((end - 20.0 / 1.9).abs() < allowed, "{algorithm}: {end}");
        let summary = bench.summary();
        let limits = summary["algorithm"]["limits"].to_string();
        let held = limits.contains("b.z, a.z: in an algebraic loop");
        assert_eq!(held, matches!(algorithm, "jacobi" | "gauss-seidel"), "{algorithm}: {limits}");
    }
    let ran = bench.run(&["--extrapolation", "2"]);
    ran.fails(1, &["the algebraic loop through b.z, a.z", "newton", "does not help"]);
    assert!(ran.stderr().contains("as the scenario sets it"), "{}", ran.stderr());
}

/// Held, a loop of gain 1.5 grows; the failure names the loop and what solves it, and that does.
#[test]
fn issue_a_loop_that_blows_up_is_named_with_its_remedy() {
    let bench = bench("Mode");
    bench.scenario(&looped(-1.5));
    for algorithm in ["jacobi", "gauss-seidel"] {
        bench
            .run(&["--quiet", "--algorithm", algorithm])
            .fails(1, &["values grew without bound", "b.z, a.z", "\"newton\""]);
    }
    bench.run(&["--quiet", "--algorithm", "newton"]).succeeds();
    let end = bench.rows()[2000][1];
    assert!((end - 20.0 / 2.5).abs() < 1e-4, "{end}");
}
