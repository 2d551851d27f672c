//! Points on the bodies: where magnets and the drive act, and where motion is observed.

use crate::index::{BodyIndex, MemberIndex};
use crate::math::Vec3;

/// A point on a composite body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Anchor {
    pub body: BodyIndex,
    /// In the body's axes from its centre of mass, m.
    pub local: Vec3,
    /// In the world in the initial pose, m.
    pub start: Vec3,
}

/// The drive: a spring and damper along the track at each driven body.
#[derive(Debug, Clone)]
pub(crate) struct DriveForce {
    /// Centres of mass of the driven bodies.
    pub anchors: Vec<Anchor>,
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    pub damping: f64,
}

/// A body whose motion is observed.
#[derive(Debug, Clone)]
pub(crate) struct WatchedBody {
    pub name: String,
    pub member: MemberIndex,
    pub points: Vec<Anchor>,
}
