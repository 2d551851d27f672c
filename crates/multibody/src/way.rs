//! The vehicle on a curved line: the frame that travels along it, and what the line turns.
//!
//! With a [`Line`], the world frame of all equations is the line's frame at the place s₀(t) of the
//! travelling frame: origin p(s₀), axes R(s₀), which turn with ω = v·κ(s₀). Velocities of bodies are the
//! absolute ones in these axes, less v along the track: w = u − v·e_x; angular velocities are absolute
//! too. So joints, elements and mass matrix are those of a straight track, and what the turning frame
//! adds is exact, without its angular acceleration:
//!
//! ṙ = w − ω × r,  ẇ = B − ω × (w + v·e_x),  ṗ = ½·p ⊗ (0, ω_b) − ½·(0, ω) ⊗ p,
//!
//! with B = A − v̇·e_x, the absolute acceleration as eq. 9 gives it. An ω that jumps, as at the end of a
//! linear cant ramp, changes no velocity. Coordinates stay those of a train's length, however far along
//! the line. Magnets, motors, drive and wind act in the axes of the line at their own places. On a straight,
//! level line all of this is nothing.

use serde::{Deserialize, Serialize};
use track_line::{Frame, Line, Meeting};

use crate::anchor::Anchor;
use crate::error::Error;
use crate::index::MagnetIndex;
use crate::loads::polynomial;
use crate::math::{Quat, Vec3, from_rotation_matrix, multiply};
use crate::model::VehicleModel;
use crate::observe::PointMotion;
use crate::rate::BodyRate;
use crate::state::{BodyState, Kinematics, State};
use crate::workspace::Workspace;

/// Where the travelling frame is on its line, and how fast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Travel {
    /// Position along the track, m.
    pub place: f64,
    /// Speed along the track, m/s.
    pub speed: f64,
}

impl Travel {
    /// The travel after the time t under an acceleration that is a polynomial a + a' τ + a'' τ²/2 + …
    pub(crate) fn after(&self, acceleration: &[f64; 4], t: f64) -> Self {
        let [a, j, s, c] = *acceleration;
        let v = self.speed;
        let half = 0.5 * t;
        Self {
            place: self.place + t * (v + half * (a + t / 3.0 * (j + 0.25 * t * (s + 0.2 * t * c)))),
            speed: polynomial(&[v, a, j, s], t) + c * t * t * t * t / 24.0,
        }
    }
}

/// The travelling frame at an instant: the line's frame, fixed, from which the origin is `shift` ahead.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    pub frame: Frame,
    /// Metres that the origin has moved along the frame's first axis; 0 but for differences in time.
    pub shift: f64,
    /// Speed of the origin, m/s.
    pub speed: f64,
}

impl Way {
    /// ω of the travelling frame, rad/s.
    pub fn turning(&self) -> Vec3 {
        self.frame.curvature * self.speed
    }

    /// Where a point of the travelling frame meets the line.
    pub fn meet(&self, line: &Line, point: &Vec3) -> Result<Meeting, track_line::Error> {
        let offset = Vec3::new(point.x + self.shift, point.y, point.z);
        line.meet(&self.frame, &offset, self.frame.s + offset.x)
    }

    /// A vector of the travelling frame in the axes of a meeting.
    pub fn inward(&self, meeting: &Meeting, vector: &Vec3) -> Vec3 {
        meeting.frame.axes.tr_mul(&(self.frame.axes * vector))
    }

    /// A vector in the axes of a meeting in those of the travelling frame.
    pub fn outward(&self, meeting: &Meeting, vector: &Vec3) -> Vec3 {
        self.frame.axes.tr_mul(&(meeting.frame.axes * vector))
    }

    /// Absolute velocity, in the axes of a meeting.
    pub fn velocity(&self, meeting: &Meeting, relative: &Vec3) -> Vec3 {
        self.inward(meeting, &(relative + Vec3::new(self.speed, 0.0, 0.0)))
    }

    /// Motion of a point relative to its place in the description, along and across the line.
    fn motion(&self, line: &Line, anchor: &Anchor, r: &Vec3, v: &Vec3) -> Option<PointMotion> {
        let meeting = self.meet(line, r).ok()?;
        let along = meeting.frame.s - self.frame.s - self.shift;
        let position = Vec3::new(along, meeting.across.y, meeting.across.z);
        let rates = meeting.rates(&self.velocity(&meeting, v));
        let velocity = Vec3::new(rates.x - self.speed, rates.y, rates.z);
        Some(PointMotion { displacement: position - anchor.start, velocity, position })
    }
}

