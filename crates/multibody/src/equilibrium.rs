//! Static equilibrium with the magnets at the nominal gap below the track.
//!
//! A vehicle that hangs on given forces has no equilibrium of its own. So each magnet-carrying body
//! is held by equal stiff springs K at its magnets, acting on the rigid-body fit of the magnets'
//! deviations from their places below the track, d = P (z_target − z) with P the orthogonal
//! projection on motions of a rigid body (heave, pitch, roll, as far as the magnets can tell them
//! apart). The magnets' loads follow by L ← L + K d (augmented Lagrangian) until d vanishes: what is
//! left are the loads alone, linear along each rigid body, hence of least norm where the body is
//! statically indeterminate. On a curved track the body sits at the least-squares fit.
//!
//! Each iteration is one Newton step in poses and multipliers, H δ + Φ_qᵀ λ = Q, Φ_q δ = −Φ, where H
//! holds the elastic stiffness of all elements, K, and σ M. H leaves out the geometric stiffness of
//! the loads, which is smaller than the elastic one wherever the vehicle is stable at all, and
//! so stays positive definite; σ M (pseudo-transient) holds what nothing holds, such as the lateral
//! place of the train, without changing where the iteration ends, since it acts on δ only.

use nalgebra::{DMatrix, DVector, Vector6};

use crate::assembly::{add_jacobians, explain, mass_block, sizes};
use crate::dynamics::{Loads, Workspace};
use crate::elements::ElasticRow;
use crate::error::Error;
use crate::joint::Row;
use crate::math::Vec3;
use crate::model::{Model, Places};
use crate::ordering::{Ordering, SAFE_AT_REST, Sample, analyse};
use crate::state::{Kinematics, State};

/// How the magnets are held while the equilibrium is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holding {
    /// K: stiffness at each magnet, N/m. Speeds the search, does not change the result.
    pub stiffness: f64,
    /// σ: inertial regularisation, 1/s².
    pub inertia: f64,
    /// Iterations before giving up.
    pub iterations: usize,
}

impl Default for Holding {
    fn default() -> Self {
        Self { stiffness: 1e7, inertia: 1.0, iterations: 300 }
    }
}

/// A vehicle at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Pose, with zero velocities, at time zero.
    pub state: State,
    /// Upward force of each magnet, N.
    pub loads: Vec<f64>,
    /// Iterations done.
    pub iterations: usize,
    /// Largest acceleration component left, m/s² or rad/s².
    pub acceleration: f64,
}

/// Below these the search ends at once.
const GOAL_ACCELERATION: f64 = 1e-10;
const GOAL_DEVIATION: f64 = 1e-13;
/// Where rounding stops progress, this is still accepted.
const ACCEPTED_ACCELERATION: f64 = 1e-8;
const ACCEPTED_DEVIATION: f64 = 1e-10;
/// Iterations without progress that count as the end of progress.
const PATIENCE: usize = 8;

/// Magnets of one body with the motions that they can tell apart.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub body: usize,
    pub magnets: Vec<usize>,
    /// Orthonormal columns, one row per magnet.
    pub basis: DMatrix<f64>,
}

/// Prepared for the static problem.
#[derive(Debug, Clone)]
pub(crate) struct Statics {
    pub ordering: Ordering,
    pub places: Places,
    pub fits: Vec<Fit>,
}

impl Model {
    /// The rigid-body fits of all magnet-carrying bodies.
    pub(crate) fn fits(&self) -> Vec<Fit> {
        let mut fits = Vec::new();
        for body in 0..self.composites.len() {
            let magnets: Vec<usize> =
                (0..self.magnets.len()).filter(|&k| self.magnets[k].body == body).collect();
            if magnets.is_empty() {
                continue;
            }
            let start = |c: usize| {
                DVector::from_iterator(
                    magnets.len(),
                    magnets.iter().map(|&k| self.magnets[k].start[c]),
                )
            };
            let ones = DVector::from_element(magnets.len(), 1.0);
            let mut columns: Vec<DVector<f64>> = Vec::new();
            for mut candidate in [ones, start(0), start(1)] {
                let size = candidate.norm();
                for column in &columns {
                    candidate -= column * column.dot(&candidate);
                }
                // magnets in one line or at one point tell no more
                if candidate.norm() > 1e-9 * size {
                    columns.push(candidate.normalize());
                }
            }
            fits.push(Fit { body, magnets, basis: DMatrix::from_columns(&columns) });
        }
        fits
    }

