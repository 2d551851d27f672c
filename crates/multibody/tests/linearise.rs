//! Linearisation: closed forms, the matrices' properties, and motions that follow the mode shapes.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{G, body, empty, joint, run, tracer};
use multibody::math::{Vec3, conjugate, from_rotation_vector, multiply, rotation_vector};
use multibody::{
    Bushing, Holding, JointKind, Linearisation, Loads, MagnetSprings, Spring, State,
    VehicleDescription, VehicleModel, damping_ratio, natural_frequency, train,
};
use nalgebra::{Complex, DMatrix, SymmetricEigen};

fn linearised(description: &VehicleDescription, start: impl Fn(&mut State)) -> Linearisation {
    let model = VehicleModel::new(description).unwrap();
    let mut state = model.initial_state();
    start(&mut state);
    let zero = vec![0.0; model.counts().magnets];
    let loads = Loads { vertical: &zero, lateral: &zero };
    model.linearise(&state, &loads, &MagnetSprings::default(), &mut model.workspace()).unwrap()
}

/// The equilibrium under its own loads, linearised with springs at the magnets.
fn at_equilibrium(
    model: &VehicleModel,
    springs: &MagnetSprings,
) -> (multibody::Equilibrium, Linearisation) {
    let mut ws = model.workspace();
    let zero = vec![0.0; model.counts().magnets];
    let found = model.equilibrium(&zero, &Holding::default(), &mut ws).unwrap();
    let loads = Loads { vertical: &found.loads, lateral: &zero };
    let linearisation = model.linearise(&found.state, &loads, springs, &mut ws).unwrap();
    (found, linearisation)
}

const HELD: MagnetSprings =
    MagnetSprings { stiffness: 7e5, damping: 8e3, lateral_stiffness: 5e4, lateral_damping: 1e3 };

/// Asserts that one eigenvalue is λ up to a share of its size.
fn assert_pole(linearisation: &Linearisation, expected: Complex<f64>, share: f64) {
    let nearest = linearisation
        .eigenvalues
        .iter()
        .map(|found| natural_frequency(found - expected))
        .fold(f64::INFINITY, f64::min);
    let all = &linearisation.eigenvalues;
    assert!(nearest < share * natural_frequency(expected), "{expected} not in {all:?}");
}

fn asymmetry(matrix: &DMatrix<f64>) -> f64 {
    (matrix - matrix.transpose()).amax() / matrix.amax()
}

/// A body on six springs and dampers at its centre: λ² m + λ c + k = 0 in each direction.
#[test]
fn analytic_bushing_held_body() {
    let (mass, inertia) = (2.0, [0.1, 0.2, 0.3]);
    let mut d = empty("held");
    d.gravity = [0.0; 3];
    d.bodies.push(body("mass", mass, inertia, [1.0, -2.0, 3.0]));
    d.bushings.push(Bushing {
        name: "hold".to_owned(),
        body_a: "ground".to_owned(),
        body_b: "mass".to_owned(),
        position: [1.0, -2.0, 3.0],
        orientation: None,
        translational_stiffness: [100.0, 400.0, 900.0],
        translational_damping: [1.0, 2.0, 3.0],
        rotational_stiffness: [9.0, 6.0, 7.0],
        rotational_damping: [0.1, 0.0, 4.0],
        preload: [0.0; 3],
    });
    let linearisation = linearised(&d, |_| ());
    assert_eq!((linearisation.degrees_of_freedom(), linearisation.rank), (6, 0));
    for (m, c, k) in [
        (mass, 1.0, 100.0),
        (mass, 2.0, 400.0),
        (mass, 3.0, 900.0),
        (inertia[0], 0.1, 9.0),
        (inertia[1], 0.0, 6.0),
        (inertia[2], 4.0, 7.0),
    ] {
        let root = Complex::<f64>::from(c * c - 4.0 * m * k).sqrt();
        for sign in [1.0, -1.0] {
            let pole = (root * sign - c) / (2.0 * m);
            if pole.im >= 0.0 {
                // a rotation vector's third derivative is of order one: DISPLACED² = 1e-10
                assert_pole(&linearisation, pole, 1e-9);
            }
        }
    }
    // the mode along x moves nothing else
    let pole = linearisation.eigenvalues.iter().find(|p| (p.im - 50.0f64.sqrt()).abs() < 0.1);
    let shape = linearisation.shape(*pole.unwrap()).unwrap();
    let size = shape[0].displacement.norm();
    assert!((shape[0].displacement.x.norm_sqr().sqrt() - size).abs() < 1e-9 * size);
    assert!(shape[0].rotation.norm() < 1e-6 * size);
    assert!((shape[0].share - 1.0).abs() < 1e-12);
}

