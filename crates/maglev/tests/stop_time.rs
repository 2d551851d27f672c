//! No step ends beyond the stop time that the units were given, as they compute it: t + h.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION, ring, with_states};

/// Errors wherever t + h > stop, and where a step does not begin where the last one ended.
const STRICT: [&str; 2] = ["-DSTRICT_STOP", "-DSTRICT_TIME"];

fn over(start: f64, stop: f64, step: f64) -> Value {
    let mut scenario = ring();
    scenario["experiment"] = json!({ "start": start, "stop": stop, "step": step });
    scenario
}

/// Spans whose last step of constant size ends one rounding beyond the stop time: 0.2 + 0.1 > 0.3.
const BEYOND: [(f64, f64); 6] =
    [(0.3, 0.1), (0.6, 0.1), (1.1, 0.1), (0.07, 0.01), (1.005, 0.001), (2.0, 1.0 / 30.0)];

/// Units that return fmi2Error for a step past the stop time, as FMI 2.0.5, 2.1.6, demands, run to the
/// end in every coupling, and the last recorded time is the stop time itself where the step divides
/// the span.
#[test]
fn issue_no_step_ends_beyond_the_stop_time() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &STRICT);
    for (stop, step) in BEYOND {
        bench.scenario(&over(0.0, stop, step));
        for further in [
            &["--algorithm", "jacobi"][..],
            &["--algorithm", "gauss-seidel"],
            &["--algorithm", "iterated"],
            &["--algorithm", "gauss-seidel", "--isolate"],
        ] {
            bench.run(&[&["--quiet", "--no-report"], further].concat()).succeeds();
            let summary = bench.summary();
            assert_eq!(summary["reached"].as_f64().unwrap(), stop, "{step} {further:?}");
            assert_eq!(bench.rows().last().unwrap()[0], stop, "{step} {further:?}");
        }
    }
    // where the start is not zero, no double may lie at t + h = t(n+1): only the stop time counts
    bench.unit("unit.fmu", &with_states(), &STRICT[..1]);
    for (start, stop, step) in
        [(0.1, 0.4, 0.1), (-0.1, 0.2, 0.1), (-1.0, 1.3, 0.1), (1e3, 1000.7, 0.1)]
    {
        bench.scenario(&over(start, stop, step));
        bench.run(&["--quiet", "--no-report"]).succeeds();
        let reached = bench.summary()["reached"].as_f64().unwrap();
        assert!(reached <= stop && stop - reached < 1e-12, "{reached} {stop}");
    }
}

/// The same for steps of one's own, for steps in parts after a discarded one, and for variable steps
/// by both estimates.
#[test]
fn issue_steps_in_parts_end_where_the_whole_one_does() {
    let bench = Bench::new();
    let variable = |estimate: &str| json!({ "tolerance": 1e-4, "estimate": estimate });
    for (stop, step) in BEYOND {
        let mut own = over(0.0, stop, step);
        own["instances"]["b"]["steps"] = json!(3);
        let plain = over(0.0, stop, step);
        let predicted = json!({ "variable": variable("predictor") });
        let doubled = json!({ "variable": variable("doubling") });
        let largest = format!("-DLARGEST_STEP={}", step / 3.0);
        let cases: [(&Value, Value, &[&str]); 4] = [
            (&own, json!({}), &STRICT),
            (&plain, json!({}), &[STRICT[0], STRICT[1], &largest]),
            (&plain, predicted, &STRICT),
            (&plain, doubled, &STRICT),
        ];
        for (scenario, algorithm, defines) in cases {
            bench.unit("unit.fmu", &with_states(), defines);
            let mut scenario = scenario.clone();
            scenario["algorithm"] = algorithm;
            scenario["instances"]["a"]["start"] = json!({ "y": 1.0 });
            bench.scenario(&scenario);
            bench.run(&["--quiet", "--no-report"]).succeeds();
            assert_eq!(bench.summary()["reached"].as_f64().unwrap(), stop, "{step} {defines:?}");
        }
    }
}

/// A unit whose steps may not vary gets the step to the last bit, except for one that would end beyond
/// the stop time; and its steps of its own likewise.
#[test]
fn issue_equal_steps_are_equal_to_the_last_bit() {
    let bench = Bench::new();
    let fixed = DESCRIPTION.replace("canHandleVariableCommunicationStepSize=\"true\"", "");
    assert_ne!(fixed, DESCRIPTION);
    for (stop, step) in BEYOND {
        for parts in [1, 2] {
            let size = format!("-DEQUAL_STEPS={:?}", step / f64::from(parts));
            bench.unit("unit.fmu", &fixed, &[STRICT[0], &size]);
            let mut scenario = over(0.0, stop, step);
            for name in ["a", "b"] {
                scenario["instances"][name]["steps"] = json!(parts);
            }
            bench.scenario(&scenario);
            bench.run(&["--quiet", "--no-report"]).succeeds();
        }
    }
}
