//! Whatever is wrong with the input, the command says what, where and how to mend it, and ends
//! with status 2; a run that fails ends with 1 and keeps its results.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use serde_json::json;
use support::{Bench, DESCRIPTION, ring};

#[test]
fn issue_a_missing_scenario_is_named() {
    Bench::new()
        .run(&[])
        .fails(2, &["cannot read the scenario", "scenario.json", "No such file", "help:"]);
}

#[test]
fn issue_files_that_are_not_scenarios_are_refused() {
    let bench = Bench::new();
    fs::create_dir(bench.path("folder")).unwrap();
    fs::copy(bench.path("unit.fmu"), bench.path("unit.zip")).unwrap();
    fs::write(bench.path("text.txt"), "hello").unwrap();
    fs::write(bench.path("empty.json"), "").unwrap();
    fs::write(bench.path("cut.json"), "{ \"units\": {").unwrap();
    for (file, texts) in [
        (
            "folder",
            [
                "cannot read the scenario",
                "help: this is a folder; give the path of a .json file in it",
            ],
        ),
        ("text.txt", ["text.txt is not JSON", "line 1 column 1"]),
        ("empty.json", ["empty.json is not JSON", "help: correct the syntax"]),
        ("cut.json", ["cut.json is not JSON", "line 1 column 12"]),
        ("unit.zip", ["cannot read the scenario", "a unit that runs alone is a .fmu file"]),
    ] {
        bench.maglev(&["run", file]).fails(2, &texts);
    }
    // what is JSON, but no scenario, is another matter
    fs::write(bench.path("bare.json"), "{ \"units\": {} }").unwrap();
    bench.maglev(&["run", "bare.json"]).fails(2, &["missing field", "`maglev schema`"]);
    // nothing at all: how it is used
    bench.maglev(&["run"]).fails(2, &["Usage: maglev run", "Examples:"]);
}

#[test]
fn issue_files_that_are_not_fmus_are_refused() {
    let bench = Bench::new();
    bench
        .maglev(&["inspect", "."])
        .fails(2, &["is a directory", "help: give the path of the .fmu file"]);
    bench.maglev(&["inspect", "none.fmu"]).fails(2, &["none.fmu", "No such file", "help: check"]);
}

#[test]
fn issue_a_missing_fmu_is_named() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["units"]["unit"] = json!("nowhere/motor.fmu");
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["units.unit", "motor.fmu", "No such file", "help: check the path"]);
}

#[test]
fn issue_a_damaged_archive_is_refused() {
    let bench = Bench::new();
    fs::write(bench.path("unit.fmu"), b"PK\x03\x04 this is no archive").unwrap();
    bench.scenario(&ring());
    bench
        .run(&[])
        .fails(2, &["unit.fmu", "not a readable zip archive", "help: the file is damaged"]);
}

#[test]
fn issue_a_truncated_archive_is_refused() {
    let bench = Bench::new();
    let bytes = fs::read(bench.path("unit.fmu")).unwrap();
    fs::write(bench.path("unit.fmu"), &bytes[..bytes.len() / 2]).unwrap();
    bench.scenario(&ring());
    bench.run(&[]).fails(2, &["unit.fmu", "not a readable zip archive"]);
}

#[test]
fn issue_an_entry_that_leaves_the_folder_is_refused() {
    let bench = Bench::new();
    let files: [(&str, &[u8]); 2] =
        [("modelDescription.xml", DESCRIPTION.as_bytes()), ("resources/../../evil", b"x")];
    bench.pack("unit.fmu", &files);
    bench.scenario(&ring());
    bench.run(&[]).fails(2, &["resources/../../evil", "outside of the archive's folder", "help:"]);
}

#[test]
fn issue_an_archive_without_description_is_refused() {
    let bench = Bench::new();
    bench.pack("unit.fmu", &[("readme.txt", b"hello")]);
    bench.scenario(&ring());
    bench.run(&[]).fails(2, &["unit.fmu", "no modelDescription.xml", "help:"]);
}

#[test]
fn issue_a_document_type_declaration_is_refused() {
    let bench = Bench::new();
    let bomb = "<!DOCTYPE x [<!ENTITY a \"b\">]><fmiModelDescription/>";
    bench.pack("unit.fmu", &[("modelDescription.xml", bomb.as_bytes())]);
    bench.scenario(&ring());
    bench.run(&[]).fails(2, &["document type declaration"]);
}

