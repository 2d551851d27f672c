//! `maglev validate`: every static rule is triggered by a unit with that one fault, one fault is
//! one finding, and what the standard allows is none.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

#[path = "support/archives.rs"]
mod archives;
#[path = "support/faults.rs"]
mod faults;
mod support;

use std::collections::BTreeSet;
use std::fs;

use archives::{
    ARM64, BINARY, PAGE, X86_64, archives, damage, encrypt, mach_o, pack_with, universal,
};
use faults::{CHANGES, larger_changes};
use serde_json::Value;
use support::{Bench, DESCRIPTION};

/// A finding in `bad.fmu`.
#[derive(Debug, PartialEq)]
struct Found {
    rule: String,
    severity: String,
    message: String,
}

/// Packs the sound unit with another description.
fn pack(bench: &Bench, description: &str, binary: &[u8]) {
    let files = [
        ("modelDescription.xml", description.as_bytes()),
        (BINARY, binary),
        (PAGE, b"".as_slice()),
    ];
    bench.pack("bad.fmu", &files);
}

/// What `maglev validate` finds in a file, with its exit status.
fn found_in(bench: &Bench, name: &str) -> (i32, Vec<Found>) {
    let ran = bench.maglev(&["validate", name, "--json"]);
    let findings: Vec<Value> = serde_json::from_str(&ran.stdout()).unwrap_or_else(|error| {
        panic!("{error}: {}{}", ran.stdout(), ran.stderr());
    });
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    let found = |it: &Value| Found {
        rule: text(it, "rule"),
        severity: text(it, "severity"),
        message: text(it, "message"),
    };
    (ran.status(), findings.iter().map(found).collect())
}

/// The errors in `bad.fmu`: rule and message.
fn errors(bench: &Bench) -> Vec<(String, String)> {
    let errors = found_in(bench, "bad.fmu").1.into_iter().filter(|it| it.severity == "error");
    errors.map(|it| (it.rule, it.message)).collect()
}

/// The sound unit has no finding; each fault is found by its rule; no rule is without a fault.
#[test]
fn issue_every_rule_is_triggered() {
    let bench = Bench::new();
    let binary = bench.compile(&[]);
    pack(&bench, DESCRIPTION, &binary);
    assert_eq!(found_in(&bench, "bad.fmu"), (0, Vec::new()));

    let mut triggered = BTreeSet::new();
    let mut silent = Vec::new();
    let mut expect = |rule: &str, change: &str| {
        let (status, findings) = found_in(&bench, "bad.fmu");
        if findings.iter().all(|it| it.rule != rule) {
            silent.push(format!("{rule} is missing for {change}: {findings:?}"));
        }
        let known = |it: &Found| fmi2_conformance::rules().any(|rule| rule.id == it.rule);
        assert!(findings.iter().all(known), "{findings:?}");
        let error = findings.iter().any(|it| it.severity == "error");
        assert_eq!(status, i32::from(error), "{rule}: {findings:?}");
        triggered.insert(rule.to_owned());
    };
    for (rule, old, new) in CHANGES {
        let changed = DESCRIPTION.replacen(old, new, if *rule == "schema-root" { 9 } else { 1 });
        assert_ne!(changed, DESCRIPTION, "{rule}");
        pack(&bench, &changed, &binary);
        expect(rule, new);
    }
    for (rule, changed) in larger_changes() {
        assert_ne!(changed, DESCRIPTION, "{rule}");
        pack(&bench, &changed, &binary);
        expect(rule, "a larger change");
    }
    for rule in fmi2_conformance::rules() {
        if archives(rule.id, &bench, &binary) {
            expect(rule.id, "an archive");
        }
    }
    assert_eq!(silent, Vec::<String>::new());
    pack(&bench, DESCRIPTION, &binary);
    fs::copy(bench.path("bad.fmu"), bench.path("bad.zip")).unwrap();
    let (status, findings) = found_in(&bench, "bad.zip");
    assert!(status == 1 && findings.len() == 1, "{findings:?}");
    triggered.insert(findings[0].rule.clone());
    // has a test of its own
    triggered.insert("guid-content".to_owned());
    for rule in fmi2_conformance::rules() {
        assert!(triggered.contains(rule.id), "no fault triggers {}", rule.id);
    }
    let ids: BTreeSet<&str> = fmi2_conformance::rules().map(|rule| rule.id).collect();
    assert_eq!(ids.len(), fmi2_conformance::rules().count(), "two rules have one name");
}

