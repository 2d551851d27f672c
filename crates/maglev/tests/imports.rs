//! Units as others make them: imperfect ones run with one warning per defect, unless the run is
//! strict; what a description may say besides is understood.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use serde_json::json;
use support::{Bench, DESCRIPTION, ring};

/// A description with one thing replaced, which must be there.
fn changed(old: &str, new: &str) -> String {
    let text = DESCRIPTION.replacen(old, new, 1);
    assert_ne!(text, DESCRIPTION, "{old}");
    text
}

fn notes(report: &str) -> Vec<&str> {
    report.lines().filter(|line| line.starts_with("note: unit.fmu")).collect()
}

/// Every tolerable defect: the run succeeds with one note, and a strict one is refused.
#[test]
fn issue_defects_are_tolerated_with_one_warning_each_and_refused_when_strict() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let binary = bench.compile(&[]);
    for (old, new, text, error) in [
        (
            "fmiVersion=\"2.0\"",
            "fmiVersion=\"2.0.1\"",
            "fmiVersion \"2.0.1\" should be \"2.0\"",
            "fmiVersion is \"2.0.1\"",
        ),
        (
            "modelName=\"integrator\" ",
            "",
            "modelName is missing",
            "does not have the required attribute \"modelName\"",
        ),
        (
            "canInterpolateInputs=\"true\"",
            "canInterpolateInputs=\"True\"",
            "is not true or false",
            "not a Boolean",
        ),
        (
            "canInterpolateInputs=\"true\"",
            "canInterpolateInputs=\"oui\"",
            "it is ignored",
            "not a Boolean",
        ),
        (
            "maxOutputDerivativeOrder=\"1\"",
            "maxOutputDerivativeOrder=\"-1\"",
            "it is ignored",
            "=\"-1\"",
        ),
        (
            "name=\"fault\"",
            "colour=\"red\" name=\"fault\"",
            "unknown attribute \"colour\"",
            "attribute \"colour\"",
        ),
        (
            "min=\"-10\"",
            "min=\"low\"",
            "min=\"low\" of <Real> is not a number; it is ignored",
            "min=\"low\"",
        ),
        ("initial=\"calculated\"", "initial=\"guess\"", "initial=\"guess\"", "not one of exact"),
        (
            "variability=\"tunable\"",
            "variability=\"parameter\"",
            "variability=\"parameter\"",
            "one of constant",
        ),
        (
            "<Integer/>",
            "<Integer declaredType=\"None\"/>",
            "\"None\", which is not defined",
            "the type \"None\" of \"m\" is not defined",
        ),
        (
            "<ModelV",
            "<DefaultExperiment stepSize=\"fast\"/><ModelV",
            "stepSize=\"fast\"",
            "not a number",
        ),
        (
            "index=\"3\" dependencies=\"1\"",
            "index=\"3\" dependencies=\"u\"",
            "list of indices",
            "not a list of indices",
        ),
        (
            "index=\"3\" dependencies=\"1\"",
            "index=\"3\" dependencies=\"99\"",
            "variable 99",
            "no variable 99",
        ),
        (
            "<Unknown index=\"2\" dependencies=\"\"/>",
            "",
            "Outputs lacks \"y\"",
            "Outputs does not list 1 variable: \"y\"",
        ),
        (
            "<InitialUnknowns>\n      <Unknown index=\"2\" dependencies=\"\"/>",
            "<InitialUnknowns>",
            "InitialUnknowns lacks \"y\"",
            "InitialUnknowns does not list 1 variable: \"y\"",
        ),
        (
            "<Unknown index=\"3\" dependencies=\"1 5\"/>\n      <Unknown index=\"8\" dependencies=\"7\"/>",
            "<Unknown index=\"8\" dependencies=\"7\"/><Unknown index=\"3\" dependencies=\"1 5\"/>",
            "InitialUnknowns is not sorted",
            "InitialUnknowns lists variable 8 before 3",
        ),
    ] {
        let text_of_unit = changed(old, new);
        let place = "binaries/linux64/unit.so";
        let files = [("modelDescription.xml", text_of_unit.as_bytes()), (place, &binary)];
        bench.pack("unit.fmu", &files);
        let ran = bench.run(&[]);
        ran.succeeds();
        let report = ran.stderr();
        let notes = notes(&report);
        assert!(notes.len() == 1 && notes[0].contains(text), "{text}:\n{report}");
        bench.run(&["--strict"]).fails(2, &["units.unit", "does not allow", error, "help:"]);
    }
}

