//! FMI 2.0 co-simulation unit `controller`: the controller of one levitation electromagnet (eqs
//! 3-5), for a magnet that leaves its own out.
//!
//! The physics is in the crate `magnet`; this crate is its FMI interface: `table` declares the
//! variables, [`ControllerFmu`] maps them to the physics.

mod model;
mod table;
#[cfg(test)]
mod tests;

pub use model::ControllerFmu;

fmi2_export::export!(ControllerFmu);
