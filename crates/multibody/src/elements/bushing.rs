//! Bushing: three translational and three rotational spring-dampers along axes fixed to a.

use super::elastic::{ElasticRow, rotation_row, translation_row};
use crate::index::BodyIndex;
use crate::joint::JacobianRow;
use crate::math::{Mat3, Quat, Vec3, conjugate, moment_from_gradient, multiply, rotation_vector};
use crate::state::{Kinematics, Wrench};

/// f = f0 + K d + C ḋ and m = J_l⁻ᵀ(θ) K_θ θ + C_θ ω_rel, both on a, in axes R fixed to a.
///
/// d = Rᵀ(p_b − p_a) and its rate ḋ as seen from a; θ is the rotation vector of b relative to a,
/// ω_rel = Rᵀ(ω_b − ω_a). The force pair acts at b's attachment on both bodies, so the only other
/// load is the torque pair m. With equal stiffness about all axes J_l⁻ᵀ cancels; with different
/// stiffnesses it makes the moment the gradient of ½ θᵀ K_θ θ.
#[derive(Debug, Clone)]
pub(crate) struct BushingElement {
    pub a: BodyIndex,
    pub b: BodyIndex,
    /// R at rest in a's axes; `None` where it is a's own axes.
    pub axes: Option<Box<Mat3>>,
    /// `None` where stiffness, damping and preload are zero. Boxed, because most bushings have only
    /// one of the two.
    pub translation: Option<Box<Translation>>,
    pub rotation: Option<Box<Rotation>>,
}

/// The translational part, along R's axes.
#[derive(Debug, Clone)]
pub(crate) struct Translation {
    /// Attachments in the bodies' axes, m.
    pub point_a: Vec3,
    pub point_b: Vec3,
    pub stiffness: Vec3,
    pub damping: Vec3,
    /// Force on a in the initial pose, N.
    pub preload: Vec3,
}

/// The rotational part, about R's axes.
#[derive(Debug, Clone)]
pub(crate) struct Rotation {
    pub stiffness: Vec3,
    pub damping: Vec3,
    /// Inverse of the relative attitude in the initial pose; `None` where it is the identity.
    pub untwist: Option<Box<Quat>>,
}

impl Translation {
    /// Arms to b's attachment: on a, on b.
    fn arms(&self, a: &Kinematics, b: &Kinematics) -> [Vec3; 2] {
        let arm_b = b.turn(&self.point_b);
        [b.r + arm_b - a.r, arm_b]
    }

    /// d in world axes for the arm on a.
    fn apart(&self, a: &Kinematics, arm_a: &Vec3) -> Vec3 {
        arm_a - a.turn(&self.point_a)
    }
}

impl Rotation {
    fn elastic_moment(&self, theta: &Vec3) -> Vec3 {
        let k = &self.stiffness;
        let gradient = theta.component_mul(k);
        let isotropic = k.x == k.y && k.y == k.z;
        if isotropic { gradient } else { moment_from_gradient(theta, &gradient) }
    }
}

impl BushingElement {
    fn frame(&self, kin: &[Kinematics]) -> Mat3 {
        let a = &kin[self.a].a;
        self.axes.as_ref().map_or(*a, |axes| a * **axes)
    }

    /// Rotation vector of b relative to a, in the bushing's axes.
    fn twist(&self, rotation: &Rotation, kin: &[Kinematics]) -> Vec3 {
        let mut q = multiply(conjugate(kin[self.a].p), kin[self.b].p);
        if let Some(untwist) = &rotation.untwist {
            q = multiply(q, **untwist);
        }
        let theta = rotation_vector(q);
        self.axes.as_ref().map_or(theta, |axes| axes.tr_mul(&theta))
    }

    /// Adds forces and moments of the current pose and motion.
    #[inline]
    pub fn apply(&self, kin: &[Kinematics], wrenches: &mut [Wrench]) {
        let frame = self.frame(kin);
        let (a, b) = (&kin[self.a], &kin[self.b]);
        if let Some(translation) = &self.translation {
            let [arm_a, arm_b] = translation.arms(a, b);
            let d = frame.tr_mul(&translation.apart(a, &arm_a));
            let rate = frame.tr_mul(&(b.velocity_at(&arm_b) - a.velocity_at(&arm_a)));
            let local = translation.preload
                + d.component_mul(&translation.stiffness)
                + rate.component_mul(&translation.damping);
            let force = frame * local;
            wrenches[self.a].add(&force, &arm_a);
            wrenches[self.b].add(&-force, &arm_b);
        }
        if let Some(rotation) = &self.rotation {
            let rate = frame.tr_mul(&(b.w_world - a.w_world));
            let local = rotation.elastic_moment(&self.twist(rotation, kin))
                + rate.component_mul(&rotation.damping);
            let moment = frame * local;
            wrenches[self.a].moment += moment;
            wrenches[self.b].moment -= moment;
        }
    }

    /// Stored energy, f0·d + ½ dᵀ K d + ½ θᵀ K_θ θ, J.
    pub fn energy(&self, kin: &[Kinematics]) -> f64 {
        let mut energy = 0.0;
        if let Some(translation) = &self.translation {
            let [arm_a, _] = translation.arms(&kin[self.a], &kin[self.b]);
            let d = self.frame(kin).tr_mul(&translation.apart(&kin[self.a], &arm_a));
            energy += translation.preload.dot(&d);
            energy += 0.5 * d.dot(&d.component_mul(&translation.stiffness));
        }
        if let Some(rotation) = &self.rotation {
            let theta = self.twist(rotation, kin);
            energy += 0.5 * theta.dot(&theta.component_mul(&rotation.stiffness));
        }
        energy
    }

    /// The elastic coordinates, without the geometric stiffness of the element's load.
    pub fn elastic_rows(&self, kin: &[Kinematics], sink: &mut impl FnMut(ElasticRow)) {
        let frame = self.frame(kin);
        let (a, b) = (self.a, self.b);
        for k in 0..3 {
            let e = frame.column(k).into_owned();
            let mut add = |stiffness: f64, [row_a, row_b]: [JacobianRow; 2]| {
                if stiffness > 0.0 {
                    sink(ElasticRow { a, b, row_a, row_b, stiffness });
                }
            };
            if let Some(translation) = &self.translation {
                let [arm_a, arm_b] = translation.arms(&kin[a], &kin[b]);
                add(translation.stiffness[k], translation_row(kin, a, b, &e, [&arm_a, &arm_b]));
            }
            if let Some(rotation) = &self.rotation {
                add(rotation.stiffness[k], rotation_row(kin, a, b, &e));
            }
        }
    }
}
