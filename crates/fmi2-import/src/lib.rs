//! Imports FMI 2.0 co-simulation FMUs of any make.
//!
//! [`archive`] reads a .fmu file, [`description`] its modelDescription.xml, [`package`] unpacks it,
//! [`library`] loads its binary, and [`instance`] makes instances of it: in this process, or with
//! [`isolate`] in processes of their own. [`logger`] receives messages, [`trace`] writes each call to a file,
//! [`interrupt`] ends calls that do not return, and [`witness`] reports which call crashed or ended this
//! process.
//!
//! ```no_run
//! use std::path::Path;
//! use fmi2_import::package::Package;
//!
//! let package = Package::open(Path::new("pendulum.fmu"))?;
//! println!("{} variables", package.description().variables.len());
//! # Ok::<(), fmi2_import::package::PackageError>(())
//! ```

mod activity;
mod answer;
pub mod archive;
mod cache;
mod component;
pub mod description;
pub mod exchange;
mod fault;
mod functions;
pub mod instance;
pub mod interrupt;
pub mod isolate;
pub mod library;
mod loaded;
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
pub use fault::causes;
pub use functions::Call;
pub use status::{fmi2Status, status_with_name};

/// Compiles the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
