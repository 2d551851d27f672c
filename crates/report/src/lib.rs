//! Reports of co-simulation runs: one HTML file that needs no network, with time histories, spectra, tables,
//! a 3D view, and what was run.
//!
//! ```no_run
//! use results::RunResults;
//!
//! let runs = [RunResults::read("results/low-speed".as_ref())?];
//! report::write(&runs, "results/low-speed/report.html".as_ref())?;
//! # Ok::<(), report::ReportError>(())
//! ```
//!
//! [`page`] collects the data of the page and puts it into `assets/report.html` together with the scripts
//! in that folder, which draw.

mod data;
mod detail;
pub mod embed;
mod error;
pub mod evidence;
mod girders;
mod irregularity;
pub mod knowledge;
mod layout_fmu;
mod modes;
mod names;
mod order;
pub mod page;
pub mod pictures;
mod response_section;
mod responses;
mod scene;
pub mod section;
pub mod series;
mod spectra;
mod spectrogram;
mod title;

use std::path::Path;

use results::RunResults;
use section::Section;

pub use error::ReportError;
pub use evidence::{RunEvidence, judge, own_metrics};
pub use order::{natural, order};
pub use responses::response_figures;

/// Makes the report of some runs and writes it.
///
/// # Errors
/// The report cannot be written.
pub fn write(runs: &[RunResults], path: &Path) -> Result<(), ReportError> {
    write_titled(runs, None, path)
}

/// The same, with a title of the page instead of what the runs are called.
///
/// # Errors
/// The report cannot be written.
pub fn write_titled(
    runs: &[RunResults],
    title: Option<&str>,
    path: &Path,
) -> Result<(), ReportError> {
    write_with(runs, title, &[], path)
}

/// The same, with further sections.
///
/// # Errors
/// The report cannot be written.
pub fn write_with(
    runs: &[RunResults],
    title: Option<&str>,
    sections: &[Section],
    path: &Path,
) -> Result<(), ReportError> {
    let page = page::html(runs, title, sections);
    results::write_whole(path, page.as_bytes())
        .map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
