//! Reports of co-simulation runs: one HTML file that needs no network, with time histories, tables
//! and what ran.
//!
//! ```no_run
//! let runs = [report::Run::read("results/low-speed".as_ref())?];
//! report::write(&runs, "results/low-speed/report.html".as_ref())?;
//! # Ok::<(), report::ReportError>(())
//! ```
//!
//! [`Run`] reads a folder, [`page`] makes the data of the page and puts it into `assets/report.html`
//! with the scripts beside it; the scripts draw. This crate knows the files of a run and nothing of
//! the program that wrote them.

mod columns;
mod data;
pub mod embed;
mod error;
mod files;
mod irregularity;
pub mod knowledge;
pub mod modes;
mod names;
pub mod page;
pub mod pictures;
mod run;
mod scenario;
mod scene;
pub mod series;
mod spectra;
mod spectrogram;
mod table;
mod unit;

use std::fs;
use std::path::Path;

pub use error::ReportError;
pub use run::{Run, Signal, Summary, UnitSummary};
pub use scenario::{Instance, Panel, Plot, Scenario};
pub use table::Table;

/// Name of the report in a folder of results.
pub const FILE: &str = "report.html";

/// Whether something of a run is in the folder.
#[must_use]
pub fn is_results(folder: &Path) -> bool {
    let files = ["summary.json", "results.csv", "results.parquet", "results.csv.partial"];
    files.iter().any(|name| folder.join(name).exists())
}

/// Makes the report of some runs and writes it, as a whole or not at all.
///
/// # Errors
/// A unit's file is not as it should be, or the report cannot be written.
pub fn write(runs: &[Run], path: &Path) -> Result<(), ReportError> {
    let page = page::html(runs)?;
    let failed = |source| ReportError::Write { path: path.to_owned(), source };
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    let temporary = Path::new(&name);
    let written = fs::write(temporary, page).and_then(|()| fs::rename(temporary, path));
    written.map_err(|source| {
        // half a file is of no use; if it cannot be removed, there is nothing else to do
        let _ = fs::remove_file(temporary);
        failed(source)
    })
}
