//! Reports at the end of runs, `maglev report`, and the scenario as it ran.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;

use serde_json::{Value, json};
use support::{Bench, ring};

/// Three units behind each other, two of them of one entry.
fn row() -> Value {
    let mut scenario = ring();
    scenario["instances"] = json!({
        "a": { "unit": "unit", "start": { "u": 1.0 } },
        "m_[1..2]": { "unit": "unit", "parameters": { "gain": 2.0 } }
    });
    scenario["connections"] = json!([{ "from": "a.y", "to": ["m_1.u", "m_2.u"] }]);
    scenario["record"]["signals"] = json!(["m_[1..2].z", "a.y"]);
    scenario["plots"] = json!([{ "file": "p.svg", "panels": [{ "signals": ["m_*.z"] }] }]);
    scenario
}

/// scenario-as-run.json has the changes of the command line in it: run alone it gives the same bytes.
#[test]
fn invariant_the_scenario_as_run_repeats_the_run() {
    let bench = Bench::new();
    bench.scenario(&row());
    let changes = ["--set", "m_2.gain=3", "--set", "a.u=2", "--step", "0.05", "--stop", "0.8"];
    bench.run(&changes).succeeds();
    let results = bench.result("results.csv");
    let ran: Value = serde_json::from_str(&bench.result("scenario-as-run.json")).unwrap();
    assert_eq!(ran["instances"]["m_2"]["parameters"]["gain"], 3.0);
    assert_eq!(ran["instances"]["m_1"]["parameters"]["gain"], 2.0);
    assert_eq!(ran["instances"]["a"]["start"]["u"], 2.0);
    assert!(ran["units"]["unit"].as_str().unwrap().starts_with('/'));
    let again = ["run", "out/scenario-as-run.json", "--out", "elsewhere/again"];
    bench.maglev(&again).succeeds();
    let repeated = fs::read_to_string(bench.path("elsewhere/again/results.csv")).unwrap();
    assert!(results == repeated);
    // what is the same for all of an entry leaves it one entry
    bench.run(&["--set", "m_*.gain=3"]).succeeds();
    let ran: Value = serde_json::from_str(&bench.result("scenario-as-run.json")).unwrap();
    assert_eq!(ran["instances"]["m_[1..2]"]["parameters"]["gain"], 3.0);
}

#[test]
fn issue_a_run_ends_with_its_report() {
    let bench = Bench::new();
    bench.scenario(&row());
    let report = bench.path("out/report.html");
    bench.run(&["--no-report"]).succeeds();
    assert!(!report.exists());
    let ran = bench.run(&[]);
    ran.succeeds();
    assert!(ran.stdout().contains("out/report.html") && report.exists());
    fs::remove_file(&report).unwrap();
    let ran = bench.run(&["--quiet"]);
    ran.succeeds();
    assert!(ran.stdout().is_empty() && report.exists());
    // a failed run has one, too, with the error in it
    fs::remove_file(&report).unwrap();
    bench
        .run(&["--set", "m_2.fault=4", "--set", "m_2.fail_time=0.55"])
        .fails(1, &["out/report.html"]);
    assert!(bench.result("report.html").contains("the model broke"));
    // a report that cannot be made is no failed run
    fs::remove_file(&report).unwrap();
    fs::create_dir(&report).unwrap();
    let ran = bench.run(&[]);
    ran.succeeds();
    assert!(ran.stderr().contains("warning: cannot make the report"), "{}", ran.stderr());
}

#[test]
fn issue_reports_are_equal_byte_for_byte_and_take_several_folders() {
    let bench = Bench::new();
    bench.scenario(&row());
    bench.run(&[]).succeeds();
    let read = |name: &str| fs::read(bench.path(name)).unwrap();
    bench.maglev(&["report", "out", "--out", "one.html"]).succeeds();
    bench.maglev(&["report", "out", "--out", "two.html"]).succeeds();
    assert!(read("one.html") == read("two.html"));
    fs::rename(bench.path("out"), bench.path("other")).unwrap();
    bench.run(&[]).succeeds();
    let ran = bench.maglev(&["report", "other", "out"]);
    ran.succeeds();
    assert_eq!(ran.stdout().trim(), "other/report.html");
    // a table as Parquet only
    bench.run(&["--format", "parquet", "--no-report"]).succeeds();
    bench.maglev(&["report", "out"]).succeeds();
    assert!(bench.result("report.html").contains("m_2.z"));
    bench
        .maglev(&["report", "nowhere"])
        .fails(2, &["nowhere is not a results folder", "maglev run"]);
    fs::write(bench.path("out/summary.json"), "{").unwrap();
    bench.maglev(&["report", "out"]).fails(2, &["out/summary.json is damaged", "line 1"]);
    bench.maglev(&["report", "--modes", "nowhere"]).fails(2, &["nowhere is not a results folder"]);
    bench.maglev(&["report"]).fails(2, &["Usage: maglev report"]);
}

/// Figures for papers: their options, and what is refused.
#[test]
fn issue_figures_take_size_limits_axes_and_titles() {
    let bench = Bench::new();
    bench.scenario(&row());
    bench.run(&["--no-report"]).succeeds();
    let figure = |options: &[&str]| {
        let command = ["report", "out", "--format", "svg"];
        bench.maglev(&[command.as_slice(), options].concat()).succeeds();
        bench.result("figures/p.svg")
    };
    assert!(figure(&["--size", "90x60"]).contains("width=\"340\" height=\"227\""));
    assert!(figure(&["--title", "My <title>"]).contains("My &lt;title&gt;"));
    let svg = figure(&["--no-title", "--time", "0.2..0.4", "--values", "-3..7"]);
    assert!(svg.contains("0.20") && svg.contains("0.40") && !svg.contains("0.50"), "{svg}");
    for (options, causes) in [
        (vec!["--size", "90x60"], vec!["--size is an option of figures", "--format svg"]),
        (vec!["--format", "svg", "--size", "90"], vec!["such as 90x60"]),
        (vec!["--format", "svg", "--size", "5x60"], vec!["20 to 2000 mm"]),
        (vec!["--format", "svg", "--time", "3..2"], vec!["not below"]),
        (vec!["--format", "svg", "--frequency", "3"], vec!["two numbers, such as 2..5.5"]),
        (vec!["--format", "svg", "--values", "y=a..2"], vec!["two numbers"]),
        (vec!["--format", "svg", "--log", "time"], vec!["frequency", "amplitude"]),
        (vec!["--format", "svg", "--title", "a", "--no-title"], vec!["cannot be used with"]),
    ] {
        let command = ["report", "out"];
        bench.maglev(&[command.as_slice(), options.as_slice()].concat()).fails(2, &causes);
    }
}

/// The title is that of the scenario only as long as nothing was changed.
#[test]
fn issue_the_title_is_that_of_what_ran() {
    let bench = Bench::new();
    let mut scenario = row();
    scenario["title"] = json!("Three units");
    bench.scenario(&scenario);
    bench.run(&[]).succeeds();
    assert!(bench.result("report.html").contains("<title>Three units</title>"));
    bench.run(&["--set", "m_2.gain=3"]).succeeds();
    let page = bench.result("report.html");
    assert!(page.contains("<title>Three units, changed</title>") && page.contains("m_2.gain=3"));
    bench.maglev(&["report", "out", "--title", "Mine"]).succeeds();
    assert!(bench.result("report.html").contains("<title>Mine</title>"));
}
