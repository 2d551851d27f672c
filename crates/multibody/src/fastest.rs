//! The fastest motion about a state at rest, which bounds the internal step.
//!
//! With a deviation u of the pose and its rate v, small motions are u' = v, v' = a(u, v) with the
//! accelerations of eq. 9. The eigenvalue of largest size follows from a few products with this matrix
//! (Arnoldi's method), each of them one evaluation: cheap for long trains too. Accelerations satisfy the
//! constraints, and so do all vectors made from them.

use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, DVector};

use crate::error::Error;
use crate::index::BodyIndex;
use crate::linearisation::natural_frequency;
use crate::loads::AppliedForces;
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::state::State;
use crate::workspace::Workspace;

/// Products. The largest eigenvalue of the trains is then known to a few parts in a thousand.
const PRODUCTS: usize = 40;
/// Size of a difference, m, rad or per second; see `linearise`.
const DISPLACED: f64 = 1e-5;
/// Weight of a displacement against a velocity, 1/s: a typical rate of a vehicle. It does not change
/// eigenvalues.
const TYPICAL: f64 = 100.0;
/// Sweeps of the QR iteration per eigenvalue before giving up.
const SWEEPS: usize = 100;

impl VehicleModel {
    /// |λ| of the fastest small motion about an equilibrium under held forces, 1/s. An explicit
    /// Runge-Kutta scheme of order 4 is stable up to an internal step of 2.8/|λ|.
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`], and [`Error::Eigenvalues`].
    pub fn fastest_rate<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        ws: &mut Workspace,
    ) -> Result<f64, Error> {
        let forces = forces.into();
        let n = 6 * self.composites.len();
        let mut at = state.clone();
        let mut accelerations = |x: &DVector<f64>, ws: &mut Workspace| {
            at.clone_from(state);
            for (k, body) in at.bodies.iter_mut().enumerate() {
                let rows = BodyIndex(k).rows();
                let moved: Vec<f64> =
                    rows.clone().map(|row| x[row] * DISPLACED / TYPICAL).collect();
                body.displace(&moved);
                let v = x.rows(n + rows.start, 6) * DISPLACED;
                body.velocity += Vec3::new(v[0], v[1], v[2]);
                body.angular_velocity += Vec3::new(v[3], v[4], v[5]);
            }
            self.accelerations(&at, forces, ws)?;
            Ok(DVector::from_column_slice(&ws.solution[..n]))
        };
        let rest = accelerations(&DVector::zeros(2 * n), ws)?;
        let mut product = |x: &DVector<f64>, ws: &mut Workspace| -> Result<_, Error> {
            let mut y = DVector::zeros(2 * n);
            y.rows_mut(0, n).copy_from(&(x.rows(n, n) * TYPICAL));
            y.rows_mut(n, n).copy_from(&((accelerations(x, ws)? - &rest) / DISPLACED));
            Ok(y)
        };
        // a start with a part of every motion, the same on every machine; its velocities satisfy the
        // constraints
        let mut first = DVector::zeros(2 * n);
        for k in 0..n {
            let t = k as f64 + 1.0;
            first[k] = (1.7 * t * t).sin();
        }
        let mut first = product(&first, ws)?;
        first.rows_mut(0, n).fill(0.0);
        let size = first.norm();
        if size == 0.0 {
            return Ok(0.0);
        }
        let mut basis = vec![first / size];
        let mut reduced = DMatrix::zeros(PRODUCTS, PRODUCTS);
        let mut used = PRODUCTS;
        for j in 0..PRODUCTS {
            let mut next = product(&basis[j], ws)?;
            let whole = next.norm();
            // twice, so that rounding leaves the basis orthogonal
            for _ in 0..2 {
                for (i, known) in basis.iter().enumerate() {
                    let part = known.dot(&next);
                    reduced[(i, j)] += part;
                    next.axpy(-part, known, 1.0);
                }
            }
            let rest = next.norm();
            // below the rounding of differences there is no further motion
            if j + 1 == PRODUCTS || rest <= 1e-7 * whole {
                used = j + 1;
                break;
            }
            reduced[(j + 1, j)] = rest;
            basis.push(next / rest);
        }
        let reduced = reduced.view((0, 0), (used, used)).into_owned();
        let schur = Schur::try_new(reduced, f64::EPSILON, SWEEPS * used)
            .ok_or(Error::Eigenvalues { eigenvalue: None })?;
        let values = schur.complex_eigenvalues();
        Ok(values.iter().fold(0.0, |most, value| natural_frequency(*value).max(most)))
    }
}
