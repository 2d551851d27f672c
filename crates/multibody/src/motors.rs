//! Linear induction motors on the vehicle's bodies: their feed, and their forces.
//!
//! A motor acts at the middle of its primary's face: its thrust along the track, its normal force up or down. With
//! the clearance g of its data in the nominal place, the displacement z of that point and the track's height h
//! there, the gap is g + z − h: it opens as the motor rises. The speed is that of the point. All motors have the
//! same feed, as from one inverter. A control that is asked for a thrust knows the speed of the travelling frame
//! and the nominal gap; what each motor gives follows from its own speed and gap.

use linear_motor::{Feed, Forces, Motor, MotorDescription};

use crate::anchor::Anchor;
use crate::error::Error;
use crate::groups::matching;
use crate::index::ComponentIndex;
use crate::loads::polynomial;
use crate::math::{Vec3, rotation_matrix};
use crate::model::VehicleModel;
use crate::observe::PointMotion;
use crate::state::State;
use crate::workspace::Workspace;

/// The motors of a vehicle.
#[derive(Debug, Clone)]
pub(crate) struct Motors {
    law: Motor,
    points: Vec<Anchor>,
}

/// How the motors are fed, over a step: polynomials in the time τ since its start, u + u' τ + u'' τ²/2 + u''' τ³/6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotorControl {
    /// For a thrust: in addition to the mass of the vehicle times the acceleration of the travelling frame.
    Thrust {
        /// Thrust of all motors together, N.
        wanted: [f64; 4],
        /// Slip frequency, Hz.
        slip_frequency: f64,
        /// Largest current, A.
        max_current: f64,
    },
    /// With a current and a frequency; thrust follows.
    Fed {
        /// Current, r.m.s. of a phase, A.
        current: [f64; 4],
        /// Frequency, Hz.
        frequency: [f64; 4],
    },
}

/// What the motors need from outside over a step.
#[derive(Debug, Clone, Copy)]
pub struct MotorCourse<'a> {
    /// The feed.
    pub control: MotorControl,
    /// Speed of the travelling frame, m/s; a polynomial as in [`MotorControl`].
    pub speed: [f64; 4],
    /// Height of the track at each motor, m, up positive; polynomials.
    pub height: &'a [[f64; 4]],
}

/// A motor in the last evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotorState {
    /// Clearance, m.
    pub gap: f64,
    /// Speed along the track, m/s.
    pub speed: f64,
    /// Forces on the vehicle, N.
    pub forces: Forces,
}

/// Feed and forces of the motors in a workspace.
#[derive(Debug, Clone)]
pub(crate) struct MotorScratch {
    /// None: not fed.
    control: Option<MotorControl>,
    speed: [f64; 4],
    height: Vec<[f64; 4]>,
    /// Time since the start of the polynomials, s, and speed of the frame and feed there.
    time: f64,
    frame_speed: f64,
    feed: Feed,
    motors: Vec<MotorState>,
    lost: Option<(usize, linear_motor::Error)>,
}

impl VehicleModel {
    /// The vehicle with motors on the bodies that a motor file names. Then they give the force that the acceleration
    /// of the travelling frame needs, and the magnets do not.
    ///
    /// # Errors
    /// [`Error::Motors`] for a body that the vehicle does not have or that is fixed to the ground, and for faults of
    /// the description.
    pub fn with_motors(mut self, description: &MotorDescription) -> Result<Self, Error> {
        let law = Motor::new(description).map_err(|e| Error::Motors(e.to_string()))?;
        let names = self.members.iter().map(|member| member.name.as_str());
        let found =
            matching(&description.bodies, names, "bodies", "body of the vehicle").map_err(|e| {
                match e {
                    Error::Invalid { path, message } => {
                        Error::Motors(format!("`{path}`: {message}"))
                    }
                    other => other,
                }
            })?;
        let mut points = Vec::with_capacity(found.len());
        for k in found {
            let member = &self.members[k];
            let start = member.start + Vec3::from(description.offset);
            let Some(composite) = self.composites.get(member.composite.0) else {
                return Err(Error::Motors(format!(
                    "`{}` is fixed to the ground, so a motor there has no effect",
                    member.name
                )));
            };
            let local = rotation_matrix(composite.start.attitude)
                .tr_mul(&(start - composite.start.position));
            points.push(Anchor { body: member.composite, local, start });
        }
        self.motors = Some(Motors { law, points });
        Ok(self)
    }

    /// Number of motors; 0 without a motor file.
    #[must_use]
    pub fn motor_count(&self) -> usize {
        self.motors.as_ref().map_or(0, |motors| motors.points.len())
    }

    /// Group of jointed bodies that carries motor k.
    #[must_use]
    pub fn motor_component(&self, k: usize) -> Option<ComponentIndex> {
        let point = self.motors.as_ref()?.points.get(k)?;
        self.components.get(point.body.0).copied()
    }

    /// Motion of the middle of motor k's face; `None` without that motor.
    #[must_use]
    pub fn motor_motion(&self, state: &State, k: usize) -> Option<PointMotion> {
        let point = self.motors.as_ref()?.points.get(k)?;
        Some(self.anchor_motion(state, point))
    }

    /// Electrical power of all motors in the last evaluation, W; `None` without motors, or with a table of forces,
    /// which has no losses.
    #[must_use]
    pub fn motor_power(&self, ws: &Workspace) -> Option<f64> {
        let (motors, scratch) = self.motors.as_ref().zip(ws.motors.as_ref())?;
        let power = |it: &MotorState| motors.law.input_power(scratch.feed, it.speed, it.gap);
        scratch.motors.iter().map(power).sum()
    }

