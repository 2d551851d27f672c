//! What a user may ask of a run besides its physics: tolerance, times that units suggest, a unit
//! without a scenario, texts, files, debug messages, a trace of all calls.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION};

/// The description of watched.c, with that DefaultExperiment.
fn watched(experiment: &str) -> String {
    let outputs = ["tolerance", "start", "stop", "length", "y"];
    let output = |(k, name): (usize, &&str)| {
        format!(
            r#"<ScalarVariable name="{name}" valueReference="{k}" causality="output"><Real/>
            </ScalarVariable>"#
        )
    };
    let outputs: String = outputs.iter().enumerate().map(output).collect();
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="watched" guid="w">
  <CoSimulation modelIdentifier="unit" canHandleVariableCommunicationStepSize="true"/>
  <LogCategories><Category name="logEvents"/><Category name="logStatusWarning"/></LogCategories>
  {experiment}
  <ModelVariables>{outputs}
    <ScalarVariable name="u" valueReference="5" causality="input"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="crash_at" valueReference="6" causality="parameter" variability="fixed">
      <Real start="1e300"/></ScalarVariable>
    <ScalarVariable name="file" valueReference="0" causality="parameter" variability="fixed">
      <String start=""/></ScalarVariable>
    <ScalarVariable name="label" valueReference="1" causality="output" variability="discrete">
      <String/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/><Unknown index="2"/><Unknown index="3"/>
    <Unknown index="4"/><Unknown index="5"/><Unknown index="9"/></Outputs></ModelStructure>
</fmiModelDescription>"#
    )
}

const SUGGESTED: &str =
    r#"<DefaultExperiment startTime="0" stopTime="0.4" tolerance="1e-5" stepSize="0.1"/>"#;

/// A bench with `watched.fmu` that suggests 0 to 0.4 s in steps of 0.1 s with tolerance 1e-5.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.source("watched.fmu", "watched.c", &watched(SUGGESTED), &[]);
    bench
}

/// One or two instances of it.
fn scenario() -> Value {
    json!({
        "units": { "w": "watched.fmu" },
        "instances": { "a": { "unit": "w" } },
        "experiment": { "stop": 0.4, "step": 0.1 },
        "record": { "signals": ["a.y"] }
    })
}

/// The last row of the results.
fn last(bench: &Bench) -> Vec<f64> {
    bench.rows().pop().unwrap()
}

/// The unit tells the tolerance that it was given: its own, that of all, or that of the instance.
#[test]
fn issue_the_tolerance_reaches_the_units() {
    let bench = bench();
    bench.source("none.fmu", "watched.c", &watched(""), &[]);
    let mut it = scenario();
    it["units"]["none"] = json!("none.fmu");
    it["instances"]["b"] = json!({ "unit": "w", "tolerance": 1e-8 });
    it["instances"]["c"] = json!({ "unit": "none" });
    it["record"]["signals"] = json!(["*.tolerance"]);
    bench.scenario(&it);
    bench.run(&["--quiet"]).succeeds();
    assert_eq!(last(&bench)[1..], [1e-5, 1e-8, -1.0]);
    let summary = bench.summary();
    assert_eq!(summary["instances"]["b"]["tolerance"], 1e-8);
    assert!(summary["instances"]["c"].get("tolerance").is_none());

    it["experiment"]["tolerance"] = json!(1e-3);
    bench.scenario(&it);
    bench.run(&["--quiet", "--isolate"]).succeeds();
    assert_eq!(last(&bench)[1..], [1e-3, 1e-8, 1e-3]);
    bench.run(&["--quiet", "--tolerance", "1e-4"]).succeeds();
    assert_eq!(last(&bench)[1..], [1e-4; 3]);
    // and what ran can be run again
    bench.maglev(&["run", "out/scenario-as-run.json", "--out", "out", "--quiet"]).succeeds();
    assert_eq!(last(&bench)[1..], [1e-4; 3]);

    bench.run(&["--tolerance", "0"]).fails(2, &["experiment.tolerance is 0"]);
    it["instances"]["b"]["tolerance"] = json!(-1.0);
    bench.scenario(&it);
    bench.run(&[]).fails(2, &["instances.b.tolerance is -1"]);
}