    fn static_problem(&self, holding: &Holding) -> Result<Statics, Error> {
        let bodies = self.composites.len();
        let fits = self.fits();
        let mut kin = vec![Kinematics::at_rest(); bodies + 1];
        for (kin, composite) in kin.iter_mut().zip(&self.composites) {
            kin.set_pose(&composite.start);
        }
        let mut sample = Sample::new(sizes(bodies, &self.joints), bodies);
        self.stiffness(&kin, &fits, holding, &mut |i, j, block| {
            let block = DMatrix::from_column_slice(6, 6, block.as_slice());
            if i == j {
                sample.diagonal[i] += block;
            } else {
                sample.couple(i, j, &block);
            }
        });
        add_jacobians(&mut sample, &self.joints, &kin);
        // stiffness takes the place of mass, and changes with the pose
        let ordering = analyse(sample, SAFE_AT_REST, false)
            .map_err(|failure| explain(&failure, &self.composites, &self.joints, &kin))?;
        let places = crate::assembly::places(&ordering, bodies, &self.joints);
        Ok(Statics { ordering, places, fits })
    }

    /// The blocks of H, each pair of bodies once.
    fn stiffness(
        &self,
        kin: &[Kinematics],
        fits: &[Fit],
        holding: &Holding,
        add: &mut impl FnMut(usize, usize, nalgebra::Matrix6<f64>),
    ) {
        let bodies = self.composites.len();
        for (k, composite) in self.composites.iter().enumerate() {
            add(k, k, mass_block(composite) * holding.inertia);
        }
        let mut sink = |e: ElasticRow| {
            let (a, b) = (Vector6::from(e.row_a), Vector6::from(e.row_b));
            if e.a < bodies {
                add(e.a, e.a, a * a.transpose() * e.stiffness);
            }
            if e.b < bodies {
                add(e.b, e.b, b * b.transpose() * e.stiffness);
            }
            if e.a < bodies && e.b < bodies && e.a != e.b {
                add(e.a, e.b, a * b.transpose() * e.stiffness);
            }
        };
        self.elastic_rows(kin, &mut sink);
        for fit in fits {
            for column in fit.basis.column_iter() {
                let mut gradient = Vector6::zeros();
                for (weight, &k) in column.iter().zip(&fit.magnets) {
                    let arm = kin[fit.body].turn(&self.magnets[k].local);
                    let moment = kin[fit.body].a.tr_mul(&arm.cross(&Vec3::z()));
                    gradient += Vector6::new(0.0, 0.0, 1.0, moment.x, moment.y, moment.z) * *weight;
                }
                add(fit.body, fit.body, gradient * gradient.transpose() * holding.stiffness);
            }
        }
    }

    fn elastic_rows(&self, kin: &[Kinematics], sink: &mut impl FnMut(ElasticRow)) {
        for bushing in &self.bushings {
            bushing.elastic_rows(kin, sink);
        }
        for spring in &self.springs {
            spring.elastic_rows(kin, sink);
        }
        for force in &self.joint_forces {
            force.elastic_rows(&self.joints, kin, sink);
        }
        let Some(drive) = &self.drive else { return };
        let ground = self.composites.len();
        for anchor in &drive.anchors {
            let body = &kin[anchor.body];
            let m = body.a.tr_mul(&body.turn(&anchor.local).cross(&Vec3::x()));
            sink(ElasticRow {
                a: ground,
                b: anchor.body,
                row_a: Row::default(),
                row_b: [1.0, 0.0, 0.0, m.x, m.y, m.z],
                stiffness: drive.stiffness,
            });
        }
    }

    /// Finds the static equilibrium with the magnets at the nominal gap below a track whose surface
    /// stands at the heights `track` (m, one per magnet, up positive).
    ///
    /// # Errors
    /// [`Error::Equilibrium`] where nothing holds the vehicle, [`Error::Argument`] for a wrong
    /// length, [`Error::Singular`].
    pub fn equilibrium(
        &self,
        track: &[f64],
        holding: &Holding,
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        let mut state = self.initial_state();
        self.check_lengths(&state, track.len(), track.len())?;
        if let Some(k) = track.iter().position(|z| !z.is_finite()) {
            let what = format!("the track's height at magnet {}", k + 1);
            return Err(Error::NotFinite { what, time: 0.0 });
        }
        let statics = self.static_problem(holding)?;
        let mut search = Search {
            model: self,
            holding,
            track,
            loads: vec![0.0; track.len()],
            forces: vec![0.0; track.len()],
            factors: vec![0.0; statics.ordering.factorisation.storage],
            statics: &statics,
        };
        search.run(&mut state, ws)
    }
}

struct Search<'a> {
    model: &'a Model,
    holding: &'a Holding,
    track: &'a [f64],
    statics: &'a Statics,
    /// L.
    loads: Vec<f64>,
    /// L + K d.
    forces: Vec<f64>,
    factors: Vec<f64>,
}

