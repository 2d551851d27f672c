//! FMI 2.0 co-simulation unit `ems`: one levitation electromagnet with its controller (eqs 1-5).
//!
//! The physics is in the crate `magnet`; this crate is its FMI interface: `table` and `parameters`
//! declare the variables, [`EmsFmu`] maps them to the physics.

mod command;
#[cfg(test)]
mod condition_tests;
mod conditions;
#[cfg(test)]
mod gain_tests;
mod lift;
mod linear;
#[cfg(test)]
mod linear_tests;
mod model;
mod parameters;
mod table;
#[cfg(test)]
mod tests;

pub use model::EmsFmu;

fmi2_export::export!(EmsFmu);
