//! Outputs that have their values only after initialization mode: all receivers get them in time.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION, ring, with_states};

/// What the source's y and m are after initialization mode; c is true then, t is "late".
const LATE: f64 = 5.0;
const STEP: f64 = 0.1;

/// A source of late outputs and a receiver whose y' = u + n + b + length of s.
fn pair(description: &str) -> Bench {
    let bench = Bench::new();
    bench.unit("late.fmu", description, &["-DLATE=5"]);
    bench.unit("sums.fmu", description, &["-DSUMS"]);
    bench.unit("unit.fmu", description, &[]);
    bench
}

/// The receiver is `b`; the source is `a`, or `c` and so later in the scenario.
fn scenario(source: &str, connections: &[[&str; 2]]) -> Value {
    let mut scenario = ring();
    scenario["units"] = json!({ "late": "late.fmu", "sums": "sums.fmu", "unit": "unit.fmu" });
    let mut instances = [(source, "late"), ("b", "sums")];
    instances.sort_unstable();
    scenario["instances"] = Value::Object(
        instances.iter().map(|(name, unit)| ((*name).into(), json!({ "unit": unit }))).collect(),
    );
    let link = |[from, to]: &[&str; 2]| json!({ "from": format!("{source}.{from}"), "to": format!("b.{to}") });
    scenario["connections"] = connections.iter().map(link).collect();
    scenario["experiment"] = json!({ "stop": 3.0 * STEP, "step": STEP });
    scenario["record"]["signals"] = json!([format!("{source}.y"), "b.y", "b.u"]);
    scenario
}

/// After the first step of h the receiver has integrated 5·h of the Real, 5·h of the Integer, 1·h of
/// the Boolean, and 4·h of the String, and so on in the next ones: whoever steps first, in all
/// algorithms, with and without derivatives of inputs, in parts and isolated. Had the first step run
/// on the values in initialization mode, it would have integrated nothing.
#[test]
fn analytic_the_first_step_runs_on_late_outputs() {
    let held = with_states().replace("canInterpolateInputs=\"true\"", "");
    assert_ne!(held, with_states());
    let cases: [(&[[&str; 2]], f64); 5] = [
        (&[["y", "u"]], LATE),
        (&[["m", "n"]], LATE),
        (&[["c", "b"]], 1.0),
        (&[["t", "s"]], 4.0),
        (&[["y", "u"], ["m", "n"], ["c", "b"], ["t", "s"]], 2.0 * LATE + 5.0),
    ];
    for description in [with_states(), held] {
        let bench = pair(&description);
        for source in ["a", "c"] {
            for (connections, rate) in cases {
                for order in [[source, "b"], ["b", source]] {
                    let mut scenario = scenario(source, connections);
                    scenario["algorithm"] = json!({ "order": order });
                    for (steps, further) in [
                        (1, &["--algorithm", "jacobi"][..]),
                        (1, &["--algorithm", "gauss-seidel"]),
                        (1, &["--algorithm", "gauss-seidel", "--extrapolation", "0"]),
                        (1, &["--algorithm", "iterated"]),
                        (1, &["--algorithm", "newton"]),
                        (2, &["--algorithm", "gauss-seidel"]),
                        (1, &["--algorithm", "gauss-seidel", "--isolate"]),
                    ] {
                        scenario["instances"]["b"]["steps"] = json!(steps);
                        bench.scenario(&scenario);
                        bench.run(&[&["--quiet", "--no-report"], further].concat()).succeeds();
                        for (n, row) in (0..).zip(bench.rows()) {
                            let expected = rate * STEP * f64::from(n);
                            let what =
                                format!("{source} {connections:?} {order:?} {further:?} {n}");
                            assert_eq!(row[1], LATE, "{what}");
                            assert!((row[2] - expected).abs() < 1e-14, "{what}: {}", row[2]);
                        }
                    }
                }
            }
        }
    }
}

