//! Vehicles on a curved line.
#![allow(clippy::unwrap_used, reason = "a test program")]

use multibody::math::{Vec3, rotation_matrix};
use multibody::{
    AppliedCourse, AppliedForces, Error, FurtherCourse, Holding, LoadCourse, Loads, MagnetIndex,
    Travel, VehicleDescription, VehicleModel, train,
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
        let course = AppliedCourse {
            magnets,
            further: FurtherCourse::default(),
            external: &[],
            acceleration: now,
        };
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

/// A train in a circle in steady motion, against the static problem of a straight track with the
/// centrifugal and the canted weight. At R = 10¹¹ m and 224 km/s the line bends by 10⁻⁹ m over the vehicle.
#[test]
fn analytic_steady_curving_is_the_statics_of_a_tilted_weight() {
    for cant in [0.0, -0.02, 0.03] {
        let (radius, lateral) = (1e11, 0.5);
        let speed = f64::sqrt(lateral * radius);
        let line = line(&format!(
            r#"{{ "name": "circle", "plan": [ {{ "kind": "clothoid", "length": 100, "to_radius": {radius} }},
            {{ "kind": "circle", "length": 200, "radius": {radius} }}, {{ "kind": "clothoid", "length": 100 }} ],
            "cant": [ {{ "length": 100, "to": {cant} }} ] }}"#
        ));
        let mut description = train::by_name("one-car").unwrap();
        let model = VehicleModel::new(&description).unwrap().with_line(line.clone()).unwrap();
        // the centrifugal acceleration points to the right
        let (s, c) = f64::sin_cos(cant);
        let (out, down) = (-lateral, -9.81);
        description.gravity = [0.0, c * out + s * down, c * down - s * out];
        let flat = VehicleModel::new(&description).unwrap();
        let mut work = flat.workspace();
        let law = |_: f64, _: f64, offset: f64| [-1.2e5 * offset, 1.2e5];
        let heights = [0.0; 32];
        let found =
            flat.guided_equilibrium(&heights, &Holding::default(), &law, &mut work).unwrap();
        let mass = flat.total_mass();
        let sides: f64 = found.lateral.iter().sum();
        assert!((sides / mass + c * out + s * down).abs() < 1e-8, "{}", sides / mass);
        let mut state = found.state.clone();
        let place = 200.0;
        state.travel = Some(Travel { place, speed });
        let turning = line.frame(place).curvature * speed;
        for body in &mut state.bodies {
            body.velocity = turning.cross(&body.position);
            body.angular_velocity = rotation_matrix(body.attitude).transpose() * turning;
        }
        // the law pulls to the line
        let offsets: Vec<f64> =
            (0..32).map(|k| model.magnet(&state, MagnetIndex(k)).displacement.y).collect();
        let pulls: Vec<f64> = offsets.iter().map(|y| -1.2e5 * y).collect();
        let magnets = Loads { vertical: &found.loads, lateral: &pulls };
        let mut work = model.workspace();
        let forces = AppliedForces { magnets, external: &[], acceleration: 0.0 };
        model.accelerations(&state, forces, &mut work).unwrap();
        for k in 0..state.bodies.len() {
            let (linear, angular) = work.acceleration(multibody::BodyIndex(k));
            let carried = state.bodies[k].velocity + Vec3::new(speed, 0.0, 0.0);
            let left = linear - turning.cross(&carried);
            assert!(left.norm() < 1e-6 && angular.norm() < 1e-6, "{cant} {k}: {left} {angular}");
        }
        // the outputs show the centripetal acceleration in the track's axes, and the roll relative to it
        let centre = model.observed_acceleration(&work, multibody::ObservedIndex(0));
        assert!((centre - Vec3::new(0.0, c * lateral, -s * lateral)).norm() < 1e-6, "{centre}");
        let [roll, ..] = model.observed_attitude(&state, multibody::ObservedIndex(0));
        let [expected, ..] = flat.observed_attitude(&found.state, multibody::ObservedIndex(0));
        assert!(
            (roll - expected).abs() < 1e-9 && (cant == 0.0) == (roll.abs() > 1e-3 && cant == 0.0)
        );
    }
}

