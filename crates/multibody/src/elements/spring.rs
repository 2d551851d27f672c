//! Spring-damper on the line between two points.

use super::elastic::{ElasticRow, translation_row};
use crate::index::BodyIndex;
use crate::math::Vec3;
use crate::state::{Kinematics, Wrench};

/// f = k (l − l0) + c l̇, a pull along the line between the points.
#[derive(Debug, Clone)]
pub(crate) struct SpringElement {
    pub a: BodyIndex,
    pub b: BodyIndex,
    /// Ends in the bodies' axes, m.
    pub point_a: Vec3,
    pub point_b: Vec3,
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    pub damping: f64,
    /// l0, m.
    pub free_length: f64,
}

impl SpringElement {
    /// Arms of both ends, unit vector from a to b, length.
    fn line(&self, kin: &[Kinematics]) -> (Vec3, Vec3, Vec3, f64) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let (arm_a, arm_b) = (a.turn(&self.point_a), b.turn(&self.point_b));
        let line = b.r + arm_b - a.r - arm_a;
        let length = line.norm();
        (arm_a, arm_b, line / length, length)
    }

    /// Adds the force pair. A length of zero has no direction and ends as NaN, which the solver
    /// reports.
    pub fn apply(&self, kin: &[Kinematics], wrenches: &mut [Wrench]) {
        let (arm_a, arm_b, e, length) = self.line(kin);
        let rate = e.dot(&(kin[self.b].velocity_at(&arm_b) - kin[self.a].velocity_at(&arm_a)));
        let pull = e * (self.stiffness * (length - self.free_length) + self.damping * rate);
        wrenches[self.a].add(&pull, &arm_a);
        wrenches[self.b].add(&-pull, &arm_b);
    }

    /// Stored energy, J.
    pub fn energy(&self, kin: &[Kinematics]) -> f64 {
        let (.., length) = self.line(kin);
        0.5 * self.stiffness * (length - self.free_length).powi(2)
    }

    /// The elastic coordinate: the length.
    pub fn elastic_rows(&self, kin: &[Kinematics], sink: &mut impl FnMut(ElasticRow)) {
        let (arm_a, arm_b, e, _) = self.line(kin);
        let [row_a, row_b] = translation_row(kin, self.a, self.b, &e, [&arm_a, &arm_b]);
        sink(ElasticRow { a: self.a, b: self.b, row_a, row_b, stiffness: self.stiffness });
    }
}
