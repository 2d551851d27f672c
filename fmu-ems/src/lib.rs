//! FMI 2.0 co-simulation unit `ems`: one levitation electromagnet with its controller (eqs 1-5).
//!
//! The physics is in the crate `magnet`; here is its interface: `table` declares the variables,
//! [`EmsFmu`] maps them on the physics.

mod linear;
mod model;
mod parameters;
mod table;
#[cfg(test)]
mod tests;

pub use model::EmsFmu;

fmi2_export::export!(EmsFmu);
