//! A scenario that becomes SSP and a scenario again is the same system.
#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::fs;

use master::system::System;
use scenario::Scenario;
use serde_json::{Value, json};
use ssp::SspVersion;
use support::Bench;

/// All that matters of a checked scenario: instances with values, links, and the settings that no instance has.
fn resolved(scenario: &Scenario) -> (Vec<String>, Vec<String>, Value) {
    let system = System::new(scenario).unwrap();
    let instances = system.instances.iter().map(|it| {
        let (parameters, inputs) = (&it.parameters, &it.inputs);
        let mut values: Vec<String> =
            parameters.iter().chain(inputs).map(|it| format!("{it:?}")).collect();
        values.sort();
        let settings =
            (it.isolate, it.steps, it.every, it.tolerance, &it.debug_log, it.input_derivatives);
        format!("{} {} {settings:?} {values:?}", it.name, it.description().guid)
    });
    let links = system.links.iter().map(|it| format!("{it:?}"));
    let mut rest = serde_json::to_value(scenario).unwrap();
    for key in ["$schema", "units", "instances", "connections"] {
        rest.as_object_mut().unwrap().shift_remove(key);
    }
    (instances.collect(), links.collect(), rest)
}

fn scenario(bench: &Bench) -> Scenario {
    bench.write("data/course.csv", "time,u\n0,0\n1,0.5\n");
    bench.write("data/notes.txt", "x");
    let text = json!({
        "title": "all of it",
        "description": "two\nlines, \"quotes\" & <signs>",
        "units": { "u": "u.fmu", "other unit": "u.fmu" },
        "instances": {
            "a_[01..03]": { "unit": "u", "steps": 2, "parameters": { "gain": 0.1, "mode": "on", "count": -3 } },
            "b": {
                "unit": "other unit",
                "parameters": { "file": { "path": "data/notes.txt" }, "on": true, "gain": 1e-300 },
                "start": { "v[1]": -0.30000000000000004 },
                "tolerance": 1e-7
            },
            "c": { "unit": "u", "parameters": { "file": "5" } },
            "d": { "unit": "u" }
        },
        "connections": [
            { "from": ["a_01.y", { "signal": "a_02.y", "factor": 3 }], "to": "b.u", "offset": 0.5, "factor": 2 },
            { "from": "b.y", "to": "a_[01..03].u", "factor": 0.1, "offset": 0.7 },
            { "from": [{ "signal": "a_03.y", "factor": 0.1 }], "to": "c.u", "factor": 0.7, "extrapolation": 1, "kinks": true },
            { "from": ["a_01.y", "a_02.y"], "to": "a_01.v[1]" },
            { "from": "c.y", "to": "a_02.v[1]", "ignore_units": true }
        ],
        "inputs": [{ "to": "d.u", "signal": { "type": "csv", "file": "data/course.csv", "column": "u" } }],
        "events": [{ "name": "e", "at": 0.5, "set": { "d.v[1]": 1.0 } }],
        "experiment": { "start": 0.1, "stop": 1.1, "step": 0.1, "tolerance": 1e-5 },
        "algorithm": { "name": "iterated", "order": ["a_*", "b"], "sizes": { "b.y": 2.5 } },
        "record": { "signals": ["a_[01..03].y", { "signals": ["b.y"], "interval": 0.2 }], "format": ["parquet"] },
        "plots": [{ "file": "x.svg", "panels": [{ "signals": ["a_*.y"] }] }],
        "objectives": { "r": { "signal": "b.y", "figure": "rms" } },
        "limits": { "l": { "signal": "b.y", "figure": "max", "max": 4.0 } },
        "real_time": 2.0
    });
    let mut scenario = Scenario::load(&bench.write("s.json", &text.to_string())).unwrap();
    scenario.overrides.push("a_02.gain=0.7".parse().unwrap());
    scenario
}

#[test]
fn invariant_everything_survives_both_versions() {
    let bench = Bench::new();
    let before = scenario(&bench);
    for version in [SspVersion::V1, SspVersion::V2] {
        let archive = bench.path("s.ssp");
        let exported = ssp::export(&before, version, &archive).unwrap();
        assert_eq!((exported.components, exported.connections), (6, 5));
        let notes = exported.notes.join("\n");
        for part in ["algorithm", "events", "b.u and 1 more inputs have no source"] {
            assert!(notes.contains(part), "{part}: {notes}");
        }
        let folder = bench.path("again");
        let imported = ssp::import(&archive, &folder).unwrap();
        let mut after = Scenario::load(&imported.scenario).unwrap();
        // files have moved with the archive
        let file = |scenario: &Scenario| {
            let text = serde_json::to_value(&scenario.inputs).unwrap();
            text[0]["signal"]["file"].as_str().unwrap().to_owned()
        };
        assert_eq!(fs::read(file(&after)).unwrap(), fs::read(file(&before)).unwrap());
        after.inputs.clone_from(&before.inputs);
        let (mut old, mut new) = (resolved(&before), resolved(&after));
        let notes = |path: &str| bench.path(path).to_string_lossy().into_owned();
        let b = &mut new.0[3];
        assert!(b.contains(&notes("again/resources/notes.txt")), "{b}");
        *b = b.replace(&notes("again/resources/notes.txt"), &notes("data/notes.txt"));
        // the order of values has no meaning
        old.0.iter_mut().chain(&mut new.0).for_each(|it| *it = it.replace("other unit", "u"));
        assert_eq!(old.0, new.0);
        assert_eq!(old.1, new.1);
        assert_eq!(old.2, new.2);
        // and again: the same text
        let second = bench.path("s2/s.ssp");
        ssp::export(&after, version, &second).unwrap();
        let text = |path| {
            let mut zip = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
            std::io::read_to_string(zip.by_name("SystemStructure.ssd").unwrap()).unwrap()
        };
        assert_eq!(text(&archive), text(&second));
        assert_eq!(text(&archive).contains("Float64"), version == SspVersion::V2);
    }
}

#[test]
fn refusal_what_has_no_place_in_an_archive() {
    let bench = Bench::new();
    let mut scenario = scenario(&bench);
    fs::remove_file(bench.path("data/course.csv")).unwrap();
    let archive = bench.path("s.ssp");
    let error = ssp::export(&scenario, SspVersion::V1, &archive).unwrap_err().to_string();
    assert!(error.contains("inputs[0]") && error.contains("is not a file"), "{error}");
    scenario.inputs.clear();
    let file = scenario.instances["b"].parameters["file"].clone();
    scenario.events[0].set.insert("b.file".to_owned(), file);
    let error = ssp::export(&scenario, SspVersion::V1, &archive).unwrap_err().to_string();
    assert!(error.contains("the event \"e\"") && error.contains("path of a file"), "{error}");
    scenario.events.clear();
    scenario.overrides.push("a_02.none=1".parse().unwrap());
    let error = support::chain(&ssp::export(&scenario, SspVersion::V1, &archive).unwrap_err());
    assert!(error.contains("none"), "{error}");
    assert!(!archive.exists());
}
