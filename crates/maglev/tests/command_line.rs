//! The command line itself: help, version, completions, manual pages, suggestions, output for scripts.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use support::{Bench, ring};

/// The subcommands that the help lists.
fn subcommands(bench: &Bench) -> Vec<String> {
    let help = bench.maglev(&["--help"]).stdout();
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.map(|line| line.split_whitespace().next().unwrap().to_owned());
    names.filter(|name| name != "help").collect()
}

/// One line for a text whose lines were wrapped.
fn unwrapped(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A bench with the scenario of a ring.
fn ready() -> Bench {
    let bench = Bench::new();
    bench.scenario(&ring());
    bench
}

#[test]
fn golden_every_line_of_help_fits_into_100_columns() {
    let bench = Bench::new();
    let commands = subcommands(&bench);
    assert!(commands.len() >= 10 && commands.contains(&"run".to_owned()), "{commands:?}");
    for command in [""].into_iter().chain(commands.iter().map(String::as_str)) {
        for flag in ["--help", "-h"] {
            let arguments: Vec<&str> =
                [command, flag].into_iter().filter(|it| !it.is_empty()).collect();
            let ran = bench.maglev(&arguments);
            ran.succeeds();
            for line in ran.stdout().lines() {
                assert!(line.chars().count() <= 100, "maglev {command} {flag}: {line}");
            }
        }
    }
}

/// docs/commands.md has the same table.
#[test]
fn golden_exit_statuses_of_help_and_guide_agree() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/commands.md");
    let docs = fs::read_to_string(docs).unwrap();
    let (_, section) = docs.split_once("## Exit statuses\n").unwrap();
    let help = unwrapped(&Bench::new().maglev(&["--help"]).stdout());
    let rows: Vec<&str> =
        section.lines().skip(3).take_while(|line| line.starts_with("| ")).collect();
    assert_eq!(rows.len(), 4);
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let text = format!("{} {}: {}", cells[0], cells[1], cells[2]).replace('`', "");
        assert!(help.contains(&text), "{text}\nis missing in\n{help}");
    }
}

#[test]
fn golden_the_version_names_the_commit() {
    let version = Bench::new().maglev(&["--version"]).stdout();
    let rest = version.strip_prefix(concat!("maglev ", env!("CARGO_PKG_VERSION"))).unwrap();
    // without git there is no commit
    if rest == "\n" {
        return;
    }
    let commit = rest.strip_prefix(" (commit ").and_then(|it| it.strip_suffix(")\n")).unwrap();
    let (hash, date) = commit.split_once(", ").unwrap();
    assert!(hash.len() >= 7 && hash.chars().all(|c| c.is_ascii_hexdigit()), "{version}");
    assert!(date.len() == 10 && date.split('-').count() == 3, "{version}");
}

#[test]
fn golden_completions_know_subcommands_and_names() {
    let bench = Bench::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let ran = bench.maglev(&["completions", shell]);
        ran.succeeds();
        for word in ["resume", "record-interval"] {
            assert!(ran.stdout().contains(word), "{shell}: {word}");
        }
        // the other two complete no values
        let values = ["bash", "fish", "zsh"].contains(&shell);
        assert_eq!(ran.stdout().contains("gauss-seidel"), values, "{shell}");
    }
    let script =
        bench.shell("maglev completions bash > script && . ./script && complete -p maglev");
    script.succeeds();
    assert!(script.stdout().contains("_maglev"), "{}", script.stdout());
}

#[test]
fn golden_every_subcommand_has_a_manual_page() {
    let bench = Bench::new();
    let all = bench.maglev(&["man"]).stdout();
    bench.maglev(&["man", "--out", "man/man1"]).succeeds();
    for name in subcommands(&bench) {
        let page = fs::read_to_string(bench.path(&format!("man/man1/maglev-{name}.1"))).unwrap();
        assert!(page.contains(".TH") && all.contains(&page), "{name}");
    }
    let page = fs::read_to_string(bench.path("man/man1/maglev.1")).unwrap();
    assert!(page.contains("Exit statuses") && !page.contains("conformance"), "{page}");
}

#[test]
fn golden_typos_get_the_nearest_name() {
    let bench = ready();
    bench.maglev(&["inspct"]).fails(2, &["unrecognized subcommand 'inspct'", "'inspect'"]);
    for (option, name, nearest) in [
        ("--algorithm", "gaus-seidel", "'gauss-seidel'"),
        ("--format", "parket", "'parquet'"),
        ("--log-level", "debgu", "'debug'"),
    ] {
        bench.run(&[option, name]).fails(2, &[name, "similar value exists", nearest]);
    }
    let modes = ["modes", "scenario.json", "--algorithm", "newtn"];
    bench.maglev(&modes).fails(2, &["similar value exists", "'newton'"]);
    bench.maglev(&["report", "out", "--format", "htm"]).fails(2, &["'html'"]);
    let of = ["modes", "scenario.json", "--of", "aa"];
    bench.maglev(&of).fails(2, &["--of: there is no instance \"aa\"; did you mean \"a\"?"]);
    // a pattern that matches nothing
    let of = ["modes", "scenario.json", "--of", "ems_*"];
    bench.maglev(&of).fails(2, &["--of: there is no instance \"ems_*\""]);
}

