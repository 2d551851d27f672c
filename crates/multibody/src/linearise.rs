//! Small motions about a state: reduced mass, damping and stiffness, eigenvalues, mode shapes.
//!
//! A deviation of a body is the twist η = (s, θ) in its own axes: r = r₀ + A₀ s, p = p₀ ⊗ exp(θ).
//! Those that the joints allow are η = N y, with N an orthonormal basis of the null space of Φ_q at
//! the state and y the reduced coordinates. Velocities are the twists ξ = (Aᵀv, ω); those that the
//! joints allow deviate by N z. Linearised,
//!
//! ẏ = G y + z,  ż = ∂(Lα)/∂y · y + ∂(Lα)/∂z · z,  with L = (NᵀMN)⁻¹ NᵀM,
//!
//! where α = ξ̇ is the acceleration that eq. 9 gives, and G y = −L (ξ₀ × η), zero for a state at rest.
//! Eliminating z leaves M_r ÿ + C_r ẏ + K_r y = 0, M_r = NᵀMN.
//!
//! The derivatives are central differences of the whole nonlinear equation 9. Each displaced pose
//! has its joints closed again, so it satisfies the constraints to all orders, and so do the
//! directions of the reactions: the geometric stiffness of preloads, gravity and joint forces is in
//! K_r.
//!
//! On a line, twists are those relative to the travelling frame ([`crate::turning`]), which turns: steady
//! curving is rest.
//!
//! A state at rest is linearised exactly, and so is a steady motion whose twists ξ₀ are constant (a
//! spinning top). For any other motion the matrices are those of the instant.

use nalgebra::linalg::Schur;
use nalgebra::{Complex, DMatrix, DVector};

use crate::composite::mass_block;
use crate::contact::TrackContact;
use crate::error::Error;
use crate::index::{BodyIndex, ComponentIndex};
use crate::linearisation::{Linearisation, natural_frequency};
use crate::loads::{AppliedForces, Loads};
use crate::math::{Vec3, cross_matrix, from_rotation_vector, multiply, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::State;
use crate::turning::Turning;
use crate::workspace::Workspace;

/// Pivots of Φ_qᵀ below this fraction of the largest count as zero. Rows of Φ_q are of size one,
/// proper pivots of the train are above 1e-2, and rounding leaves 1e-14.
const RANK_THRESHOLD: f64 = 1e-9;
/// Displacements (m, rad) for differences. Truncation: (DISPLACED²/6) times a third derivative, 1e-10
/// of a stiffness whose force is curved within a metre or a radian. Rounding: accelerations are known
/// to 2e-11 m/s² (places of 10 m to 2e-15 m, 4e5 N/m on 50 kg), so K/M to 2e-6 1/s², 1e-10 of the
/// train's stiffest.
const DISPLACED: f64 = 1e-5;
/// Velocities (m/s, rad/s) for differences. The equations are quadratic in them, so only rounding
/// counts: 2e-11/1e-3.
const MOVED: f64 = 1e-3;
/// Sweeps of the QR iteration per eigenvalue before giving up.
const SWEEPS: usize = 100;
/// Springs and dampers at every magnet that replace the levitation, relative to the position and
/// motion of the state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MagnetSprings {
    /// Vertical, N/m.
    pub stiffness: f64,
    /// Vertical, N·s/m.
    pub damping: f64,
    /// Lateral, N/m.
    pub lateral_stiffness: f64,
    /// Lateral, N·s/m.
    pub lateral_damping: f64,
}

