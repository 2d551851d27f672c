//! `cargo xtask mutants`: changes the code of the physics one place at a time and looks whether a test
//! of the same crate fails. What survives must be in `mutants.json`, with a reason.
//!
//! `cargo-mutants` makes the changes, in a copy of the workspace; `.cargo/mutants.toml` says of which
//! files. This module starts it and compares its results with the list of accepted survivors.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;

use crate::workspace;

/// The version whose names of mutants and results are read here.
const VERSION: &str = "27.1.0";
/// The crates that hold equations.
pub const PACKAGES: [&str; 4] = ["magnet", "guideway", "multibody", "analysis"];
/// The accepted survivors.
const ACCEPTED: &str = "crates/xtask/mutants.json";
/// Exit statuses of cargo-mutants that have results: nothing survived, something did, timeouts.
const FINISHED: [i32; 3] = [0, 2, 3];

/// Which mutants to try.
#[derive(Debug, Default, clap::Args)]
pub struct Selection {
    /// Only this crate; may be repeated [default: magnet, guideway, multibody, analysis]
    #[arg(long = "crate", value_name = "NAME", value_parser = PACKAGES)]
    crates: Vec<String>,
    /// Only files that match, such as crates/magnet/src/filter.rs; may be repeated
    #[arg(long = "file", value_name = "GLOB")]
    files: Vec<String>,
    /// Only what a diff changes: git diff main > my.diff
    #[arg(long, value_name = "FILE")]
    in_diff: Option<PathBuf>,
    /// Only a part of them, such as 1/8, to divide a run among machines
    #[arg(long, value_name = "K/N")]
    shard: Option<String>,
    /// Install cargo-mutants first if it is missing
    #[arg(long)]
    install: bool,
    /// List the mutants and try none
    #[arg(long)]
    list: bool,
    /// Tests to build and run, such as --lib or --test=NAME [default: --tests]
    #[arg(last = true)]
    test_options: Vec<String>,
}

