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
//! Sideways a magnet pulls as its law of guidance says for the load that it carries. That force is part
//! of Q and its stiffness part of H, so it does change the result: it is what holds a vehicle whose
//! loads on the left and on the right differ.
//!
//! Each iteration is one Newton step in poses and multipliers, H δ + Φ_qᵀ λ = Q, Φ_q δ = −Φ, where H
//! holds the elastic stiffness of all elements, K, and σ M. H leaves out the geometric stiffness of
//! the loads, which is smaller than the elastic one wherever the vehicle is stable at all, and
//! so stays positive definite; σ M (pseudo-transient) holds what nothing holds, such as the lateral
//! place of a train without guidance, without changing where the iteration ends, since it acts on δ
//! only. It finds such a place only for a symmetric vehicle, which need not move there.

mod search;

use nalgebra::{DMatrix, DVector, Vector6};

use self::search::Search;
use crate::assembly::{add_jacobians, explain, mass_block, sizes};
use crate::dynamics::Workspace;
use crate::elements::ElasticRow;
use crate::error::Error;
use crate::joint::Row;
use crate::math::Vec3;
use crate::model::{Model, Places};
use crate::ordering::{Ordering, SAFE_AT_REST, Sample, analyse};
use crate::state::{Kinematics, State};

/// Law of the lateral guidance: from the load (N), the gap (m) and the offset to the left (m) of a magnet
/// its lateral force to the left (N) and how fast that falls with the offset (N/m).
pub type Guidance<'a> = &'a dyn Fn(f64, f64, f64) -> [f64; 2];

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
    /// Guidance force of each magnet to the left, N; zeros where no law is given.
    pub lateral: Vec<f64>,
    /// Iterations done.
    pub iterations: usize,
    /// Largest acceleration component left, m/s² or rad/s².
    pub acceleration: f64,
}

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
        let restoring = vec![0.0; self.magnets.len()];
        self.stiffness(&kin, &fits, holding, &restoring, &mut |i, j, block| {
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
        restoring: &[f64],
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
                    gradient += self.magnet_row(kin, k, &Vec3::z()) * *weight;
                }
                add(fit.body, fit.body, gradient * gradient.transpose() * holding.stiffness);
            }
        }
        for (k, (magnet, restoring)) in self.magnets.iter().zip(restoring).enumerate() {
            // a magnet that nothing loads pulls nowhere
            if *restoring > 0.0 {
                let row = self.magnet_row(kin, k, &Vec3::y());
                add(magnet.body, magnet.body, row * row.transpose() * *restoring);
            }
        }
    }

    /// Gradient of a magnet's displacement along a direction of the world.
    fn magnet_row(&self, kin: &[Kinematics], k: usize, along: &Vec3) -> Vector6<f64> {
        let body = &kin[self.magnets[k].body];
        let arm = body.turn(&self.magnets[k].local);
        let moment = body.a.tr_mul(&arm.cross(along));
        Vector6::new(along.x, along.y, along.z, moment.x, moment.y, moment.z)
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
    /// stands at the heights `track` (m, one per magnet, up positive), without guidance forces.
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
        self.guided_equilibrium(track, holding, &|_, _, _| [0.0; 2], ws)
    }

    /// The same with magnets that also pull sideways, each as `guidance` says for its load.
    ///
    /// # Errors
    /// As [`Model::equilibrium`].
    pub fn guided_equilibrium(
        &self,
        track: &[f64],
        holding: &Holding,
        guidance: Guidance,
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
            guidance,
            loads: vec![0.0; track.len()],
            forces: vec![0.0; track.len()],
            lateral: vec![0.0; track.len()],
            restoring: vec![0.0; track.len()],
            factors: vec![0.0; statics.ordering.factorisation.storage],
            statics: &statics,
        };
        search.run(&mut state, ws)
    }
}
