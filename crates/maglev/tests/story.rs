//! Events, stop conditions and inputs over time, through the command.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{DESCRIPTION, bench_of, last, oscillator};

/// a' = g b, b' = a from a = 1, b = 0: with g = −1 until the event, with g = −4 after it.
fn exact(event: f64, time: f64) -> [f64; 2] {
    let (a, b) = (event.cos(), event.sin());
    let (sin, cos) = (2.0 * (time - event)).sin_cos();
    [a * cos - 2.0 * b * sin, b * cos + a / 2.0 * sin]
}

/// The order of the coupling is that without an event, though the event is between two communication points: for
/// algorithms in which targets step before sources, too.
#[test]
fn order_is_kept_across_an_event_between_communication_points() {
    // in the middle of a step for all sizes: the history begins anew there, so that its place in the step counts
    let event = 0.73;
    // the order 2 is what a start without history allows
    let order = 2.0;
    for (algorithm, extrapolation) in
        [("gauss-seidel", 1), ("jacobi", 1), ("jacobi", 2), ("gauss-seidel", 2), ("newton", 1)]
    {
        let error = |step: f64| {
            let mut scenario = oscillator(step);
            scenario["algorithm"] = json!({ "name": algorithm, "extrapolation": extrapolation });
            scenario["events"] = json!([
                { "name": "harder", "at": event, "set": { "c.gain": -4.0 } }
            ]);
            let bench = bench_of(&scenario);
            bench.run(&["--quiet"]).succeeds();
            let row = last(&bench);
            assert_eq!(row[0], 2.0);
            let [a, b] = exact(event, 2.0);
            f64::max((row[1] - a).abs(), (row[2] - b).abs())
        };
        let errors = [0.02, 0.02 / 3.0, 0.02 / 9.0].map(error);
        let found = (errors[0] / errors[2]).ln() / 9.0_f64.ln();
        assert!(found > order - 0.3, "{algorithm} {extrapolation}: order {found}, {errors:?}");
    }
}

/// The coupling is exact for a constant input, so only the time of the event counts: y = ∫ u with u = 0 until the event.
#[test]
fn analytic_events_happen_at_their_time_and_in_their_order() {
    let mut scenario = oscillator(0.1);
    scenario["events"] = json!([
        { "name": "second", "at": 0.25, "set": { "d.u": 3.0 } },
        { "at": 0.13, "set": { "d.u": 2.0, "d.gain": 5.0 } },
        { "name": "overruled", "at": 0.13, "set": { "d.u": 1.0 } },
    ]);
    let bench = bench_of(&scenario);
    bench.run(&[]).succeeds();
    let row = last(&bench);
    assert!((row[3] - (0.12 * 1.0 + 1.75 * 3.0)).abs() < 1e-12, "{row:?}");
    assert!((row[4] - 15.0).abs() < 1e-12);
    assert_eq!(bench.rows().len(), 21, "rows stay on the communication points");
    let events = bench.result("events.csv");
    let first = events.find("0.13,event,,\"events[1]: d.u = 2, d.gain = 5\"").unwrap();
    let second = events.find("0.25,event,,second: d.u = 3").unwrap();
    assert!(first < events.find("0.13,event,,overruled: d.u = 1").unwrap() && first < second);
    assert_eq!(bench.summary()["events"]["event"], 3);
}

