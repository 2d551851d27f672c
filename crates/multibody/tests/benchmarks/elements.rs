//! A body on a bushing, and a spring pendulum.

use std::f64::consts::PI;

use multibody::math::{
    Vec3, conjugate, from_rotation_vector, multiply, rotation_matrix, rotation_vector,
};
use multibody::{Bushing, Spring};
use nalgebra::{DMatrix, DVector, Matrix3};

use crate::common::{G, body, empty};
use crate::support::{after, assert_fourth_order, classical, extrapolated};

/// A body on one bushing with axes that lie askew, attached above its centre and loaded by its
/// weight. For small motions u = (way, turn) about the equilibrium,
/// M ü + Bᵀ C B u̇ + (Bᵀ K B + K_G) u = 0 with B = (I, −p̃), all in closed form by the matrix
/// exponential; K_G is the weight's pendulum stiffness.
#[test]
fn analytic_bushing_held_body_in_six_degrees_of_freedom() {
    let (mass, moments, arm) = (40.0, [2.0, 3.0, 1.5], Vec3::new(0.0, 0.0, 0.3));
    let askew = from_rotation_vector(&Vec3::new(0.4, -0.7, 0.5));
    let axes = rotation_matrix(askew);
    let (k, c) = ([8e4, 5e4, 9e4], [200.0, 300.0, 250.0]);
    let (k_turn, c_turn) = ([4e3; 3], [20.0, 10.0, 15.0]);
    let mut d = empty("held");
    d.bodies.push(body("body", mass, moments, [0.0; 3]));
    d.bushings.push(Bushing {
        name: "bush".to_owned(),
        body_a: "ground".to_owned(),
        body_b: "body".to_owned(),
        position: arm.into(),
        orientation: Some(askew),
        translational_stiffness: k,
        translational_damping: c,
        rotational_stiffness: k_turn,
        rotational_damping: c_turn,
        preload: axes.tr_mul(&Vec3::new(0.0, 0.0, -mass * G)).into(),
    });
    let model = classical(&d);
    let world = |v: [f64; 3]| axes * Matrix3::from_diagonal(&Vec3::from(v)) * axes.transpose();
    let cross = |a: &Vec3| Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0);
    let mut b = DMatrix::zeros(3, 6);
    b.view_mut((0, 0), (3, 3)).copy_from(&Matrix3::identity());
    b.view_mut((0, 3), (3, 3)).copy_from(&-cross(&arm));
    let six = |way: [f64; 3], turn: [f64; 3]| {
        let mut m = b.transpose() * world(way) * &b;
        let mut corner = m.view_mut((3, 3), (3, 3));
        corner += world(turn);
        m
    };
    let mut stiffness = six(k, k_turn);
    // the force m g at the arm's end: moment (θ × p) × F on the body, so −F̃ p̃ … on the left
    let weight = Vec3::new(0.0, 0.0, mass * G);
    let mut corner = stiffness.view_mut((3, 3), (3, 3));
    corner -= cross(&weight) * cross(&arm);
    let damping = six(c, c_turn);
    let inverse = DMatrix::from_diagonal(&DVector::from_vec(vec![
        1.0 / mass,
        1.0 / mass,
        1.0 / mass,
        1.0 / moments[0],
        1.0 / moments[1],
        1.0 / moments[2],
    ]));
    let mut a = DMatrix::zeros(12, 12);
    a.view_mut((0, 6), (6, 6)).copy_from(&DMatrix::identity(6, 6));
    a.view_mut((6, 0), (6, 6)).copy_from(&(-&inverse * stiffness));
    a.view_mut((6, 6), (6, 6)).copy_from(&(-&inverse * damping));
    let t = 0.1;
    let size = 1e-8;
    let first: Vec<f64> = [0.5, -0.3, 0.8, 1.0, -0.6, 0.7, 20.0, -10.0, 15.0, 30.0, 25.0, -20.0]
        .iter()
        .map(|v| v * size)
        .collect();
    let exact = (a * t).exp() * DVector::from_vec(first.clone());
    let mut start = model.initial_state();
    let part = |v: &[f64], k: usize| Vec3::new(v[k], v[k + 1], v[k + 2]);
    start.bodies[0].position = part(&first, 0);
    start.bodies[0].attitude = from_rotation_vector(&part(&first, 3));
    start.bodies[0].velocity = part(&first, 6);
    start.bodies[0].angular_velocity = part(&first, 9);
    let errors: Vec<f64> = [4e-3, 2e-3, 1e-3]
        .into_iter()
        .map(|h| {
            let end = after(&model, &start, h, t);
            let way = end.bodies[0].position - part(exact.as_slice(), 0);
            let turn = rotation_vector(end.bodies[0].attitude) - part(exact.as_slice(), 3);
            way.amax().max(turn.amax()) / size
        })
        .collect();
    println!("bushing-held body: {errors:?} of the amplitude");
    // what is not linear, and rounding of 1e-16 m, leave 1e-7 or less of the amplitude
    assert_fourth_order(&errors, 1e-8);
}

