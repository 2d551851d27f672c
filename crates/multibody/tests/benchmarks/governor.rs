//! A stiff flyball governor, with the bodies, springs and speed of IFToMM A05.

use std::f64::consts::{FRAC_PI_6, TAU};

use multibody::math::from_rotation_vector;
use multibody::{JointKind, MagnetIndex, Spring, VehicleDescription};

use crate::common::{G, body, empty, joint, tracer};
use crate::support::{after, assert_fourth_order, classical, extrapolated};

/// Bars of 1 m × 1 cm × 1 cm and a slider of 10 cm × 10 cm × 10 cm of 3000 kg/m³.
const BAR: f64 = 0.3;
const ACROSS: f64 = BAR / 12.0 * (1.0 + 1e-4);
const ALONG: f64 = BAR / 12.0 * 2e-4;
const SLIDER: f64 = 3.0;
const SLIDER_INERTIA: f64 = SLIDER * 0.01 / 6.0;
const BALL: f64 = 5.0;
/// Springs from the middle of each arm to the slider.
const STIFFNESS: f64 = 8e5;
const DAMPING: f64 = 4e4;
const FREE: f64 = 0.5;
const MIDDLE: f64 = 0.5;

/// Arm and ball: mass, distance of the centre from the hinge, moment of inertia across about the centre.
fn arm() -> (f64, f64, f64) {
    let mass = BAR + BALL;
    let centre = (0.5 * BAR + BALL) / mass;
    (mass, centre, ACROSS + BAR * (centre - 0.5).powi(2) + BALL * (1.0 - centre).powi(2))
}

/// A shaft on a vertical hinge with its top at the origin, two arms on hinges there, a slider on the shaft.
fn governor() -> VehicleDescription {
    let mut d = empty("governor");
    let (mass, centre, across) = arm();
    // both springs at rest
    let slider = -2.0 * MIDDLE * FRAC_PI_6.cos();
    d.bodies.push(body("shaft", BAR, [ACROSS, ACROSS, ALONG], [0.0, 0.0, -0.5]));
    d.bodies.push(body("slider", SLIDER, [SLIDER_INERTIA; 3], [0.0, 0.0, slider]));
    let (z, y) = (Some([0.0, 0.0, 1.0]), Some([0.0, 1.0, 0.0]));
    d.joints.push(joint("shaft", JointKind::Revolute, ["ground", "shaft"], [0.0; 3], z));
    d.joints.push(joint(
        "slider",
        JointKind::Translational,
        ["shaft", "slider"],
        [0.0, 0.0, slider],
        z,
    ));
    for (name, side) in [("right", 1.0), ("left", -1.0)] {
        let (x, down) = (side * FRAC_PI_6.sin(), FRAC_PI_6.cos());
        let mut it = body(name, mass, [across, across, ALONG], [centre * x, 0.0, -centre * down]);
        it.orientation = Some(from_rotation_vector(&[0.0, -side * FRAC_PI_6, 0.0].into()));
        d.bodies.push(it);
        d.joints.push(joint(name, JointKind::Revolute, ["shaft", name], [0.0; 3], y));
        d.springs.push(Spring {
            name: name.to_owned(),
            body_a: name.to_owned(),
            position_a: [MIDDLE * x, 0.0, -MIDDLE * down],
            body_b: "slider".to_owned(),
            position_b: [0.0, 0.0, slider],
            stiffness: STIFFNESS,
            damping: DAMPING,
            free_length: Some(FREE),
        });
    }
    let (x, down) = (FRAC_PI_6.sin(), FRAC_PI_6.cos());
    d.magnets.push(tracer("right", [x, 0.0, -down]));
    d.magnets.push(tracer("slider", [0.0, 0.0, slider]));
    d
}

/// Lagrange's equations of the shaft's angle φ, the arms' angle α from the vertical and the slider's depth s: rates of
/// [φ, α, s, φ', α', s'].
fn lagrange(y: &[f64; 6]) -> [f64; 6] {
    let [_, alpha, s, spin, opening, sinking] = *y;
    let (mass, centre, across) = arm();
    let hinge = across + mass * centre * centre;
    let (sin, cos) = alpha.sin_cos();
    let inertia = ALONG + SLIDER_INERTIA + 2.0 * (hinge * sin * sin + ALONG * cos * cos);
    let slope = 4.0 * (hinge - ALONG) * sin * cos;
    let length = (MIDDLE * MIDDLE + s * s - 2.0 * MIDDLE * s * cos).sqrt();
    let (by_alpha, by_s) = (MIDDLE * s * sin / length, (s - MIDDLE * cos) / length);
    let force = STIFFNESS * (length - FREE) + DAMPING * (by_alpha * opening + by_s * sinking);
    [
        spin,
        opening,
        sinking,
        -slope * opening * spin / inertia,
        (0.5 * slope * spin * spin - 2.0 * mass * G * centre * sin - 2.0 * force * by_alpha)
            / (2.0 * hinge),
        G - 2.0 * force * by_s / SLIDER,
    ]
}

/// Half a second from 30° and one turn a second: the arms fall, the shaft speeds up. The fastest motion decays with 2·10⁴
/// 1/s, so steps are short.
#[test]
fn analytic_a_stiff_flyball_governor_follows_lagrange() {
    let model = classical(&governor());
    assert_eq!(model.counts().degrees_of_freedom, 4);
    let mut start = model.initial_state();
    // shaft, slider, and the arms, in whose axes the vertical leans
    for (body, lean) in start.bodies.iter_mut().zip([0.0, 0.0, FRAC_PI_6, -FRAC_PI_6]) {
        body.angular_velocity = [TAU * lean.sin(), 0.0, TAU * lean.cos()].into();
        (body.velocity.x, body.velocity.y) = (-TAU * body.position.y, TAU * body.position.x);
    }
    let t = 0.5;
    let begin = [0.0, FRAC_PI_6, 2.0 * MIDDLE * FRAC_PI_6.cos(), TAU, 0.0, 0.0];
    let exact = extrapolated(lagrange, begin, t, 2500);
    let [phi, alpha, s, ..] = exact;
    let mut errors = Vec::new();
    for h in [1e-4, 5e-5] {
        let state = after(&model, &start, h, t);
        let ball = model.magnet(&state, MagnetIndex(0)).position;
        let slider = model.magnet(&state, MagnetIndex(1)).position;
        let (x, y) = (alpha.sin() * phi.cos(), alpha.sin() * phi.sin());
        let error = (ball.x - x).hypot(ball.y - y).hypot(ball.z + alpha.cos()).hypot(slider.z + s);
        println!("h = {h}: {error:e} m of α = {alpha}, s = {s}, φ = {phi}");
        errors.push(error);
    }
    // a motion that would show an error: the arms have moved by more than 3°
    assert!((alpha - FRAC_PI_6).abs() > 0.05);
    // 6e-12 m and 4e-13 m; rounding leaves 3e-13 in half of that step
    assert_fourth_order(&errors, 3e-14);
    assert!(errors[0] < 2e-11, "{errors:?}");
}
