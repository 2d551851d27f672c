//! Rates of the accelerations along the motion, and their rates, computed from one evaluation.
//!
//! Eq. 9 differentiated in time has the same matrix: with the accelerations a and multipliers λ of
//! the moment held fixed in the brackets,
//!
//! M ȧ + Φ_qᵀ λ̇ = d/dt [Q − Φ_qᵀ λ],  Φ_q ȧ = d/dt [γ − Φ_q a].
//!
//! The brackets are differenced centrally along the motion. Neither neighbouring state needs a
//! factorisation or a solution; the existing factors give ȧ and λ̇ by one back-substitution.
//!
//! Differentiated once more,
//!
//! M ä + Φ_qᵀ λ̈ = d²/dt² [Q − Φ_qᵀ (λ + λ̇ t)],  Φ_q ä = d²/dt² [γ − Φ_q (a + ȧ t)],
//!
//! with a, λ, ȧ, λ̇ of the moment, by the central difference of fourth order.

use crate::contact::TrackContact;
use crate::dynamics::{are_finite, check_line};
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

/// Step of the second difference, s. Motions of up to 400 rad/s lose (400·BEND_DIFFERENCE)⁴/90 = 5e-7.
/// Rounding as above: 2e-11 m/s² become 2e-3 m/s⁴ at the most, which moves the polynomial over a step of
/// 10 ms by 3e-9 m/s².
const BEND_DIFFERENCE: f64 = 2e-4;
/// Its weights at −2, −1, 0, 1 and 2 steps, times 12.
const BEND_WEIGHTS: [f64; 5] = [-1.0, 16.0, -30.0, 16.0, -1.0];

/// The rail under the magnets with the accelerations of its heights and their rates, one per magnet.
#[derive(Debug, Clone, Copy)]
pub struct MovingTrack<'a> {
    /// Its heights and their rates.
    pub track: &'a TrackContact<'a>,
    /// Rates of the rates, m/s².
    pub acceleration: &'a [f64],
    /// Rates of the lateral rates, m/s²; empty if these do not change.
    pub side_acceleration: &'a [f64],
    /// Rates of the accelerations, m/s³; used for second derivatives only.
    pub jerk: &'a [f64],
    /// Rates of the lateral accelerations, m/s³, or empty; used for second derivatives only.
    pub side_jerk: &'a [f64],
}

impl BodyState {
    /// The body at a time `dt` later (or earlier) by its Taylor series, with the rates of its
    /// accelerations if they are known. Its attitude is exact to the second order.
    fn beside(&self, dt: f64, (v, w): (Vec3, Vec3), rates: Option<(Vec3, Vec3)>) -> Self {
        let turn = self.angular_velocity * dt + w * (0.5 * dt * dt);
        let mut beside = Self {
            position: self.position + self.velocity * dt + v * (0.5 * dt * dt),
            attitude: multiply(self.attitude, from_rotation_vector(&turn)),
            velocity: self.velocity + v * dt,
            angular_velocity: self.angular_velocity + w * dt,
        };
        if let Some((v, w)) = rates {
            beside.position += v * (dt * dt * dt / 6.0);
            beside.velocity += v * (0.5 * dt * dt);
            beside.angular_velocity += w * (0.5 * dt * dt);
        }
        beside
    }
}