/// Without dampers, the energy of the vehicle changes by the work of the magnets' forces, through a curve
/// with cant and a crest.
#[test]
fn invariant_energy_balance_through_a_curve() {
    let mut description = train::by_name("one-car").unwrap();
    description.drive = None;
    description.bushings.iter_mut().for_each(|it| {
        it.translational_damping = [0.0; 3];
        it.rotational_damping = [0.0; 3];
    });
    description.joint_forces.iter_mut().for_each(|it| it.damping = 0.0);
    let line = line(
        r#"{ "name": "curve", "plan": [ { "kind": "straight", "length": 10 },
        { "kind": "clothoid", "length": 15, "to_radius": 80 }, { "kind": "circle", "length": 10, "radius": 80 },
        { "kind": "clothoid", "length": 15 } ],
        "elevation": [ { "kind": "straight", "length": 12 }, { "kind": "clothoid", "length": 10, "to_radius": -400 },
        { "kind": "clothoid", "length": 10 } ],
        "cant": [ { "length": 10 }, { "length": 15, "to": -0.04 }, { "length": 10 }, { "length": 15, "to": 0 } ] }"#,
    );
    let model = VehicleModel::new(&description).unwrap().with_line(line.clone()).unwrap();
    let (mut work, speed, n) = (model.workspace(), 15.0, 32);
    let rest = model.equilibrium(&vec![0.0; n], &Holding::default(), &mut work).unwrap();
    let mut state = rest.state;
    state.travel = Some(Travel { place: -4.0, speed });
    let energy = |state: &multibody::State, work: &mut multibody::Workspace| {
        let (momentum, _) = model.momentum(state);
        let total = model.energy(state, work).total();
        total + momentum.x * speed + 0.5 * model.total_mass() * speed * speed
    };
    // absolute velocities of the magnets in the line's axes, left and up
    let velocities = |state: &multibody::State| -> Vec<[f64; 2]> {
        let place = state.travel.unwrap().place;
        (0..n)
            .map(|k| {
                let motion = model.magnet(state, MagnetIndex(k));
                let roll = line.frame(place + motion.position.x).curvature.x;
                let along = (speed + motion.velocity.x) * roll;
                let [y, z] = [motion.position.y, motion.position.z];
                [motion.velocity.y - along * z, motion.velocity.z + along * y]
            })
            .collect()
    };
    let before = energy(&state, &mut work);
    let (mut done, mut size, h) = (0.0, 0.0, 1e-3);
    for _ in 0..1500 {
        let hold = |value: f64| [value, 0.0, 0.0, 0.0];
        let motions: Vec<_> = (0..n).map(|k| model.magnet(&state, MagnetIndex(k))).collect();
        let up: Vec<_> = motions
            .iter()
            .zip(&rest.loads)
            .map(|(it, load)| hold(load - 4e5 * it.displacement.z - 2e4 * it.velocity.z))
            .collect();
        let left: Vec<_> =
            motions.iter().map(|it| hold(-2e5 * it.displacement.y - 5e3 * it.velocity.y)).collect();
        let course = LoadCourse { vertical: &up, lateral: &left };
        let mut moved = Vec::new();
        moved.push(velocities(&state));
        for _ in 0..2 {
            model.step(&mut state, 0.5 * h, 0.5 * h, &course, &mut work).unwrap();
            moved.push(velocities(&state));
        }
        for k in 0..n {
            let mean = |axis: usize| {
                (moved[0][k][axis] + 4.0 * moved[1][k][axis] + moved[2][k][axis]) / 6.0
            };
            let power = left[k][0] * mean(0) + up[k][0] * mean(1);
            done += h * power;
            size += h * power.abs();
        }
    }
    let gained = energy(&state, &mut work) - before;
    assert!(state.travel.unwrap().place > 18.0 && size > 2e3, "{size} J");
    assert!((gained - done).abs() < 1e-6 * size, "{gained} J, work {done} J of {size} J");
}

#[test]
fn refusal_of_what_a_line_does_not_have() {
    let model = VehicleModel::new(&train::by_name("one-magnet").unwrap()).unwrap();
    let error = model.with_line(twisted()).unwrap_err();
    assert!(matches!(&error, Error::Line(text) if text.contains("to the ground")), "{error}");
    let model = VehicleModel::new(&train::by_name("one-car").unwrap()).unwrap();
    let model = model.with_line(twisted()).unwrap();
    let mut state = model.initial_state();
    state.travel = Some(Travel { place: 60.0, speed: 1.0 });
    let zeros = [0.0; 32];
    let loads = Loads { vertical: &zeros, lateral: &zeros };
    let mut work = model.workspace();
    // a vehicle beyond the centre of the curve has no place on the line
    state.bodies.iter_mut().for_each(|body| body.position.y += 500.0);
    let error = model.accelerations(&state, &loads, &mut work).unwrap_err();
    assert!(matches!(error, Error::OffLine { .. }), "{error}");
}