#[test]
fn issue_other_versions_and_broken_descriptions_are_refused_with_the_reason() {
    let bench = Bench::new();
    bench.scenario(&ring());
    for (old, new, text) in [
        ("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"", "is for FMI 3.0"),
        ("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\"", "is for FMI 1.0; only FMI 2.0 is supported"),
        ("<CoSimulation", "<ModelExchange", "model exchange only"),
        ("valueReference=\"0\"", "valueReference=\"x\"", "line 11: valueReference=\"x\""),
        ("name=\"y\"", "name=\"u\"", "duplicate variable \"u\""),
        ("</ModelStructure>", "", "not well-formed"),
        ("modelIdentifier=\"unit\"", "modelIdentifier=\"../../x\"", "not a C identifier"),
    ] {
        let changed = DESCRIPTION.replacen(old, new, 1);
        bench.pack("unit.fmu", &[("modelDescription.xml", changed.as_bytes())]);
        bench.run(&[]).fails(2, &["unit.fmu", text]);
    }
}

#[test]
fn issue_a_guid_that_the_binary_refuses_is_named() {
    let bench = Bench::new();
    bench.unit("unit.fmu", DESCRIPTION, &["-DGUID=\"another\""]);
    bench.scenario(&ring());
    bench.run(&[]).fails(
        2,
        &["unit a refused to be instantiated", "it logged: GUID test-unit does not fit", "help:"],
    );
}

#[test]
fn issue_a_missing_or_foreign_binary_is_named() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let text = DESCRIPTION.as_bytes();
    bench.pack("unit.fmu", &[("modelDescription.xml", text), ("binaries/win64/unit.dll", b"MZ")]);
    bench.run(&[]).fails(2, &["no binary for linux64", "it has binaries for win64", "help:"]);
    let place = "binaries/linux64/unit.so";
    bench.pack("unit.fmu", &[("modelDescription.xml", text), (place, b"no library")]);
    bench.run(&[]).fails(2, &["cannot be loaded", "not a binary of a known format"]);
    let binary = bench.compile(&["-DfmiDoStep=x", "-Dfmi2DoStep=fmi2DoStop"]);
    bench.pack("unit.fmu", &[("modelDescription.xml", text), (place, &binary)]);
    bench.run(&[]).fails(2, &["does not export fmi2DoStep", "X86_64"]);
    bench.pack("unit.fmu", &[("modelDescription.xml", text), ("sources/unit.c", b"int x;")]);
    bench.run(&[]).fails(2, &["contains only source code (sources/)", "help:"]);
    let others = [("binaries/linux64/one.so", &b""[..]), ("binaries/linux64/two.so", &b""[..])];
    bench.pack("unit.fmu", &[("modelDescription.xml", text), others[0], others[1]]);
    let texts =
        ["unit.so is missing", "binaries/linux64 contains one.so, two.so", "modelIdentifier"];
    bench.run(&[]).fails(2, &texts);
    bench.pack("unit.fmu", &[("modelDescription.xml", text)]);
    bench.run(&[]).fails(2, &["contains no binaries"]);
}

#[test]
fn issue_unknown_names_in_connections_get_a_suggestion() {
    let bench = Bench::new();
    let connect = |from: &str, to: &str| {
        let mut scenario = ring();
        scenario["connections"] = json!([{ "from": from, "to": to }]);
        bench.scenario(&scenario);
        bench.run(&[])
    };
    connect("a.Y", "b.u").fails(
        2,
        &[
            "connections[0]",
            "no variable \"Y\" in a (unit integrator)",
            "did you mean \"y\"?",
            "help:",
        ],
    );
    connect("aa.y", "b.u").fails(2, &["no instance \"aa\"", "did you mean \"a\"?"]);
    connect("ay", "b.u").fails(2, &["\"ay\" is not of the form instance.variable"]);
    connect("a.[1..2]", "b.[1..3]").fails(2, &["stands for 2 signals", "for 3"]);
    connect("a.[3..1]", "b.u").fails(2, &["[3..1] runs backwards"]);
}

