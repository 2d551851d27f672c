//! The vehicles: counts, equilibrium, closing of joints, determinism, order.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{G, Levitation};
use multibody::{
    BodyIndex, Error, Holding, JointKind, LoadCourse, Loads, MagnetIndex, State, VehicleModel,
    train,
};

fn model(name: &str) -> VehicleModel {
    VehicleModel::new(&train::by_name(name).unwrap()).unwrap()
}

/// The paper's table 1.
#[test]
fn golden_two_car_train_has_the_counts_of_table_1() {
    let model = model("two-car");
    let counts = model.counts();
    assert_eq!(counts.bodies, 105);
    assert_eq!(counts.joints[&JointKind::Bracket], 25);
    assert_eq!(counts.joints[&JointKind::Translational], 20);
    assert_eq!(counts.joints[&JointKind::Spherical], 64);
    assert_eq!(counts.joints[&JointKind::Revolute], 12);
    assert_eq!((counts.equations, counts.rank, counts.degrees_of_freedom), (502, 502, 128));
    assert_eq!(counts.magnets, 64);
    // eight bogies and the pair of cars
    assert_eq!(counts.components, 9);
    assert!((model.total_mass() - 38_000.0).abs() < 1e-9);
}

#[test]
fn analytic_magnets_go_from_front_to_rear_left_before_right() {
    let description = train::two_car();
    let x: Vec<f64> = description.magnets.iter().map(|m| m.position[0]).collect();
    let y: Vec<f64> = description.magnets.iter().map(|m| m.position[1]).collect();
    assert_eq!((x[0], x[3], x[4], x[63]), (11.7, 9.6, 11.7, -11.7));
    assert_eq!((y[0], y[4], y[63]), (0.95, -0.95, -0.95));
}

/// Every layout hangs at rest with all magnets at the nominal gap: no acceleration under the loads
/// alone, loads linear along each side frame (least norm) and adding up to the weight.
#[test]
fn invariant_equilibrium_on_a_flat_track() {
    for name in ["one-magnet", "one-bogie", "one-car", "two-car", "5-cars"] {
        let model = model(name);
        let mut ws = model.workspace();
        let n = model.counts().magnets;
        let found = model.equilibrium(&vec![0.0; n], &Holding::default(), &mut ws).unwrap();
        for k in 0..n {
            assert!(
                model.magnet(&found.state, MagnetIndex(k)).displacement.z.abs() < 1e-10,
                "{name} {k}"
            );
        }
        let lateral = vec![0.0; n];
        let loads = Loads { vertical: &found.loads, lateral: &lateral };
        model.accelerations(&found.state, &loads, &mut ws).unwrap();
        for body in 0..found.state.bodies.len() {
            let (v, w) = ws.acceleration(BodyIndex(body));
            assert!(v.amax() < 1e-9 && w.amax() < 1e-9, "{name} body {body}: {v} {w}");
        }
        let weight = model.total_mass() * G;
        let sum: f64 = found.loads.iter().sum();
        assert!((sum - weight).abs() < 1e-9 * weight, "{name}: {sum} {weight}");
        for side in found.loads.chunks_exact(4) {
            for bend in [side[0] - 2.0 * side[1] + side[2], side[1] - 2.0 * side[2] + side[3]] {
                assert!(bend.abs() < 1e-6, "{name}: {side:?}");
            }
        }
    }
}

/// On a wavy track each side frame sits at the least-squares fit: the gap deviations left have
/// neither sum nor first moment. The search starts from the flat pose, so it also shows that the
/// result does not depend on the springs that hold the magnets meanwhile.
#[test]
fn invariant_equilibrium_on_a_wavy_track_is_the_least_squares_fit() {
    let description = train::two_car();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let track: Vec<f64> = description
        .magnets
        .iter()
        .map(|m| 3e-3 * (0.9 * m.position[0]).sin() + 1e-3 * m.position[1])
        .collect();
    let found = model.equilibrium(&track, &Holding::default(), &mut ws).unwrap();
    let other = Holding { stiffness: 1e6, ..Holding::default() };
    let again = model.equilibrium(&track, &other, &mut ws).unwrap();
    let sum: f64 = found.loads.iter().sum();
    assert!((sum - 38_000.0 * G).abs() < 1e-3);
    for side in 0..16 {
        let deviation = |i: usize| {
            track[4 * side + i]
                - model.magnet(&found.state, MagnetIndex(4 * side + i)).displacement.z
        };
        let sum: f64 = (0..4).map(deviation).sum();
        let moment: f64 = (0..4).map(|i| (i as f64 - 1.5) * deviation(i)).sum();
        assert!(sum.abs() < 1e-10 && moment.abs() < 1e-10, "{side}: {sum:e} {moment:e}");
        // the wave does not fit a straight frame, otherwise this proved nothing
        assert!((0..4).any(|i| deviation(i).abs() > 1e-5));
    }
    for (a, b) in found.loads.iter().zip(&again.loads) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}

