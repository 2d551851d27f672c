//! Stages that keep the factors of an earlier stage.
//!
//! With the accelerations a and multipliers λ of a stage whose matrix was factored, another stage has a + Δa and
//! λ + Δλ:
//!
//! M Δa + Φ_qᵀ Δλ = Q − Φ_qᵀ λ − M a,  Φ_q Δa = γ − Φ_q a.
//!
//! The right-hand sides are those of the stage itself, exactly; only the matrix on the left is kept. Its relative
//! error is the turning of the bodies since, so the accelerations are wrong by that part of their change within
//! the step: nothing where nothing changes. A stage that turns or moves further than [`BESIDE`] is factored.
//!
//! A stage then costs half (two-car train: 12 instead of 25 µs). Formally the scheme is of second order then, with
//! an error constant of [`BESIDE`], so a model does this only if it is asked to, and only in steps that are long.

use crate::dynamics::check_line;
use crate::error::Error;
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::state::BodyState;
use crate::workspace::Workspace;

/// Largest change of a component of a body's place (m) or quaternion (half an angle in rad) since the factors.
const BESIDE: f64 = 5e-5;

impl Workspace {
    /// Remembers a solution for stages beside it.
    pub(crate) fn keep(&mut self) {
        self.kept.clear();
        self.kept.extend_from_slice(&self.solution);
    }

    /// Whether the poses are close to those whose factors it holds.
    pub(crate) fn is_beside(&self, bodies: &[BodyState]) -> bool {
        // a NaN is not beside anything
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= BESIDE;
        bodies.iter().zip(&self.factored_pose).all(|(body, (place, attitude))| {
            body.position.iter().zip(place.iter()).all(near)
                && body.attitude.iter().zip(attitude).all(near)
        })
    }
}

impl VehicleModel {
    /// Lets the stages of internal steps above this size (s) keep the factors of an earlier stage while no body moves
    /// by more than 0.05 mm or turns by more than 0.1 mrad: cheaper, and less exact by 1e-4 of the change of the
    /// accelerations within a step at most. Without this, every stage is factored.
    #[must_use]
    pub fn with_factors_kept_above(mut self, step: f64) -> Self {
        self.keeps_above = step;
        self
    }

    /// As `evaluate`, with the kept solution and its factors.
    pub(crate) fn evaluate_beside(
        &self,
        bodies: &[BodyState],
        time: f64,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        // the kinematics will not be those of the factors
        ws.forget();
        self.set_kinematics(bodies, ws);
        self.apply_forces(ws);
        check_line(time, ws)?;
        self.right_hand_side(ws);
        self.jacobians(ws);
        let kept = std::mem::take(&mut ws.kept);
        self.take_away(&kept, ws);
        let (inertia, _) = ws.solution.as_chunks_mut::<6>();
        let (accelerations, _) = kept.as_chunks::<6>();
        for ((force, a), composite) in inertia.iter_mut().zip(accelerations).zip(&self.composites) {
            let turning = composite.inertia * Vec3::new(a[3], a[4], a[5]);
            for k in 0..3 {
                force[k] -= composite.mass * a[k];
                force[3 + k] -= turning[k];
            }
        }
        self.solver.solve(&ws.factors, &mut ws.solution);
        for (value, kept) in ws.solution.iter_mut().zip(&kept) {
            *value += kept;
        }
        ws.kept = kept;
        self.check_finite(time, ws)
    }

    /// Φ_qᵀ λ and Φ_q a of known accelerations and multipliers, with the Jacobians in the workspace, from the
    /// right-hand side in it.
    pub(crate) fn take_away(&self, known: &[f64], ws: &mut Workspace) {
        let ground = self.ground();
        let (accelerations, multipliers) = known.split_at(6 * ground.0);
        let (forces, bends) = ws.solution.split_at_mut(6 * ground.0);
        let (forces, _) = forces.as_chunks_mut::<6>();
        let (accelerations, _) = accelerations.as_chunks::<6>();
        for joint in &self.joints {
            let rows = joint.row..joint.row + joint.equations();
            for (body, jacobian) in [(joint.a, &ws.rows_a), (joint.b, &ws.rows_b)] {
                if body == ground {
                    continue;
                }
                let (force, a) = (&mut forces[body], &accelerations[body]);
                let known = bends[rows.clone()].iter_mut().zip(&multipliers[rows.clone()]);
                for (row, (bend, lambda)) in jacobian[rows.clone()].iter().zip(known) {
                    *bend -= (row[0] * a[0] + row[1] * a[1] + row[2] * a[2])
                        + (row[3] * a[3] + row[4] * a[4] + row[5] * a[5]);
                    *force = std::array::from_fn(|i| force[i] - row[i] * lambda);
                }
            }
        }
    }
}
