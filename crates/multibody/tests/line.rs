//! Vehicles on a curved line.
#![allow(clippy::unwrap_used, reason = "a test program")]

use multibody::math::{Vec3, rotation_matrix};
use multibody::{
    AppliedCourse, AppliedForces, Error, Holding, LoadCourse, Loads, MagnetIndex, Travel,
    VehicleDescription, VehicleModel, train,
};
use track_line::{Line, LineDescription};

fn line(text: &str) -> Line {
    Line::new(&LineDescription::from_json(text).unwrap()).unwrap()
}

/// Clothoids with cant and slope; pieces end at multiples of 5 m.
fn twisted() -> Line {
    line(
        r#"{ "name": "twisted", "plan": [
            { "kind": "straight", "length": 20 }, { "kind": "clothoid", "length": 30, "to_radius": 60 },
            { "kind": "clothoid", "length": 40, "to_radius": -70 }, { "kind": "clothoid", "length": 30 } ],
          "elevation": [
            { "kind": "straight", "length": 25 }, { "kind": "clothoid", "length": 30, "to_radius": 200 },
            { "kind": "clothoid", "length": 20, "to_radius": -150 }, { "kind": "clothoid", "length": 30 } ],
          "cant": [
            { "length": 20 }, { "length": 30, "to": -0.1 }, { "length": 40, "to": 0.06 },
            { "length": 20, "to": 0 } ] }"#,
    )
}

const FREE: &str = r#"{ "name": "free", "gravity": [0, 0, -9.81], "nominal_gap": 0.008,
    "bodies": [ { "name": "stone", "mass": 250, "inertia": [12, 30, 21], "position": [0.4, -0.3, 0.8] } ],
    "observed": [ { "name": "stone", "body": "stone" } ] }"#;

fn run(
    model: &VehicleModel,
    state: &mut multibody::State,
    acceleration: [f64; 4],
    steps: u32,
    h: f64,
) {
    let magnets = LoadCourse { vertical: &[], lateral: &[] };
    let mut work = model.workspace();
    for n in 0..steps {
        state.time = f64::from(n) * h;
        let [a, j, ..] = acceleration;
        let now = [a + j * state.time, j, 0.0, 0.0];
        let course = AppliedCourse { magnets, external: &[], acceleration: now };
        model.step(state, h, h, course, &mut work).unwrap();
    }
}

/// Errors of place, velocity (m, m/s), attitude and spin after a flight of 2 s beside the line.
fn flight(speed: f64, acceleration: [f64; 4], steps: u32) -> [f64; 4] {
    let description = VehicleDescription::from_json(FREE).unwrap();
    let plain = VehicleModel::new(&description).unwrap();
    let line = twisted();
    let curved = plain.clone().with_line(line.clone()).unwrap();
    let spin = Vec3::new(0.9, -0.4, 1.3);
    let (place, h) = (5.0, 4.0 / f64::from(steps));
    let mut free = plain.initial_state();
    free.bodies[0].angular_velocity = spin;
    run(&plain, &mut free, [0.0; 4], steps, h);
    let mut state = curved.initial_state();
    state.travel = Some(Travel { place, speed });
    state.bodies[0].angular_velocity = spin;
    let (t, frame) = (4.0, line.frame(place));
    let from = frame.position + frame.axes * state.bodies[0].position;
    run(&curved, &mut state, acceleration, steps, h);
    let travel = state.travel.unwrap();
    let [a, j, ..] = acceleration;
    let way = speed * t + a * t * t / 2.0 + j * t * t * t / 6.0;
    assert!((travel.place - place - way).abs() < 1e-9 && travel.place > 80.0, "{travel:?}");
    let frame = line.frame(travel.place);
    let body = &state.bodies[0];
    let there = frame.position + frame.axes * body.position;
    let velocity = frame.axes * (body.velocity + Vec3::new(travel.speed, 0.0, 0.0));
    let flown = from + Vec3::new(speed * t, 0.0, -0.5 * 9.81 * t * t);
    let turned = frame.axes * rotation_matrix(body.attitude);
    [
        (there - flown).norm(),
        (velocity - Vec3::new(speed, 0.0, -9.81 * t)).norm(),
        (turned - rotation_matrix(free.bodies[0].attitude)).norm(),
        (body.angular_velocity - free.bodies[0].angular_velocity).norm(),
    ]
}

/// A free, spinning body, carried past by a frame that follows clothoids, crests and cant ramps, flies as
/// in an inertial frame: a parabola, and the rotation that the same body has without a line. At 25 m/s the
/// kinks of the curvature fall on ends of steps.
#[test]
fn analytic_a_free_body_flies_straight_past_a_twisted_line() {
    for error in flight(25.0, [0.0; 4], 4000) {
        assert!(error < 1e-9, "{error}");
    }
}

/// With a speed that changes, steps pass over the kinks, which costs the order: second of the step.
#[test]
fn order_a_changing_speed_past_kinks_of_the_curvature() {
    let coarse = flight(20.0, [4.0, -1.5, 0.0, 0.0], 1000);
    let fine = flight(20.0, [4.0, -1.5, 0.0, 0.0], 4000);
    for (coarse, fine) in coarse.iter().zip(fine) {
        assert!(fine < 2e-6 && (fine < 0.2 * coarse || fine < 1e-10), "{coarse} {fine}");
    }
}
