//! Redundant joints are a matter of geometry: masses, inertias and the unit of length change nothing.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside the test functions

mod common;

use common::{G, Noise, body, empty, joint, run_free};
use multibody::{Error, JointKind, Redundancy, VehicleDescription, VehicleModel, train};

const Y: Option<[f64; 3]> = Some([0.0, 1.0, 0.0]);

/// A closed loop of three bodies and the ground, the corners at (0, 0, 0), (0, 0, 1), (1, 0.3, 1.2)
/// and (1, 0, 0), with a joint of given kind in each; hinges turn about y.
fn four_bar(kinds: [JointKind; 4]) -> VehicleDescription {
    let mut d = empty("four-bar");
    for (name, at) in [("a", [0.0, 0.0, 0.5]), ("b", [0.5, 0.15, 1.1]), ("c", [1.0, 0.15, 0.6])] {
        d.bodies.push(body(name, 1.0, [0.1; 3], at));
    }
    let corners = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.3, 1.2], [1.0, 0.0, 0.0]];
    let ends = [["ground", "a"], ["a", "b"], ["b", "c"], ["c", "ground"]];
    for (k, (kind, (ends, at))) in kinds.into_iter().zip(ends.into_iter().zip(corners)).enumerate()
    {
        let axis = if kind.has_axis() { Y } else { None };
        d.joints.push(joint(&format!("corner {k}"), kind, ends, at, axis));
    }
    d
}

/// One bogie whose four anti-roll beams are parallel: one equation too many.
fn parallel_beams() -> VehicleDescription {
    let mut d = train::one_bogie();
    for joint in d.joints.iter_mut().filter(|j| j.kind == JointKind::Spherical) {
        let beam = d.bodies.iter().find(|b| b.name == joint.body_b).unwrap();
        joint.position = joint.position.map(|p| [beam.position[0], p[1], p[2]]);
    }
    d
}

fn stretch(point: &mut [f64; 3], factor: f64) {
    *point = point.map(|x| x * factor);
}

/// The same mechanism with all lengths multiplied, and with other masses and inertias: each body's
/// from 1e-6 to 1e6 kg and from 1e-12 to 1e9 kg·m², at random and independently.
fn rescaled(of: &VehicleDescription, length: f64, noise: &mut Noise) -> VehicleDescription {
    let mut d = of.clone();
    for body in &mut d.bodies {
        stretch(&mut body.position, length);
        body.mass = 10_f64.powf(6.0 * noise.next());
        let inertia = 10_f64.powf(-1.5 + 10.5 * noise.next());
        body.inertia = multibody::Inertia::Principal([inertia, inertia * 1.5, inertia * 1.2]);
    }
    for joint in &mut d.joints {
        if let Some(position) = &mut joint.position {
            stretch(position, length);
        }
    }
    d
}

fn redundancies(d: &VehicleDescription) -> Vec<Redundancy> {
    match VehicleModel::new(d) {
        Err(Error::Redundant(found)) => found,
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("{}: accepted", d.name),
    }
}

/// Joint and companions of each redundancy.
fn names(found: &[Redundancy]) -> Vec<(String, Vec<String>)> {
    found.iter().map(|r| (r.joint.clone(), r.together_with.clone())).collect()
}

const LENGTHS: [f64; 5] = [1e-6, 1e-3, 1.0, 1e3, 1e6];

#[test]
fn invariant_redundant_joints_are_named_alike_in_all_scalings() {
    use JointKind::{Revolute, Spherical, Translational};
    let mut noise = Noise(14);
    for (d, expected, named) in [
        (four_bar([Revolute; 4]), 3, "corner 3"),
        (four_bar([Translational, Revolute, Revolute, Revolute]), 2, "corner 3"),
        (four_bar([Revolute, Revolute, Spherical, Revolute]), 1, "corner 3"),
        (parallel_beams(), 1, "beam"),
    ] {
        let found = redundancies(&d);
        assert_eq!(found.len(), expected, "{found:?}");
        assert!(found.iter().all(|r| r.joint.contains(named)), "{found:?}");
        for length in LENGTHS {
            for _ in 0..20 {
                let scaled = rescaled(&d, length, &mut noise);
                assert_eq!(names(&redundancies(&scaled)), names(&found), "lengths × {length}");
            }
        }
    }
}

