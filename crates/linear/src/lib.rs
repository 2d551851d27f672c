//! Linear analysis of coupled systems.
//!
//! Every unit reports its linearisation ẋ = A x + B u, y = C x + D u ([`LinearUnit`]). With the scenario's
//! connections they make a [`LinearSystem`], which is one differential equation: closed
//! ([`LinearSystem::matrix`]), or between free inputs and chosen outputs, with loops broken where wanted
//! ([`LinearSystem::open`]). The same units, stepped as the master steps them, give the map from one
//! communication point to the next ([`Stepped`]).
//!
//! ```no_run
//! use std::path::Path;
//! use linear::{Linearised, Open};
//! use master::Setup;
//! use scenario::Scenario;
//!
//! let setup = Setup::new(&Scenario::load(Path::new("scenario.json"))?)?;
//! let system = Linearised::at_start(&setup)?.system;
//! let poles = linear::eigenvalues(&system.matrix()?)?;
//! // the loop broken at the force of one magnet
//! let force = system.output("ems_01.force")?;
//! let open = Open { cut: vec![force], outputs: vec![force], ..Open::default() };
//! let loop_transfer = system.open(&open)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![expect(
    clippy::result_large_err,
    reason = "errors have the detailed one of the master; they end a command"
)]

mod coupled;
mod derivatives;
pub mod eigen;
mod error;
mod files;
mod identified;
mod lanes;
mod mat5;
mod matching;
mod model;
pub mod modes;
mod operating_point;
mod report;
mod rows;
mod shapes;
mod stepped;
mod stepped_unit;
mod steps;
mod structure;
mod system;
#[cfg(test)]
mod tests;
mod unit;
mod unit_map;

pub use coupled::{Open, StateSpace};
pub use eigen::{Eigen, eigen, eigenvalues};
pub use error::LinearError;
pub use identified::Identified;
pub use lanes::{Lanes, Motion};
pub use model::{Model, Models, Source};
pub use report::Report;
pub use rows::{Entry, Rows};
pub use shapes::Motions;
pub use stepped::Stepped;
pub use steps::{IDENTIFYING_STEPS, UnitSteps};
pub use system::{Connection, LinearSystem, Linearised, Port, Stepping};
pub use unit::{LinearUnit, Quantity};
