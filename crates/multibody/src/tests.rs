//! The equations against independent routes: differences, dense algebra, energy.

mod jets;

use nalgebra::{DMatrix, DVector};

use crate::loads::Loads;
use crate::math::{Vec3, from_rotation_vector, multiply, normalised};
use crate::model::VehicleModel;
use crate::state::{State, Wrench};
use crate::workspace::Workspace;
use crate::{JointKind, VehicleDescription, train};

/// Numbers in [−1, 1), the same on every machine.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, size: f64) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * size
    }
}

/// Every body somewhere near its place, turned and moving: joints open, all terms at work.
fn disturbed(model: &VehicleModel, size: f64, noise: &mut Noise) -> State {
    let mut state = model.initial_state();
    for body in &mut state.bodies {
        body.position += noise.vector(size);
        let turn = from_rotation_vector(&noise.vector(size));
        body.attitude = normalised(multiply(body.attitude, turn));
        body.velocity = noise.vector(1.0);
        body.angular_velocity = noise.vector(1.0);
    }
    state
}

fn moved(state: &State, t: f64) -> State {
    let mut later = state.clone();
    for body in &mut later.bodies {
        body.position += body.velocity * t;
        let turn = from_rotation_vector(&(body.angular_velocity * t));
        body.attitude = normalised(multiply(body.attitude, turn));
    }
    later
}

fn residual(model: &VehicleModel, state: &State, ws: &mut Workspace) -> DVector<f64> {
    ws.forget();
    model.set_pose(&state.bodies, ws);
    model.residuals(ws);
    DVector::from_column_slice(&ws.residual)
}

fn velocity(state: &State) -> DVector<f64> {
    let parts = state.bodies.iter().flat_map(|b| {
        b.velocity.iter().chain(b.angular_velocity.iter()).copied().collect::<Vec<_>>()
    });
    DVector::from_iterator(6 * state.bodies.len(), parts)
}

/// A train in which every second bushing and every body frame is turned, so that no axis is aligned
/// by luck, with a spring between points as well: all joint kinds and elements are at work.
fn crooked() -> VehicleDescription {
    let mut d = train::two_car();
    let mut noise = Noise(7);
    for body in &mut d.bodies {
        body.orientation = Some(from_rotation_vector(&noise.vector(1.0)));
    }
    for bushing in d.bushings.iter_mut().step_by(2) {
        bushing.orientation = Some(from_rotation_vector(&noise.vector(1.0)));
        bushing.rotational_stiffness = [1e4, 2e4, 3e4];
    }
    d.springs.push(crate::Spring {
        name: "strut".to_owned(),
        body_a: "car_1".to_owned(),
        position_a: [1.0, 0.3, 1.5],
        body_b: "car_2".to_owned(),
        position_b: [-1.0, 0.1, 1.2],
        stiffness: 3e4,
        damping: 200.0,
        free_length: Some(1.5),
    });
    d
}

/// Φ_q v is the rate of Φ, and γ is −(rate of Φ_q at fixed v)·v, by central differences.
#[test]
fn analytic_jacobian_and_gamma_agree_with_differences() {
    let model = VehicleModel::new(&crooked()).unwrap();
    let mut ws = model.workspace();
    let state = disturbed(&model, 0.1, &mut Noise(3));
    let zero = vec![0.0; 64];
    let loads = Loads { vertical: &zero, lateral: &zero };
    let v = velocity(&state);
    let n = v.len();
    let (_, jacobian, rhs) = model.dense_system(&state, &loads, &mut ws);
    let h = 1e-5;
    let later = residual(&model, &moved(&state, h), &mut ws);
    let earlier = residual(&model, &moved(&state, -h), &mut ws);
    let rate = (later - earlier) / (2.0 * h);
    // h²/6 of a third derivative of some ω³ = 5 times arms of 6 m: 5e-10; rounding 1e-15·6/h
    assert!((&jacobian * &v - rate).amax() < 5e-9);
    let (_, later, _) = model.dense_system(&moved(&state, h), &loads, &mut ws);
    let (_, earlier, _) = model.dense_system(&moved(&state, -h), &loads, &mut ws);
    let bend = (later - earlier) * &v / (2.0 * h);
    assert!((rhs.rows(n, model.rows) + bend).amax() < 5e-8);
}

