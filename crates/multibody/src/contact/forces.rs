//! Forces of stops and skids in an evaluation, their derivatives and their energy.

use super::law::Clearance;
use super::track::TrackContact;
use crate::error::Error;
use crate::index::MagnetIndex;
use crate::loads::AppliedForces;
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::observe::PointMotion;
use crate::state::{BodyState, State};
use crate::workspace::Workspace;

/// Energy and power of all contacts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactPower {
    /// ½ k d² of all contacts, J.
    pub stored: f64,
    /// Power that damping and friction turn into heat, W.
    pub dissipated: f64,
    /// Power that the moving rail does on the vehicle, W. Friction against the travelling frame's speed
    /// counts here: the frame moves over the rail.
    pub supplied: f64,
}

impl VehicleModel {
    /// Gap and rate of magnet k.
    pub(crate) fn clearance(
        &self,
        bodies: &[BodyState],
        k: usize,
        height: f64,
        rate: f64,
    ) -> Clearance {
        let motion = self.magnet_motion(bodies, MagnetIndex(k));
        self.clearance_of(&motion, height, rate)
    }

    /// Gap and rate of a magnet for its motion.
    pub(crate) fn clearance_of(&self, motion: &PointMotion, height: f64, rate: f64) -> Clearance {
        Clearance {
            gap: self.nominal_gap + height - motion.displacement.z,
            rate: rate - motion.velocity.z,
        }
    }

    /// Adds the forces of stops and skids for the kinematics in the workspace.
    pub(crate) fn apply_contact(&self, ws: &mut Workspace) {
        let Workspace { kin, wrenches, touch, .. } = ws;
        let Some(contact) = touch.contact else { return };
        for (k, magnet) in self.magnets.iter().enumerate() {
            let body = &kin[magnet.body];
            let arm = body.turn(&magnet.local);
            let velocity = body.velocity_at(&arm);
            let clearance = Clearance {
                gap: self.nominal_gap + touch.height[k] - (body.r.z + arm.z - magnet.start.z),
                rate: touch.rate[k] - velocity.z,
            };
            let force = contact.force(clearance, [touch.speed + velocity.x, velocity.y]);
            touch.force[k] = force;
            touch.push[k] = touch.push[k].max(force.z.abs());
            if force != Vec3::zeros() {
                wrenches[magnet.body].add(&force, &arm);
            }
        }
    }

    /// Force of stop and skid on magnet k: along the track, to the left and up, N.
    #[must_use]
    pub fn contact_force(&self, state: &State, k: MagnetIndex, track: &TrackContact) -> Vec3 {
        let motion = self.magnet(state, k);
        let clearance = self.clearance_of(&motion, track.height[k.0], track.rate[k.0]);
        track.contact.force(clearance, slip(&motion, track))
    }

    /// Change of [`VehicleModel::contact_force`] with the gap (N/m) and with its rate (N·s/m).
    #[must_use]
    pub fn contact_slopes(&self, state: &State, k: MagnetIndex, track: &TrackContact) -> [Vec3; 2] {
        let motion = self.magnet(state, k);
        let clearance = self.clearance_of(&motion, track.height[k.0], track.rate[k.0]);
        track.contact.force_slopes(clearance, slip(&motion, track))
    }

    /// The first magnet that is within `margin` (m) of touching or of leaving the rail: small motions
    /// about it are not linear.
    #[must_use]
    pub fn near_touch(
        &self,
        state: &State,
        track: &TrackContact,
        margin: f64,
    ) -> Option<MagnetIndex> {
        self.magnets().find(|&k| {
            let height = track.height[k.0];
            let clearance = self.clearance(&state.bodies, k.0, height, track.rate[k.0]);
            track.contact.at(clearance).any(|touch| touch.depth.abs() < margin)
        })
    }

    /// Energy and power of all contacts of a state.
    #[must_use]
    pub fn contact_power(&self, state: &State, track: &TrackContact) -> ContactPower {
        let mut sum = ContactPower::default();
        for k in self.magnets() {
            let motion = self.magnet(state, k);
            let (height, rate) = (track.height[k.0], track.rate[k.0]);
            let slip = slip(&motion, track);
            let force = track.contact.force(self.clearance_of(&motion, height, rate), slip);
            for touch in track.contact.at(self.clearance_of(&motion, height, rate)) {
                let depth = touch.depth.max(0.0);
                let spring = touch.law.stiffness * depth;
                sum.stored += 0.5 * spring * depth;
                sum.dissipated += (touch.normal() - spring) * touch.rate;
            }
            sum.dissipated -= force.x * slip[0] + force.y * slip[1];
            sum.supplied += force.z * rate - force.x * track.speed;
        }
        sum
    }

    /// Accelerations that a change of the track alone would cause through the contacts, beside those
    /// of additional loads: the derivative of [`VehicleModel::accelerations_in_contact`] in the
    /// direction of `forces`, `height` (m) and `rate` (m/s). Read it with
    /// [`VehicleModel::magnet_response`].
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`].
    pub fn load_response_in_contact<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        track: Option<(&TrackContact, &[f64], &[f64])>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        self.respond(state, &forces.into(), ws, |k| {
            let Some((track, height, rate)) = track else { return Vec3::zeros() };
            let [by_gap, by_rate] = self.contact_slopes(state, k, track);
            by_gap * height[k.0] + by_rate * rate[k.0]
        })
    }
}

/// Velocity at which a magnet slides along the rail, m/s.
fn slip(motion: &PointMotion, track: &TrackContact) -> [f64; 2] {
    [track.speed + motion.velocity.x, motion.velocity.y]
}
