//! Units that break where units of widespread exporters break: at what the master might try of them.
//! Nothing may be tried that could end in `fmi2Error`, and what breaks all the same must not pass for a
//! finished run. The unit is tests/support/fragile.c.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::path::Path;

use master::Setup;
use scenario::Scenario;
use serde_json::{Value, json};
use support::{Bench, ring};

const CAN: &str = "canHandleVariableCommunicationStepSize=\"true\" canInterpolateInputs=\"true\"";
const STATES: &str = "canGetAndSetFMUstate=\"true\"";
const DIRECTIONAL: &str = "providesDirectionalDerivative=\"true\"";
const OUTPUTS: &str = "maxOutputDerivativeOrder=\"1\"";
/// The annotation of the exporter that comes with the master.
const ANNOTATED: &str = "<VendorAnnotations><Tool name=\"fmi2-export\"><Derivatives inputs=\"3\">\
    <Outputs order=\"1\" variables=\"2\"/></Derivatives></Tool></VendorAnnotations>";

/// The description of fragile.c with these attributes of `<CoSimulation>`.
fn description(attributes: &[&str], annotations: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="fragile" guid="fragile">
  <CoSimulation modelIdentifier="unit" {}/>{annotations}
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input" variability="continuous">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output" variability="continuous"
      initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="z" valueReference="2" causality="output" variability="continuous"
      initial="calculated"><Real/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="3" causality="parameter" variability="fixed">
      <Real start="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/><Unknown index="3" dependencies="1"/></Outputs>
    <InitialUnknowns><Unknown index="3" dependencies="1 4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>"#,
        attributes.join(" ")
    )
}

/// A bench with `fragile.fmu`, and `unit.fmu` to feed it.
fn bench(attributes: &[&str], defines: &[&str]) -> Bench {
    annotated(attributes, "", defines)
}

fn annotated(attributes: &[&str], annotations: &str, defines: &[&str]) -> Bench {
    let bench = Bench::new();
    let description = description(attributes, annotations);
    bench.source("fragile.fmu", "fragile.c", &description, defines);
    bench
}

/// c.y = t feeds the fragile b over 10 steps of 0.1 s: b.y = t²/2 where lines get through.
fn line() -> Value {
    json!({
        "units": { "unit": "unit.fmu", "fragile": "fragile.fmu" },
        "instances": { "c": { "unit": "unit", "start": { "u": 1.0 } }, "b": { "unit": "fragile" } },
        "connections": [{ "from": "c.y", "to": "b.u" }],
        "experiment": { "stop": 1.0, "step": 0.1 },
        "algorithm": { "order": ["c", "b"] },
        "record": { "signals": ["b.y"] }
    })
}

/// c.y = t, a.y = t²/2 exactly, b.y = t³/6 where parabolas get through.
fn parabola() -> Value {
    let mut scenario = line();
    scenario["instances"]["a"] = json!({ "unit": "unit", "input_derivatives": 3 });
    scenario["connections"] =
        json!([{ "from": "c.y", "to": "a.u" }, { "from": "a.y", "to": "b.u" }]);
    scenario["algorithm"]["order"] = json!(["c", "a", "b"]);
    scenario
}

/// b.y at 1 s.
#[track_caller]
fn last(bench: &Bench) -> f64 {
    bench.rows().last().unwrap()[1]
}

/// What b was called for, up to its first step.
fn calls(bench: &Bench, until: &str) -> Vec<String> {
    let text = bench.calls();
    let calls: Vec<String> =
        text.lines().filter_map(|line| line.strip_prefix("b ")).map(str::to_owned).collect();
    let end = calls.iter().position(|call| call == until).unwrap();
    calls[..=end].to_vec()
}

fn limits(bench: &Bench) -> String {
    bench.summary()["algorithm"]["limits"].to_string()
}

