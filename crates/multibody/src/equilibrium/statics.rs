//! The matrix H of the static problem: elastic stiffness, holding springs and inertia.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::holding::Holding;
use crate::composite::mass_block;
use crate::elements::ElasticRow;
use crate::error::Error;
use crate::explain::unusable;
use crate::index::{BodyIndex, MagnetIndex};
use crate::joint::JacobianRow;
use crate::layout::Analysis;
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::ordering::{SAFE_AT_REST, analyse};
use crate::places::BlockPlaces;
use crate::saddle::{add_jacobians, places, sizes};
use crate::sample::Sample;
use crate::state::Kinematics;
use crate::way::Way;
use crate::workspace::Workspace;

/// Magnets of one body with the rigid-body motions that they can distinguish.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub body: BodyIndex,
    pub magnets: Vec<MagnetIndex>,
    /// Orthonormal columns, one row per magnet.
    pub basis: DMatrix<f64>,
}

/// Analysis and storage layout of the static problem.
#[derive(Debug, Clone)]
pub(crate) struct Statics {
    pub analysis: Analysis,
    pub places: BlockPlaces,
    pub fits: Vec<Fit>,
}

impl Statics {
    /// Adds a block to the matrix.
    pub(super) fn add(
        &self,
        i: BodyIndex,
        j: BodyIndex,
        block: &Matrix6<f64>,
        factors: &mut [f64],
    ) {
        // every pair that the initial pose couples has its place
        let Some(place) = self.analysis.place(i.0, j.0) else { return };
        let target = &mut factors[place.offset as usize..][..36];
        for (c, column) in block.column_iter().enumerate() {
            for (r, value) in column.iter().enumerate() {
                target[if place.as_asked { 6 * c + r } else { 6 * r + c }] += value;
            }
        }
    }
}

impl VehicleModel {
    /// Q and −Φ for the forces and residuals in the workspace, for a body at rest.
    pub(super) fn static_right_hand_side(&self, ws: &mut Workspace) {
        let bodies = self.composites.len();
        for k in 0..bodies {
            let moment = ws.kin[k].a.tr_mul(&ws.wrenches[k].moment);
            ws.solution[6 * k..6 * k + 3].copy_from_slice(ws.wrenches[k].force.as_slice());
            ws.solution[6 * k + 3..6 * k + 6].copy_from_slice(moment.as_slice());
        }
        for (target, value) in ws.solution[6 * bodies..].iter_mut().zip(&ws.residual) {
            *target = -value;
        }
    }

