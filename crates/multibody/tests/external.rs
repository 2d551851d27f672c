//! External forces and moments on observed bodies.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{body, empty, joint};
use multibody::{
    AppliedCourse, AppliedForces, BodyIndex, Error, FurtherCourse, Holding, Inertia, JointKind,
    LoadCourse, Loads, MagnetIndex, MagnetPoint, Observed, ObservedIndex, VehicleDescription,
    VehicleModel, train,
};

const NONE: Loads = Loads { vertical: &[], lateral: &[] };

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

/// A free turned body without weight, with a magnet at its centre of mass.
fn free() -> VehicleDescription {
    let mut d = empty("free");
    d.gravity = [0.0; 3];
    let mut mass = body("mass", 4.0, [1.0; 3], [1.0, 2.0, 3.0]);
    mass.inertia = Inertia::Principal([2.0, 3.0, 4.0]);
    // a quarter turn about z
    let half = std::f64::consts::FRAC_1_SQRT_2;
    mass.orientation = Some([half, 0.0, 0.0, half]);
    d.bodies.push(mass);
    d.observed.push(observed("mass"));
    d.magnets.push(MagnetPoint { body: "mass".to_owned(), position: [1.0, 2.0, 3.0] });
    d
}

/// a = F/m; J ω̇ = Aᵀ M: world axes, whatever the body's attitude.
#[test]
fn analytic_a_free_body_obeys_newton_and_euler() {
    let model = VehicleModel::new(&free()).unwrap();
    let mut ws = model.workspace();
    let magnets = Loads { vertical: &[0.0], lateral: &[0.0] };
    let external = [[4.0, -8.0, 12.0, 3.0, 2.0, 8.0]];
    let forces = AppliedForces { magnets, external: &external, acceleration: 0.0 };
    model.accelerations(&model.initial_state(), forces, &mut ws).unwrap();
    let (v, w) = ws.acceleration(BodyIndex(0));
    for (value, expected) in v.iter().chain(w.iter()).zip([1.0, -2.0, 3.0, 1.0, -1.0, 2.0]) {
        assert!((value - expected).abs() < 1e-14, "{v} {w}");
    }
    // the answer to a change is the same; and without it there is none
    model.load_response(&model.initial_state(), forces, &mut ws).unwrap();
    assert!((model.observed_response(&ws, ObservedIndex(0)).z - 3.0).abs() < 1e-14);
    model.accelerations(&model.initial_state(), &magnets, &mut ws).unwrap();
    assert_eq!(ws.acceleration(BodyIndex(0)).0.amax(), 0.0);
}

/// A force that grows: ½ a t² + j t³/6, and the jerk is its rate over the mass.
#[test]
fn analytic_a_growing_force_over_a_step() {
    let model = VehicleModel::new(&free()).unwrap();
    let (mut ws, mut probe) = (model.workspace(), model.workspace());
    let magnets = LoadCourse { vertical: &[[0.0; 4]], lateral: &[[0.0; 4]] };
    let mut external = [[[0.0; 4]; 6]];
    external[0][1] = [8.0, 40.0, 0.0, 0.0];
    let mut state = model.initial_state();
    model
        .step(
            &mut state,
            0.1,
            0.03,
            AppliedCourse {
                magnets,
                further: FurtherCourse::default(),
                external: &external,
                acceleration: [0.0; 4],
            },
            &mut ws,
        )
        .unwrap();
    let way = 0.5 * 2.0 * 0.01 + 10.0 * 0.001 / 6.0;
    assert!((state.bodies[0].position.y - 2.0 - way).abs() < 1e-14);
    let still = Loads { vertical: &[0.0], lateral: &[0.0] };
    let now = AppliedForces {
        magnets: still,
        external: &[[0.0, 12.0, 0.0, 0.0, 0.0, 0.0]],
        acceleration: 0.0,
    };
    let rates = AppliedForces {
        magnets: still,
        external: &[[0.0, 40.0, 0.0, 0.0, 0.0, 0.0]],
        acceleration: 0.0,
    };
    model.jerks(&state, now, rates, &mut ws, &mut probe).unwrap();
    let jerk = model.magnet_jerk(&ws, &probe, MagnetIndex(0));
    assert!((jerk.y - 10.0).abs() < 1e-6, "{jerk}");
}

