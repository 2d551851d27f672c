//! FMI 2.0 co-simulation units of any make, as an importer sees them.
//!
//! A .fmu file is opened ([`archive`]), its description read ([`description`]), its files unpacked
//! ([`package`]), its binary loaded ([`library`]) and instances made ([`instance`]): in this process, or in
//! processes of their own ([`isolate`]). Messages arrive in [`logger`], each call can be written to a
//! [`trace`], [`interrupt`] ends calls that do not return, and [`witness`] reports which call crashed or
//! ended this process.
//!
//! ```no_run
//! use std::path::Path;
//! use fmi2_import::package::Package;
//!
//! let unit = Package::open(Path::new("pendulum.fmu"))?;
//! println!("{} variables", unit.description().variables.len());
//! # Ok::<(), fmi2_import::package::PackageError>(())
//! ```

#![expect(clippy::result_large_err, reason = "errors name all that they concern, and end a run")]

mod activity;
mod answer;
pub mod archive;
mod component;
pub mod description;
pub mod exchange;
mod fault;
mod functions;
pub mod instance;
pub mod interrupt;
pub mod isolate;
pub mod library;
pub mod logger;
pub mod package;
pub mod per_type;
mod request;
pub mod scratch;
mod signal;
pub mod span;
mod status;
pub mod trace;
pub mod witness;
pub mod xml;

pub use activity::Activity;
pub use functions::Call;
pub use status::{fmi2Status, status_with_name};