/// A pattern that matches nothing gets the nearest one that does, instance and variable each on their own.
#[test]
fn issue_patterns_that_match_nothing_get_a_suggestion() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["instances"] =
        json!({ "ems_[01..03]": { "unit": "unit" }, "car": { "unit": "unit" } });
    scenario["connections"] = json!([]);
    scenario["record"] = json!({ "signals": ["*.y"] });
    bench.scenario(&scenario);
    for (pattern, meant) in [
        ("ems_*.gian", "ems_*.gain"),
        ("esm_*.gain", "ems_*.gain"),
        ("esm_*.gian", "ems_*.gain"),
        ("ems_*.fail_tmie*", "ems_*.fail_time*"),
        ("ca*.gians", "ca*.gain"),
    ] {
        let text = format!("\"{pattern}\" matches nothing; did you mean \"{meant}\"?");
        bench.run(&["--set", &format!("{pattern}=1")]).fails(2, &[&text]);
    }
    bench.run(&["--set", "wheel_*.gain=1"]).fails(2, &["\"wheel_*.gain\" matches nothing\n"]);
    scenario["algorithm"] = json!({ "order": ["emms_*"] });
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["algorithm.order", "did you mean \"ems_*\"?"]);
}

#[test]
fn issue_connections_of_wrong_causality_or_type_or_with_two_sources_are_refused() {
    let bench = Bench::new();
    let connect = |pairs: &[(&str, &str)]| {
        let mut scenario = ring();
        scenario["connections"] =
            pairs.iter().map(|(from, to)| json!({ "from": from, "to": to })).collect();
        bench.scenario(&scenario);
        bench.run(&[])
    };
    connect(&[("a.u", "b.u")]).fails(2, &["a.u is an input, not an output", "help:"]);
    connect(&[("a.y", "b.gain")]).fails(2, &["b.gain is a parameter, not an input"]);
    connect(&[("a.t", "b.u")]).fails(2, &["a.t is of type String, b.u of type Real"]);
    connect(&[("a.y", "b.u"), ("a.z", "b.u")])
        .fails(2, &["connections[1]", "b.u is already connected to a.y", "help:"]);
}

#[test]
fn issue_connections_between_different_dimensions_are_refused() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &DESCRIPTION.replacen("unit=\"m\"", "unit=\"s\"", 1), &[]);
    bench.scenario(&ring());
    bench.run(&[]).fails(
        2,
        &[
            "units of measurement of a.y and b.u are incompatible",
            "m is m in base units, s is s",
            "help:",
        ],
    );
}

#[test]
fn issue_an_unconnected_input_without_start_is_named() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &DESCRIPTION.replacen("start=\"0\" unit", "unit", 1), &[]);
    let mut scenario = ring();
    scenario["connections"] = json!([{ "from": "a.y", "to": "b.u" }]);
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["a.u is not connected and has no start value", "help: connect it"]);
    bench.run(&["--set", "a.u=1"]).succeeds();
}

#[test]
fn issue_values_of_wrong_type_range_or_name_are_refused() {
    let bench = Bench::new();
    bench.scenario(&ring());
    for (set, text) in [
        ("a.gain=11", "11 is outside of the range of a.gain: -10 to 10"),
        ("a.gain=much", "\"much\" is not a valid Real for a.gain"),
        ("a.fault=1.5", "1.5 is not a valid Integer for a.fault"),
        ("a.y=1", "a.y cannot be set"),
        ("a.gian=1", "did you mean \"gain\"?"),
        ("x_*.gain=1", "matches nothing"),
    ] {
        bench.run(&["--set", set]).fails(2, &[text, "--set"]);
    }
    bench.run(&["--set", "nonsense"]).fails(2, &["instance.variable=value"]);
    let mut scenario = ring();
    scenario["instances"]["a"]["parameters"] = json!({ "u": 1.0 });
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["instances.a.parameters", "it belongs under \"start\""]);
}

#[test]
fn issue_steps_and_intervals_that_do_not_divide_the_run_are_refused() {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench
        .run(&["--step", "0.3"])
        .fails(2, &["is not a multiple of the step 0.3 s", "help: choose stop"]);
    bench
        .run(&["--record-interval", "0.25"])
        .fails(2, &["record.interval is 0.25 s, which is not a multiple"]);
    bench.run(&["--stop", "-1"]).fails(2, &["do not describe a run"]);
}

#[test]
fn issue_unknown_key_and_type_name_their_path() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["record"]["sginals"] = json!([]);
    bench.scenario(&scenario);
    bench.run(&[]).fails(
        2,
        &[
            "at record",
            "unknown field `sginals`",
            "did you mean `signals`?",
            "help: `maglev schema`",
        ],
    );
    let mut scenario = ring();
    scenario["experiment"]["step"] = json!("fast");
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["at experiment.step", "expected a number"]);
    let mut scenario = ring();
    scenario["algorithm"] = json!({ "name": "magic" });
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["at algorithm.name", "`jacobi`, `gauss-seidel`"]);
}