/// The list in docs/imports.md: a unit with nothing connected.
#[test]
fn golden_calls_before_the_first_step_of_a_unit_alone() {
    let bench = bench(&[CAN, STATES, DIRECTIONAL, OUTPUTS], &[]);
    let mut scenario = line();
    scenario["connections"] = json!([]);
    scenario["algorithm"]["on_discard"] = json!("fail");
    bench.scenario(&scenario);
    bench.recorded(&[]).succeeds();
    assert_eq!(
        calls(&bench, "fmi2DoStep"),
        [
            "fmi2Instantiate",
            "fmi2SetupExperiment",
            "fmi2EnterInitializationMode",
            "fmi2SetReal 0",
            "fmi2ExitInitializationMode",
            "fmi2GetReal 1",
            "fmi2DoStep",
        ]
    );
}

/// The same of one with connected Reals that takes derivatives of inputs and gives some of outputs.
#[test]
fn golden_calls_before_the_first_step_of_a_connected_unit() {
    let bench = bench(&[CAN, DIRECTIONAL, OUTPUTS], &[]);
    let mut scenario = line();
    scenario["instances"]["d"] = json!({ "unit": "unit" });
    scenario["connections"] =
        json!([{ "from": "c.y", "to": "b.u" }, { "from": "b.y", "to": "d.u" }]);
    bench.scenario(&scenario);
    bench.recorded(&[]).succeeds();
    assert_eq!(
        calls(&bench, "fmi2DoStep"),
        [
            "fmi2Instantiate",
            "fmi2SetupExperiment",
            "fmi2EnterInitializationMode",
            "fmi2GetReal 1",
            "fmi2SetReal 0",
            "fmi2ExitInitializationMode",
            "fmi2GetRealOutputDerivatives 1:1",
            "fmi2GetReal 1",
            "fmi2GetRealOutputDerivatives 1:1",
            // what has its value only now
            "fmi2SetReal 0",
            // the step's
            "fmi2SetReal 0",
            "fmi2SetRealInputDerivatives 0:1",
            "fmi2DoStep",
        ]
    );
}

/// The same of one in an algorithm that saves states and takes directional derivatives.
#[test]
fn golden_calls_before_the_first_step_of_a_unit_with_states() {
    let bench = bench(&[CAN, STATES, DIRECTIONAL], &[]);
    let mut scenario = line();
    scenario["instances"]["d"] = json!({ "unit": "unit" });
    scenario["connections"] =
        json!([{ "from": "c.y", "to": "b.u" }, { "from": "b.z", "to": "d.u" }]);
    scenario["algorithm"] = json!({ "name": "newton", "order": ["c", "b", "d"] });
    bench.scenario(&scenario);
    bench.recorded(&[]).succeeds();
    assert_eq!(
        calls(&bench, "fmi2DoStep"),
        [
            "fmi2Instantiate",
            "fmi2SetupExperiment",
            "fmi2EnterInitializationMode",
            "fmi2SetReal 0",
            "fmi2GetReal 2",
            "fmi2ExitInitializationMode",
            // for steps that are discarded
            "fmi2GetFMUstate",
            // for steps that are made again
            "fmi2GetFMUstate",
            "fmi2SetFMUstate",
            "fmi2GetDirectionalDerivative 1/1",
            "fmi2GetReal 2 1",
            "fmi2SetReal 0",
            "fmi2GetFMUstate",
            "fmi2SetReal 0",
            "fmi2SetRealInputDerivatives 0:1",
            "fmi2GetFMUstate",
            "fmi2DoStep",
        ]
    );
}