/// Wind on the first car of a train that its magnets hold sideways: their forces balance it in direction and
/// in moment about the track, and nothing moves.
#[test]
fn analytic_wind_on_a_car_is_carried_by_the_magnets() {
    let description = train::two_car();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let hold = |_: f64, _: f64, offset: f64| [-2e5 * offset, 2e5];
    let wind = [0.0, 6000.0, -1500.0, 900.0, 0.0, 0.0];
    let external = [wind, [0.0; 6]];
    let rest = |external: &[[f64; 6]]| {
        let (flat, holding) = (vec![0.0; 64], Holding::default());
        model.loaded_equilibrium(&flat, &holding, &hold, external, &mut model.workspace()).unwrap()
    };
    let (calm, found) = (rest(&[]), rest(&external));
    let sideways: f64 = found.lateral.iter().sum();
    assert!((sideways + 6000.0).abs() < 1e-5, "{sideways} N");
    let up: f64 = found.loads.iter().sum::<f64>() - calm.loads.iter().sum::<f64>();
    assert!((up - 1500.0).abs() < 1e-5, "{up} N");
    let magnets = Loads { vertical: &found.loads, lateral: &found.lateral };
    let forces = AppliedForces { magnets, external: &external, acceleration: 0.0 };
    model.accelerations(&found.state, forces, &mut ws).unwrap();
    for body in 0..found.state.bodies.len() {
        let (v, w) = ws.acceleration(BodyIndex(body));
        assert!(v.amax() < 1e-9 && w.amax() < 1e-9, "body {body}: {v} {w}");
    }
    // all weights, forces and moments of the displaced train about the world's x axis
    let mut about_x = wind[3];
    let place = model.observed_motion(&found.state, ObservedIndex(0)).position;
    about_x += place.y * wind[2] - place.z * wind[1];
    for k in 0..64 {
        let place = model.magnet(&found.state, MagnetIndex(k)).position;
        about_x += place.y * found.loads[k] - place.z * found.lateral[k];
    }
    // the composites' weights by their momentum, were they to fall: r × m g = −g (m y)
    let mut falling = found.state.clone();
    falling.bodies.iter_mut().for_each(|body| body.velocity.z = -9.81);
    about_x += model.momentum(&falling).1.x;
    assert!(about_x.abs() < 1e-3, "{about_x} N·m are not balanced");
    let lean = model.observed_attitude(&found.state, ObservedIndex(0))[0];
    assert!(lean.abs() > 1e-4, "the wind does nothing");
}

/// The same on girders that hang through by 4 mm, with the law of the magnets, which holds nothing sideways
/// while the search still pulls the magnets down.
#[test]
fn analytic_wind_on_a_train_on_deflected_girders() {
    let description = train::cars(3);
    let model = VehicleModel::new(&description).unwrap();
    let pole = |load: f64, gap: f64, offset: f64| {
        let slope = load * std::f64::consts::FRAC_2_PI / 0.028;
        let fall = slope * gap * gap / (gap * gap + offset * offset);
        [-slope * gap * (offset / gap).atan(), fall]
    };
    let track: Vec<f64> =
        description.magnets.iter().map(|m| -4e-3 * (m.position[0] / 25.0).cos().abs()).collect();
    let external = [[0.0, 3000.0, 0.0, -500.0, 0.0, 0.0], [0.0; 6], [0.0; 6]];
    let mut ws = model.workspace();
    let holding = Holding::default();
    let found = model.loaded_equilibrium(&track, &holding, &pole, &external, &mut ws).unwrap();
    assert!(found.acceleration < 1e-9, "{}", found.acceleration);
    let sideways: f64 = found.lateral.iter().sum();
    assert!((sideways + 3000.0).abs() < 1e-5, "{sideways} N");
}

