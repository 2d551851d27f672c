//! `maglev validate`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use master::description::Severity;
use master::error::Error;
use master::package::Package;
use master::validate;

/// Arguments of `maglev validate`.
#[derive(Args)]
pub struct Arguments {
    /// The unit (.fmu).
    unit: PathBuf,
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
}

/// Checks the unit; exit status 1 if an error is found.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let package = Package::open(&arguments.unit)?;
    let findings = validate::check(&package);
    let count = |severity| findings.iter().filter(|finding| finding.severity == severity).count();
    let errors = count(Severity::Error);
    if arguments.json {
        let text = serde_json::to_string_pretty(&findings).unwrap_or_default();
        super::print(&(text + "\n"))?;
    } else {
        let mut text = String::new();
        for finding in &findings {
            let severity = format!("{:?}", finding.severity).to_lowercase();
            // writing to a String cannot fail
            let _ = writeln!(text, "{severity}: {} [{}]", finding.message, finding.rule);
        }
        let _ = writeln!(
            text,
            "{}: {errors} errors, {} warnings, {} notes from {} rules",
            arguments.unit.display(),
            count(Severity::Warning),
            count(Severity::Note),
            validate::RULES.len(),
        );
        super::print(&text)?;
    }
    Ok(if errors > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