/// Units that answer a directional derivative of nothing, or a second derivative of an input, with
/// fmi2Error or fmi2Warning and are dead or deaf afterwards: they are run as their makers meant. A line
/// passes exactly: rounding of 30 operations of size 1.
#[test]
fn issue_units_that_crash_when_probed_run_with_the_right_result() {
    let all = [CAN, STATES, DIRECTIONAL, OUTPUTS];
    for defines in [
        &["-DEMPTY=3", "-DORDER2=0", "-DDEAD=3"][..],
        &["-DEMPTY=3", "-DORDER2=0", "-DDEAD=1"],
        &["-DORDER2=3", "-DDEAD=3"],
        &["-DORDER2=3", "-DDEAD=1"],
        &["-DORDER2=1", "-DDEAD=1"],
        &["-DORDER2=2", "-DDEAD=1"],
    ] {
        let bench = bench(&all, defines);
        bench.scenario(&line());
        for more in
            [&[][..], &["--isolate"], &["--algorithm", "jacobi"], &["--algorithm", "newton"]]
        {
            let ran = bench.run(more);
            ran.succeeds();
            assert!((last(&bench) - 0.5).abs() < 1e-13, "{defines:?} {more:?}: {}", last(&bench));
            assert!(!ran.stderr().contains("warns"), "{}", ran.stderr());
            assert_eq!(bench.summary()["instances"]["b"]["warned_steps"], 0);
        }
        // with nothing connected it integrates its start value 1
        let mut scenario = line();
        scenario["connections"] = json!([]);
        scenario["instances"]["b"]["start"] = json!({ "u": 1.0 });
        bench.scenario(&scenario);
        for algorithm in ["gauss-seidel", "newton", "iterated"] {
            bench.run(&["--algorithm", algorithm]).succeeds();
            assert!((last(&bench) - 1.0).abs() < 1e-13, "{defines:?} {algorithm}");
        }
    }
}

/// One that ignores mixed calls once it was asked for order 2: lines get through, so b.y errs by
/// p''·h²/12 = 8.3e-4, not by h/4 = 2.5e-2 as with held inputs. `limits` says which order it takes.
#[test]
fn order_a_unit_of_order_one_gets_lines() {
    let bench = bench(&[CAN], &["-DORDER2=1"]);
    let error = |step: &str| {
        bench.run(&["--step", step]).succeeds();
        (last(&bench) - 1.0 / 6.0).abs()
    };
    bench.scenario(&parabola());
    let (coarse, fine) = (error("0.1"), error("0.05"));
    assert!((coarse - 0.01 / 12.0).abs() < 1e-12, "{coarse:e}");
    assert!((coarse / fine - 4.0).abs() < 1e-6, "{coarse:e} {fine:e}");
    let limits = limits(&bench);
    assert!(limits.contains("b takes derivatives of inputs up to order 1"), "{limits}");
}

/// More than order 1 goes to a unit whose annotation says so, in one call, and to one of which the
/// scenario says so, in a call per order. Parabolas are then exact.
#[test]
fn order_more_derivatives_for_units_that_are_known_to_take_them() {
    let mixed = "fmi2SetRealInputDerivatives 0:1 0:2 0:3";
    let apart =
        ["1", "2", "3"].map(|order| format!("fmi2SetRealInputDerivatives 0:{order}")).join("\n");
    for (annotation, order, expected) in [(ANNOTATED, None, mixed), ("", Some(3), apart.as_str())] {
        let bench = annotated(&[CAN], annotation, &["-DORDER2=0"]);
        let mut scenario = parabola();
        scenario["instances"]["b"]["input_derivatives"] = json!(order);
        bench.scenario(&scenario);
        bench.recorded(&[]).succeeds();
        assert!((last(&bench) - 1.0 / 6.0).abs() < 1e-14, "{}", last(&bench));
        assert!(calls(&bench, "fmi2DoStep").join("\n").contains(expected), "{}", bench.calls());
        assert!(!limits(&bench).contains("b takes"), "{}", limits(&bench));
    }
    // annotations of others count for nothing
    let other = ANNOTATED.replace("fmi2-export", "other");
    let bench = annotated(&[CAN], &other, &["-DORDER2=3"]);
    bench.scenario(&parabola());
    bench.run(&[]).succeeds();
    assert!((last(&bench) - 1.0 / 6.0).abs() < 1e-3);
    let mut scenario = parabola();
    scenario["instances"]["b"]["input_derivatives"] = json!(4);
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["instances.b.input_derivatives is 4", "0 to 3"]);
}