/// A physical pendulum: ω² = m g l / (J + m l²), hanging; ± the same, real, standing.
#[test]
fn analytic_pendulum_hanging_and_standing() {
    let (m, l, j) = (3.0, 0.7, 0.2);
    let omega = (m * G * l / (j + m * l * l)).sqrt();
    for (side, pole) in [(-1.0, Complex::new(0.0, omega)), (1.0, Complex::from(omega))] {
        let mut d = empty("pendulum");
        d.bodies.push(body("bob", m, [0.1, j, 0.1], [0.0, 0.0, side * l]));
        let y = Some([0.0, 1.0, 0.0]);
        d.joints.push(joint("pivot", JointKind::Revolute, ["ground", "bob"], [0.0; 3], y));
        let linearisation = linearised(&d, |_| ());
        assert_eq!((linearisation.degrees_of_freedom(), linearisation.rank), (1, 5));
        // all stiffness is that of the joint's force turning with the body; DISPLACED² = 1e-10
        assert_pole(&linearisation, pole, 1e-9);
    }
}

/// A mass on a spring: k/m along it, and across it g/l by the spring's tension alone.
#[test]
fn analytic_tension_is_stiffness() {
    let (m, k, l) = (2.0, 500.0, 0.8);
    let mut d = empty("spring pendulum");
    d.bodies.push(body("bob", m, [0.1; 3], [0.0; 3]));
    d.springs.push(Spring {
        name: "spring".to_owned(),
        body_a: "ground".to_owned(),
        position_a: [0.0, 0.0, l],
        body_b: "bob".to_owned(),
        position_b: [0.0; 3],
        stiffness: k,
        damping: 0.0,
        free_length: Some(l - m * G / k),
    });
    let linearisation = linearised(&d, |_| ());
    assert_pole(&linearisation, Complex::new(0.0, (k / m).sqrt()), 1e-9);
    assert_pole(&linearisation, Complex::new(0.0, (G / l).sqrt()), 1e-9);
    assert!(asymmetry(&linearisation.stiffness) < 1e-9);
}

/// A sleeping top: seen from outside it nutates and precesses at
/// ν = (I₃Ω ± √(I₃²Ω² − 4 I₁ m g l)) / (2 I₁), in its own axes at ν − Ω.
#[test]
fn analytic_sleeping_top() {
    let (m, l, i1, i3, spin) = (1.5, 0.3, 0.02, 0.035, 60.0);
    let mut d = empty("top");
    d.bodies.push(body("top", m, [i1, i1, i3], [0.0, 0.0, l]));
    d.joints.push(joint("tip", JointKind::Spherical, ["ground", "top"], [0.0; 3], None));
    let linearisation =
        linearised(&d, |state| state.bodies[0].angular_velocity = Vec3::new(0.0, 0.0, spin));
    assert_eq!((linearisation.degrees_of_freedom(), linearisation.rank), (3, 3));
    let about_tip = i1 + m * l * l;
    let root = ((i3 * spin).powi(2) - 4.0 * about_tip * m * G * l).sqrt();
    // fails to be real for a top too slow to sleep
    assert!(root > 0.0);
    for sign in [1.0, -1.0] {
        let nu = (i3 * spin + sign * root) / (2.0 * about_tip);
        assert_pole(&linearisation, Complex::new(0.0, (nu - spin).abs()), 1e-8);
    }
    // gyroscopic forces do no work, gravity and the centrifugal ones have a potential
    let damping = &linearisation.damping;
    assert!((damping + damping.transpose()).amax() < 1e-8 * damping.amax());
    assert!(damping.amax() > 1.0);
    assert!(asymmetry(&linearisation.stiffness) < 1e-8);
}

/// The two-car train at rest: 128 coordinates left by rank 352 of its 480 merged unknowns; with
/// 7e5 N/m and 8e3 N·s/m per magnet its fastest pair is that of a prototype written apart.
#[test]
fn golden_two_car_train() {
    let model = VehicleModel::new(&train::two_car()).unwrap();
    let springs = MagnetSprings { stiffness: 7e5, damping: 8e3, ..MagnetSprings::default() };
    let (_, linearisation) = at_equilibrium(&model, &springs);
    assert_eq!(linearisation.degrees_of_freedom(), 128);
    assert_eq!(linearisation.rank, 352);
    let fastest = *linearisation.eigenvalues.last().unwrap();
    // the prototype's digits
    assert!((fastest.re + 209.48).abs() < 0.005, "{fastest}");
    assert!((fastest.im - 308.47).abs() < 0.005, "{fastest}");
    let expected = natural_frequency(fastest);
    assert!((damping_ratio(fastest) - 209.48 / expected).abs() < 1e-4);
}