/// Whatever the masses and lengths, a mechanism without redundancy is accepted, or it is said that
/// its numbers differ too much: it is never called redundant. With one ratio of all masses and one of
/// all lengths it is always accepted.
#[test]
fn invariant_joints_that_are_not_redundant_are_never_called_so() {
    use JointKind::{Revolute, Spherical};
    let mut noise = Noise(15);
    for d in [
        four_bar([Revolute, Spherical, Spherical, Revolute]),
        four_bar([Revolute, Revolute, Spherical, Spherical]),
        train::one_bogie(),
        train::one_magnet(),
    ] {
        VehicleModel::new(&d).unwrap();
        let mut accepted = 0;
        for length in LENGTHS {
            for mass in [1e-6, 1.0, 1e6] {
                let mut scaled = rescaled(&d, length, &mut noise);
                for (scaled, body) in scaled.bodies.iter_mut().zip(&d.bodies) {
                    scaled.mass = body.mass * mass;
                    let moments = body.inertia.matrix() * (mass * length * length);
                    scaled.inertia = multibody::Inertia::Full(moments.transpose().into());
                }
                VehicleModel::new(&scaled).unwrap();
            }
            for _ in 0..20 {
                match VehicleModel::new(&rescaled(&d, length, &mut noise)) {
                    Ok(_) => accepted += 1,
                    Err(Error::Invalid { message, .. }) => {
                        assert!(message.contains("differ too much in magnitude"), "{message}");
                    }
                    Err(error) => panic!("lengths × {length}: {error}"),
                }
            }
        }
        assert!(accepted > 0, "{}", d.name);
    }
}

/// A pendulum: a body of mass m and moments of inertia J on a hinge at the distance s.
fn pendulum(mass: f64, inertia: f64, arm: f64) -> VehicleDescription {
    let mut d = empty("pendulum");
    d.bodies.push(body("bob", mass, [inertia; 3], [arm, 0.0, 0.0]));
    d.joints.push(joint("hinge", JointKind::Revolute, ["ground", "bob"], [0.0; 3], Y));
    d
}

/// From rest in the horizontal it reaches its lowest point after K(1/√2)·√(l/g), with the complete
/// elliptic integral K and l = s + J/(m s). Down to J = 1e-11 m s² the equations keep enough digits,
/// whatever the size of m and s.
#[test]
fn issue_14_a_hinge_on_a_body_of_small_inertia_is_no_redundancy() {
    const QUARTER: f64 = 1.854_074_677_301_372;
    for mass in [1e-6, 1.0, 1e6] {
        for arm in [1e-3, 0.5, 1e2] {
            for ratio in [1e-11, 1e-10, 1e-6, 1e-2, 1.0] {
                let model =
                    VehicleModel::new(&pendulum(mass, ratio * mass * arm * arm, arm)).unwrap();
                let mut state = model.initial_state();
                let time = QUARTER * (arm * (1.0 + ratio) / G).sqrt();
                run_free(&model, &mut state, time / 500.0, 500);
                let [x, z] = [state.bodies[0].position.x, state.bodies[0].position.z];
                assert!(x.abs().max((z + arm).abs()) < 1e-7 * arm, "{mass} {arm} {ratio}: {x} {z}");
            }
        }
    }
}

/// Beyond that the message says what is wrong, and names no redundancy.
#[test]
fn refusal_an_inertia_too_small_for_the_arm_is_named() {
    for (mass, arm) in [(1e-6, 1e-3), (1.0, 1.0), (1e6, 1e3)] {
        let error = VehicleModel::new(&pendulum(mass, 1e-14 * mass * arm * arm, arm)).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, Error::Invalid { .. }), "{text}");
        assert!(text.contains("`hinge`") && text.contains("inertias"), "{text}");
    }
}

/// A chain of 300 rods between two fixed points is no problem; a second hold on its last rod is.
#[test]
fn invariant_a_redundancy_at_the_end_of_a_long_chain_is_found() {
    let ball = |name: &str, ends: [&str; 2], at| joint(name, JointKind::Spherical, ends, at, None);
    let mut d = empty("chain");
    let mut last = "ground".to_owned();
    for k in 0..300 {
        let (name, x) = (format!("rod {k}"), f64::from(k));
        d.bodies.push(body(&name, 1.0, [0.1; 3], [x + 0.5, 0.0, 0.1 * x.sin()]));
        d.joints.push(ball(&format!("joint {k}"), [&last, &name], [x, 0.0, 0.1 * x.cos()]));
        last = name;
    }
    d.joints.push(ball("end", [&last, "ground"], [300.0, 0.0, 0.0]));
    assert_eq!(VehicleModel::new(&d).unwrap().counts().degrees_of_freedom, 1800 - 903);
    d.joints.push(ball("second end", [&last, "ground"], [299.5, 0.0, 0.0]));
    let found = redundancies(&d);
    assert_eq!(names(&found), [("second end".to_owned(), vec!["`end`".to_owned()])]);
    assert_eq!(found[0].direction, "translation along (1, 0, 0)");
}
