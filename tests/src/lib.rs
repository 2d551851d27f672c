//! System tests of units and master together, through the files and the command that users use.
//!
//! They run what `cargo xtask package` built: `target/fmu/*.fmu` and `target/release/maglev`.

pub mod curves;
pub mod monolithic;
pub mod rails;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;

/// The workspace's root folder.
#[must_use]
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// The release build of the command.
#[must_use]
pub fn maglev() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    root().join(target).join("release").join("maglev")
}

/// A scenario of `scenarios/`.
#[must_use]
pub fn scenario(name: &str) -> PathBuf {
    root().join("scenarios").join(name)
}

/// Starts the command and waits for it.
///
/// # Errors
/// It cannot be started; `cargo xtask package` and a release build of `maglev-cli` must come first.
pub fn start<S: AsRef<std::ffi::OsStr>>(args: &[S]) -> Result<Output, String> {
    let maglev = maglev();
    Command::new(&maglev)
        .args(args)
        .output()
        .map_err(|e| format!("{}: {e}; run `cargo xtask test`", maglev.display()))
}

/// The files of a successful run.
pub struct FinishedRun {
    folder: tempfile::TempDir,
    /// summary.json
    pub summary: Value,
}

impl FinishedRun {
    /// Runs `scenario` with further options. Results go to a new folder.
    ///
    /// # Errors
    /// The run failed; the message is the output of `maglev`.
    pub fn of(scenario: &Path, options: &[&str]) -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let mut args: Vec<String> = vec!["run".into(), scenario.display().to_string()];
        args.extend(["--quiet".into(), "--out".into(), folder.path().display().to_string()]);
        args.extend(options.iter().map(|&o| o.into()));
        let output = start(&args)?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        let text = fs::read(folder.path().join("summary.json"))
            .map_err(|e| format!("summary.json: {e}"))?;
        let summary = serde_json::from_slice(&text).map_err(|e| format!("summary.json: {e}"))?;
        Ok(Self { folder, summary })
    }

    /// The results folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// results.csv as it is.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn csv(&self) -> Result<Vec<u8>, String> {
        fs::read(self.folder.path().join("results.csv")).map_err(|e| format!("results.csv: {e}"))
    }

    /// The columns of results.csv, by name.
    ///
    /// # Errors
    /// The file cannot be read or is not a table of numbers.
    pub fn columns(&self) -> Result<std::collections::BTreeMap<String, Vec<f64>>, String> {
        let text = String::from_utf8(self.csv()?).map_err(|e| e.to_string())?;
        let mut lines = text.lines();
        let names: Vec<_> = lines.next().unwrap_or("").split(',').map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            for (column, cell) in columns.iter_mut().zip(line.split(',')) {
                column.push(cell.parse().map_err(|e| format!("{cell}: {e}"))?);
            }
        }
        Ok(names.into_iter().zip(columns).collect())
    }

    /// One statistic (`min`, `max`, `mean`, `rms`, `final`) of a recorded signal.
    ///
    /// # Errors
    /// The summary has no such signal.
    pub fn statistic(&self, signal: &str, name: &str) -> Result<f64, String> {
        self.summary["signals"][signal][name]
            .as_f64()
            .ok_or_else(|| format!("summary.json has no {name} of {signal}"))
    }
}
