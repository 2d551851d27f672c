//! Equation 9 as dense matrices, for checks.

use nalgebra::{DMatrix, DVector};

use crate::composite::mass_block;
use crate::loads::{AppliedForces, copy_external};
use crate::model::VehicleModel;
use crate::state::State;
use crate::workspace::Workspace;

impl VehicleModel {
    /// M and Φ_q of eq. 9 as dense matrices, with the right-hand side (Q, γ): for checks.
    #[must_use]
    pub fn dense_system<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        ws: &mut Workspace,
    ) -> (DMatrix<f64>, DMatrix<f64>, DVector<f64>) {
        ws.forget();
        ws.touch.set(None);
        self.follow_line(state.travel, ws);
        let forces = forces.into();
        ws.vertical.copy_from_slice(forces.magnets.vertical);
        ws.lateral.copy_from_slice(forces.magnets.lateral);
        copy_external(&mut ws.external, forces.external);
        self.set_kinematics(&state.bodies, ws);
        self.jacobians(ws);
        self.apply_forces(ws);
        self.right_hand_side(ws);
        let n = 6 * self.composites.len();
        let mut mass = DMatrix::zeros(n, n);
        for (k, composite) in self.composites.iter().enumerate() {
            mass.view_mut((6 * k, 6 * k), (6, 6)).copy_from(&mass_block(composite));
        }
        let mut jacobian = DMatrix::zeros(self.rows, n);
        for joint in &self.joints {
            for r in joint.row..joint.row + joint.equations() {
                for (body, row) in [(joint.a, &ws.rows_a[r]), (joint.b, &ws.rows_b[r])] {
                    if body != self.ground() {
                        for (c, value) in row.iter().enumerate() {
                            jacobian[(r, 6 * body.0 + c)] = *value;
                        }
                    }
                }
            }
        }
        (mass, jacobian, DVector::from_column_slice(&ws.solution))
    }
}