/// M_r is symmetric and definite, as M is; at rest K_r is symmetric (all forces have a potential) and
/// C_r symmetric and not negative (dampers take energy); N is orthonormal and keeps the joints.
#[test]
fn invariant_matrices_of_the_held_train() {
    let model = VehicleModel::new(&train::two_car()).unwrap();
    let (found, linearisation) = at_equilibrium(&model, &HELD);
    let Linearisation { basis, mass, damping, stiffness, .. } = &linearisation;
    assert!(asymmetry(mass) == 0.0);
    assert!(SymmetricEigen::new(mass.clone()).eigenvalues.min() > 0.1);
    // differences know K/M to 2e-6 1/s², on 1e4 kg that is 0.02 N/m beside 1e6 N/m
    assert!(asymmetry(stiffness) < 1e-7, "{}", asymmetry(stiffness));
    assert!(asymmetry(damping) < 1e-7, "{}", asymmetry(damping));
    let lowest =
        |m: &DMatrix<f64>| SymmetricEigen::new((m + m.transpose()) * 0.5).eigenvalues.min();
    assert!(lowest(damping) > -1e-7 * damping.amax());
    assert!(lowest(stiffness) > 0.0);
    let unit = basis.tr_mul(basis) - DMatrix::identity(128, 128);
    // 480 products of rounded numbers
    assert!(unit.amax() < 1e-13);
    let zero = vec![0.0; 64];
    let loads = Loads { vertical: &zero, lateral: &zero };
    let (_, jacobian, _) = model.dense_system(&found.state, &loads, &mut model.workspace());
    assert!((jacobian * basis).amax() < 1e-12);
}

/// Every shape solves (λ² M_r + λ C_r + K_r) y = 0; its shares are shares.
#[test]
fn invariant_shapes_solve_their_equation() {
    let model = VehicleModel::new(&train::one_bogie()).unwrap();
    let (_, linearisation) = at_equilibrium(&model, &HELD);
    let basis = linearisation.basis.map(Complex::from);
    let complex = |m: &DMatrix<f64>| m.map(Complex::<f64>::from);
    for &pole in &linearisation.eigenvalues {
        let shape = linearisation.shape(pole).unwrap();
        let motion = nalgebra::DVector::from_iterator(
            basis.nrows(),
            shape.iter().flat_map(|b| {
                let (d, r) = (b.displacement, b.rotation);
                [d.x, d.y, d.z, r.x, r.y, r.z]
            }),
        );
        let y = basis.ad_mul(&motion);
        let inertia = complex(&linearisation.mass) * &y * (pole * pole);
        let damping = complex(&linearisation.damping) * &y * pole;
        let elastic = complex(&linearisation.stiffness) * &y;
        let scale = inertia.norm().max(damping.norm()).max(elastic.norm());
        let rest = (inertia + damping + elastic).norm();
        // the eigenvalues carry some 1e-16 of the fastest, 1e3² 1/s², in K/M: 1e-10 of the slowest
        assert!(rest < 1e-6 * scale, "{pole}: {rest} of {scale}");
        let shares: f64 = shape.iter().map(|b| b.share).sum();
        assert!((shares - 1.0).abs() < 1e-12 && shape.iter().all(|b| b.share >= 0.0));
    }
    assert!(linearisation.shape(Complex::new(f64::NAN, 0.0)).is_err());
}

/// Deviation of a state from another as (displacement, rotation in body axes) of each body.
fn deviation(state: &State, from: &State) -> Vec<Vec3> {
    let mut all = Vec::new();
    for (now, then) in state.bodies.iter().zip(&from.bodies) {
        all.push(now.position - then.position);
        all.push(rotation_vector(multiply(conjugate(then.attitude), now.attitude)));
    }
    all
}