/// What follows from a fault is not told as well: one fault, one error, and it says what it is.
#[test]
fn issue_one_fault_is_one_error() {
    let bench = Bench::new();
    let binary = bench.compile(&[]);
    let files: String = (0..132).map(|n| format!("<File name=\"f{n}.c\"/>")).collect();
    let sources = format!("><SourceFiles>{files}</SourceFiles></CoSimulation>");
    let structure =
        DESCRIPTION.find("<ModelStructure>").unwrap()..DESCRIPTION.find("</fmi").unwrap();
    let without_structure = DESCRIPTION.replace(&DESCRIPTION[structure], "");
    let outputs = DESCRIPTION.find("<Outputs>").unwrap()..DESCRIPTION.find("<InitialU").unwrap();
    let without_outputs = DESCRIPTION.replace(&DESCRIPTION[outputs], "");
    let all = |old: &str, new: &str| DESCRIPTION.replace(old, new);
    let one = |old: &str, new: &str| DESCRIPTION.replacen(old, new, 1);
    for (changed, rule, text) in [
        (
            one("maxOutputDerivativeOrder=\"1\"/>", &sources),
            "sources",
            "132 files that are missing",
        ),
        (
            without_structure,
            "schema-missing",
            "does not contain the required element <ModelStructure>",
        ),
        (without_outputs, "outputs", "there is no <Outputs>, which must list 5 variables"),
        (
            all("<Integer/>", ""),
            "schema-missing",
            "does not contain the required element <Real> or <Integer>",
        ),
        (one("causality=\"output\"", "causality=\"Output\""), "schema-value", "not one of"),
        (one("causality=\"output\"", "causality=\" output\""), "schema-value", "\" output\""),
        (one("index=\"2\"", "index=\"two\""), "schema-value", "index=\"two\""),
        (all("<CoSimulation", "<q:CoSimulation xmlns:q=\"urn:x\""), "schema-element", "urn:x"),
        (
            one("<fmiModelDescription ", "<fmiModelDescription xmlns=\"urn:x\" "),
            "schema-root",
            "urn:x",
        ),
        (
            one("name=\"z\"", "name=\"y\""),
            "variable-duplicate",
            "the variable name \"y\" occurs more than once",
        ),
        (all("unit=\"m\"", "unit=\"M\""), "unit-defined", "the unit \"M\" of \"u\", \"y\", \"z\""),
        (
            one("modelIdentifier=\"unit\"", "modelIdentifier=\"u\""),
            "binary-name",
            "has no \"u.so\"",
        ),
        (
            one("causality=\"input\"", "causality=\"input\" derivative=\"0\""),
            "schema-attribute",
            "",
        ),
        (
            one("<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"0\"/>"),
            "derivative",
            "variable 0",
        ),
    ] {
        pack(&bench, &changed, &binary);
        let errors = errors(&bench);
        assert!(
            matches!(&errors[..], [(it, message)] if it == rule && message.contains(text)),
            "{rule}, {text}: {errors:#?}"
        );
    }
}

/// A description that cannot be unpacked is not called missing, and other entries count too.
#[test]
fn issue_damaged_and_encrypted_entries_are_called_so() {
    let bench = Bench::new();
    let binary = bench.compile(&[]);
    for name in ["modelDescription.xml", BINARY, "resources/a"] {
        pack_with(&bench, &binary, &[("resources/a", b"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa")]);
        damage(&bench, name);
        let found = errors(&bench);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].0, "archive-damaged", "{found:?}");
        assert!(found[0].1.contains(name) && found[0].1.contains("checksum"), "{found:?}");

        pack_with(&bench, &binary, &[("resources/a", b"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa")]);
        encrypt(&bench, name);
        let found = errors(&bench);
        let expected = format!("entry \"{name}\" is encrypted");
        assert_eq!(found, [("archive-encrypted".to_owned(), expected)]);
    }
    pack_with(&bench, &binary, &[]);
    encrypt(&bench, "modelDescription.xml");
    bench.maglev(&["inspect", "bad.fmu"]).fails(2, &["modelDescription.xml", "Password"]);
}

