//! Benchmarks with known answers: pendulum, four-bars, gyroscope, levitated mass.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{G, body, empty, joint, run, run_free, tracer};
use multibody::math::{Vec3, from_rotation_vector};
use multibody::{
    Error, JointKind, Loads, MagnetIndex, State, VehicleDescription, VehicleModel, train,
};

const Y: Option<[f64; 3]> = Some([0.0, 1.0, 0.0]);

/// A rigid body that swings like a point mass at 1 m: (I + m l²)/(m l) = 1 m with l = 0.5 m.
fn pendulum() -> VehicleDescription {
    let mut d = empty("pendulum");
    d.bodies.push(body("bob", 1.0, [0.25; 3], [-0.5, 0.0, 0.0]));
    d.joints.push(joint("pivot", JointKind::Revolute, ["ground", "bob"], [0.0; 3], Y));
    d.magnets.push(tracer("bob", [-1.0, 0.0, 0.0]));
    d
}

fn end_of(
    description: &VehicleDescription,
    start: impl Fn(&VehicleModel) -> State,
    h: f64,
    t: f64,
) -> (Vec3, VehicleModel, State) {
    let model = VehicleModel::new(description).unwrap();
    let mut state = start(&model);
    run_free(&model, &mut state, h, (t / h).round() as usize);
    (model.magnet(&state, MagnetIndex(0)).position, model, state)
}

/// IFToMM benchmark A01: pendulum released from the horizontal, at 10 s.
#[test]
fn golden_simple_pendulum_of_iftomm_a01() {
    let exact = Vec3::new(-0.275_087_462_6, 0.0, -0.961_419_205_1);
    let error = |h| (end_of(&pendulum(), VehicleModel::initial_state, h, 10.0).0 - exact).norm();
    assert_fourth_order([error(8e-3), error(4e-3), error(2e-3), error(1e-3)]);
}

/// Each halving of the step divides the error by sixteen or nearly so; what is left at the end is
/// the rounding of the references' ten digits.
fn assert_fourth_order(errors: [f64; 4]) {
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / 12.0 + 1e-10, "{errors:?}");
    }
    // and it is the answer: the last error is below a sixteenth of 2e-9, so at the rounding
    assert!(errors[3] < 2e-10, "{errors:?}");
}

/// Two coupled four-bars: three cranks on the ground, two couplers with balls at both ends (a
/// revolute at either end would be redundant in space). The couplers' spin about themselves stays
/// zero, nothing drives it.
fn four_bars() -> VehicleDescription {
    let mut d = empty("four-bars");
    // moment of a thin bar of 1 m and 1 kg; about itself anything small
    let (i, e) = (1.0 / 12.0, 1e-3);
    for k in 0..3 {
        let x = k as f64;
        let name = format!("crank_{k}");
        d.bodies.push(body(&name, 1.0, [i, i, e], [x, 0.0, 0.5]));
        d.joints.push(joint(&name, JointKind::Revolute, ["ground", &name], [x, 0.0, 0.0], Y));
    }
    for k in 0..2 {
        let x = k as f64;
        let name = format!("coupler_{k}");
        d.bodies.push(body(&name, 1.0, [e, i, i], [x + 0.5, 0.0, 1.0]));
        for (end, crank) in [("rear", k), ("front", k + 1)] {
            let crank_name = format!("crank_{crank}");
            d.joints.push(joint(
                &format!("{name}_{end}"),
                JointKind::Spherical,
                [&crank_name, &name],
                [crank as f64, 0.0, 1.0],
                None,
            ));
        }
    }
    d.magnets.push(tracer("crank_0", [0.0, 0.0, 1.0]));
    d
}

fn four_bars_start(model: &VehicleModel) -> State {
    let mut state = model.initial_state();
    for k in 0..3 {
        let crank = model.body_index(&format!("crank_{k}")).unwrap();
        state.bodies[crank].velocity = Vec3::new(0.5, 0.0, 0.0);
        state.bodies[crank].angular_velocity = Vec3::new(0.0, 1.0, 0.0);
    }
    for k in 0..2 {
        let coupler = model.body_index(&format!("coupler_{k}")).unwrap();
        state.bodies[coupler].velocity = Vec3::new(1.0, 0.0, 0.0);
    }
    state
}