    pub(crate) fn motor_scratch(&self) -> Option<Box<MotorScratch>> {
        self.motors.as_ref().map(|motors| {
            let count = motors.points.len();
            Box::new(MotorScratch {
                control: None,
                speed: [0.0; 4],
                height: vec![[0.0; 4]; count],
                time: 0.0,
                frame_speed: 0.0,
                feed: Feed::default(),
                motors: vec![MotorState::default(); count],
                lost: None,
            })
        })
    }

    /// Sets the feed for an instant: the time t after the start of the polynomials, and the acceleration of the frame
    /// in the workspace.
    pub(crate) fn feed_motors(&self, t: f64, ws: &mut Workspace) {
        let Some((motors, scratch)) = self.motors.as_ref().zip(ws.motors.as_mut()) else { return };
        let Some(control) = &scratch.control else { return };
        scratch.time = t;
        scratch.frame_speed = polynomial(&scratch.speed, t);
        scratch.lost = None;
        match control {
            MotorControl::Fed { current, frequency } => {
                scratch.feed =
                    Feed { current: polynomial(current, t), frequency: polynomial(frequency, t) };
            }
            MotorControl::Thrust { wanted, slip_frequency, max_current } => {
                let all = polynomial(wanted, t) + self.moved_mass() * ws.acceleration;
                let each = all / motors.points.len() as f64;
                let limits = [*slip_frequency, *max_current];
                match motors.law.feed_for(each, scratch.frame_speed, limits) {
                    Ok(feed) => scratch.feed = feed,
                    Err(error) => scratch.lost = Some((0, error)),
                }
            }
        }
    }

    /// Adds the forces of the motors for the kinematics in the workspace.
    pub(crate) fn apply_motors(&self, ws: &mut Workspace) {
        let Workspace { kin, wrenches, way, lost: off, motors: scratch, .. } = ws;
        let Some((motors, scratch)) = self.motors.as_ref().zip(scratch.as_mut()) else { return };
        if scratch.control.is_none() {
            return;
        }
        let on_line = self.line.as_ref().zip(way.as_ref());
        for (k, point) in motors.points.iter().enumerate() {
            let body = &kin[point.body];
            let arm = body.turn(&point.local);
            let (place, velocity) = (body.r + arm, body.velocity_at(&arm));
            let mut up = place.z;
            let mut speed = scratch.frame_speed + velocity.x;
            let mut meeting = None;
            if let Some((line, way)) = on_line {
                match way.meet(line, &place) {
                    Ok(met) => {
                        up = met.across.z;
                        speed = met.rates(&way.velocity(&met, &velocity)).x;
                        meeting = Some((way, met));
                    }
                    Err(error) => {
                        *off = Some(error);
                        continue;
                    }
                }
            }
            let height = polynomial(&scratch.height[k], scratch.time);
            let gap = motors.law.nominal_gap() + (up - point.start.z) - height;
            let forces = match motors.law.forces(scratch.feed, speed, gap) {
                Ok(forces) => forces,
                Err(error) => {
                    scratch.lost.get_or_insert((k, error));
                    continue;
                }
            };
            scratch.motors[k] = MotorState { gap, speed, forces };
            if forces == Forces::default() {
                continue;
            }
            let mut force = Vec3::new(forces.thrust, 0.0, -forces.normal);
            if let Some((way, meeting)) = &meeting {
                force = way.outward(meeting, &force);
            }
            wrenches[point.body].add(&force, &arm);
        }
    }
}

impl Workspace {
    /// Feeds the motors from now on; `None` ends it. Without motors this does nothing.
    ///
    /// # Errors
    /// [`Error::Argument`] for another number of heights than motors.
    pub fn supply(&mut self, course: Option<&MotorCourse>) -> Result<(), Error> {
        let Some(scratch) = self.motors.as_mut() else { return Ok(()) };
        let Some(course) = course else {
            self.evaluated &= scratch.control.is_none();
            scratch.control = None;
            scratch.feed = Feed::default();
            scratch.motors.fill(MotorState::default());
            return Ok(());
        };
        if course.height.len() != scratch.height.len() {
            return Err(Error::Argument {
                what: "heights of the track at the motors",
                expected: scratch.height.len().to_string(),
                found: course.height.len().to_string(),
            });
        }
        // what is remembered of an evaluation belongs to its feed
        self.evaluated &= scratch.time == 0.0
            && scratch.control == Some(course.control)
            && scratch.speed == course.speed
            && scratch.height == course.height;
        scratch.control = Some(course.control);
        scratch.speed = course.speed;
        scratch.height.copy_from_slice(course.height);
        Ok(())
    }

    /// The motors in the last evaluation; empty without motors.
    #[must_use]
    pub fn motors(&self) -> &[MotorState] {
        self.motors.as_ref().map_or(&[], |scratch| &scratch.motors)
    }

    /// The motors' feed in the last evaluation.
    #[must_use]
    pub fn feed(&self) -> Feed {
        self.motors.as_ref().map_or(Feed::default(), |scratch| scratch.feed)
    }
}

/// Refuses an evaluation in which a motor could not work.
pub(crate) fn check_motors(time: f64, ws: &mut Workspace) -> Result<(), Error> {
    let Some(scratch) = ws.motors.as_mut() else { return Ok(()) };
    let Some((k, cause)) = scratch.lost.take() else { return Ok(()) };
    ws.forget();
    Err(Error::Motor { time, number: k + 1, cause })
}
