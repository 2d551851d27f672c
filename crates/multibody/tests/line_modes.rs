//! Small motions in steady curving.
#![allow(clippy::unwrap_used, reason = "a test program")]

use multibody::math::{
    Vec3, conjugate, from_rotation_vector, multiply, rotation_matrix, rotation_vector,
};
use multibody::{
    AppliedForces, Equilibrium, Holding, LoadCourse, Loads, MagnetIndex, MagnetSprings, Rails,
    State, Travel, VehicleModel, damping_ratio, train,
};
use track_line::{Line, LineDescription};

fn canted() -> Line {
    let text = r#"{ "name": "circle", "plan": [ { "kind": "clothoid", "length": 100, "to_radius": 150 },
        { "kind": "circle", "length": 400, "radius": 150 }, { "kind": "clothoid", "length": 100 } ],
        "elevation": [ { "kind": "clothoid", "length": 50, "to_radius": 1000 },
        { "kind": "clothoid", "length": 50 }, { "kind": "straight", "length": 400 } ],
        "cant": [ { "length": 100, "to": -0.08 } ] }"#;
    Line::new(&LineDescription::from_json(text).unwrap()).unwrap()
}

const PULL: f64 = 3e5;

/// Steady curving of one car up a slope at a speed, held sideways by springs to the line.
fn curving(speed: f64) -> (VehicleModel, Equilibrium) {
    let model = VehicleModel::new(&train::by_name("one-car").unwrap()).unwrap();
    let model = model.with_line(canted()).unwrap();
    let heights = vec![0.0; 32];
    let rails = Rails { height: &heights, side: &[] };
    let law = |_: f64, _: f64, offset: f64| [-PULL * offset, PULL];
    let travel = Some(Travel { place: 250.0, speed });
    let mut work = model.workspace();
    let holding = Holding::default();
    let found = model.carried_equilibrium(travel, &rails, &holding, &law, &[], &mut work).unwrap();
    (model, found)
}

/// Velocities of the steady motion, to which those of a small one are added.
fn carry(state: &mut State, turning: &Vec3) {
    for body in &mut state.bodies {
        body.velocity += turning.cross(&body.position);
        body.angular_velocity += rotation_matrix(body.attitude).tr_mul(turning);
    }
}

/// Set moving along a mode shape about steady curving at 12 m/s in a canted curve of 150 m that rises, a car
/// follows Re(shape·e^{λt}) relative to the turning frame. The integrator knows nothing of the linearisation.
#[test]
fn invariant_a_car_in_a_curve_follows_its_modes() {
    let (model, found) = curving(12.0);
    let line = canted();
    let magnets = Loads { vertical: &found.loads, lateral: &found.lateral };
    let forces = AppliedForces { magnets, external: &[], acceleration: 0.0 };
    let (springs, mut work) = (MagnetSprings::default(), model.workspace());
    let linear = model.linearise(&found.state, forces, &springs, &mut work).unwrap();
    let chosen: Vec<_> = linear
        .eigenvalues
        .iter()
        .copied()
        .filter(|p| p.im > 3.0 && damping_ratio(*p) < 0.95)
        .collect();
    assert!(chosen.len() > 20, "{}", chosen.len());
    let turning = line.frame(250.0).curvature * 12.0;
    let hold =
        |values: &[f64]| -> Vec<[f64; 4]> { values.iter().map(|u| [*u, 0.0, 0.0, 0.0]).collect() };
    let (up, left) = (hold(&found.loads), hold(&found.lateral));
    for pole in chosen.into_iter().step_by(5) {
        let shape = linear.shape(pole).unwrap();
        let largest = shape.iter().map(|b| b.displacement.norm().max(b.rotation.norm()));
        let size = 1e-6 / largest.fold(0.0, f64::max);
        let mut state = found.state.clone();
        for (body, b) in state.bodies.iter_mut().zip(&shape) {
            body.position += b.displacement.map(|c| (c * size).re);
            let turn = b.rotation.map(|c| (c * size).re);
            body.attitude = multiply(body.attitude, from_rotation_vector(&turn));
            body.velocity = b.displacement.map(|c| (c * pole * size).re);
            body.angular_velocity = b.rotation.map(|c| (c * pole * size).re);
        }
        carry(&mut state, &turning);
        model.close_joints(&mut state, &mut work).unwrap();
        let h = 1e-3;
        let steps = (std::f64::consts::TAU / pole.im / h).min(250.0).round() as usize;
        for _ in 0..steps {
            let course = LoadCourse { vertical: &up, lateral: &left };
            model.step(&mut state, h, h, &course, &mut work).unwrap();
        }
        let factor = (pole * (steps as f64 * h)).exp() * size;
        for ((now, then), b) in state.bodies.iter().zip(&found.state.bodies).zip(&shape) {
            let moved = now.position - then.position - b.displacement.map(|c| (c * factor).re);
            let turned = rotation_vector(multiply(conjugate(then.attitude), now.attitude))
                - b.rotation.map(|c| (c * factor).re);
            let off = moved.norm().max(turned.norm());
            // as for the straight track: deviations, the steps and what is left of accelerations
            assert!(off < 2e-4 * 1e-6, "{pole}: {off:e}");
        }
    }
}

/// At rest on a canted curve: no gyroscopic part, the stiffness of forces with a potential, beside those of the
/// magnets, which turn with the line, and inertial accelerations that follow from the matrices.
#[test]
fn invariant_matrices_at_rest_on_a_canted_curve() {
    let (model, found) = curving(0.0);
    let magnets = Loads { vertical: &found.loads, lateral: &found.lateral };
    let springs = MagnetSprings { stiffness: 7e5, damping: 8e3, ..MagnetSprings::default() };
    let mut work = model.workspace();
    let forces = AppliedForces { magnets, external: &[], acceleration: 0.0 };
    let linear = model.linearise(&found.state, forces, &springs, &mut work).unwrap();
    let skew = |m: &nalgebra::DMatrix<f64>| (m - m.transpose()).amax() / m.amax();
    // the drive's damping sees the speed of the foot, and its force acts at the point: κ_z·y apart
    assert!(skew(&linear.damping) < 5e-4, "{}", skew(&linear.damping));
    assert!(skew(&linear.stiffness) < 1e-3, "{}", skew(&linear.stiffness));
    // the magnets' springs hold every place but the lateral one and yaw
    let unstable = linear.eigenvalues.iter().filter(|p| p.re > 1e-3).count();
    assert!(unstable <= 2, "{:?}", linear.eigenvalues);
    let [by_place, by_rate] = linear.magnet_accelerations.as_ref().unwrap();
    let shapes = model.magnet_shapes(&found.state, &linear);
    let inverse = linear.mass.clone().try_inverse().unwrap();
    let up = nalgebra::DMatrix::from_fn(32, shapes.ncols(), |k, j| shapes[(3 * k + 2, j)]);
    // at rest, axes that turn with a displacement turn an acceleration of zero
    let expected = -&up * &inverse * &linear.stiffness;
    assert!((by_place - &expected).amax() < 1e-6 * expected.amax());
    let expected = -&up * &inverse * &linear.damping;
    assert!((by_rate - &expected).amax() < 1e-6 * expected.amax());
    let own = model.magnet(&found.state, MagnetIndex(0)).displacement;
    assert!(own.y.abs() > 1e-3);
}
