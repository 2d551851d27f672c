//! Mapping tables, and systems in files of their own.
#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::fs;

use master::system::System;
use scenario::Scenario;
use serde_json::{Value, json};
use ssp::SspVersion;
use support::{Bench, pack, ssd};

const TIMES: &str = r#"<ssd:DefaultExperiment startTime="0" stopTime="1"/>"#;

/// Inputs and outputs of all types that have tables. Mode is off (1), on (2); Other is on (0), off (1).
fn switches() -> String {
    let input = |name: &str, kind: &str| {
        format!(
            r#"<ScalarVariable name="{name}" causality="input" variability="discrete">{kind}</ScalarVariable>"#
        )
    };
    let output = |name: &str, kind: &str| {
        format!(
            r#"<ScalarVariable name="{name}" causality="output" variability="discrete">{kind}</ScalarVariable>"#
        )
    };
    let other = r#"<SimpleType name="Other"><Enumeration><Item name="on" value="0"/><Item name="off" value="1"/>
</Enumeration></SimpleType></TypeDefinitions>"#;
    support::unit(&[
        &input("b", r#"<Boolean start="false"/>"#),
        &input("i", r#"<Integer start="0"/>"#),
        &input("m", r#"<Enumeration declaredType="Mode" start="1"/>"#),
        &input("o", r#"<Enumeration declaredType="Other" start="1"/>"#),
        &input("r", r#"<Real start="0"/>"#),
        &output("b_out", "<Boolean/>"),
        &output("i_out", "<Integer/>"),
        &output("m_out", r#"<Enumeration declaredType="Mode"/>"#),
    ])
    .replace("</TypeDefinitions>", other)
}

fn table(kind: &str, entries: &[(&str, &str)]) -> String {
    let entry = |(a, b): &(&str, &str)| format!(r#"<ssc:MapEntry source="{a}" target="{b}"/>"#);
    let entries: String = entries.iter().map(entry).collect();
    format!("<ssc:{kind}MappingTransformation>{entries}</ssc:{kind}MappingTransformation>")
}

fn plain(name: &str, source: &str, inside: &str) -> String {
    format!(r#"<ssd:Component name="{name}" source="{source}">{inside}</ssd:Component>"#)
}

fn connect(from: &str, to: &str, inside: &str) -> String {
    let end = |at: &str, text: &str| match text.split_once('.') {
        Some((element, name)) => {
            format!(r#"{at}Element="{element}" {at}Connector="{name}""#)
        }
        None => format!(r#"{at}Connector="{text}""#),
    };
    format!("<ssd:Connection {} {}>{inside}</ssd:Connection>", end("start", from), end("end", to))
}

fn system(elements: &str, connections: &[String]) -> String {
    let connections = connections.concat();
    format!(
        "<ssd:Elements>{elements}</ssd:Elements><ssd:Connections>{connections}</ssd:Connections>"
    )
}

fn map_of<'s>(scenario: &'s Value, to: &str) -> &'s Value {
    let connections = scenario["connections"].as_array().unwrap();
    &connections.iter().find(|it| it["to"] == to).unwrap()["map"]
}

/// Every kind of table becomes a `map`; what a table does not list stays as it is.
#[test]
fn analytic_tables_on_connections() {
    let bench = Bench::new();
    bench.write_unit("u.fmu", &switches(), &[]);
    let unit = "resources/u.fmu";
    let inner = format!(
        r#"<ssd:System name="in"><ssd:Connectors><ssd:Connector name="x" kind="input"><ssc:Integer/></ssd:Connector>
</ssd:Connectors>{}</ssd:System>"#,
        system(
            &plain("c", unit, ""),
            &[connect("x", "c.i", &table("Integer", &[("8", "9"), ("5", "6")]))]
        )
    );
    let described = r#"<ssd:Connectors><ssd:Connector name="i_out" kind="output"><ssc:Enumeration name="Level"/></ssd:Connector></ssd:Connectors>"#;
    let elements = format!(
        "{}{}{}{inner}",
        plain("a", unit, ""),
        plain("b", unit, ""),
        plain("d", unit, described)
    );
    let connections = [
        connect("a.b_out", "b.b", &table("Boolean", &[("true", "0"), ("false", "1")])),
        // the second is outside of what an Integer can be
        connect("a.i_out", "b.i", &table("Integer", &[("7", "100"), ("99999999999", "1")])),
        connect("a.m_out", "b.m", &table("Enumeration", &[("off", "on")])),
        connect("a.m_out", "b.o", &table("Integer", &[("2", "0")])),
        connect("a.i_out", "in.x", &table("Integer", &[("7", "8")])),
        // the unit has a number where the description has an item
        connect("d.i_out", "a.m", &table("Enumeration", &[("high", "on")])),
    ];
    let levels = r#"<ssd:Enumerations><ssc:Enumeration name="Level"><ssc:Item name="high" value="30"/></ssc:Enumeration></ssd:Enumerations>"#;
    let text = ssd(&system(&elements, &connections), &format!("{levels}{TIMES}"));
    let (scenario, _) = bench.import(&bench.archive(&text, &[])).unwrap();
    assert_eq!(map_of(&scenario, "b.b"), &json!({ "true": false, "false": true }));
    assert_eq!(map_of(&scenario, "b.i"), &json!({ "7": 100 }));
    assert_eq!(map_of(&scenario, "b.m"), &json!({ "off": "on" }));
    // 1 stays 1, which is another item
    assert_eq!(map_of(&scenario, "b.o"), &json!({ "2": 0, "1": 1 }));
    assert_eq!(map_of(&scenario, "in/c.i"), &json!({ "7": 9, "8": 9, "5": 6 }));
    assert_eq!(map_of(&scenario, "a.m"), &json!({ "30": "on" }));
    // and all of them fit
    System::new(&Scenario::load(&bench.path("imported/scenario.json")).unwrap()).unwrap();
}

/// Tables at parameters, of mappings and of connections on the way.
#[test]
fn analytic_tables_leave_other_values_as_they_are() {
    let bench = Bench::new();
    let values = r#"<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>
<ssv:Parameter name="n"><ssv:Integer value="3"/></ssv:Parameter><ssv:Parameter name="o"><ssv:Boolean value="false"/></ssv:Parameter>
<ssv:Parameter name="m"><ssv:Enumeration value="off"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>"#;
    let entry = |source: &str, target: &str, table: &str| {
        format!(
            r#"<ssm:MappingEntry source="{source}" target="{target}">{table}</ssm:MappingEntry>"#
        )
    };
    let mapping = [
        entry("n", "count", &table("Integer", &[("4", "5")])),
        entry("o", "a.on", &table("Boolean", &[("true", "false")])),
        entry("m", "a.mode", &table("Enumeration", &[("off", "on")])),
    ]
    .concat();
    let binding = format!(
        r#"<ssd:Connectors><ssd:Connector name="count" kind="parameter"/></ssd:Connectors><ssd:ParameterBindings>
<ssd:ParameterBinding><ssd:ParameterValues>{values}</ssd:ParameterValues><ssd:ParameterMapping>
<ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping></ssd:ParameterMapping></ssd:ParameterBinding></ssd:ParameterBindings>"#
    );
    let connections = [connect("count", "a.count", &table("Integer", &[("3", "-8")]))];
    let text = format!("{binding}{}", system(&plain("a", "resources/u.fmu", ""), &connections));
    let (scenario, _) = bench.import(&bench.archive(&ssd(&text, TIMES), &[])).unwrap();
    let found = &scenario["instances"]["a"]["parameters"];
    assert_eq!(found, &json!({ "count": -8, "on": false, "mode": "on" }));
}

/// A scenario with tables survives both versions.
#[test]
fn invariant_tables_survive() {
    let bench = Bench::new();
    bench.write_unit("u.fmu", &switches(), &[]);
    let text = json!({
        "units": { "u": "u.fmu" },
        "instances": { "a": { "unit": "u" }, "b": { "unit": "u" }, "c": { "unit": "u" } },
        "connections": [
            { "from": "a.b_out", "to": "b.b", "map": { "true": false } },
            { "from": "a.i_out", "to": "b.i", "map": { "3": 4 } },
            { "from": "a.m_out", "to": "b.m", "map": { "off": "on" } },
            { "from": "a.i_out", "to": "b.o", "map": { "17": "off" } },
            { "from": "a.m_out", "to": "c.i", "map": { "on": -5 } },
            { "from": "a.m_out", "to": "c.o" }
        ],
        "experiment": { "stop": 1.0, "step": 0.1 }
    });
    let before = Scenario::load(&bench.write("s.json", &text.to_string())).unwrap();
    for version in [SspVersion::V1, SspVersion::V2] {
        let archive = bench.path("s.ssp");
        ssp::export(&before, version, &archive).unwrap();
        let imported = ssp::import(&archive, &bench.path("again")).unwrap();
        let after = Scenario::load(&imported.scenario).unwrap();
        assert_eq!(System::new(&before).unwrap().links, System::new(&after).unwrap().links);
    }
}

#[test]
fn refusal_tables_that_do_not_fit() {
    let bench = Bench::new();
    bench.write_unit("u.fmu", &switches(), &[]);
    let unit = "resources/u.fmu";
    for (from, to, inside, part) in [
        ("a.i_out", "b.i", table("Boolean", &[("true", "false")]), "for Booleans, but a.i_out"),
        ("a.b_out", "b.i", table("Integer", &[("1", "2")]), "for Integers and Enumerations"),
        ("a.i_out", "b.r", table("Integer", &[("1", "2")]), "b.r of type Real"),
        ("a.m_out", "b.m", table("Enumeration", &[("off", "of")]), "\"of\" is not an item of b.m"),
        ("a.m_out", "b.m", table("Enumeration", &[("of", "off")]), "\"of\" is not an item of a.m"),
        ("a.m_out", "b.o", table("Integer", &[("1", "0")]), "2 of 2, which is not a value of b.o"),
        (
            "a.i_out",
            "b.i",
            table("Integer", &[("1", "2"), ("1", "3")]),
            "two MapEntry elements for 1",
        ),
        ("a.i_out", "b.i", table("Integer", &[("x", "2")]), "\"x\" is not valid"),
        ("b.i", "a.i_out", table("Integer", &[("1", "2")]), "direction of its transformation"),
    ] {
        let elements = format!("{}{}", plain("a", unit, ""), plain("b", unit, ""));
        let text = ssd(&system(&elements, &[connect(from, to, &inside)]), TIMES);
        let error = bench.import(&bench.archive(&text, &[])).unwrap_err();
        assert!(error.contains(part) && error.contains("Connection from"), "{error}");
    }
}

/// A system with one component, whose gain is 3, an input and an output.
fn inner(unit: &str) -> String {
    let value = r#"<ssd:ParameterBindings><ssd:ParameterBinding prefix="c."><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p">
<ssv:Parameters><ssv:Parameter name="gain"><ssv:Real value="3"/></ssv:Parameter><ssv:Parameter name="count"><ssv:Integer value="3"/></ssv:Parameter>
</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"#;
    let connectors = r#"<ssd:Connectors><ssd:Connector name="x" kind="input"/><ssd:Connector name="z" kind="output"/></ssd:Connectors>"#;
    let connections = [connect("x", "c.u", ""), connect("c.y", "z", "")];
    format!("{connectors}{value}{}", system(&plain("c", unit, ""), &connections))
}

fn gain(value: &str, attributes: &str) -> String {
    format!(
        r#"<ssd:ParameterBindings><ssd:ParameterBinding {attributes}><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p">
<ssv:Parameters><ssv:Parameter name="c.gain"><ssv:Real value="{value}"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues>
</ssd:ParameterBinding></ssd:ParameterBindings>"#
    )
}

/// An archive in an archive, one of its variants, a description beside it, and a system of the same file: each as if
/// its system were there. Values of the component replace those of the system.
#[test]
fn analytic_systems_in_files_of_their_own() {
    let bench = Bench::new();
    let unit = fs::read(bench.path("u.fmu")).unwrap();
    let nested = bench.path("inner.ssp");
    let description = ssd(&inner("resources/u.fmu"), "");
    let variant = description.replace("value=\"3\"", "value=\"4\"").replace("a system", "other");
    pack(
        &nested,
        &[
            ("SystemStructure.ssd", description.as_bytes()),
            ("Variant B.ssd", variant.as_bytes()),
            ("resources/u.fmu", &unit),
            ("resources/own.ssv", br#"<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="c.gain"><ssv:Real value="6"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>"#),
        ],
    );
    let nested = fs::read(nested).unwrap();
    let own = r#"<ssd:ParameterBindings><ssd:ParameterBinding source="resources/own.ssv" sourceBase="component"/></ssd:ParameterBindings>"#;
    let here = inner("resources/u.fmu");
    let elements = [
        plain("one", "resources/inner.ssp", &gain("5", "")),
        plain("two", "resources/inner.ssp", own),
        plain("three", "resources/inner.ssp#Variant%20B.ssd", ""),
        // relative to the file that it is in
        plain("four", "resources/part.ssd", ""),
        plain("five", "#here", ""),
        format!(r#"<ssd:System name="six" id="here">{here}</ssd:System>"#),
    ];
    let names = ["one", "two", "three", "four", "five", "six"];
    let connections: Vec<String> = names
        .windows(2)
        .map(|pair| connect(&format!("{}.z", pair[0]), &format!("{}.x", pair[1]), ""))
        .collect();
    let text = ssd(&system(&elements.concat(), &connections), TIMES);
    let archive = bench.path("outer.ssp");
    let part = ssd(&inner("u.fmu"), "");
    pack(
        &archive,
        &[
            ("SystemStructure.ssd", text.as_bytes()),
            ("resources/inner.ssp", &nested),
            ("resources/part.ssd", part.as_bytes()),
            ("resources/u.fmu", &unit),
            ("Variant C.ssd", b""),
        ],
    );
    let (scenario, notes) = bench.import(&archive).unwrap();
    let instances = &scenario["instances"];
    for (name, gain) in names.into_iter().zip([5.0, 6.0, 4.0, 3.0, 3.0, 3.0]) {
        assert_eq!(instances[format!("{name}/c")]["parameters"]["gain"], gain, "{name}");
    }
    assert_eq!(instances["one/c"]["parameters"]["count"], 3);
    let of = |name: &str| instances[format!("{name}/c")]["unit"].clone();
    assert_eq!(of("one"), of("three"), "an archive is opened once");
    assert_eq!(of("four"), of("six"));
    assert_eq!(scenario["units"].as_object().unwrap().len(), 2);
    let found = scenario["connections"].as_array().unwrap();
    assert_eq!(found.len(), 5);
    assert!(found.contains(&json!({ "from": "two/c.y", "to": "three/c.u" })), "{found:?}");
    assert!(
        notes.iter().any(|it| it.contains("variants are not used: Variant C.ssd")),
        "{notes:?}"
    );
    Scenario::load(&bench.path("imported/scenario.json")).unwrap();
    // the same from the unpacked archive
    bench.write("open/SystemStructure.ssd", &text);
    bench.write("open/resources/part.ssd", &part);
    fs::write(bench.path("open/resources/inner.ssp"), &nested).unwrap();
    fs::write(bench.path("open/resources/u.fmu"), &unit).unwrap();
    let (again, _) = bench.import(&bench.path("open/SystemStructure.ssd")).unwrap();
    assert_eq!(&again["instances"], instances);
}

/// An archive of ours as a part: its sums and the settings of its instances are used, the rest is named.
#[test]
fn issue_21_archives_of_ours_are_parts_of_others() {
    let bench = Bench::new();
    let text = json!({
        "units": { "u": "u.fmu" },
        "instances": { "a": { "unit": "u", "steps": 2, "parameters": { "file": { "path": "x.txt" } } }, "b": { "unit": "u" } },
        "connections": [{ "from": ["a.y", { "signal": "b.y", "factor": 3.0 }], "to": "b.u" }],
        "experiment": { "stop": 1.0, "step": 0.1 },
        "algorithm": { "name": "jacobi" }
    });
    bench.write("x.txt", "text");
    let before = Scenario::load(&bench.write("s.json", &text.to_string())).unwrap();
    let archive = bench.path("ours.ssp");
    ssp::export(&before, SspVersion::V2, &archive).unwrap();
    bench.write("outer.ssd", &ssd(&system(&plain("p.1", "ours.ssp", ""), &[]), TIMES));
    let (scenario, notes) = bench.import(&bench.path("outer.ssd")).unwrap();
    let sum = json!({
        "from": [{ "signal": "p_1/a.y", "factor": 1.0 }, { "signal": "p_1/b.y", "factor": 3.0 }],
        "to": "p_1/b.u"
    });
    assert_eq!(scenario["connections"], json!([sum]));
    let a = &scenario["instances"]["p_1/a"];
    assert_eq!(a["steps"], 2);
    let file = bench.path("imported").join(a["parameters"]["file"]["path"].as_str().unwrap());
    assert_eq!(fs::read_to_string(file).unwrap(), "text");
    assert!(
        notes.iter().any(|it| it.contains("ours.ssp") && it.contains("algorithm")),
        "{notes:?}"
    );
    assert!(scenario.get("algorithm").is_none());
}

#[test]
fn refusal_systems_that_cannot_be_parts() {
    let bench = Bench::new();
    let unit = fs::read(bench.path("u.fmu")).unwrap();
    fs::create_dir_all(bench.path("resources")).unwrap();
    fs::write(bench.path("resources/u.fmu"), &unit).unwrap();
    let units = r#"<ssd:Units><ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssd:Units>"#;
    let text = inner("resources/u.fmu").replace(
        "name=\"x\" kind=\"input\"/>",
        "name=\"x\" kind=\"input\"><ssc:Real unit=\"m\"/></ssd:Connector>",
    );
    bench.write("part.ssd", &ssd(&text, units));
    bench.write("bad.ssd", &ssd(&plain("c", "resources/no.fmu", ""), ""));
    bench.write("unit.ssd", &ssd(&system(&plain("c", "resources/no.fmu", ""), &[]), ""));
    bench.write("broken.ssp", "no archive");
    let connector = |text: &str| format!("<ssd:Connectors>{text}</ssd:Connectors>");
    let in_mm =
        connector(r#"<ssd:Connector name="x" kind="input"><ssc:Real unit="mm"/></ssd:Connector>"#);
    let none = connector(r#"<ssd:Connector name="none" kind="input"/>"#);
    for (elements, parts) in [
        (plain("p", "outer.ssd", ""), ["p/p", "nested more than 100 deep"]),
        (
            format!(
                r#"<ssd:System name="s" id="s"><ssd:Elements>{}</ssd:Elements></ssd:System>"#,
                plain("p", "#s", "")
            ),
            ["s/p/p", "nested more than 100 deep"],
        ),
        (plain("p", "#none", ""), ["Component \"p\"", "no System has the id \"none\""]),
        (plain("p", "part.ssd#x", ""), ["Component \"p\"", "part.ssd#x"]),
        (plain("p", "none.ssp", ""), ["Component \"p\"", "no file \"none.ssp\""]),
        (plain("p", "broken.ssp", ""), ["broken.ssp", "not a readable zip archive"]),
        (plain("p", "unit.ssd", ""), ["Component \"p/c\"", "no file \"resources/no.fmu\""]),
        (plain("p", "part.ssd", &none), ["Component \"p\"", "no connector \"none\""]),
        (plain("p", "part.ssd", &in_mm), ["Component \"p\"", "\"x\" is in mm, but in m in"]),
    ] {
        let outer =
            bench.write("outer.ssd", &ssd(&system(&elements, &[]), &format!("{units}{TIMES}")));
        let error = bench.import(&outer).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "{elements}\n{error}");
        }
    }
}