/// A body that nothing holds has no equilibrium: said so, rather than ending anywhere.
#[test]
fn invariant_nothing_to_hold_a_body_is_an_error() {
    let mut description = train::one_magnet();
    description.bodies.push(common::body("loose", 10.0, [1.0; 3], [0.0, 0.0, 5.0]));
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let error = model.equilibrium(&[0.0], &Holding::default(), &mut ws).unwrap_err();
    assert!(matches!(error, Error::Equilibrium { acceleration, .. } if acceleration > 9.8));
}

/// Held at its loads the vehicle stays where it is: nothing jumps at the start.
#[test]
fn invariant_vehicle_in_equilibrium_stays() {
    let model = model("two-car");
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 64], &Holding::default(), &mut ws).unwrap();
    let mut state = found.state.clone();
    let mut levitation = Levitation::new(&found.loads);
    for _ in 0..1000 {
        levitation.step(&model, &mut state, 1e-3, |_| 0.0, &mut ws);
    }
    for (a, b) in found.state.bodies.iter().zip(&state.bodies) {
        assert!((a.position - b.position).amax() < 1e-9);
    }
}

/// Joints stay closed to the tolerance after every step, not only on average. The disturbance of
/// ±3 kN per magnet throws the bogie about by centimetres and tenths of a radian.
#[test]
fn invariant_joints_stay_closed_under_rough_running() {
    let model = model("one-bogie");
    let mut ws = model.workspace();
    let mut probe = model.workspace();
    let found = model.equilibrium(&[0.0; 8], &Holding::default(), &mut ws).unwrap();
    let mut state = found.state;
    let mut levitation = Levitation::new(&found.loads);
    let mut noise = common::Noise(1);
    let mut farthest = 0.0_f64;
    for _ in 0..5_000 {
        let push: Vec<f64> = (0..8).map(|_| 2e4 * noise.next()).collect();
        levitation.step(&model, &mut state, 1e-3, |k| push[k], &mut ws);
        let (position, velocity) = model.constraint_violation(&state, &mut probe);
        assert!(position <= 1e-11 && velocity <= 1e-11, "{position:e} {velocity:e}");
        farthest = farthest.max(model.magnet(&state, MagnetIndex(0)).displacement.z.abs());
    }
    assert!(farthest > 5e-3, "the bogie hardly moved: {farthest}");
}

/// One hour of rough running; takes about a minute.
#[test]
#[ignore = "takes about a minute: cargo test --release -p multibody -- --ignored --nocapture"]
fn invariant_joints_stay_closed_over_an_hour() {
    let model = model("one-bogie");
    let mut ws = model.workspace();
    let mut probe = model.workspace();
    let found = model.equilibrium(&[0.0; 8], &Holding::default(), &mut ws).unwrap();
    let mut state = found.state;
    let mut levitation = Levitation::new(&found.loads);
    let mut noise = common::Noise(2);
    let mut push = [0.0; 8];
    let mut worst = (0.0_f64, 0.0_f64);
    for n in 0..3_600_000 {
        for p in &mut push {
            *p = 2e4 * noise.next();
        }
        levitation.step(&model, &mut state, 1e-3, |k| push[k], &mut ws);
        if n % 100 == 0 {
            let (position, velocity) = model.constraint_violation(&state, &mut probe);
            worst = (worst.0.max(position), worst.1.max(velocity));
        }
    }
    println!("worst violation over an hour: {:e} m or rad, {:e} per second", worst.0, worst.1);
    assert!(worst.0 <= 1e-11 && worst.1 <= 1e-11);
}