/// A change of the code, as cargo-mutants reports it.
#[derive(Debug, Clone, Deserialize)]
struct Mutant {
    name: String,
    file: String,
    span: Span,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct Span {
    start: Place,
    end: Place,
}

/// Both count from one.
#[derive(Debug, Clone, Copy, Deserialize)]
struct Place {
    line: usize,
    column: usize,
}

#[derive(Debug, Deserialize)]
struct Outcomes {
    outcomes: Vec<Outcome>,
}

#[derive(Debug, Deserialize)]
struct Outcome {
    scenario: Scenario,
    summary: Summary,
}

#[derive(Debug, Deserialize)]
enum Scenario {
    Baseline,
    Mutant(Mutant),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
enum Summary {
    Success,
    CaughtMutant,
    MissedMutant,
    Timeout,
    Unviable,
    Failure,
}

/// Survivors on one line of code that are accepted.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Accepted {
    file: String,
    /// The line, with the changed part between « and » unless it is a whole function.
    code: String,
    /// What is done to it.
    mutants: Vec<String>,
    /// Why no test can or should find it.
    reason: String,
}

/// A mutant by file, code and change: what remains when lines move.
type Key = (String, String, String);

/// Sources by path.
#[derive(Default)]
struct Sources(BTreeMap<String, Vec<String>>);

impl Sources {
    fn key(&mut self, mutant: &Mutant) -> Result<Key> {
        let lines = match self.0.get(&mutant.file) {
            Some(lines) => lines,
            None => self.0.entry(mutant.file.clone()).or_insert(lines_of(&mutant.file)?),
        };
        let line = lines.get(mutant.span.start.line - 1).map_or("", String::as_str);
        let change = mutant.name.split_once(": ").map_or(mutant.name.as_str(), |(_, what)| what);
        Ok((mutant.file.clone(), marked(line, mutant.span), change.to_owned()))
    }
}

fn lines_of(file: &str) -> Result<Vec<String>> {
    let text = fs::read_to_string(workspace::root().join(file))
        .with_context(|| format!("cannot read {file}"))?;
    Ok(text.lines().map(str::to_owned).collect())
}

/// The line with marks about the span, or as it is if the span goes on after it.
fn marked(line: &str, span: Span) -> String {
    if span.start.line != span.end.line {
        return line.trim().to_owned();
    }
    let part = |from: usize, to: usize| line.chars().skip(from).take(to - from).collect::<String>();
    let (start, end) = (span.start.column - 1, span.end.column - 1);
    let (before, middle, after) =
        (part(0, start), part(start, end), part(end, line.chars().count()));
    format!("{}«{middle}»{}", before.trim_start(), after.trim_end())
}

fn accepted() -> Result<Vec<Accepted>> {
    let text = fs::read_to_string(workspace::root().join(ACCEPTED))
        .with_context(|| format!("cannot read {ACCEPTED}"))?;
    serde_json::from_str(&text).with_context(|| format!("{ACCEPTED} is invalid"))
}

/// The accepted mutants with their reasons.
fn reasons(accepted: &[Accepted]) -> BTreeMap<Key, String> {
    let key = |a: &Accepted, change: &String| (a.file.clone(), a.code.clone(), change.clone());
    let all = accepted.iter().flat_map(|a| a.mutants.iter().map(move |m| (a, m)));
    all.map(|(a, change)| (key(a, change), a.reason.clone())).collect()
}

fn show((file, code, change): &Key) -> String {
    format!("{file}: {change}\n    {code}")
}

/// Tries the mutants, or lists them.
pub fn run(selection: &Selection) -> Result<()> {
    installed(selection.install)?;
    let accepted = reasons(&accepted()?);
    report_stale(&accepted)?;
    if selection.list {
        return list(selection, &accepted);
    }
    let out = workspace::target_dir();
    let mut command = mutants(selection);
    command.args(["--no-times", "--colors", "never", "--output"]).arg(&out);
    // as arguments of cargo, they also hold for the build, which takes most of the time
    let tests = ["--tests".to_owned()];
    let options =
        if selection.test_options.is_empty() { &tests[..] } else { &selection.test_options };
    command.args(options.iter().map(|option| format!("--cargo-arg={option}")));
    let status = command.status().context("cannot start cargo mutants")?;
    if !status.code().is_some_and(|code| FINISHED.contains(&code)) {
        bail!("cargo mutants ended with {status}; it found no results to compare");
    }
    judge(&out.join("mutants.out").join("outcomes.json"), &accepted)
}

/// `cargo mutants` for a selection.
fn mutants(selection: &Selection) -> Command {
    let mut command = Command::new(workspace::cargo());
    command.arg("mutants").current_dir(workspace::root());
    let all = PACKAGES.map(str::to_owned);
    let packages = if selection.crates.is_empty() { &all[..] } else { &selection.crates };
    for package in packages {
        command.args(["--package", package]);
    }
    for file in &selection.files {
        command.args(["--file", file]);
    }
    if let Some(diff) = &selection.in_diff {
        command.arg("--in-diff").arg(diff);
    }
    if let Some(shard) = &selection.shard {
        command.args(["--shard", shard]);
    }
    command
}

fn installed(install: bool) -> Result<()> {
    let version = || {
        let output =
            Command::new(workspace::cargo()).args(["mutants", "--version"]).output().ok()?;
        let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        output.status.success().then(|| text.rsplit(' ').next().unwrap_or_default().to_owned())
    };
    let order = ["install", "cargo-mutants", "--version", VERSION, "--locked"];
    match version() {
        Some(found) if found == VERSION => Ok(()),
        _ if install => workspace::run(workspace::cargo(), &order),
        found => bail!(
            "cargo-mutants {VERSION} is needed, but {}; add --install, or run `cargo {}`",
            found.map_or_else(|| "it is not installed".to_owned(), |v| format!("{v} is installed")),
            order.join(" ")
        ),
    }
}

/// The mutants of a selection.
fn all(selection: &Selection) -> Result<Vec<Mutant>> {
    let output = mutants(selection).args(["--list", "--json"]).output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).context("cannot read the list of cargo mutants")
}

/// Names the accepted survivors that the code no longer has.
fn report_stale(accepted: &BTreeMap<Key, String>) -> Result<()> {
    let mut sources = Sources::default();
    let existing: BTreeSet<Key> =
        all(&Selection::default())?.iter().map(|m| sources.key(m)).collect::<Result<_>>()?;
    for key in accepted.keys().filter(|key| !existing.contains(*key)) {
        println!("stale: remove from {ACCEPTED}, the code has no such mutant: {}", show(key));
    }
    Ok(())
}

fn list(selection: &Selection, accepted: &BTreeMap<Key, String>) -> Result<()> {
    let mut sources = Sources::default();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let (mut total, mut known) = (0, 0);
    for mutant in all(selection)? {
        let key = sources.key(&mutant)?;
        let reason = accepted.get(&key);
        println!("{}", mutant.name);
        reason.iter().for_each(|reason| println!("    accepted: {reason}"));
        *counts.entry(mutant.file).or_default() += 1;
        total += 1;
        known += usize::from(reason.is_some());
    }
    for (file, count) in counts {
        println!("{count:6}  {file}");
    }
    println!("{total:6}  mutants, {known} of them accepted survivors");
    Ok(())
}

