//! Random mechanisms and damaged files.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{body, empty, joint};
use multibody::math::{
    Vec3, conjugate, from_rotation_vector, multiply, normalised, rotation_matrix, rotation_vector,
};
use multibody::{
    BodyIndex, Holding, Inertia, Joint, JointKind, Loads, State, VehicleDescription, VehicleModel,
    train,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const KINDS: [JointKind; 4] =
    [JointKind::Bracket, JointKind::Translational, JointKind::Spherical, JointKind::Revolute];

/// One link of a tree: parent (0 is the ground), kind of joint, mass, and numbers in (−1, 1).
type Link = (usize, usize, f64, [f64; 14]);

fn links() -> impl Strategy<Value = Vec<Link>> {
    let link = (0..9usize, 0..4usize, 0.1..1e3, prop::array::uniform14(-1.0..1.0f64));
    prop::collection::vec(link, 1..9)
}

fn triple(numbers: &[f64], size: f64) -> [f64; 3] {
    [numbers[0] * size, numbers[1] * size, numbers[2] * size]
}

/// A tree of bodies hung from the ground, with a bushing on every link.
fn tree(links: &[Link]) -> VehicleDescription {
    let mut d = empty("tree");
    let mut bushing = train::one_bogie().bushings[0].clone();
    for (k, (parent, kind, mass, x)) in links.iter().enumerate() {
        let name = format!("body_{k}");
        let parent = match parent % (k + 1) {
            0 => "ground".to_owned(),
            p => format!("body_{}", p - 1),
        };
        // moments of three pairs of point masses: always those of a possible body
        let [a, b, c] = triple(&x[0..3], 1.0).map(|v| mass * (0.01 + v * v));
        let mut new = body(&name, *mass, [b + c, a + c, a + b], triple(&x[3..6], 5.0));
        assert!(matches!(new.inertia, Inertia::Principal(_)));
        new.orientation = Some(from_rotation_vector(&Vec3::from(triple(&x[6..9], 2.0))));
        d.bodies.push(new);
        let kind = KINDS[*kind];
        let axis = kind.has_axis().then(|| [x[9], x[10], x[11].abs() + 0.1]);
        let at = triple(&x[11..14], 5.0);
        d.joints.push(joint(&format!("joint_{k}"), kind, [&parent, &name], at, axis));
        (bushing.name, bushing.position) = (format!("bushing_{k}"), at);
        (bushing.body_a, bushing.body_b) = (parent, name);
        d.bushings.push(bushing.clone());
    }
    d
}

/// How far the two sides of a joint stand apart, from its place and axis in the file and the way
/// that bodies have moved: nothing of the equations is used. Zero for a closed joint.
fn gap(model: &VehicleModel, start: &State, state: &State, joint: &Joint) -> Vec<f64> {
    let place = Vec3::from(joint.position.unwrap());
    let side = |name: &str| {
        model.body_index(name).map_or((place, multibody::math::IDENTITY), |k| {
            let (now, then) = (&state.bodies[k], &start.bodies[k]);
            let turn = normalised(multiply(now.attitude, conjugate(then.attitude)));
            (now.position + rotation_matrix(turn) * (place - then.position), turn)
        })
    };
    let ((pa, qa), (pb, qb)) = (side(&joint.body_a), side(&joint.body_b));
    let axis = joint.axis.map_or(Vec3::zeros(), |n| Vec3::from(n).normalize());
    let (na, nb) = (rotation_matrix(qa) * axis, rotation_matrix(qb) * axis);
    let apart = pb - pa;
    let pair = match joint.kind {
        JointKind::Bracket => [Vec3::zeros(); 2],
        JointKind::Spherical => [apart, Vec3::zeros()],
        JointKind::Revolute => [apart, na.cross(&nb)],
        JointKind::Translational => {
            [apart - na * na.dot(&apart), rotation_vector(multiply(conjugate(qa), qb))]
        }
    };
    pair.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

fn gaps(
    model: &VehicleModel,
    start: &State,
    state: &State,
    description: &VehicleDescription,
) -> DVector<f64> {
    let all = description.joints.iter().flat_map(|j| gap(model, start, state, j));
    DVector::from_vec(all.collect())
}

/// The state moved by h along velocities.
fn along(state: &State, velocities: &DVector<f64>, h: f64) -> State {
    let mut state = state.clone();
    for (body, v) in state.bodies.iter_mut().zip(velocities.as_slice().chunks(6)) {
        body.position += Vec3::new(v[0], v[1], v[2]) * h;
        let turn = from_rotation_vector(&(Vec3::new(v[3], v[4], v[5]) * h));
        body.attitude = multiply(body.attitude, turn);
    }
    state
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Φ_q and γ of any tree somewhere on its way: motions that Φ_q allows leave the joints closed,
    /// their number is that of the degrees of freedom, γ is minus the change of Φ_q along the motion
    /// times the velocity, and Φ_q M⁻¹ Φ_qᵀ is positive definite.
    #[test]
    fn invariant_jacobian_of_any_tree_spans_what_its_joints_forbid(
        links in links(), seed in any::<u64>()
    ) {
        let mut description = tree(&links);
        // their stiffness would ask for small steps
        description.bushings.clear();
        let model = VehicleModel::new(&description).unwrap();
        let mut ws = model.workspace();
        let start = model.initial_state();
        let mut state = start.clone();
        let mut noise = common::Noise(seed);
        let mut vector = |size: f64| Vec3::new(noise.next(), noise.next(), noise.next()) * size;
        for body in &mut state.bodies {
            (body.velocity, body.angular_velocity) = (vector(1.0), vector(1.0));
        }
        model.close_joints(&mut state, &mut ws).unwrap();
        common::run_free(&model, &mut state, 1e-3, 100);
        let closed = gaps(&model, &start, &state, &description).amax();
        // closed to 1e-11 m over arms of 10 m and turned axes, as the test sees it
        prop_assert!(closed < 1e-9, "{closed:e}");
        let loads = Loads { vertical: &[], lateral: &[] };
        let (mass, jacobian, rhs) = model.dense_system(&state, &loads, &mut ws);
        let (n, m) = (mass.nrows(), jacobian.nrows());
        if m == 0 {
            return Ok(());
        }
        let schur = &jacobian * mass.try_inverse().unwrap() * jacobian.transpose();
        prop_assert!(schur.cholesky().is_some());
        let h = 1e-5;
        // what no row forbids: eigenvectors of Φ_qᵀ Φ_q with eigenvalue zero
        let normal = nalgebra::SymmetricEigen::new(jacobian.tr_mul(&jacobian));
        let largest = normal.eigenvalues.amax();
        let free: Vec<usize> =
            (0..n).filter(|&k| normal.eigenvalues[k] < 1e-11 * largest).collect();
        prop_assert_eq!(free.len(), n - m);
        prop_assert_eq!(free.len(), model.counts().degrees_of_freedom);
        for k in free {
            let way = normal.eigenvectors.column(k).into_owned();
            let ahead = gaps(&model, &start, &along(&state, &way, h), &description);
            let behind = gaps(&model, &start, &along(&state, &way, -h), &description);
            // rounding of 1e-14 m over h, h² times arms of 10 m, and the eigenvector's own digits
            let rate = (ahead - behind).amax() / (2.0 * h);
            prop_assert!(rate < 1e-5, "{rate:e}");
        }
        let v = DVector::from_iterator(n, state.bodies.iter().flat_map(|b| {
            let (v, w) = (b.velocity, b.angular_velocity);
            [v.x, v.y, v.z, w.x, w.y, w.z]
        }));
        let (_, ahead, _) = model.dense_system(&along(&state, &v, h), &loads, &mut ws);
        let (_, behind, _) = model.dense_system(&along(&state, &v, -h), &loads, &mut ws);
        let bend = (ahead - behind) * &v / (2.0 * h);
        let gamma = rhs.rows(n, m);
        let off = (gamma + &bend).amax();
        // h² of third derivatives ω³ times arms of 10 m, and 1e-15·10/h times v
        let size = 1.0 + v.amax().powi(3);
        prop_assert!(off < 1e-7 * size, "{off:e} of {:e}", gamma.amax());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    /// Accelerations and multipliers of any tree, moving, solve the whole dense system of eq. 9;
    /// the mass matrix is symmetric and positive definite; degrees of freedom count up.
    #[test]
    fn invariant_any_tree_solves_the_dense_system(links in links(), seed in any::<u64>()) {
        let description = tree(&links);
        let model = VehicleModel::new(&description).unwrap();
        let counts = model.counts();
        let equations: usize = description.joints.iter().map(|j| j.kind.equations()).sum();
        prop_assert_eq!(counts.degrees_of_freedom, 6 * links.len() - equations);
        let mut ws = model.workspace();
        let mut state = model.initial_state();
        let mut noise = common::Noise(seed);
        let mut vector = |size: f64| Vec3::new(noise.next(), noise.next(), noise.next()) * size;
        for body in &mut state.bodies {
            body.position += vector(0.01);
            body.attitude = multiply(body.attitude, from_rotation_vector(&vector(0.01)));
            body.velocity = vector(2.0);
            body.angular_velocity = vector(2.0);
        }
        let loads = Loads { vertical: &[], lateral: &[] };
        let (mass, jacobian, rhs) = model.dense_system(&state, &loads, &mut ws);
        prop_assert_eq!(&mass, &mass.transpose());
        if mass.nrows() > 0 {
            prop_assert!(mass.clone().cholesky().is_some());
        }
        model.accelerations(&state, &loads, &mut ws).unwrap();
        let n = mass.nrows();
        let accelerations = DVector::from_iterator(n, (0..n / 6).flat_map(|k| {
            let (v, w) = ws.acceleration(BodyIndex(k));
            [v.x, v.y, v.z, w.x, w.y, w.z]
        }));
        let multipliers = DVector::from_column_slice(ws.multipliers());
        let balance = &mass * &accelerations + jacobian.tr_mul(&multipliers) - rhs.rows(0, n);
        let closing = &jacobian * &accelerations - rhs.rows(n, jacobian.nrows());
        // bodies of 0.1 to 1000 kg with arms of 10 m: six or seven digits may go of sixteen
        let forces = mass.amax() * accelerations.amax() + multipliers.amax() + rhs.amax();
        prop_assert!(balance.amax() <= 1e-9 * forces, "{:e} of {:e}", balance.amax(), forces);
        let motion = DMatrix::amax(&jacobian) * accelerations.amax() + rhs.amax();
        prop_assert!(closing.amax() <= 1e-8 * motion, "{:e} of {:e}", closing.amax(), motion);
    }

    /// Whatever bytes change in a file, reading ends with a model or an error, never otherwise.
    #[test]
    fn invariant_damaged_files_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = train::one_bogie().to_json().unwrap().into_bytes();
        for (index, byte) in changes {
            let k = index.index(bytes.len());
            bytes[k] = byte;
        }
        if let Ok(text) = String::from_utf8(bytes)
            && let Err(error) = VehicleModel::from_json(&text)
        {
            prop_assert!(!error.to_string().is_empty());
        }
    }

    /// Whatever numbers stand in a file, it is refused or its equilibrium is found or refused.
    #[test]
    fn invariant_strange_numbers_never_panic(
        which in any::<prop::sample::Index>(),
        number in prop_oneof![Just(0.0), Just(-1.0), Just(1e300), Just(1e-300), any::<f64>()],
    ) {
        let mut description = train::one_bogie();
        let bodies = description.bodies.len();
        let k = which.index(4 * bodies);
        let body = &mut description.bodies[k % bodies];
        match k / bodies {
            0 => body.mass = number,
            1 => body.inertia = Inertia::Principal([number, number, number]),
            2 => body.position[k % 3] = number,
            _ => description.bushings[k % 16].translational_stiffness[k % 3] = number,
        }
        if let Ok(model) = VehicleModel::new(&description) {
            let mut ws = model.workspace();
            let few = Holding { iterations: 30, ..Holding::default() };
            let _ = model.equilibrium(&[0.0; 8], &few, &mut ws);
        }
    }
}
