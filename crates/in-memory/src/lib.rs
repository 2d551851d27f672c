//! Runs without files: the signals of a run in memory, and its figures.
//!
//! [`run`] steps a [`Setup`](master::Setup) to its end. [`metrics`] and [`ride`] judge recorded signals, of a run in
//! memory or of a results folder, so a figure does not depend on where the signals are. [`prove_resets`] finds out which
//! instances a [`Pool`](master::simulation::Pool) may use again.

#![expect(clippy::result_large_err, reason = "an error ends a run")]
#![doc = include_str!("../README.md")]

pub mod accuracy;
pub mod as_run;
mod listener;
pub mod metrics;
mod proof;
pub mod ride;
mod run;
mod signals;

pub use proof::{Reset, prove_resets};
pub use run::{Run, run};
pub use signals::{Signals, needed};