/// Velocities v̇ and ω̇ of a body in a solution of eq. 9.
fn of_body(solution: &[f64], body: BodyIndex) -> (Vec3, Vec3) {
    let x = &solution[body.rows()];
    (Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], x[5]))
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
        track: Option<MovingTrack>,
        [ws, probe]: [&mut Workspace; 2],
    ) -> Result<(), Error> {
        let (forces, rates) = (forces.into(), rates.into());
        self.check_forces(state, &rates)?;
        if let Some(MovingTrack { track, acceleration, .. }) = track {
            self.check_track(track.height.len(), acceleration.len())?;
        }
        self.accelerations_in_contact(state, forces, track.map(|it| it.track), ws)?;
        probe.forget();
        probe.touch.set(track.map(|it| it.track));
        for dt in [-DIFFERENCE, DIFFERENCE] {
            shift_loads(dt, [&forces, &rates], track, ws, probe);
            self.feed_motors(dt, probe);
            self.imbalance(&state.bodies, dt, ws, probe, None);
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

    /// Like [`VehicleModel::jerks_in_contact`], and the rates of these rates, where the forces also
    /// have the second derivatives `bends`; read them with [`VehicleModel::magnet_snap`].
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`]; [`Error::Line`] along a line.
    pub fn snaps_in_contact(
        &self,
        state: &State,
        [forces, rates, bends]: [AppliedForces; 3],
        track: Option<MovingTrack>,
        [ws, probe]: [&mut Workspace; 2],
    ) -> Result<(), Error> {
        self.refuse_line(state, "the second derivative of an acceleration")?;
        self.check_forces(state, &bends)?;
        if let Some(MovingTrack { acceleration, jerk, .. }) = track {
            self.check_track(acceleration.len(), jerk.len())?;
        }
        self.jerks_in_contact(state, forces, rates, track, [&mut *ws, &mut *probe])?;
        let known = std::mem::replace(&mut probe.solution, std::mem::take(&mut probe.bend));
        let mut sum = std::mem::take(&mut probe.sum_of_bends);
        probe.solution.resize(known.len(), 0.0);
        sum.clear();
        sum.resize(known.len(), 0.0);
        for (k, weight) in BEND_WEIGHTS.into_iter().enumerate() {
            let dt = BEND_DIFFERENCE * (k as f64 - 2.0);
            shift_loads(dt, [&forces, &rates], track, ws, probe);
            bend_loads(dt, &bends, track, probe);
            self.feed_motors(dt, probe);
            self.imbalance(&state.bodies, dt, ws, probe, Some(&known));
            let scale = weight / (12.0 * BEND_DIFFERENCE * BEND_DIFFERENCE);
            for (sum, value) in sum.iter_mut().zip(&probe.solution) {
                *sum += scale * value;
            }
        }
        self.solver.solve(&ws.factors, &mut sum);
        probe.acceleration = rates.acceleration;
        probe.frame_bend = bends.acceleration;
        probe.sum_of_bends = std::mem::replace(&mut probe.solution, known);
        probe.bend = sum;
        if are_finite(&probe.bend) {
            return Ok(());
        }
        let what = "the second derivative of an acceleration".to_owned();
        Err(Error::NotFinite { what, time: state.time })
    }

    /// Q − Φ_qᵀ λ and γ − Φ_q a at a time `dt` from the state, with a and λ from `ws`, into
    /// `probe.solution`. If their `rates` are known, a and λ change with them.
    fn imbalance(
        &self,
        bodies: &[BodyState],
        dt: f64,
        ws: &Workspace,
        probe: &mut Workspace,
        rates: Option<&[f64]>,
    ) {
        for (k, (body, kin)) in bodies.iter().zip(&mut probe.kin).enumerate() {
            let rates = rates.map(|rates| of_body(rates, BodyIndex(k)));
            let beside = body.beside(dt, ws.acceleration(BodyIndex(k)), rates);
            kin.set_pose(&beside);
            kin.set_motion(&beside);
        }
        self.jacobians(probe);
        self.apply_forces(probe);
        self.right_hand_side(probe);
        let Some(rates) = rates else { return self.take_away(&ws.solution, probe) };
        let mut known = std::mem::take(&mut probe.spare);
        for ((known, value), rate) in known.iter_mut().zip(&ws.solution).zip(rates) {
            *known = value + rate * dt;
        }
        self.take_away(&known, probe);
        probe.spare = known;
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

    /// Second derivative of the acceleration of magnet k after [`VehicleModel::snaps_in_contact`] with these
    /// two workspaces, m/s⁴.
    ///
    /// With s⁽¹⁾ = ω × s and so on, s⁽⁴⁾ = α̈ × s + 3 α̇ × s⁽¹⁾ + 3 α × s⁽²⁾ + ω × s⁽³⁾, and
    /// α̈ = A ω⃛ + ω × A ω̈ + ω × α̇.
    #[must_use]
    pub fn magnet_snap(&self, ws: &Workspace, probe: &Workspace, k: MagnetIndex) -> Vec3 {
        let anchor = &self.magnets[k];
        if anchor.body == self.ground() {
            return Vec3::zeros();
        }
        let kin = &ws.kin[anchor.body];
        let (linear, angular) = of_body(&probe.bend, anchor.body);
        let (arm, w) = (kin.turn(&anchor.local), &kin.w_world);
        let alpha = kin.turn(&ws.acceleration(anchor.body).1);
        let turned = kin.turn(&probe.acceleration(anchor.body).1);
        let alpha_rate = turned + w.cross(&alpha);
        let alpha_bend = kin.turn(&angular) + w.cross(&turned) + w.cross(&alpha_rate);
        let first = w.cross(&arm);
        let second = alpha.cross(&arm) + w.cross(&first);
        let third = alpha_rate.cross(&arm) + alpha.cross(&first) * 2.0 + w.cross(&second);
        linear
            + Vec3::new(probe.frame_bend, 0.0, 0.0)
            + alpha_bend.cross(&arm)
            + (alpha_rate.cross(&first) + alpha.cross(&second)) * 3.0
            + w.cross(&third)
    }
}

/// Loads and rail at a time `dt` from the moment, by their rates.
fn shift_loads(
    dt: f64,
    [forces, rates]: [&AppliedForces; 2],
    track: Option<MovingTrack>,
    ws: &Workspace,
    probe: &mut Workspace,
) {
    for (shifted, values, rates) in [
        (&mut probe.vertical, forces.magnets.vertical, rates.magnets.vertical),
        (&mut probe.lateral, forces.magnets.lateral, rates.magnets.lateral),
    ] {
        for ((shifted, value), rate) in shifted.iter_mut().zip(values).zip(rates) {
            *shifted = value + rate * dt;
        }
    }
    if let Some(MovingTrack { track, acceleration, side_acceleration, .. }) = track {
        for (k, acceleration) in acceleration.iter().enumerate() {
            probe.touch.height[k] =
                track.height[k] + dt * (track.rate[k] + 0.5 * dt * acceleration);
            probe.touch.rate[k] = track.rate[k] + dt * acceleration;
            let side_rate = track.side_rate.get(k).copied().unwrap_or(0.0);
            probe.touch.side_rate[k] = side_rate + dt * side_acceleration.get(k).unwrap_or(&0.0);
        }
        probe.touch.speed = track.speed + dt * forces.acceleration;
    }
    probe.acceleration = forces.acceleration + rates.acceleration * dt;
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
}

/// Adds what second derivatives of loads and rail do until the time `dt`.
fn bend_loads(dt: f64, bends: &AppliedForces, track: Option<MovingTrack>, probe: &mut Workspace) {
    let half = 0.5 * dt * dt;
    for (shifted, bends) in [
        (&mut probe.vertical[..], bends.magnets.vertical),
        (&mut probe.lateral, bends.magnets.lateral),
        (probe.external.as_flattened_mut(), bends.external.as_flattened()),
    ] {
        shifted.iter_mut().zip(bends).for_each(|(shifted, bend)| *shifted += half * bend);
    }
    probe.acceleration += half * bends.acceleration;
    for (k, jerk) in track.iter().flat_map(|it| it.jerk).enumerate() {
        probe.touch.height[k] += half * dt / 3.0 * jerk;
        probe.touch.rate[k] += half * jerk;
    }
    for (k, jerk) in track.iter().flat_map(|it| it.side_jerk).enumerate() {
        probe.touch.side_rate[k] += half * jerk;
    }
}
