//! Fits parameters of a scenario to a measured record.
//!
//! [`fit`] runs the scenario in this process with many values of the parameters, until the sum of the squared
//! differences from the record is least. [`least_squares`] is the method without simulation: any [`least_squares::Model`] can be
//! fitted. [`section`] shows a [`Fit`] in a report, [`patch()`](patch::patch) is the change of the scenario.

#![forbid(unsafe_code)]
#![expect(clippy::result_large_err, reason = "an error ends the fit")]
#![doc = include_str!("../README.md")]

mod covariance;
mod error;
mod fitting;
pub mod least_squares;
pub mod patch;
mod section;
mod simulator;
pub mod statistics;
mod varied;

pub use error::FitError;
pub use fitting::{Fit, FittedParameter, FittedSignal, Order, Progress, fit};
pub use section::section;
pub use varied::Varied;
