//! The project's own Python environments: the foreign tools of the tests, the guide's, and zig.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};

use crate::workspace;

/// The machine's own Python.
pub const SYSTEM: &str = if cfg!(windows) { "python" } else { "python3" };
/// Packages of the test environment, one requirement a line.
pub const TESTS: &str = "tests/python/requirements.txt";
/// Packages that make a book of the guide.
pub const GUIDE: &str = "docs/requirements.txt";

/// The interpreter of a virtual environment with the packages in a requirements file.
///
/// The environment is created in `target/{name}`, and again whenever the requirements change.
pub fn environment(name: &str, requirements: &Path) -> Result<PathBuf> {
    let root = workspace::root();
    let wanted = fs::read_to_string(root.join(requirements))
        .with_context(|| format!("reading {}", requirements.display()))?;
    let folder = root.join("target").join(name);
    let python = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
    let python = folder.join(python);
    let stamp = folder.join("requirements.txt");
    if fs::read_to_string(&stamp).is_ok_and(|had| had == wanted) {
        return Ok(python);
    }
    let folder = folder.to_string_lossy().into_owned();
    workspace::run(SYSTEM, &["-m", "venv", "--clear", &folder])?;
    let list = requirements.to_string_lossy();
    workspace::run(
        &python,
        &["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", &list],
    )?;
    fs::write(stamp, wanted)?;
    Ok(python)
}
