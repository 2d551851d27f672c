//! Rates of accelerations, and that what a workspace remembers never shows.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{G, Levitation, Noise, body, empty, joint, run_free, tracer};
use multibody::math::Vec3;
use multibody::{
    AppliedForces, Holding, JointKind, LoadCourse, Loads, MagnetIndex, State, VehicleModel,
    Workspace, train,
};

const NONE: Loads = Loads { vertical: &[0.0], lateral: &[0.0] };

/// The point of a pendulum that swings like a point mass at R = 1 m moves on a circle, so its jerk is
/// R (ψ⃛ − ψ̇³) along the circle and −3 R ψ̇ ψ̈ outward, with ψ̈ = −g sin ψ and ψ⃛ = −g cos ψ ψ̇, and
/// the rate of that R (ψ⁗ − 6 ψ̇² ψ̈) and R (ψ̇⁴ − 3 ψ̈² − 4 ψ̇ ψ⃛). A term of the rotating arm left out
/// would show in full.
#[test]
fn analytic_jerk_of_a_pendulum() {
    let mut d = empty("pendulum");
    d.bodies.push(body("bob", 1.0, [0.25; 3], [-0.5, 0.0, 0.0]));
    let y = Some([0.0, 1.0, 0.0]);
    d.joints.push(joint("pivot", JointKind::Revolute, ["ground", "bob"], [0.0; 3], y));
    d.magnets.push(tracer("bob", [-1.0, 0.0, 0.0]));
    let model = VehicleModel::new(&d).unwrap();
    let (mut state, mut ws, mut probe) =
        (model.initial_state(), model.workspace(), model.workspace());
    for _ in 0..5 {
        run_free(&model, &mut state, 1e-3, 130);
        let motion = model.magnet(&state, MagnetIndex(0));
        let outward = motion.position;
        let along = Vec3::new(-outward.z, 0.0, outward.x);
        let rate = motion.velocity.dot(&along);
        let (bend, third) = (-G * outward.x, G * outward.z * rate);
        let expected = along * (third - rate.powi(3)) - outward * (3.0 * rate * bend);
        model.jerks(&state, &NONE, &NONE, &mut ws, &mut probe).unwrap();
        let jerk = model.magnet_jerk(&ws, &probe, MagnetIndex(0));
        // accelerations of 30 m/s² to 1e-15 over 6e-6 s: some 1e-8 m/s³ after a few operations
        assert!((jerk - expected).amax() < 1e-7, "{jerk} {expected}");
        assert!(expected.amax() > 10.0);
        let fourth = G * (outward.x * rate * rate + outward.z * bend);
        let expected = along * (fourth - 6.0 * rate * rate * bend)
            + outward * (rate.powi(4) - 3.0 * bend * bend - 4.0 * rate * third);
        let none: AppliedForces = (&NONE).into();
        model.snaps_in_contact(&state, [none; 3], None, [&mut ws, &mut probe]).unwrap();
        let snap = model.magnet_snap(&ws, &probe, MagnetIndex(0));
        // rounding: 30 m/s² to 1e-15 over (2e-4 s)²
        assert!((snap - expected).amax() < 3e-6, "{snap} {expected}");
        assert!(expected.amax() > 10.0);
        // and the rates are still those of before
        assert_eq!(model.magnet_jerk(&ws, &probe, MagnetIndex(0)), jerk);
    }
}

/// A rough moment of a vehicle on levitation: its state, loads and their rates.
fn moment(name: &str) -> (VehicleModel, State, [Vec<[f64; 4]>; 2]) {
    let model = VehicleModel::new(&train::by_name(name).unwrap()).unwrap();
    let n = model.counts().magnets;
    let mut ws = model.workspace();
    let found = model.equilibrium(&vec![0.0; n], &Holding::default(), &mut ws).unwrap();
    let mut levitation = Levitation::new(&found.loads);
    let mut state = found.state;
    let mut noise = Noise(7);
    let push: Vec<f64> = (0..n).map(|_| 500.0 * noise.next()).collect();
    for _ in 0..30 {
        levitation.step(&model, &mut state, 1e-3, |k| push[k], &mut ws);
    }
    let mut course = |values: &[[f64; 4]]| -> Vec<[f64; 4]> {
        values.iter().map(|u| [u[0], 2e4 * noise.next(), 0.0, 0.0]).collect()
    };
    let loads = [course(&levitation.vertical), course(&levitation.lateral)];
    (model, state, loads)
}