/// A unit that declares canInterpolateInputs and refuses order 1 without harm: its inputs are held from
/// the second step on, which limits, events and the terminal say. Held are the newest values: the sum of
/// 0.1·t over the ends of all steps but the first, which began at 0, is 0.54.
#[test]
fn issue_a_refusal_of_order_one_is_told_and_the_inputs_are_held() {
    for (status, name) in [("1", "fmi2Warning"), ("2", "fmi2Discard")] {
        let bench = bench(&[CAN], &[&format!("-DORDER1={status}")]);
        for more in [&[][..], &["--isolate"]] {
            bench.scenario(&line());
            let ran = bench.recorded(more);
            ran.succeeds();
            assert!((last(&bench) - 0.54).abs() < 1e-14, "{}", last(&bench));
            let text = format!("fmi2SetRealInputDerivatives returned {name}");
            assert_eq!(ran.stderr().matches(&text).count(), 1, "{}", ran.stderr());
            assert!(bench.result("events.csv").contains(&text));
            assert!(limits(&bench).contains("refused derivatives of inputs"), "{}", limits(&bench));
            let told = bench.calls().matches("fmi2SetRealInputDerivatives").count();
            assert_eq!(told, 1, "{}", bench.calls());
        }
        // held from the start, by the scenario
        let mut scenario = line();
        scenario["instances"]["b"]["input_derivatives"] = json!(0);
        bench.scenario(&scenario);
        let ran = bench.run(&[]);
        ran.succeeds();
        assert!((last(&bench) - 0.55).abs() < 1e-14);
        assert!(!ran.stderr().contains("fmi2SetRealInputDerivatives"), "{}", ran.stderr());
    }
}

/// With fmi2Error the run fails, and says how it does not.
#[test]
fn issue_an_error_of_order_one_names_the_remedy() {
    let bench = bench(&[CAN], &["-DORDER1=3"]);
    bench.scenario(&line());
    let texts = [
        "unit b: fmi2SetRealInputDerivatives returned fmi2Error",
        "simulation terminated",
        "\"input_derivatives\": 0",
    ];
    bench.run(&[]).fails(1, &texts);
    assert_eq!(bench.summary()["status"], "failed");
    bench.recorded(&[]).fails(1, &texts);
    // after an error only freeing is allowed
    let calls = bench.calls();
    let mut after = calls
        .lines()
        .filter(|line| line.starts_with("b "))
        .skip_while(|line| !line.contains("fmi2SetRealInputDerivatives"));
    after.next();
    assert_eq!(after.collect::<Vec<_>>(), ["b fmi2FreeInstance"]);
}

/// A refusal is part of the state of a run: one that goes on from a state gives the bits of the whole one,
/// and the unit is not asked again.
#[test]
fn invariant_a_resumed_run_holds_the_inputs_as_before() {
    let states = support::with_states();
    let bench = Bench::new();
    bench.unit("unit.fmu", &states, &[]);
    bench.unit("slow.fmu", &states, &["-DMAX_INPUT_ORDER=0"]);
    let mut scenario = ring();
    scenario["units"] = json!({ "unit": bench.path("unit.fmu"), "slow": bench.path("slow.fmu") });
    scenario["instances"]["b"]["unit"] = json!("slow");
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0 });
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    let scenario = Scenario::parse(&scenario.to_string(), Path::new("held.json")).unwrap();
    let setup = Setup::new(&scenario).unwrap();
    let mut whole = setup.start().unwrap();
    for _ in 0..4 {
        whole.step().unwrap();
    }
    let state = whole.state().unwrap();
    let mut resumed = setup.start().unwrap();
    resumed.restore(&state).unwrap();
    assert!(resumed.limits().iter().any(|it| it.contains("b declares canInterpolateInputs")));
    for _ in 4..10 {
        whole.step().unwrap();
        resumed.step().unwrap();
        assert_eq!(whole.value(1).to_bits(), resumed.value(1).to_bits());
    }
    // held: the newest of t at the ends of all steps but the first
    assert!((resumed.value(1) - 0.54).abs() < 1e-14, "{}", resumed.value(1));
    assert!(resumed.participants()[1].instance().warnings().refusal().is_none());
}

