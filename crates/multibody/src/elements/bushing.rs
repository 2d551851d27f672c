//! Bushing: three translational and three rotational spring-dampers along axes fixed to a.

use crate::elements::{ElasticRow, rotation_row, translation_row};
use crate::math::{Mat3, Quat, Vec3, conjugate, moment_from_gradient, multiply, rotation_vector};
use crate::state::{Kinematics, Wrench};

/// f = f0 + K d + C ḋ and m = J_l⁻ᵀ(θ) K_θ θ + C_θ ω_rel, both on a, in axes R fixed to a.
///
/// d = Rᵀ(p_b − p_a) and its rate ḋ as seen from a; θ is the rotation vector of b relative to a,
/// ω_rel = Rᵀ(ω_b − ω_a). The force pair acts at b's attachment on both bodies, so nothing but the
/// torque pair m is exchanged besides. With equal stiffness about all axes J_l⁻ᵀ drops out; with
/// different ones it makes the moment the gradient of ½ θᵀ K_θ θ.
#[derive(Debug, Clone)]
pub(crate) struct Bushing {
    pub a: usize,
    pub b: usize,
    /// Attachments in the bodies' axes, m.
    pub point_a: Vec3,
    pub point_b: Vec3,
    /// R at rest in a's axes; `None` where it is a's own axes.
    pub axes: Option<Mat3>,
    /// Undoes the relative attitude of the initial pose; `None` where there is none.
    pub untwist: Option<Quat>,
    pub translational_stiffness: Vec3,
    pub translational_damping: Vec3,
    pub rotational_stiffness: Vec3,
    pub rotational_damping: Vec3,
    /// Force on a in the initial pose, bushing axes, N.
    pub preload: Vec3,
    /// Which halves do anything.
    pub translates: bool,
    pub rotates: bool,
    /// Equal rotational stiffness about all axes.
    pub isotropic: bool,
}

impl Bushing {
    fn frame(&self, kin: &[Kinematics]) -> Mat3 {
        let a = &kin[self.a].a;
        self.axes.as_ref().map_or(*a, |axes| a * axes)
    }

    /// Rotation vector of b relative to a, in the bushing's axes.
    fn twist(&self, kin: &[Kinematics]) -> Vec3 {
        let mut q = multiply(conjugate(kin[self.a].p), kin[self.b].p);
        if let Some(untwist) = self.untwist {
            q = multiply(q, untwist);
        }
        let theta = rotation_vector(q);
        self.axes.as_ref().map_or(theta, |axes| axes.tr_mul(&theta))
    }

    fn elastic_moment(&self, theta: &Vec3) -> Vec3 {
        let gradient = theta.component_mul(&self.rotational_stiffness);
        if self.isotropic { gradient } else { moment_from_gradient(theta, &gradient) }
    }

    /// Adds forces and moments of the current pose and motion.
    #[inline]
    pub fn apply(&self, kin: &[Kinematics], wrenches: &mut [Wrench]) {
        let frame = self.frame(kin);
        let (a, b) = (&kin[self.a], &kin[self.b]);
        if self.translates {
            let arm_b = b.turn(&self.point_b);
            let arm_a = b.r + arm_b - a.r;
            let d = frame.tr_mul(&(arm_a - a.turn(&self.point_a)));
            let rate = frame.tr_mul(&(b.velocity_at(&arm_b) - a.velocity_at(&arm_a)));
            let local = self.preload
                + d.component_mul(&self.translational_stiffness)
                + rate.component_mul(&self.translational_damping);
            let force = frame * local;
            wrenches[self.a].add(&force, &arm_a);
            wrenches[self.b].add(&-force, &arm_b);
        }
        if self.rotates {
            let rate = frame.tr_mul(&(b.w_world - a.w_world));
            let local = self.elastic_moment(&self.twist(kin))
                + rate.component_mul(&self.rotational_damping);
            let moment = frame * local;
            wrenches[self.a].moment += moment;
            wrenches[self.b].moment -= moment;
        }
    }

    /// Stored energy, f0·d + ½ dᵀ K d + ½ θᵀ K_θ θ, J.
    pub fn energy(&self, kin: &[Kinematics]) -> f64 {
        let (a, b) = (&kin[self.a], &kin[self.b]);
        let apart = b.r + b.turn(&self.point_b) - a.r - a.turn(&self.point_a);
        let d = self.frame(kin).tr_mul(&apart);
        let theta = self.twist(kin);
        self.preload.dot(&d)
            + 0.5 * d.dot(&d.component_mul(&self.translational_stiffness))
            + 0.5 * theta.dot(&theta.component_mul(&self.rotational_stiffness))
    }

    /// The elastic coordinates, without the geometric stiffness of what the element carries.
    pub fn elastic_rows(&self, kin: &[Kinematics], sink: &mut impl FnMut(ElasticRow)) {
        let frame = self.frame(kin);
        let arm_b = kin[self.b].turn(&self.point_b);
        let arm_a = kin[self.b].r + arm_b - kin[self.a].r;
        for k in 0..3 {
            let e = frame.column(k).into_owned();
            for (stiffness, [row_a, row_b]) in [
                (
                    self.translational_stiffness[k],
                    translation_row(kin, self.a, self.b, &e, [&arm_a, &arm_b]),
                ),
                (self.rotational_stiffness[k], rotation_row(kin, self.a, self.b, &e)),
            ] {
                if stiffness > 0.0 {
                    sink(ElasticRow { a: self.a, b: self.b, row_a, row_b, stiffness });
                }
            }
        }
    }
}
