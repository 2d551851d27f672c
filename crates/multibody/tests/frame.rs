//! A travelling frame that gains and loses speed.
#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{body, empty, joint};
use multibody::{
    AppliedCourse, AppliedForces, BodyIndex, Bushing, FurtherCourse, JointKind, LoadCourse, Loads,
    MagnetIndex, MagnetPoint, Observed, ObservedIndex, State, VehicleDescription, VehicleModel,
};

const STILL: [f64; 4] = [0.0; 4];

fn observed(name: &str) -> Observed {
    Observed {
        name: name.to_owned(),
        body: name.to_owned(),
        points: Vec::new(),
        point_bodies: Vec::new(),
        parts: Vec::new(),
        levelled_by: Vec::new(),
    }
}

/// A sled with the magnet at its centre of mass, and a body that swings on it.
fn swing() -> VehicleDescription {
    let mut d = empty("swing");
    d.bodies.push(body("sled", 3.0, [0.4, 0.5, 0.6], [0.0; 3]));
    d.bodies.push(body("bob", 2.0, [0.1, 0.2, 0.15], [0.1, 0.2, -0.9]));
    let ends = ["sled", "bob"];
    d.joints.push(joint("hinge", JointKind::Spherical, ends, [0.0, 0.0, -0.2], None));
    d.observed.push(observed("sled"));
    d.magnets.push(MagnetPoint { body: "sled".to_owned(), position: [0.0; 3] });
    d
}

/// Steps under the weight, with an acceleration of the frame, and a force along the track on the sled.
fn stepped(model: &VehicleModel, state: &mut State, acceleration: [f64; 4], force: [f64; 4]) {
    let mut ws = model.workspace();
    let magnets = LoadCourse { vertical: &[[49.05, 0.0, 0.0, 0.0]], lateral: &[STILL] };
    let external = [[force, STILL, STILL, STILL, STILL, STILL]];
    let course = AppliedCourse {
        magnets,
        further: FurtherCourse::default(),
        external: &external,
        acceleration,
    };
    model.step(state, 0.5, 2e-3, course, &mut ws).unwrap();
}

/// What happens in a frame with the acceleration a happens without it under the force M a at the magnet, with the places
/// ∫∫ a and the velocities ∫ a further on.
#[test]
fn invariant_the_frame_changes_no_motion() {
    let model = VehicleModel::new(&swing()).unwrap();
    let [a, j, s] = [-1.3, 2.0, -7.0];
    let (mut within, mut without) = (model.initial_state(), model.initial_state());
    stepped(&model, &mut within, [a, j, s, 0.0], STILL);
    stepped(&model, &mut without, STILL, [5.0 * a, 5.0 * j, 5.0 * s, 0.0]);
    let t: f64 = 0.5;
    let speed = t * (a + t / 2.0 * (j + t / 3.0 * s));
    let place = t * t / 2.0 * (a + t / 3.0 * (j + t / 4.0 * s));
    assert!((without.bodies[1].angular_velocity.norm()) > 0.5, "it does not swing");
    for (a, b) in within.bodies.iter().zip(&without.bodies) {
        let moved = a.position - b.position;
        assert!((moved.x + place).abs() < 1e-9 && moved.y.abs() + moved.z.abs() < 1e-9, "{moved}");
        let faster = a.velocity - b.velocity;
        assert!((faster.x + speed).abs() < 1e-8, "{faster}");
        assert!((a.angular_velocity - b.angular_velocity).norm() < 1e-8);
    }
    // accelerations and their rates are inertial
    let end = |polynomial: [f64; 3]| polynomial[0] + t * (polynomial[1] + t / 2.0 * polynomial[2]);
    let (now, rate) = (end([a, j, s]), end([j, s, 0.0]));
    let magnets = Loads { vertical: &[49.05], lateral: &[0.0] };
    let seen = |state: &State, frame: [f64; 2], force: [f64; 2]| {
        let (mut ws, mut probe) = (model.workspace(), model.workspace());
        let pulled = force.map(|it| [[it, 0.0, 0.0, 0.0, 0.0, 0.0]]);
        let [forces, rates] = [0, 1].map(|k| AppliedForces {
            magnets: if k == 0 { magnets } else { Loads { vertical: &[0.0], lateral: &[0.0] } },
            external: &pulled[k],
            acceleration: frame[k],
        });
        model.jerks(state, forces, rates, &mut ws, &mut probe).unwrap();
        let centre = model.observed_acceleration(&ws, ObservedIndex(0));
        let load = model.reaction("hinge", state, forces, &mut model.workspace()).unwrap();
        (centre, model.magnet_jerk(&ws, &probe, MagnetIndex(0)), load.force)
    };
    let inside = seen(&within, [now, rate], [0.0; 2]);
    let outside = seen(&without, [0.0; 2], [5.0 * now, 5.0 * rate]);
    assert!((inside.0 - outside.0).norm() < 1e-7, "{} {}", inside.0, outside.0);
    assert!((inside.1 - outside.1).norm() < 1e-4, "{} {}", inside.1, outside.1);
    assert!((inside.2 - outside.2).norm() < 1e-6, "{} {}", inside.2, outside.2);
}