/// IFToMM benchmark A02 with N = 2, at 10 s. The bars pass the stretched position, where the
/// constraints of the plane become dependent, several times.
#[test]
fn golden_four_bars_of_iftomm_a02() {
    let exact = Vec3::new(0.328_458_111_5, 0.0, 0.944_518_538_2);
    let at = |h| end_of(&four_bars(), four_bars_start, h, 10.0);
    let error = |h| (at(h).0 - exact).norm();
    assert_fourth_order([error(8e-3), error(4e-3), error(2e-3), error(1e-3)]);
    let (_, model, state) = at(2e-3);
    // nothing dissipates: the energy at the end is that of the start
    let mut ws = model.workspace();
    let start = model.energy(&four_bars_start(&model), &mut ws).total();
    let end = model.energy(&state, &mut ws).total();
    assert!((end - start).abs() < 1e-6 * start, "{start} {end}");
}

/// All bars stretched in one line: the constraints are dependent there, and whoever asks for
/// accelerations is told when and where instead of getting numbers.
#[test]
fn invariant_singular_position_is_an_error_with_time_and_joint() {
    let model = VehicleModel::new(&four_bars()).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    state.time = 3.5;
    for k in 0..3 {
        let crank = model.body_index(&format!("crank_{k}")).unwrap();
        state.bodies[crank].position = Vec3::new(k as f64 + 0.5, 0.0, 0.0);
        let quarter = Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0);
        state.bodies[crank].attitude = from_rotation_vector(&quarter);
    }
    for k in 0..2 {
        let coupler = model.body_index(&format!("coupler_{k}")).unwrap();
        state.bodies[coupler].position = Vec3::new(k as f64 + 1.5, 0.0, 0.0);
    }
    let loads = Loads { vertical: &[0.0], lateral: &[0.0] };
    match model.accelerations(&state, &loads, &mut ws) {
        Err(Error::Singular { time, joint, .. }) => {
            assert_eq!(time, 3.5);
            assert!(joint.contains("coupler") || joint.contains("crank"), "{joint}");
        }
        other => panic!("{other:?}"),
    }
}

/// A free body keeps momentum, moment of momentum and energy; a wrong ω × J ω or a mixed-up frame
/// shows at once.
#[test]
fn invariant_free_gyroscope() {
    let mut d = empty("gyroscope");
    d.gravity = [0.0; 3];
    d.bodies.push(body("top", 2.0, [1.0, 2.0, 2.5], [0.0; 3]));
    let model = VehicleModel::new(&d).unwrap();
    let mut state = model.initial_state();
    state.bodies[0].velocity = Vec3::new(1.0, -2.0, 3.0);
    // near the unstable middle axis, so that it tumbles
    state.bodies[0].angular_velocity = Vec3::new(0.01, 3.0, 0.02);
    let (p0, l0) = model.momentum(&state);
    let e0 = model.kinetic_energy(&state);
    run_free(&model, &mut state, 1e-3, 10_000);
    let (p, l) = model.momentum(&state);
    // RK4: (ω h)⁵/120 per step and 1e4 steps: 3e-3⁵/120·1e4 = 2e-11 relative
    assert!((p - p0).norm() < 1e-11 * p0.norm());
    assert!((l - l0).norm() < 1e-9 * l0.norm(), "{:e}", (l - l0).norm());
    assert!((model.kinetic_energy(&state) - e0).abs() < 1e-10 * e0);
    // it has tumbled: otherwise this proved nothing
    assert!(state.bodies[0].angular_velocity.y < 2.9);
}

/// One magnet's mass under its weight plus F: free fall upward, z = F t²/(2 m); and gap signs.
#[test]
fn analytic_one_magnet_rises_under_surplus_force() {
    let model = VehicleModel::new(&train::one_magnet()).unwrap();
    let mut state = model.initial_state();
    run(&model, &mut state, 1e-3, 500, [&[250.0 * G + 25.0], &[1000.0]]);
    let motion = model.magnet(&state, MagnetIndex(0));
    // a polynomial of second degree is exact but for rounding; the guide takes the lateral force
    assert!((motion.displacement.z - 0.5 * 0.1 * 0.25).abs() < 1e-13);
    assert!((motion.velocity.z - 0.05).abs() < 1e-13);
    assert!(motion.displacement.y.abs() < 1e-15);
}
