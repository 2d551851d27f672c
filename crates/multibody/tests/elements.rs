//! Force elements one by one, each option with numbers of its own, against formulas written down here.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{body, empty, joint, run_free};
use multibody::math::{
    Mat3, Quat, Vec3, conjugate, from_rotation_vector, multiply, rotation_matrix,
};
use multibody::{
    Body, Bushing, Drive, Inertia, JointForce, JointKind, Loads, Spring, State, VehicleDescription,
    VehicleModel,
};
use nalgebra::DVector;

/// Force on a body and moment about its centre of mass, world axes, without the gyroscopic moment.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Load {
    force: Vec3,
    moment: Vec3,
}

/// A model and a state of it that is neither the initial pose nor at rest.
struct Case {
    model: VehicleModel,
    start: State,
    state: State,
}

impl Case {
    fn new(d: &VehicleDescription) -> Self {
        let model = VehicleModel::new(d).unwrap();
        let start = model.initial_state();
        Self { model, state: start.clone(), start }
    }

    /// Displaces and turns a body (rotation vector in world axes), and sets its velocities (world
    /// axes).
    fn set(&mut self, k: usize, shift: [f64; 3], turn: [f64; 3], v: [f64; 3], w: [f64; 3]) {
        let body = &mut self.state.bodies[k];
        body.position += Vec3::from(shift);
        body.attitude = multiply(from_rotation_vector(&turn.into()), body.attitude);
        body.velocity = v.into();
        body.angular_velocity = rotation_matrix(body.attitude).tr_mul(&Vec3::from(w));
    }

    fn turned(&self, k: usize) -> Mat3 {
        rotation_matrix(self.state.bodies[k].attitude)
    }

    /// A(t)·A(0)ᵀ: what the body has turned since the initial pose.
    fn turn_since_start(&self, k: usize) -> Mat3 {
        self.turned(k) * rotation_matrix(self.start.bodies[k].attitude).transpose()
    }

    /// Where a point of the initial pose is now, relative to the body's centre of mass.
    fn arm(&self, k: usize, point: [f64; 3]) -> Vec3 {
        self.turn_since_start(k) * (Vec3::from(point) - self.start.bodies[k].position)
    }

    fn place(&self, k: usize, point: [f64; 3]) -> Vec3 {
        self.state.bodies[k].position + self.arm(k, point)
    }

    fn spin(&self, k: usize) -> Vec3 {
        self.turned(k) * self.state.bodies[k].angular_velocity
    }

    /// Velocity of the body's material at a place of the world.
    fn speed(&self, k: usize, place: Vec3) -> Vec3 {
        let body = &self.state.bodies[k];
        body.velocity + self.spin(k).cross(&(place - body.position))
    }

    /// What the model applies to a body.
    fn load(&self, k: usize) -> Load {
        let none = vec![0.0; self.model.counts().magnets];
        let loads = Loads { vertical: &none, lateral: &none };
        let mut ws = self.model.workspace();
        let (mass, _, right): (_, _, DVector<f64>) =
            self.model.dense_system(&self.state, &loads, &mut ws);
        let inertia = mass.fixed_view::<3, 3>(6 * k + 3, 6 * k + 3).into_owned();
        let w = self.state.bodies[k].angular_velocity;
        let part = |first: usize| Vec3::new(right[first], right[first + 1], right[first + 2]);
        let moment = part(6 * k + 3) + w.cross(&(inertia * w));
        Load { force: part(6 * k), moment: self.turned(k) * moment }
    }

    fn assert_load(&self, k: usize, force: Vec3, moment: Vec3) {
        let load = self.load(k);
        let tolerance = 1e-12 * (force.amax() + moment.amax()).max(1.0);
        let apart = (load.force - force).amax().max((load.moment - moment).amax());
        assert!(apart < tolerance, "body {k}: {load:?} is not {force} {moment}");
    }
}

fn attitude(vector: [f64; 3]) -> Option<Quat> {
    Some(from_rotation_vector(&vector.into()))
}

/// Two free bodies that stand crooked in their own axes, without gravity.
fn two_bodies() -> VehicleDescription {
    let mut d = empty("two bodies");
    d.gravity = [0.0; 3];
    let a = body("a", 3.0, [0.3, 0.4, 0.5], [0.2, -0.1, 0.4]);
    let b = body("b", 2.0, [0.2, 0.25, 0.3], [1.1, 0.6, -0.3]);
    d.bodies.push(Body { orientation: attitude([0.4, -0.2, 0.7]), ..a });
    d.bodies.push(Body { orientation: attitude([-0.5, 0.9, 0.1]), ..b });
    d
}