/// A jump of the speed is the limit of ever shorter accelerations: the difference falls with the duration.
#[test]
fn order_a_jump_is_the_limit_of_short_accelerations() {
    let model = VehicleModel::new(&swing()).unwrap();
    let mut jumped = model.initial_state();
    model.jump(&mut jumped, -0.4, &mut model.workspace()).unwrap();
    let difference = |duration: f64| {
        let mut state = model.initial_state();
        let magnets = LoadCourse { vertical: &[[49.05, 0.0, 0.0, 0.0]], lateral: &[STILL] };
        let acceleration = [-0.4 / duration, 0.0, 0.0, 0.0];
        let course = AppliedCourse {
            magnets,
            further: FurtherCourse::default(),
            external: &[],
            acceleration,
        };
        model.step(&mut state, duration, 1e-3, course, &mut model.workspace()).unwrap();
        let pairs = state.bodies.iter().zip(&jumped.bodies);
        pairs.map(|(a, b)| (a.velocity - b.velocity).norm()).fold(0.0, f64::max)
    };
    let [long, short] = [1e-3, 1e-4].map(difference);
    assert!(long < 0.05 && short < 0.12 * long && short > 0.0, "{long} {short}");
    // momentum along the track stays in the frame: the motor gives what inertia takes
    assert!(model.momentum(&jumped).0.x.abs() < 1e-12);
    assert!(jumped.bodies[1].angular_velocity.norm() > 0.1);
}

/// A car on four springs whose centre of mass is h above the magnets pitches by M a h / (4 k l²) in steady braking, nose
/// down, and its passengers feel the frame's acceleration.
#[test]
fn analytic_a_car_pitches_under_steady_braking() {
    let (mass, height, half, stiffness) = (800.0, 0.7, 2.0, 5e4);
    let mut d = empty("car");
    d.gravity = [0.0; 3];
    d.bodies.push(body("car", mass, [100.0, 900.0, 900.0], [0.0, 0.0, height]));
    for (k, (x, y)) in [(half, 1.0), (half, -1.0), (-half, 1.0), (-half, -1.0)].iter().enumerate() {
        d.bushings.push(Bushing {
            name: format!("spring {k}"),
            body_a: multibody::GROUND.to_owned(),
            body_b: "car".to_owned(),
            position: [*x, *y, height],
            orientation: None,
            translational_stiffness: [0.0, 1e4, stiffness],
            translational_damping: [0.0, 1e3, 4e3],
            rotational_stiffness: [0.0; 3],
            rotational_damping: [0.0; 3],
            preload: [0.0; 3],
        });
    }
    for x in [-1.0, 1.0] {
        d.magnets.push(MagnetPoint { body: "car".to_owned(), position: [x, 0.0, 0.0] });
    }
    d.observed.push(observed("car"));
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    let acceleration = -0.9;
    let magnets = LoadCourse { vertical: &[STILL; 2], lateral: &[STILL; 2] };
    let course = AppliedCourse {
        magnets,
        further: FurtherCourse::default(),
        external: &[],
        acceleration: [acceleration, 0.0, 0.0, 0.0],
    };
    model.step(&mut state, 30.0, 5e-3, course, &mut ws).unwrap();
    let pitch = model.observed_attitude(&state, ObservedIndex(0))[1];
    let expected = mass * 0.9 * height / (4.0 * stiffness * half * half);
    assert!((pitch - expected).abs() < 1e-5 * expected, "{pitch} {expected}");
    assert!(state.bodies[0].position.x.abs() < 1e-9, "the centre of mass leaves the frame");
    let forces = AppliedForces {
        magnets: Loads { vertical: &[0.0; 2], lateral: &[0.0; 2] },
        external: &[],
        acceleration,
    };
    model.accelerations(&state, forces, &mut ws).unwrap();
    assert!((model.observed_acceleration(&ws, ObservedIndex(0)).x - acceleration).abs() < 1e-9);
    assert!(ws.acceleration(BodyIndex(0)).0.x.abs() < 1e-9);
}