/// An independent route: set moving along a mode shape, the train follows Re(shape·e^{λt}). The
/// integrator knows nothing of differences, bases and eigenvalues.
#[test]
fn invariant_the_train_follows_its_modes() {
    let model = VehicleModel::new(&train::two_car()).unwrap();
    // held loads: the bodies swing against each other on their springs, as a whole they float
    let (found, linearisation) = at_equilibrium(&model, &MagnetSprings::default());
    let oscillating: Vec<_> = linearisation
        .eigenvalues
        .iter()
        .copied()
        .filter(|p| p.im > 5.0 && damping_ratio(*p) < 0.95)
        .collect();
    assert!(oscillating.len() > 40, "{}", oscillating.len());
    let zero = vec![0.0; 64];
    for pole in oscillating.into_iter().step_by(7) {
        let shape = linearisation.shape(pole).unwrap();
        let largest = shape.iter().map(|b| b.displacement.norm().max(b.rotation.norm()));
        let size = 1e-6 / largest.fold(0.0, f64::max);
        let at = |t: f64| -> Vec<[Vec3; 2]> {
            let factor = (pole * t).exp() * size;
            shape
                .iter()
                .map(|b| [b.displacement, b.rotation].map(|v| v.map(|c| (c * factor).re)))
                .collect()
        };
        let mut state = found.state.clone();
        for ((body, b), place) in state.bodies.iter_mut().zip(&shape).zip(at(0.0)) {
            body.position += place[0];
            body.attitude = multiply(body.attitude, from_rotation_vector(&place[1]));
            body.velocity = b.displacement.map(|c| (c * pole * size).re);
            body.angular_velocity = b.rotation.map(|c| (c * pole * size).re);
        }
        model.close_joints(&mut state, &mut model.workspace()).unwrap();
        let h = 1e-3;
        let steps = (std::f64::consts::TAU / pole.im / h).min(400.0).round();
        run(&model, &mut state, h, steps as usize, [&found.loads, &zero]);
        let expected = at(steps * h);
        let moved = deviation(&state, &found.state);
        for (k, place) in expected.as_flattened().iter().enumerate() {
            // deviations of 1e-6 are linear to 1e-6 of themselves; a step's error is (λh)⁵/120 of
            // the motion, some 1e-5 in all; accelerations of 1e-10 left in the equilibrium make
            // 1e-11 m in 0.4 s, which is 1e-5 of 1e-6
            let off = (moved[k] - place).norm();
            assert!(off < 1e-4 * 1e-6, "{pole}, row {k}: {off:e}");
        }
    }
}

/// The magnets' springs are those of a body on k and c: one magnet on 250 kg.
#[test]
fn analytic_one_magnet_on_its_spring() {
    let model = VehicleModel::new(&train::one_magnet()).unwrap();
    let springs = MagnetSprings { stiffness: 7e5, damping: 8e3, ..MagnetSprings::default() };
    let (_, linearisation) = at_equilibrium(&model, &springs);
    let half: f64 = 8e3 / (2.0 * 250.0);
    let expected = Complex::new(-half, (7e5 / 250.0 - half * half).sqrt());
    assert_eq!(linearisation.eigenvalues.len(), 1);
    assert_pole(&linearisation, expected, 1e-9);
}

/// A state that is displaced has its own modes: a pendulum held aside by a force swings about there.
/// Under a horizontal force F it hangs at tan φ = F/(m g) and swings at √(√(g² + (F/m)²)/l).
#[test]
fn analytic_pendulum_held_aside_by_a_force() {
    let (m, l): (f64, f64) = (2.0, 0.5);
    let mut d = empty("aside");
    // a spherical joint and the force to the left; a point mass with a little moment of inertia
    let j = 1e-3;
    d.bodies.push(body("bob", m, [j; 3], [0.0, 0.0, -l]));
    let x = Some([1.0, 0.0, 0.0]);
    d.joints.push(joint("pivot", JointKind::Revolute, ["ground", "bob"], [0.0; 3], x));
    d.magnets.push(tracer("bob", [0.0, 0.0, -l]));
    let model = VehicleModel::new(&d).unwrap();
    let force = m * G * 0.75;
    let mut state = model.initial_state();
    let angle = 0.75f64.atan();
    state.bodies[0].position = Vec3::new(0.0, l * angle.sin(), -l * angle.cos());
    state.bodies[0].attitude = from_rotation_vector(&Vec3::new(angle, 0.0, 0.0));
    let loads = Loads { vertical: &[0.0], lateral: &[force] };
    let springs = MagnetSprings::default();
    let linearisation = model.linearise(&state, &loads, &springs, &mut model.workspace()).unwrap();
    let omega = (m * G * 1.25 * l / (j + m * l * l)).sqrt();
    assert_pole(&linearisation, Complex::new(0.0, omega), 1e-9);
}
