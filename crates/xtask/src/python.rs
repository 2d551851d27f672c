//! The project's own Python environment, for the tests against foreign tools.

use std::{fs, path::PathBuf};

use anyhow::{Context, Result};

use crate::workspace;

/// Packages of the test environment, one requirement a line.
const REQUIREMENTS: &str = "tests/python/requirements.txt";

/// A Python that has what the tests need; makes the environment where it is missing.
///
/// It lies in target/python and is made anew when the requirements change.
pub fn environment() -> Result<PathBuf> {
    let root = workspace::root();
    let wanted = fs::read_to_string(root.join(REQUIREMENTS)).context(REQUIREMENTS)?;
    let folder = root.join("target").join("python");
    let python = folder.join("bin").join("python");
    let stamp = folder.join("requirements.txt");
    if fs::read_to_string(&stamp).is_ok_and(|had| had == wanted) {
        return Ok(python);
    }
    let folder = folder.to_string_lossy().into_owned();
    workspace::run("python3", &["-m", "venv", "--clear", &folder])?;
    workspace::run(
        &python,
        &["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", REQUIREMENTS],
    )?;
    fs::write(stamp, wanted)?;
    Ok(python)
}
