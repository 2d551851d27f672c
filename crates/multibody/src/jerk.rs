//! Rates of the accelerations along the motion, computed from one evaluation.
//!
//! Eq. 9 differentiated in time has the same matrix: with the accelerations a and multipliers λ of
//! the moment held fixed in the brackets,
//!
//! M ȧ + Φ_qᵀ λ̇ = d/dt [Q − Φ_qᵀ λ],  Φ_q ȧ = d/dt [γ − Φ_q a].
//!
//! The brackets are differenced centrally along the motion. Neither neighbouring state needs a
//! factorisation or a solution; the existing factors give ȧ and λ̇ by one back-substitution.

use crate::contact::TrackContact;
use crate::dynamics::check_line;
use crate::error::Error;
use crate::index::{BodyIndex, MagnetIndex};
use crate::loads::{AppliedForces, copy_external};
use crate::math::{Vec3, from_rotation_vector, multiply};
use crate::model::VehicleModel;
use crate::state::{BodyState, State};
use crate::way::Way;
use crate::workspace::Workspace;

/// Step of the central difference, s. Motions of up to 400 rad/s lose (400·DIFFERENCE)²/6 = 2e-7 of
/// their rate. Rounding: places of some 10 m are known to 2e-15 m, which a bushing of 4e5 N/m on a
/// body of 50 kg turns into 2e-11 m/s² and the quotient into 4e-6 m/s³ at the most.
const DIFFERENCE: f64 = 3e-6;

impl BodyState {
    /// The body at a time `dt` later (or earlier) by its Taylor series.
    fn beside(&self, dt: f64, (v, w): (Vec3, Vec3)) -> Self {
        let turn = self.angular_velocity * dt + w * (0.5 * dt * dt);
        Self {
            position: self.position + self.velocity * dt + v * (0.5 * dt * dt),
            attitude: multiply(self.attitude, from_rotation_vector(&turn)),
            velocity: self.velocity + v * dt,
            angular_velocity: self.angular_velocity + w * dt,
        }
    }
}