    /// The rigid-body fits of all magnet-carrying bodies.
    pub(crate) fn fits(&self) -> Vec<Fit> {
        let mut fits = Vec::new();
        for body in (0..self.composites.len()).map(BodyIndex) {
            let magnets: Vec<MagnetIndex> =
                self.magnets().filter(|&k| self.magnets[k].body == body).collect();
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
                // magnets in one line or at one point distinguish no further motion
                if candidate.norm() > 1e-9 * size {
                    columns.push(candidate.normalize());
                }
            }
            fits.push(Fit { body, magnets, basis: DMatrix::from_columns(&columns) });
        }
        fits
    }

    /// The static problem; the workspace keeps it for the next search.
    pub(super) fn static_problem(
        &self,
        holding: &Holding,
        ws: &mut Workspace,
    ) -> Result<Arc<Statics>, Error> {
        if let Some((known, statics)) = &ws.statics
            && known == holding
        {
            return Ok(statics.clone());
        }
        let statics = Arc::new(self.analyse_statics(holding)?);
        ws.statics = Some((*holding, statics.clone()));
        Ok(statics)
    }

    fn analyse_statics(&self, holding: &Holding) -> Result<Statics, Error> {
        let bodies = self.composites.len();
        let fits = self.fits();
        let mut kin = vec![Kinematics::at_rest(); bodies + 1];
        for (kin, composite) in kin.iter_mut().zip(&self.composites) {
            kin.set_pose(&composite.start);
        }
        let mut sample = Sample::new(sizes(bodies, &self.joints), bodies);
        let restoring = vec![0.0; self.magnets.len()];
        self.stiffness(&kin, &fits, holding, &restoring, None, &mut |i, j, block| {
            let block = DMatrix::from_column_slice(6, 6, block.as_slice());
            if i == j {
                sample.diagonal[i] += block;
            } else {
                sample.couple(i.0, j.0, &block);
            }
        });
        add_jacobians(&mut sample, &self.joints, &kin);
        // stiffness takes the place of mass, and changes with the pose
        let analysis = analyse(sample, SAFE_AT_REST, false)
            .map_err(|failure| unusable(failure, &self.composites, &self.joints))?;
        let places = places(&analysis, bodies, &self.joints);
        Ok(Statics { analysis, places, fits })
    }

    /// The blocks of H, each pair of bodies once. On a line the magnets and the drive act along its axes.
    pub(super) fn stiffness(
        &self,
        kin: &[Kinematics],
        fits: &[Fit],
        holding: &Holding,
        restoring: &[f64],
        way: Option<&Way>,
        add: &mut impl FnMut(BodyIndex, BodyIndex, Matrix6<f64>),
    ) {
        let ground = self.ground();
        for (k, composite) in self.composites.iter().enumerate() {
            add(BodyIndex(k), BodyIndex(k), mass_block(composite) * holding.inertia);
        }
        let mut sink = |e: ElasticRow| {
            let (a, b) = (Vector6::from(e.row_a), Vector6::from(e.row_b));
            if e.a != ground {
                add(e.a, e.a, a * a.transpose() * e.stiffness);
            }
            if e.b != ground {
                add(e.b, e.b, b * b.transpose() * e.stiffness);
            }
            if e.a != ground && e.b != ground && e.a != e.b {
                add(e.a, e.b, a * b.transpose() * e.stiffness);
            }
        };
        self.elastic_rows(kin, way, &mut sink);
        for fit in fits {
            for column in fit.basis.column_iter() {
                let mut gradient = Vector6::zeros();
                for (weight, &k) in column.iter().zip(&fit.magnets) {
                    let up = self.axes_ahead(way, self.magnets[k].start.x).column(2).into_owned();
                    gradient += self.magnet_row(kin, k, &up) * *weight;
                }
                add(fit.body, fit.body, gradient * gradient.transpose() * holding.stiffness);
            }
        }
        for (k, (magnet, restoring)) in self.magnets.iter().zip(restoring).enumerate() {
            // a magnet without load has no guidance force
            if *restoring > 0.0 {
                let left = self.axes_ahead(way, magnet.start.x).column(1).into_owned();
                let row = self.magnet_row(kin, MagnetIndex(k), &left);
                add(magnet.body, magnet.body, row * row.transpose() * *restoring);
            }
        }
    }

    /// Gradient of a magnet's displacement along a direction of the world.
    pub(super) fn magnet_row(
        &self,
        kin: &[Kinematics],
        k: MagnetIndex,
        along: &Vec3,
    ) -> Vector6<f64> {
        let body = &kin[self.magnets[k].body];
        let arm = body.turn(&self.magnets[k].local);
        let moment = body.a.tr_mul(&arm.cross(along));
        Vector6::new(along.x, along.y, along.z, moment.x, moment.y, moment.z)
    }

    fn elastic_rows(
        &self,
        kin: &[Kinematics],
        way: Option<&Way>,
        sink: &mut impl FnMut(ElasticRow),
    ) {
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
        let ground = self.ground();
        for anchor in &drive.anchors {
            let body = &kin[anchor.body];
            let along = self.axes_ahead(way, anchor.start.x).column(0).into_owned();
            let m = body.a.tr_mul(&body.turn(&anchor.local).cross(&along));
            sink(ElasticRow {
                a: ground,
                b: anchor.body,
                row_a: JacobianRow::default(),
                row_b: [along.x, along.y, along.z, m.x, m.y, m.z],
                stiffness: drive.stiffness,
            });
        }
    }
}
