//! Units that make several steps per communication step.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION, ring, with_states};

/// c.y = t, a.y = t²/2, b.y = t³/6: each integrates the one before, exactly for what it is sent.
fn chain(steps: u32) -> Value {
    let mut scenario = ring();
    scenario["instances"] = json!({
        "c": { "unit": "unit", "start": { "u": 1.0 } },
        "a": { "unit": "unit" },
        "b": { "unit": "slow", "steps": steps }
    });
    scenario["units"]["slow"] = json!("slow.fmu");
    scenario["connections"] =
        json!([{ "from": "c.y", "to": "a.u" }, { "from": "a.y", "to": "b.u" }]);
    scenario["algorithm"] = json!({ "order": ["c", "a", "b"] });
    scenario["record"]["signals"] = json!(["b.y"]);
    scenario
}

/// Error of b.y at 1 s.
fn error(bench: &Bench, steps: u32, order: u8) -> f64 {
    let mut scenario = chain(steps);
    scenario["instances"]["b"]["input_derivatives"] = json!(order);
    bench.scenario(&scenario);
    bench.run(&["--quiet"]).succeeds();
    assert_eq!(bench.summary()["instances"]["b"]["steps"], 10 * steps);
    bench.rows()[10][1] - 1.0 / 6.0
}

/// The input's second derivative is 1, so by the table in participant/rate.rs b.y errs by −δ²/24 when
/// its inputs are held over its steps of δ = 0.1 s/n, and by δ²/12 when they are lines; nothing remains
/// with parabolas. The errors fall with the square of n. Sums of 160 terms round by less than 1e-14.
#[test]
fn order_own_steps_follow_the_inputs_within_a_communication_step() {
    let bench = Bench::new();
    let held = DESCRIPTION.replace("canInterpolateInputs=\"true\"", "");
    for (description, order, factor) in
        [(held.as_str(), 0, -1.0 / 24.0), (DESCRIPTION, 1, 1.0 / 12.0), (DESCRIPTION, 2, 0.0)]
    {
        bench.unit("slow.fmu", description, &[&format!("-DMAX_INPUT_ORDER={order}")]);
        for steps in [2, 4, 16] {
            let own = 0.1 / f64::from(steps);
            let found = error(&bench, steps, order);
            assert!((found - factor * own * own).abs() < 1e-14, "{order} {steps}: {found:e}");
        }
    }
}

/// A unit that is exact for the polynomials that it gets gives the same results in parts: an oscillator
/// over 1 s, by both algorithms. Rounding of 2e3 operations of size 1 stays below 1e-12.
#[test]
fn invariant_an_exact_unit_does_not_feel_the_parts() {
    let bench = Bench::new();
    let mut scenario = ring();
    bench.unit("unit.fmu", &with_states(), &[]);
    scenario["instances"]["a"] =
        json!({ "unit": "unit", "start": { "y": 1.0 }, "input_derivatives": 3 });
    scenario["instances"]["b"]["input_derivatives"] = json!(3);
    scenario["instances"]["c"] = json!({ "unit": "unit", "parameters": { "gain": -1.0 } });
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" },
        { "from": "b.y", "to": "c.u" },
        { "from": "c.z", "to": "a.u" }
    ]);
    for algorithm in ["jacobi", "gauss-seidel"] {
        let mut rows = Vec::new();
        for steps in [1, 5] {
            scenario["instances"]["b"]["steps"] = json!(steps);
            bench.scenario(&scenario);
            bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
            rows.push(bench.rows());
        }
        for (one, five) in rows[0].iter().zip(&rows[1]) {
            assert!(one.iter().zip(five).all(|(x, y)| (x - y).abs() < 1e-12), "{one:?} {five:?}");
        }
        // cos 1 and sin 1
        assert!((rows[0][10][1] - 0.54).abs() < 0.05 && (rows[0][10][2] - 0.84).abs() < 0.05);
    }
    scenario["instances"]["b"]["steps"] = json!(0);
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["instances.b.steps is 0"]);
}
