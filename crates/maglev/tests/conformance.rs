//! `maglev validate --dynamic`: the sound unit passes every check, and every check finds the unit
//! that is broken for it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;
use support::Bench;

const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="lag" guid="conformance-unit">
  <CoSimulation modelIdentifier="unit" canHandleVariableCommunicationStepSize="true"
    canInterpolateInputs="true" maxOutputDerivativeOrder="1" canGetAndSetFMUstate="true"
    canSerializeFMUstate="true" providesDirectionalDerivative="true"/>
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output">
      <Real min="-100" max="100"/></ScalarVariable>
    <ScalarVariable name="z" valueReference="2" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="x0" valueReference="3" causality="parameter" variability="fixed">
      <Real start="0.5"/></ScalarVariable>
    <ScalarVariable name="p" valueReference="4" causality="parameter" variability="fixed">
      <Real start="3"/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="5" causality="parameter" variability="tunable">
      <Real start="2"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="6" variability="constant"><Real start="42"/>
      </ScalarVariable>
    <ScalarVariable name="t" valueReference="7" causality="independent"><Real/></ScalarVariable>
    <ScalarVariable name="n" valueReference="0" causality="input" variability="discrete">
      <Integer start="0"/></ScalarVariable>
    <ScalarVariable name="m" valueReference="1" causality="output" variability="discrete">
      <Integer/></ScalarVariable>
    <ScalarVariable name="b" valueReference="0" causality="input" variability="discrete">
      <Boolean start="false"/></ScalarVariable>
    <ScalarVariable name="c" valueReference="1" causality="output" variability="discrete">
      <Boolean/></ScalarVariable>
    <ScalarVariable name="s" valueReference="0" causality="input" variability="discrete">
      <String start="start"/></ScalarVariable>
    <ScalarVariable name="r" valueReference="1" causality="output" variability="discrete">
      <String/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="2" dependencies=""/>
      <Unknown index="3" dependencies="1"/>
      <Unknown index="10" dependencies="9"/>
      <Unknown index="12" dependencies="11"/>
      <Unknown index="14" dependencies="13"/>
    </Outputs>
    <InitialUnknowns>
      <Unknown index="2" dependencies="4"/>
      <Unknown index="3" dependencies="1 4 6"/>
      <Unknown index="10" dependencies="9"/>
      <Unknown index="12" dependencies="11"/>
      <Unknown index="14" dependencies="13"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;

/// The fault of conformance.c for each check.
const FAULTS: &[(&str, &str)] = &[
    ("load", "LOAD"),
    ("run", "RUN"),
    ("outputs-finite", "FINITE"),
    ("repeatable", "REPEATABLE"),
    ("free-any-time", "FREE_ANY_TIME"),
    ("free-null", "FREE_NULL"),
    ("terminate-twice", "TERMINATE_TWICE"),
    ("reset", "RESET"),
    ("start-time", "START_TIME"),
    ("order-allowed", "ORDER_ALLOWED"),
    ("order-forbidden", "ORDER_FORBIDDEN"),
    ("after-error", "AFTER_ERROR"),
    ("zero-length", "ZERO_LENGTH"),
    ("null-arguments", "NULL_ARGUMENTS"),
    ("wrong-reference", "WRONG_REFERENCE"),
    ("set-read-only", "READ_ONLY"),
    ("set-calculated", "CALCULATED"),
    ("set-fixed-late", "FIXED_LATE"),
    ("guid-wrong", "GUID_WRONG"),
    ("name-null", "NAME_NULL"),
    ("model-exchange", "MODEL_EXCHANGE"),
    ("status-kinds", "STATUS_KINDS"),
    ("start-values", "START_VALUES"),
    ("set-then-get", "SET_THEN_GET"),
    ("strings", "STRINGS"),
    ("booleans", "BOOLEANS"),
    ("value-range", "VALUE_RANGE"),
    ("independent", "INDEPENDENT"),
    ("dependencies", "DEPENDENCIES"),
    ("location-forms", "LOCATION_FORMS"),
    ("location-odd", "LOCATION_ODD"),
    ("logger-caller", "LOGGER_CALLER"),
    ("logger-category", "LOGGER_CATEGORY"),
    ("logger-off", "LOGGER_OFF"),
    ("logger-format", "LOGGER_FORMAT"),
    ("logger-error", "LOGGER_ERROR"),
    ("logger-control", "LOGGER_CONTROL"),
    ("silent", "SILENT"),
    ("process-state", "PROCESS_STATE"),
    ("memory-instances", "MEMORY_INSTANCES"),
    ("memory-steps", "MEMORY_STEPS"),
    ("memory-states", "MEMORY_STATES"),
    ("many-instances", "MANY_INSTANCES"),
    ("threads", "THREADS"),
    ("step-varying", "STEP_VARYING"),
    ("step-extreme", "STEP_EXTREME"),
    ("step-split", "STEP_SPLIT"),
    ("step-rounded", "STEP_ROUNDED"),
    ("step-invalid", "STEP_INVALID"),
    ("step-not-finite", "STEP_NOT_FINITE"),
    ("step-elsewhere", "STEP_ELSEWHERE"),
    ("step-past-stop", "STEP_PAST_STOP"),
    ("inputs-extreme", "INPUTS_EXTREME"),
    ("state-restored", "STATE_RESTORED"),
    ("state-inputs", "STATE_INPUTS"),
    ("state-independent", "STATE_INDEPENDENT"),
    ("state-memory", "STATE_MEMORY"),
    ("serialized", "SERIALIZED"),
    ("serialized-process", "SERIALIZED_PROCESS"),
    ("serialized-damaged", "SERIALIZED_DAMAGED"),
    ("input-derivatives", "INPUT_DERIVATIVES"),
    ("input-derivatives-wrong", "INPUT_DERIVATIVES_WRONG"),
    ("output-derivatives", "OUTPUT_DERIVATIVES"),
    ("directional-derivatives", "DIRECTIONAL"),
];