/// The same state gives the same bits, whatever the workspace did before and however the state was
/// carried over.
#[test]
fn invariant_restored_state_gives_the_same_bits() {
    let model = model("one-car");
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 32], &Holding::default(), &mut ws).unwrap();
    let mut state = found.state.clone();
    let mut levitation = Levitation::new(&found.loads);
    let push = |k: usize| 1e3 * (k as f64).cos();
    for _ in 0..50 {
        levitation.step(&model, &mut state, 1e-3, push, &mut ws);
    }
    let text = serde_json::to_string(&state).unwrap();
    let mut copy: State = serde_json::from_str(&text).unwrap();
    for _ in 0..50 {
        levitation.step(&model, &mut state, 1e-3, push, &mut ws);
    }
    // the used workspace first remembers another pose, the fresh one nothing
    for workspace in [&mut ws, &mut model.workspace()] {
        let mut again = copy.clone();
        for _ in 0..50 {
            levitation.step(&model, &mut again, 1e-3, push, workspace);
        }
        assert_eq!(again, state);
    }
    // and one step of 10 ms differs from ten of 1 ms by rounding only: loads are held
    copy = state.clone();
    let loads: Vec<[f64; 4]> = found.loads.iter().map(|l| [l + 100.0, 0.0, 0.0, 0.0]).collect();
    let side = vec![[0.0; 4]; 32];
    let course = LoadCourse { vertical: &loads, lateral: &side };
    model.step(&mut copy, 10e-3, 1e-3, &course, &mut ws).unwrap();
    for _ in 0..10 {
        model.step(&mut state, 1e-3, 1e-3, &course, &mut ws).unwrap();
    }
    for (a, b) in copy.bodies.iter().zip(&state.bodies) {
        assert!((a.position - b.position).amax() < 1e-12);
    }
}

/// Halving the step divides the error by sixteen, loads varying as cubic polynomials.
#[test]
fn order_of_integration_is_four() {
    let model = model("one-bogie");
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 8], &Holding::default(), &mut ws).unwrap();
    let vertical: Vec<[f64; 4]> = found
        .loads
        .iter()
        .enumerate()
        .map(|(k, l)| [l + 300.0 * (k as f64 + 1.0), 1e4, -1e6, 2e7])
        .collect();
    let lateral: Vec<[f64; 4]> = (0..8).map(|k| [400.0 * f64::from(k), -3e3, 1e5, 0.0]).collect();
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    let mut end = |h: f64| {
        let mut state = found.state.clone();
        model.step(&mut state, 0.096, h, &course, &mut ws).unwrap();
        state
    };
    let exact = end(0.25e-3);
    let errors: Vec<f64> = [6e-3, 3e-3, 1.5e-3]
        .into_iter()
        .map(|h| {
            let state = end(h);
            let apart = |(a, b): (&multibody::BodyState, &multibody::BodyState)| {
                (a.position - b.position).amax().max((a.velocity - b.velocity).amax())
            };
            state.bodies.iter().zip(&exact.bodies).map(apart).fold(0.0, f64::max)
        })
        .collect();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.7..4.6).contains(&order), "{errors:?} {order}");
    }
}

/// A load is felt at once exactly as `load_response` says: the equations are linear in the loads.
#[test]
fn analytic_load_response_is_the_difference_of_accelerations() {
    let model = model("one-car");
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 32], &Holding::default(), &mut ws).unwrap();
    let side = vec![0.0; 32];
    let mut pushed = found.loads.clone();
    let mut seed = vec![0.0; 32];
    seed[5] = 1000.0;
    pushed[5] += 1000.0;
    model
        .accelerations(&found.state, &Loads { vertical: &pushed, lateral: &side }, &mut ws)
        .unwrap();
    let felt: Vec<f64> =
        (0..32).map(|k| model.magnet_acceleration(&ws, MagnetIndex(k)).z).collect();
    model.load_response(&found.state, &Loads { vertical: &seed, lateral: &side }, &mut ws).unwrap();
    for (k, felt) in felt.iter().enumerate() {
        // the equilibrium itself is left with 1e-9 m/s² at most
        let response = model.magnet_response(&ws, MagnetIndex(k)).z;
        assert!((felt - response).abs() < 2e-9, "{k}: {felt} {response}");
        // other bogies feel nothing at once
        let same = model.magnet_component(MagnetIndex(k)) == model.magnet_component(MagnetIndex(5));
        assert_eq!(response != 0.0, same, "{k}");
    }
}