#[test]
fn issue_inspect_shows_the_whole_suggestion() {
    let bench = bench();
    let shown = bench.maglev(&["inspect", "watched.fmu"]).stdout();
    assert!(shown.contains("start 0 s, stop 0.4 s, step 0.1 s, tolerance 1e-5"), "{shown}");
    let some = watched(r#"<DefaultExperiment tolerance="0.0001"/>"#);
    bench.source("some.fmu", "watched.c", &some, &[]);
    let shown = bench.maglev(&["inspect", "some.fmu"]).stdout();
    assert!(shown.contains("experiment  tolerance 1e-4\n"), "{shown}");
}

/// Start, stop and step that are left out are those of the units: the longest span, the smallest step.
#[test]
fn issue_what_the_experiment_leaves_out_is_suggested_by_the_units() {
    let bench = bench();
    let other = watched(r#"<DefaultExperiment startTime="-0.2" stopTime="0.2" stepSize="0.05"/>"#);
    bench.source("other.fmu", "watched.c", &other, &[]);
    let mut it = scenario();
    it["experiment"] = json!({});
    it["record"]["signals"] = json!(["*.start", "*.stop"]);
    bench.scenario(&it);
    let ran = bench.run(&[]);
    ran.succeeds();
    assert_eq!(last(&bench), [0.4, 0.0, 0.4]);
    assert_eq!(bench.rows().len(), 5);
    assert!(
        ran.stderr()
            .contains("stop is left out; using 0.4 s from the DefaultExperiment of watched.fmu"),
        "{}",
        ran.stderr()
    );
    assert!(bench.result("events.csv").contains("experiment.step is left out; using 0.1 s"));

    it["units"]["o"] = json!("other.fmu");
    bench.scenario(&it);
    // a unit without an instance has no say
    bench.run(&["--quiet"]).succeeds();
    assert_eq!(bench.rows().len(), 5);
    it["instances"]["b"] = json!({ "unit": "o" });
    bench.scenario(&it);
    let ran = bench.run(&[]);
    ran.succeeds();
    assert_eq!(last(&bench)[1..], [-0.2, -0.2, 0.4, 0.4]);
    assert_eq!(bench.rows().len(), 13);
    assert!(ran.stderr().contains("other units have other values"), "{}", ran.stderr());
    // the start that is suggested belongs to the stop that is
    bench.run(&["--quiet", "--stop", "0.3"]).succeeds();
    assert_eq!(last(&bench)[1..], [0.0, 0.0, 0.3, 0.3]);
    // what ran is written with its numbers
    let ran: Value = serde_json::from_str(&bench.result("scenario-as-run.json")).unwrap();
    assert_eq!(ran["experiment"], json!({ "start": 0.0, "stop": 0.3, "step": 0.05 }));
}

#[test]
fn issue_an_experiment_that_nobody_completes_is_refused() {
    let bench = bench();
    bench.source("none.fmu", "watched.c", &watched(""), &[]);
    let mut it = scenario();
    it["units"]["w"] = json!("none.fmu");
    it["experiment"] = json!({ "step": 0.1 });
    bench.scenario(&it);
    bench.run(&[]).fails(2, &["experiment.stop is missing", "stopTime", "--stop"]);
    bench.run(&["--quiet", "--stop", "0.2"]).succeeds();
    it["experiment"] = json!({ "stop": 0.2 });
    bench.scenario(&it);
    bench.run(&[]).fails(2, &["experiment.step is missing", "stepSize", "--step"]);
    bench.run(&["--quiet", "--step", "0.1"]).succeeds();
    it["units"]["w"] = json!("nowhere.fmu");
    bench.scenario(&it);
    bench.run(&[]).fails(2, &["units.w", "nowhere.fmu cannot be opened"]);
}

/// y' = u with u = 1 by its start value, or 3 as set: 0.4 and 1.2 after 0.4 s.
#[test]
fn issue_a_unit_runs_without_a_scenario() {
    let bench = bench();
    let ran = bench.maglev(&["run", "watched.fmu"]);
    ran.succeeds();
    let read = |name: &str| fs::read_to_string(bench.path("results/watched").join(name)).unwrap();
    let csv = read("results.csv");
    let mut lines = csv.lines();
    assert_eq!(
        lines.next().unwrap(),
        "time,watched.tolerance,watched.start,watched.stop,watched.length,watched.y,watched.label"
    );
    assert_eq!(lines.clone().count(), 5);
    assert!(lines.last().unwrap().starts_with("0.4,0.00001,0.0,0.4,0.0,0.4,\"at 0.4\""), "{csv}");
    assert!(bench.path("results/watched/report.html").exists());
    assert!(ran.stderr().contains("alone from 0 s to 0.4 s in steps of 0.1 s"), "{}", ran.stderr());

    let set = ["--set", "u=3", "--set", "watched.crash_at=9", "--out", "out", "--quiet"];
    bench.maglev(&[&["run", "watched.fmu"], &set[..]].concat()).succeeds();
    let csv = bench.result("results.csv");
    assert!(csv.starts_with("time,") && csv.contains(",watched.label,watched.u\n"), "{csv}");
    let y: f64 = csv.lines().last().unwrap().split(',').nth(5).unwrap().parse().unwrap();
    assert!((y - 1.2).abs() < 1e-15, "{y}");
    // what ran, as a scenario, gives the same from anywhere
    bench.maglev(&["run", "out/scenario-as-run.json", "--out", "again", "--quiet"]).succeeds();
    assert!(csv == fs::read_to_string(bench.path("again/results.csv")).unwrap());

    bench
        .maglev(&["run", "watched.fmu", "--set", "v=3"])
        .fails(2, &["no variable \"v\"", "watched"]);
    bench.maglev(&["run", "nowhere.fmu"]).fails(2, &["nowhere.fmu cannot be opened"]);
}

/// A unit that suggests nothing: 1 s in 500 steps; with times from the command line those.
#[test]
fn issue_a_unit_alone_has_a_span_and_a_step() {
    let bench = Bench::new();
    bench.source("a.b[1].fmu", "watched.c", &watched(""), &[]);
    let rows = |arguments: &[&str]| {
        let all = [&["run", "a.b[1].fmu", "--out", "out", "--quiet"], arguments].concat();
        bench.maglev(&all).succeeds();
        let csv = bench.result("results.csv");
        assert!(csv.starts_with("time,a_b_1_.tolerance,"), "{csv}");
        (csv.lines().count() - 1, csv.lines().last().unwrap().split(',').next().unwrap().to_owned())
    };
    assert_eq!(rows(&[]), (501, "1.0".to_owned()));
    assert_eq!(rows(&["--stop", "2", "--step", "0.5"]), (5, "2.0".to_owned()));
    assert_eq!(rows(&["--step", "0.4"]), (3, "0.8".to_owned()));
}

/// A unit alone that is killed by Ctrl-C, or by itself, goes on from its checkpoint.
#[test]
fn issue_a_unit_alone_can_be_resumed() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &support::with_states(), &[]);
    let run = ["run", "unit.fmu", "--stop", "1", "--step", "0.1", "--set", "u=2", "--out"];
    bench.maglev(&[&run[..], &["whole", "--quiet"]].concat()).succeeds();
    let fails = ["--set", "fault=4", "--set", "fail_time=0.75", "--checkpoint-every", "0.2"];
    let ran = bench.maglev(&[&run[..], &["out"], &fails[..]].concat());
    ran.fails(1, &["the model broke"]);
    assert!(bench.path("out/checkpoint.bin").exists());
    bench.maglev(&["resume", "out"]).fails(1, &["the model broke"]);
    let whole = fs::read_to_string(bench.path("whole/results.csv")).unwrap();
    let found = bench.result("results.csv");
    assert!(whole.starts_with(&found) && found.lines().count() == 9, "{found}");
}

