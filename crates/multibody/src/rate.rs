//! Time derivative of a body's state, as summed by the Runge-Kutta schemes.

use crate::math::{Quat, Vec3, rate};
use crate::state::BodyState;

/// Derivative of a body's state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyRate {
    r: Vec3,
    p: Quat,
    v: Vec3,
    w: Vec3,
}

impl BodyRate {
    pub fn zero() -> Self {
        Self { r: Vec3::zeros(), p: [0.0; 4], v: Vec3::zeros(), w: Vec3::zeros() }
    }

    pub fn of(body: &BodyState, v: Vec3, w: Vec3) -> Self {
        Self { r: body.velocity, p: rate(body.attitude, &body.angular_velocity), v, w }
    }

    /// Adds to the rates of position, attitude and velocity.
    pub fn shift(&mut self, r: &Vec3, p: &Quat, v: &Vec3) {
        self.r += r;
        for (a, b) in self.p.iter_mut().zip(p) {
            *a += b;
        }
        self.v += v;
    }

    pub fn add(&mut self, other: &Self, factor: f64) {
        self.r += other.r * factor;
        for (a, b) in self.p.iter_mut().zip(other.p) {
            *a += b * factor;
        }
        self.v += other.v * factor;
        self.w += other.w * factor;
    }
}

impl BodyState {
    pub(crate) fn moved(&self, rate: &BodyRate, h: f64) -> Self {
        let mut attitude = self.attitude;
        for (a, b) in attitude.iter_mut().zip(rate.p) {
            *a += b * h;
        }
        Self {
            position: self.position + rate.r * h,
            attitude,
            velocity: self.velocity + rate.v * h,
            angular_velocity: self.angular_velocity + rate.w * h,
        }
    }
}
