//! The state of a vehicle, and kinematics derived from it.

use serde::{Deserialize, Serialize};

use crate::math::{
    IDENTITY, Mat3, Quat, Vec3, from_rotation_vector, multiply, normalised, rotation_matrix,
};
use crate::way::Travel;

/// Motion of one rigid body (a composite of all bodies joined by brackets).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    /// r: centre of mass in the travelling world frame, m.
    pub position: Vec3,
    /// p: attitude, unit quaternion (w, x, y, z), body to world.
    pub attitude: Quat,
    /// v: velocity of the centre of mass in the travelling world frame, m/s.
    pub velocity: Vec3,
    /// ω: angular velocity in body axes, rad/s.
    pub angular_velocity: Vec3,
}

impl BodyState {
    /// Applies a small displacement and a small rotation in body axes.
    pub(crate) fn displace(&mut self, delta: &[f64]) {
        self.position += Vec3::new(delta[0], delta[1], delta[2]);
        let turn = from_rotation_vector(&Vec3::new(delta[3], delta[4], delta[5]));
        self.attitude = normalised(multiply(self.attitude, turn));
    }
}

/// Everything that changes while stepping. A plain value: a copy is a complete saved state.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Simulated time, s.
    pub time: f64,
    /// One entry per composite body.
    pub bodies: Vec<BodyState>,
    /// Where the travelling frame is; needed on a line only ([`VehicleModel::with_line`](crate::VehicleModel::with_line)).
    pub travel: Option<Travel>,
}

impl Clone for State {
    fn clone(&self) -> Self {
        Self { time: self.time, bodies: self.bodies.clone(), travel: self.travel }
    }

    /// Reuses the memory, so that saving and restoring need not allocate.
    fn clone_from(&mut self, source: &Self) {
        self.time = source.time;
        self.travel = source.travel;
        self.bodies.clone_from(&source.bodies);
    }
}

/// A body's pose and motion as the equations need them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kinematics {
    pub r: Vec3,
    pub p: Quat,
    /// A(p): body to world.
    pub a: Mat3,
    pub v: Vec3,
    /// ω in body axes.
    pub w: Vec3,
    /// ω in world axes.
    pub w_world: Vec3,
}

impl Kinematics {
    /// The ground: at rest at the origin.
    pub fn at_rest() -> Self {
        Self {
            r: Vec3::zeros(),
            p: IDENTITY,
            a: Mat3::identity(),
            v: Vec3::zeros(),
            w: Vec3::zeros(),
            w_world: Vec3::zeros(),
        }
    }

    #[inline]
    pub fn set_pose(&mut self, body: &BodyState) {
        self.r = body.position;
        // intermediate stages are not exactly of unit norm
        self.p = normalised(body.attitude);
        self.a = rotation_matrix(self.p);
    }

    #[inline]
    pub fn set_motion(&mut self, body: &BodyState) {
        self.v = body.velocity;
        self.w = body.angular_velocity;
        self.w_world = self.a * self.w;
    }

    /// A s: a body vector in the world.
    #[inline]
    pub fn turn(&self, local: &Vec3) -> Vec3 {
        self.a * local
    }

    /// Velocity of the body's point at the world arm s from the centre of mass.
    #[inline]
    pub fn velocity_at(&self, arm: &Vec3) -> Vec3 {
        self.v + self.w_world.cross(arm)
    }

    /// ω × (ω × s), the acceleration of a point without v̇ and ω̇.
    #[inline]
    pub fn centripetal(&self, arm: &Vec3) -> Vec3 {
        self.w_world.cross(&self.w_world.cross(arm))
    }
}

/// Force and moment about the centre of mass on one body, world axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wrench {
    pub force: Vec3,
    pub moment: Vec3,
}

impl Wrench {
    pub fn zero() -> Self {
        Self { force: Vec3::zeros(), moment: Vec3::zeros() }
    }

    /// Adds a force that acts at the arm from the centre of mass.
    #[inline]
    pub fn add(&mut self, force: &Vec3, arm: &Vec3) {
        self.force += force;
        self.moment += arm.cross(force);
    }
}