/// The GUID of a unit of the kit is a fingerprint: other resources, or another description, do not
/// belong to it.
#[test]
fn issue_a_description_belongs_to_its_resources() {
    let bench = Bench::new();
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let of = |name: &str| fs::read_to_string(root.join("modelDescription").join(name)).unwrap();
    let resource = |name: &str| fs::read_to_string(root.join(name)).unwrap();
    let check = |description: &str, files: &[(&str, &str)]| {
        let mut all = vec![("modelDescription.xml", description.as_bytes())];
        all.extend(files.iter().map(|(name, text)| (*name, text.as_bytes())));
        bench.pack("bad.fmu", &all);
        let (_, findings) = found_in(&bench, "bad.fmu");
        let found = findings.iter().find(|it| it.rule == "guid-content");
        found.map(|it| (it.severity.clone(), it.message.contains("one of them was changed")))
    };
    let changed = Some(("warning".to_owned(), true));
    let file = "resources/vehicle.json";
    for (name, layout) in [("vehicle.xml", "two-car"), ("vehicle-one-bogie.xml", "one-bogie")] {
        let description = of(name);
        let json = resource(&format!("fmu-vehicle/resources/{layout}/vehicle.json"));
        assert_eq!(check(&description, &[(file, &json)]), None, "{name}");
        assert_eq!(check(&description, &[("resources/more", ""), (file, &json)]), None, "{name}");
        assert_eq!(check(&description, &[(file, &(json.clone() + " "))]), changed, "{name}");
        assert_eq!(check(&description, &[]), changed, "{name}");
        let edited = description.replacen("start=\"", "start=\"1", 1);
        assert_eq!(check(&edited, &[(file, &json)]), changed, "{name}");
    }
    assert_eq!(check(&of("ems.xml"), &[]), None);
    // annotations are no part of the fingerprint
    let ems = of("ems.xml");
    let (before, rest) = ems.split_once("  <VendorAnnotations>").unwrap();
    let (_, after) = rest.split_once("</VendorAnnotations>\n").unwrap();
    let plain = format!("{before}{after}");
    assert!(!plain.contains("Annotations"));
    assert_eq!(check(&plain, &[]), None);
}

/// Exit status 2 for what is no file, and readable output by default.
#[test]
fn issue_validate_reports_counts_and_refuses_what_it_cannot_read() {
    let bench = Bench::new();
    bench.maglev(&["validate", "nothing.fmu"]).fails(2, &["cannot read", "nothing.fmu"]);
    bench.maglev(&["validate", "."]).fails(2, &["directory"]);
    let ran = bench.maglev(&["validate", "unit.fmu"]);
    ran.succeeds();
    assert!(ran.stdout().contains("0 errors, 0 warnings, 1 notes"), "{}", ran.stdout());
    assert!(ran.stdout().contains("[documentation]"));
    let rules = bench.maglev(&["validate", "--rules"]).stdout();
    assert!(fmi2_conformance::rules().all(|rule| rules.contains(rule.demand)));
}

