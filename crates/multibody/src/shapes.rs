//! Displacement of the magnets per reduced coordinate of a linearisation.

use nalgebra::{DMatrix, Matrix3xX, RowDVector};

use crate::anchor::Anchor;
use crate::index::ObservedIndex;
use crate::linearisation::Linearisation;
use crate::math::{Vec3, cross_matrix, rotation_matrix};
use crate::model::VehicleModel;
use crate::observe::point_motion;
use crate::state::State;

impl VehicleModel {
    /// ∂(displacement of magnet k in world axes, on a line in those of the line there)/∂y in rows 3k …
    /// 3k + 2, with the reduced coordinates y of a linearisation about `state`. Its transpose turns forces
    /// on the magnets into reduced ones.
    #[must_use]
    pub fn magnet_shapes(&self, state: &State, linearisation: &Linearisation) -> DMatrix<f64> {
        let mut shapes = DMatrix::zeros(3 * self.magnets.len(), linearisation.degrees_of_freedom());
        for (k, anchor) in self.magnets.iter().enumerate() {
            if let Some(shape) = self.anchor_shape(state, linearisation, anchor) {
                let shape = self.along_line(state, anchor, shape, false);
                shapes.rows_mut(3 * k, 3).copy_from(&shape);
            }
        }
        shapes
    }

    /// As [`VehicleModel::magnet_shapes`], of the magnets' places: along, left and up. On a line the way
    /// along it is that of the foot.
    #[must_use]
    pub fn magnet_places(&self, state: &State, linearisation: &Linearisation) -> DMatrix<f64> {
        let mut places = DMatrix::zeros(3 * self.magnets.len(), linearisation.degrees_of_freedom());
        for (k, anchor) in self.magnets.iter().enumerate() {
            if let Some(shape) = self.anchor_shape(state, linearisation, anchor) {
                let shape = self.along_line(state, anchor, shape, true);
                places.rows_mut(3 * k, 3).copy_from(&shape);
            }
        }
        places
    }

    /// Displacements of a point in the axes of the line there, or the changes of its coordinates.
    fn along_line(
        &self,
        state: &State,
        anchor: &Anchor,
        mut shape: Matrix3xX<f64>,
        coordinates: bool,
    ) -> Matrix3xX<f64> {
        let (line, way) = (self.line.as_ref(), self.way(state.travel));
        let Some(((line, way), body)) = line.zip(way).zip(state.bodies.get(anchor.body.0)) else {
            return shape;
        };
        let meeting = way.meet(line, &point_motion(body, anchor).position);
        for mut column in shape.column_iter_mut() {
            let lost = Vec3::repeat(f64::NAN);
            let moved = meeting.as_ref().map_or(lost, |meeting| {
                let moved = way.inward(meeting, &column.clone_owned());
                if coordinates { meeting.rates(&moved) } else { moved }
            });
            column.copy_from(&moved);
        }
        shape
    }

    /// As [`VehicleModel::magnet_shapes`] for external loads: displacement of the centre of mass of
    /// observed body k in rows 6k … 6k + 2 and rotation in rows 6k + 3 … 6k + 5, both in world axes, on a
    /// line in those of the line there.
    #[must_use]
    pub fn external_shapes(&self, state: &State, linearisation: &Linearisation) -> DMatrix<f64> {
        let mut shapes = DMatrix::zeros(6 * self.watched.len(), linearisation.degrees_of_freedom());
        for k in 0..self.watched.len() {
            let anchor = self.observed_centre(ObservedIndex(k));
            let Some(body) = state.bodies.get(anchor.body.0) else { continue };
            if let Some(shape) = self.anchor_shape(state, linearisation, &anchor) {
                let shape = self.along_line(state, &anchor, shape, false);
                shapes.rows_mut(6 * k, 3).copy_from(&shape);
            }
            let turns = linearisation.basis.fixed_rows::<3>(6 * anchor.body.0 + 3);
            let turns = rotation_matrix(body.attitude) * turns;
            let turns = self.along_line(state, &anchor, turns, false);
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
                    let shape = self.along_line(state, anchor, shape, true);
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
