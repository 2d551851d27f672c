//! Conditions of events and stops: the time at which they become true.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::json;
use support::{Bench, DESCRIPTION, bench_of, last, oscillator, with_states};

/// The times of the events in events.csv.
fn times(bench: &Bench, kind: &str) -> Vec<f64> {
    let events = bench.result("events.csv");
    let rows = events.lines().map(|line| line.split(',').collect::<Vec<_>>());
    rows.filter(|row| row[1] == kind).map(|row| row[0].parse().unwrap()).collect()
}

/// a' = g b, b' = a from a = 1, b = 0: with g = −1 until a has fallen to 1/2 at π/3, with g = −4 after it.
fn exact(time: f64) -> [f64; 2] {
    let event = std::f64::consts::FRAC_PI_3;
    let (a, b) = (event.cos(), event.sin());
    let (sin, cos) = (2.0 * (time - event)).sin_cos();
    [a * cos - 2.0 * b * sin, b * cos + a / 2.0 * sin]
}

/// The order of the coupling is that without an event, though a condition is its cause, which becomes true anywhere in a
/// step.
#[test]
fn order_is_kept_across_an_event_that_a_condition_causes() {
    for (algorithm, extrapolation) in
        [("gauss-seidel", 1), ("jacobi", 2), ("gauss-seidel", 2), ("newton", 1), ("iterated", 1)]
    {
        let error = |step: f64| {
            let mut scenario = oscillator(step);
            scenario["algorithm"] = json!({ "name": algorithm, "extrapolation": extrapolation });
            scenario["events"] = json!([
                { "when": { "signal": "a.y", "below": 0.5 }, "set": { "c.gain": -4.0 } }
            ]);
            let bench = bench_of(&scenario);
            bench.run(&["--quiet"]).succeeds();
            let row = last(&bench);
            let ([a, b], happened) = (exact(2.0), times(&bench, "event")[0]);
            assert!((happened - std::f64::consts::FRAC_PI_3).abs() < step * step, "{happened}");
            f64::max((row[1] - a).abs(), (row[2] - b).abs())
        };
        let errors = [0.02, 0.02 / 3.0, 0.02 / 9.0].map(error);
        let found = (errors[0] / errors[2]).ln() / 9.0_f64.ln();
        assert!(found > 1.7, "{algorithm} {extrapolation}: order {found}, {errors:?}");
    }
}

/// y of `d` is 2 t: it passes 0.5 at 0.25 s, within a step of 0.1 s.
#[test]
fn analytic_conditions_are_located_and_fire_once() {
    let mut scenario = oscillator(0.1);
    scenario["instances"]["d"]["start"] = json!({ "u": 2.0 });
    scenario["record"]["interval"] = json!(0.2);
    scenario["events"] = json!([
        { "name": "slower", "when": { "signal": "d.y", "above": 0.5 }, "set": { "d.u": 1.0 } },
        { "name": "never", "when": { "signal": "d.y", "falling": 0.5 }, "set": { "d.u": 9.0 } },
        { "name": "late", "when": { "signal": "d.y", "above": 0.1, "after": 1.0 },
          "set": { "d.u": 4.0 } },
    ]);
    scenario["stop_when"] = json!([
        { "name": "far enough", "when": { "signal": "d.y", "rising": 1.45 } }
    ]);
    for variable in [false, true] {
        if variable {
            scenario["algorithm"] = json!({ "variable": { "tolerance": 1e-6 } });
        }
        let bench = bench_of(&scenario);
        let ran = bench.run(&[]);
        ran.succeeds();
        // 0.5 at 0.25 s, 1.25 at 1 s, 1.45 at 1.05 s; three short steps after each change have the old input
        let row = last(&bench);
        assert!((row[0] - 1.05).abs() < 1e-6 && (row[3] - 1.45).abs() < 1e-6, "{row:?}");
        let happened = times(&bench, "event");
        assert!((happened[0] - 0.25).abs() < 2e-7 && happened[1] == 1.0, "{happened:?}");
        assert_eq!((happened.len(), times(&bench, "stopped").len()), (2, 1));
        let summary = bench.summary();
        assert_eq!(
            (summary["status"].as_str(), summary["error"].is_null()),
            (Some("stopped"), true)
        );
        assert_eq!(summary["reached"].as_f64(), Some(row[0]));
        let reason = "far enough: d.y has risen above 1.45 m: it is 1.450000 m";
        assert_eq!(summary["ended_by"], reason);
        assert!(bench.result("events.csv").contains("(d.y is above 0.5 m: it is 0.500000 m)"));
        assert!(ran.stderr().contains("the run ends at 1.0"), "{}", ran.stderr());
    }
}