/// Packs conformance.c with a fault.
fn pack(bench: &Bench, name: &str, fault: &str) {
    let define = format!("-DFAULT={fault}");
    let mut defines = vec![define.as_str()];
    if fault == "LOAD" {
        defines.push("-DWITHOUT_PLATFORM");
    }
    bench.source(name, "conformance.c", DESCRIPTION, &defines);
}

/// Runs checks; hanging ones end after two seconds.
fn report(bench: &Bench, unit: &str, only: &[&str]) -> (i32, Value) {
    let mut arguments = vec!["validate", "--dynamic", unit, "--json", "--time-limit", "2"];
    for id in only {
        arguments.extend(["--only", id]);
    }
    let ran = bench.maglev(&arguments);
    let report = serde_json::from_str(&ran.stdout()).unwrap_or_else(|error| {
        panic!("{error}: {}{}", ran.stdout(), ran.stderr());
    });
    (ran.status(), report)
}

fn findings(report: &Value) -> Vec<&Value> {
    let checks = report["checks"].as_array().unwrap();
    checks.iter().flat_map(|check| check["findings"].as_array().unwrap()).collect()
}

/// A unit that keeps the standard has no finding, and nothing of it is left out.
#[test]
fn invariant_the_sound_unit_passes_every_check() {
    let bench = Bench::new();
    pack(&bench, "sound.fmu", "SOUND");
    bench.maglev(&["validate", "sound.fmu"]).succeeds();
    let ran = bench.maglev(&["validate", "--dynamic", "sound.fmu"]);
    let count = fmi2_conformance::checks().count();
    let total = format!("0 errors, 0 warnings, 0 notes from {count} checks, 0 skipped");
    assert!(ran.stdout().ends_with(&format!("sound.fmu: {total}\n")), "{}", ran.stdout());
    ran.succeeds();
}

/// For every check there is a unit that breaks it, and the check says so with the calls.
#[test]
fn issue_every_check_can_fail() {
    let bench = Bench::new();
    let mut silent = Vec::new();
    for check in fmi2_conformance::checks() {
        let fault = FAULTS.iter().find(|(id, _)| *id == check.id);
        let Some((id, fault)) = fault else {
            silent.push(format!("{} has no broken unit", check.id));
            continue;
        };
        pack(&bench, "broken.fmu", fault);
        let (status, report) = report(&bench, "broken.fmu", &[id]);
        let found = findings(&report);
        if found.is_empty() {
            silent.push(format!("{id} finds nothing: {report}"));
        }
        let error = found.iter().any(|finding| finding["severity"] == "error");
        assert_eq!(status, i32::from(error), "{id}: {report}");
    }
    assert!(silent.is_empty(), "{}", silent.join("\n"));
    let ids: BTreeSet<&str> = fmi2_conformance::checks().map(|check| check.id).collect();
    assert_eq!(ids.len(), fmi2_conformance::checks().count(), "two checks have one name");
    assert_eq!(ids.len(), FAULTS.len(), "a fault belongs to no check");
}

/// A crash, a hang and an exit are findings with the calls before them; the other checks go on.
#[test]
fn issue_the_suite_survives_the_unit() {
    let bench = Bench::new();
    for (fault, text) in
        [("CRASH", "signal"), ("HANG", "did not end within 2 s"), ("EXIT", "ended the process")]
    {
        pack(&bench, "broken.fmu", fault);
        let (status, report) =
            report(&bench, "broken.fmu", &["run", "free-any-time", "guid-wrong"]);
        assert_eq!(status, 1);
        let checks = report["checks"].as_array().unwrap();
        assert_eq!(checks.len(), 3, "{report}");
        let finding = &checks[0]["findings"][0];
        let message = finding["message"].as_str().unwrap();
        assert!(message.contains(text), "{message}");
        let calls = finding["calls"].as_array().unwrap();
        assert!(calls.last().unwrap().as_str().unwrap().contains("fmi2DoStep"), "{report}");
        assert_eq!(checks[2]["findings"].as_array().unwrap().len(), 0, "{report}");
    }
}

/// What the command says about itself and about wrong use.
#[test]
fn issue_validate_dynamic_refuses_bad_usage_with_help() {
    let bench = Bench::new();
    pack(&bench, "sound.fmu", "SOUND");
    bench.maglev(&["validate", "--dynamic", "nothing.fmu"]).fails(2, &["nothing.fmu"]);
    let wrong = bench.maglev(&["validate", "--dynamic", "sound.fmu", "--only", "rest"]);
    wrong.fails(2, &["no check \"rest\"", "reset"]);
    assert_eq!(bench.maglev(&["validate", "--only", "reset", "sound.fmu"]).status(), 2);
    let list = bench.maglev(&["validate", "--dynamic", "--rules"]).stdout();
    assert!(fmi2_conformance::checks().all(|check| list.contains(check.expects)));
}

/// docs/conformance.md has the tables that the command prints.
#[test]
fn golden_the_documentation_lists_all_rules_and_checks() {
    let bench = Bench::new();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/conformance.md");
    let page = fs::read_to_string(path).unwrap();
    for arguments in [vec!["validate", "--rules"], vec!["validate", "--dynamic", "--rules"]] {
        let table = bench.maglev(&arguments).stdout();
        let command = arguments.join(" ");
        assert!(page.contains(&table), "docs/conformance.md: put in what maglev {command} prints");
    }
}
