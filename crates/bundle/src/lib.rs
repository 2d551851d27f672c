//! Packs a whole co-simulation into one FMI 2.0 co-simulation unit.
#![doc = include_str!("../README.md")]
#![expect(clippy::result_large_err, reason = "an error ends the command")]

mod contents;
mod dependencies;
mod error;
mod expose;
mod library;
mod limits;
mod measures;
mod names;
mod pack;
mod page;
mod prepared;
mod variables;

pub use bundle_table::Role;
pub use error::BundleError;
pub use expose::Expose;
pub use library::Library;
pub use pack::{Bundled, Order, bundle};
