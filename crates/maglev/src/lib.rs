//! Runs of scenarios with all that they leave on the disk: the library behind the command `maglev`.
//!
//! ```no_run
//! use std::path::Path;
//! use maglev::run::{Job, Unobserved};
//! use scenario::Scenario;
//!
//! let scenario = Scenario::load(Path::new("scenario.json"))?;
//! let job = Job { scenario: &scenario, name: "scenario", folder: Path::new("results") };
//! let summary = job.run(&mut Unobserved)?;
//! println!("{} steps, {} times real time", summary.steps, summary.real_time_factor);
//! # Ok::<(), maglev::Error>(())
//! ```
//!
//! A program that steps by hand uses the crate [`master`] alone.

#![expect(clippy::result_large_err, reason = "an error ends the command")]

pub mod error;
pub mod run;

pub use error::Error;