impl Search<'_> {
    fn run(&mut self, state: &mut State, ws: &mut Workspace) -> Result<Equilibrium, Error> {
        let mut best = (f64::INFINITY, f64::INFINITY);
        let mut stalled = 0;
        for iteration in 1..=self.holding.iterations {
            let move_size = self.newton(state, ws)?;
            let deviation = self.hold(state);
            self.loads.copy_from_slice(&self.forces);
            // far from the goal the check is not worth its price
            if move_size > 1e-8 {
                continue;
            }
            let acceleration = self.acceleration(state, ws)?;
            let done = acceleration <= GOAL_ACCELERATION && deviation <= GOAL_DEVIATION;
            let better = acceleration < 0.5 * best.0 || deviation < 0.5 * best.1;
            stalled = if better { 0 } else { stalled + 1 };
            best = (acceleration.min(best.0), deviation.min(best.1));
            let accepted = acceleration <= ACCEPTED_ACCELERATION && deviation <= ACCEPTED_DEVIATION;
            if done || (accepted && stalled >= PATIENCE) {
                return Ok(Equilibrium {
                    state: state.clone(),
                    loads: self.loads.clone(),
                    iterations: iteration,
                    acceleration,
                });
            }
        }
        let acceleration = self.acceleration(state, ws)?;
        Err(Error::Equilibrium {
            iterations: self.holding.iterations,
            acceleration,
            deviation: self.hold(state),
        })
    }

    /// Sets the forces to L + K d; returns the largest component of d.
    fn hold(&mut self, state: &State) -> f64 {
        let mut largest = 0.0_f64;
        self.forces.copy_from_slice(&self.loads);
        for fit in &self.statics.fits {
            let deviation = DVector::from_iterator(
                fit.magnets.len(),
                fit.magnets
                    .iter()
                    .map(|&k| self.track[k] - self.model.magnet(state, k).displacement.z),
            );
            let fitted = &fit.basis * (fit.basis.tr_mul(&deviation));
            largest = largest.max(fitted.amax());
            for (value, &k) in fitted.iter().zip(&fit.magnets) {
                self.forces[k] += self.holding.stiffness * value;
            }
        }
        largest
    }

    /// One Newton step; returns its largest component.
    fn newton(&mut self, state: &mut State, ws: &mut Workspace) -> Result<f64, Error> {
        self.hold(state);
        let model = self.model;
        ws.forget();
        ws.vertical.copy_from_slice(&self.forces);
        ws.lateral.fill(0.0);
        model.set_kinematics(&state.bodies, ws);
        model.apply_forces(ws);
        model.residuals(ws);
        self.assemble(ws);
        let solver = &self.statics.ordering.factorisation;
        solver.factor(&mut self.factors).map_err(|vanished| model.singular(vanished, 0.0))?;
        let bodies = model.composites.len();
        for k in 0..bodies {
            let moment = ws.kin[k].a.tr_mul(&ws.wrenches[k].moment);
            ws.solution[6 * k..6 * k + 3].copy_from_slice(ws.wrenches[k].force.as_slice());
            ws.solution[6 * k + 3..6 * k + 6].copy_from_slice(moment.as_slice());
        }
        for (target, value) in ws.solution[6 * bodies..].iter_mut().zip(&ws.residual) {
            *target = -value;
        }
        solver.solve(&self.factors, &mut ws.solution);
        let mut largest = 0.0_f64;
        for (body, delta) in state.bodies.iter_mut().zip(ws.solution.chunks_exact(6)) {
            largest = delta.iter().fold(largest, |m, d| m.max(d.abs()));
            body.displace(delta);
        }
        if !largest.is_finite() {
            return Err(Error::NotFinite { what: "the static equilibrium".to_owned(), time: 0.0 });
        }
        Ok(largest)
    }

    fn assemble(&mut self, ws: &Workspace) {
        let (statics, factors) = (self.statics, &mut self.factors);
        factors.fill(0.0);
        self.model.stiffness(&ws.kin, &statics.fits, self.holding, &mut |i, j, block| {
            // every pair that the initial pose couples has its place
            let Some(place) = statics.ordering.place(i, j) else { return };
            let target = &mut factors[place.offset as usize..][..36];
            let block = if place.as_asked { block } else { block.transpose() };
            for (t, value) in target.iter_mut().zip(block.iter()) {
                *t += value;
            }
        });
        for (joint, places) in self.model.joints.iter().zip(&statics.places.joints) {
            joint.store_jacobian(&ws.kin, places, factors);
        }
    }

    /// Largest acceleration under the loads alone.
    fn acceleration(&self, state: &State, ws: &mut Workspace) -> Result<f64, Error> {
        let lateral = vec![0.0; self.loads.len()];
        let loads = Loads { vertical: &self.loads, lateral: &lateral };
        self.model.accelerations(state, &loads, ws)?;
        let n = 6 * self.model.composites.len();
        Ok(ws.solution[..n].iter().fold(0.0, |m, a| m.max(a.abs())))
    }
}