/// stdout is summary.json, also for a run that fails, and for units that print.
#[test]
fn golden_json_is_the_summary_and_nothing_else() {
    let bench = ready();
    let parse = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    for extra in [&[][..], &["--quiet"]] {
        let ran = bench.run(&[&["--json"], extra].concat());
        ran.succeeds();
        assert_eq!(ran.stdout(), bench.result("summary.json"));
        assert_eq!(parse(&ran.stdout())["status"], "finished");
        if !extra.is_empty() {
            assert_eq!(ran.stderr(), "");
        }
    }
    let failing = ["--json", "--set", "a.fault=4", "--set", "a.fail_time=0.45"];
    let ran = bench.run(&failing);
    ran.fails(1, &["error: ", "the model broke"]);
    assert_eq!(parse(&ran.stdout())["status"], "failed");
    // a run that does not start has no summary
    let ran = bench.run(&["--json", "--set", "a.gian=1"]);
    ran.fails(2, &["did you mean \"gain\"?"]);
    assert_eq!(ran.stdout(), "");
}

#[test]
fn golden_resume_prints_json_or_nothing() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &support::with_states(), &[]);
    bench.scenario(&ring());
    for (option, printed) in [("--json", true), ("--quiet", false)] {
        let fails =
            ["--set", "a.fault=4", "--set", "a.fail_time=0.75", "--checkpoint-every", "0.2"];
        bench.run(&fails).fails(1, &["to continue from the last checkpoint: maglev resume out"]);
        let ran = bench.maglev(&["resume", "out", option]);
        ran.fails(1, &["the model broke"]);
        let expected = if printed { bench.result("summary.json") } else { String::new() };
        assert_eq!(ran.stdout(), expected);
    }
}

/// What a unit prints itself goes to stderr, so that stdout is one document.
#[test]
#[cfg(unix)]
fn golden_json_is_alone_even_if_units_print() {
    for arguments in [&["--json"][..], &["--json", "--isolate"]] {
        if arguments.len() > 1 && cfg!(not(target_os = "linux")) {
            continue;
        }
        let bench = ready();
        bench.unit("unit.fmu", support::DESCRIPTION, &["-DPRINTS"]);
        let ran = bench.run(arguments);
        ran.succeeds();
        assert_eq!(ran.stdout(), bench.result("summary.json"));
        assert!(ran.stderr().contains("printed by the unit"), "{}", ran.stderr());
    }
}

#[test]
fn golden_quiet_says_nothing_of_a_run_that_succeeds() {
    let bench = ready();
    let ran = bench.run(&["--quiet"]);
    ran.succeeds();
    assert_eq!((ran.stdout(), ran.stderr()), (String::new(), String::new()));
    bench
        .run(&["--quiet", "--set", "a.fault=4", "--set", "a.fail_time=0.45"])
        .fails(1, &["error: ", "the model broke"]);
}

/// Seconds of units on several threads do not leave a rest for the master.
#[test]
fn issue_shares_of_the_wall_time_are_stated_only_if_they_are_known() {
    let bench = ready();
    let ran = bench.run(&["--threads", "2"]);
    ran.succeeds();
    assert!(ran.stdout().contains("too short to measure the units' share"), "{}", ran.stdout());
    let summary = bench.summary();
    assert_eq!(summary["algorithm"]["threads"], 2);
    assert_eq!(summary["wall_time"]["master_seconds"], json!(null));
    bench.run(&["--quiet", "--stop", "1000"]).succeeds();
    let wall = &bench.summary()["wall_time"];
    let [run, units] = ["run_seconds", "units_seconds"].map(|key| wall[key].as_f64().unwrap());
    match wall["master_seconds"].as_f64() {
        Some(master) => assert!((units + master - run).abs() < 1e-9 && master >= 0.0, "{wall}"),
        None => assert!(units > run, "{wall}"),
    }
}

#[test]
fn golden_schemas_are_printed_by_kind_of_file() {
    let bench = Bench::new();
    let published = |name: &str| {
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../").to_owned() + name)
    };
    for (kind, file) in [
        (vec![], "scenarios/schema.json"),
        (vec!["scenario"], "scenarios/schema.json"),
        (vec!["criteria"], "criteria/schema.json"),
        (vec!["study"], "examples/studies/schema.json"),
        (vec!["tuning"], "examples/tuning/schema.json"),
        (vec!["vehicle"], "fmu-vehicle/resources/schema.json"),
        (vec!["guideway"], "fmu-guideway/resources/schema.json"),
        (vec!["line"], "fmu-vehicle/resources/line-schema.json"),
    ] {
        let arguments: Vec<&str> = ["schema"].into_iter().chain(kind).collect();
        let ran = bench.maglev(&arguments);
        ran.succeeds();
        // without the texts, which are long
        assert!(ran.stdout() == published(file).unwrap(), "{arguments:?}: {file} is stale");
    }
    bench
        .maglev(&["schema", "train"])
        .fails(2, &["train", "scenario, criteria, study, tuning, vehicle, guideway"]);
}
