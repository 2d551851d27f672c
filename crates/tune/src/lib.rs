//! Tuning of controllers: parameters of many units that make the coupled system damped and robust under several
//! conditions.
//!
//! [`tune`] varies the parameters of a [`Tuning`] within bounds, maximises the worst [`Objective`] of all conditions and
//! keeps the worst margins and the r.m.s. voltage within [`Constraints`]. Nothing runs: every set of values is judged by
//! the linearised system. The scenario starts once per condition; then single units are asked for their linearisation
//! with other values (`maps`). The rest of the system is split into parts that do not see each other, so that equal
//! controllers cost little. The values found are verified by a new start and all eigenvalues of the whole system.

#![expect(
    clippy::result_large_err,
    reason = "errors have the detailed one of the master; they end a command"
)]

mod closed;
mod condition;
mod core;
mod counting;
mod decay;
mod error;
mod figures;
mod file;
mod goal;
mod modes;
mod noise;
mod picture;
mod result;
mod run;
mod search;
mod sensitivity;
mod split;
mod store;
#[cfg(test)]
mod tests;
mod verify;

pub use counting::Ignored;
pub use decay::{Oscillation, oscillations};
pub use error::TuneError;
pub use figures::Figures;
pub use file::{
    Bounds, Condition, Constraints, Irregularity, NoiseOption, Objective, SensorNoise, Tuning,
    Varied,
};
pub use maps::Watch;
pub use picture::front_picture;
pub use result::{Active, ConditionResult, FrontPoint, TuneResult, Tuned, Verified};
pub use run::{Request, tune};