/// Zeros are none, bit for bit; the workspace tells forces apart.
#[test]
fn invariant_no_wind_changes_no_bit() {
    let model = VehicleModel::new(&train::one_car()).unwrap();
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 32], &Holding::default(), &mut ws).unwrap();
    let side = [7.0; 32];
    let magnets = Loads { vertical: &found.loads, lateral: &side };
    let mut answer = |external: &[[f64; 6]]| -> Vec<u64> {
        let forces = AppliedForces { magnets, external, acceleration: 0.0 };
        model.accelerations(&found.state, forces, &mut ws).unwrap();
        let all = (0..found.state.bodies.len()).flat_map(|k| {
            let (v, w) = ws.acceleration(BodyIndex(k));
            [v.x, v.y, v.z, w.x, w.y, w.z]
        });
        all.map(f64::to_bits).collect()
    };
    let none = answer(&[]);
    let windy = answer(&[[0.0, 100.0, 0.0, 0.0, 0.0, 0.0]]);
    assert_ne!(none, windy);
    assert_eq!(none, answer(&[]));
    assert_eq!(none, answer(&[[0.0; 6]]));
    assert_eq!(windy, answer(&[[0.0, 100.0, 0.0, 0.0, 0.0, 0.0]]));
}

/// A bracket passes on what acts on the observed body beyond it.
#[test]
fn analytic_a_bracket_carries_the_external_load() {
    let mut d = empty("pair");
    d.gravity = [0.0; 3];
    d.bodies.push(body("base", 1e9, [1e9; 3], [0.0; 3]));
    d.bodies.push(body("mast", 1.0, [1.0; 3], [0.0, 0.0, 5.0]));
    d.joints.push(joint("foot", JointKind::Bracket, ["base", "mast"], [0.0; 3], None));
    d.observed.push(observed("mast"));
    let model = VehicleModel::new(&d).unwrap();
    let external = [[0.0, 10.0, 0.0, 0.0, 0.0, 2.0]];
    let forces = AppliedForces { magnets: NONE, external: &external, acceleration: 0.0 };
    let mut ws = model.workspace();
    let reaction = model.reaction("foot", &model.initial_state(), forces, &mut ws).unwrap();
    assert!((reaction.force.y + 10.0).abs() < 1e-6, "{}", reaction.force);
    assert!((reaction.moment.x - 50.0).abs() < 1e-5, "{}", reaction.moment);
    assert!((reaction.moment.z + 2.0).abs() < 1e-6, "{}", reaction.moment);
}

/// How the linearised train answers to a small wind is the difference of two accelerations.
#[test]
fn analytic_shapes_of_external_loads_agree_with_accelerations() {
    let model = VehicleModel::new(&train::one_car()).unwrap();
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 32], &Holding::default(), &mut ws).unwrap();
    let side = [0.0; 32];
    let magnets = Loads { vertical: &found.loads, lateral: &side };
    let springs = multibody::MagnetSprings::default();
    let linear = model.linearise(&found.state, &magnets, &springs, &mut ws).unwrap();
    let shapes = model.external_shapes(&found.state, &linear);
    let factors = linear.mass.clone().cholesky().unwrap();
    for component in 0..6 {
        let mut load = [0.0; 6];
        load[component] = 1.0;
        let silent = Loads { vertical: &side, lateral: &side };
        let forces = AppliedForces { magnets: silent, external: &[load], acceleration: 0.0 };
        model.load_response(&found.state, forces, &mut ws).unwrap();
        let reduced = factors.solve(&shapes.row(component).transpose());
        let felt = &linear.basis * reduced;
        for body in 0..found.state.bodies.len() {
            let (v, w) = ws.acceleration(BodyIndex(body));
            for (i, value) in v.iter().chain(w.iter()).enumerate() {
                let expected = felt[6 * body + i];
                assert!((value - expected).abs() < 1e-12, "{component}: {value} {expected}");
            }
        }
    }
}

#[test]
fn refusal_of_external_loads_names_the_body() {
    let model = VehicleModel::new(&free()).unwrap();
    let mut ws = model.workspace();
    let magnets = Loads { vertical: &[0.0], lateral: &[0.0] };
    let external = [[0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0]];
    let forces = AppliedForces { magnets, external: &external, acceleration: 0.0 };
    let failed = model.accelerations(&model.initial_state(), forces, &mut ws).unwrap_err();
    assert!(failed.to_string().contains("external force or moment on `mass`"), "{failed}");
    let two = [[0.0; 6]; 2];
    let forces = AppliedForces { magnets, external: &two, acceleration: 0.0 };
    let failed = model.accelerations(&model.initial_state(), forces, &mut ws).unwrap_err();
    assert!(matches!(failed, Error::Argument { what: "external loads", .. }), "{failed}");
}
