//! Displacement of the magnets per reduced coordinate of a linearisation.

use nalgebra::{DMatrix, Matrix3xX, RowDVector};

use crate::anchor::Anchor;
use crate::index::ObservedIndex;
use crate::linearisation::Linearisation;
use crate::math::{cross_matrix, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::State;

impl VehicleModel {
    /// ∂(displacement of magnet k in world axes)/∂y in rows 3k … 3k + 2, with the reduced coordinates y
    /// of a linearisation about `state`. Its transpose turns forces on the magnets into reduced ones.
    #[must_use]
    pub fn magnet_shapes(&self, state: &State, linearisation: &Linearisation) -> DMatrix<f64> {
        let mut shapes = DMatrix::zeros(3 * self.magnets.len(), linearisation.degrees_of_freedom());
        for (k, anchor) in self.magnets.iter().enumerate() {
            if let Some(shape) = self.anchor_shape(state, linearisation, anchor) {
                shapes.rows_mut(3 * k, 3).copy_from(&shape);
            }
        }
        shapes
    }

    /// As [`VehicleModel::magnet_shapes`] for external loads: displacement of the centre of mass of
    /// observed body k in rows 6k … 6k + 2 and rotation in rows 6k + 3 … 6k + 5, both in world axes.
    #[must_use]
    pub fn external_shapes(&self, state: &State, linearisation: &Linearisation) -> DMatrix<f64> {
        let mut shapes = DMatrix::zeros(6 * self.watched.len(), linearisation.degrees_of_freedom());
        for k in 0..self.watched.len() {
            let anchor = self.observed_centre(ObservedIndex(k));
            let Some(body) = state.bodies.get(anchor.body.0) else { continue };
            if let Some(shape) = self.anchor_shape(state, linearisation, &anchor) {
                shapes.rows_mut(6 * k, 3).copy_from(&shape);
            }
            let turns = linearisation.basis.rows(6 * anchor.body.0 + 3, 3);
            let turns = rotation_matrix(body.attitude) * turns;
            shapes.rows_mut(6 * k + 3, 3).copy_from(&turns);
        }
        shapes
    }

    /// ∂([`VehicleModel::relative_speed`])/∂ẏ.
    #[must_use]
    pub fn speed_shape(&self, state: &State, linearisation: &Linearisation) -> RowDVector<f64> {
        let mut mean = RowDVector::zeros(linearisation.degrees_of_freedom());
        if let Some(drive) = self.drive.as_ref().filter(|d| !d.anchors.is_empty()) {
            for anchor in &drive.anchors {
                if let Some(shape) = self.anchor_shape(state, linearisation, anchor) {
                    mean += shape.row(0) / drive.anchors.len() as f64;
                }
            }
            return mean;
        }
        let mass: f64 = self.composites.iter().map(|c| c.mass).sum();
        for (k, composite) in self.composites.iter().enumerate() {
            mean += linearisation.basis.row(6 * k) * (composite.mass / mass);
        }
        mean
    }

    /// Displacement of a point, s + θ × arm, per reduced coordinate; none for a point of the ground.
    fn anchor_shape(
        &self,
        state: &State,
        linearisation: &Linearisation,
        anchor: &Anchor,
    ) -> Option<Matrix3xX<f64>> {
        let body = state.bodies.get(anchor.body.0)?;
        let rows = linearisation.basis.rows(6 * anchor.body.0, 6);
        // rotations are in body axes: A (θ × local) = −A [local]ₓ θ
        let turning = rotation_matrix(body.attitude) * cross_matrix(&anchor.local);
        Some(rows.fixed_rows::<3>(0) - turning * rows.fixed_rows::<3>(3))
    }
}