/// Texts in both tables and in the report; numbers and pictures do without them.
#[test]
fn issue_strings_are_recorded() {
    let bench = bench();
    let mut it = scenario();
    it["record"] = json!({ "signals": ["a.label", "a.y", "a.*"], "format": ["csv", "parquet"] });
    it["plots"] = json!([{ "file": "p.svg", "panels": [{ "signals": ["a.*"] }] }]);
    bench.scenario(&it);
    for arguments in [&["--quiet"][..], &["--quiet", "--isolate"]] {
        bench.run(arguments).succeeds();
        let csv = bench.result("results.csv");
        let lines: Vec<&str> = csv.lines().collect();
        // the star passes over texts
        assert_eq!(lines[0], "time,a.label,a.y,a.tolerance,a.start,a.stop,a.length,a.u,a.crash_at");
        assert!(lines[1].starts_with("0.0,\"not yet\",0.0,"), "{csv}");
        assert!(lines[2].starts_with("0.1,\"at 0.1, \"\"early\"\"\",0.1,"), "{csv}");
        assert!(lines[5].starts_with("0.4,\"at 0.4\",0.4,"), "{csv}");
        let summary = bench.summary();
        assert_eq!(summary["signals"]["a.label"], json!({ "unit": null, "final_text": "at 0.4" }));
        assert_eq!(summary["signals"]["a.y"]["final"], 0.4);
        assert!(bench.result("report.html").contains("a.label"));
        assert!(
            bench.result("p.svg").contains("a.y") && !bench.result("p.svg").contains("a.label")
        );
    }
    // without the text, the report is made of the copy in Parquet
    fs::remove_file(bench.path("out/results.csv")).unwrap();
    bench.maglev(&["report", "out"]).succeeds();

    it["plots"][0]["panels"][0]["signals"] = json!(["a.label"]);
    bench.scenario(&it);
    bench.run(&[]).fails(2, &["plots[0].panels[0].signals", "a.label"]);
}