fn in_motion(d: &VehicleDescription) -> Case {
    let mut case = Case::new(d);
    case.set(0, [0.03, -0.02, 0.05], [0.2, 0.1, -0.3], [0.4, -0.7, 0.2], [0.5, 1.1, -0.8]);
    case.set(1, [-0.06, 0.04, 0.01], [-0.1, 0.3, 0.15], [-0.3, 0.9, 0.6], [-0.9, 0.4, 1.3]);
    case
}

fn spring(stiffness: f64, damping: f64, free_length: Option<f64>) -> Spring {
    Spring {
        name: "spring".to_owned(),
        body_a: "a".to_owned(),
        position_a: [0.5, 0.0, 0.3],
        body_b: "b".to_owned(),
        position_b: [0.9, 0.4, -0.1],
        stiffness,
        damping,
        free_length,
    }
}

/// k (l − l0) + c l̇ pulls both ends towards each other: stiffness, damping and free length alone, and
/// all together.
#[test]
fn issue_14_a_spring_pulls_with_its_stiffness_and_its_damping() {
    for (k, c, free) in [
        (700.0, 0.0, Some(0.4)),
        (0.0, 35.0, Some(0.4)),
        (700.0, 35.0, Some(0.4)),
        (700.0, 35.0, None),
    ] {
        let mut d = two_bodies();
        let spring = spring(k, c, free);
        let [pa, pb] = [spring.position_a, spring.position_b];
        d.springs.push(spring);
        let case = in_motion(&d);
        let (end_a, end_b) = (case.place(0, pa), case.place(1, pb));
        let line = end_b - end_a;
        let (length, e) = (line.norm(), line.normalize());
        let rate = e.dot(&(case.speed(1, end_b) - case.speed(0, end_a)));
        let free = free.unwrap_or_else(|| (Vec3::from(pb) - Vec3::from(pa)).norm());
        let pull = e * (k * (length - free) + c * rate);
        assert!(rate.abs() > 0.1 && (length - free).abs() > 1e-3);
        case.assert_load(0, pull, case.arm(0, pa).cross(&pull));
        case.assert_load(1, -pull, case.arm(1, pb).cross(&-pull));
    }
}

/// A mass on a line spring with damper: x(t) = e^(−ζω t)·(cos ω_d t + ζω/ω_d·sin ω_d t) of the
/// release.
#[test]
fn issue_14_a_damped_line_spring_decays() {
    let (m, k, c, release) = (2.0, 800.0, 12.0, 0.02);
    let mut d = empty("damped spring");
    d.gravity = [0.0; 3];
    let along = Vec3::new(2.0, -1.0, 2.0) / 3.0;
    let at = along * 0.5;
    d.bodies.push(body("b", m, [0.1; 3], at.into()));
    d.springs.push(Spring {
        body_a: "ground".to_owned(),
        position_a: [0.0; 3],
        position_b: at.into(),
        free_length: Some(0.5 - release),
        ..spring(k, c, None)
    });
    let model = VehicleModel::new(&d).unwrap();
    let mut state = model.initial_state();
    let (decay, omega) = (c / (2.0 * m), (k / m).sqrt());
    let damped = (omega * omega - decay * decay).sqrt();
    let h = 1e-4;
    for n in 1..=5 {
        run_free(&model, &mut state, h, 1000);
        let t = f64::from(n) * 1000.0 * h;
        let swing = (damped * t).cos() + decay / damped * (damped * t).sin();
        let expected = along * (0.5 - release + release * (-decay * t).exp() * swing);
        // Runge-Kutta: (ω h)⁴/120·ω t of the amplitude = 2e-12 per 0.1 s
        assert!((state.bodies[0].position - expected).amax() < 1e-11, "at {t} s");
    }
}

fn bushing() -> Bushing {
    Bushing {
        name: "bushing".to_owned(),
        body_a: "a".to_owned(),
        body_b: "b".to_owned(),
        position: [0.7, 0.3, 0.1],
        orientation: attitude([0.3, 0.8, -0.4]),
        translational_stiffness: [0.0; 3],
        translational_damping: [0.0; 3],
        rotational_stiffness: [0.0; 3],
        rotational_damping: [0.0; 3],
        preload: [0.0; 3],
    }
}