/// The unit integrates polynomials up to the third degree exactly: y is the integral of the input.
#[test]
fn analytic_inputs_over_time_are_integrated() {
    for (signal, integral, tolerance) in [
        (json!({ "type": "step", "time": 0.33, "before": 1, "after": 5 }), 0.33 + 5.0 * 1.67, 1e-5),
        (
            json!({ "type": "ramp", "start": 0.33, "end": 1.27, "to": 4 }),
            4.0 * 0.47 + 4.0 * 0.73,
            1e-12,
        ),
        (json!({ "type": "pulse", "start": 0.33, "end": 1.27, "height": 4 }), 2.0 * 0.94, 1e-3),
        (
            json!({ "type": "sine", "amplitude": 3, "frequency": 1, "phase": 0.5, "mean": 1 }),
            2.0,
            1e-4,
        ),
        (
            json!({ "type": "table", "times": [0.33, 0.55, 1.0], "values": [1, 2, 4],
                    "interpolation": "hold" }),
            0.55 + 2.0 * 0.45 + 4.0,
            1e-5,
        ),
        (json!({ "type": "table", "times": [0.0, 1.0, 2.0], "values": [1, 3, 2] }), 4.5, 1e-12),
        (json!({ "type": "csv", "file": "wind.csv", "column": "force", "factor": 2 }), 9.0, 1e-12),
    ] {
        let all = json!({ "unit": "unit", "input_derivatives": 3 });
        let more = json!({ "unit": "unit", "input_derivatives": 3, "steps": 3 });
        for instance in [all, more] {
            let mut scenario = oscillator(0.1);
            scenario["instances"]["d"] = instance;
            scenario["inputs"] = json!([{ "to": "d.u", "signal": signal }]);
            let bench = bench_of(&scenario);
            std::fs::write(bench.path("wind.csv"), "time,force\n0,1\n1,3\n2,2\n").unwrap();
            bench.run(&["--quiet"]).succeeds();
            let y = last(&bench)[3];
            assert!((y - integral).abs() < tolerance, "{signal}: {y}, not {integral}");
        }
    }
}

/// A resumed run does what the run without a stop does: events that have happened do not happen again, values before
/// the checkpoint count for `rising`, and noise continues.
#[test]
fn invariant_a_resumed_run_has_the_same_story() {
    for variable in [false, true] {
        let mut scenario = oscillator(0.01);
        scenario["experiment"]["stop"] = json!(3.0);
        scenario["inputs"] = json!([
            { "to": "d.u", "signal": { "type": "noise", "rms": 1, "interval": 0.03, "seed": 4 } }
        ]);
        scenario["events"] = json!([
            { "at": 0.5, "set": { "c.gain": -2.0 } },
            { "when": { "signal": "b.y", "rising": 0.3 }, "set": { "d.gain": 3.0 } },
            { "at": 1.234, "set": { "c.gain": -1.0 } },
        ]);
        scenario["stop_when"] =
            json!([{ "when": { "signal": "b.y", "falling": 0.2, "after": 0.1 } }]);
        if variable {
            scenario["algorithm"] = json!({ "variable": { "tolerance": 1e-6 } });
        }
        let bench = bench_of(&scenario);
        bench.run(&["--checkpoint-every", "0.31", "--quiet"]).succeeds();
        let whole = bench.result("results.csv");
        assert_eq!(bench.summary()["status"], "stopped");
        assert!(!bench.path("out/checkpoint.bin").exists());
        // end the run with a time limit that is below its end: an interrupted run keeps its checkpoint
        let stop = bench.summary()["reached"].as_f64().unwrap();
        assert!(stop > 1.3 && stop < 3.0, "{stop}");
        let out = bench.path("part");
        let mut child = bench.start(&[
            "run",
            "scenario.json",
            "--out",
            "part",
            "--checkpoint-every",
            "0.31",
            "--real-time",
            "1",
            "--quiet",
        ]);
        std::thread::sleep(std::time::Duration::from_millis(1900));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(out.join("checkpoint.bin").exists());
        bench.maglev(&["resume", "part", "--quiet"]).succeeds();
        let resumed = std::fs::read_to_string(out.join("results.csv")).unwrap();
        assert!(resumed == whole, "variable: {variable}");
        let events = std::fs::read_to_string(out.join("events.csv")).unwrap();
        for count in ["c.gain = -2", "d.gain = 3", "c.gain = -1", "has fallen below"] {
            assert_eq!(events.matches(count).count(), 1, "{count}: {events}");
        }
    }
}

