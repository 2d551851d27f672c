//! Reactions of the joints: statics, Newton-Euler by another route, published multipliers.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{G, Levitation, Noise, body, empty, joint, tracer};
use multibody::math::{Vec3, from_rotation_vector, multiply, normalised, rotation_matrix};
use multibody::{
    Error, Holding, Joint, JointKind, Loads, MagnetIndex, State, VehicleDescription, VehicleModel,
    train,
};

const X: Option<[f64; 3]> = Some([1.0, 0.0, 0.0]);

/// An L of a post (100 kg) and an arm (20 kg) welded to it, with a load (5 kg) welded to the arm's
/// end: a clamped beam. Moments of weights about the welds.
#[test]
fn analytic_welds_of_a_cantilever() {
    let mut d = empty("cantilever");
    d.bodies.push(body("post", 100.0, [10.0; 3], [0.0, 0.0, 1.0]));
    d.bodies.push(body("arm", 20.0, [1.0; 3], [1.0, 0.0, 2.0]));
    d.bodies.push(body("load", 5.0, [0.1; 3], [2.0, 0.5, 2.0]));
    d.bodies.push(body("ballast", 1.0, [0.1; 3], [0.0, 0.0, -3.0]));
    for (name, ends, at) in [
        ("foot", ["ground", "post"], [0.0; 3]),
        // turned round: the arm is a, the post b
        ("shoulder", ["arm", "post"], [0.0, 0.0, 2.0]),
        ("hand", ["arm", "load"], [2.0, 0.0, 2.0]),
    ] {
        d.joints.push(joint(name, JointKind::Bracket, ends, at, None));
    }
    d.joints.push(joint("swing", JointKind::Spherical, ["post", "ballast"], [0.0; 3], None));
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let state = model.initial_state();
    let loads = Loads { vertical: &[], lateral: &[] };
    // exact but for the rounding of a handful of products of 1e3
    let mut assert_is = |name: &str, force: [f64; 3], moment: [f64; 3]| {
        let found = model.reaction(name, &state, &loads, &mut ws).unwrap();
        assert!((found.force - Vec3::from(force)).amax() < 1e-11, "{name}: {found:?}");
        assert!((found.moment - Vec3::from(moment)).amax() < 1e-11, "{name}: {found:?}");
    };
    assert_is("hand", [0.0, 0.0, 5.0 * G], [0.5 * 5.0 * G, 0.0, 0.0]);
    // on the post: what the weights of arm and load do to it
    assert_is("shoulder", [0.0, 0.0, -25.0 * G], [-2.5 * G, 20.0 * G + 10.0 * G, 0.0]);
    assert_is("foot", [0.0, 0.0, 126.0 * G], [2.5 * G, -30.0 * G, 0.0]);
    assert_is("swing", [0.0, 0.0, G], [0.0; 3]);
    let unknown = model.reaction("knee", &state, &loads, &mut ws);
    assert!(matches!(unknown, Err(Error::Argument { found, .. }) if found == "knee"));
}

/// A pendulum passes the lowest point with ω: the hinge carries m (g + ω² l), and no moment.
#[test]
fn analytic_hinge_of_a_pendulum() {
    let mut d = empty("pendulum");
    d.bodies.push(body("bob", 2.0, [0.1, 0.2, 0.15], [0.3, 0.0, -0.7]));
    d.joints.push(joint("hinge", JointKind::Revolute, ["ground", "bob"], [0.3, 0.0, 0.0], X));
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    state.bodies[0].angular_velocity = Vec3::new(3.0, 0.0, 0.0);
    state.bodies[0].velocity = Vec3::new(0.0, 2.1, 0.0);
    let none = Loads { vertical: &[], lateral: &[] };
    let found = model.reaction("hinge", &state, &none, &mut ws).unwrap();
    assert!((found.force - Vec3::new(0.0, 0.0, 2.0 * (G + 9.0 * 0.7))).amax() < 1e-13);
    assert!(found.moment.amax() < 1e-14);
    assert_eq!(found.point, Vec3::new(0.3, 0.0, 0.0));
}

