//! FMI 2.0 co-simulation master: connects units from any exporter and steps them.
//!
//! ```no_run
//! use std::path::Path;
//! use master::Setup;
//! use scenario::Scenario;
//!
//! let scenario = Scenario::load(Path::new("scenario.json"))?;
//! let setup = Setup::new(&scenario)?;
//! let mut simulation = setup.start()?;
//! while simulation.remaining() > 0 {
//!     simulation.step()?;
//! }
//! println!("{} s reached", simulation.time());
//! # Ok::<(), master::Error>(())
//! ```
//!
//! A [`Setup`] is a checked [`Scenario`](scenario::Scenario): its units are opened, and the [`system`] of
//! instances, connections and values is checked. Starting it loads and [`initialize`]s the units, connects
//! them as [`participant`]s to the algorithms of a [`coupling`], and gives a [`Simulation`] to step.
//! The crate `results` writes files, the crate `linear` computes modes, and the crate `maglev` is the
//! command. Nothing in here knows what the units model.

#![expect(
    clippy::result_large_err,
    reason = "detailed errors are large; they end a run, and those of steps are boxed"
)]

mod error;
pub mod graph;
pub mod initialize;
pub mod participant;
pub mod simulation;
pub mod system;

pub use coupling;
pub use error::{Error, Misfit, StateError};
pub use simulation::{Setup, Simulation, SimulationState};