/// f0 + K d + C ḋ on a along axes that turn with a, the opposite on b, both at b's attachment; each
/// axis with its own numbers, each part alone and all together.
#[test]
fn issue_14_a_bushing_pushes_along_its_own_axes() {
    let (k, c, f) = ([1e3, 2e3, 4e3], [10.0, 30.0, 50.0], [7.0, -11.0, 13.0]);
    for part in 0..4 {
        let on = |which: usize, values: [f64; 3]| {
            if part == which || part == 3 { values } else { [0.0; 3] }
        };
        let (k, c, f) = (on(0, k), on(1, c), on(2, f));
        let mut d = two_bodies();
        let bushing = Bushing {
            translational_stiffness: k,
            translational_damping: c,
            preload: f,
            ..bushing()
        };
        let (at, axes) = (bushing.position, rotation_matrix(bushing.orientation.unwrap()));
        d.bushings.push(bushing);
        let case = in_motion(&d);
        let axes = case.turn_since_start(0) * axes;
        let (end_a, end_b) = (case.place(0, at), case.place(1, at));
        let way = axes.tr_mul(&(end_b - end_a));
        // seen from a, the attachment on b moves against a's material there
        let rate = axes.tr_mul(&(case.speed(1, end_b) - case.speed(0, end_b)));
        let local = Vec3::from_fn(|i, _| f[i] + k[i] * way[i] + c[i] * rate[i]);
        let force = axes * local;
        assert!(force.amax() > 1.0);
        let arm_on_a = end_b - case.state.bodies[0].position;
        case.assert_load(0, force, arm_on_a.cross(&force));
        case.assert_load(1, -force, case.arm(1, at).cross(&-force));
    }
}

/// A turn about one of the bushing's axes meets that axis's stiffness and damping, though the bodies'
/// axes and the bushing's all differ.
#[test]
fn issue_14_a_bushing_turns_about_its_own_axes() {
    let (k, c) = ([20.0, 30.0, 50.0], [0.7, 1.1, 1.3]);
    for axis in 0..3 {
        for (angle, rate) in [(0.3, 0.0), (0.0, 0.9), (-0.7, 0.5)] {
            let mut d = two_bodies();
            let bushing = Bushing { rotational_stiffness: k, rotational_damping: c, ..bushing() };
            let axes = rotation_matrix(bushing.orientation.unwrap());
            d.bushings.push(bushing);
            let mut case = Case::new(&d);
            let turn = [0.2, 0.1, -0.3];
            case.set(0, [0.0; 3], turn, [0.0; 3], [0.0; 3]);
            let e = case.turn_since_start(0) * axes.column(axis);
            case.set(1, [0.0; 3], turn, [0.0; 3], (e * rate).into());
            // on top of a's turn
            let body = &mut case.state.bodies[1];
            body.attitude = multiply(from_rotation_vector(&(e * angle)), body.attitude);
            body.angular_velocity = rotation_matrix(body.attitude).tr_mul(&(e * rate));
            let moment = e * (k[axis] * angle + c[axis] * rate);
            case.assert_load(0, Vec3::zeros(), moment);
            case.assert_load(1, Vec3::zeros(), -moment);
        }
    }
}

/// f0 − (k s + c ṡ) on b along a slide's axis and about a hinge's, with gravity beside it.
#[test]
fn issue_14_a_joint_force_has_preload_stiffness_and_damping() {
    let axis = [2.0, -1.0, 2.0].map(|x: f64| x / 3.0);
    for kind in [JointKind::Translational, JointKind::Revolute] {
        for (k, c, f) in [(90.0, 0.0, 0.0), (0.0, 6.0, 0.0), (0.0, 0.0, 4.0), (90.0, 6.0, 4.0)] {
            let mut d = empty("joint force");
            d.gravity = [0.0; 3];
            d.bodies.push(body("b", 2.0, [0.2; 3], [0.3, 0.1, -0.2]));
            d.joints.push(joint("guide", kind, ["ground", "b"], [0.3, 0.1, -0.2], Some(axis)));
            d.joint_forces.push(JointForce {
                joint: "guide".to_owned(),
                stiffness: k,
                damping: c,
                preload: f,
            });
            let (e, way, rate) = (Vec3::from(axis), 0.15, 0.8);
            let expected = e * (f - (k * way + c * rate));
            let mut case = Case::new(&d);
            let (moved, speed) = ((e * way).into(), (e * rate).into());
            if kind == JointKind::Translational {
                case.set(0, moved, [0.0; 3], speed, [0.0; 3]);
                case.assert_load(0, expected, Vec3::zeros());
            } else {
                case.set(0, [0.0; 3], moved, [0.0; 3], speed);
                case.assert_load(0, Vec3::zeros(), expected);
            }
        }
    }
}

/// The drive holds each of its bodies with its whole stiffness and damping, along x alone, and no
/// other body.
#[test]
fn issue_14_the_drive_holds_each_body_along_the_track() {
    for (k, c) in [(500.0, 0.0), (0.0, 40.0), (500.0, 40.0)] {
        let mut d = two_bodies();
        d.bodies.push(body("free", 1.0, [0.1; 3], [3.0, 0.0, 0.0]));
        d.drive = Some(Drive { bodies: vec!["a".into(), "b".into()], stiffness: k, damping: c });
        let mut case = in_motion(&d);
        case.set(2, [0.1, 0.1, 0.1], [0.0; 3], [1.0, 1.0, 1.0], [0.0; 3]);
        case.assert_load(0, Vec3::new(-(k * 0.03 + c * 0.4), 0.0, 0.0), Vec3::zeros());
        case.assert_load(1, Vec3::new(-(k * -0.06 + c * -0.3), 0.0, 0.0), Vec3::zeros());
        case.assert_load(2, Vec3::zeros(), Vec3::zeros());
    }
}