/// What a unit declares and answers with fmi2Error, where the run needs it: the instance is not
/// continued, all units are started again without, and the result is right. A line feeds b, and b.y
/// (b.z in the loop) the unit d.
#[test]
fn issue_units_that_die_of_a_declared_capability_are_started_again_without_it() {
    let cases: [(&str, &str, &str); 3] = [
        (OUTPUTS, "-DOUTPUT_DERIVATIVES=3", "fmi2GetRealOutputDerivatives"),
        (STATES, "-DSTATES=3", "fmi2GetFMUstate"),
        (DIRECTIONAL, "-DDIRECTIONAL=3", "fmi2GetDirectionalDerivative"),
    ];
    for (attribute, define, call) in cases {
        for once in ["", "canBeInstantiatedOnlyOncePerProcess=\"true\""] {
            let states = if attribute == STATES { "" } else { STATES };
            let attributes = [CAN, states, attribute, once];
            let bench = bench(&attributes, &[define, "-DORDER2=3", "-DDEAD=3"]);
            let mut scenario = line();
            scenario["instances"]["d"] = json!({ "unit": "unit" });
            scenario["connections"] = json!([
                { "from": "c.y", "to": "b.u" },
                { "from": "b.y", "to": "d.u" }
            ]);
            if attribute == DIRECTIONAL {
                scenario["connections"][1]["from"] = json!("b.z");
            }
            scenario["algorithm"]["name"] = json!("newton");
            bench.scenario(&scenario);
            for more in [&[][..], &["--isolate"]] {
                let ran = bench.run(more);
                ran.succeeds();
                assert!((last(&bench) - 0.5).abs() < 1e-12, "{define}: {}", last(&bench));
                let text = format!("b declares that it supports {call}, which returned fmi2Error");
                assert!(limits(&bench).contains(&text), "{define}: {}", limits(&bench));
                // what it said while it was tried
                assert!(bench.result("events.csv").contains("simulation terminated"), "{define}");
            }
        }
    }
}

/// Output derivatives that come with a warning, or not at all, are taken from history instead.
#[test]
fn issue_output_derivatives_that_are_not_given_come_from_history() {
    for status in ["1", "2"] {
        let bench = bench(&[CAN, OUTPUTS], &[&format!("-DOUTPUT_DERIVATIVES={status}")]);
        let mut scenario = line();
        scenario["instances"]["d"] = json!({ "unit": "unit" });
        scenario["connections"] =
            json!([{ "from": "c.y", "to": "b.u" }, { "from": "b.y", "to": "d.u" }]);
        bench.scenario(&scenario);
        bench.recorded(&[]).succeeds();
        assert!((last(&bench) - 0.5).abs() < 1e-13);
        let limits = limits(&bench);
        assert!(limits.contains("b does not return all derivatives of outputs"), "{limits}");
        assert!(bench.result("events.csv").contains("not supported"));
        let asked = bench.calls().matches("fmi2GetRealOutputDerivatives").count();
        assert_eq!(asked, 1);
    }
}