/// Of several conditions in one step each happens at its time, also one that an event makes true.
#[test]
fn analytic_several_conditions_in_a_step_happen_in_their_order() {
    let mut scenario = oscillator(1.0);
    scenario["instances"]["d"]["start"] = json!({ "u": 2.0 });
    scenario["events"] = json!([
        { "when": { "signal": "d.y", "above": 1.0 }, "set": { "d.u": 4.0 } },
        { "when": { "signal": "d.y", "above": 0.5 }, "set": { "d.u": 1.0 } },
        { "at": 0.95, "set": { "d.u": -1.0 } },
        { "when": { "signal": "d.y", "falling": 1.0 }, "set": { "d.u": 0.0 } },
    ]);
    let bench = bench_of(&scenario);
    bench.run(&["--quiet"]).succeeds();
    // 0.5 at 0.25 s, 1 at 0.75 s, 1.8 at 0.95 s, 1 again at 1.75 s
    let happened = times(&bench, "event");
    for (time, expected) in happened.iter().zip([0.25, 0.75, 0.95, 1.75]) {
        assert!((time - expected).abs() < 2e-5, "{happened:?}");
    }
    assert_eq!(happened.len(), 4);
    assert!((last(&bench)[3] - 1.0).abs() < 5e-5);
}

/// Conditions that never become true change no bit; isolated units and threads change none either.
#[test]
fn invariant_watching_changes_no_bit() {
    let mut scenario = oscillator(0.01);
    scenario["algorithm"] = json!({ "name": "gauss-seidel", "extrapolation": 2 });
    let plain = bench_of(&scenario);
    plain.run(&["--quiet"]).succeeds();
    scenario["stop_when"] = json!([{ "when": { "signal": "*.y", "above": 5.0 } }]);
    let watched = bench_of(&scenario);
    watched.run(&["--quiet"]).succeeds();
    assert!(plain.result("results.csv") == watched.result("results.csv"));
    scenario["stop_when"] = json!([{ "when": { "signal": "a.y", "below": 0.3 } }]);
    scenario["events"] =
        json!([{ "when": { "signal": "b.y", "above": 0.2 }, "set": { "c.gain": -2.0 } }]);
    let located = bench_of(&scenario);
    located.run(&["--quiet"]).succeeds();
    let first = located.result("results.csv");
    for option in [["--isolate", "--quiet"], ["--threads=2", "--quiet"]] {
        located.run(&option).succeeds();
        assert!(located.result("results.csv") == first, "{option:?}");
    }
}

/// Units that cannot repeat steps: conditions count at communication points, and the run says so.
#[test]
fn analytic_conditions_count_at_communication_points_otherwise() {
    let fixed = "canHandleVariableCommunicationStepSize=\"true\"";
    let equal = DESCRIPTION.replace(fixed, &fixed.replace("true", "false"));
    for (description, every, why) in [
        (DESCRIPTION.to_owned(), 1, "a unit cannot save its state"),
        (equal, 1, "a unit needs equal steps"),
        (with_states(), 2, "a unit needs equal steps"),
    ] {
        let mut scenario = oscillator(0.1);
        scenario["instances"]["a"] = json!({ "unit": "unit" });
        scenario["instances"]["b"]["every"] = json!(every);
        scenario["instances"]["d"]["start"] = json!({ "u": 2.0 });
        scenario["events"] =
            json!([{ "when": { "signal": "d.y", "above": 0.5 }, "set": { "d.u": 1.0 } }]);
        scenario["stop_when"] = json!([{ "when": { "signal": "d.y", "above": 1.05 } }]);
        let bench = bench_of(&scenario);
        bench.unit("unit.fmu", &description, &[]);
        let ran = bench.run(&[]);
        ran.succeeds();
        // 0.6 at 0.3 s, 1.1 at 0.8 s
        let row = last(&bench);
        assert!((row[0] - 0.8).abs() < 1e-12 && (row[3] - 1.1).abs() < 1e-5, "{row:?}");
        let note = format!("checked at communication points, not located between them: {why}");
        assert!(ran.stderr().contains(&note), "{}", ran.stderr());
    }
}

/// What a shortened run does not reach is said, and no error.
#[test]
fn issue_16_events_after_a_shortened_stop_are_noted() {
    let mut scenario = oscillator(0.1);
    scenario["events"] = json!([
        { "at": 1.5, "set": { "d.u": 1.0 } },
        { "when": { "signal": "d.y", "below": 9, "after": 1.2 }, "set": { "d.u": 1.0 } },
    ]);
    scenario["stop_when"] = json!([{ "when": { "signal": "d.y", "below": 9, "after": 1.6 } }]);
    let bench = bench_of(&scenario);
    let ran = bench.run(&["--stop", "1"]);
    ran.succeeds();
    for note in [
        "events[0].at is 1.5 s, and the run ends at 1 s: it does not happen",
        "events[1].when.after is 1.2 s, and the run ends at 1 s: the condition is not checked",
        "stop_when[0].when.after is 1.6 s",
    ] {
        assert!(ran.stderr().contains(note), "{}", ran.stderr());
    }
    assert_eq!((last(&bench)[0], bench.summary()["status"].as_str()), (1.0, Some("finished")));
    let whole = bench.run(&[]);
    assert!(!whole.stderr().contains("it does not happen"), "{}", whole.stderr());
}