/// What forces need of a line.
pub(crate) struct OnLine<'a> {
    pub way: Option<&'a Way>,
    /// Where the magnets meet the line.
    pub met: &'a mut Vec<Option<Meeting>>,
    pub lost: &'a mut Option<track_line::Error>,
}

impl BodyRate {
    /// Adds what the turning of the travelling frame changes.
    pub(crate) fn turn(&mut self, body: &BodyState, way: &Way) {
        let w = way.turning();
        if w == Vec3::zeros() {
            return;
        }
        let carried = body.velocity + Vec3::new(way.speed, 0.0, 0.0);
        let spun: Quat = multiply([0.0, -0.5 * w.x, -0.5 * w.y, -0.5 * w.z], body.attitude);
        self.shift(&-w.cross(&body.position), &spun, &-w.cross(&carried));
    }
}

impl VehicleModel {
    /// Puts the vehicle on a line. Its states then need a [`State::travel`]. A line that is straight, level
    /// and without cant changes nothing, to the last bit.
    ///
    /// # Errors
    /// [`Error::Line`] for a vehicle with joints or elements to the ground, which does not turn with the line.
    pub fn with_line(mut self, line: Line) -> Result<Self, Error> {
        let [start, end] = line.extent();
        if line.is_plain(start, end) {
            return Ok(self);
        }
        let ground = self.ground();
        let held = self
            .joints
            .iter()
            .map(|it| (it.a, it.b, &it.name))
            .find(|(a, b, _)| *a == ground || *b == ground)
            .map(|(_, _, name)| format!("the joint `{name}`"))
            .or_else(|| {
                let bushings = self.bushings.iter().map(|it| (it.a, it.b));
                let mut pairs = bushings.chain(self.springs.iter().map(|it| (it.a, it.b)));
                pairs
                    .any(|(a, b)| a == ground || b == ground)
                    .then(|| "a bushing or a spring".to_owned())
            });
        if let Some(held) = held {
            return Err(Error::Line(format!(
                "{held} ties the vehicle to the ground, which does not follow the line; use a vehicle that \
                 its magnets and its drive alone hold"
            )));
        }
        self.line = Some(line);
        Ok(self)
    }

    /// The line that the vehicle travels along.
    #[must_use]
    pub fn line(&self) -> Option<&Line> {
        self.line.as_ref()
    }

    /// The travelling frame, on a line.
    pub(crate) fn way(&self, travel: Option<Travel>) -> Option<Way> {
        let (line, travel) = (self.line.as_ref()?, travel?);
        Some(Way { frame: line.frame(travel.place), shift: 0.0, speed: travel.speed })
    }

    /// Whether a state is on a line whose curves count, and why what is asked for is not known there.
    pub(crate) fn refuse_line(&self, state: &State, what: &str) -> Result<(), Error> {
        if self.line.is_none() || state.travel.is_none() {
            return Ok(());
        }
        Err(Error::Line(format!("{what} along a line is not supported")))
    }

    /// Second derivatives (m/s²) of the coordinates of magnet k across the line, less its inertial
    /// acceleration in the line's axes, after an evaluation: what the turning axes add. 0 on a straight track.
    #[must_use]
    pub fn magnet_apparent(&self, state: &State, ws: &Workspace, k: MagnetIndex) -> Vec3 {
        let Some((way, meeting)) = self.met(ws, k) else { return Vec3::zeros() };
        let anchor = &self.magnets[k];
        let velocity = crate::observe::point_motion(&state.bodies[anchor.body.0], anchor).velocity;
        let inertial = self.magnet_acceleration(ws, k);
        meeting.accelerations(&way.velocity(&meeting, &velocity), &inertial) - inertial
    }

    /// Motion of a point of a body, along and across the line; NaN where it has left the line.
    pub(crate) fn motion_on_line(
        &self,
        state: &State,
        anchor: &Anchor,
        motion: PointMotion,
    ) -> PointMotion {
        let Some((line, way)) = self.line.as_ref().zip(self.way(state.travel)) else {
            return motion;
        };
        let lost = Vec3::repeat(f64::NAN);
        way.motion(line, anchor, &motion.position, &motion.velocity).unwrap_or(PointMotion {
            displacement: lost,
            velocity: lost,
            position: lost,
        })
    }