#[test]
fn issue_results_folder_that_cannot_be_written() {
    let bench = Bench::new();
    bench.scenario(&ring());
    fs::write(bench.path("out"), "a file is in the way").unwrap();
    bench.run(&[]).fails(2, &["cannot write the results to out", "help: choose another folder"]);
}

#[test]
fn issue_bad_usage_ends_with_status_2() {
    let bench = Bench::new();
    bench.maglev(&["fly"]).fails(2, &["unrecognized subcommand"]);
    bench.maglev(&["inspect", "missing.fmu"]).fails(2, &["missing.fmu", "No such file"]);
}

/// Until the fault at 0.5 s everything is kept; the report names unit, call and time.
#[test]
fn issue_faults_while_stepping_end_the_run_and_keep_its_results() {
    for (fault, texts) in [
        (1, &["the run failed at 0.4 s", "unit a: y is NaN at 0.5 s", "help:"][..]),
        (4, &["unit a: fmi2DoStep returned fmi2Error at 0.4 s", "it logged: the model broke"][..]),
        (5, &["fmi2Fatal at 0.4 s"][..]),
        (8, &["unknown status 99 at 0.4 s"][..]),
    ] {
        let bench = Bench::new();
        bench.scenario(&ring());
        let fault = format!("a.fault={fault}");
        let ran = bench.run(&["--set", &fault, "--set", "a.fail_time=0.45"]);
        ran.fails(1, texts);
        assert_eq!(bench.rows().len(), 5, "0.0 to 0.4 s");
        let summary = bench.summary();
        assert_eq!(summary["status"], "failed");
        assert_eq!(summary["steps"], 4);
        assert!(summary["error"]["causes"][1].as_str().unwrap().contains("unit a"));
        assert!(!bench.path("out/results.csv.partial").exists());
    }
}

#[test]
fn issue_a_failure_while_initializing_names_unit_and_call() {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench.run(&["--set", "b.fault=7"]).fails(
        1,
        &["the run could not start", "unit b: fmi2ExitInitializationMode returned fmi2Error"],
    );
}

#[test]
fn issue_warnings_do_not_end_a_run_and_pending_steps_are_polled() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let ran = bench.run(&["--set", "a.fault=2", "--set", "a.fail_time=0.5"]);
    ran.succeeds();
    assert_eq!(ran.stderr().matches("unit a warns: u is odd at 100 #").count(), 1);
    assert_eq!(bench.summary()["messages"][0]["status"], "fmi2Warning");
    bench.run(&["--set", "a.fault=6", "--set", "a.fail_time=0.5"]).succeeds();
    assert_eq!(bench.rows().len(), 11);
}

/// z = gain·u in a ring of two: sweeps that diverge with a gain of 4 are followed by Newton's method,
/// which ends at the only solution, zero; not without enough of them. A weak loop takes sweeps alone.
#[test]
fn issue_initial_loops_are_solved_or_named() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["connections"] =
        json!([{ "from": "a.z", "to": "b.u" }, { "from": "b.z", "to": "a.u" }]);
    scenario["instances"]["a"]["start"] = json!({ "u": 1.0 });
    scenario["instances"]["a"]["parameters"] = json!({ "gain": 2.0 });
    scenario["instances"]["b"]["parameters"] = json!({ "gain": 2.0 });
    scenario["record"]["signals"] = json!(["a.z"]);
    bench.scenario(&scenario);
    let ran = bench.run(&[]);
    ran.succeeds();
    assert!(ran.stderr().contains("algebraic loop, cut by holding its inputs"));
    let solved = &bench.summary()["initial_loops"][0];
    assert!(solved["newton"].as_u64().unwrap() >= 1 && solved["sweeps"].as_u64().unwrap() < 10);
    assert!(bench.summary()["signals"]["a.z"]["max"].as_f64().unwrap().abs() < 1e-9);
    bench.run(&["--set", "a.gain=0.1", "--set", "b.gain=0.1"]).succeeds();
    let solved = &bench.summary()["initial_loops"][0];
    assert!(solved["newton"] == 0 && solved["sweeps"].as_u64().unwrap() > 3);
    scenario["initialization"] = json!({ "iterations": 2 });
    bench.scenario(&scenario);
    bench.run(&[]).fails(
        1,
        &[
            "the loop through a.z, b.z did not converge in 2 sweeps",
            "still changing: a.z by",
            "help:",
        ],
    );
}
