//! FMI 2.0 co-simulation master: connects units of any make and steps them.
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
//! A [`Scenario`](scenario::Scenario) becomes a [`Setup`]: its units are opened and the [`system`] of
//! instances, connections and values is checked. The setup starts a [`Simulation`]: the units are loaded, [`initialize`]d
//! and joined to a [`coupling`] algorithm as its [`participant`]s, and stepped. [`modes`] finds the modes of
//! the coupled system instead. Results and files are the business of the crate `maglev`. Nothing in here
//! knows what the units model.

#![expect(
    clippy::result_large_err,
    reason = "errors that say much are large; they end a run, and those of steps are boxed"
)]

pub mod coupling;
mod error;
pub mod graph;
pub mod initialize;
pub mod modes;
pub mod participant;
pub mod simulation;
pub mod system;

pub use error::{Error, Misfit, StateError};
pub use simulation::{Setup, Simulation, SimulationState};
