//! Motion relative to the travelling frame on a line, which turns.
//!
//! Velocities of a state are absolute ones ([`crate::way`]). Small motions about steady curving are those
//! relative to the turning frame, in which the vehicle rests: with u = w − ω × r, ω_r = ω_b − Aᵀω,
//!
//! u̇ = B − ω × (w + v·e_x) − ω̇ × r − ω × u,  ω̇_r = ω̇_b + ω_r × Aᵀω − Aᵀω̇.

use crate::math::{Vec3, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::{BodyState, State};

/// Turning of the travelling frame, in its axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turning {
    /// ω, rad/s.
    spin: Vec3,
    /// ω̇, rad/s².
    spin_rate: Vec3,
    /// v, m/s.
    speed: f64,
}

impl VehicleModel {
    /// The turning of a state's frame, on a line, whose speed changes by an acceleration (m/s²).
    pub(crate) fn turning(&self, state: &State, acceleration: f64) -> Option<Turning> {
        let way = self.way(state.travel)?;
        let frame = &way.frame;
        let spin_rate =
            frame.curvature_rate * (way.speed * way.speed) + frame.curvature * acceleration;
        Some(Turning { spin: way.turning(), spin_rate, speed: way.speed })
    }
}

impl Turning {
    /// u, and ω_r in body axes.
    pub fn relative(&self, body: &BodyState) -> (Vec3, Vec3) {
        let turned = rotation_matrix(body.attitude).tr_mul(&self.spin);
        (body.velocity - self.spin.cross(&body.position), body.angular_velocity - turned)
    }

    /// Gives a body the velocities u and ω_r.
    pub fn set(&self, body: &mut BodyState, velocity: &Vec3, spin: &Vec3) {
        body.velocity = velocity + self.spin.cross(&body.position);
        body.angular_velocity = spin + rotation_matrix(body.attitude).tr_mul(&self.spin);
    }

    /// Rates of u, in the frame's axes, and of ω_r, for the accelerations B and ω̇_b.
    pub fn rates(&self, body: &BodyState, (linear, angular): (Vec3, Vec3)) -> (Vec3, Vec3) {
        let (u, spin) = self.relative(body);
        let carried = body.velocity + Vec3::new(self.speed, 0.0, 0.0);
        let fictitious = self.spin.cross(&(carried + u)) + self.spin_rate.cross(&body.position);
        let axes = rotation_matrix(body.attitude);
        let turned = spin.cross(&axes.tr_mul(&self.spin)) - axes.tr_mul(&self.spin_rate);
        (linear - fictitious, angular + turned)
    }
}
