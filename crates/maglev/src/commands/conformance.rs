//! The hidden subcommands that `maglev validate --dynamic` starts itself with.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use fmi2_conformance::harness;
use maglev::Error;

/// Arguments of one check.
#[derive(Args)]
pub struct Check {
    /// The unit (.fmu).
    unit: PathBuf,
    /// Name of the check, as `--only` takes it.
    id: String,
    /// File for what it found.
    answer: PathBuf,
    /// File for the calls that it made.
    trace: PathBuf,
}

/// Arguments of a state that goes on.
#[derive(Args)]
pub struct Resume {
    /// The unit (.fmu).
    unit: PathBuf,
    /// File with the state.
    file: PathBuf,
}

/// Runs one check.
pub fn check(arguments: &Check) -> Result<ExitCode, Error> {
    harness::child(&arguments.unit, &arguments.id, &arguments.answer, &arguments.trace)?;
    Ok(ExitCode::SUCCESS)
}

/// Goes on from a state; says on stderr what is wrong.
pub fn resume(arguments: &Resume) -> ExitCode {
    match harness::resume(&arguments.unit, &arguments.file) {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("{text}");
            ExitCode::FAILURE
        }
    }
}