impl VehicleModel {
    /// Linearises about a state under held forces, with optional springs and dampers at the magnets.
    /// The state's joints must be closed ([`VehicleModel::close_joints`]).
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`], and [`Error::Eigenvalues`].
    pub fn linearise<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        springs: &MagnetSprings,
        ws: &mut Workspace,
    ) -> Result<Linearisation, Error> {
        self.linearise_in_contact(state, forces, springs, None, ws)
    }

    /// Like [`VehicleModel::linearise`], with the contacts of the magnets with the rail. No magnet may
    /// be about to touch it or to leave it ([`VehicleModel::near_touch`]).
    ///
    /// # Errors
    /// As [`VehicleModel::linearise`].
    pub fn linearise_in_contact<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        springs: &MagnetSprings,
        track: Option<&TrackContact>,
        ws: &mut Workspace,
    ) -> Result<Linearisation, Error> {
        // checks the lengths and that the state can be evaluated
        let forces = forces.into();
        self.accelerations_in_contact(state, forces, track, ws)?;
        let (free, rank) = self.free_motions(state, ws);
        let dof = free.ncols();
        let mut weighted = free.clone();
        for (k, composite) in self.composites.iter().enumerate() {
            let rows = mass_block(composite) * free.rows(6 * k, 6);
            weighted.rows_mut(6 * k, 6).copy_from(&rows);
        }
        let mass = free.tr_mul(&weighted);
        let mass = (&mass + mass.transpose()) * 0.5;
        let factors = mass.clone().cholesky().ok_or(Error::Eigenvalues { eigenvalue: None })?;
        // L
        let reduce = |motion: &DVector<f64>| factors.solve(&weighted.tr_mul(motion));

        let turning = self.turning(state, forces.acceleration);
        let seen = turning.map_or(0, |_| self.magnets.len());
        let (bodies, mut seen_by_place) = (free.nrows(), DMatrix::zeros(seen, dof));
        let mut seen_by_motion = seen_by_place.clone();
        let mut probe =
            LinearisationProbe { model: self, state, forces, springs, track, turning, ws };
        let mut by_place = DMatrix::zeros(dof, dof);
        let mut by_motion = DMatrix::zeros(dof, dof);
        let mut transport = DMatrix::zeros(dof, dof);
        for j in 0..dof {
            let direction = free.column(j).into_owned();
            let slope = probe.difference(&direction, DISPLACED, true)?;
            by_place.set_column(j, &reduce(&slope.rows(0, bodies).into_owned()));
            seen_by_place.set_column(j, &slope.rows(bodies, seen));
            let slope = probe.difference(&direction, MOVED, false)?;
            by_motion.set_column(j, &reduce(&slope.rows(0, bodies).into_owned()));
            seen_by_motion.set_column(j, &slope.rows(bodies, seen));
            transport.set_column(j, &-reduce(&carried(state, turning.as_ref(), &direction)));
        }
        let eigenvalues = eigenvalues(first_order(&transport, &by_place, &by_motion))?;
        // z = ẏ − G y, so ÿ = (G + ∂z) ẏ + (∂y − ∂z G) y
        let damping = &mass * -(&transport + &by_motion);
        let stiffness = &mass * (&by_motion * &transport - &by_place);
        Ok(Linearisation {
            rank,
            basis: in_world(state, free),
            mass,
            damping,
            stiffness,
            eigenvalues,
            magnet_accelerations: turning
                .map(|_| [seen_by_place - &seen_by_motion * &transport, seen_by_motion]),
            body_masses: self.composites.iter().map(mass_block).collect(),
        })
    }

    /// N in body axes, and the rank of Φ_q. Group by group of jointed bodies: the last columns of Q in
    /// the pivoted factorisation Φ_qᵀ P = Q R.
    fn free_motions(&self, state: &State, ws: &mut Workspace) -> (DMatrix<f64>, usize) {
        ws.forget();
        self.set_pose(&state.bodies, ws);
        self.jacobians(ws);
        let bodies = self.composites.len();
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut rank = 0;
        for group in 0..self.counts.components {
            let members: Vec<usize> =
                (0..bodies).filter(|&k| self.components[k] == ComponentIndex(group)).collect();
            let place = |body: BodyIndex| members.iter().position(|&k| k == body.0);
            let size = 6 * members.len();
            let mut rows: Vec<DVector<f64>> = Vec::new();
            for joint in &self.joints {
                let places = [place(joint.a), place(joint.b)];
                if places == [None, None] {
                    continue;
                }
                for r in joint.row..joint.row + joint.equations() {
                    let mut row = DVector::zeros(size);
                    for (place, part) in places.iter().zip([&ws.rows_a[r], &ws.rows_b[r]]) {
                        let Some(place) = *place else { continue };
                        let linear = Vec3::new(part[0], part[1], part[2]);
                        let linear = ws.kin[members[place]].a.tr_mul(&linear);
                        let angular = Vec3::new(part[3], part[4], part[5]);
                        row.rows_mut(6 * place, 3).copy_from(&linear);
                        row.rows_mut(6 * place + 3, 3).copy_from(&angular);
                    }
                    rows.push(row);
                }
            }
            // padded with zeros to a square matrix, so that Q is complete
            let mut transposed = DMatrix::zeros(size, size.max(rows.len()));
            for (column, row) in rows.iter().enumerate() {
                transposed.set_column(column, row);
            }
            let factors = transposed.col_piv_qr();
            let diagonal = factors.r().diagonal().abs();
            let found = diagonal.iter().filter(|d| **d > RANK_THRESHOLD * diagonal.max()).count();
            let q = factors.q();
            for k in found..size {
                let mut column = DVector::zeros(6 * bodies);
                for (place, member) in members.iter().enumerate() {
                    column.rows_mut(6 * member, 6).copy_from(&q.view((6 * place, k), (6, 1)));
                }
                columns.push(column);
            }
            rank += found;
        }
        let mut free = DMatrix::zeros(6 * bodies, columns.len());
        for (k, column) in columns.iter().enumerate() {
            free.set_column(k, column);
        }
        (free, rank)
    }
}

/// Evaluates eq. 9 near a state.
struct LinearisationProbe<'a> {
    model: &'a VehicleModel,
    state: &'a State,
    forces: AppliedForces<'a>,
    springs: &'a MagnetSprings,
    track: Option<&'a TrackContact<'a>>,
    turning: Option<Turning>,
    ws: &'a mut Workspace,
}

impl LinearisationProbe<'_> {
    /// Slope of α in the direction of a twist of places or of velocities.
    fn difference(
        &mut self,
        direction: &DVector<f64>,
        size: f64,
        place: bool,
    ) -> Result<DVector<f64>, Error> {
        let ahead = self.accelerations(direction, size, place)?;
        let behind = self.accelerations(direction, -size, place)?;
        Ok((ahead - behind) / (2.0 * size))
    }

    /// α = ξ̇ = (Aᵀ v̇ − ω × Aᵀ v, ω̇) of all bodies, displaced from the state by `size` times the
    /// direction; on a line followed by the magnets' inertial accelerations along its up axis.
    fn accelerations(
        &mut self,
        direction: &DVector<f64>,
        size: f64,
        place: bool,
    ) -> Result<DVector<f64>, Error> {
        let mut beside = self.state.clone();
        for (body, twist) in beside.bodies.iter_mut().zip(direction.as_slice().chunks_exact(6)) {
            let way = Vec3::new(twist[0], twist[1], twist[2]) * size;
            let turn = Vec3::new(twist[3], twist[4], twist[5]) * size;
            let axes = rotation_matrix(body.attitude);
            if place {
                let moving = self.turning.map(|it| (it, it.relative(body)));
                body.position += axes * way;
                body.attitude = multiply(body.attitude, from_rotation_vector(&turn));
                // the same velocity in the axes of the turned body
                let turned = rotation_matrix(body.attitude);
                match moving {
                    None => body.velocity = turned * axes.tr_mul(&body.velocity),
                    Some((turning, (u, spin))) => {
                        turning.set(body, &(turned * axes.tr_mul(&u)), &spin);
                    }
                }
            } else {
                body.velocity += axes * way;
                body.angular_velocity += turn;
            }
        }
        if place {
            self.model.close_joints(&mut beside, self.ws)?;
        }
        let [vertical, lateral] = self.held(&beside);
        let magnets = Loads { vertical: &vertical, lateral: &lateral };
        let forces = AppliedForces { magnets, ..self.forces };
        self.model.accelerations_in_contact(&beside, forces, self.track, self.ws)?;
        let seen = self.turning.map_or(0, |_| self.model.magnets.len());
        let mut result = DVector::zeros(direction.len() + seen);
        for k in self.model.magnets().take(seen) {
            result[direction.len() + k.0] = self.model.magnet_acceleration(self.ws, k).z;
        }
        for (k, body) in beside.bodies.iter().enumerate() {
            let (mut v, mut w) = self.ws.acceleration(BodyIndex(k));
            let (mut velocity, mut spin) = (body.velocity, body.angular_velocity);
            if let Some(turning) = &self.turning {
                (v, w) = turning.rates(body, (v, w));
                (velocity, spin) = turning.relative(body);
            }
            let axes = rotation_matrix(body.attitude);
            let linear = axes.tr_mul(&v) - spin.cross(&axes.tr_mul(&velocity));
            result.rows_mut(6 * k, 3).copy_from(&linear);
            result.rows_mut(6 * k + 3, 3).copy_from(&w);
        }
        Ok(result)
    }

    /// Loads plus the forces of the springs and dampers at the magnets for the displaced state.
    fn held(&self, beside: &State) -> [Vec<f64>; 2] {
        let mut vertical = self.forces.magnets.vertical.to_vec();
        let mut lateral = self.forces.magnets.lateral.to_vec();
        let springs = self.springs;
        for (k, (up, left)) in self.model.magnets().zip(vertical.iter_mut().zip(&mut lateral)) {
            let (here, there) = (self.model.magnet(self.state, k), self.model.magnet(beside, k));
            let way = there.displacement - here.displacement;
            let rate = there.velocity - here.velocity;
            *up -= springs.stiffness * way.z + springs.damping * rate.z;
            *left -= springs.lateral_stiffness * way.y + springs.lateral_damping * rate.y;
        }
        [vertical, lateral]
    }
}

/// ξ₀ × η of every body: (ω × s + Aᵀv × θ, ω × θ).
fn carried(state: &State, turning: Option<&Turning>, direction: &DVector<f64>) -> DVector<f64> {
    let mut result = DVector::zeros(direction.len());
    for (k, body) in state.bodies.iter().enumerate() {
        let way: Vec3 = direction.fixed_rows::<3>(6 * k).into_owned();
        let turn: Vec3 = direction.fixed_rows::<3>(6 * k + 3).into_owned();
        let (velocity, spin) = turning
            .map_or((body.velocity, body.angular_velocity), |turning| turning.relative(body));
        let spin = cross_matrix(&spin);
        let speed = rotation_matrix(body.attitude).tr_mul(&velocity);
        result.rows_mut(6 * k, 3).copy_from(&(spin * way + speed.cross(&turn)));
        result.rows_mut(6 * k + 3, 3).copy_from(&(spin * turn));
    }
    result
}

/// The basis with displacements in world axes.
fn in_world(state: &State, mut free: DMatrix<f64>) -> DMatrix<f64> {
    for (k, body) in state.bodies.iter().enumerate() {
        let turned = rotation_matrix(body.attitude) * free.rows(6 * k, 3);
        free.rows_mut(6 * k, 3).copy_from(&turned);
    }
    free
}

/// d/dt (ω y, z), with one frequency ω that brings places to the size of velocities.
fn first_order(
    transport: &DMatrix<f64>,
    by_place: &DMatrix<f64>,
    by_motion: &DMatrix<f64>,
) -> DMatrix<f64> {
    let dof = transport.nrows();
    let omega = by_place.iter().fold(1.0_f64, |m, x| m.max(x.abs())).sqrt();
    let mut matrix = DMatrix::zeros(2 * dof, 2 * dof);
    matrix.view_mut((0, 0), (dof, dof)).copy_from(transport);
    matrix.view_mut((0, dof), (dof, dof)).fill_diagonal(omega);
    matrix.view_mut((dof, 0), (dof, dof)).copy_from(&(by_place / omega));
    matrix.view_mut((dof, dof), (dof, dof)).copy_from(by_motion);
    matrix
}

/// Slowest first; of a conjugate pair the one with positive imaginary part.
fn eigenvalues(matrix: DMatrix<f64>) -> Result<Vec<Complex<f64>>, Error> {
    if matrix.is_empty() {
        return Ok(Vec::new());
    }
    // nothing to iterate on otherwise; the sum is finite unless a component or their sum is not
    if !matrix.iter().map(|x| x * x).sum::<f64>().is_finite() {
        return Err(Error::Eigenvalues { eigenvalue: None });
    }
    let sweeps = SWEEPS * matrix.nrows();
    let schur = Schur::try_new(matrix, f64::EPSILON, sweeps)
        .ok_or(Error::Eigenvalues { eigenvalue: None })?;
    let mut all: Vec<_> =
        schur.complex_eigenvalues().iter().copied().filter(|value| value.im >= 0.0).collect();
    all.sort_by(|a, b| {
        natural_frequency(*a).total_cmp(&natural_frequency(*b)).then(a.re.total_cmp(&b.re))
    });
    Ok(all)
}
