//! Units with other resources: `maglev derive`, and `resources` in scenarios.

#![allow(clippy::unwrap_used, reason = "a test program")]
#![cfg(unix)]

mod support;

use std::fs;
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use fmi2_import::package::{BINARY_EXTENSION, PLATFORM, Package};
use serde_json::{Value, json};
use support::{Bench, DESCRIPTION};

const LAYOUT: &str =
    r#"{"title": "t", "items": [{"name": "a", "gain": 1.5}, {"name": "b", "gain": 2.5}]}"#;

/// The description that layout.c prints for `LAYOUT`.
const PRINTED: &str = r#"<fmiModelDescription fmiVersion="2.0" modelName="layout 4" guid="layout-4" generationTool="fmi2-export test">
  <CoSimulation modelIdentifier="unit" canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>
  <DefaultExperiment startTime="0" stopTime="4" stepSize="0.5"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="z" valueReference="2" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="4" causality="parameter" variability="tunable"><Real start="4"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies="1"/></Outputs><InitialUnknowns><Unknown index="2" dependencies="1 3"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>"#;

/// A bench with `layout.fmu` and files that change it.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.source("bare.fmu", "layout.c", PRINTED, &["-DMAX_INPUT_ORDER=3"]);
    let library = Package::open(&bench.path("bare.fmu")).unwrap();
    let library = fs::read(library.binary()).unwrap();
    bench.pack(
        "layout.fmu",
        &[
            ("modelDescription.xml", PRINTED.as_bytes()),
            (&format!("binaries/{PLATFORM}/unit.{BINARY_EXTENSION}"), &library),
            ("binaries/other64/unit.so", b"for another system"),
            ("resources/layout.json", LAYOUT.as_bytes()),
            ("resources/keep.csv", b"1,2\n"),
            ("documentation/licenses/license.txt", b"free"),
            ("documentation/index.html", b"<h1>not made by fmi2-package</h1>"),
            ("model.png", b"a picture of the old layout"),
            ("extra/org.fmi-standard.fmi-ls-ref/x_ref.csv", b"old results"),
        ],
    );
    for (name, text) in [
        ("mine.json", r#"{"items": [{"name": "c", "gain": 7}]}"#),
        ("patch.json", r#"{"items": {"a": null, "b": {"gain": 8.5}}}"#),
        ("negative.json", r#"{"items": {"b": {"gain": -1}, "bb": {"gain": 1}}}"#),
        ("unknown.json", r#"{"items": {"bb": null}}"#),
        ("list.json", "[1]"),
        ("cut.json", r#"{"items": "#),
        ("track.csv", "0,1\n"),
    ] {
        fs::write(bench.path(name), text).unwrap();
    }
    bench
}

/// A scenario in which z is the sum of the gains in the layout.
fn scenario(unit: &Value) -> Value {
    json!({
        "units": { "l": unit },
        "instances": { "l": { "unit": "l", "start": { "u": 1.0 } } },
        "experiment": { "stop": 1.0, "step": 0.25 },
        "record": { "signals": ["l.z"] }
    })
}

/// z at the end of the last run.
fn last(bench: &Bench) -> f64 {
    *bench.rows().last().unwrap().last().unwrap()
}

fn entries(bench: &Bench, name: &str) -> Vec<String> {
    let mut files = Package::open(&bench.path(name)).unwrap().files().to_vec();
    files.sort();
    files
}

#[test]
fn invariant_a_derived_unit_keeps_what_holds_and_drops_the_rest() {
    let bench = bench();
    let ran = bench.maglev(&[
        "derive",
        "layout.fmu",
        "--resource",
        "layout.json=mine.json",
        "--resource",
        "track.csv=track.csv",
        "--out",
        "new.fmu",
    ]);
    ran.succeeds();
    for part in [
        "new.fmu: layout 7, 3 variables",
        "replaced in resources: layout.json",
        "added in resources: track.csv",
        "left out, because valid for layout.fmu only: model.png, reference results",
    ] {
        assert!(ran.stdout().contains(part), "{}", ran.stdout());
    }
    let library = format!("binaries/{PLATFORM}/unit.{BINARY_EXTENSION}");
    let mut expected = vec![
        library.as_str(),
        "binaries/other64/unit.so",
        "documentation/index.html",
        "documentation/licenses/license.txt",
        "modelDescription.xml",
        "resources/keep.csv",
        "resources/layout.json",
        "resources/track.csv",
    ];
    expected.sort_unstable();
    assert_eq!(entries(&bench, "new.fmu"), expected);
    let package = Package::open(&bench.path("new.fmu")).unwrap();
    assert_eq!(package.description().guid, "layout-7");
    let read = |name: &str| fs::read_to_string(package.resources().join(name)).unwrap();
    assert_eq!(read("layout.json"), fs::read_to_string(bench.path("mine.json")).unwrap());
    assert_eq!(read("track.csv"), "0,1\n");
    // the original is not changed
    let original = Package::open(&bench.path("layout.fmu")).unwrap();
    assert_eq!(original.description().guid, "layout-4");
}

#[test]
fn analytic_a_derived_unit_computes_with_its_layout() {
    let bench = bench();
    for (option, file, sum) in [("--resource", "mine.json", 7.0), ("--patch", "patch.json", 8.5)] {
        let change = format!("layout.json={file}");
        bench.maglev(&["derive", "layout.fmu", option, &change, "--out", "new.fmu"]).succeeds();
        bench.maglev(&["inspect", "new.fmu"]).succeeds();
        bench.scenario(&scenario(&json!("new.fmu")));
        bench.run(&["--no-report"]).succeeds();
        assert_eq!(last(&bench), sum);
    }
    // a patch follows the file that replaces the resource, whatever the order of the options
    bench
        .maglev(&[
            "derive",
            "new.fmu",
            "--patch",
            "layout.json=patch.json",
            "--resource",
            "layout.json=mine.json",
            "--out",
            "both.fmu",
        ])
        .fails(2, &["patch of resource layout.json: at items.a: unknown name `a`"]);
}

#[test]
fn refusal_of_derive_leaves_no_file() {
    let bench = bench();
    bench.unit("plain.fmu", DESCRIPTION, &[]);
    let other = PRINTED.replace("modelIdentifier=\"unit\"", "modelIdentifier=\"elsewhere\"");
    bench.pack(
        "elsewhere.fmu",
        &[("modelDescription.xml", other.as_bytes()), ("binaries/other64/elsewhere.so", b"x")],
    );
    // it says that it is made with fmi2-export, but is not
    bench.unit("silent.fmu", &DESCRIPTION.replace("\"hand\"", "\"fmi2-export 9\""), &[]);
    for (arguments, parts) in [
        (
            vec!["layout.fmu", "--patch", "layout.json=negative.json"],
            vec![
                "layout.fmu does not accept the resources",
                "resource layout.json: at items[1].gain",
                "the patch adds items.bb",
                "help: correct the patch",
            ],
        ),
        (
            vec!["layout.fmu", "--patch", "layout.json=unknown.json"],
            vec!["at items.bb: unknown name `bb`; did you mean `b`?"],
        ),
        (
            vec!["layout.fmu", "--patch", "layout.json=list.json"],
            vec!["list.json is not a patch: it is not an object"],
        ),
        (
            vec!["layout.fmu", "--patch", "layout.json=cut.json"],
            vec!["cut.json is not a patch", "EOF"],
        ),
        (
            vec!["layout.fmu", "--patch", "layuot.json=patch.json"],
            vec!["no resource layuot.json", "did you mean layout.json?"],
        ),
        (vec!["layout.fmu", "--patch", "keep.csv=patch.json"], vec!["keep.csv cannot be patched"]),
        (
            vec!["layout.fmu", "--resource", "layuot.json=mine.json"],
            vec!["does not read the new resource layuot.json; did you mean layout.json?"],
        ),
        (
            vec!["layout.fmu", "--resource", "../layout.json=mine.json"],
            vec!["inside of the unit's resources"],
        ),
        (
            vec!["layout.fmu", "--resource", "layout.json=nowhere.json"],
            vec!["cannot read nowhere.json", "No such file"],
        ),
        (
            vec!["layout.fmu", "--resource", "LAYOUT.JSON=mine.json"],
            vec!["beside the unit's layout.json", "differ only in case", "help: give the name"],
        ),
        (
            vec!["layout.fmu", "--resource", "layout.json/x=mine.json"],
            vec!["beside the unit's layout.json", "one is a folder"],
        ),
        (
            vec!["layout.fmu", "--resource", "layout.json=."],
            vec!["cannot read .", "not a regular file", "help: write the resource to a file"],
        ),
        (vec!["layout.fmu", "--resource", "layout.json"], vec!["expected NAME=FILE"]),
        (vec!["layout.fmu"], vec!["--resource <NAME=FILE>"]),
        (
            vec!["nowhere.fmu", "--resource", "layout.json=mine.json"],
            vec!["nowhere.fmu", "No such file"],
        ),
        (
            vec!["plain.fmu", "--resource", "layout.json=mine.json"],
            vec![
                "plain.fmu was exported by hand, not by fmi2-export",
                "help: change the resources in the tool",
            ],
        ),
        (
            vec!["elsewhere.fmu", "--resource", "layout.json=mine.json"],
            vec!["no binary for", "it has binaries for other64"],
        ),
        (
            vec!["silent.fmu", "--resource", "layout.json=mine.json"],
            vec!["cannot print the new description", "fmi2_export_describe"],
        ),
    ] {
        let all: Vec<&str> =
            ["derive"].into_iter().chain(arguments).chain(["--out", "new.fmu"]).collect();
        bench.maglev(&all).fails(2, &parts);
        let left = fs::read_dir(bench.path("")).unwrap().map(|entry| entry.unwrap().file_name());
        let left: Vec<_> = left.filter(|name| name.to_string_lossy().contains("new.fmu")).collect();
        assert!(left.is_empty(), "{left:?}");
    }
    let before = fs::read(bench.path("layout.fmu")).unwrap();
    let over =
        ["derive", "layout.fmu", "--patch", "layout.json=patch.json", "--out", "./layout.fmu"];
    bench.maglev(&over).fails(2, &["layout.fmu cannot be replaced by a unit that is made of it"]);
    assert!(fs::read(bench.path("layout.fmu")).unwrap() == before);
    fs::create_dir(bench.path("folder.fmu")).unwrap();
    let folder =
        ["derive", "layout.fmu", "--patch", "layout.json=patch.json", "--out", "folder.fmu"];
    bench.maglev(&folder).fails(1, &["cannot write folder.fmu", "it is a folder"]);
    assert!(!bench.path("folder.fmu.partial").exists());
}

/// As a device, a socket is neither file nor folder.
#[test]
fn issue_a_derived_unit_replaces_regular_files_only() {
    let bench = bench();
    let socket = bench.path("socket");
    let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    std::os::unix::fs::symlink(&socket, bench.path("link")).unwrap();
    for out in ["socket", "link"] {
        let all = ["derive", "layout.fmu", "--patch", "layout.json=patch.json", "--out", out];
        bench.maglev(&all).fails(1, &[&format!("cannot write {out}"), "not a regular file"]);
    }
    let kind = fs::symlink_metadata(&socket).unwrap().file_type();
    assert!(std::os::unix::fs::FileTypeExt::is_socket(&kind));
}

#[test]
fn invariant_a_scenario_with_resources_computes_what_the_derived_unit_does() {
    let bench = bench();
    for (resources, sum) in [
        (json!({ "layout.json": "mine.json" }), 7.0),
        (
            json!({ "layout.json": { "items": { "*": { "gain": 0.25 } } }, "track.csv": "track.csv" }),
            0.5,
        ),
        (json!({ "layout.json": ["mine.json", { "items": [{ "name": "d", "gain": 1 }] }] }), 8.0),
    ] {
        bench.scenario(&scenario(&json!({ "fmu": "layout.fmu", "resources": resources })));
        bench.run(&["--no-report"]).succeeds();
        assert_eq!(last(&bench), sum);
        let unit = &bench.summary()["units"]["l"];
        assert_eq!(unit["model"], format!("layout {sum}"));
        assert_eq!(unit["guid"], format!("layout-{sum}"));
        assert_eq!(
            unit["resources"].as_array().unwrap().len(),
            resources.as_object().unwrap().len()
        );
        // what the folder records runs again, from anywhere, to the same bytes
        let first = bench.result("results.csv");
        fs::create_dir_all(bench.path("elsewhere")).unwrap();
        fs::rename(bench.path("out/scenario-as-run.json"), bench.path("elsewhere/again.json"))
            .unwrap();
        bench.maglev(&["run", "elsewhere/again.json", "--out", "out", "--no-report"]).succeeds();
        assert_eq!(bench.result("results.csv"), first);
    }
    let isolated = ["--isolate", "--strict", "--no-report"];
    bench.run(&isolated).succeeds();
    assert_eq!(last(&bench), 8.0);
}

/// Each key in `units` is a unit of its own, although both come from one file.
#[test]
fn issue_two_layouts_of_one_file_run_together() {
    let bench = bench();
    let unit = |gain: f64| json!({ "fmu": "layout.fmu", "resources": { "layout.json": { "items": { "a": { "gain": gain } } } } });
    let mut both = scenario(&unit(10.0));
    both["units"]["m"] = unit(20.0);
    both["units"]["plain"] = json!("layout.fmu");
    for name in ["m", "plain"] {
        both["instances"][name] = json!({ "unit": name, "start": { "u": 1.0 } });
    }
    both["record"]["signals"] = json!(["l.z", "m.z", "plain.z"]);
    bench.scenario(&both);
    bench.run(&["--no-report"]).succeeds();
    assert_eq!(bench.rows().last().unwrap()[1..], [12.5, 22.5, 4.0]);
    let summary = bench.summary();
    let of = |name: &str| [&summary["instances"][name]["unit"], &summary["units"][name]["guid"]];
    assert_eq!(of("l"), ["l", "layout-12.5"]);
    assert_eq!(of("m"), ["m", "layout-22.5"]);
    assert_eq!(of("plain"), ["plain", "layout-4"]);
    assert!(summary["units"]["plain"].get("resources").is_none());
}

/// Times that are left out come from the description of the changed unit.
#[test]
fn analytic_the_experiment_is_completed_from_the_changed_unit() {
    let bench = bench();
    let unit = json!({ "fmu": "layout.fmu", "resources": { "layout.json": "mine.json" } });
    let mut open = scenario(&unit);
    open["experiment"] = json!({ "step": 0.5 });
    bench.scenario(&open);
    bench.run(&["--no-report"]).succeeds();
    assert_eq!(bench.rows().last().unwrap()[0], 7.0);
}

#[test]
fn issue_a_run_resumes_with_its_resources_or_not_at_all() {
    let bench = bench();
    let unit = json!({ "fmu": "layout.fmu", "resources": { "layout.json": "mine.json", "track.csv": "track.csv" } });
    let mut long = scenario(&unit);
    long["experiment"] = json!({ "stop": 40.0, "step": 0.25 });
    bench.scenario(&long);
    let order = ["--no-report", "--checkpoint-every", "10", "--quiet"];
    bench.run(&order).succeeds();
    let whole = bench.result("results.csv");
    // a checkpoint remains after an interruption only
    let stop = |bench: &Bench| {
        let run = "run scenario.json --out out --no-report --quiet --checkpoint-every 0.25 --real-time 20";
        let mut run = bench.start(&run.split(' ').collect::<Vec<_>>());
        while !bench.path("out/checkpoint.bin").exists() {
            assert!(run.try_wait().unwrap().is_none(), "the run ended without a checkpoint");
            sleep(Duration::from_millis(10));
        }
        let killed = Command::new("kill").args(["-TERM", &run.id().to_string()]).status();
        assert!(killed.unwrap().success());
        run.wait().unwrap();
        assert!(bench.path("out/checkpoint.bin").exists());
    };
    stop(&bench);
    bench.maglev(&["resume", "out", "--quiet"]).succeeds();
    assert_eq!(bench.result("results.csv"), whole);
    // the unit does not read the track before it is instantiated, so its GUID does not depend on it
    for (file, text, what) in [
        ("track.csv", "0,2\n", "the content differs"),
        ("mine.json", r#"{"items": []}"#, "the GUID differs"),
    ] {
        stop(&bench);
        let old = fs::read(bench.path(file)).unwrap();
        fs::write(bench.path(file), text).unwrap();
        bench.maglev(&["resume", "out"]).fails(2, &["unit l", "has changed", what]);
        fs::write(bench.path(file), old).unwrap();
        bench.maglev(&["resume", "out", "--quiet"]).succeeds();
    }
}

#[test]
fn refusal_of_resources_names_the_unit_of_the_scenario() {
    let bench = bench();
    for (unit, parts) in [
        (
            json!({ "fmu": "layout.fmu", "resources": { "layout.json": { "items": { "a": { "gain": -2 } } } } }),
            ["units.l: cannot use this unit", "at items[0].gain: it is negative"],
        ),
        (
            json!({ "fmu": "layout.fmu", "resources": { "layuot.json": {} } }),
            ["units.l", "did you mean layout.json?"],
        ),
        (
            json!({ "fmu": "layout.fmu", "resources": { "layout.json": "nowhere.json" } }),
            ["units.l", "nowhere.json"],
        ),
        (
            json!({ "fmu": "unit.fmu", "resources": { "layout.json": "mine.json" } }),
            ["units.l", "not by fmi2-export"],
        ),
        (
            json!({ "fmu": "nowhere.fmu", "resources": { "layout.json": "mine.json" } }),
            ["units.l", "help: check the path"],
        ),
        (
            json!({ "fmu": "layout.fmu", "resource": {} }),
            ["at units.l.resource", "did you mean `resources`?"],
        ),
        (json!({ "resources": {} }), ["at units.l", "missing field `fmu`"]),
        (
            json!({ "fmu": "layout.fmu", "resources": { "layout.json": 3 } }),
            ["at units.l.resources.layout.json", "expected the path of a file, an object"],
        ),
        (json!(3), ["at units.l", "expected the path of a .fmu file, or an object"]),
    ] {
        bench.scenario(&scenario(&unit));
        bench.run(&[]).fails(2, &parts);
        assert!(!bench.path("out").exists());
    }
}