    /// A vector of the travelling frame in the line's axes at a point of a body.
    pub(crate) fn in_line_axes(&self, ws: &Workspace, anchor: &Anchor, vector: Vec3) -> Vec3 {
        let Some((line, way)) = self.line.as_ref().zip(ws.way) else { return vector };
        let kin = &ws.kin[anchor.body];
        let point = kin.r + kin.turn(&anchor.local);
        way.meet(line, &point).map_or(Vec3::repeat(f64::NAN), |it| way.inward(&it, &vector))
    }

    /// Rate (m/s³) of the inertial acceleration of a magnet in the line's axes, which turn, from the rate
    /// in the travelling frame's.
    pub(crate) fn jerk_on_line(&self, ws: &Workspace, k: MagnetIndex, jerk: Vec3) -> Vec3 {
        let Some((way, meeting)) = self.met(ws, k) else { return jerk };
        let anchor = &self.magnets[k];
        let kin = &ws.kin[anchor.body];
        let velocity = way.velocity(&meeting, &kin.velocity_at(&kin.turn(&anchor.local)));
        let turning = meeting.frame.curvature * meeting.rates(&velocity).x;
        let acceleration = way.inward(&meeting, &self.anchor_acceleration(ws, anchor));
        way.inward(&meeting, &jerk) - turning.cross(&acceleration)
    }

    /// A vector of the travelling frame in the line's axes at a magnet.
    pub(crate) fn in_axes_at_magnet(&self, ws: &Workspace, k: MagnetIndex, vector: Vec3) -> Vec3 {
        self.met(ws, k).map_or(vector, |(way, meeting)| way.inward(&meeting, &vector))
    }

    /// Attitude relative to the line's axes at a point.
    pub(crate) fn attitude_on_line(&self, state: &State, anchor: &Anchor, attitude: Quat) -> Quat {
        let Some((line, way)) = self.line.as_ref().zip(self.way(state.travel)) else {
            return attitude;
        };
        let Some(body) = state.bodies.get(anchor.body.0) else { return attitude };
        let position = crate::observe::point_motion(body, anchor).position;
        let Ok(meeting) = way.meet(line, &position) else { return [f64::NAN; 4] };
        let turn = meeting.frame.axes.tr_mul(&way.frame.axes);
        multiply(from_rotation_matrix(&turn), attitude)
    }

    /// Finds where the magnets meet the line.
    pub(crate) fn meet_line(&self, kin: &[Kinematics], on_line: &mut OnLine) {
        let Some((line, way)) = self.line.as_ref().zip(on_line.way) else { return };
        for (magnet, met) in self.magnets.iter().zip(on_line.met.iter_mut()) {
            let body = &kin[magnet.body];
            *met = match way.meet(line, &(body.r + body.turn(&magnet.local))) {
                Ok(meeting) => Some(meeting),
                Err(error) => {
                    *on_line.lost = Some(error);
                    None
                }
            };
        }
    }

    /// Where a magnet meets the line, of the last evaluation.
    fn met(&self, ws: &Workspace, k: MagnetIndex) -> Option<(Way, Meeting)> {
        ws.way.zip(ws.met.get(k.0).copied().flatten())
    }

    /// Forces (N, along, left, up) at a point of a body, in the line's axes there.
    pub(crate) fn turned(
        &self,
        way: &Way,
        kin: &Kinematics,
        local: &Vec3,
        force: &Vec3,
        lost: &mut Option<track_line::Error>,
    ) -> Vec3 {
        let Some(line) = &self.line else { return *force };
        match way.meet(line, &(kin.r + kin.turn(local))) {
            Ok(meeting) => way.outward(&meeting, force),
            Err(error) => {
                *lost = Some(error);
                *force
            }
        }
    }

    /// Way along the line and rate of a driven point, relative to the travelling frame, and the direction
    /// of the drive's force.
    pub(crate) fn driven(
        &self,
        way: &Way,
        anchor: &Anchor,
        kin: &Kinematics,
        lost: &mut Option<track_line::Error>,
    ) -> (f64, f64, Vec3) {
        let arm = kin.turn(&anchor.local);
        let Some(line) = &self.line else { return (0.0, 0.0, Vec3::x()) };
        match way.meet(line, &(kin.r + arm)) {
            Ok(meeting) => {
                let along = meeting.frame.s - way.frame.s - way.shift - anchor.start.x;
                let velocity = way.velocity(&meeting, &kin.velocity_at(&arm));
                let rate = meeting.rates(&velocity).x - way.speed;
                (along, rate, way.outward(&meeting, &Vec3::x()))
            }
            Err(error) => {
                *lost = Some(error);
                (0.0, 0.0, Vec3::x())
            }
        }
    }
}