/// A connected String is read once and recorded as it is handed on.
#[test]
fn issue_connected_strings_are_recorded() {
    let bench = bench();
    let mut it = scenario();
    it["units"]["u"] = json!("unit.fmu");
    it["instances"]["b"] = json!({ "unit": "u" });
    it["connections"] = json!([{ "from": "a.label", "to": "b.s" }]);
    it["record"]["signals"] = json!(["a.label", "b.t"]);
    bench.scenario(&it);
    bench.run(&["--quiet", "--no-report", "--algorithm", "jacobi"]).succeeds();
    let csv = bench.result("results.csv");
    // the receiver's step is made with the text at its beginning
    let end = "0.30000000000000004,\"at 0.3\",\"at 0.2\"\n0.4,\"at 0.4\",\"at 0.3\"\n";
    assert!(csv.ends_with(end), "{csv}");
}

/// The unit finds the file wherever it is run from, and the file that has the path counts.
#[test]
fn issue_paths_are_relative_to_the_scenario() {
    let bench = bench();
    fs::create_dir_all(bench.path("sub/data")).unwrap();
    fs::write(bench.path("sub/data/profile.csv"), "12345").unwrap();
    fs::write(bench.path("profile.csv"), "123").unwrap();
    let mut it = scenario();
    it["units"]["w"] = json!("../watched.fmu");
    it["instances"]["a"]["parameters"] = json!({ "file": { "path": "data/profile.csv" } });
    it["record"]["signals"] = json!(["a.length"]);
    fs::write(bench.path("sub/s.json"), it.to_string()).unwrap();
    bench.maglev(&["run", "sub/s.json", "--out", "out", "--quiet"]).succeeds();
    assert_eq!(last(&bench)[1], 5.0);
    fs::rename(bench.path("out"), bench.path("first")).unwrap();
    bench.shell("cd sub && maglev run ../first/scenario-as-run.json --out ../out -q").succeeds();
    assert_eq!(last(&bench)[1], 5.0);

    let patch = json!({ "extends": "sub/s.json",
        "instances": { "a": { "parameters": { "file": { "path": "profile.csv" } } } } });
    bench.scenario(&patch);
    bench.run(&["--quiet"]).succeeds();
    assert_eq!(last(&bench)[1], 3.0);

    fs::remove_file(bench.path("sub/data/profile.csv")).unwrap();
    bench.maglev(&["run", "sub/s.json", "--out", "never"]).fails(
        2,
        &[
            "instances.a.parameters.file",
            "cannot use the file",
            "sub/data/profile.csv",
            "No such file",
        ],
    );
    assert!(!bench.path("never").exists());
    it["instances"]["a"]["parameters"] = json!({ "crash_at": { "path": "s.json" } });
    fs::write(bench.path("sub/s.json"), it.to_string()).unwrap();
    bench.maglev(&["run", "sub/s.json"]).fails(2, &["instances.a.parameters.crash_at", "Real"]);
    it["instances"]["a"]["parameters"] = json!({ "file": { "pat": "s.json" } });
    fs::write(bench.path("sub/s.json"), it.to_string()).unwrap();
    bench.maglev(&["run", "sub/s.json"]).fails(2, &["instances.a.parameters.file", "\"path\""]);
}