/// What the standard allows is no error, whatever other tools think.
#[test]
fn issue_legal_descriptions_have_no_errors() {
    let bench = Bench::new();
    let binary = bench.compile(&[]);
    let one = |old: &str, new: &str| {
        let changed = DESCRIPTION.replacen(old, new, 1);
        assert_ne!(changed, DESCRIPTION, "{old}");
        changed
    };
    let types = "<TypeDefinitions><SimpleType name=\"T\"><Real min=\"-5\" max=\"5\"/></SimpleType>\
                 <SimpleType name=\"E\"><Enumeration><Item name=\"a\" value=\"7\"/></Enumeration>\
                 </SimpleType></TypeDefinitions><ModelV";
    let typed = one("<ModelV", types);
    let wider = typed.replacen("start=\"1\" min", "declaredType=\"T\" start=\"1\" min", 1);
    let item = typed.replacen(
        "<Integer start=\"0\"/>",
        "<Enumeration declaredType=\"E\" start=\" 007 \"/>",
        1,
    );
    let vendor = "<VendorAnnotations><Tool name=\"t\"><a><ScalarVariable name=\"u\"/><Unit name=\"m\"/>\
                  <Unit name=\"m\"/><Real unit=\"none\" derivative=\"0\"/><SourceFiles><File name=\"x\"/>\
                  </SourceFiles><CoSimulation modelIdentifier=\"-\"/><Category name=\"a\"/><Category \
                  name=\"a\"/>text</a></Tool></VendorAnnotations><ModelV";
    let constants = |unit: &str| {
        format!(
            "<ScalarVariable name=\"k1\" valueReference=\"9\" variability=\"constant\"><Real \
             start=\"2\"{unit}/></ScalarVariable><ScalarVariable name=\"k2\" valueReference=\"9\" \
             variability=\"constant\"><Real start=\" 2.0e0 \"{unit}/></ScalarVariable></ModelVariables>"
        )
    };
    for (what, changed) in [
        ("a range wider than the type's", wider),
        ("an item by its number", item),
        (
            "a display unit that is not defined",
            one("<Real unit=\"m\"/>", "<Real unit=\"m\" displayUnit=\"in\"/>"),
        ),
        (
            "blanks and zeros around a number",
            one("valueReference=\"3\"", "valueReference=\" 003 \""),
        ),
        ("minus zero", one("valueReference=\"0\"", "valueReference=\"-0\"")),
        ("anything in an annotation", one("<ModelV", vendor)),
        ("constants of one value", one("</ModelVariables>", &constants(""))),
        ("constants of one value and unit", one("</ModelVariables>", &constants(" unit=\"m\""))),
        ("a unit without base", one("<BaseUnit s=\"1\"/>", "")),
        (
            "where the schema is",
            one(
                "fmiVersion",
                "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
            xsi:noNamespaceSchemaLocation=\"a\" fmiVersion",
            ),
        ),
        ("quotes in a name", one("name=\"z\"", "name=\"a &quot;b&quot; 'c'\"")),
        ("another case of the encoding", one("UTF-8", "utf-8")),
        ("a leap day", one("guid=", "generationDateAndTime=\"2024-02-29T12:00:00Z\" guid=")),
        (
            "both interfaces",
            one("<CoSimulation", "<ModelExchange modelIdentifier=\"unit\"/><CoSimulation"),
        ),
    ] {
        pack(&bench, &changed, &binary);
        let errors = errors(&bench);
        assert!(errors.is_empty(), "{what}: {errors:#?}");
    }
    let listed = one(
        "maxOutputDerivativeOrder=\"1\"/>",
        "><SourceFiles><File name=\"./gc/x.c\"/><File name=\"y.c\"/></SourceFiles></CoSimulation>",
    );
    let files = [
        ("modelDescription.xml", listed.as_bytes()),
        ("sources/gc/x.c", b""),
        ("./sources/y.c", b""),
    ];
    bench.pack("bad.fmu", &files);
    assert_eq!(errors(&bench), []);
}

/// Binaries of macOS and of ARM are looked into as those of others are.
#[test]
fn issue_binaries_of_other_systems_are_known() {
    let bench = Bench::new();
    let all = fmi2_import::library::SYMBOLS;
    let (intel, arm) = (mach_o(X86_64, all), mach_o(ARM64, all));
    let both = universal(&[(X86_64, intel.clone()), (ARM64, arm.clone())]);
    let half = universal(&[(X86_64, intel.clone()), (ARM64, mach_o(ARM64, &all[1..]))]);
    for (folder, bytes, rule) in [
        ("darwin64", &intel, None),
        ("darwin64", &both, None),
        ("aarch64-darwin", &arm, None),
        ("aarch64-darwin", &both, None),
        ("x86_64-darwin", &both, None),
        ("darwin64", &half, Some("symbols")),
        ("darwin64", &arm, Some("binary-format")),
        ("aarch64-darwin", &intel, Some("binary-format")),
        ("darwin32", &both, Some("binary-format")),
    ] {
        let name = format!("binaries/{folder}/unit.dylib");
        let files = [("modelDescription.xml", DESCRIPTION.as_bytes()), (&name, bytes.as_slice())];
        bench.pack("bad.fmu", &files);
        let found: Vec<String> = errors(&bench).into_iter().map(|(rule, _)| rule).collect();
        assert_eq!(found, Vec::from_iter(rule.map(str::to_owned)), "{folder}");
        let (_, findings) = found_in(&bench, "bad.fmu");
        let message = &findings.iter().find(|it| it.rule == "platform").unwrap().message;
        assert!(message.ends_with(&format!("there are binaries for: {folder}")), "{message}");
    }
    let binary = bench.compile(&[]);
    let files = [
        ("modelDescription.xml", DESCRIPTION.as_bytes()),
        ("binaries/aarch64-linux/unit.so", &binary),
    ];
    bench.pack("bad.fmu", &files);
    let found = errors(&bench);
    assert!(found.len() == 1 && found[0].1.contains("must be Elf for Aarch64"), "{found:?}");
}
