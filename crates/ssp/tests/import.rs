//! Archives of all kinds become scenarios.
#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use serde_json::json;
use support::{Bench, ssd};

const TIMES: &str = r#"<ssd:DefaultExperiment startTime="0" stopTime="1"/>"#;

fn component(name: &str, inside: &str) -> String {
    format!(
        r#"<ssd:Component name="{name}" source="resources/u.fmu"><ssd:Connectors>
<ssd:Connector name="u" kind="input"/><ssd:Connector name="y" kind="output"/></ssd:Connectors>{inside}</ssd:Component>"#
    )
}

fn set(parameters: &str) -> String {
    let namespaces = r#"xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon""#;
    format!(
        r#"<ssv:ParameterSet {namespaces} version="1.0" name="p"><ssv:Parameters>{parameters}</ssv:Parameters>
<ssv:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssv:Units></ssv:ParameterSet>"#
    )
}

fn real(name: &str, value: &str) -> String {
    format!(r#"<ssv:Parameter name="{name}"><ssv:Real value="{value}"/></ssv:Parameter>"#)
}

fn inline(set: &str, attributes: &str, mapping: &str) -> String {
    format!(
        "<ssd:ParameterBinding {attributes}><ssd:ParameterValues>{set}</ssd:ParameterValues>{mapping}</ssd:ParameterBinding>"
    )
}

/// Connections through a nested system: conversion first, then the transformation, hop by hop.
#[test]
fn analytic_chains_of_connections_are_composed() {
    let bench = Bench::new();
    let inner = format!(
        r#"<ssd:System name="in"><ssd:Connectors>
<ssd:Connector name="x" kind="input"><ssc:Real unit="m"/></ssd:Connector>
<ssd:Connector name="z" kind="output"/></ssd:Connectors><ssd:Elements>{}</ssd:Elements><ssd:Connections>
<ssd:Connection startConnector="x" endElement="b" endConnector="u"><ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection>
<ssd:Connection startElement="b" startConnector="y" endConnector="z"/></ssd:Connections></ssd:System>"#,
        component("b", "")
    );
    let system = format!(
        r#"<ssd:Connectors><ssd:Connector name="out" kind="output"/></ssd:Connectors>
<ssd:Elements>{}{inner}{}</ssd:Elements><ssd:Connections>
<ssd:Connection startElement="a" startConnector="y" endElement="in" endConnector="x"><ssc:LinearTransformation factor="3" offset="5"/></ssd:Connection>
<ssd:Connection startElement="c" startConnector="u" endElement="in" endConnector="z"/>
<ssd:Connection startElement="c" startConnector="y" endElement="a" endConnector="u" suppressUnitConversion="true"/>
<ssd:Connection startElement="c" startConnector="y" endConnector="out"/></ssd:Connections>"#,
        component("a", ""),
        component("c", "")
    );
    let units = r#"<ssd:Units><ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit></ssd:Units>"#;
    let archive = bench.archive(&ssd(&system, &format!("{units}{TIMES}")), &[]);
    let (scenario, notes) = bench.import(&archive).unwrap();
    // y of a in mm: x = 3 (y/1000) + 5 m, u of b = 2 x + 1
    let expected = json!([
        { "from": "c.y", "to": "a.u", "ignore_units": true },
        // written from the target to the source; plain, so the master converts
        { "from": "in/b.y", "to": "c.u" },
        { "from": "a.y", "to": "in/b.u", "factor": 0.006, "offset": 11.0, "ignore_units": true },
    ]);
    let mut found = scenario["connections"].as_array().unwrap().clone();
    found.sort_by_key(|it| it["to"].to_string());
    let mut expected = expected.as_array().unwrap().clone();
    expected.sort_by_key(|it| it["to"].to_string());
    assert_eq!(found, expected);
    assert_eq!(scenario["record"], json!({ "signals": ["c.y"] }));
    assert_eq!(scenario["units"], json!({ "u": "resources/u.fmu" }), "one archive, one unit");
    assert!(notes.iter().any(|it| it.contains("output out") && it.contains("c.y")), "{notes:?}");
}

/// Outer values replace inner ones, later ones earlier ones; prefix, mapping, units, files in all places.
#[test]
fn analytic_bindings_at_every_level() {
    let bench = Bench::new();
    let description = support::plain();
    bench.write_unit("u.fmu", &description, &[("resources/own.ssv", &set(&real("gain", "7")))]);
    let bindings =
        |all: &[String]| format!("<ssd:ParameterBindings>{}</ssd:ParameterBindings>", all.concat());
    let of_a = bindings(&[
        r#"<ssd:ParameterBinding source="resources/own.ssv" sourceBase="component"/>"#.to_owned(),
        inline(
            &set(concat!(
                r#"<ssv:Parameter name="count"><ssv:Integer value="3"/></ssv:Parameter>"#,
                r#"<ssv:Parameter name="on"><ssv:Boolean value="1"/></ssv:Parameter>"#,
                r#"<ssv:Parameter name="file"><ssv:String value="a b"/></ssv:Parameter>"#,
                r#"<ssv:Parameter name="mode"><ssv:Enumeration value="on"/></ssv:Parameter>"#,
                r#"<ssv:Parameter name="none"><ssv:Real value="1"/></ssv:Parameter>"#,
            )),
            "",
            "",
        ),
    ]);
    let of_b = bindings(&[
        inline(&set(&real("gain", "2")), "", ""),
        inline(&set(&real("gain", "3")), "", ""),
    ]);
    let mapping = r#"<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">
<ssm:MappingEntry source="s.K" target="in.gain_of_b"><ssc:LinearTransformation factor="10" offset="1"/></ssm:MappingEntry>
<ssm:MappingEntry source="s.K" target="c.u"/></ssm:ParameterMapping></ssd:ParameterMapping>"#;
    let millimetres =
        r#"<ssv:Parameter name="K"><ssv:Real value="2000" unit="mm"/></ssv:Parameter>"#;
    let of_root = bindings(&[
        r#"<ssd:ParameterBinding source="values/c.ssv" prefix="c."/>"#.to_owned(),
        inline(&set(&format!("{millimetres}{}", real("unmapped", "1"))), "prefix=\"s.\"", mapping),
    ]);
    let inner = format!(
        r#"<ssd:System name="in"><ssd:Connectors><ssd:Connector name="gain_of_b" kind="parameter"/></ssd:Connectors>
<ssd:Elements>{}</ssd:Elements><ssd:Connections>
<ssd:Connection startConnector="gain_of_b" endElement="b" endConnector="gain"/></ssd:Connections></ssd:System>"#,
        component("b", &of_b)
    );
    let elements = format!(
        "<ssd:Elements>{}{inner}{}</ssd:Elements>",
        component("a", &of_a),
        component("c", "")
    );
    let c = set(&real("gain", "0.1"));
    let text = ssd(&format!("{of_root}{elements}"), TIMES);
    let (scenario, notes) = bench.import(&bench.archive(&text, &[("values/c.ssv", &c)])).unwrap();
    let instances = &scenario["instances"];
    let expected = json!({ "gain": 7.0, "count": 3, "on": true, "file": "a b", "mode": "on" });
    assert_eq!(instances["a"]["parameters"], expected);
    // nothing says that the connector has another unit than the parameter behind it: 2000 mm is 10 · 2000 + 1 mm
    assert_eq!(instances["in/b"]["parameters"], json!({ "gain": 20.001 }));
    assert_eq!(
        instances["c"],
        json!({ "unit": "u", "parameters": { "gain": 0.1 }, "start": { "u": 2.0 } })
    );
    assert!(
        notes.iter().any(|it| it.contains("Component \"a\"") && it.contains("none")),
        "{notes:?}"
    );
}

/// All references to a dictionary share its signals, also from inner systems.
#[test]
fn analytic_signal_dictionaries_join_elements() {
    let bench = Bench::new();
    let reference = |name: &str| {
        format!(
            r#"<ssd:SignalDictionaryReference name="{name}" dictionary="bus"><ssd:Connectors>
<ssd:Connector name="s" kind="inout"/></ssd:Connectors></ssd:SignalDictionaryReference>"#
        )
    };
    let inner = format!(
        r#"<ssd:System name="in"><ssd:Elements>{}{}</ssd:Elements><ssd:Connections>
<ssd:Connection startElement="d" startConnector="s" endElement="b" endConnector="u"/></ssd:Connections></ssd:System>"#,
        component("b", ""),
        reference("d")
    );
    let system = format!(
        r#"<ssd:Elements>{}{}{inner}</ssd:Elements><ssd:Connections>
<ssd:Connection startElement="a" startConnector="y" endElement="d" endConnector="s"/></ssd:Connections>
<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="bus.ssb"/></ssd:SignalDictionaries>"#,
        component("a", ""),
        reference("d")
    );
    let bus = r#"<ssb:SignalDictionary version="1.0" xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"><ssb:DictionaryEntry name="s"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary>"#;
    let archive = bench.archive(&ssd(&system, TIMES), &[("bus.ssb", bus)]);
    let (scenario, _) = bench.import(&archive).unwrap();
    assert_eq!(scenario["connections"], json!([{ "from": "a.y", "to": "in/b.u" }]));
    let gone = bench.archive(&ssd(&system, TIMES), &[]);
    assert!(bench.import(&gone).unwrap_err().contains("there is no file \"bus.ssb\""));
}

/// Steps in the annotations of other tools are used; other annotations are named.
#[test]
fn issue_21_steps_of_other_tools_are_used() {
    let bench = Bench::new();
    let elements = format!("<ssd:Elements>{}</ssd:Elements>", component("a", ""));
    let annotation = |kind: &str, text: &str| {
        format!(
            r#"<ssd:Annotations><ssc:Annotation type="{kind}">{text}</ssc:Annotation></ssd:Annotations>"#
        )
    };
    let step = r#"<o:A xmlns:o="o"><o:FixedStepAlgorithm baseStepSize="1e-4"/></o:A>"#;
    let experiment = format!(
        "<ssd:DefaultExperiment startTime=\"1\">{}</ssd:DefaultExperiment>",
        annotation("com.opensimulationplatform", step)
    );
    let other = annotation("com.example", "x");
    let archive = bench.archive(&ssd(&format!("{elements}{other}"), &experiment), &[]);
    let (scenario, notes) = bench.import(&archive).unwrap();
    assert_eq!(scenario["experiment"], json!({ "start": 1.0, "step": 1e-4 }));
    for part in ["com.opensimulationplatform", "com.example"] {
        assert!(notes.iter().any(|it| it.contains(part)), "{part}: {notes:?}");
    }
}

/// A unit of measurement that no file defines converts nothing, and a note says so.
#[test]
fn issue_21_undefined_units_are_noted() {
    let bench = Bench::new();
    let values =
        set(r#"<ssv:Parameter name="gain"><ssv:Real value="4" unit="[m]"/></ssv:Parameter>"#);
    let binding =
        format!("<ssd:ParameterBindings>{}</ssd:ParameterBindings>", inline(&values, "", ""));
    let a = component("a", &binding)
        .replace("kind=\"input\"/>", "kind=\"input\"><ssc:Real unit=\"\"/></ssd:Connector>");
    let archive = bench.archive(&ssd(&format!("<ssd:Elements>{a}</ssd:Elements>"), TIMES), &[]);
    let (scenario, notes) = bench.import(&archive).unwrap();
    assert_eq!(scenario["instances"]["a"]["parameters"], json!({ "gain": 4.0 }));
    assert!(notes.iter().any(|it| it.contains("values in [m] are not converted")), "{notes:?}");
}

/// Some tools do not declare the prefixes in files of parameters.
#[test]
fn issue_21_undeclared_prefixes_have_their_usual_meaning() {
    let bench = Bench::new();
    let values = r#"<?xml version="1.0"?><ssv:ParameterSet version="1.0" name="x"><ssv:Parameters>
<ssv:Parameter name="gain"><ssv:Real value="4"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>"#;
    let binding =
        r#"<ssd:ParameterBindings><ssd:ParameterBinding source="v.ssv"/></ssd:ParameterBindings>"#;
    let elements = format!("<ssd:Elements>{}</ssd:Elements>", component("a", binding));
    let archive = bench.archive(&ssd(&elements, TIMES), &[("v.ssv", values)]);
    let (scenario, _) = bench.import(&archive).unwrap();
    assert_eq!(scenario["instances"]["a"]["parameters"], json!({ "gain": 4.0 }));
    // an unpacked system: its units stay where they are
    bench.write("unpacked/v.ssv", values);
    let text = ssd(&elements, TIMES).replace("resources/u.fmu", "../u.fmu");
    let (scenario, _) = bench.import(&bench.write("unpacked/s.ssd", &text)).unwrap();
    let unit = scenario["units"]["u"].as_str().unwrap().to_owned();
    assert!(std::path::Path::new(&unit).is_absolute() && unit.ends_with("u.fmu"), "{unit}");
}

/// Each change of a sound description gives an error that names the element.
#[test]
fn refusal_errors_name_the_element() {
    let bench = Bench::new();
    let sound = format!(
        r#"<ssd:Elements>{}{}</ssd:Elements><ssd:Connections>
<ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u"/></ssd:Connections>"#,
        component("a", ""),
        component("b", "")
    );
    let sound = ssd(&sound, TIMES);
    bench.import(&bench.archive(&sound, &[])).unwrap();
    let source = "source=\"resources/u.fmu\"";
    for (from, to, parts) in [
        (
            "version=\"1.0\" name",
            "version=\"3.0\" name",
            ["SystemStructureDescription", "version \"3.0\""],
        ),
        (
            "<ssd:Connection ",
            "<ssd:Conection ",
            ["line ", "no element Conection; did you mean Connection?"],
        ),
        (
            "startConnector=",
            "factr=\"2\" startConnector=",
            ["line ", "no attribute factr; did you mean factor?"],
        ),
        (source, "source=\"../u.fmu\"", ["Component \"a\"", "leaves the archive"]),
        (
            source,
            "source=\"resources/%2e%2e/../../u.fmu\"",
            ["Component \"a\"", "leaves the archive"],
        ),
        (source, "source=\"/etc/u.fmu\"", ["Component \"a\"", "not a relative URI"]),
        (source, "source=\"file:///etc/u.fmu\"", ["Component \"a\"", "only relative URIs"]),
        (source, "source=\"#other\"", ["Component \"a\"", "no System has the id \"other\""]),
        (source, "source=\"resources/v.fmu\"", ["Component \"a\"", "no file \"resources/v.fmu\""]),
        (
            source,
            "source=\"resources/in.ssp\"",
            ["Component \"a\"", "no file \"resources/in.ssp\""],
        ),
        (
            source,
            "implementation=\"ModelExchange\" source=\"resources/u.fmu\"",
            ["Component \"a\"", "ModelExchange"],
        ),
        (
            source,
            "type=\"application/x-ssp-package\" source=\"resources/u.fmu\"",
            ["Component \"a\"", "no file \"resources/u.fmu/SystemStructure.ssd\""],
        ),
        (source, "type=\"text/x\" source=\"resources/u.fmu\"", ["Component \"a\"", "text/x"]),
        (source, "source=\"v3.fmu\"", ["component \"a\"", "3.0"]),
        ("name=\"b\"", "name=\"a\"", ["System \"root\"", "two elements have the name \"a\""]),
        ("startElement=\"a\"", "startElement=\"c\"", ["from c.y to b.u", "no element \"c\""]),
        ("startConnector=\"y\"", "startConnector=\"z\"", ["from a.z to b.u", "no variable \"z\""]),
        (
            "startConnector=\"y\"",
            "startConnector=\"u\"",
            ["from a.u to b.u", "both ends are targets"],
        ),
        ("endConnector=\"u\"", "endConnector=\"gain\"", ["b.gain", "parameter"]),
        (
            "endConnector=\"u\"/>",
            "endConnector=\"u\"/><ssd:Connection startElement=\"b\" startConnector=\"y\" endElement=\"b\" endConnector=\"u\"/>",
            ["from b.y to b.u", "already has a source: Connection from a.y"],
        ),
        (
            "endConnector=\"u\"/>",
            "endConnector=\"u\"><ssc:BooleanMappingTransformation><ssc:MapEntry source=\"true\" target=\"false\"/></ssc:BooleanMappingTransformation></ssd:Connection>",
            ["from a.y to b.u", "for Booleans, but a.y is of type Real"],
        ),
        (
            "endConnector=\"u\"/>",
            "endConnector=\"u\"><ssc:LinearTransformation factor=\"x\"/></ssd:Connection>",
            ["from a.y to b.u", "factor=\"x\" is not a number"],
        ),
        (
            "kind=\"output\"/>",
            "kind=\"output\"><ssc:Binary/></ssd:Connector>",
            ["from a.y to b.u: connector \"y\"", "Binary"],
        ),
        (
            "kind=\"output\"/>",
            "kind=\"output\"><ssc:Real/><ssc:Dimension size=\"2\"/></ssd:Connector>",
            ["from a.y to b.u: connector \"y\"", "arrays"],
        ),
        (
            "</ssd:System>",
            "<ssd:Elements><ssd:SignalDictionaryReference name=\"d\" dictionary=\"x\"/></ssd:Elements></ssd:System>",
            ["SignalDictionaryReference \"d\"", "no signal dictionary \"x\""],
        ),
        (
            "</ssd:SystemStructureDescription>",
            "<ssd:Annotations><ssc:Annotation type=\"org.maglev-cosimulation.scenario\"><s:Settings xmlns:s=\"urn:maglev-cosimulation:ssp\">{\"trace\": \"/etc/x\"}</s:Settings></ssc:Annotation></ssd:Annotations></ssd:SystemStructureDescription>",
            ["annotation", "\"trace\" is not allowed"],
        ),
        (
            "</ssd:SystemStructureDescription>",
            "<ssd:Annotations><ssc:Annotation type=\"org.maglev-cosimulation.scenario\"><s:Settings xmlns:s=\"urn:maglev-cosimulation:ssp\">{\"inputs\": [{\"signal\": {\"file\": \"../x.csv\"}}]}</s:Settings></ssc:Annotation></ssd:Annotations></ssd:SystemStructureDescription>",
            ["annotation", "leaves the archive"],
        ),
        (
            "<ssd:System name=\"root\">",
            "<ssd:System name=\"root\"",
            ["SystemStructure.ssd", "not valid XML"],
        ),
        (
            "<ssd:System name=\"root\">",
            "<ssd:System name=\"root\"><ssd:ParameterBindings><ssd:ParameterBinding source=\"no.ssv\"/></ssd:ParameterBindings>",
            ["ParameterBinding 1 of System \"root\"", "no file \"no.ssv\""],
        ),
    ] {
        assert!(sound.contains(from), "{from}");
        let changed = sound.replacen(from, to, 1);
        bench.write_unit(
            "v3.fmu",
            &support::plain().replace("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\""),
            &[],
        );
        let newer = std::fs::read(bench.path("v3.fmu")).unwrap();
        let old = std::fs::read(bench.path("u.fmu")).unwrap();
        let archive = bench.path("changed.ssp");
        support::pack(
            &archive,
            &[
                ("SystemStructure.ssd", changed.as_bytes()),
                ("resources/u.fmu", &old),
                ("v3.fmu", &newer),
            ],
        );
        let error = bench.import(&archive).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "{to}\n{error}");
        }
    }
    // values that do not fit, and transformations of bindings
    for (value, part) in [
        (
            r#"name="count"><ssv:Real value="1.5"/>"#,
            "1.5 is not valid for count, which is of type Integer",
        ),
        (r#"name="gain"><ssv:Real value="1 2"/>"#, "arrays"),
        (r#"name="gain"><ssv:Real value="one"/>"#, "\"one\" is not a valid Real"),
        (r#"name="gain"><ssv:Binary value="00"/>"#, "Binary"),
        (
            r#"name="on"><ssv:String value="true"/>"#,
            "true is not valid for on, which is of type Boolean",
        ),
    ] {
        let values = set(&format!("<ssv:Parameter {value}</ssv:Parameter>"));
        let binding =
            format!("<ssd:ParameterBindings>{}</ssd:ParameterBindings>", inline(&values, "", ""));
        let elements = format!("<ssd:Elements>{}</ssd:Elements>", component("a", &binding));
        let error = bench.import(&bench.archive(&ssd(&elements, TIMES), &[])).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
    // a loop of connectors that no component interrupts, with and without a value in it
    let through = |binding: &str| {
        let inner = r#"<ssd:System name="in"><ssd:Connectors><ssd:Connector name="x" kind="input"/>
<ssd:Connector name="z" kind="output"/></ssd:Connectors><ssd:Connections>
<ssd:Connection startConnector="x" endConnector="z"/></ssd:Connections></ssd:System>"#;
        let back = r#"<ssd:Connection startElement="in" startConnector="z" endElement="in" endConnector="x"/>
<ssd:Connection startElement="in" startConnector="z" endElement="a" endConnector="u"/>"#;
        let a = component("a", "");
        let system = format!(
            "{binding}<ssd:Elements>{a}{inner}</ssd:Elements><ssd:Connections>{back}</ssd:Connections>"
        );
        bench.archive(&ssd(&system, TIMES), &[])
    };
    let binding = inline(&set(&real("in.x", "1")), "", "");
    for binding in ["", &format!("<ssd:ParameterBindings>{binding}</ssd:ParameterBindings>")] {
        let error = bench.import(&through(binding)).unwrap_err();
        assert!(error.contains("form a cycle"), "{error}");
    }
    for (entry, part) in [("../x", "\"..\""), ("/etc/x", "absolute")] {
        let archive = bench.archive(&sound, &[(entry, "x")]);
        let error = bench.import(&archive).unwrap_err();
        assert!(error.contains(part), "{error}");
    }
    let nothing = bench.path("nothing.ssp");
    support::pack(&nothing, &[("x", b"x")]);
    assert!(bench.import(&nothing).unwrap_err().contains("no file \"SystemStructure.ssd\""));
}
