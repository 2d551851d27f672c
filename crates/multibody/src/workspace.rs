//! Scratch memory of an evaluation, and what it remembers of the last one.

use std::sync::Arc;

use track_line::Meeting;

use crate::contact::{ContactScratch, TrackContact};
use crate::equilibrium::{Holding, Statics};
use crate::index::BodyIndex;
use crate::integrate::Course;
use crate::joint::JacobianRow;
use crate::loads::{AppliedCourse, AppliedForces, ExternalLoad};
use crate::math::{Quat, Vec3};
use crate::motors::MotorScratch;
use crate::rate::BodyRate;
use crate::state::{BodyState, Kinematics, Wrench};
use crate::way::{Travel, Way};

/// Scratch memory of one thread of evaluations. It never influences results: remembered factors are
/// used only for exactly the same pose, remembered accelerations only for exactly the same state
/// and loads.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// Kinematics of the bodies, the ground last.
    pub(crate) kin: Vec<Kinematics>,
    pub(crate) rows_a: Vec<JacobianRow>,
    pub(crate) rows_b: Vec<JacobianRow>,
    pub(crate) factors: Vec<f64>,
    /// Pose whose factors `factors` holds.
    pub(crate) factored: Option<()>,
    pub(crate) factored_pose: Vec<(Vec3, Quat)>,
    /// Whether `solution` is the solution for the factored pose, the motion in `kin` and the loads
    /// in `vertical` and `lateral` and the rail in `touch`.
    pub(crate) evaluated: bool,
    pub(crate) wrenches: Vec<Wrench>,
    /// Right-hand side, then accelerations (v̇, ω̇ by body) and multipliers.
    pub(crate) solution: Vec<f64>,
    /// The solution of the last stage that was factored.
    pub(crate) kept: Vec<f64>,
    /// As long as the solution, for differences of right-hand sides.
    pub(crate) spare: Vec<f64>,
    /// Second derivatives of the accelerations and multipliers, and memory for their computation.
    pub(crate) bend: Vec<f64>,
    pub(crate) sum_of_bends: Vec<f64>,
    /// Second derivative of the acceleration of the travelling frame, m/s⁴.
    pub(crate) frame_bend: f64,
    pub(crate) residual: Vec<f64>,
    pub(crate) stage: Vec<BodyState>,
    pub(crate) start: Vec<BodyState>,
    pub(crate) sum: Vec<BodyRate>,
    pub(crate) vertical: Vec<f64>,
    pub(crate) lateral: Vec<f64>,
    pub(crate) external: Vec<ExternalLoad>,
    /// Acceleration of the travelling frame, m/s².
    pub(crate) acceleration: f64,
    pub(crate) touch: ContactScratch,
    /// The travelling frame on a line, and the travel that it is of.
    pub(crate) way: Option<Way>,
    pub(crate) travel: Option<Travel>,
    /// Where the magnets meet the line, of the last forces; empty without a line.
    pub(crate) met: Vec<Option<Meeting>>,
    /// A point that has no place on the line.
    pub(crate) lost: Option<track_line::Error>,
    /// The last static problem, without its numbers.
    pub(crate) statics: Option<(Holding, Arc<Statics>)>,
    /// Feed and forces of the motors; none without motors.
    pub(crate) motors: Option<Box<MotorScratch>>,
}

/// Bitwise equality: 0 and −0 differ, because they can lead to different results.
fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

impl Workspace {
    /// Accelerations v̇ (world) and ω̇ (body axes) of a composite body after an evaluation.
    #[must_use]
    pub fn acceleration(&self, body: BodyIndex) -> (Vec3, Vec3) {
        let x = &self.solution[body.rows()];
        (Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], x[5]))
    }

    /// λ after an evaluation, joint by joint.
    #[must_use]
    pub fn multipliers(&self) -> &[f64] {
        &self.solution[6 * (self.kin.len() - 1)..]
    }

    /// Forgets the remembered factors and accelerations.
    pub(crate) fn forget(&mut self) {
        self.factored = None;
        self.evaluated = false;
    }

    /// Remembers that the factors are those of these poses.
    pub(crate) fn remember(&mut self, bodies: &[BodyState]) {
        for (pose, body) in self.factored_pose.iter_mut().zip(bodies) {
            *pose = (body.position, body.attitude);
        }
        self.factored = Some(());
    }

    /// Whether factors of exactly this pose are remembered.
    pub(crate) fn has_factors(&self, bodies: &[BodyState]) -> bool {
        self.factored.is_some()
            && bodies.iter().zip(&self.factored_pose).all(|(body, (r, p))| {
                same_bits(body.position.as_slice(), r.as_slice()) && same_bits(&body.attitude, p)
            })
    }

    /// Whether `kin` holds exactly these velocities.
    pub(crate) fn has_motion(&self, bodies: &[BodyState]) -> bool {
        bodies.iter().zip(&self.kin).all(|(body, kin)| {
            same_bits(body.velocity.as_slice(), kin.v.as_slice())
                && same_bits(body.angular_velocity.as_slice(), kin.w.as_slice())
        })
    }

    fn has_external(&self, external: &[ExternalLoad]) -> bool {
        if external.is_empty() {
            return self.external.as_flattened().iter().all(|u| *u == 0.0);
        }
        same_bits(external.as_flattened(), self.external.as_flattened())
    }

    /// Whether the accelerations at the start of a step are remembered: exactly this motion under exactly the loads
    /// with which the step begins. Only for vehicles whose forces follow from these alone.
    pub(crate) fn begins(&self, bodies: &[BodyState], course: &Course) -> bool {
        let AppliedCourse { magnets, external, acceleration, .. } = &course.forces;
        let same = |courses: &[[f64; 4]], values: &[f64]| {
            courses.iter().zip(values).all(|(u, value)| u[0].to_bits() == value.to_bits())
        };
        self.evaluated
            && course.track.is_none()
            && course.travel.is_none()
            && self.motors.is_none()
            && self.touch.same(None)
            && same(magnets.vertical, &self.vertical)
            && same(magnets.lateral, &self.lateral)
            && if external.is_empty() {
                self.has_external(&[])
            } else {
                same(external.as_flattened(), self.external.as_flattened())
            }
            && acceleration[0].to_bits() == self.acceleration.to_bits()
            && self.travel.is_none()
            && self.has_factors(bodies)
            && self.has_motion(bodies)
    }

    /// Whether accelerations of exactly this state under exactly these loads are remembered.
    pub(crate) fn has_solution(
        &self,
        bodies: &[BodyState],
        forces: &AppliedForces,
        track: Option<&TrackContact>,
        travel: Option<Travel>,
    ) -> bool {
        self.evaluated
            && self.touch.same(track)
            && self.has_factors(bodies)
            && same_bits(forces.magnets.vertical, &self.vertical)
            && same_bits(forces.magnets.lateral, &self.lateral)
            && self.has_external(forces.external)
            && forces.acceleration.to_bits() == self.acceleration.to_bits()
            && self.travel == travel
            && self.has_motion(bodies)
    }
}