impl VehicleModel {
    /// Rates of the accelerations along the motion that begins in `state` under `forces`, which
    /// change by `rates` (N/s), into `probe`; read them with [`VehicleModel::magnet_jerk`]. If `ws`
    /// already holds the accelerations, this costs less than another evaluation of them.
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`].
    pub fn jerks<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        rates: impl Into<AppliedForces<'a>>,
        ws: &mut Workspace,
        probe: &mut Workspace,
    ) -> Result<(), Error> {
        self.jerks_in_contact(state, forces, rates, None, [ws, probe])
    }

    /// Like [`VehicleModel::jerks`], with the contacts of the magnets with the rail, whose rates, vertical and
    /// lateral, change by the given accelerations (m/s²), one per magnet. Where a magnet touches or leaves the rail
    /// at this very moment, the rates are between those before and after.
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`].
    pub fn jerks_in_contact<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        rates: impl Into<AppliedForces<'a>>,
        track: Option<(&TrackContact, [&[f64]; 2])>,
        [ws, probe]: [&mut Workspace; 2],
    ) -> Result<(), Error> {
        let (forces, rates) = (forces.into(), rates.into());
        self.check_forces(state, &rates)?;
        let (loads, load_rates) = (forces.magnets, rates.magnets);
        self.accelerations_in_contact(state, forces, track.map(|(track, _)| track), ws)?;
        probe.forget();
        probe.touch.set(track.map(|(track, _)| track));
        for dt in [-DIFFERENCE, DIFFERENCE] {
            for (shifted, values, rates) in [
                (&mut probe.vertical, loads.vertical, load_rates.vertical),
                (&mut probe.lateral, loads.lateral, load_rates.lateral),
            ] {
                for ((shifted, value), rate) in shifted.iter_mut().zip(values).zip(rates) {
                    *shifted = value + rate * dt;
                }
            }
            if let Some((track, [accelerations, sideways])) = track {
                self.check_track(track.height.len(), accelerations.len())?;
                for (k, acceleration) in accelerations.iter().enumerate() {
                    probe.touch.height[k] =
                        track.height[k] + dt * (track.rate[k] + 0.5 * dt * acceleration);
                    probe.touch.rate[k] = track.rate[k] + dt * acceleration;
                    let side_rate = track.side_rate.get(k).copied().unwrap_or(0.0);
                    probe.touch.side_rate[k] = side_rate + dt * sideways.get(k).unwrap_or(&0.0);
                }
                probe.touch.speed = track.speed + dt * forces.acceleration;
            }
            probe.acceleration = forces.acceleration + rates.acceleration * dt;
            self.feed_motors(dt, probe);
            // the frame of the moment stays, and its origin moves along it
            probe.way = ws.way.map(|way| Way {
                shift: dt * (way.speed + 0.5 * dt * forces.acceleration),
                speed: way.speed + dt * forces.acceleration,
                ..way
            });
            copy_external(&mut probe.external, forces.external);
            let shifted = probe.external.as_flattened_mut().iter_mut();
            for (shifted, rate) in shifted.zip(rates.external.as_flattened()) {
                *shifted += rate * dt;
            }
            self.imbalance(&state.bodies, dt, ws, probe);
            check_line(state.time, probe)?;
            std::mem::swap(&mut probe.solution, &mut probe.spare);
        }
        // from here on its rate
        probe.acceleration = rates.acceleration;
        for (rate, later) in probe.solution.iter_mut().zip(&probe.spare) {
            *rate = (later - *rate) / (2.0 * DIFFERENCE);
        }
        self.solver.solve(&ws.factors, &mut probe.solution);
        self.check_finite(state.time, probe)
    }

    /// Q − Φ_qᵀ λ and γ − Φ_q a at a time `dt` from the state, with a and λ from `ws`, into
    /// `probe.solution`.
    fn imbalance(&self, bodies: &[BodyState], dt: f64, ws: &Workspace, probe: &mut Workspace) {
        for (k, (body, kin)) in bodies.iter().zip(&mut probe.kin).enumerate() {
            let beside = body.beside(dt, ws.acceleration(BodyIndex(k)));
            kin.set_pose(&beside);
            kin.set_motion(&beside);
        }
        self.jacobians(probe);
        self.apply_forces(probe);
        self.right_hand_side(probe);
        let ground = self.ground();
        let (forces, bends) = probe.solution.split_at_mut(6 * ground.0);
        let (forces, _) = forces.as_chunks_mut::<6>();
        let (accelerations, _) = ws.solution[..6 * ground.0].as_chunks::<6>();
        for joint in &self.joints {
            let rows = joint.row..joint.row + joint.equations();
            for (body, jacobian) in [(joint.a, &probe.rows_a), (joint.b, &probe.rows_b)] {
                if body == ground {
                    continue;
                }
                let (force, a) = (&mut forces[body], &accelerations[body]);
                let known = bends[rows.clone()].iter_mut().zip(&ws.multipliers()[rows.clone()]);
                for (row, (bend, lambda)) in jacobian[rows.clone()].iter().zip(known) {
                    *bend -= (row[0] * a[0] + row[1] * a[1] + row[2] * a[2])
                        + (row[3] * a[3] + row[4] * a[4] + row[5] * a[5]);
                    *force = std::array::from_fn(|i| force[i] - row[i] * lambda);
                }
            }
        }
    }

    /// Rate of the acceleration of magnet k after [`VehicleModel::jerks`] with these two workspaces, m/s³.
    ///
    /// The acceleration is v̇ + α × s + ω × (ω × s) with α = A ω̇; in the rate ṡ = ω × s and
    /// α̇ = A ω̈ + ω × α.
    #[must_use]
    pub fn magnet_jerk(&self, ws: &Workspace, probe: &Workspace, k: MagnetIndex) -> Vec3 {
        let anchor = &self.magnets[k];
        if anchor.body == self.ground() {
            return Vec3::zeros();
        }
        let kin = &ws.kin[anchor.body];
        let (linear, angular) = probe.acceleration(anchor.body);
        let (arm, w) = (kin.turn(&anchor.local), &kin.w_world);
        let alpha = kin.turn(&ws.acceleration(anchor.body).1);
        let alpha_rate = kin.turn(&angular) + w.cross(&alpha);
        let arm_rate = w.cross(&arm);
        let jerk = linear
            + Vec3::new(probe.acceleration, 0.0, 0.0)
            + alpha_rate.cross(&arm)
            + alpha.cross(&arm_rate) * 2.0
            + w.cross(&(alpha.cross(&arm) + w.cross(&arm_rate)));
        self.jerk_on_line(ws, k, jerk)
    }
}
