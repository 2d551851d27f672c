//! Jacobians and γ against automatic differentiation: Φ written out once more in numbers that carry
//! their first two derivatives in time (dual numbers of second order), so free of any step size.

use std::ops::{Add, Mul, Sub};

use super::{Noise, crooked, disturbed, velocity};
use crate::description::JointKind;
use crate::joint::JointConstraint;
use crate::math::{Mat3, Vec3, conjugate, cross_matrix, rotation_matrix};
use crate::state::Kinematics;
use crate::{Loads, VehicleModel};

/// a + a' t + a'' t²/2.
#[derive(Clone, Copy)]
struct Jet(f64, f64, f64);

impl Add for Jet {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1, self.2 + b.2)
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Self(self.0 - b.0, self.1 - b.1, self.2 - b.2)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self(
            self.0 * b.0,
            self.1 * b.0 + self.0 * b.1,
            self.2 * b.0 + 2.0 * self.1 * b.1 + self.0 * b.2,
        )
    }
}

type Jets = [Jet; 3];

fn dot(a: Jets, b: Jets) -> Jet {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: Jets, b: Jets) -> Jets {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A s of a body that turns on at its present ω: A (1 + ω̃ t + ω̃² t²/2) s.
fn direction(body: &Kinematics, s: &Vec3) -> Jets {
    let spin: Mat3 = cross_matrix(&body.w);
    let parts = [body.a * s, body.a * spin * s, body.a * spin * spin * s];
    [0, 1, 2].map(|i| Jet(parts[0][i], parts[1][i], parts[2][i]))
}

/// A point of a body that moves on at its present v and ω.
fn point(body: &Kinematics, s: &Vec3) -> Jets {
    let arm = direction(body, s);
    [0, 1, 2].map(|i| Jet(body.r[i], body.v[i], 0.0) + arm[i])
}

/// Φ of one joint.
fn constraints(joint: &JointConstraint, kin: &[Kinematics]) -> Vec<Jet> {
    let (a, b) = (&kin[joint.a], &kin[joint.b]);
    let d = minus(point(b, &joint.point_b), point(a, &joint.point_a));
    let [t1, t2, _] = joint.frame_a.map(|e| direction(a, &e));
    let [_, u2, n] = joint.frame_b.map(|e| direction(b, &e));
    match joint.kind {
        JointKind::Translational => {
            vec![dot(t1, d), dot(t2, d), dot(t1, n), dot(t2, n), dot(t1, u2)]
        }
        JointKind::Revolute => vec![d[0], d[1], d[2], dot(t1, n), dot(t2, n)],
        JointKind::Spherical | JointKind::Bracket => d.to_vec(),
    }
}

/// Φ̇ = Φ_q (v, ω) and Φ̈ = −γ where nothing accelerates, for every joint of the crooked train.
#[test]
fn analytic_jacobian_and_gamma_agree_with_dual_numbers() {
    let model = VehicleModel::new(&crooked()).unwrap();
    let mut ws = model.workspace();
    let state = disturbed(&model, 0.1, &mut Noise(17));
    let zero = vec![0.0; 64];
    let loads = Loads { vertical: &zero, lateral: &zero };
    let (_, jacobian, rhs) = model.dense_system(&state, &loads, &mut ws);
    let v = velocity(&state);
    let rates = &jacobian * &v;
    let (mut first, mut second) = (0.0_f64, 0.0_f64);
    for joint in &model.joints {
        for (r, jet) in constraints(joint, &ws.kin).iter().enumerate() {
            let row = joint.row + r;
            first = first.max((jet.1 - rates[row]).abs());
            second = second.max((jet.2 + rhs[v.len() + row]).abs());
        }
    }
    // some 30 roundings of terms of up to 10 m/s and 30 m/s²
    assert!(first < 1e-13, "{first:e}");
    assert!(second < 1e-12, "{second:e}");
    assert!(rates.amax() > 1e-2 && rhs.rows(v.len(), model.rows).amax() > 1e-2, "nothing moves");
}

/// ½ (v, ω)ᵀ M (v, ω) is the kinetic energy of the described bodies, each by its own mass, inertia
/// and motion, whatever moves: so M is right, with all that brackets tie together.
#[test]
fn analytic_mass_matrix_is_the_kinetic_energy_of_the_described_bodies() {
    let description = crooked();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let zero = vec![0.0; 64];
    let loads = Loads { vertical: &zero, lateral: &zero };
    for seed in 30..40 {
        let state = disturbed(&model, 0.1, &mut Noise(seed));
        let (mass, ..) = model.dense_system(&state, &loads, &mut ws);
        let v = velocity(&state);
        let mut energy = 0.0;
        for (body, member) in description.bodies.iter().zip(&model.members) {
            let Some(motion) = state.bodies.get(member.composite.0) else { continue };
            let kin = &ws.kin[member.composite];
            let speed = kin.v + kin.turn(&motion.angular_velocity.cross(&member.offset));
            let spin = rotation_matrix(conjugate(member.twist)) * motion.angular_velocity;
            energy += 0.5 * body.mass * speed.norm_squared();
            energy += 0.5 * spin.dot(&(body.inertia.matrix() * spin));
        }
        // sums of some 300 positive terms
        let quadratic = 0.5 * v.dot(&(&mass * &v));
        assert!((quadratic - energy).abs() < 1e-13 * energy, "{quadratic} {energy}");
        assert_eq!(mass, mass.transpose());
        assert!(mass.cholesky().is_some());
    }
}
