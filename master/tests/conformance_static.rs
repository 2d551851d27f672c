//! `maglev validate`: every static rule is triggered by a unit with that one fault.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;

use master::validate;
use serde_json::Value;
use support::{Bench, DESCRIPTION};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const BINARY: &str = "binaries/linux64/unit.so";
const PAGE: &str = "documentation/index.html";

/// A rule, and the change of the sound description that breaks it.
const CHANGES: &[(&str, &str, &str)] = &[
    ("description-doctype", "<fmiModelD", "<!DOCTYPE fmiModelDescription><fmiModelD"),
    ("description-xml", "</ModelStructure>", ""),
    ("schema-root", "fmiModelDescription", "fmiModel"),
    ("schema-root", "<fmiModelDescription ", "<fmiModelDescription xmlns=\"urn:x\" "),
    ("schema-element", "<BaseUnit s=\"1\"/>", "<BaseUnit s=\"1\"/><Other/>"),
    (
        "schema-order",
        "<ModelV",
        "<LogCategories><Category name=\"a\"/></LogCategories>\
         <TypeDefinitions><SimpleType name=\"T\"><Real/></SimpleType></TypeDefinitions><ModelV",
    ),
    ("schema-missing", "<ModelV", "<LogCategories/><ModelV"),
    ("schema-missing", "<Integer/>", ""),
    ("schema-repeated", "<Integer/>", "<Integer/><Integer/>"),
    ("schema-attribute", "name=\"u\"", "colour=\"red\" name=\"u\""),
    ("schema-attribute", "canInterpolateInputs", "canInterpolateInput"),
    ("schema-required", " valueReference=\"0\"", ""),
    ("schema-value", "min=\"-10\"", "min=\"low\""),
    ("schema-value", "start=\"false\"", "start=\"False\""),
    ("schema-value", "<Integer start=\"0\"/>", "<Integer start=\"3000000000\"/>"),
    ("schema-value", "start=\"1\" min", "start=\"infinity\" min"),
    ("schema-value", "guid=", "generationDateAndTime=\"yesterday\" guid="),
    ("schema-value", "causality=\"input\"", "causality=\"Input\""),
    ("schema-text", "<ModelV", "stray<ModelV"),
    ("fmi-version", "fmiVersion=\"2.0\"", "fmiVersion=\"2.0.5\""),
    ("co-simulation", "<CoSimulation", "<Simulation"),
    ("readable", "<Integer/>", ""),
    ("guid", "guid=\"test-unit\"", "guid=\"\""),
    ("model-name", "modelName=\"integrator\"", "modelName=\" \""),
    ("model-identifier", "modelIdentifier=\"unit\"", "modelIdentifier=\"my-unit\""),
    (
        "model-identifier-length",
        "modelIdentifier=\"unit\"",
        "modelIdentifier=\"a_unit_whose_name_is_longer_than_any_path_on_windows_can_hold\"",
    ),
    ("generation-date", "guid=", "generationDateAndTime=\"2026-01-31T12:00:00+01:00\" guid="),
    (
        "log-categories",
        "<ModelV",
        "<LogCategories><Category name=\"a\"/><Category name=\"a\"/></LogCategories><ModelV",
    ),
    (
        "experiment-interval",
        "<ModelV",
        "<DefaultExperiment startTime=\"1\" stopTime=\"0\"/><ModelV",
    ),
    ("experiment-interval", "<ModelV", "<DefaultExperiment stopTime=\"INF\"/><ModelV"),
    ("experiment-value", "<ModelV", "<DefaultExperiment stepSize=\"0\"/><ModelV"),
    ("experiment-step", "<ModelV", "<DefaultExperiment stopTime=\"1\" stepSize=\"2\"/><ModelV"),
    (
        "annotations",
        "<ModelV",
        "<VendorAnnotations><Tool name=\"t\"/><Tool name=\"t\"/></VendorAnnotations><ModelV",
    ),
    ("serialize", "canInter", "canSerializeFMUstate=\"true\" canInter"),
    ("execution-tool", "canInter", "needsExecutionTool=\"true\" canInter"),
    ("once-per-process", "canInter", "canBeInstantiatedOnlyOncePerProcess=\"true\" canInter"),
    ("asynchronous", "canInter", "canRunAsynchronuously=\"true\" canInter"),
    ("multiple-set", "name=\"u\"", "canHandleMultipleSetPerTimeInstant=\"false\" name=\"u\""),
    ("reinit", "<Real unit=\"m\"/>", "<Real unit=\"m\" reinit=\"true\"/>"),
    ("unit-duplicate", "<Unit name=\"mm\">", "<Unit name=\"m\">"),
    ("unit-base", "<BaseUnit s=\"1\"/>", ""),
    ("unit-factor", "factor=\"0.001\"", "factor=\"0\""),
    ("unit-factor", "factor=\"0.001\"", "offset=\"INF\""),
    (
        "display-unit-duplicate",
        "<BaseUnit s=\"1\"/>",
        "<BaseUnit s=\"1\"/><DisplayUnit name=\"h\"/><DisplayUnit name=\"h\"/>",
    ),
    ("unit-defined", "<Real unit=\"m\"/>", "<Real unit=\"parsec\"/>"),
    ("display-unit-defined", "<Real unit=\"m\"/>", "<Real unit=\"m\" displayUnit=\"inch\"/>"),
    ("display-unit-alone", "<Real unit=\"m\"/>", "<Real displayUnit=\"mm\"/>"),
    (
        "type-duplicate",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Real/></SimpleType>\
        <SimpleType name=\"T\"><Real/></SimpleType></TypeDefinitions><ModelV",
    ),
    (
        "type-name",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"u\"><Real/></SimpleType>\
        </TypeDefinitions><ModelV",
    ),
    (
        "type-range",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Real min=\"2\" max=\"1\"/>\
        </SimpleType></TypeDefinitions><ModelV",
    ),
    (
        "enumeration-items",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Enumeration>\
        <Item name=\"a\" value=\"1\"/><Item name=\"b\" value=\"1\"/></Enumeration></SimpleType>\
        </TypeDefinitions><ModelV",
    ),
    ("declared-type", "<Integer start", "<Integer declaredType=\"Missing\" start"),
    ("variable-duplicate", "name=\"z\"", "name=\"y\""),
    ("variable-empty", "name=\"z\"", "name=\" \""),
    ("variable-flat", "name=\"z\"", "name=\"z&#9;z\""),
    (
        "variability-type",
        "name=\"n\" valueReference=\"1\" causality=\"input\" variability=\"discrete\"",
        "name=\"n\" valueReference=\"1\" causality=\"input\" variability=\"continuous\"",
    ),
    (
        "variability-missing",
        "name=\"n\" valueReference=\"1\" causality=\"input\" variability=\"discrete\"",
        "name=\"n\" valueReference=\"1\" causality=\"input\"",
    ),
    (
        "causality-variability",
        "causality=\"parameter\" variability=\"fixed\"",
        "causality=\"parameter\" variability=\"discrete\"",
    ),
    ("initial", "causality=\"input\"", "causality=\"input\" initial=\"exact\""),
    ("initial", "=\"output\" initial", "=\"parameter\" variability=\"fixed\" initial"),
    ("start-required", "start=\"0\" unit", "unit"),
    ("start-forbidden", "<Integer/>", "<Integer start=\"1\"/>"),
    ("start-finite", "start=\"1\" min", "start=\"NaN\" min"),
    ("start-finite", "start=\"1\" min", "start=\"-INF\" min"),
    ("start-outside-range", "start=\"1\" min", "start=\"11\" min"),
    ("range", "min=\"-10\"", "min=\"100\""),
    ("range-finite", "min=\"-10\"", "min=\"-INF\""),
    ("nominal", "unit=\"s\"/>", "unit=\"s\" nominal=\"-1\"/>"),
    ("nominal", "unit=\"s\"/>", "unit=\"s\" nominal=\"0\"/>"),
    ("derivative", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"6\"/>"),
    ("derivative", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"2\"/>"),
    ("alias-start", "valueReference=\"4\"", "valueReference=\"3\""),
    ("alias-settable", "valueReference=\"4\"", "valueReference=\"3\""),
    ("alias-unit", "valueReference=\"2\" causality", "valueReference=\"3\" causality"),
    ("outputs", "<Unknown index=\"2\" dependencies=\"\"/>", ""),
    ("outputs", "<Unknown index=\"2\" dependencies=\"\"/>", "<Unknown index=\"1\"/>"),
    (
        "initial-unknowns",
        "<InitialUnknowns>\n      <Unknown index=\"2\" dependencies=\"\"/>",
        "<InitialUnknowns>",
    ),
    ("initial-unknowns-excess", "<InitialUnknowns>", "<InitialUnknowns><Unknown index=\"1\"/>"),
    (
        "initial-unknowns-order",
        "<Unknown index=\"3\" dependencies=\"1 5\"/>",
        "<Unknown index=\"12\"/><Unknown index=\"3\" dependencies=\"1 5\"/>",
    ),
    ("structure-index", "index=\"3\"", "index=\"33\""),
    ("structure-index", "dependencies=\"1\"", "dependencies=\"0 1\""),
    ("structure-duplicate", "<Unknown index=\"3\"", "<Unknown index=\"2\"/><Unknown index=\"3\""),
    ("dependencies-order", "dependencies=\"1 5\"", "dependencies=\"5 1\""),
    ("dependencies-known", "dependencies=\"1\"", "dependencies=\"4\""),
    (
        "dependencies-kind",
        "dependencies=\"1\"",
        "dependencies=\"1\" dependenciesKind=\"constant fixed\"",
    ),
    ("dependencies-kind", "index=\"3\" dependencies=\"1\"", "index=\"3\" dependenciesKind=\"\""),
    (
        "dependencies-kind-initial",
        "dependencies=\"1 5\"",
        "dependencies=\"1 5\" dependenciesKind=\"fixed constant\"",
    ),
    (
        "dependencies-kind-type",
        "index=\"8\" dependencies=\"7\"",
        "index=\"8\" dependencies=\"7\" dependenciesKind=\"constant\"",
    ),
];

