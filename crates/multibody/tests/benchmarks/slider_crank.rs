//! Every kind of joint in one spatial loop.

use std::f64::consts::TAU;

use multibody::math::{Vec3, from_rotation_vector, rotation_matrix};
use multibody::{JointKind, VehicleDescription};

use crate::common::{G, body, empty, joint, run_free};
use crate::support::{assert_fourth_order, classical};

const Y: Option<[f64; 3]> = Some([0.0, 1.0, 0.0]);
const R: f64 = 0.3;
const ASIDE: f64 = 0.2;
const HEIGHT: f64 = 0.15;
const ROD: f64 = 1.0;

/// Crank on a hinge, with a disc welded to it, ball, rod, ball, slide: one spatial loop with every
/// kind of joint.
fn slider_crank() -> VehicleDescription {
    let mut d = empty("slider-crank");
    let s = slider_of(0.0).0;
    d.bodies.push(body("crank", 2.0, [0.01, 0.05, 0.05], [0.5 * R, ASIDE, 0.0]));
    d.bodies.push(body("disc", 5.0, [0.2, 0.3, 0.2], [0.0, -0.1, 0.0]));
    let pin = Vec3::new(R, ASIDE, 0.0);
    let end = Vec3::new(s, 0.0, HEIGHT);
    let mut rod = body("rod", 1.5, [0.002, 0.12, 0.12], ((pin + end) * 0.5).into());
    // the rod's x axis along the line of its balls
    let along = (end - pin) / ROD;
    let turn = Vec3::x().cross(&along).normalize() * along.x.acos();
    rod.orientation = Some(from_rotation_vector(&turn));
    d.bodies.push(rod);
    d.bodies.push(body("slider", 3.0, [0.1; 3], end.into()));
    d.joints.push(joint("hinge", JointKind::Revolute, ["ground", "crank"], [0.0; 3], Y));
    d.joints.push(joint("weld", JointKind::Bracket, ["crank", "disc"], [0.0; 3], None));
    d.joints.push(joint("big end", JointKind::Spherical, ["crank", "rod"], pin.into(), None));
    d.joints.push(joint("small end", JointKind::Spherical, ["rod", "slider"], end.into(), None));
    let x = Some([1.0, 0.0, 0.0]);
    d.joints.push(joint("slide", JointKind::Translational, ["ground", "slider"], end.into(), x));
    d
}

/// Place of the slider and its derivative by the crank's angle.
fn slider_of(theta: f64) -> (f64, f64) {
    let pin = Vec3::new(R * theta.cos(), ASIDE, -R * theta.sin());
    let moves = Vec3::new(-R * theta.sin(), 0.0, -R * theta.cos());
    let way = (ROD * ROD - ASIDE * ASIDE - (HEIGHT - pin.z).powi(2)).sqrt();
    let line = Vec3::new(way, -ASIDE, HEIGHT - pin.z);
    (pin.x + way, line.dot(&moves) / way)
}

/// Twice the kinetic energy per square of the crank's rate, and the potential energy.
fn slider_crank_energies(theta: f64) -> (f64, f64) {
    let (s, rate) = slider_of(theta);
    let pin = Vec3::new(R * theta.cos(), ASIDE, -R * theta.sin());
    let pin_rate = Vec3::new(-R * theta.sin(), 0.0, -R * theta.cos());
    let (end, end_rate) = (Vec3::new(s, 0.0, HEIGHT), Vec3::new(rate, 0.0, 0.0));
    let crank = 0.05 + 2.0 * (0.5 * R).powi(2) + 0.3;
    let rod = 1.5 * ((pin_rate + end_rate) * 0.5).norm_squared()
        + 0.12 * ((end_rate - pin_rate) / ROD).norm_squared();
    let weight = G * (2.0 * 0.5 * pin.z + 1.5 * 0.5 * (pin.z + end.z));
    (crank + rod + 3.0 * rate * rate, weight)
}

/// One degree of freedom and no loss: the time of a turn is ∮ √(M/(2(E − V))) dθ, by the trapezoidal
/// rule exact to rounding, for the integrand is periodic and smooth. After two turns the mechanism
/// is where it began, as fast as it began.
#[test]
fn analytic_spatial_loop_of_every_joint_returns_after_the_time_of_its_turns() {
    let model = classical(&slider_crank());
    let counts = model.counts();
    // the loop's motion and the rod's spin about itself
    assert_eq!((counts.joints.len(), counts.degrees_of_freedom), (4, 2));
    let omega = 8.0;
    let (inertia, potential) = slider_crank_energies(0.0);
    let energy = 0.5 * inertia * omega * omega + potential;
    let integrand = |theta: f64| {
        let (inertia, potential) = slider_crank_energies(theta);
        (inertia / (2.0 * (energy - potential))).sqrt()
    };
    let period = |n: usize| {
        let sum: f64 = (0..n).map(|k| integrand(TAU * k as f64 / n as f64)).sum();
        sum * TAU / n as f64
    };
    assert!((period(200) - period(400)).abs() < 1e-14);
    let mut ws = model.workspace();
    let mut start = model.initial_state();
    let (_, rate) = slider_of(0.0);
    let pin_rate = Vec3::new(0.0, 0.0, -R * omega);
    let end_rate = Vec3::new(rate * omega, 0.0, 0.0);
    let rod = model.body_index("rod").unwrap();
    let along = rotation_matrix(start.bodies[rod].attitude).column(0).into_owned();
    let spin = along.cross(&((end_rate - pin_rate) / ROD));
    let crank = model.body_index("crank").unwrap();
    start.bodies[crank].angular_velocity.y = omega;
    let centre = start.bodies[crank].position;
    start.bodies[crank].velocity = Vec3::new(0.0, omega, 0.0).cross(&centre);
    start.bodies[rod].velocity = (pin_rate + end_rate) * 0.5;
    start.bodies[rod].angular_velocity = rotation_matrix(start.bodies[rod].attitude).tr_mul(&spin);
    start.bodies[model.body_index("slider").unwrap()].velocity = end_rate;
    let (position, velocity) = model.constraint_violation(&start, &mut ws);
    assert!(position < 1e-14 && velocity < 1e-13, "{position:e} {velocity:e}");
    let t = 2.0 * period(200);
    let errors: Vec<f64> = [200, 400, 800]
        .into_iter()
        .map(|steps| {
            let mut state = start.clone();
            run_free(&model, &mut state, t / f64::from(steps), steps as usize);
            let pairs = state.bodies.iter().zip(&start.bodies);
            pairs
                .map(|(a, b)| {
                    (a.position - b.position).amax().max((a.velocity - b.velocity).amax())
                })
                .fold(0.0, f64::max)
        })
        .collect();
    println!("slider-crank: {errors:?}, period {}", 0.5 * t);
    assert_fourth_order(&errors, 1e-12);
    // energy over 400 turns at some 500 steps a turn
    let begin = model.energy(&start, &mut ws).total();
    let mut state = start.clone();
    run_free(&model, &mut state, 0.005 * t / 5.0, 200_000);
    let drift = model.energy(&state, &mut ws).total() / begin - 1.0;
    println!("slider-crank: energy drift over 200,000 steps of {} s: {drift:e}", 0.001 * t);
    assert!(drift.abs() < 1e-6, "{drift:e}");
    let (position, velocity) = model.constraint_violation(&state, &mut ws);
    assert!(position <= 1e-11 && velocity <= 1e-11, "{position:e} {velocity:e}");
}
