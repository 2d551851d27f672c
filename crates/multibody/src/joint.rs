//! Constraint equations of the joints: Φ (eq. 10), Φ_q (eq. 11) and γ (eq. 12).
//!
//! Velocities of a body are (v, ω), v in world and ω in body axes, so a Jacobian row holds the
//! coefficients of these six. With s the arm from the centre of mass to the joint's point, t1, t2,
//! n the joint's frame and d = p_b − p_a:
//!
//! | joint | equations |
//! |---|---|
//! | spherical | d = 0 |
//! | revolute | d = 0, t1_a·n_b = 0, t2_a·n_b = 0 |
//! | translational | t1_a·d = 0, t2_a·d = 0, t1_a·n_b = 0, t2_a·n_b = 0, t1_a·t2_b = 0 |
//!
//! Brackets are merged before and have no equations here.

use crate::description::JointKind;
use crate::index::BodyIndex;
use crate::math::Vec3;
use crate::places::JointPlaces;
use crate::state::Kinematics;

/// Coefficients of (v, ω) in one equation.
pub(crate) type JacobianRow = [f64; 6];

/// Largest number of equations of a joint that is not merged.
const MOST_EQUATIONS: usize = 5;

/// A joint between two composite bodies; the index after the last body is the ground.
#[derive(Debug, Clone)]
pub(crate) struct JointConstraint {
    pub name: String,
    pub kind: JointKind,
    pub a: BodyIndex,
    pub b: BodyIndex,
    /// The joint's point on either body, in its axes.
    pub point_a: Vec3,
    pub point_b: Vec3,
    /// t1, t2, n on either body, in its axes (zero for spherical joints).
    pub frame_a: [Vec3; 3],
    pub frame_b: [Vec3; 3],
    /// First equation of this joint among all.
    pub row: usize,
}

/// The pairs (frame vector of a, frame vector of b) that stay perpendicular.
const REVOLUTE_PAIRS: [(usize, usize); 2] = [(0, 2), (1, 2)];
const TRANSLATIONAL_PAIRS: [(usize, usize); 3] = [(0, 2), (1, 2), (0, 1)];

