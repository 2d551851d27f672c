//! Units that make one step in every n-th communication step.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use master::{Setup, Simulation};
use scenario::Scenario;
use serde_json::{Value, json};
use support::{Bench, DESCRIPTION, ring, with_states};

/// c.y = t by its start value, b.y integrates it in steps of 4·0.1 s, d.y integrates b.y.
fn chain() -> Value {
    let mut scenario = ring();
    scenario["instances"] = json!({
        "c": { "unit": "unit", "start": { "u": 1.0 } },
        "b": { "unit": "slow", "every": 4 },
        "d": { "unit": "unit" }
    });
    scenario["units"]["slow"] = json!("slow.fmu");
    scenario["connections"] =
        json!([{ "from": "c.y", "to": "b.u" }, { "from": "b.y", "to": "d.u" }]);
    scenario["experiment"] = json!({ "stop": 2.0, "step": 0.1 });
    scenario["algorithm"] = json!({ "order": ["c", "d", "b"] });
    scenario["record"]["signals"] = json!(["b.y", "d.y", "b.z"]);
    scenario
}

/// Bench with a slow.fmu that takes input derivatives up to that order.
fn bench(order: usize) -> Bench {
    let bench = Bench::new();
    let held = DESCRIPTION.replace("canInterpolateInputs=\"true\"", "");
    let description = if order == 0 { &held } else { DESCRIPTION };
    bench.unit("slow.fmu", description, &[&format!("-DMAX_INPUT_ORDER={order}")]);
    bench
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-13
}

/// Driven by 2: b.y = 2 t at its points every 0.4 s, and held between them; d.y is the area under that
/// staircase, 0.1 s · b.y per step. Sums of 20 terms below 4 round by less than 1e-14.
#[test]
fn analytic_a_slow_unit_steps_at_its_own_points_and_is_held_between() {
    let bench = bench(3);
    let mut scenario = chain();
    scenario["instances"]["b"]["start"] = json!({ "u": 2.0 });
    scenario["connections"] = json!([{ "from": "b.y", "to": "d.u" }]);
    // receivers before and after the slow unit
    let orders = [["c", "d", "b"], ["c", "b", "d"]];
    for (algorithm, order) in
        ["jacobi", "gauss-seidel"].into_iter().zip(orders).chain([("gauss-seidel", orders[0])])
    {
        scenario["algorithm"]["order"] = json!(order);
        bench.scenario(&scenario);
        bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
        let rows = bench.rows();
        assert_eq!(rows.len(), 21);
        let mut area = 0.0;
        for (k, row) in (0..).zip(&rows) {
            let point = f64::from(k / 4 * 4) * 0.1;
            assert!(near(row[1], 2.0 * point), "{algorithm}: {row:?}");
            assert!(near(row[2], area), "{algorithm}: {row:?} {area}");
            area += 0.1 * 2.0 * point;
        }
        assert_eq!(bench.summary()["instances"]["b"]["steps"], 5);
    }
}

/// Driven by the ramp t: with lines as inputs b.y = t²/2 at its points, whatever the algorithm; with
/// held ones the sum of 0.4·t_k, for a slow unit samples its inputs at its own points. b.z is what the
/// input has become at its last point.
#[test]
fn analytic_a_slow_unit_follows_a_ramp() {
    for order in [0, 1, 3] {
        let bench = bench(order);
        bench.scenario(&chain());
        for algorithm in ["jacobi", "gauss-seidel"] {
            bench.run(&["--quiet", "--algorithm", algorithm]).succeeds();
            let (mut held, rows) = (0.0, bench.rows());
            for k in (0..=20).step_by(4) {
                let t = f64::from(u8::try_from(k).unwrap()) * 0.1;
                let expected = if order == 0 { held } else { t * t / 2.0 };
                for row in &rows[k..(k + 4).min(21)] {
                    assert!(near(row[1], expected), "{order} {algorithm}: {row:?}");
                }
                held += 0.4 * t;
            }
        }
    }
}

/// The same as a unit that is stepped with 0.4 s by a master of its own: a loop of two slow units.
#[test]
fn invariant_slow_units_alone_are_like_a_larger_step() {
    let bench = bench(0);
    let mut scenario = ring();
    scenario["units"]["unit"] = json!("slow.fmu");
    scenario["instances"]["a"]["parameters"] = json!({ "gain": 2.0 });
    scenario["instances"]["b"]["parameters"] = json!({ "gain": -0.5 });
    scenario["instances"]["a"]["start"] = json!({ "n": 7 });
    scenario["connections"] = json!([
        { "from": "a.z", "to": "b.u", "extrapolation": 0 },
        { "from": "b.y", "to": "a.u", "extrapolation": 0 },
        { "from": "a.m", "to": "b.n" },
        { "from": "a.t", "to": "b.s" }
    ]);
    scenario["instances"]["a"]["start"]["s"] = json!("hello");
    scenario["algorithm"] = json!({ "name": "jacobi" });
    scenario["record"]["signals"] = json!(["a.y", "b.y", "b.m"]);
    scenario["experiment"] = json!({ "stop": 4.0, "step": 0.4 });
    bench.scenario(&scenario);
    bench.run(&["--quiet"]).succeeds();
    let whole = bench.rows();
    scenario["experiment"]["step"] = json!(0.1);
    scenario["instances"]["a"]["every"] = json!(4);
    scenario["instances"]["b"]["every"] = json!(4);
    bench.scenario(&scenario);
    for more in [&[][..], &["--isolate"], &["--threads", "2"]] {
        bench.run(&[&["--quiet"], more].concat()).succeeds();
        let rows = bench.rows();
        for (one, four) in whole.iter().zip(rows.iter().step_by(4)) {
            assert!(one.iter().zip(four).all(|(x, y)| near(*x, *y)), "{one:?} {four:?}");
        }
        assert_eq!(rows.last().unwrap()[3], 7.0);
    }
}

