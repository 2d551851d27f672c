//! `maglev validate`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use master::description::{Finding, Severity};
use master::error::Error;
use master::validate;

/// Arguments of `maglev validate`.
#[derive(Args)]
pub struct Arguments {
    /// The unit (.fmu).
    #[arg(required_unless_present = "rules")]
    unit: Option<PathBuf>,
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
    /// List all rules instead.
    #[arg(long, conflicts_with = "unit")]
    rules: bool,
}

/// Checks the unit; exit status 1 if an error is found.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let Some(unit) = arguments.unit.as_deref().filter(|_| !arguments.rules) else {
        return super::print(&rules());
    };
    let findings = validate::check(unit)?;
    let errors = count(&findings, Severity::Error);
    if arguments.json {
        let text = serde_json::to_string_pretty(&findings).unwrap_or_default();
        super::print(&(text + "\n"))?;
    } else {
        let mut text = lines(&findings);
        // writing to a String cannot fail
        let _ = writeln!(
            text,
            "{}: {} from {} rules",
            unit.display(),
            totals(&findings),
            validate::rules().count(),
        );
        super::print(&text)?;
    }
    Ok(if errors > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn count(findings: &[Finding], severity: Severity) -> usize {
    findings.iter().filter(|finding| finding.severity == severity).count()
}

fn totals(findings: &[Finding]) -> String {
    format!(
        "{} errors, {} warnings, {} notes",
        count(findings, Severity::Error),
        count(findings, Severity::Warning),
        count(findings, Severity::Note),
    )
}

fn lines(findings: &[Finding]) -> String {
    let mut text = String::new();
    for finding in findings {
        let _ = writeln!(text, "{}: {} [{}]", finding.severity, finding.message, finding.rule);
    }
    text
}

/// The table of rules, as docs/conformance.md has it.
fn rules() -> String {
    let mut text = String::from("| rule | severity | FMI 2.0.5 | demands |\n|---|---|---|---|\n");
    for rule in validate::rules() {
        let (id, severity, section, demand) = (rule.id, rule.severity, rule.section, rule.demand);
        let _ = writeln!(text, "| {id} | {severity} | {section} | {demand} |");
    }
    text
}