/// A unit that needs equal steps: what is due between communication points takes effect at the next one, and the run
/// says so.
#[test]
fn analytic_equal_steps_delay_events_and_say_so() {
    let fixed = "canHandleVariableCommunicationStepSize=\"true\"";
    let description = DESCRIPTION.replace(fixed, &fixed.replace("true", "false"));
    for every in [false, true] {
        let mut scenario = oscillator(0.1);
        scenario["events"] = json!([{ "at": 0.25, "set": { "d.u": 1.0 } }]);
        if every {
            scenario["instances"]["b"]["every"] = json!(2);
        }
        let bench = bench_of(&scenario);
        if !every {
            bench.unit("unit.fmu", &description, &[]);
            scenario["instances"]["a"] = json!({ "unit": "unit" });
            bench.scenario(&scenario);
        }
        let ran = bench.run(&[]);
        ran.succeeds();
        assert!((last(&bench)[3] - 1.7).abs() < 1e-12);
        let note = "the first at 0.25 s, take effect at the next communication point";
        assert!(ran.stderr().contains(note), "{}", ran.stderr());
        assert!(bench.result("events.csv").contains("0.30000000000000004,event"));
        // nothing to say where all are on communication points
        scenario["events"][0]["at"] = json!(0.3);
        bench.scenario(&scenario);
        assert!(!bench.run(&[]).stderr().contains("take effect"));
    }
}

/// In processes of their own, with threads, and with values of --set, the results are the same.
#[test]
fn invariant_isolation_and_set_work_with_a_story() {
    let mut scenario = oscillator(0.05);
    scenario["inputs"] = json!([
        { "to": "d.u", "signal": { "type": "sine", "amplitude": 1, "frequency": 0.7 } }
    ]);
    scenario["events"] = json!([{ "at": 0.333, "set": { "c.gain": -2.0 } }]);
    let bench = bench_of(&scenario);
    bench.run(&["--quiet"]).succeeds();
    let plain = bench.result("results.csv");
    bench.run(&["--quiet", "--isolate"]).succeeds();
    assert_eq!(bench.result("results.csv"), plain);
    let z = last(&bench)[4];
    bench.run(&["--quiet", "--set", "d.gain=3"]).succeeds();
    assert!(z != 0.0 && (last(&bench)[4] / z - 3.0).abs() < 1e-12);
    bench
        .run(&["--set", "d.u=3"])
        .fails(2, &["inputs[0].to", "d.u", "--set gives it a constant value"]);
}

