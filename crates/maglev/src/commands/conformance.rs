//! The hidden subcommands with which `maglev validate --dynamic` starts itself.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use fmi2_conformance::runner;
use maglev::Error;

/// Arguments of one check.
#[derive(Args)]
pub struct Check {
    /// The unit (.fmu).
    unit: PathBuf,
    /// Name of the check, as for `--only`.
    id: String,
    /// File for the findings.
    answer: PathBuf,
    /// File for the calls.
    trace: PathBuf,
}

/// Arguments for restoring a state.
#[derive(Args)]
pub struct Resume {
    /// The unit (.fmu).
    unit: PathBuf,
    /// File with the state.
    file: PathBuf,
}

/// Runs one check.
pub fn check(arguments: &Check) -> Result<ExitCode, Error> {
    runner::child(&arguments.unit, &arguments.id, &arguments.answer, &arguments.trace)?;
    Ok(ExitCode::SUCCESS)
}

/// Restores a state and continues; errors go to stderr.
pub fn resume(arguments: &Resume) -> ExitCode {
    match runner::resume(&arguments.unit, &arguments.file) {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("{text}");
            ExitCode::FAILURE
        }
    }
}