fn part(course: &[[f64; 4]], order: usize) -> Vec<f64> {
    course.iter().map(|u| u[order]).collect()
}

/// Jerks of the whole train are what its accelerations do over the next small steps. All joints and
/// force elements are in it.
#[test]
fn analytic_jerks_are_the_slopes_of_accelerations() {
    let (model, start, [vertical, lateral]) = moment("two-car");
    let (mut ws, mut probe) = (model.workspace(), model.workspace());
    let (up, left) = (part(&vertical, 0), part(&lateral, 0));
    let (up_rate, left_rate) = (part(&vertical, 1), part(&lateral, 1));
    let loads = Loads { vertical: &up, lateral: &left };
    let rates = Loads { vertical: &up_rate, lateral: &left_rate };
    model.jerks(&start, &loads, &rates, &mut ws, &mut probe).unwrap();
    let jerks: Vec<Vec3> =
        (0..64).map(|k| model.magnet_jerk(&ws, &probe, MagnetIndex(k))).collect();
    // forward difference of fourth order
    const H: f64 = 1e-4;
    const WEIGHTS: [f64; 5] = [-25.0 / 12.0, 4.0, -3.0, 4.0 / 3.0, -0.25];
    let mut slopes = vec![Vec3::zeros(); 64];
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    for (n, weight) in WEIGHTS.into_iter().enumerate() {
        let (mut state, t) = (start.clone(), n as f64 * H);
        if n > 0 {
            model.step(&mut state, t, H, &course, &mut ws).unwrap();
        }
        let at = |u: &[[f64; 4]]| u.iter().map(|u| u[0] + t * u[1]).collect::<Vec<_>>();
        let loads = Loads { vertical: &at(&vertical), lateral: &at(&lateral) };
        model.accelerations(&state, &loads, &mut ws).unwrap();
        for (k, slope) in slopes.iter_mut().enumerate() {
            *slope += model.magnet_acceleration(&ws, MagnetIndex(k)) * (weight / H);
        }
    }
    let largest = jerks.iter().map(Vec3::amax).fold(0.0, f64::max);
    assert!(largest > 30.0, "nothing to see: {largest}");
    for (k, (jerk, slope)) in jerks.iter().zip(&slopes).enumerate() {
        // (400 rad/s · H)⁴/5 = 5e-7 of the largest; joints closed to 1e-13 m, a bushing of 4e5 N/m
        // and 50 kg: 1e-9 m/s², over H and with the weights 5e-5 m/s³
        assert!((jerk - slope).amax() < 1e-6 * largest + 5e-5, "{k}: {jerk} {slope}");
    }
}

/// Second derivatives of the accelerations of the whole train are what its jerks do over the next small steps,
/// under forces with curved courses.
#[test]
fn analytic_snaps_are_the_slopes_of_jerks() {
    let (model, start, [mut vertical, lateral]) = moment("two-car");
    let (mut ws, mut probe) = (model.workspace(), model.workspace());
    for (k, u) in vertical.iter_mut().enumerate() {
        u[2] = 1e6 * (k as f64 - 31.5) / 32.0;
    }
    let at =
        |u: &[[f64; 4]], t: f64| u.iter().map(|u| u[0] + t * (u[1] + 0.5 * t * u[2])).collect();
    let rate = |u: &[[f64; 4]], t: f64| u.iter().map(|u| u[1] + t * u[2]).collect();
    let bend = [part(&vertical, 2), part(&lateral, 2)];
    let applied = |loads: &[Vec<f64>; 2], of: &mut dyn FnMut(AppliedForces)| {
        of((&Loads { vertical: &loads[0], lateral: &loads[1] }).into());
    };
    let all = |t: f64, of: &mut dyn FnMut([AppliedForces; 3])| {
        let values: [Vec<f64>; 2] = [at(&vertical, t), at(&lateral, t)];
        let rates: [Vec<f64>; 2] = [rate(&vertical, t), rate(&lateral, t)];
        applied(&values, &mut |value| {
            applied(&rates, &mut |rate| applied(&bend, &mut |bend| of([value, rate, bend])));
        });
    };
    let mut snaps = Vec::new();
    all(0.0, &mut |loads| {
        model.snaps_in_contact(&start, loads, None, [&mut ws, &mut probe]).unwrap();
        snaps = (0..64).map(|k| model.magnet_snap(&ws, &probe, MagnetIndex(k))).collect();
    });
    const H: f64 = 2e-4;
    const WEIGHTS: [f64; 5] = [-25.0 / 12.0, 4.0, -3.0, 4.0 / 3.0, -0.25];
    let mut slopes = vec![Vec3::zeros(); 64];
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    for (n, weight) in WEIGHTS.into_iter().enumerate() {
        let (mut state, t) = (start.clone(), n as f64 * H);
        if n > 0 {
            model.step(&mut state, t, 1e-4, &course, &mut ws).unwrap();
        }
        all(t, &mut |[loads, rates, _]| {
            model.jerks_in_contact(&state, loads, rates, None, [&mut ws, &mut probe]).unwrap();
        });
        for (k, slope) in slopes.iter_mut().enumerate() {
            *slope += model.magnet_jerk(&ws, &probe, MagnetIndex(k)) * (weight / H);
        }
    }
    let largest = snaps.iter().map(Vec3::amax).fold(0.0, f64::max);
    assert!(largest > 1e3, "nothing to see: {largest}");
    for (k, (snap, slope)) in snaps.iter().zip(&slopes).enumerate() {
        // the forward difference: (400 rad/s · H)⁴/5 = 8e-6 of the largest; jerks to 4e-6 m/s³ over H
        assert!((snap - slope).amax() < 2e-5 * largest + 0.2, "{k}: {snap} {slope}");
    }
}

