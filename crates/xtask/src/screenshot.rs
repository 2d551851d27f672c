//! `cargo xtask screenshot`: docs/report.png, the report of the 5 km/h run as a browser shows it.

use std::path::Path;

use anyhow::Result;

use crate::{
    package::{self, Order},
    python, workspace,
};

/// Runs the scenario and takes the picture with a headless Chromium.
pub fn take() -> Result<()> {
    package::package(&Order { also: &[workspace::COMMAND], ..Order::default() })?;
    let out = workspace::root().join("results").join("low-speed");
    let folder = out.to_string_lossy().into_owned();
    workspace::run_maglev(
        Path::new("scenarios/low-speed.json"),
        &["--out".into(), folder, "--quiet".into()],
    )?;
    let python = python::environment("python", Path::new(python::TESTS))?;
    let report = out.join("report.html");
    workspace::run(
        python,
        &["tests/python/screenshot.py", &report.to_string_lossy(), "docs/report.png"],
    )
}