/// The block-sparse solution is that of the whole dense system of eq. 9.
#[test]
fn invariant_block_solver_agrees_with_dense_algebra() {
    for (description, size) in
        [(crooked(), 0.02), (train::two_car(), 0.02), (train::one_bogie(), 0.05)]
    {
        let model = VehicleModel::new(&description).unwrap();
        let mut ws = model.workspace();
        let mut noise = Noise(11);
        let state = disturbed(&model, size, &mut noise);
        let count = model.counts().magnets;
        let vertical: Vec<f64> = (0..count).map(|_| 6e3 + 1e3 * noise.next()).collect();
        let lateral: Vec<f64> = (0..count).map(|_| 1e3 * noise.next()).collect();
        let loads = Loads { vertical: &vertical, lateral: &lateral };
        let (mass, jacobian, rhs) = model.dense_system(&state, &loads, &mut ws);
        let (n, m) = (mass.nrows(), jacobian.nrows());
        let mut matrix = DMatrix::zeros(n + m, n + m);
        matrix.view_mut((0, 0), (n, n)).copy_from(&mass);
        matrix.view_mut((n, 0), (m, n)).copy_from(&jacobian);
        matrix.view_mut((0, n), (n, m)).copy_from(&jacobian.transpose());
        model.accelerations(&state, &loads, &mut ws).unwrap();
        let sparse = DVector::from_column_slice(&ws.solution);
        // the residual is the honest measure, relative to the forces (1e5 N)
        let left = &matrix * &sparse - &rhs;
        assert!(left.amax() < 1e-9 * rhs.amax(), "{}: {:e}", description.name, left.amax());
        let dense = matrix.lu().solve(&rhs).unwrap();
        let apart = (&dense - &sparse).rows(0, n).amax();
        assert!(apart < 1e-9 * dense.rows(0, n).amax(), "{}: {apart:e}", description.name);
        let apart = (&dense - &sparse).rows(n, m).amax();
        assert!(apart < 1e-9 * dense.rows(n, m).amax(), "{}: {apart:e}", description.name);
    }
}

/// At rest, forces are minus the gradient of the energy: −dE = Q·dq for any small displacement. A
/// force pair with a wrong line of action or a wrong moment shows here. Joint springs are left out:
/// their coordinate is the joint's only while the joint is closed.
#[test]
fn invariant_elastic_forces_derive_from_the_energy() {
    let mut description = crooked();
    description.joint_forces.clear();
    description.groups.clear();
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let mut state = disturbed(&model, 0.02, &mut Noise(5));
    for body in &mut state.bodies {
        body.velocity = Vec3::zeros();
        body.angular_velocity = Vec3::zeros();
    }
    let zero = vec![0.0; 64];
    let loads = Loads { vertical: &zero, lateral: &zero };
    let (.., rhs) = model.dense_system(&state, &loads, &mut ws);
    let mut noise = Noise(6);
    for _ in 0..20 {
        let mut direction = state.clone();
        for body in &mut direction.bodies {
            body.velocity = noise.vector(1.0);
            body.angular_velocity = noise.vector(1.0);
        }
        let way = velocity(&direction);
        let power = rhs.rows(0, way.len()).dot(&way);
        let h = 1e-5;
        let mut energy = |t: f64| {
            let energy = model.energy(&moved(&direction, t), &mut ws);
            energy.gravitational + energy.elastic
        };
        let slope = (energy(h) - energy(-h)) / (2.0 * h);
        // energies of 1e6 J round to 1e-10 J, so slopes to 1e-5; h² times stiffnesses of 1e6 less
        assert!((power + slope).abs() < 1e-4 * power.abs().max(1.0), "{power} {slope}");
    }
}

/// Action equals reaction: without gravity, drive and magnets the elements neither push nor turn
/// the vehicle as a whole, moving or not. Leaving the moment of a bushing's force unbalanced shows.
#[test]
fn invariant_force_elements_create_no_momentum() {
    let mut description = crooked();
    description.gravity = [0.0; 3];
    description.drive = None;
    let model = VehicleModel::new(&description).unwrap();
    let mut ws = model.workspace();
    let state = disturbed(&model, 0.1, &mut Noise(9));
    let zero = vec![0.0; 64];
    // evaluates the forces on the way
    let _ = model.dense_system(&state, &Loads { vertical: &zero, lateral: &zero }, &mut ws);
    let (mut force, mut moment, mut size) = (Vec3::zeros(), Vec3::zeros(), 0.0_f64);
    for (Wrench { force: f, moment: m }, kin) in ws.wrenches.iter().zip(&ws.kin) {
        force += f;
        moment += m + kin.r.cross(f);
        size = size.max(f.amax());
    }
    assert!(size > 1e3, "nothing acts");
    // sums of 160 terms of up to 1e5 N with arms of 12 m round to some 1e-8
    assert!(force.amax() < 1e-12 * size * 160.0, "{force}");
    assert!(moment.amax() < 1e-12 * size * 12.0 * 160.0, "{moment}");
}

/// Damping never feeds energy: the power of all dampers is negative whatever moves.
#[test]
fn invariant_dampers_take_energy() {
    let model = VehicleModel::new(&crooked()).unwrap();
    let mut ws = model.workspace();
    let mut noise = Noise(21);
    let zero = vec![0.0; 64];
    let loads = Loads { vertical: &zero, lateral: &zero };
    for _ in 0..50 {
        let state = disturbed(&model, 0.05, &mut noise);
        let mut still = state.clone();
        for body in &mut still.bodies {
            body.velocity = Vec3::zeros();
            body.angular_velocity = Vec3::zeros();
        }
        let v = velocity(&state);
        let power = |s: &State, ws: &mut Workspace| {
            let (.., rhs) = model.dense_system(s, &loads, ws);
            // the gyroscopic moment does no work, so it may stay in
            rhs.rows(0, v.len()).dot(&v)
        };
        assert!(power(&state, &mut ws) < power(&still, &mut ws));
    }
}

