//! Systems as SSP archives: System Structure and Parameterization 1.0 and 2.0 of the Modelica Association.
#![doc = include_str!("../README.md")]
#![expect(clippy::result_large_err, reason = "errors carry their context, and are rare")]

mod annotation;
mod error;
mod export;
mod files;
mod import;
mod names;
mod read;
mod xml;

pub use annotation::TYPE as ANNOTATION;
pub use error::SspError;
pub use export::{Exported, SspVersion, export};
pub use import::{Imported, import};

use std::path::Path;

/// Whether the name of a file says that it describes a system: an archive (.ssp), or the description of one that is
/// unpacked (.ssd).
#[must_use]
pub fn is_system(path: &Path) -> bool {
    let is = |wanted: &str| path.extension().is_some_and(|end| end.eq_ignore_ascii_case(wanted));
    is("ssp") || is("ssd")
}