/// Compares the results with the accepted survivors.
fn judge(outcomes: &Path, accepted: &BTreeMap<Key, String>) -> Result<()> {
    let text = fs::read_to_string(outcomes)
        .with_context(|| format!("cannot read {}", outcomes.display()))?;
    let outcomes: Outcomes = serde_json::from_str(&text).context("cannot read the results")?;
    let mut sources = Sources::default();
    let mut counts: BTreeMap<Summary, usize> = BTreeMap::new();
    let (mut survivors, mut caught) = (BTreeSet::new(), BTreeSet::new());
    for Outcome { scenario, summary } in outcomes.outcomes {
        let Scenario::Mutant(mutant) = scenario else { continue };
        *counts.entry(summary).or_default() += 1;
        match summary {
            Summary::MissedMutant => survivors.insert(sources.key(&mutant)?),
            Summary::CaughtMutant => caught.insert(sources.key(&mutant)?),
            _ => false,
        };
    }
    for key in caught.iter().filter(|key| accepted.contains_key(*key)) {
        println!("stale: remove from {ACCEPTED}, a test finds it now: {}", show(key));
    }
    let new: Vec<&Key> = survivors.iter().filter(|key| !accepted.contains_key(*key)).collect();
    for key in &new {
        println!("survived: {}", show(key));
    }
    let count = |summary| counts.get(&summary).copied().unwrap_or(0);
    println!(
        "{} mutants: {} caught, {} timed out, {} not compiled, {} survived, {} of them not accepted",
        counts.values().sum::<usize>(),
        count(Summary::CaughtMutant),
        count(Summary::Timeout),
        count(Summary::Unviable),
        count(Summary::MissedMutant),
        new.len(),
    );
    ensure!(
        new.is_empty(),
        "{} mutants survived: add a test that fails for each, or accept it in {ACCEPTED} with a reason",
        new.len()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mutant(file: &str, line: usize, columns: (usize, usize)) -> Mutant {
        let at = |column| Place { line, column };
        let span = Span { start: at(columns.0), end: at(columns.1) };
        Mutant {
            name: format!("{file}:{line}:{}: replace + with -", columns.0),
            file: file.to_owned(),
            span,
        }
    }

    #[test]
    fn issue_14_a_mutant_keeps_its_key_when_lines_move() {
        let file = "a.rs".to_owned();
        let key = |lines: &[&str], line, columns| {
            let lines = lines.iter().map(|l| (*l).to_owned()).collect();
            let mut sources = Sources(BTreeMap::from([(file.clone(), lines)]));
            sources.key(&mutant("a.rs", line, columns)).unwrap()
        };
        let first = key(&["    µ + b + c"], 1, (7, 8));
        assert_eq!(first.1, "µ «+» b + c");
        assert_eq!(first.2, "replace + with -");
        assert_eq!(key(&["", "  µ + b + c"], 2, (5, 6)), first);
        assert_ne!(key(&["µ + b + c"], 1, (7, 8)), first);
        let place = |line, column| Place { line, column };
        let span = Span { start: place(1, 5), end: place(3, 6) };
        assert_eq!(marked("    fn f() {", span), "fn f() {");
    }

    /// A survivor outside the list fails, an accepted one does not, and one that a test finds does not.
    #[test]
    fn issue_14_only_new_survivors_fail() {
        let folder = std::env::temp_dir().join(format!("mutants-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let file = folder.join("outcomes.json");
        let source = "crates/xtask/src/mutants.rs";
        let outcome = |line: usize, summary: &str| {
            format!(
                r#"{{"scenario": {{"Mutant": {{"name": "{source}:{line}:1: replace a with b", "file": "{source}",
                "span": {{"start": {{"line": {line}, "column": 1}}, "end": {{"line": {line}, "column": 2}}}}}}}},
                "summary": "{summary}"}}"#
            )
        };
        let write = |outcomes: &[String]| {
            let all = [r#"{"scenario": "Baseline", "summary": "Success"}"#.to_owned()];
            let text = [&all[..], outcomes].concat().join(",");
            fs::write(&file, format!(r#"{{"outcomes": [{text}]}}"#)).unwrap();
        };
        let mut sources = Sources::default();
        let mut first = mutant(source, 1, (1, 2));
        first.name = format!("{source}:1:1: replace a with b");
        let accepted = BTreeMap::from([(sources.key(&first).unwrap(), String::new())]);
        write(&[outcome(1, "MissedMutant"), outcome(2, "CaughtMutant"), outcome(4, "Timeout")]);
        judge(&file, &accepted).unwrap();
        assert!(judge(&file, &BTreeMap::new()).unwrap_err().to_string().starts_with("1 mutants"));
        write(&[outcome(1, "MissedMutant"), outcome(3, "MissedMutant")]);
        assert!(judge(&file, &accepted).unwrap_err().to_string().starts_with("1 mutants"));
        fs::remove_dir_all(&folder).unwrap();
    }

    /// Each entry has a reason, and its line is in its file.
    #[test]
    fn issue_14_accepted_survivors_are_of_the_code_as_it_is() {
        for Accepted { file, code, mutants, reason } in accepted().unwrap() {
            let line = code.replace(['«', '»'], "");
            let lines = lines_of(&file).unwrap();
            assert!(lines.iter().any(|l| l.trim() == line), "{file} has no line `{line}`");
            assert!(!mutants.is_empty() && reason.len() > 20, "{file}: `{line}` has no reason");
        }
    }
}