/// The two-car train at rest: tables carry cars, couplers and themselves; boxes and motors hang in
/// their brackets with their own weight; each anti-roll beam rests on its two ends.
#[test]
fn analytic_train_at_rest_carries_its_weight() {
    let description = train::two_car();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 64], &Holding::default(), &mut ws).unwrap();
    let side = [0.0; 64];
    let loads = Loads { vertical: &found.loads, lateral: &side };
    let mut reaction = |j: &Joint| model.reaction(&j.name, &found.state, &loads, &mut ws).unwrap();
    let mass = |name: &str| description.bodies.iter().find(|b| b.name == name).unwrap().mass;
    let mut cars = Vec3::zeros();
    let mut beams = Vec3::zeros();
    for joint in &description.joints {
        let found = reaction(joint);
        // accelerations of 1e-9 m/s² are left in the equilibrium, times masses of up to 11 t
        let tolerance = 1e-5;
        match joint.kind {
            JointKind::Translational => {
                // the slide goes sideways without friction
                assert!(found.force.y.abs() < tolerance, "{}: {found:?}", joint.name);
                cars -= found.force;
            }
            JointKind::Bracket if joint.body_a != "ground" => {
                let weight = mass(&joint.body_b) * G;
                let off = found.force - Vec3::new(0.0, 0.0, weight);
                assert!(off.amax() < tolerance, "{}: {found:?}", joint.name);
            }
            JointKind::Spherical => {
                assert!(joint.body_b.contains("beam"), "{}", joint.name);
                assert_eq!(found.moment, Vec3::zeros());
                beams += found.force;
            }
            _ => {}
        }
    }
    let carried = 2.0 * (7700.0 + 4.0 * 600.0) + 10.0 * 40.0;
    assert!((cars - Vec3::new(0.0, 0.0, carried * G)).amax() < 1e-3, "{cars}");
    assert!((beams - Vec3::new(0.0, 0.0, 32.0 * 50.0 * G)).amax() < 1e-3, "{beams}");
}

/// Eight links in a row, joined by every kind of joint twice, none aligned with an axis.
fn chain() -> VehicleDescription {
    let mut d = empty("chain");
    let mut at = Vec3::zeros();
    let mut last = "ground".to_owned();
    let axes = [[0.0, 1.0, 0.2], [1.0, 0.0, 0.1], [0.3, 0.2, 1.0], [0.0, 1.0, 0.0]];
    let kinds =
        [JointKind::Revolute, JointKind::Spherical, JointKind::Bracket, JointKind::Translational];
    for k in 0..8 {
        let name = format!("link_{k}");
        let kind = kinds[k % 4];
        let inertia = [0.02 + 0.01 * k as f64, 0.04, 0.05];
        let centre = at + Vec3::new(0.3, 0.1, -0.2);
        let mut link = body(&name, 1.0 + 0.3 * k as f64, inertia, centre.into());
        let turn = from_rotation_vector(&Vec3::new(0.3, -0.2, 0.1 * k as f64));
        link.orientation = Some(turn);
        d.bodies.push(link);
        let axis = kind.has_axis().then_some(axes[k % 4]);
        d.joints.push(joint(&name, kind, [&last, &name], at.into(), axis));
        d.magnets.push(tracer(&name, centre.into()));
        at = centre + Vec3::new(0.2, 0.0, -0.1);
        last = name;
    }
    d
}

/// As if the chain were cut at each joint in turn: the reaction balances all that hangs on it.
/// Accelerations of the described bodies come from differences over ±dt of the motion, so neither
/// the solver's accelerations nor its multipliers enter on this side.
#[test]
fn invariant_reactions_agree_with_inverse_dynamics_of_a_moving_chain() {
    let description = chain();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    let up: Vec<f64> = (0..8).map(|k| 5.0 * f64::from(k)).collect();
    let left: Vec<f64> = (0..8).map(|k| 7.0 - f64::from(k)).collect();
    // let it get going, and keep three neighbouring moments
    common::run(&model, &mut state, 1e-3, 400, [&up, &left]);
    let dt = 1e-4;
    let before = state.clone();
    common::run(&model, &mut state, dt, 1, [&up, &left]);
    let now = state.clone();
    common::run(&model, &mut state, dt, 1, [&up, &left]);
    let members = |s: &State| members(&description, &model, s);
    let (earlier, here, later) = (members(&before), members(&now), members(&state));
    let speeds = here.iter().map(|m| m.spin.norm()).fold(0.0, f64::max);
    assert!(speeds > 1.5, "the chain hardly moves: {speeds}");
    let loads = Loads { vertical: &up, lateral: &left };
    let mut carried = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
    for k in (0..8).rev() {
        let body = &description.bodies[k];
        let acceleration = (later[k].velocity - earlier[k].velocity) / (2.0 * dt);
        let moment = (later[k].momentum - earlier[k].momentum) / (2.0 * dt);
        let force = (acceleration - Vec3::from(description.gravity)) * body.mass
            - Vec3::new(0.0, left[k], up[k]);
        let found = model.reaction(&body.name, &now, &loads, &mut ws).unwrap();
        // the next joint pulls back with what it carries
        let needed = force + carried.0;
        let about = moment
            + (here[k].centre - found.point).cross(&force)
            + carried.1
            + (carried.2 - found.point).cross(&carried.0);
        // dt²/6 of a third derivative, rates of 5 1/s cubed times m/s²: 1e-6 of the forces
        let size = needed.amax().max(about.amax());
        assert!((found.force - needed).amax() < 1e-5 * size, "{k}: {found:?} {needed}");
        assert!((found.moment - about).amax() < 1e-5 * size, "{k}: {found:?} {about}");
        carried = (found.force, found.moment, found.point);
    }
}