fn row(linear: Vec3, angular_world: Vec3, body: &Kinematics) -> JacobianRow {
    let angular = body.a.tr_mul(&angular_world);
    [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
}

impl JointConstraint {
    /// Number of equations.
    pub fn equations(&self) -> usize {
        self.kind.equations()
    }

    fn pairs(&self) -> &'static [(usize, usize)] {
        match self.kind {
            JointKind::Revolute => &REVOLUTE_PAIRS,
            JointKind::Translational => &TRANSLATIONAL_PAIRS,
            JointKind::Spherical | JointKind::Bracket => &[],
        }
    }

    /// Φ.
    pub fn residual(&self, kin: &[Kinematics], out: &mut [f64]) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let d = b.r + b.turn(&self.point_b) - a.r - a.turn(&self.point_a);
        let first = if self.kind == JointKind::Translational {
            out[0] = a.turn(&self.frame_a[0]).dot(&d);
            out[1] = a.turn(&self.frame_a[1]).dot(&d);
            2
        } else {
            out[..3].copy_from_slice(d.as_slice());
            3
        };
        for (value, &(i, k)) in out[first..].iter_mut().zip(self.pairs()) {
            *value = a.turn(&self.frame_a[i]).dot(&b.turn(&self.frame_b[k]));
        }
    }

    /// Φ_q: the rows for a and for b.
    pub fn jacobian(
        &self,
        kin: &[Kinematics],
        rows_a: &mut [JacobianRow],
        rows_b: &mut [JacobianRow],
    ) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let first = if self.kind == JointKind::Translational {
            let arm_b = b.turn(&self.point_b);
            // t·d changes with a's rotation through t as well: the arm on a ends at b's point
            let arm_a = b.r + arm_b - a.r;
            for i in 0..2 {
                let t = a.turn(&self.frame_a[i]);
                rows_a[i] = row(-t, -arm_a.cross(&t), a);
                rows_b[i] = row(t, arm_b.cross(&t), b);
            }
            2
        } else {
            // e·(ω × A s) = (s × Aᵀe)·ω with ω in body axes, and Aᵀe is a row of A
            for i in 0..3 {
                let part = |body: &Kinematics, point: &Vec3| {
                    let m = &body.a;
                    point.cross(&Vec3::new(m[(i, 0)], m[(i, 1)], m[(i, 2)]))
                };
                let (angular_a, angular_b) = (part(a, &self.point_a), part(b, &self.point_b));
                let mut linear = [0.0; 3];
                linear[i] = 1.0;
                let [x, y, z] = linear;
                rows_a[i] = [-x, -y, -z, -angular_a.x, -angular_a.y, -angular_a.z];
                rows_b[i] = [x, y, z, angular_b.x, angular_b.y, angular_b.z];
            }
            3
        };
        for (r, &(i, k)) in self.pairs().iter().enumerate() {
            // d/dt (u_a·w_b) = (ω_b − ω_a)·(w × u)
            let moment = b.turn(&self.frame_b[k]).cross(&a.turn(&self.frame_a[i]));
            rows_a[first + r] = row(Vec3::zeros(), -moment, a);
            rows_b[first + r] = row(Vec3::zeros(), moment, b);
        }
    }

    /// Φ_q into the blocks of a matrix.
    pub fn store_jacobian(&self, kin: &[Kinematics], places: &JointPlaces, matrix: &mut [f64]) {
        let n = self.equations();
        let mut rows = [[JacobianRow::default(); MOST_EQUATIONS]; 2];
        let [rows_a, rows_b] = &mut rows;
        self.jacobian(kin, &mut rows_a[..n], &mut rows_b[..n]);
        for (place, rows) in places.iter().zip(&rows) {
            let Some(place) = place else { continue };
            let block = &mut matrix[place.offset as usize..][..6 * n];
            if place.as_asked {
                for (r, row) in rows[..n].iter().enumerate() {
                    for (c, value) in row.iter().enumerate() {
                        block[c * n + r] = *value;
                    }
                }
            } else {
                block.copy_from_slice(rows[..n].as_flattened());
            }
        }
    }

    /// Φ̇ = Φ_q (v, ω).
    pub fn rate(&self, kin: &[Kinematics], out: &mut [f64]) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let (arm_a, arm_b) = (a.turn(&self.point_a), b.turn(&self.point_b));
        let speed = b.velocity_at(&arm_b) - a.velocity_at(&arm_a);
        let first = if self.kind == JointKind::Translational {
            let d = b.r + arm_b - a.r - arm_a;
            for (i, value) in out[..2].iter_mut().enumerate() {
                let t = a.turn(&self.frame_a[i]);
                *value = a.w_world.cross(&t).dot(&d) + t.dot(&speed);
            }
            2
        } else {
            out[..3].copy_from_slice(speed.as_slice());
            3
        };
        let spin = b.w_world - a.w_world;
        for (value, &(i, k)) in out[first..].iter_mut().zip(self.pairs()) {
            *value = spin.dot(&b.turn(&self.frame_b[k]).cross(&a.turn(&self.frame_a[i])));
        }
    }

    /// γ = −(Φ̈ without accelerations).
    pub fn gamma(&self, kin: &[Kinematics], out: &mut [f64]) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let (arm_a, arm_b) = (a.turn(&self.point_a), b.turn(&self.point_b));
        let bend = b.centripetal(&arm_b) - a.centripetal(&arm_a);
        let first = if self.kind == JointKind::Translational {
            let d = b.r + arm_b - a.r - arm_a;
            let rate = b.velocity_at(&arm_b) - a.velocity_at(&arm_a);
            for (i, value) in out[..2].iter_mut().enumerate() {
                let t = a.turn(&self.frame_a[i]);
                let turned = a.w_world.cross(&t);
                *value = -(a.centripetal(&t).dot(&d) + 2.0 * turned.dot(&rate) + t.dot(&bend));
            }
            2
        } else {
            out[..3].copy_from_slice((-bend).as_slice());
            3
        };
        for (value, &(i, k)) in out[first..].iter_mut().zip(self.pairs()) {
            let (u, w) = (a.turn(&self.frame_a[i]), b.turn(&self.frame_b[k]));
            *value = -(a.centripetal(&u).dot(&w)
                + 2.0 * a.w_world.cross(&u).dot(&b.w_world.cross(&w))
                + u.dot(&b.centripetal(&w)));
        }
    }

    /// Force and moment on b that the multipliers of this joint represent, world axes.
    pub fn reaction(&self, kin: &[Kinematics], multipliers: &[f64]) -> (Vec3, Vec3) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let mut force = Vec3::zeros();
        let mut moment = Vec3::zeros();
        let first = if self.kind == JointKind::Translational {
            force += a.turn(&self.frame_a[0]) * multipliers[0];
            force += a.turn(&self.frame_a[1]) * multipliers[1];
            2
        } else {
            force += Vec3::new(multipliers[0], multipliers[1], multipliers[2]);
            3
        };
        for (value, &(i, k)) in multipliers[first..].iter().zip(self.pairs()) {
            moment += b.turn(&self.frame_b[k]).cross(&a.turn(&self.frame_a[i])) * *value;
        }
        (-force, -moment)
    }

    /// Displacement along the axis (translational) or angle about it (revolute, in (−π, π]), and
    /// its rate.
    pub fn coordinate(&self, kin: &[Kinematics]) -> (f64, f64) {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let n = a.turn(&self.frame_a[2]);
        if self.kind == JointKind::Translational {
            let arm_b = b.turn(&self.point_b);
            let point = b.r + arm_b;
            let d = point - a.r - a.turn(&self.point_a);
            // n turns with a, hence a's velocity at b's point
            let rate = b.velocity_at(&arm_b) - a.velocity_at(&(point - a.r));
            (n.dot(&d), n.dot(&rate))
        } else {
            let t1_b = b.turn(&self.frame_b[0]);
            let (t1, t2) = (a.turn(&self.frame_a[0]), a.turn(&self.frame_a[1]));
            (t1_b.dot(&t2).atan2(t1_b.dot(&t1)), n.dot(&(b.w_world - a.w_world)))
        }
    }
}
