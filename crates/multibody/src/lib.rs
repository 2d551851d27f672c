//! Constrained rigid multibody dynamics in body coordinates with Lagrange multipliers (eqs 9-12).
//!
//! A vehicle is data ([`Description`], JSON). [`Model::new`] checks it, merges fixed joints, finds
//! redundant ones and prepares the block-sparse solver; the [`Model`] never changes afterwards. All
//! that changes is a [`State`], a plain value. [`Model::step`] advances it under forces on the
//! magnets, [`Model::equilibrium`] finds where it hangs at rest.
//!
//! # Coordinates
//! Each rigid body has the position r of its centre of mass and a unit quaternion p; velocities are
//! v (world axes) and ω (body axes), so the mass matrix diag(m I, J) is constant. x forward, y left,
//! z up, in a world frame that travels with the vehicle's nominal speed.

#![forbid(unsafe_code)]

mod assembly;
mod block;
mod check;
mod composite;
mod description;
mod dynamics;
mod elements;
mod equilibrium;
mod error;
mod integrate;
mod joint;
pub mod math;
mod model;
mod observe;
mod ordering;
mod state;
#[cfg(test)]
mod tests;
pub mod train;

pub use check::MEETING_TOLERANCE;
pub use description::{
    Body, Bushing, Description, Drive, GROUND, Inertia, Joint, JointForce, JointKind, Magnet,
    Observed, Spring,
};
pub use dynamics::{Loads, Workspace};
pub use equilibrium::{Equilibrium, Holding};
pub use error::{Error, Redundancy};
pub use integrate::LoadCourse;
pub use model::{Counts, Model, Tolerances};
pub use observe::{Energy, Motion};
pub use state::{BodyState, State};
