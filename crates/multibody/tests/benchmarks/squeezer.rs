//! Andrews' squeezing mechanism.

use std::f64::consts::{FRAC_PI_2, TAU};

use multibody::math::{Vec3, conjugate, from_rotation_vector, multiply, rotation_vector};
use multibody::{
    Body, BodyIndex, JointForce, JointKind, Loads, Spring, State, VehicleDescription, VehicleModel,
};

use crate::common::{body, empty, joint, tracer};
use crate::support::{after, assert_fourth_order, classical};

const Z: Option<[f64; 3]> = Some([0.0, 0.0, 1.0]);

/// Angles of the initial position: β, Θ, γ, Φ, δ, Ω, ε.
const SQUEEZER_START: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.455_279_819_163_070_4,
    0.222_668_390_165_885_9,
    0.487_364_979_543_842_55,
    -0.222_668_390_165_885_9,
    1.230_547_444_549_821_2,
];
/// The test set's reference at 0.03 s: angles, their rates, and the six multipliers.
///
/// Its last digits are off: the test set's own equations of seven relative angles, integrated by
/// Dormand and Prince's method of order 8 with tolerances of 3e-14, give β = 15.810771195154 and
/// β̇ = 1139.9203022591, and so does this model in steps of 1 µs (β̇ = 1139.9203022591). That is
/// 1.1e-9 rad beside the reference.
const SQUEEZER_ANGLES: [f64; 7] = [
    15.810_771_196_299_04,
    -15.756_371_059_842_98,
    0.040_822_240_130_731_01,
    -0.534_730_116_322_694_8,
    0.524_409_965_880_530_4,
    0.534_730_116_322_694_8,
    1.048_080_741_042_263,
];
const SQUEEZER_RATES: [f64; 7] = [
    1_139.920_302_151_208,
    -1_424.379_294_994_111,
    11.032_912_219_371_34,
    19.293_374_644_213_85,
    0.573_569_928_479_080_8,
    -19.293_374_644_213_85,
    0.323_179_165_802_695_5,
];
const SQUEEZER_MULTIPLIERS: [f64; 6] = [
    199.175_333_373_191,
    -29.755_312_280_150_52,
    23.066_541_190_983_99,
    31.452_713_654_759_27,
    22.642_492_320_827_39,
    11.617_407_000_196_73,
];

/// The multipliers of the integration that the angles' comment speaks of.
const SQUEEZER_RECOMPUTED: [f64; 6] = [
    199.175_348_104_5,
    -29.755_309_975_0,
    23.066_543_611_6,
    31.452_725_275_8,
    22.642_494_786_4,
    11.617_392_352_6,
];

/// A body in the plane: centre, attitude about z, moment about z; the others are arbitrary.
fn planar(name: &str, mass: f64, moment: f64, centre: [f64; 2], angle: f64, slender: bool) -> Body {
    let about_length = if slender { 0.5 * moment } else { moment };
    let mut new = body(name, mass, [about_length, moment, moment], [centre[0], centre[1], 0.0]);
    new.orientation = Some(from_rotation_vector(&Vec3::new(0.0, 0.0, angle)));
    new
}