/// No algorithm asks for derivatives of nothing, or by nothing, and only Newton's asks at all.
#[test]
fn invariant_directional_derivatives_are_asked_for_only_where_needed() {
    let all = [CAN, STATES, DIRECTIONAL, OUTPUTS];
    let bench = bench(&all, &[]);
    let mut scenario = line();
    // b.z = 0.5·u fed back through another: a loop that Newton solves
    scenario["instances"]["b"]["parameters"] = json!({ "gain": 0.5 });
    scenario["instances"]["e"] = json!({ "unit": "fragile", "parameters": { "gain": 0.25 } });
    scenario["instances"]["alone"] = json!({ "unit": "fragile" });
    scenario["instances"]["giver"] = json!({ "unit": "fragile" });
    scenario["instances"]["taker"] = json!({ "unit": "fragile" });
    scenario["connections"] = json!([
        { "from": "b.z", "to": "e.u" },
        { "from": "e.z", "to": "b.u" },
        { "from": "giver.y", "to": "taker.u" }
    ]);
    scenario["algorithm"] = json!({ "name": "newton" });
    bench.scenario(&scenario);
    bench.recorded(&[]).succeeds();
    let calls = bench.calls();
    let asked = calls.lines().filter(|line| line.contains("fmi2GetDirectionalDerivative"));
    let mut count = 0;
    for line in asked {
        assert!(line.ends_with(" 1/1"), "{line}");
        assert!(line.starts_with("b ") || line.starts_with("e "), "{line}");
        count += 1;
    }
    assert!(count >= 2, "{calls}");
    scenario["algorithm"] = json!({ "on_discard": "fail" });
    bench.scenario(&scenario);
    for algorithm in ["jacobi", "gauss-seidel", "iterated"] {
        bench.recorded(&["--algorithm", algorithm]).succeeds();
        let calls = bench.calls();
        assert!(!calls.contains("fmi2GetDirectionalDerivative"), "{algorithm}");
        let saves = calls.contains("fmi2GetFMUstate");
        assert_eq!(saves, algorithm == "iterated", "{algorithm}");
    }
}

/// A unit that breaks on the way, answers every step with fmi2Warning and stands still. If it said that
/// it has terminated, the run fails; else all can read that it may have stopped computing.
#[test]
fn issue_a_unit_that_terminated_but_returns_warnings_fails_the_run() {
    let mut scenario = line();
    scenario["experiment"]["stop"] = json!(2.0);
    scenario["record"]["signals"] = json!(["b.y", "b.u"]);
    let dead = ["-DDEAD=1", "-DDIES=4"];
    let loud = bench(&[CAN], &dead);
    loud.scenario(&scenario);
    for more in [&[][..], &["--isolate"], &["--quiet"]] {
        let ran = loud.run(more);
        // the fifth step, to 0.5 s, is the first that warns; five more without a change
        ran.fails(1, &["unit b has stopped computing", "since 0.5 s", "simulation terminated"]);
        assert!(ran.stderr().contains("warning: unit b reports that it has terminated"));
        assert_eq!(loud.summary()["status"], "failed");
        assert!((9..=10).contains(&(loud.rows().len() - 1)), "{}", loud.rows().len());
    }
    let silent = bench(&[CAN], &["-DDEAD=1", "-DDIES=4", "-DLAST_WORDS=\"\""]);
    silent.scenario(&scenario);
    let ran = silent.run(&[]);
    ran.succeeds();
    let report = ran.stderr();
    assert!(report.contains("warning: unit b: each of the last 5 steps returned"), "{report}");
    assert!(report.contains("16 of 20 steps returned fmi2Warning"), "{report}");
    let summary = silent.summary();
    assert_eq!(summary["instances"]["b"]["warned_steps"], 16);
    assert_eq!(summary["instances"]["b"]["stalled_since"], 0.5);
    assert_eq!(summary["instances"]["c"]["warned_steps"], 0);
    let events = silent.result("events.csv");
    assert!(
        events.contains(
            "0.5,warning,b,\"fmi2DoStep returned fmi2Warning, first in the step from 0.4 s\""
        ),
        "{events}"
    );
    assert!(events.contains("it may have stopped computing"), "{events}");
}
