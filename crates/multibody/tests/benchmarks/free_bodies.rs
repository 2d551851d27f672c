//! Gyroscopes.

use multibody::State;
use multibody::math::{
    Vec3, conjugate, from_rotation_vector, multiply, rotation_matrix, rotation_vector,
};

use crate::common::{body, empty, run_free};
use crate::support::{after, assert_fourth_order, classical};

/// A body with two equal moments, free of forces: its axis goes round the moment of momentum with
/// L/I₁, and it spins about itself with ω₃ (1 − I₃/I₁).
#[test]
fn analytic_symmetric_gyroscope() {
    let mut d = empty("top");
    d.gravity = [0.0; 3];
    d.bodies.push(body("top", 2.0, [1.2, 1.2, 2.0], [0.0; 3]));
    let model = classical(&d);
    let mut start = model.initial_state();
    let omega = Vec3::new(2.0, 0.0, 5.0);
    start.bodies[0].angular_velocity = omega;
    let t = 4.0;
    let momentum = Vec3::new(1.2 * omega.x, 0.0, 2.0 * omega.z);
    let precession = from_rotation_vector(&(momentum * (t / 1.2)));
    let spin = from_rotation_vector(&Vec3::new(0.0, 0.0, omega.z * (1.0 - 2.0 / 1.2) * t));
    let exact = multiply(precession, spin);
    let errors: Vec<f64> = [10e-3, 5e-3, 2.5e-3]
        .into_iter()
        .map(|h| {
            let end = after(&model, &start, h, t);
            rotation_vector(multiply(conjugate(exact), end.bodies[0].attitude)).norm()
        })
        .collect();
    println!("symmetric gyroscope: {errors:?}");
    assert_fourth_order(&errors, 1e-13);
}

/// Turning about the middle axis, a body tumbles over and over. Over 10 minutes of it (600,000 steps,
/// some hundred tumbles) momentum stays, and energy and moment of momentum are lost no faster than
/// RK4 must, (ωh)⁶/72 a step.
#[test]
fn invariant_tumbling_gyroscope_over_a_long_run() {
    let mut d = empty("tumbling");
    d.gravity = [0.0; 3];
    d.bodies.push(body("top", 2.0, [1.0, 2.0, 2.5], [0.0; 3]));
    let model = classical(&d);
    let mut state = model.initial_state();
    state.bodies[0].velocity = Vec3::new(1.0, -2.0, 3.0);
    state.bodies[0].angular_velocity = Vec3::new(0.01, 3.0, 0.02);
    let (p0, _) = model.momentum(&state);
    let moment = |s: &State| {
        rotation_matrix(s.bodies[0].attitude)
            * Vec3::from([1.0, 2.0, 2.5]).component_mul(&s.bodies[0].angular_velocity)
    };
    let (l0, e0) = (moment(&state), model.kinetic_energy(&state));
    let mut turned = 0;
    let mut side = 1.0;
    for _ in 0..600 {
        run_free(&model, &mut state, 1e-3, 1000);
        let now = state.bodies[0].angular_velocity.y.signum();
        turned += usize::from(now != side);
        side = now;
    }
    let p = (model.momentum(&state).0 - p0).norm() / p0.norm();
    let l = (moment(&state) - l0).norm() / l0.norm();
    let e = model.kinetic_energy(&state) / e0 - 1.0;
    println!(
        "gyroscope over 600 s at 1 ms: momentum {p:e}, moment {l:e}, energy {e:e}, {turned} tumbles"
    );
    assert!(turned > 20, "{turned}");
    // without force the momentum takes no rounding at all; the attitude's phase error turns L by
    // (ωh)⁵/120 a step, 1e-15, and 6e5 steps; the energy's is (ωh)⁶/72 and rounding
    assert!(p == 0.0 && l < 6e-9 && e.abs() < 1e-10, "{p:e} {l:e} {e:e}");
}