/// Andrews' squeezing mechanism (E. Hairer and G. Wanner, Solving Ordinary Differential Equations
/// II, section VII.7; Test Set for IVP Solvers, problem "andrews"), in the x-y plane. Seven bodies
/// with ten hinges in the plane; in space, what turns on the ground has hinges, and the three links
/// that close the loops have a ball at either end: nothing is constrained twice. Their spin about
/// themselves is free and stays zero, for their centres lie on the line between the balls.
fn squeezer() -> VehicleDescription {
    let [beta, theta, gamma, phi, delta, omega, epsilon] = SQUEEZER_START;
    let at = |from: [f64; 2], length: f64, angle: f64| {
        [from[0] + length * angle.cos(), from[1] + length * angle.sin()]
    };
    let a = [-0.06934, -0.00227];
    let b = [-0.03635, 0.03273];
    let c = [0.014, 0.072, 0.0];
    let crank = at([0.0; 2], 7e-3, beta);
    let p = at(crank, -28e-3, beta + theta);
    let e = at(a, 4e-2, delta);
    let h = at(a, 4e-2, epsilon - FRAC_PI_2);
    let (link_4, link_6) = (phi + delta - FRAC_PI_2, omega + epsilon);
    let mut d = empty("squeezer");
    d.gravity = [0.0; 3];
    d.bodies = vec![
        planar("k1", 0.04325, 2.194e-6, at([0.0; 2], 92e-5, beta), beta, false),
        planar("k2", 0.00365, 4.410e-7, at(crank, -115e-4, beta + theta), beta + theta, true),
        planar(
            "k3",
            0.02373,
            5.255e-6,
            at(at(b, 1043e-5, gamma), 1874e-5, gamma - FRAC_PI_2),
            gamma,
            false,
        ),
        planar("k4", 0.00706, 5.667e-7, at(e, 2e-2 - 1421e-5, link_4), link_4, true),
        planar(
            "k5",
            0.07050,
            1.169e-5,
            at(at(a, 2308e-5, delta), 916e-5, delta + FRAC_PI_2),
            delta,
            false,
        ),
        planar("k6", 0.00706, 5.667e-7, at(h, 2e-2 - 1421e-5, link_6), link_6, true),
        planar(
            "k7",
            0.05498,
            1.912e-5,
            at(at(a, 1228e-5, epsilon - FRAC_PI_2), 449e-5, epsilon),
            epsilon,
            false,
        ),
    ];
    let hinge = |name: &str, x: [f64; 2]| {
        joint(name, JointKind::Revolute, ["ground", name], [x[0], x[1], 0.0], Z)
    };
    let ball = |name: &str, ends: [&str; 2], x: [f64; 2]| {
        joint(name, JointKind::Spherical, ends, [x[0], x[1], 0.0], None)
    };
    d.joints = vec![
        hinge("k1", [0.0; 2]),
        hinge("k3", b),
        hinge("k5", a),
        hinge("k7", a),
        ball("k1-k2", ["k1", "k2"], crank),
        ball("k2-k3", ["k2", "k3"], p),
        ball("k5-k4", ["k5", "k4"], e),
        ball("k4-k3", ["k4", "k3"], p),
        ball("k7-k6", ["k7", "k6"], h),
        ball("k6-k3", ["k6", "k3"], p),
    ];
    d.joint_forces.push(JointForce {
        joint: "k1".to_owned(),
        stiffness: 0.0,
        damping: 0.0,
        preload: 0.033,
    });
    let hook = at(at(b, 2e-2, gamma), 18e-3, gamma - FRAC_PI_2);
    d.springs.push(Spring {
        name: "spring".to_owned(),
        body_a: "ground".to_owned(),
        position_a: c,
        body_b: "k3".to_owned(),
        position_b: [hook[0], hook[1], 0.0],
        stiffness: 4530.0,
        damping: 0.0,
        free_length: Some(0.07785),
    });
    d.magnets.push(tracer("k3", [p[0], p[1], 0.0]));
    d
}

/// Absolute angles of the seven bodies and their rates, from the test set's relative ones. Attitudes
/// count from what `squeezer` calls a body's own x axis.
fn absolute(q: &[f64; 7]) -> [f64; 7] {
    [q[0], q[0] + q[1], q[2], q[3] + q[4], q[4], q[5] + q[6], q[6]]
}

/// The largest differences in angles (rad, whole turns left aside) and their rates (rad/s).
fn squeezer_errors(model: &VehicleModel, state: &State) -> (f64, f64) {
    let start = model.initial_state();
    let (first, angles) = (absolute(&SQUEEZER_START), absolute(&SQUEEZER_ANGLES));
    let rates = absolute(&SQUEEZER_RATES);
    let mut worst = (0.0_f64, 0.0_f64);
    for k in 0..7 {
        let turn = multiply(conjugate(start.bodies[k].attitude), state.bodies[k].attitude);
        let off = rotation_vector(turn).z - (angles[k] - first[k]);
        worst.0 = worst.0.max((off - TAU * (off / TAU).round()).abs());
        worst.1 = worst.1.max((state.bodies[k].angular_velocity.z - rates[k]).abs());
    }
    worst
}