/// A plate hung on a spring by its corner swings, turns over and bounces: against the planar
/// equations of motion, solved to rounding.
#[test]
fn analytic_spring_pendulum_of_large_rotation() {
    let (mass, moment, stiffness, length) = (2.0, 0.3, 80.0, 0.8);
    let arm = (0.35, 0.1);
    let mut d = empty("spring pendulum");
    d.bodies.push(body("plate", mass, [0.2, moment, 0.2], [1.0 - arm.0, 0.0, -arm.1]));
    d.springs.push(Spring {
        name: "spring".to_owned(),
        body_a: "ground".to_owned(),
        position_a: [0.0; 3],
        body_b: "plate".to_owned(),
        position_b: [1.0, 0.0, 0.0],
        stiffness,
        damping: 0.0,
        free_length: Some(length),
    });
    let model = classical(&d);
    // x, z, φ about y (x towards −z), and their rates
    let f = |y: &[f64; 6]| {
        let (sin, cos) = y[2].sin_cos();
        let s = (arm.0 * cos + arm.1 * sin, arm.1 * cos - arm.0 * sin);
        let end = (y[0] + s.0, y[1] + s.1);
        let l = end.0.hypot(end.1);
        let pull = -stiffness * (l - length) / l;
        let force = (pull * end.0, pull * end.1);
        // y component of s × F
        let turn = s.1 * force.0 - s.0 * force.1;
        [y[3], y[4], y[5], force.0 / mass, force.1 / mass - G, turn / moment]
    };
    let t = 4.0;
    let first = [1.0 - arm.0, -arm.1, 0.0, 0.0, 0.0, 6.0];
    let exact = extrapolated(f, first, t, 200);
    let finer = extrapolated(f, first, t, 400);
    assert!((0..3).all(|i| (exact[i] - finer[i]).abs() < 1e-11), "{exact:?} {finer:?}");
    let turned = (0..40).map(|k| extrapolated(f, first, 0.1 * f64::from(k + 1), 10)[2].abs());
    assert!(turned.fold(0.0, f64::max) > PI, "it did not turn over");
    let mut start = model.initial_state();
    start.bodies[0].angular_velocity.y = 6.0;
    let errors: Vec<f64> = [5e-3, 2.5e-3, 1.25e-3]
        .into_iter()
        .map(|h| {
            let end = after(&model, &start, h, t).bodies[0];
            let turn = from_rotation_vector(&Vec3::new(0.0, finer[2], 0.0));
            let off = rotation_vector(multiply(conjugate(turn), end.attitude)).norm();
            let way = end.position - Vec3::new(finer[0], 0.0, finer[1]);
            off.max(way.norm())
        })
        .collect();
    println!("spring pendulum: {errors:?}");
    assert_fourth_order(&errors, 1e-11);
}
