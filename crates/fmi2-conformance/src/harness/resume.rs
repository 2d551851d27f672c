//! A serialized state from which another process continues.

use std::path::Path;
use std::process::{Command, Stdio};
use std::ptr::null_mut;

use serde::{Deserialize, Serialize};

use super::bench::Bench;
use super::drive::{ReadValues, same};
use super::raw::ok;
use super::{CheckResult, Stop, fault};
use fmi2_import::description::Severity;

/// The hidden subcommand of `maglev` that calls [`resume`].
pub(crate) const SUBCOMMAND: &str = "conformance-resume";

/// A serialized state, and the values that must follow from it.
#[derive(Serialize, Deserialize)]
pub(crate) struct Continuation {
    pub(crate) bytes: Vec<u8>,
    /// Communication point of the state.
    pub(crate) from: usize,
    /// Values of the steps after it.
    pub(crate) wanted: Vec<ReadValues>,
}

/// Continues from the state in another process of this program.
pub(crate) fn elsewhere(bench: &Bench, continuation: &Continuation) -> CheckResult {
    let internal = |what: &dyn std::fmt::Display| fault(format!("the check itself failed: {what}"));
    let folder = match tempfile::tempdir() {
        Ok(folder) => folder,
        Err(error) => return internal(&error),
    };
    let file = folder.path().join("continuation.json");
    let text = serde_json::to_vec(continuation).unwrap_or_default();
    if let Err(error) = std::fs::write(&file, text) {
        return internal(&error);
    }
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(error) => return internal(&error),
    };
    let mut command = Command::new(program);
    command.arg(SUBCOMMAND).arg(bench.package().path()).arg(&file).stdout(Stdio::null());
    match command.output() {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => fault(format!(
            "in another process: {} ({})",
            String::from_utf8_lossy(&output.stderr).trim(),
            output.status
        )),
        Err(error) => internal(&error),
    }
}

/// Continues from the state in a file, in a process that `maglev validate --dynamic` started.
///
/// # Errors
/// The finding, in words.
pub fn resume(unit: &Path, file: &Path) -> Result<(), String> {
    let text = std::fs::read(file).map_err(|error| error.to_string())?;
    let continuation: Continuation =
        serde_json::from_slice(&text).map_err(|error| error.to_string())?;
    let bench = Bench::new(unit, Severity::Error, None).map_err(|error| error.to_string())?;
    continue_from(&bench, &continuation).map_err(|stop| match stop {
        Stop::Fault(text) | Stop::Skip(text) => text,
    })
}

fn continue_from(bench: &Bench, continuation: &Continuation) -> CheckResult {
    let unit = bench.instance("another process")?;
    let mut saved = null_mut();
    ok(unit.deserialize(&continuation.bytes, &mut saved), "fmi2DeSerializeFMUstate")?;
    ok(unit.set_state(saved), "fmi2SetFMUstate")?;
    ok(unit.free_state(&mut saved), "fmi2FreeFMUstate")?;
    let (from, steps) = (continuation.from, continuation.wanted.len());
    same(
        bench,
        &unit.record(from, from + steps)?,
        &continuation.wanted,
        "from the serialized state",
    )
}