/// Angles, rates and joint forces at 0.03 s, to the digits of the reference.
#[test]
fn golden_squeezing_mechanism_of_andrews() {
    let model = classical(&squeezer());
    // one degree of freedom, and three spins of links
    assert_eq!(model.counts().degrees_of_freedom, 4);
    let start = model.initial_state();
    let at = |h| after(&model, &start, h, 0.03);
    let crank = |state: &State| {
        let turn = multiply(conjugate(start.bodies[0].attitude), state.bodies[0].attitude);
        let off = rotation_vector(turn).z - (15.810_771_195_154 - SQUEEZER_START[0]);
        (off - TAU * (off / TAU).round()).abs()
    };
    let errors: Vec<f64> = [6e-5, 3e-5, 1.5e-5].iter().map(|h| crank(&at(*h))).collect();
    println!("squeezer: {errors:?}");
    assert_fourth_order(&errors, 1e-11);
    let state = at(2e-6);
    let (angles, rates) = squeezer_errors(&model, &state);
    println!("squeezer at 2 us: {angles:e} rad, {rates:e} rad/s");
    // the reference's own error, see there; the rates follow with some 500 1/s
    assert!(angles < 1.3e-9 && rates < 7e-7, "{angles:e} {rates:e}");
    assert!(crank(&state) < 5e-12, "{:e}", crank(&state));
    let rate = state.bodies[0].angular_velocity.z;
    assert!((rate - 1_139.920_302_259_1).abs() < 1e-9, "{rate}");
    // the joints' forces are the multipliers: link 4 and link 6 on body 3, and 2 against all three
    let mut ws = model.workspace();
    let none = Loads { vertical: &[0.0], lateral: &[0.0] };
    let mut force = |name: &str| model.reaction(name, &state, &none, &mut ws).unwrap().force;
    // published to 7 digits (the reference's error again), recomputed to 10
    for (l, tolerance) in [(SQUEEZER_MULTIPLIERS, 5e-5), (SQUEEZER_RECOMPUTED, 1e-7)] {
        for (name, x, y) in [
            ("k4-k3", -l[2], -l[3]),
            ("k6-k3", -l[4], -l[5]),
            ("k2-k3", l[0] + l[2] + l[4], l[1] + l[3] + l[5]),
        ] {
            let off = force(name) - Vec3::new(x, y, 0.0);
            assert!(off.amax() < tolerance, "{name}: {off}");
        }
    }
}

/// At the start, where everything rests, all multipliers but two vanish (test set, consistent
/// initial values): the crank and its link go by themselves.
#[test]
fn golden_squeezing_mechanism_starts_with_two_multipliers() {
    let model = classical(&squeezer());
    let mut ws = model.workspace();
    let none = Loads { vertical: &[0.0], lateral: &[0.0] };
    let state = model.initial_state();
    let mut force = |name: &str| model.reaction(name, &state, &none, &mut ws).unwrap().force;
    let expected = Vec3::new(98.566_870_396_241_09, -6.122_688_344_255_663, 0.0);
    let found = force("k2-k3");
    // data of 16 digits, lengths of 0.1 m that end at 1e-17 m and a spring of 4.5e3 N/m
    assert!((found - expected).amax() < 1e-9, "{found}");
    assert!(force("k4-k3").amax() < 1e-9 && force("k6-k3").amax() < 1e-9);
    // β̈ of the test set
    model.accelerations(&state, &none, &mut ws).unwrap();
    let found = ws.acceleration(BodyIndex(0)).1.z;
    assert!((found - 14_222.443_919_954_14).abs() < 1e-7, "{found}");
}
