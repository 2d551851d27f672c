//! Linear motors on bodies: direction, gap, travelling frame, order, line.
#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{body, empty};
use linear_motor::{Feed, Motor, MotorDescription};
use multibody::{
    AppliedCourse, Error, FurtherCourse, LoadCourse, Loads, MagnetIndex, MagnetPoint, MotorControl,
    MotorCourse, State, Travel, VehicleDescription, VehicleModel, Workspace,
};
use track_line::{Line, LineDescription};

const MOTOR: &str = include_str!("../../../scenarios/motors/aluminium-4-mm.json");
const STILL: [f64; 4] = [0.0; 4];
const MASS: f64 = 500.0;

fn description() -> MotorDescription {
    MotorDescription { offset: [0.0; 3], ..MotorDescription::from_json(MOTOR).unwrap() }
}

/// A sled whose motor acts at its centre of mass.
fn sled() -> VehicleDescription {
    let mut d = empty("sled");
    d.bodies.push(body("the_motor_1", MASS, [40.0, 50.0, 60.0], [0.0; 3]));
    d.magnets.push(MagnetPoint { body: "the_motor_1".to_owned(), position: [0.0; 3] });
    d
}

fn model() -> VehicleModel {
    VehicleModel::new(&sled()).unwrap().with_motors(&description()).unwrap()
}

fn wanted(thrust: f64) -> MotorControl {
    MotorControl::Thrust {
        wanted: [thrust, 0.0, 0.0, 0.0],
        slip_frequency: 12.0,
        max_current: 400.0,
    }
}

fn advance(
    model: &VehicleModel,
    state: &mut State,
    [size, most]: [f64; 2],
    course: &MotorCourse,
    acceleration: [f64; 4],
    lift: f64,
) -> Workspace {
    let mut ws = model.workspace();
    ws.supply(Some(course)).unwrap();
    let magnets = LoadCourse { vertical: &[[lift, 0.0, 0.0, 0.0]], lateral: &[STILL] };
    model
        .step(
            state,
            size,
            most,
            AppliedCourse {
                magnets,
                external: &[],
                acceleration,
                further: FurtherCourse::default(),
            },
            &mut ws,
        )
        .unwrap();
    ws
}

/// In a frame that speeds up, a sled at its nominal gap stays where it is: the motor gives M a, and the magnet its
/// weight and the normal force.
#[test]
fn analytic_the_motor_gives_what_the_frame_needs() {
    let (model, law) = (model(), Motor::new(&description()).unwrap());
    for a in [1.1, -1.1] {
        let feed = law.feed_for(MASS * a, 5.0, [12.0, 400.0]).unwrap();
        let normal = law.forces(feed, 5.0, 0.01).unwrap().normal;
        let mut state = model.initial_state();
        let course =
            MotorCourse { control: wanted(0.0), speed: [5.0, a, 0.0, 0.0], height: &[STILL] };
        let ws = advance(
            &model,
            &mut state,
            [2e-3, 1e-3],
            &course,
            [a, 0.0, 0.0, 0.0],
            MASS * 9.81 + normal,
        );
        assert!((ws.motors()[0].forces.thrust - MASS * a).abs() < 1e-2);
        let body = &state.bodies[0];
        // the speed of the wave changes with the frame's, and the normal force a little with it
        assert!(body.velocity.x.abs() < 1e-7 && body.velocity.z.abs() < 1e-4, "{}", body.velocity);
    }
}