/// Algorithms that make steps again: a slow unit in a loop with a fast one gives what it gives when
/// steps are made once, as its step does not depend on what is iterated between its points.
#[test]
fn invariant_iterations_do_not_disturb_a_slow_unit() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    let mut scenario = ring();
    scenario["instances"]["a"] = json!({ "unit": "unit", "start": { "y": 1.0 }, "every": 4 });
    scenario["instances"]["c"] = json!({ "unit": "unit", "parameters": { "gain": -1.0 } });
    scenario["connections"] = json!([
        { "from": "a.y", "to": "b.u" },
        { "from": "b.y", "to": "c.u" },
        { "from": "c.z", "to": "a.u" }
    ]);
    scenario["experiment"] = json!({ "stop": 0.8, "step": 0.1 });
    let mut ends = Vec::new();
    for algorithm in ["iterated", "newton"] {
        scenario["algorithm"] = json!({ "name": algorithm });
        bench.scenario(&scenario);
        bench.run(&["--quiet"]).succeeds();
        let rows = bench.rows();
        // held between its points, and moved at them
        assert_eq!(rows[0][1], rows[3][1]);
        assert_eq!(rows[4][1], rows[7][1]);
        assert!(rows[4][1] != rows[3][1] && rows[8][1] != rows[4][1], "{rows:?}");
        // b integrates what is held: 1 for 0.4 s
        assert!((rows[4][2] - 0.4).abs() < 1e-6, "{rows:?}");
        ends.push(rows[8][1]);
    }
    assert!((ends[0] - ends[1]).abs() < 1e-6, "{ends:?}");
}

/// A state saved anywhere, also between the points of a slow unit, goes on to the same bits.
#[test]
fn issue_a_checkpoint_between_the_steps_of_a_slow_unit_continues_to_the_same_bytes() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    bench.unit("slow.fmu", &with_states(), &[]);
    let mut scenario = chain();
    scenario["record"]["signals"] = json!(["b.y", "b.z", "d.y", "b.t"]);
    scenario["connections"].as_array_mut().unwrap().push(json!({ "from": "d.t", "to": "b.s" }));
    scenario["instances"]["d"]["start"] = json!({ "s": "text" });
    bench.scenario(&scenario);
    let scenario = Scenario::load(&bench.path("scenario.json")).unwrap();
    let setup = Setup::new(&scenario).unwrap();
    let seen = |simulation: &Simulation<'_>| {
        let bits = [0, 1, 2].map(|signal| simulation.value(signal).to_bits());
        (bits, simulation.text(3).unwrap().to_owned())
    };
    let mut whole = setup.start().unwrap();
    let mut expected = vec![seen(&whole)];
    let mut states = vec![whole.state().unwrap()];
    while whole.remaining() > 0 {
        whole.step().unwrap();
        expected.push(seen(&whole));
        states.push(whole.state().unwrap());
    }
    assert_eq!(expected[20].1.to_str().unwrap(), "text");
    for (k, state) in states.iter().enumerate() {
        let mut again = setup.start().unwrap();
        again.restore(state).unwrap();
        for (n, expected) in expected.iter().enumerate().skip(k + 1) {
            again.step().unwrap();
            assert_eq!(seen(&again), *expected, "from {k}, step {n}");
        }
    }
    bench.run(&["--quiet", "--checkpoint-every", "0.3"]).succeeds();
}

#[test]
fn issue_steps_that_do_not_fit_are_refused() {
    let bench = bench(3);
    let refused = |change: &dyn Fn(&mut Value), texts: &[&str]| {
        let mut scenario = chain();
        change(&mut scenario);
        bench.scenario(&scenario);
        bench.run(&[]).fails(2, texts);
    };
    let every = "instances.b.every is";
    refused(&|it| it["instances"]["b"]["every"] = json!(3), &[every, "20 communication steps"]);
    refused(
        &|it| it["instances"]["b"]["every"] = json!(0),
        &["instances.b.every is 0", "at least 1"],
    );
    refused(&|it| it["instances"]["b"]["steps"] = json!(2), &[every, "\"steps\" is 2"]);
    refused(
        &|it| it["algorithm"]["variable"] = json!({ "tolerance": 1e-3 }),
        &[every, "equal steps", "algorithm.variable"],
    );
}