#[test]
fn issue_equal_defects_are_told_once_with_their_number() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &DESCRIPTION.replace("initial=\"calculated\"", "initial=\"no\""), &[]);
    bench.scenario(&ring());
    let report = bench.run(&[]).stderr();
    let notes = notes(&report);
    assert!(notes.len() == 1 && notes[0].ends_with("(and 1 more like it)"), "{report}");
}

#[test]
fn issue_strict_is_a_key_and_an_option_of_inspect() {
    let bench = Bench::new();
    let mut scenario = ring();
    scenario["strict"] = json!(true);
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    bench.maglev(&["inspect", "--strict", "unit.fmu"]).succeeds();
    bench.unit(
        "unit.fmu",
        &changed("canInterpolateInputs=\"true\"", "canInterpolateInputs=\"yes\""),
        &[],
    );
    bench.run(&[]).fails(2, &["which a strict run does not allow"]);
    bench.maglev(&["inspect", "unit.fmu"]).succeeds();
    bench.maglev(&["inspect", "--strict", "unit.fmu"]).fails(2, &["does not allow"]);
}

/// An Enumeration takes its items by name or number, and nothing else.
#[test]
fn issue_enumerations_are_set_by_name() {
    let bench = Bench::new();
    let types = "<TypeDefinitions><SimpleType name=\"Gear\"><Enumeration>\
                 <Item name=\"neutral\" value=\"0\"/><Item name=\"third\" value=\"3\"/>\
                 </Enumeration></SimpleType></TypeDefinitions>";
    let text = changed(
        "variability=\"discrete\">\n      <Integer start=\"0\"/>",
        "variability=\"discrete\"><Enumeration declaredType=\"Gear\" start=\"0\"/>",
    )
    .replace("<ModelV", &format!("{types}<ModelV"));
    bench.unit("unit.fmu", &text, &[]);
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "n": "third" });
    scenario["instances"]["b"]["start"] = json!({ "n": 3 });
    scenario["record"]["signals"] = json!(["*.m"]);
    bench.scenario(&scenario);
    bench.run(&["--strict"]).succeeds();
    assert_eq!(bench.rows().last().unwrap()[1..], [3.0, 3.0]);
    bench.run(&["--set", "a.n=neutral"]).succeeds();
    assert_eq!(bench.rows().last().unwrap()[1..], [0.0, 3.0]);
    for wrong in ["a.n=fourth", "a.n=4", "a.n=true"] {
        bench
            .run(&["--set", wrong])
            .fails(2, &["is not an item of a.n", "\"neutral\" (0), \"third\" (3)"]);
    }
}

/// A declared type lends unit, min, max and nominal; the variable's own attributes win.
#[test]
fn issue_declared_types_lend_their_attributes() {
    let bench = Bench::new();
    let types = "<TypeDefinitions><SimpleType name=\"Gain\">\
                 <Real unit=\"mm\" min=\"-5\" max=\"5\" nominal=\"2\"/></SimpleType></TypeDefinitions>";
    let text = changed(
        "<Real start=\"1\" min=\"-10\" max=\"10\"/>",
        "<Real declaredType=\"Gain\" start=\"1\" max=\"7\"/>",
    )
    .replace("<ModelV", &format!("{types}<ModelV"));
    bench.unit("unit.fmu", &text, &[]);
    let json = bench.maglev(&["inspect", "--json", "unit.fmu"]).stdout();
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    let gain = &value["variables"][4];
    assert_eq!(gain["name"], "gain");
    assert_eq!((&gain["unit"], &gain["nominal"]), (&json!("mm"), &json!(2.0)));
    assert_eq!((&gain["min"], &gain["max"]), (&json!(-5.0), &json!(7.0)));
    bench.scenario(&ring());
    bench.run(&["--set", "a.gain=-6"]).fails(2, &["-6 is outside of the range of a.gain: -5 to 7"]);
}

