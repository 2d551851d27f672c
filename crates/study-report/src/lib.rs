//! Reports of studies: one HTML file that needs no network.
//!
//! ```no_run
//! let study = study_report::StudyResults::read("studies/speed-and-gain".as_ref())?;
//! study_report::write(&study, None, "studies/speed-and-gain/report.html".as_ref())?;
//! # Ok::<(), study_report::StudyReportError>(())
//! ```
//!
//! [`StudyResults`] reads the folder, [`sensitivity`] computes effects and indices, [`page`] embeds both into the template
//! of single reports. The scripts in `assets` draw.

mod columns;
mod error;
pub mod page;
pub mod sensitivity;
mod settings;
mod study_results;

use std::path::Path;

pub use columns::{Column, ColumnKind, ColumnValues};
pub use error::StudyReportError;
pub use settings::Settings;
pub use study_results::StudyResults;

/// Makes the report of a study and writes it. Links to single reports are relative to the study's folder.
///
/// # Errors
/// The report cannot be written.
pub fn write(
    study: &StudyResults,
    title: Option<&str>,
    path: &Path,
) -> Result<(), StudyReportError> {
    let page = page::html(study, title, path);
    results::write_whole(path, page.as_bytes())
        .map_err(|source| StudyReportError::Write { path: path.to_owned(), source })
}