/// A body with all six entries of the inertia matrix, turned in space, under forces on points of it:
/// J α = s × F − ω × J ω in world axes, and gravity.
#[test]
fn issue_14_a_full_inertia_matrix_acts_in_the_bodys_axes() {
    let inertia = [[0.9, 0.11, -0.07], [0.11, 0.7, 0.13], [-0.07, 0.13, 0.8]];
    let mut d = empty("full");
    let at = [0.4, -0.2, 0.3];
    d.bodies.push(Body {
        inertia: Inertia::Full(inertia),
        orientation: attitude([0.5, -0.3, 0.8]),
        ..body("b", 2.0, [1.0; 3], at)
    });
    let points = [at, [1.4, -0.2, 0.3], [0.4, 0.8, 0.3], [0.4, -0.2, 1.3]];
    d.magnets.extend(points.map(|p| common::tracer("b", p)));
    let mut case = Case::new(&d);
    case.set(0, [0.1, 0.2, 0.3], [-0.4, 0.6, 0.2], [0.0; 3], [0.7, -1.2, 0.5]);
    let (vertical, lateral) = ([1.0, 2.0, -3.0, 0.5], [0.3, -0.8, 0.0, 1.1]);
    let mut ws = case.model.workspace();
    let loads = Loads { vertical: &vertical, lateral: &lateral };
    case.model.accelerations(&case.state, &loads, &mut ws).unwrap();
    let turn = case.turned(0);
    let local = Mat3::from_fn(|r, c| inertia[r][c]);
    let (j, w) = (turn * local * turn.transpose(), case.spin(0));
    let forces = |k: usize| Vec3::new(0.0, lateral[k], vertical[k]);
    let force: Vec3 = (0..4).map(forces).sum();
    let moment: Vec3 = (0..4).map(|k| case.arm(0, points[k]).cross(&forces(k))).sum();
    let angular = j.try_inverse().unwrap() * (moment - w.cross(&(j * w)));
    let linear = force / 2.0 - Vec3::new(0.0, 0.0, common::G);
    for (k, point) in points.into_iter().enumerate() {
        let arm = case.arm(0, point);
        let expected = linear + angular.cross(&arm) + w.cross(&w.cross(&arm));
        let found = case.model.magnet_acceleration(&ws, multibody::MagnetIndex(k));
        assert!((found - expected).amax() < 1e-13, "{k}: {found} is not {expected}");
    }
}

/// A joint given by points and axes in the bodies' own coordinates is the joint given by a place and
/// an axis of the world, whatever the bodies' orientation.
#[test]
fn issue_14_joints_in_local_coordinates_are_the_same_joints() {
    let place = [0.6, 0.3, 0.2];
    let axis = [1.0, 2.0, -2.0].map(|x: f64| x / 3.0);
    for kind in [JointKind::Spherical, JointKind::Revolute, JointKind::Translational] {
        let mut world = two_bodies();
        let with = kind.has_axis().then_some(axis);
        world.joints.push(joint("joint", kind, ["a", "b"], place, with));
        let mut local = two_bodies();
        let into = |k: usize, v: Vec3| -> [f64; 3] {
            (rotation_matrix(conjugate(local.bodies[k].orientation.unwrap())) * v).into()
        };
        let arm = |k: usize| into(k, Vec3::from(place) - Vec3::from(local.bodies[k].position));
        let mut same = joint("joint", kind, ["a", "b"], place, None);
        same.position = None;
        (same.local_a, same.local_b) = (Some(arm(0)), Some(arm(1)));
        if kind.has_axis() {
            same.local_axis_a = Some(into(0, axis.into()));
            same.local_axis_b = Some(into(1, axis.into()));
        }
        local.joints.push(same);
        let run = |d: &mut VehicleDescription| {
            d.gravity = [0.0, 0.0, -9.81];
            // something that moves the bodies against each other
            d.springs.push(Spring { free_length: Some(0.1), ..spring(300.0, 2.0, None) });
            let model = VehicleModel::new(d).unwrap();
            let mut state = model.initial_state();
            run_free(&model, &mut state, 1e-3, 300);
            state
        };
        let (first, second) = (run(&mut world), run(&mut local));
        for (a, b) in first.bodies.iter().zip(&second.bodies) {
            assert!((a.position - b.position).amax() < 1e-10, "{kind}");
            let apart = rotation_matrix(a.attitude) - rotation_matrix(b.attitude);
            assert!(apart.amax() < 1e-9, "{kind}");
        }
    }
}