/// Fed directly, the motion does not depend on the frame in which it is computed: one that speeds up, or not.
#[test]
fn invariant_the_frame_changes_no_motion() {
    let model = model();
    let control =
        MotorControl::Fed { current: [250.0, 300.0, 0.0, 0.0], frequency: [24.0, 2.0, 0.0, 0.0] };
    let run = |a: f64| {
        let mut state = model.initial_state();
        let course = MotorCourse { control, speed: [5.0, a, 0.0, 0.0], height: &[STILL] };
        let acceleration = [a, 0.0, 0.0, 0.0];
        advance(&model, &mut state, [0.05, 1e-3], &course, acceleration, MASS * 9.81);
        state.bodies[0]
    };
    let (within, without) = (run(0.8), run(0.0));
    assert!((within.velocity.x + 0.04 - without.velocity.x).abs() < 1e-12);
    assert!((within.velocity.z - without.velocity.z).abs() < 1e-12);
    assert!(without.velocity.x > 0.05 && without.velocity.z < -1e-3, "{}", without.velocity);
}

/// Fed directly: the integration has order 4, and the momentum is the integral of the thrust.
#[test]
fn order_steps_with_motors_have_order_four() {
    let model = model();
    let feed =
        MotorControl::Fed { current: [250.0, 400.0, 0.0, 0.0], frequency: [24.0, 20.0, 0.0, 0.0] };
    let course = MotorCourse {
        control: feed,
        speed: [5.0, 0.0, 0.0, 0.0],
        height: &[[0.0, 0.02, 0.3, 0.0]],
    };
    let run = |most: f64| {
        let mut state = model.initial_state();
        advance(&model, &mut state, [0.08, most], &course, STILL, MASS * 9.81 + 900.0);
        state.bodies[0]
    };
    let exact = run(2e-4);
    let [coarse, fine] = [8e-3, 4e-3].map(|most| (run(most).velocity - exact.velocity).norm());
    assert!(coarse / fine > 12.0 && fine > 1e-14, "{coarse} {fine}");
}

/// On a slope the thrust is along the line and the normal force across it.
#[test]
fn analytic_forces_are_along_the_lines_axes() {
    let line = r#"{ "name": "slope", "plan": [ { "kind": "straight", "length": 400 } ], "elevation": [
        { "kind": "clothoid", "length": 20, "to_radius": 300 }, { "kind": "clothoid", "length": 20 } ] }"#;
    let line = Line::new(&LineDescription::from_json(line).unwrap()).unwrap();
    let slope: f64 = 20.0 / 300.0;
    let model = model().with_line(line).unwrap();
    let law = Motor::new(&description()).unwrap();
    let mut state = model.initial_state();
    state.travel = Some(Travel { place: 100.0, speed: 6.0 });
    let feed = Feed { current: 300.0, frequency: 27.0 };
    let mut ws = model.workspace();
    let control =
        MotorControl::Fed { current: [300.0, 0.0, 0.0, 0.0], frequency: [27.0, 0.0, 0.0, 0.0] };
    let course =
        MotorCourse { control, speed: [6.0, 0.0, 0.0, 0.0], height: &[[1e-3, 0.0, 0.0, 0.0]] };
    ws.supply(Some(&course)).unwrap();
    model.accelerations(&state, &Loads { vertical: &[0.0], lateral: &[0.0] }, &mut ws).unwrap();
    let known = law.forces(feed, 6.0, 0.009).unwrap();
    let felt = model.magnet_acceleration(&ws, MagnetIndex(0));
    assert!((felt.x - (known.thrust / MASS - 9.81 * slope.sin())).abs() < 1e-6, "{felt} {known:?}");
    assert!(
        (felt.z - (-known.normal / MASS - 9.81 * slope.cos())).abs() < 1e-6,
        "{felt} {known:?}"
    );
}

#[test]
fn refusal_bodies_that_are_not_there_and_wrong_heights() {
    let other = MotorDescription { bodies: vec!["engine".to_owned()], ..description() };
    let error = VehicleModel::new(&sled()).unwrap().with_motors(&other).unwrap_err().to_string();
    assert!(
        error.contains("motors: `bodies[0]`: no body of the vehicle matches `engine`"),
        "{error}"
    );
    let mut ws = model().workspace();
    let course = MotorCourse { control: wanted(1.0), speed: STILL, height: &[] };
    assert!(matches!(ws.supply(Some(&course)), Err(Error::Argument { .. })));
}
