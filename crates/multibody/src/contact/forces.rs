//! Forces of stops and skids in an evaluation, their derivatives and their energy.

use super::law::Clearance;
use super::track::{RailPoint, TrackContact};
use crate::error::Error;
use crate::index::MagnetIndex;
use crate::loads::AppliedForces;
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::state::{BodyState, State};
use crate::way::Way;
use crate::workspace::Workspace;
use track_line::Meeting;

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
    /// Gap and rate of magnet k, and the velocity (x, y) at which it slides along the rail; NaN where it
    /// has left its line.
    pub(crate) fn at_rail(
        &self,
        bodies: &[BodyState],
        way: Option<&Way>,
        k: MagnetIndex,
        rail: &RailPoint,
    ) -> (Clearance, [f64; 2]) {
        let motion = self.magnet_motion(bodies, k);
        let Some((line, way)) = self.line.as_ref().zip(way) else {
            let (up, velocity) = (motion.displacement.z, motion.velocity);
            let slip = [rail.speed + velocity.x, velocity.y - rail.side_rate];
            return (self.clearance(rail, up, velocity.z), slip);
        };
        let Ok(meeting) = way.meet(line, &motion.position) else {
            return (Clearance { gap: f64::NAN, rate: f64::NAN }, [f64::NAN; 2]);
        };
        self.at_line(way, &meeting, k, &motion.velocity, rail)
    }

    /// As `at_rail`, for a magnet that meets its line.
    fn at_line(
        &self,
        way: &Way,
        meeting: &Meeting,
        k: MagnetIndex,
        velocity: &Vec3,
        rail: &RailPoint,
    ) -> (Clearance, [f64; 2]) {
        let velocity = way.velocity(meeting, velocity);
        let up = meeting.across.z - self.magnets[k].start.z;
        let clearance = self.clearance(rail, up, meeting.rates(&velocity).z);
        // the rail is at rest where the magnet passes it, but for its own motion
        (clearance, [velocity.x, velocity.y - rail.side_rate])
    }

    fn clearance(&self, rail: &RailPoint, up: f64, rate: f64) -> Clearance {
        Clearance { gap: self.nominal_gap + rail.height - up, rate: rail.rate - rate }
    }

    /// As `at_rail`, for a state.
    fn touching(
        &self,
        state: &State,
        k: MagnetIndex,
        track: &TrackContact,
    ) -> (Clearance, [f64; 2]) {
        self.at_rail(&state.bodies, self.way(state.travel).as_ref(), k, &track.at(k.0))
    }

    /// Adds the forces of stops and skids for the kinematics in the workspace.
    pub(crate) fn apply_contact(&self, ws: &mut Workspace) {
        let Workspace { kin, wrenches, touch, way, met, .. } = ws;
        let Some(contact) = touch.contact else { return };
        for (k, magnet) in self.magnets.iter().enumerate() {
            let body = &kin[magnet.body];
            let arm = body.turn(&magnet.local);
            let velocity = body.velocity_at(&arm);
            let rail = touch.rail(k);
            let meeting = way.as_ref().zip(met.get(k).and_then(Option::as_ref));
            let (clearance, slip) = match meeting {
                Some((way, meeting)) => {
                    self.at_line(way, meeting, MagnetIndex(k), &velocity, &rail)
                }
                None => {
                    let up = body.r.z + arm.z - magnet.start.z;
                    let slip = [rail.speed + velocity.x, velocity.y - rail.side_rate];
                    (self.clearance(&rail, up, velocity.z), slip)
                }
            };
            let force = contact.force(clearance, slip);
            touch.force[k] = force;
            touch.push[k] = touch.push[k].max(force.z.abs());
            if force != Vec3::zeros() {
                let force = meeting.map_or(force, |(way, meeting)| way.outward(meeting, &force));
                wrenches[magnet.body].add(&force, &arm);
            }
        }
    }

    /// Force of stop and skid on magnet k: along the track, to the left and up, on a line in its axes, N.
    #[must_use]
    pub fn contact_force(&self, state: &State, k: MagnetIndex, track: &TrackContact) -> Vec3 {
        let (clearance, slip) = self.touching(state, k, track);
        track.contact.force(clearance, slip)
    }

    /// Change of [`VehicleModel::contact_force`] with the gap (N/m) and with its rate (N·s/m).
    #[must_use]
    pub fn contact_slopes(&self, state: &State, k: MagnetIndex, track: &TrackContact) -> [Vec3; 2] {
        let (clearance, slip) = self.touching(state, k, track);
        track.contact.force_slopes(clearance, slip)
    }

    /// Change of [`VehicleModel::contact_force`] with the rate of the rail's lateral displacement, N·s/m.
    #[must_use]
    pub fn contact_side_slope(&self, state: &State, k: MagnetIndex, track: &TrackContact) -> Vec3 {
        let (clearance, slip) = self.touching(state, k, track);
        -track.contact.force_by_side_slip(clearance, slip)
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
            let (clearance, _) = self.touching(state, k, track);
            track.contact.at(clearance).any(|touch| touch.depth.abs() < margin)
        })
    }

    /// Energy and power of all contacts of a state.
    #[must_use]
    pub fn contact_power(&self, state: &State, track: &TrackContact) -> ContactPower {
        let mut sum = ContactPower::default();
        for k in self.magnets() {
            let rail = track.at(k.0);
            let (clearance, slip) = self.touching(state, k, track);
            let force = track.contact.force(clearance, slip);
            for touch in track.contact.at(clearance) {
                let depth = touch.depth.max(0.0);
                let spring = touch.law.stiffness * depth;
                sum.stored += 0.5 * spring * depth;
                sum.dissipated += (touch.normal() - spring) * touch.rate;
            }
            sum.dissipated -= force.x * slip[0] + force.y * slip[1];
            sum.supplied += force.z * rail.rate + force.y * rail.side_rate - force.x * rail.speed;
        }
        sum
    }

    /// Accelerations that a change of the track alone would cause through the contacts, beside those
    /// of additional loads: the derivative of [`VehicleModel::accelerations_in_contact`] in the
    /// direction of `forces` and of the track's height (m), its rate and the rail's lateral rate (m/s). Read it with
    /// [`VehicleModel::magnet_response`].
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`].
    pub fn load_response_in_contact<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        track: Option<(&TrackContact, [&[f64]; 3])>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        self.respond(state, &forces.into(), ws, |k| {
            let Some((track, [height, rate, side_rate])) = track else { return Vec3::zeros() };
            let [by_gap, by_rate] = self.contact_slopes(state, k, track);
            let mut force = by_gap * height[k.0] + by_rate * rate[k.0];
            if side_rate[k.0] != 0.0 {
                force += self.contact_side_slope(state, k, track) * side_rate[k.0];
            }
            force
        })
    }
}