/// Factor and offset: 20 degC arrive as 293.15 K; a difference of temperatures has no offset.
#[test]
fn analytic_offsets_are_converted_except_for_differences() {
    let bench = Bench::new();
    let units = "<Unit name=\"K\"><BaseUnit K=\"1\"/></Unit>\
                 <Unit name=\"degC\"><BaseUnit K=\"1\" offset=\"273.15\"/></Unit>";
    let celsius = DESCRIPTION
        .replacen("unit=\"m\"", "unit=\"K\"", 1)
        .replacen("<Real unit=\"m\"/>", "<Real unit=\"degC\"/>", 2)
        .replace("<Unit name=\"s\">", &format!("{units}<Unit name=\"s\">"));
    let scenario = json!({
        "units": { "unit": "unit.fmu" },
        "instances": {
            "a": { "unit": "unit", "start": { "u": 20.0 } },
            "b": { "unit": "unit" }
        },
        "connections": [ { "from": "a.z", "to": "b.u" } ],
        "experiment": { "stop": 0.1, "step": 0.1 },
        "record": { "signals": ["a.z", "b.u", "b.y"] }
    });
    bench.scenario(&scenario);
    bench.unit("unit.fmu", &celsius, &[]);
    bench.run(&["--strict"]).succeeds();
    // results are in base units: both 293.15 K, of which u is 293.15 exactly and z is 20 + 273.15
    let row = &bench.rows()[1];
    assert_eq!(row[1..3], [293.15, 293.15]);
    let relative =
        celsius.replace("<Real unit=\"degC\"/>", "<Real unit=\"degC\" relativeQuantity=\"true\"/>");
    bench.unit("unit.fmu", &relative, &[]);
    bench.run(&["--strict"]).succeeds();
    assert_eq!(bench.rows()[1][1..3], [20.0, 20.0]);
}

/// Units of measurement without a definition do not connect, unless the scenario says so.
#[test]
fn issue_undefined_units_connect_on_demand() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &changed("unit=\"m\"", "unit=\"meter\""), &[]);
    let mut scenario = ring();
    bench.scenario(&scenario);
    bench.run(&[]).fails(2, &["m and meter have different names", "help:", "ignore_units"]);
    for connection in scenario["connections"].as_array_mut().unwrap() {
        connection["ignore_units"] = json!(true);
    }
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
}

/// A unit of measurement without a name is none, unless it is defined; then it is one as any.
#[test]
fn issue_an_empty_unit_attribute_means_no_unit_of_measure() {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench.unit("unit.fmu", &changed("unit=\"m\"", "unit=\"\""), &[]);
    let ran = bench.run(&[]);
    ran.succeeds();
    let report = ran.stderr();
    let notes = notes(&report);
    assert!(
        notes.len() == 1 && notes[0].contains("\"u\" has the unit \"\", which is not def"),
        "{report}"
    );
    bench.run(&["--strict"]).fails(2, &["does not allow", "is not defined"]);
    for name in ["", "-", "1"] {
        // 1 of it is 2 m
        let unit = format!("<Unit name=\"{name}\"><BaseUnit m=\"1\" factor=\"2\"/></Unit>");
        let description = changed("unit=\"m\"", &format!("unit=\"{name}\""))
            .replace("<Unit name=\"s\">", &format!("{unit}<Unit name=\"s\">"));
        bench.unit("unit.fmu", &description, &[]);
        let mut scenario = ring();
        scenario["instances"]["a"]["start"] = json!({ "u": 3.0 });
        scenario["connections"] = json!([ { "from": "a.z", "to": "b.u" } ]);
        scenario["record"]["signals"] = json!(["a.u", "a.z", "b.u", "b.z"]);
        bench.scenario(&scenario);
        bench.run(&["--strict"]).succeeds();
        // z is in m: 3 m are 1.5 units for b; u is recorded in m
        assert_eq!(bench.rows()[1][1..], [6.0, 3.0, 3.0, 1.5], "{name:?}");
        // nothing else than a length fits
        let other = description.replace("BaseUnit m=\"1\" factor=\"2\"", "BaseUnit s=\"1\"");
        bench.unit("unit.fmu", &other, &[]);
        bench.run(&[]).fails(2, &["units of measurement", "connect quantities of the same kind"]);
    }
}