/// Number of lines in which a text is.
fn count(text: &str, part: &str) -> usize {
    text.lines().filter(|line| line.contains(part)).count()
}

/// Levels: what is shown, and at debug what units are asked for. events.csv has all that arrives.
#[test]
fn issue_log_levels_filter_what_is_shown() {
    let bench = bench();
    let mut it = scenario();
    bench.scenario(&it);
    let stepped = "unit a [fmi2OK logEvents] stepped";
    for isolate in [&[][..], &["--isolate"]] {
        let run = |level: &[&str]| bench.run(&[level, isolate].concat());
        for level in [&[][..], &["--log-level", "info"]] {
            let ran = run(level);
            ran.succeeds();
            assert_eq!(count(&ran.stderr(), "stepped"), 0, "{}", ran.stderr());
            assert_eq!(count(&bench.result("events.csv"), "stepped"), 0);
        }
        let ran = run(&["--log-level", "debug"]);
        ran.succeeds();
        assert_eq!(count(&ran.stderr(), stepped), 4, "{}", ran.stderr());
        assert_eq!(count(&ran.stderr(), "a debug warning"), 4, "{}", ran.stderr());
        assert_eq!(count(&bench.result("events.csv"), "message,a,[fmi2OK] stepped"), 4);
        let errors = run(&["--log-level", "error", "--set", "a.u=-1"]);
        errors.succeeds();
        assert_eq!(count(&errors.stderr(), "unit a [fmi2Error logStatusError] negative"), 4);
        assert_eq!(count(&errors.stderr(), "note: "), 4, "{}", errors.stderr());
        let warnings = run(&["--set", "a.u=-1"]);
        assert_eq!(count(&warnings.stderr(), "unit a warns: negative"), 1, "{}", warnings.stderr());
    }
    bench
        .run(&["--log-level", "loud"])
        .fails(2, &["loud", "[possible values: error, warning, info, debug]"]);
    it["log_level"] = json!("debug");
    bench.scenario(&it);
    let ran = bench.run(&[]);
    assert_eq!(count(&ran.stderr(), stepped), 4, "{}", ran.stderr());
}

/// Per instance: on, off, or by category.
#[test]
fn issue_debug_messages_are_chosen_per_instance() {
    let bench = bench();
    let mut it = scenario();
    it["instances"] = json!({
        "a": { "unit": "w", "debug_log": true },
        "b": { "unit": "w", "debug_log": ["logEvents"] },
        "c": { "unit": "w", "debug_log": false },
        "d": { "unit": "w" }
    });
    bench.scenario(&it);
    for isolate in [&["--quiet"][..], &["--quiet", "--isolate"]] {
        bench.run(isolate).succeeds();
        let events = bench.result("events.csv");
        let of = |name: &str, text: &str| count(&events, &format!(",{name},{text}"));
        let both = ["[fmi2OK] stepped", "[fmi2Warning] a debug warning"];
        assert_eq!(both.map(|text| of("a", text)), [4, 4], "{events}");
        assert_eq!(both.map(|text| of("b", text)), [4, 0], "{events}");
        for silent in ["c", "d"] {
            assert_eq!(both.map(|text| of(silent, text)), [0, 0], "{events}");
        }
    }
    // at debug, only who says no is silent
    bench.run(&["--quiet", "--log-level", "debug"]).succeeds();
    let events = bench.result("events.csv");
    assert_eq!((count(&events, ",c,"), count(&events, ",d,")), (0, 8), "{events}");

    it["instances"]["b"]["debug_log"] = json!(["logEvent"]);
    bench.scenario(&it);
    bench
        .run(&[])
        .fails(2, &["instances.b.debug_log", "\"logEvent\"", "did you mean \"logEvents\""]);
    it["instances"]["b"] = json!({ "unit": "u", "debug_log": ["x"] });
    it["units"]["u"] = json!("unit.fmu");
    bench.scenario(&it);
    bench.run(&[]).fails(2, &["no log category \"x\"", "declares none"]);
}