struct Member {
    centre: Vec3,
    velocity: Vec3,
    spin: Vec3,
    /// Moment of momentum about its own centre.
    momentum: Vec3,
}

fn members(description: &VehicleDescription, model: &VehicleModel, state: &State) -> Vec<Member> {
    let start = model.initial_state();
    let each = description.bodies.iter().enumerate().map(|(k, data)| {
        let composite = model.body_index(&data.name).unwrap();
        let (now, then) = (&state.bodies[composite], &start.bodies[composite]);
        // attitude: the composite's turn since the start, times the body's own at the start
        let [w, x, y, z] = then.attitude;
        let turn = multiply(now.attitude, [w, -x, -y, -z]);
        let axes = rotation_matrix(normalised(multiply(turn, data.attitude())));
        let spin = rotation_matrix(now.attitude) * now.angular_velocity;
        let motion = model.magnet(state, MagnetIndex(k));
        Member {
            centre: motion.position,
            velocity: motion.velocity,
            spin,
            momentum: axes * (data.inertia.matrix() * axes.tr_mul(&spin)),
        }
    });
    each.collect()
}

/// A welded ring of elements: a bushing and a spring between two bodies of the same composite carry
/// their preload, and the weld carries the opposite.
#[test]
fn analytic_weld_bridged_by_preloaded_elements() {
    let mut d = empty("clamp");
    d.gravity = [0.0; 3];
    d.bodies.push(body("a", 1.0, [1.0; 3], [0.0; 3]));
    d.bodies.push(body("b", 3.0, [1.0; 3], [1.0, 0.0, 0.0]));
    d.joints.push(joint("weld", JointKind::Bracket, ["a", "b"], [0.5, 0.0, 0.0], None));
    let mut bushing = train::one_bogie().bushings[0].clone();
    (bushing.body_a, bushing.body_b) = ("a".to_owned(), "b".to_owned());
    (bushing.position, bushing.preload) = ([0.5, 0.2, 0.0], [0.0, 0.0, 100.0]);
    d.bushings.push(bushing);
    d.springs.push(multibody::Spring {
        name: "spring".to_owned(),
        body_a: "b".to_owned(),
        position_a: [1.0, 1.0, 0.0],
        body_b: "a".to_owned(),
        position_b: [0.0, 1.0, 0.0],
        stiffness: 50.0,
        damping: 0.0,
        free_length: Some(0.6),
    });
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let none = Loads { vertical: &[], lateral: &[] };
    let found = model.reaction("weld", &model.initial_state(), &none, &mut ws).unwrap();
    // on b: the bushing −100 N in z at y = 0.2 m, the spring −20 N in x at y = 1 m
    assert!((found.force - Vec3::new(20.0, 0.0, 100.0)).amax() < 1e-12, "{found:?}");
    assert!((found.moment - Vec3::new(20.0, 0.0, -20.0)).amax() < 1e-12, "{found:?}");
}

/// The running train: the bracket of every box and motor moves its mass and carries its weight.
#[test]
fn invariant_brackets_of_a_running_train_move_what_they_hold() {
    let description = train::two_car();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 64], &Holding::default(), &mut ws).unwrap();
    let mut state = found.state;
    let mut levitation = Levitation::new(&found.loads);
    let mut noise = Noise(4);
    for _ in 0..50 {
        let push: Vec<f64> = (0..64).map(|_| 5e3 * noise.next()).collect();
        levitation.step(&model, &mut state, 1e-3, |k| push[k], &mut ws);
    }
    let up: Vec<f64> = levitation.vertical.iter().map(|l| l[0]).collect();
    let left: Vec<f64> = levitation.lateral.iter().map(|l| l[0]).collect();
    let loads = Loads { vertical: &up, lateral: &left };
    let mut checked = 0;
    for joint in description.joints.iter().filter(|j| j.kind == JointKind::Bracket) {
        let Some(k) = model.body_index(&joint.body_b) else { continue };
        let held = description.bodies.iter().find(|b| b.name == joint.body_b).unwrap();
        let found = model.reaction(&joint.name, &state, &loads, &mut ws).unwrap();
        // acceleration of the held body's centre from that of its composite's
        let then = model.initial_state().bodies[k].position;
        let turn = rotation_matrix(state.bodies[k].attitude);
        let arm = turn * (Vec3::from(held.position) - then);
        let w = turn * state.bodies[k].angular_velocity;
        let (linear, angular) = ws.acceleration(k);
        let acceleration = linear + (turn * angular).cross(&arm) + w.cross(&w.cross(&arm));
        let needed = (acceleration + Vec3::new(0.0, 0.0, G)) * held.mass;
        assert!((found.force - needed).amax() < 1e-9 * needed.amax(), "{}", joint.name);
        checked += 1;
    }
    assert_eq!(checked, 24);
}
