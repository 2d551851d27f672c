//! FMI 2.0 co-simulation unit `vehicle`: a Maglev vehicle as a constrained multibody system
//! (eqs 9-12).
//!
//! The physics is in the crate `multibody`; this crate is its FMI interface: `table` declares the
//! variables, [`VehicleFmu`] maps them to the physics. The layout (bodies, joints, force elements,
//! magnets) is data: `vehicle.json` in the unit's resources.
//!
//! # Frames
//! The equations run in a frame that travels with `travel_speed` + `speed_change`, and the file's
//! `ground` travels with it. So a single magnet on a vertical guide can travel along a track as
//! well as a train. A magnet's `position` along the track is its place in that frame plus
//! `initial_position` plus the integral of the frame's speed. Where the speed changes, each body
//! feels its inertia, and the motor acts at the magnets ([`multibody::AppliedForces::acceleration`]).

mod adjustments;
#[cfg(test)]
mod allocation;
mod contact;
#[cfg(test)]
mod contact_tests;
mod dependencies;
#[cfg(test)]
mod derivative_tests;
mod external;
mod jerks;
mod journey;
#[cfg(test)]
mod journey_tests;
mod line;
#[cfg(test)]
mod line_contact_tests;
#[cfg(test)]
mod line_start_tests;
#[cfg(test)]
mod line_tests;
mod linear;
mod model;
mod modes;
#[cfg(test)]
mod motor_tests;
mod motors;
#[cfg(test)]
mod parameter_tests;
mod resting;
#[cfg(test)]
mod sideways_tests;
mod start;
#[cfg(test)]
mod start_tests;
mod state;
mod table;
#[cfg(test)]
mod tests;

pub use model::VehicleFmu;

fmi2_export::export!(VehicleFmu);