/// A bushing-held body swings at its closed form's frequency: ω² = k/m − (c/2m)².
#[test]
fn analytic_bushing_held_body() {
    let mut d = train::one_magnet();
    d.gravity = [0.0; 3];
    d.joints.clear();
    let mut bushing = train::one_bogie().bushings[0].clone();
    (bushing.body_a, bushing.body_b) = ("ground".to_owned(), "mass".to_owned());
    (bushing.position, bushing.preload) = ([0.0; 3], [0.0; 3]);
    bushing.rotational_stiffness = [1e4; 3];
    bushing.translational_stiffness = [250.0 * 100.0; 3];
    bushing.translational_damping = [250.0 * 2.0; 3];
    d.bushings.push(bushing);
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    state.bodies[0].velocity = Vec3::new(0.1, -0.2, 0.3);
    let course = crate::LoadCourse { vertical: &[[0.0; 4]], lateral: &[[0.0; 4]] };
    model.step(&mut state, 2.0, 1e-3, &course, &mut ws).unwrap();
    let w = (100.0_f64 - 1.0).sqrt();
    let swing = (-2.0_f64).exp() * (w * 2.0).sin() / w;
    // RK4: (ω h)⁴/120·ω t = 1e-8/120·20 of 0.03 m
    let expected = Vec3::new(0.1, -0.2, 0.3) * swing;
    assert!((state.bodies[0].position - expected).amax() < 1e-10);
}

/// Multipliers are the joints' reactions: at rest the guide of a laterally pushed magnet carries
/// exactly that push, and the car of a standing bogie nothing vertical.
#[test]
fn analytic_multipliers_are_reactions() {
    let model = VehicleModel::new(&train::one_magnet()).unwrap();
    let mut ws = model.workspace();
    let state = model.initial_state();
    let loads = Loads { vertical: &[250.0 * 9.81], lateral: &[777.0] };
    model.accelerations(&state, &loads, &mut ws).unwrap();
    let (force, moment) = model.joints[0].reaction(&ws.kin, ws.multipliers());
    assert!((force - Vec3::new(0.0, -777.0, 0.0)).amax() < 1e-10, "{force}");
    assert!(moment.amax() < 1e-10, "{moment}");
    assert_eq!(model.joints[0].kind, JointKind::Translational);
}

/// A torsion spring in a hinge and a spring along a slide keep the energy of a swinging chain.
#[test]
fn invariant_joint_springs_keep_energy() {
    let mut d = train::one_bogie();
    // the carried mass with one table on a slide, and a flap hinged to that
    d.bodies.truncate(2);
    d.bodies.push(d.bodies[1].clone());
    d.bodies[2].name = "flap".to_owned();
    d.bodies[2].position[2] += 0.5;
    d.joints.truncate(2);
    let mut hinge = d.joints[1].clone();
    (hinge.name, hinge.kind) = ("hinge".to_owned(), JointKind::Revolute);
    (hinge.body_a, hinge.body_b) = (d.bodies[1].name.clone(), "flap".to_owned());
    hinge.axis = Some([1.0, 0.2, 0.3]);
    d.joints.push(hinge);
    d.bushings.clear();
    d.groups.clear();
    d.magnets.clear();
    d.observed.clear();
    d.joint_forces = d
        .joints
        .iter()
        .zip([1e5, 1e4, 1e3])
        .map(|(j, stiffness)| crate::JointForce {
            joint: j.name.clone(),
            stiffness,
            damping: 0.0,
            preload: 0.0,
        })
        .collect();
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    let flap = model.body_index("flap").unwrap();
    state.bodies[flap].angular_velocity = Vec3::new(3.0, 0.0, 0.0);
    model.close_joints(&mut state, &mut ws).unwrap();
    let start = model.energy(&state, &mut ws).total();
    let elastic = model.energy(&state, &mut ws).elastic;
    let course = crate::LoadCourse { vertical: &[], lateral: &[] };
    let mut largest = 0.0_f64;
    for _ in 0..2000 {
        model.step(&mut state, 1e-3, 1e-3, &course, &mut ws).unwrap();
        let energy = model.energy(&state, &mut ws);
        largest = largest.max(energy.elastic - elastic);
        // RK4 at ω h = 12e-3: (ω h)⁵/120 per step, 2000 steps: 4e-9 of some 100 J
        assert!((energy.total() - start).abs() < 1e-6, "{} {start}", energy.total());
    }
    assert!(largest > 1.0, "the springs were hardly used: {largest}");
}
