//! The vehicle's modes, by differences of the nonlinear equations about the equilibrium.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

use multibody::math::{Vec3, from_rotation_vector, multiply};
use multibody::{BodyIndex, Holding, Loads, MagnetIndex, State, VehicleModel, train};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Springs and dampers in place of the levitation: N/m and N·s/m per magnet.
struct Held {
    vertical: [f64; 2],
    lateral: [f64; 2],
}

/// A complex number (real, imaginary), 1/s.
type Pole = (f64, f64);

/// Columns: all motions that the joints allow in this pose.
fn free_motions(model: &VehicleModel, state: &State) -> DMatrix<f64> {
    let zero = vec![0.0; model.counts().magnets];
    let loads = Loads { vertical: &zero, lateral: &zero };
    let (_, jacobian, _) = model.dense_system(state, &loads, &mut model.workspace());
    let eigen = SymmetricEigen::new(jacobian.tr_mul(&jacobian));
    // squares of singular values: the smallest proper one is 3e-3, rounding leaves 1e-14
    let columns: Vec<_> = (0..eigen.eigenvalues.len())
        .filter(|&k| eigen.eigenvalues[k] < 1e-8)
        .map(|k| eigen.eigenvectors.column(k))
        .collect();
    DMatrix::from_columns(&columns)
}

fn part(motion: &DVector<f64>, first: usize) -> Vec3 {
    Vec3::new(motion[first], motion[first + 1], motion[first + 2])
}

/// The state displaced (or set moving) by a motion.
fn shifted(state: &State, motion: &DVector<f64>, moving: bool) -> State {
    let mut state = state.clone();
    for (k, body) in state.bodies.iter_mut().enumerate() {
        let (way, turn) = (part(motion, 6 * k), part(motion, 6 * k + 3));
        if moving {
            (body.velocity, body.angular_velocity) = (way, turn);
        } else {
            body.position += way;
            body.attitude = multiply(body.attitude, from_rotation_vector(&turn));
        }
    }
    state
}

/// Poles about the equilibrium, fastest first; of a pair the one with positive imaginary part.
fn poles(model: &VehicleModel, held: &Held) -> Vec<Pole> {
    let mut ws = model.workspace();
    let n = model.counts().magnets;
    let found = model.equilibrium(&vec![0.0; n], &Holding::default(), &mut ws).unwrap();
    let free = free_motions(model, &found.state);
    let mut acceleration = |state: &State| {
        let mut force = [found.loads.clone(), vec![0.0; n]];
        let [up, left] = &mut force;
        for (k, (up, left)) in up.iter_mut().zip(left).enumerate() {
            let m = model.magnet(state, MagnetIndex(k));
            *up -= held.vertical[0] * m.displacement.z + held.vertical[1] * m.velocity.z;
            *left -= held.lateral[0] * m.displacement.y + held.lateral[1] * m.velocity.y;
        }
        let loads = Loads { vertical: &force[0], lateral: &force[1] };
        model.accelerations(state, &loads, &mut ws).unwrap();
        let all = (0..state.bodies.len()).flat_map(|k| {
            let (v, w) = ws.acceleration(BodyIndex(k));
            [v.x, v.y, v.z, w.x, w.y, w.z]
        });
        free.tr_mul(&DVector::from_iterator(free.nrows(), all))
    };
    let dof = free.ncols();
    let mut matrix = DMatrix::zeros(2 * dof, 2 * dof);
    let h = 1e-6;
    for j in 0..dof {
        matrix[(j, dof + j)] = 1.0;
        for (moving, column) in [(false, j), (true, dof + j)] {
            let motion = free.column(j) * h;
            let change = acceleration(&shifted(&found.state, &motion, moving))
                - acceleration(&shifted(&found.state, &-motion, moving));
            matrix.view_mut((dof, column), (dof, 1)).copy_from(&(change / (2.0 * h)));
        }
    }
    let mut poles: Vec<Pole> =
        matrix.complex_eigenvalues().iter().map(|z| (z.re, z.im)).filter(|z| z.1 >= 0.0).collect();
    poles.sort_by(|a, b| b.0.hypot(b.1).total_cmp(&a.0.hypot(a.1)));
    poles
}

/// With 7e5 N/m and 8e3 N·s/m per magnet a linear prototype, written apart from this code with the
/// same connections, masses and stiffnesses, has its fastest pair at −209 ± 308i 1/s (three
/// digits). A missing element, a wrong inertia or arm moves it.
#[test]
fn golden_fastest_pair_of_the_two_car_train() {
    let model = VehicleModel::new(&train::two_car()).unwrap();
    let poles = poles(&model, &Held { vertical: [7e5, 8e3], lateral: [0.0, 0.0] });
    let (re, im) = poles[0];
    assert!((re + 209.0).abs() < 0.5 && (im - 308.0).abs() < 0.5, "{re} {im}");
    // eight bogies, each swings alike: pairs come in groups of eight
    assert!(poles[..8].iter().all(|p| (p.0 - re).abs() < 0.1 && (p.1 - im).abs() < 0.1));
    assert!(poles[8].0 > re + 0.5);
}

/// Held in both directions the train is stable in all of its 128 degrees of freedom.
#[test]
fn invariant_a_held_train_is_stable() {
    let model = VehicleModel::new(&train::two_car()).unwrap();
    let poles = poles(&model, &Held { vertical: [7e5, 8e3], lateral: [5e4, 1e3] });
    assert!(poles.iter().all(|p| p.0 < -0.1), "{:?}", poles.last());
}

/// One bogie's carriage on four air springs above stiffly held side frames: heave at about
/// ω² = k/m with k = 4·62 kN/m and m = 2,750 kg, damping 4·1600/(2 m).
#[test]
fn analytic_heave_of_the_carriage_of_one_bogie() {
    let model = VehicleModel::new(&train::one_bogie()).unwrap();
    let poles = poles(&model, &Held { vertical: [1e9, 1e6], lateral: [1e9, 1e6] });
    let delta: f64 = 4.0 * 1600.0 / (2.0 * 2750.0);
    let omega = (4.0 * 62e3 / 2750.0 - delta * delta).sqrt();
    // the side frames yield by k/K = 2.48e5/8e9
    let found = poles.iter().any(|p| (p.0 + delta).abs() < 1e-3 && (p.1 - omega).abs() < 1e-3);
    assert!(found, "{delta} {omega} {poles:?}");
}
