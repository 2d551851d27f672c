//! A single-sided linear induction motor: its thrust and its normal force.
//!
//! The primary, a three-phase winding in an iron core, is on the vehicle. The reaction plate, a conducting
//! sheet on back iron, is on the track. [`Motor`] gives the forces over current, frequency, speed and gap, by
//! one of two laws:
//!
//! - [`Field`]: the one-dimensional theory of the field in the gap, with entry and exit end effect.
//!   S. Yamamura, *Theory of Linear Induction Motors*, University of Tokyo Press, 2nd edition, 1979.
//! - [`ForceTable`]: forces of measurements or of a field programme, interpolated.
//!
//! [`Motor::feed_for`] is the usual control of such a motor: it keeps the slip frequency and changes the current.
//!
//! | symbol | meaning | unit | in the code |
//! |---|---|---|---|
//! | I, f | current (r.m.s. of a phase) and frequency | A, Hz | [`Feed`] |
//! | v | speed of the primary along the track | m/s | |
//! | τ, k = π/τ | pole pitch, wave number | m, 1/m | [`MotorDescription::pole_pitch`] |
//! | f − v/2τ | slip frequency | Hz | [`Motor::slip_frequency`] |
//! | g | clearance between primary and sheet | m | |
//!
//! Forces are those of the fundamental wave in the steady state at each instant: the motor's electrical
//! transients, some 10 ms, its harmonics and the saturation of the iron are left out.
#![forbid(unsafe_code)]

mod check;
mod description;
mod error;
mod field;
mod motor;
#[cfg(feature = "schema")]
mod schema;
mod table;

pub use description::{FieldDescription, ForceTable, MotorDescription};
pub use error::Error;
pub use field::{Circuit, Field, Powers};
pub use motor::{Feed, Forces, Motor};

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
