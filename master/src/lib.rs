//! FMI 2.0 co-simulation master: loads, connects and steps units of any make.
//!
//! ```no_run
//! use std::path::Path;
//! use master::run::{Job, Unobserved};
//! use master::scenario::Scenario;
//!
//! let scenario = Scenario::load(Path::new("scenario.json"))?;
//! let job =
//!     Job { scenario: &scenario, name: "scenario", overrides: &[], folder: Path::new("results") };
//! let summary = job.run(&mut Unobserved)?;
//! println!("{} steps, {} times real time", summary.steps, summary.real_time_factor);
//! # Ok::<(), master::error::Error>(())
//! ```
//!
//! A program of one's own can step by hand: [`run::Setup`] loads and connects, [`run::Simulation`]
//! steps, gives values and changes them (`examples/by_hand.rs`).
//!
//! From the file to the results: [`scenario`] is read, its units are opened ([`archive`],
//! [`description`], [`package`]), the [`system`] is checked ([`pattern`], [`graph`]), the
//! binaries are loaded ([`library`], [`logger`], [`instance`]), here or in processes of their own
//! ([`isolate`], each call noted in a [`trace`] on demand), [`initialize`]d, stepped by a [`coupling`]
//! algorithm ([`participant`]), and written ([`record`], [`plot`], [`summary`]) by [`run`];
//! [`interrupt`] ends runs early. [`witness`] has the last words when a unit crashes in this process or
//! ends it. [`validate`] looks for defects of a unit, [`conformance`] drives it to show them.
//! Nothing in here knows what the units model.

#![expect(
    clippy::result_large_err,
    reason = "errors that say much are large; they end a run, and those of steps are boxed"
)]

pub mod archive;
mod component;
pub mod conformance;
pub mod coupling;
pub mod description;
pub mod error;
pub mod graph;
pub mod initialize;
pub mod instance;
pub mod interrupt;
pub mod isolate;
pub mod library;
pub mod logger;
#[cfg(feature = "modes")]
pub mod modes;
pub mod package;
pub mod participant;
pub mod record;
pub mod reference;
pub mod ride;
pub mod run;
pub mod scenario;
mod scratch;
mod span;
pub mod summary;
pub mod system;
pub mod trace;
pub mod validate;
pub mod witness;
mod xml;

pub use figure as plot;
pub use patterns as pattern;