/// a.y is late; b feeds it through to c, which integrates. c gets the value a step later in Jacobi, and
/// with the step that b ends in Gauss-Seidel; a note names all of them, on the terminal and in
/// events.csv. The recorded inputs at the start are those handed on, the fed-through output is the
/// earlier one.
#[test]
fn issue_what_is_fed_through_late_is_noted() {
    let bench = pair(&with_states());
    for order in [["a", "b", "c"], ["c", "b", "a"]] {
        let mut scenario = ring();
        scenario["units"] = json!({ "late": "late.fmu", "sums": "sums.fmu", "unit": "unit.fmu" });
        scenario["instances"] =
            json!({ "c": { "unit": "sums" }, "a": { "unit": "late" }, "b": { "unit": "unit" } });
        scenario["connections"] =
            json!([{ "from": "a.y", "to": "b.u" }, { "from": "b.z", "to": "c.u" }]);
        scenario["experiment"] = json!({ "stop": 10.0 * STEP, "step": STEP });
        scenario["record"]["signals"] = json!(["a.y", "b.u", "b.z", "c.u", "c.y"]);
        scenario["algorithm"] = json!({ "name": "jacobi", "extrapolation": 0, "order": order });
        bench.scenario(&scenario);
        let ran = bench.run(&["--no-report"]);
        ran.succeeds();
        let note = "a.y changed on leaving initialization mode (0 → 5); b.z, which depends on it \
                    through b.u, still has its earlier value at the start, and c.u gets the new \
                    value one step later, unless it steps after b";
        assert!(ran.stderr().contains(note), "{}", ran.stderr());
        let events = bench.result("events.csv");
        assert!(events.lines().any(|line| line.starts_with("0.0,note,") && line.contains(note)));
        let rows = bench.rows();
        assert_eq!(rows[0][1..], [LATE, LATE, 0.0, 0.0, 0.0]);
        for (n, row) in (0..).zip(&rows).skip(1) {
            // one step of nothing, then 5 held
            let expected = LATE * STEP * f64::from(n - 1);
            assert_eq!(row[3], LATE);
            assert!((row[5] - expected).abs() < 1e-14, "{n}: {row:?}");
        }
    }
}

/// No polynomial is drawn from the earlier value of what is fed through to the new one. In Jacobi the
/// receiver gets nothing in the first step and 5 from then on, at any degree, and likewise in
/// Gauss-Seidel where it steps first; where it steps after the unit that feeds through, or steps are
/// iterated, it gets 5 at once. A line, and the parabolas after it, would give 5·(n − 0.4166…)·h.
#[test]
fn analytic_what_is_fed_through_late_jumps() {
    let bench = pair(&with_states());
    let mut scenario = ring();
    scenario["units"] = json!({ "late": "late.fmu", "sums": "sums.fmu", "unit": "unit.fmu" });
    scenario["instances"] =
        json!({ "c": { "unit": "sums" }, "a": { "unit": "late" }, "b": { "unit": "unit" } });
    scenario["connections"] =
        json!([{ "from": "a.y", "to": "b.u" }, { "from": "b.z", "to": "c.u" }]);
    scenario["experiment"] = json!({ "stop": 10.0 * STEP, "step": STEP });
    scenario["record"]["signals"] = json!(["c.y"]);
    let (first, last) = (["c", "a", "b"], ["a", "b", "c"]);
    for (algorithm, order, lag) in [
        ("jacobi", first, 1.0),
        ("jacobi", last, 1.0),
        ("gauss-seidel", first, 1.0),
        ("gauss-seidel", last, 0.0),
        ("iterated", first, 0.0),
        ("iterated", last, 0.0),
        ("newton", first, 0.0),
        ("newton", last, 0.0),
    ] {
        scenario["algorithm"] = json!({ "order": order });
        for degree in ["0", "1", "2", "3"] {
            bench.scenario(&scenario);
            let choice = ["--algorithm", algorithm, "--extrapolation", degree];
            bench.run(&[&["--quiet", "--no-report"], &choice[..]].concat()).succeeds();
            for (n, row) in (0..).zip(bench.rows()).skip(1) {
                let expected = LATE * STEP * (f64::from(n) - lag);
                let error = row[1] - expected;
                assert!(
                    error.abs() < 1e-13,
                    "{algorithm} {order:?} {degree} {n}: {} {expected}",
                    row[1]
                );
            }
        }
    }
}

/// Outputs that are what they were in initialization mode, and late ones that nobody feeds through,
/// need no note.
#[test]
fn issue_no_note_on_late_outputs_that_nobody_feeds_through() {
    let bench = pair(DESCRIPTION);
    bench.scenario(&scenario("a", &[["y", "u"], ["m", "n"]]));
    let ran = bench.run(&["--no-report"]);
    ran.succeeds();
    assert!(!ran.stderr().contains("initialization mode"), "{}", ran.stderr());
    let mut scenario = ring();
    scenario["connections"] =
        json!([{ "from": "a.z", "to": "b.u" }, { "from": "b.z", "to": "a.u" }]);
    scenario["instances"]["a"]["parameters"] = json!({ "gain": 0.5 });
    bench.scenario(&scenario);
    let ran = bench.run(&["--no-report"]);
    ran.succeeds();
    assert!(!ran.stderr().contains("initialization mode"), "{}", ran.stderr());
}