/// Every call is there, in order, with what went in and came out.
#[test]
fn issue_a_trace_has_every_call() {
    let bench = bench();
    let mut it = scenario();
    it["instances"]["a"]["parameters"] = json!({ "file": { "path": "scenario.json" } });
    it["record"]["signals"] = json!(["a.label", "a.y"]);
    it["experiment"]["stop"] = json!(0.1);
    bench.scenario(&it);
    for isolate in [&["--quiet"][..], &["--quiet", "--isolate"]] {
        bench.run(&[isolate, &["--trace", "calls.txt", "--set", "a.u=2.5"]].concat()).succeeds();
        let text = fs::read_to_string(bench.path("calls.txt")).unwrap();
        let calls: Vec<&str> =
            text.lines().skip(1).map(|line| line.split_once(' ').unwrap().1).collect();
        // lines come in pairs: the call, and what it brought
        for pair in calls.chunks(2) {
            let call = pair[0].split_once('(').unwrap().0;
            assert!(pair[1].starts_with(&format!("{call} = ")), "{pair:?}");
        }
        let has =
            |part: &str| assert!(calls.iter().any(|line| line.contains(part)), "{part}\n{text}");
        has("a fmi2Instantiate(\"a\", fmi2CoSimulation, \"w\", \"file:///");
        has("loggingOn false)");
        has("a fmi2SetupExperiment(tolerance Some(1e-5), start 0.0, stop 0.1)");
        has("a fmi2SetString(file #0 = \"/");
        has("a fmi2SetReal(u #5 = 2.5)");
        has("a fmi2DoStep(from 0.0 over 0.1, noSetFMUStatePrior true)");
        has("a fmi2DoStep = fmi2OK in ");
        has("a fmi2GetReal(y #4)");
        has(" us: y #4 = 0.25");
        has("us: label #1 = \"at 0.1, \\\"early\\\"\"");
        assert!(calls[calls.len() - 2] == "a fmi2FreeInstance()", "{text}");
        let step = calls.iter().position(|line| line.contains("DoStep(")).unwrap();
        let exit = calls.iter().position(|line| line.contains("ExitInit")).unwrap();
        assert!(exit < step, "{text}");
        // seconds since the start never run backwards
        let times: Vec<f64> = text
            .lines()
            .skip(1)
            .map(|line| line.split_once(' ').unwrap().0.parse().unwrap())
            .collect();
        assert!(times.windows(2).all(|pair| pair[0] <= pair[1] + 1e-4), "{text}");
    }
    // beside the scenario, where the scenario says so; to repeat a run leaves its trace alone
    it["trace"] = json!("trace.txt");
    bench.scenario(&it);
    bench.run(&["--quiet"]).succeeds();
    let before = fs::read_to_string(bench.path("trace.txt")).unwrap();
    bench.maglev(&["run", "out/scenario-as-run.json", "--out", "x", "--quiet"]).succeeds();
    assert!(before == fs::read_to_string(bench.path("trace.txt")).unwrap());
    bench.run(&["--trace", "no/such/folder/t"]).fails(2, &["the trace", "no/such/folder/t"]);
}

/// After a crash, the last line is the call that it happened in.
#[cfg(unix)]
#[test]
fn issue_a_trace_ends_with_the_call_that_crashes() {
    let bench = bench();
    bench.scenario(&scenario());
    for isolate in [&[][..], &["--isolate"]] {
        let crash = ["--set", "a.crash_at=0.3", "--trace", "calls.txt"];
        let ran = bench.run(&[isolate, &crash[..]].concat());
        assert!(ran.signal().is_some() || ran.status() == 1, "{}", ran.stderr());
        let text = fs::read_to_string(bench.path("calls.txt")).unwrap();
        let end = text.lines().last().unwrap();
        assert!(end.contains("a fmi2DoStep(from 0.2 over"), "{text}");
    }
}

/// Whatever else is asked for, a unit that suggests nothing is told nothing: as before.
#[test]
fn invariant_without_options_nothing_is_told() {
    let bench = Bench::new();
    assert!(!DESCRIPTION.contains("DefaultExperiment"));
    bench.maglev(&["run", "unit.fmu", "--out", "out", "-q", "--trace", "t"]).succeeds();
    let text = fs::read_to_string(bench.path("t")).unwrap();
    assert!(text.contains("tolerance None, start 0.0, stop 1.0)"), "{text}");
    assert!(!text.contains("fmi2SetDebugLogging"), "{text}");
}