/// The only binary is loaded under any name, with a warning, also in copies.
#[test]
fn issue_the_only_binary_is_loaded_whatever_its_name() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let binary = bench.compile(&[]);
    let once = changed("canInter", "canBeInstantiatedOnlyOncePerProcess=\"true\" canInter");
    for description in [DESCRIPTION, &once] {
        let text = description.as_bytes();
        let place = "binaries/linux64/odd-name.so";
        // neither another ending nor a folder below counts
        let others = [("binaries/linux64/readme.txt", &b""[..]), ("binaries/linux64/x/y.so", b"")];
        let files = [("modelDescription.xml", text), others[0], (place, &binary), others[1]];
        bench.pack("unit.fmu", &files);
        for arguments in [&[][..], &["--isolate"]] {
            let ran = bench.run(arguments);
            ran.succeeds();
            let report = ran.stderr();
            let notes = notes(&report);
            let text = "odd-name.so should be named unit.so";
            assert!(notes.len() == 1 && notes[0].contains(text), "{report}");
        }
        bench.run(&["--strict"]).fails(2, &["does not allow", "has no \"unit.so\"", "odd-name.so"]);
        assert!(bench.maglev(&["inspect", "unit.fmu"]).stdout().contains("linux64"));
    }
}

/// The folder that fmuResourceLocation names is there, also where the archive has an empty one or
/// none; folders in it are made.
#[test]
fn issue_the_resources_are_there_though_they_are_empty() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let binary = bench.compile(&["-DNEEDS_RESOURCES=\"\""]);
    let place = "binaries/linux64/unit.so";
    let files = [("modelDescription.xml", DESCRIPTION.as_bytes()), (place, &binary[..])];
    bench.pack("unit.fmu", &files);
    bench.run(&[]).succeeds();
    bench.run(&["--isolate"]).succeeds();
    let binary = bench.compile(&["-DNEEDS_RESOURCES=\"/cache/deep\""]);
    let files = [("modelDescription.xml", DESCRIPTION.as_bytes()), (place, &binary[..])];
    bench.pack("unit.fmu", &files);
    bench.run(&[]).fails(2, &["it logged: no folder", "/cache/deep"]);
    let folders = ["resources/", "resources/cache/deep/"].map(|name| (name, &b""[..]));
    bench.pack("unit.fmu", &[files[0], files[1], folders[0], folders[1]]);
    bench.run(&[]).succeeds();
}

/// A unit that needs a tool names it and is tried: the tool may be there.
#[test]
fn issue_units_that_need_a_tool_name_it() {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench.unit("unit.fmu", &changed("canInter", "needsExecutionTool=\"true\" canInter"), &[]);
    let ran = bench.run(&[]);
    ran.succeeds();
    let report = ran.stderr();
    assert!(
        notes(&report)[0].contains("another program that must be installed (hand)"),
        "{report}"
    );
}

/// A unit of fixed step is noted only where its step does not fit. The standard does not forbid that
/// step, so that a strict run does not refuse it.
#[test]
fn issue_a_step_that_does_not_suit_a_unit_of_fixed_step_is_noted() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let fixed = changed(" canHandleVariableCommunicationStepSize=\"true\"", "")
        .replace("<ModelV", "<DefaultExperiment stepSize=\"0.05\"/><ModelV");
    bench.unit("unit.fmu", &fixed, &[]);
    let ran = bench.run(&["--strict"]);
    ran.succeeds();
    assert!(notes(&ran.stderr()).is_empty());
    let ran = bench.run(&["--step", "0.02"]);
    ran.succeeds();
    let report = ran.stderr();
    assert!(notes(&report)[0].contains("declares 0.05 s: a step of 0.02 s"), "{report}");
    bench.run(&["--step", "0.02", "--strict"]).succeeds();
}

/// Warnings of `maglev validate` are no reason to refuse: the standard allows what they are about.
#[test]
fn issue_strict_refuses_errors_only() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let noted = changed("guid=", "generationDateAndTime=\"2026-01-31T12:00:00\" guid=")
        .replace("<BaseUnit s=\"1\"/>", "")
        .replace("<ModelV", "<DefaultExperiment stopTime=\"1\" stepSize=\"2\"/><ModelV");
    bench.unit("unit.fmu", &noted, &[]);
    let ran = bench.maglev(&["validate", "unit.fmu"]);
    ran.succeeds();
    assert!(ran.stdout().contains("0 errors, 1 warnings, 3 notes"), "{}", ran.stdout());
    bench.run(&["--strict"]).succeeds();
    bench.maglev(&["inspect", "--strict", "unit.fmu"]).succeeds();
}

/// The units of this project have nothing to tolerate.
#[test]
fn golden_own_descriptions_have_no_defects() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../modelDescription");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let description = fmi2_import::description::ModelDescription::parse(&text).unwrap();
        assert!(description.findings.is_empty(), "{}: {:?}", path.display(), description.findings);
    }
}
