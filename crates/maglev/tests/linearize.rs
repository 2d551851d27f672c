//! `maglev linearize` on units of others: directional derivatives, models identified from steps, and what is
//! refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::Bench;

/// The description of `oscillator.c`; CAPABILITIES are attributes.
const OSCILLATOR: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="oscillator" guid="oscillator">
  <CoSimulation modelIdentifier="unit" canHandleVariableCommunicationStepSize="true" CAPABILITIES/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="local" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="v" valueReference="1" causality="local" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="2" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="3" causality="output"><Real unit="m"/></ScalarVariable>
    <ScalarVariable name="w" valueReference="4" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="5" causality="local"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="der(v)" valueReference="6" causality="local"><Real derivative="2"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="4"/><Unknown index="5"/></Outputs>
    <Derivatives><Unknown index="6"/><Unknown index="7"/></Derivatives>
    <InitialUnknowns><Unknown index="4"/><Unknown index="5"/><Unknown index="6"/><Unknown index="7"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;

const STATES: &str = "canGetAndSetFMUstate=\"true\"";
const DERIVATIVES: &str = "providesDirectionalDerivative=\"true\"";
const STEP: f64 = 0.01;

/// A bench with the oscillator alone.
fn bench(capabilities: &str, defines: &[&str]) -> Bench {
    let bench = Bench::new();
    let description = OSCILLATOR.replace("CAPABILITIES", capabilities);
    bench.source("oscillator.fmu", "oscillator.c", &description, defines);
    bench.scenario(&json!({
        "units": {"oscillator": "oscillator.fmu"},
        "instances": {"o": {"unit": "oscillator"}},
        "connections": [],
        "experiment": {"stop": 1.0, "step": STEP},
        "record": {"signals": ["o.y"]},
    }));
    bench
}

/// Linearises, and returns all models.
fn models(bench: &Bench) -> Value {
    let ran = bench.maglev(&["linearize", "scenario.json", "--out", "models.json"]);
    assert_eq!(ran.status(), 0, "{}", ran.stderr());
    serde_json::from_str(&std::fs::read_to_string(bench.path("models.json")).unwrap()).unwrap()
}

fn model<'a>(all: &'a Value, name: &str) -> &'a Value {
    let models = all["models"].as_array().unwrap();
    models.iter().find(|it| it["name"] == name).unwrap_or_else(|| panic!("no {name} in {all}"))
}

fn number(model: &Value, matrix: &str, i: usize, j: usize) -> f64 {
    model[matrix][i][j].as_f64().unwrap()
}

/// Trace and determinant of a 2 × 2 matrix A.
fn invariants(model: &Value) -> [f64; 2] {
    let a = |i, j| number(model, "A", i, j);
    assert_eq!(model["A"].as_array().unwrap().len(), 2, "{model}");
    [a(0, 0) + a(1, 1), a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0)]
}

/// Trace and determinant of exp(A h) for the oscillator: λ = −1 ± √99 i.
fn exact(step: f64) -> [f64; 2] {
    let size = (-step).exp();
    [2.0 * size * (99.0_f64.sqrt() * step).cos(), size * size]
}

fn assert_close(found: [f64; 2], wanted: [f64; 2], tolerance: f64) {
    for (a, b) in found.iter().zip(wanted) {
        assert!((a - b).abs() < tolerance, "{found:?} {wanted:?}");
    }
}

#[test]
fn analytic_declared_states_and_directional_derivatives_give_the_matrices() {
    let all = models(&bench(DERIVATIVES, &[]));
    let unit = model(&all, "o");
    assert_eq!(unit["source"], "directional derivatives");
    assert_eq!(unit["A"], json!([[0.0, 1.0], [-100.0, -2.0]]));
    assert_eq!(unit["B"], json!([[0.0], [1.0]]));
    assert_eq!(unit["C"], json!([[1.0, 0.0], [0.0, 1.0]]));
    assert_eq!(unit["D"], json!([[0.0], [0.5]]));
    assert_eq!((&unit["states"], &unit["output_units"]), (&json!(["x", "v"]), &json!(["m", ""])));
    let step = model(&all, "o_stepped");
    assert_close(invariants(step), exact(STEP), 1e-13);
    // the coupled system is the unit, whose step is exact
    assert_eq!(model(&all, "coupled")["A"], unit["A"]);
    assert_close(invariants(model(&all, "coupled_stepped")), exact(STEP), 1e-13);
}

/// The unit's own midpoint rule has an error of about 1e-7 per step.
#[test]
fn analytic_steps_from_a_saved_state_give_the_eigenvalues() {
    let all = models(&bench(STATES, &[]));
    let unit = model(&all, "o_stepped");
    assert_eq!(unit["source"], "identified from steps");
    assert!(unit["error"].as_f64().unwrap() < 1e-5, "{}", unit["error"]);
    assert_close(invariants(unit), exact(STEP), 1e-6);
    // w = v + u/2 at the end of the step
    assert!((number(unit, "D", 1, 0) - 0.5 - STEP * (1.0 - STEP)).abs() < 1e-4);
    let note = all["notes"][0].as_str().unwrap();
    assert!(note.contains("no model of the coupled system") && note.contains('o'), "{note}");
}

/// A unit that samples its input at every third step is linear and time-invariant over three.
#[test]
fn analytic_a_sampled_unit_is_identified_at_its_own_period() {
    let all = models(&bench(STATES, &["-DSAMPLED"]));
    let unit = model(&all, "o_stepped");
    assert!((unit["step"].as_f64().unwrap() - 3.0 * STEP).abs() < 1e-15, "{}", unit["step"]);
    assert!(unit["error"].as_f64().unwrap() < 1e-5, "{}", unit["error"]);
    assert_close(invariants(unit), exact(3.0 * STEP), 1e-5);
}

#[test]
fn refusal_what_cannot_be_linearised_or_written_is_said() {
    let bench = bench("", &[]);
    for (arguments, wanted) in [
        (
            ["--out", "models.json"],
            "o reports no linearisation, and its steps cannot be used instead: it cannot save",
        ),
        (
            ["--out", "models.csv"],
            "cannot write models.csv: the name must end with .json, .mat or .npz",
        ),
    ] {
        let mut all = vec!["linearize", "scenario.json"];
        all.extend(arguments);
        let ran = bench.maglev(&all);
        assert_eq!(ran.status(), 2, "{}", ran.stderr());
        assert!(ran.stderr().contains(wanted), "{}", ran.stderr());
    }
}