fn bits(model: &VehicleModel, ws: &Workspace) -> Vec<u64> {
    let magnets =
        (0..model.counts().magnets).map(|k| model.magnet_acceleration(ws, MagnetIndex(k)));
    magnets
        .flat_map(|a| [a.x, a.y, a.z])
        .chain(ws.multipliers().to_vec())
        .map(f64::to_bits)
        .collect()
}

/// Whatever a workspace was used for before, accelerations and jerks have the bits of a fresh one.
#[test]
fn invariant_remembered_accelerations_never_show() {
    let (model, state, [vertical, lateral]) = moment("one-car");
    let (up, left) = (part(&vertical, 0), part(&lateral, 0));
    let (up_rate, left_rate) = (part(&vertical, 1), part(&lateral, 1));
    let loads = Loads { vertical: &up, lateral: &left };
    let rates = Loads { vertical: &up_rate, lateral: &left_rate };
    let fresh = |state: &State, loads: &Loads| {
        let mut ws = model.workspace();
        model.accelerations(state, loads, &mut ws).unwrap();
        bits(&model, &ws)
    };
    let fresh_jerks = |state: &State| {
        let (mut ws, mut probe) = (model.workspace(), model.workspace());
        model.jerks(state, &loads, &rates, &mut ws, &mut probe).unwrap();
        (0..32).map(|k| model.magnet_jerk(&ws, &probe, MagnetIndex(k))).collect::<Vec<_>>()
    };
    let mut moving = state.clone();
    moving.bodies[3].velocity.x += 0.1;
    let mut turned = state.clone();
    turned.bodies[3].position.z += 1e-9;
    let mut other_loads = up.clone();
    other_loads[31] += 1.0;
    let other_loads = Loads { vertical: &other_loads, lateral: &left };
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    let (mut ws, mut probe) = (model.workspace(), model.workspace());
    for round in 0..8 {
        match round {
            0 | 1 => {}
            2 => model.accelerations(&moving, &loads, &mut ws).unwrap(),
            3 => model.accelerations(&turned, &loads, &mut ws).unwrap(),
            4 => model.accelerations(&state, &other_loads, &mut ws).unwrap(),
            5 => model.load_response(&state, &other_loads, &mut ws).unwrap(),
            6 => {
                model.constraint_violation(&turned, &mut ws);
            }
            _ => model.step(&mut state.clone(), 1e-3, 1e-3, &course, &mut ws).unwrap(),
        }
        model.accelerations(&state, &loads, &mut ws).unwrap();
        assert_eq!(bits(&model, &ws), fresh(&state, &loads), "round {round}");
        model.jerks(&state, &loads, &rates, &mut ws, &mut probe).unwrap();
        let jerks: Vec<Vec3> =
            (0..32).map(|k| model.magnet_jerk(&ws, &probe, MagnetIndex(k))).collect();
        assert_eq!(jerks, fresh_jerks(&state), "round {round}");
    }
    // and what is remembered is not taken for another state or other loads
    for (state, loads) in [(&moving, &loads), (&turned, &loads), (&state, &other_loads)] {
        model.accelerations(state, loads, &mut ws).unwrap();
        assert_eq!(bits(&model, &ws), fresh(state, loads));
    }
}