/// Rules that need more than one replacement.
fn larger_changes() -> Vec<(&'static str, String)> {
    let types = |inner: &str| {
        let types = format!(
            "<TypeDefinitions><SimpleType name=\"T\">{inner}</SimpleType></TypeDefinitions>\n\
             <ModelV"
        );
        DESCRIPTION.replacen("<ModelV", &types, 1)
    };
    let variables = |inner: &str| {
        DESCRIPTION.replacen("</ModelVariables>", &format!("{inner}</ModelVariables>"), 1)
    };
    let time = r#"<ScalarVariable name="T" valueReference="9" causality="independent"
        variability="continuous"><Real unit="s"/></ScalarVariable>"#;
    let constants = r#"<ScalarVariable name="k" valueReference="9" variability="constant"><Real
        start="1"/></ScalarVariable><ScalarVariable name="l" valueReference="9"><Real/>
        </ScalarVariable>"#;
    let items = types(r#"<Enumeration><Item name="a" value="1"/></Enumeration>"#);
    let derivative = variables(
        r#"<ScalarVariable name="der(y)" valueReference="9" variability="discrete"><Integer/>
        </ScalarVariable>"#,
    );
    vec![
        (
            "type-widened",
            types(r#"<Real min="-5"/>"#).replacen(
                "start=\"1\" min",
                "declaredType=\"T\" start=\"1\" min",
                1,
            ),
        ),
        (
            "declared-type",
            types("<Real/>").replacen("<Integer start", "<Integer declaredType=\"T\" start", 1),
        ),
        (
            "start-enumeration",
            items.replacen(
                "<Integer start=\"0\"",
                "<Enumeration declaredType=\"T\" start=\"4\"",
                1,
            ),
        ),
        ("independent-once", variables(&(time.to_owned() + &time.replace("\"T\"", "\"T2\"")))),
        ("independent-type", variables(&time.replace("Real unit=\"s\"", "Integer"))),
        ("alias-constant", variables(constants)),
        (
            "variable-structured",
            DESCRIPTION.replacen("name=\"z\"", "name=\"z z\"", 1).replacen(
                "guid=",
                "variableNamingConvention=\"structured\" guid=",
                1,
            ),
        ),
        (
            "variable-der",
            derivative.replacen("guid=", "variableNamingConvention=\"structured\" guid=", 1),
        ),
        (
            "derivatives",
            DESCRIPTION.replacen(
                "</Outputs>",
                "</Outputs><Derivatives><Unknown index=\"2\"/></Derivatives>",
                1,
            ),
        ),
        (
            "sources",
            DESCRIPTION.replacen(
                "maxOutputDerivativeOrder=\"1\"/>",
                "><SourceFiles><File name=\"all.c\"/></SourceFiles></CoSimulation>",
                1,
            ),
        ),
    ]
}

fn write(bench: &Bench, fill: impl FnOnce(&mut ZipWriter<fs::File>)) {
    let mut writer = ZipWriter::new(fs::File::create(bench.path("bad.fmu")).unwrap());
    fill(&mut writer);
    writer.finish().unwrap();
}

fn add(writer: &mut ZipWriter<fs::File>, name: &str, bytes: &[u8]) {
    writer.start_file(name, SimpleFileOptions::default()).unwrap();
    writer.write_all(bytes).unwrap();
}

/// Packs `bad.fmu` with a fault of its archive.
fn archives(rule: &str, bench: &Bench, binary: &[u8]) -> bool {
    let xml = DESCRIPTION.as_bytes();
    let sound = |extra: &[(&str, &[u8])]| {
        let mut files =
            vec![("modelDescription.xml", xml), (BINARY, binary), (PAGE, b"".as_slice())];
        files.extend(extra);
        bench.pack("bad.fmu", &files);
    };
    match rule {
        "archive-zip" => fs::write(bench.path("bad.fmu"), "no archive").unwrap(),
        "archive-backslash" => sound(&[("resources\\a", b"")]),
        "archive-escape" => sound(&[("resources/../../a", b"")]),
        "archive-dot" => sound(&[("./resources/a", b"")]),
        "archive-duplicate" => sound(&[("resources/a", b""), ("resources/A", b"")]),
        "archive-ascii" => sound(&[("resources/ä", b"")]),
        "archive-control" => sound(&[("resources/a\tb", b"")]),
        "archive-top-level" => sound(&[("notes.txt", b"")]),
        "archive-refused" => sound(&[("resources/zeros", &vec![0; 64 << 20])]),
        "archive-link" => write(bench, |writer| {
            add(writer, "modelDescription.xml", xml);
            let options = SimpleFileOptions::default();
            writer.add_symlink("resources/link", "/etc/passwd", options).unwrap();
        }),
        "archive-compression" => {
            sound(&[]);
            patch_compression(bench);
        }
        "description-missing" => bench.pack("bad.fmu", &[("x/modelDescription.xml", xml)]),
        "description-text" => bench.pack("bad.fmu", &[("modelDescription.xml", b"<x \xff/>")]),
        "documentation" => {
            bench.pack("bad.fmu", &[("modelDescription.xml", xml), (BINARY, binary)])
        }
        "code-missing" | "platform" => bench.pack("bad.fmu", &[("modelDescription.xml", xml)]),
        "binary-name" => bench.pack(
            "bad.fmu",
            &[("modelDescription.xml", xml), ("binaries/linux64/libunit.so", binary)],
        ),
        "binary-folder" => sound(&[("binaries/linux-x64/unit.so", binary)]),
        "binary-format" => sound(&[("binaries/win64/unit.dll", binary)]),
        "symbols" => bench.unit("bad.fmu", DESCRIPTION, &["-DWITHOUT_RESET"]),
        _ => return false,
    }
    true
}

/// Marks the first entry as packed with method 12, bzip2, in both of its headers.
fn patch_compression(bench: &Bench) {
    let path = bench.path("bad.fmu");
    let mut bytes = fs::read(&path).unwrap();
    bytes[8] = 12;
    let central = bytes.windows(4).position(|it| it == [b'P', b'K', 1, 2]).unwrap();
    bytes[central + 10] = 12;
    fs::write(path, bytes).unwrap();
}

/// Rules that `maglev validate` names for `bad.fmu`, with its exit status.
fn found(bench: &Bench) -> (i32, Vec<(String, String)>) {
    let ran = bench.maglev(&["validate", "bad.fmu", "--json"]);
    let findings: Vec<Value> = serde_json::from_str(&ran.stdout()).unwrap_or_else(|error| {
        panic!("{error}: {}{}", ran.stdout(), ran.stderr());
    });
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    (ran.status(), findings.iter().map(|it| (text(it, "rule"), text(it, "severity"))).collect())
}

/// The sound unit has no finding; each fault is found by its rule; no rule is without a fault.
#[test]
fn issue_every_rule_is_triggered() {
    let bench = Bench::new();
    let binary = bench.compile(&[]);
    let pack = |description: &str| {
        let text = description.as_bytes();
        let files = [("modelDescription.xml", text), (BINARY, &binary), (PAGE, b"".as_slice())];
        bench.pack("bad.fmu", &files);
    };
    pack(DESCRIPTION);
    assert_eq!(found(&bench), (0, Vec::new()));

    let mut triggered = BTreeSet::new();
    let mut silent = Vec::new();
    let mut expect = |rule: &str| {
        let (status, findings) = found(&bench);
        let own = findings.iter().find(|(it, _)| it == rule);
        if own.is_none() {
            silent.push(format!("{rule} is missing among {findings:?}"));
        }
        let known = |it: &str| validate::rules().any(|rule| rule.id == it);
        assert!(findings.iter().all(|(it, _)| known(it)), "{findings:?}");
        let error = findings.iter().any(|(_, severity)| severity == "error");
        assert_eq!(status, i32::from(error), "{rule}: {findings:?}");
        triggered.insert(rule.to_owned());
    };
    for (rule, old, new) in CHANGES {
        let changed = DESCRIPTION.replacen(old, new, if *rule == "schema-root" { 9 } else { 1 });
        assert_ne!(changed, DESCRIPTION, "{rule}");
        pack(&changed);
        expect(rule);
    }
    for (rule, changed) in larger_changes() {
        assert_ne!(changed, DESCRIPTION, "{rule}");
        pack(&changed);
        expect(rule);
    }
    for rule in validate::rules() {
        if archives(rule.id, &bench, &binary) {
            expect(rule.id);
        }
    }
    assert_eq!(silent, Vec::<String>::new());
    for rule in validate::rules() {
        assert!(triggered.contains(rule.id), "no fault triggers {}", rule.id);
    }
    let ids: BTreeSet<&str> = validate::rules().map(|rule| rule.id).collect();
    assert_eq!(ids.len(), validate::rules().count(), "two rules have one name");
}

/// Exit status 2 for what is no file, and readable output by default.
#[test]
fn issue_validate_says_what_it_did() {
    let bench = Bench::new();
    bench.maglev(&["validate", "nothing.fmu"]).fails(2, &["nothing.fmu", "cannot be read"]);
    bench.maglev(&["validate", "."]).fails(2, &["directory"]);
    let ran = bench.maglev(&["validate", "unit.fmu"]);
    ran.succeeds();
    assert!(ran.stdout().contains("0 errors, 0 warnings, 1 notes"), "{}", ran.stdout());
    assert!(ran.stdout().contains("[documentation]"));
    let rules = bench.maglev(&["validate", "--rules"]).stdout();
    assert!(validate::rules().all(|rule| rules.contains(rule.demand)));
}