#[test]
fn refusal_bad_stories_say_where_and_why() {
    let set = json!({ "d.gain": 2 });
    let when = |text: &str| {
        let mut when: Value = serde_json::from_str(text).unwrap();
        when["signal"] = when["signal"].as_str().unwrap_or("d.y").into();
        json!([{ "when": when, "set": { "d.gain": 2 } }])
    };
    let input = |to: &str, signal: Value| json!([{ "to": to, "signal": signal }]);
    let sine = json!({ "type": "sine", "amplitude": 1, "frequency": 1 });
    for (key, value, texts) in [
        ("events", json!([{ "at": 0.1, "set": {} }]), vec!["events[0].set is empty"]),
        ("events", json!([{ "set": set }]), vec!["events[0].at is missing"]),
        (
            "events",
            json!([{ "at": -1, "set": set }]),
            vec!["events[0].at is -1", "before the start"],
        ),
        ("events", json!([{ "at": 1, "sett": set }]), vec!["events[0]", "`sett`"]),
        (
            "events",
            json!([{ "at": 1, "set": { "d.gian": 1 } }]),
            vec!["events[0].set", "no variable \"gian\" in d", "did you mean \"gain\"?"],
        ),
        (
            "events",
            json!([{ "at": 1, "set": { "x.gain": 1 } }]),
            vec!["events[0].set", "no instance \"x\""],
        ),
        (
            "events",
            json!([{ "at": 1, "set": { "d.fault": 1 } }]),
            vec!["events[0].set", "d.fault", "neither tunable nor an unconnected input"],
        ),
        ("events", json!([{ "at": 1, "set": { "a.u": 1 } }]), vec!["a.u", "unconnected input"]),
        ("events", json!([{ "at": 1, "set": { "d.gain": 11 } }]), vec!["d.gain", "11", "10"]),
        ("events", json!([{ "at": 1, "set": { "d.gain": "x" } }]), vec!["d.gain", "Real"]),
        (
            "events",
            json!([{ "at": 1, "set": { "d.s": { "path": "x" } } }]),
            vec!["events[0].set", "path of a file"],
        ),
        ("events", when("{}"), vec!["events[0].when is given with 0 comparisons"]),
        ("events", when(r#"{"above": 1, "below": 2}"#), vec!["given with 2 comparisons"]),
        ("events", when(r#"{"above": 1, "after": -3}"#), vec!["events[0].when.after is -3"]),
        (
            "events",
            when(r#"{"above": 1, "signal": "d.*"}"#),
            vec!["events[0].when.signal", "\"d.*\" matches signals of different units", "d.u (m)"],
        ),
        (
            "events",
            when(r#"{"above": 1, "signal": "d.yy"}"#),
            vec!["events[0].when.signal", "\"yy\"", "did you mean"],
        ),
        ("events", when(r#"{"above": 1, "signal": "d.t"}"#), vec!["events[0].when.signal", "d.t"]),
        (
            "stop_when",
            json!([{ "when": { "signal": "q*.y", "above": 1 } }]),
            vec!["stop_when[0].when.signal", "q*.y"],
        ),
        ("stop_when", json!([{ "when": { "signal": "d.y" } }]), vec!["stop_when[0].when is given"]),
        (
            "inputs",
            input("d.y", sine.clone()),
            vec!["inputs[0].to", "d.y is an output, not an input"],
        ),
        ("inputs", input("a.u", sine.clone()), vec!["inputs[0].to", "a.u", "c.z"]),
        ("inputs", input("d.b", sine.clone()), vec!["d.b", "Real inputs", "Boolean"]),
        ("inputs", input("d.uu", sine.clone()), vec!["inputs[0].to", "did you mean"]),
        (
            "inputs",
            json!([{ "to": ["d.u", "d.u"], "signal": sine }]),
            vec!["inputs[0].to", "d.u", "it has a signal already"],
        ),
        ("inputs", input("d.u", json!({ "type": "sinus" })), vec!["inputs[0].signal", "sinus"]),
        (
            "inputs",
            input("d.u", json!({ "type": "step", "time": 1, "after": 1, "befor": 0 })),
            vec!["inputs[0].signal", "befor"],
        ),
        (
            "inputs",
            input("d.u", json!({ "type": "ramp", "start": 2, "end": 1, "to": 1 })),
            vec!["inputs[0].signal.end is 1", "after \"start\""],
        ),
        (
            "inputs",
            input("d.u", json!({ "type": "table", "times": [0, 2, 1], "values": [1, 1, 1] })),
            vec!["inputs[0].signal.times is 1 after 2"],
        ),
        (
            "inputs",
            input("d.u", json!({ "type": "table", "times": [0, 2], "values": [1] })),
            vec!["inputs[0].signal.values is 1 values for 2 times"],
        ),
        (
            "inputs",
            input("d.u", json!({ "type": "csv", "file": "none.csv", "column": "x" })),
            vec!["inputs[0].signal", "cannot read", "none.csv"],
        ),
        (
            "inputs",
            input("d.u", json!({ "type": "noise", "rms": 1, "interval": 0 })),
            vec!["inputs[0].signal.interval is 0"],
        ),
    ] {
        let mut scenario = oscillator(0.1);
        scenario[key] = value;
        bench_of(&scenario).run(&[]).fails(2, &texts);
    }
    // an event at an input that a signal drives
    let mut scenario = oscillator(0.1);
    scenario["inputs"] = input("d.u", sine);
    scenario["events"] = json!([{ "at": 1, "set": { "d.u": 1 } }]);
    bench_of(&scenario)
        .run(&[])
        .fails(2, &["events[0].set", "it follows a signal under \"inputs\""]);
}
