//! `maglev validate`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use fmi2_conformance::runner::{self, CheckOutcome, ConformanceOptions};
use fmi2_import::description::{Finding, Severity};
use maglev::Error;

/// Arguments of `maglev validate`.
#[derive(Args)]
pub struct Arguments {
    /// The unit (.fmu), or a system (.ssp): its structure and all its units.
    #[arg(required_unless_present = "rules")]
    unit: Option<PathBuf>,
    /// Load the unit and call its C functions, instead of only reading the file.
    #[arg(long)]
    dynamic: bool,
    /// Run only this check. Can be repeated.
    #[arg(long, value_name = "CHECK", requires = "dynamic")]
    only: Vec<String>,
    /// Longest wall time of one check (s).
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, requires = "dynamic")]
    time_limit: f64,
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
    /// List all rules, or with --dynamic all checks.
    #[arg(long, conflicts_with = "unit")]
    rules: bool,
}

/// Checks the unit. The exit status is 1 if it finds an error.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    match arguments.unit.as_deref() {
        None if arguments.dynamic => super::print(&checks()),
        None => super::print(&rules()),
        Some(unit) if ssp::is_system(unit) => {
            if arguments.dynamic {
                return Err(Error::SystemDynamic);
            }
            super::system::validate(unit, arguments.json)
        }
        Some(unit) if arguments.dynamic => dynamic(unit, arguments),
        Some(unit) => fixed(unit, arguments.json),
    }
}

/// 1 if there are errors.
pub(super) fn status(errors: usize) -> ExitCode {
    if errors > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn fixed(unit: &Path, as_json: bool) -> Result<ExitCode, Error> {
    let findings = fmi2_conformance::check(unit)?;
    let count = |severity| findings.iter().filter(|it| it.severity == severity).count();
    if as_json {
        let text = serde_json::to_string_pretty(&findings).unwrap_or_default();
        super::print(&(text + "\n"))?;
    } else {
        let rules = fmi2_conformance::rules().count();
        let total = totals(count);
        super::print(&format!(
            "{}{}: {total} from {rules} rules\n",
            lines(&findings),
            unit.display()
        ))?;
    }
    Ok(status(count(Severity::Error)))
}

pub(super) fn totals(count: impl Fn(Severity) -> usize) -> String {
    format!(
        "{} errors, {} warnings, {} notes",
        count(Severity::Error),
        count(Severity::Warning),
        count(Severity::Note),
    )
}

pub(super) fn lines(findings: &[Finding]) -> String {
    let mut text = String::new();
    for finding in findings {
        // writing to a String cannot fail
        let _ = writeln!(text, "{}: {} [{}]", finding.severity, finding.message, finding.rule);
    }
    text
}

fn dynamic(unit: &Path, arguments: &Arguments) -> Result<ExitCode, Error> {
    let options = ConformanceOptions {
        program: std::env::current_exe().map_err(Error::Program)?,
        only: arguments.only.clone(),
        limit: Duration::try_from_secs_f64(arguments.time_limit).unwrap_or(Duration::MAX),
    };
    let mut printed = Ok(ExitCode::SUCCESS);
    let report = runner::run(unit, &options, |outcome| {
        if !arguments.json && printed.is_ok() {
            printed = super::print(&outcome_text(outcome));
        }
    })?;
    printed?;
    if arguments.json {
        let text = serde_json::to_string_pretty(&report).unwrap_or_default();
        super::print(&(text + "\n"))?;
    } else {
        let skipped = report.checks.iter().filter(|it| it.skipped.is_some()).count();
        let total = totals(|severity| report.count(severity));
        let ran = report.checks.len() - skipped;
        super::print(&format!(
            "{}: {total} from {ran} checks, {skipped} skipped\n",
            unit.display()
        ))?;
    }
    Ok(status(report.count(Severity::Error)))
}

/// The verdict of a check as text, with the calls that show a finding.
fn outcome_text(outcome: &CheckOutcome) -> String {
    let mut text = String::new();
    let (check, section, seconds) = (outcome.check, outcome.section, outcome.seconds);
    // writing to a String cannot fail, also below
    let _ = match (&outcome.skipped, outcome.findings.is_empty()) {
        (Some(reason), true) => writeln!(text, "skip  {check}: {reason}"),
        (_, true) => writeln!(text, "ok    {check} ({seconds:.1} s)"),
        (_, false) => Ok(()),
    };
    for finding in &outcome.findings {
        let (severity, message) = (finding.severity, &finding.message);
        let _ = writeln!(text, "{severity}: {message} [{check}, FMI 2.0.5 section {section}]");
        if severity > Severity::Note {
            for call in &finding.calls {
                let _ = writeln!(text, "    {call}");
            }
        }
    }
    text
}

/// The table of rules in docs/conformance.md.
fn rules() -> String {
    let mut text = String::from("| rule | severity | FMI 2.0.5 | demands |\n|---|---|---|---|\n");
    for rule in fmi2_conformance::rules() {
        let (id, severity, section, demand) = (rule.id, rule.severity, rule.section, rule.demand);
        let _ = writeln!(text, "| {id} | {severity} | {section} | {demand} |");
    }
    text
}

/// The table of checks in docs/conformance.md.
fn checks() -> String {
    let mut text = String::from("| check | severity | FMI 2.0.5 | expects |\n|---|---|---|---|\n");
    for check in fmi2_conformance::checks() {
        let (id, severity, section) = (check.id, check.severity, check.section);
        let _ = writeln!(text, "| {id} | {severity} | {section} | {} |", check.expects);
    }
    text
}
