//! Time integration: the classical fourth-order Runge-Kutta scheme on (r, p, v, ω) with the
//! accelerations of eq. 9, followed by a projection on the constraints (eqs 10, 11).
//!
//! Equation 9 enforces the constraints only on the level of accelerations, so positions and
//! velocities would drift. After every internal step the pose is corrected by simplified Newton
//! steps M δ + Φ_qᵀ μ = 0, Φ_q δ = −Φ and then the velocities by the same with −Φ_q v, both with
//! the factors of the last stage, whose pose differs from the corrected one by O(h²) of a step:
//! each correction gains several digits. Where it does not, the matrix is factored again. So the
//! violation stays below the tolerances after every step and does not accumulate.
//!
//! In long internal steps, stages may keep the factors of an earlier stage: see `kept`.

use crate::contact::TrackCourse;
use crate::error::Error;
use crate::index::{BodyIndex, JointIndex};
use crate::loads::{AppliedCourse, polynomial};
use crate::math::{Vec3, normalised};
use crate::model::VehicleModel;
use crate::rate::BodyRate;
use crate::state::{BodyState, State};
use crate::way::Travel;
use crate::workspace::Workspace;

/// Largest number of corrections.
const MOST_CORRECTIONS: usize = 12;
/// A correction that leaves more than this fraction of the violation triggers a new factorisation.
const SLOW: f64 = 0.1;
/// Fraction of the tolerance at which corrections end. Near singular positions the remaining
/// violation is amplified, so corrections continue towards rounding as long as they help.
const AIM: f64 = 0.01;

/// What acts on the vehicle over a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course<'a> {
    pub forces: AppliedCourse<'a>,
    /// The rail, where magnets may touch it.
    pub track: Option<TrackCourse<'a>>,
    /// The travel at the start of the step, on a line.
    pub travel: Option<Travel>,
}

/// An internal step: the time at which the step began, and its own start and size (s).
#[derive(Debug, Clone, Copy)]
pub(crate) struct InternalStep {
    pub begin: f64,
    pub offset: f64,
    pub h: f64,
}

/// Whether corrections may end: below the target, or within the tolerance once rounding stops
/// progress or no correction is left.
fn closed(violation: f64, before: f64, tolerance: f64, iteration: usize) -> bool {
    let at_an_end = violation > 0.5 * before || iteration >= MOST_CORRECTIONS;
    violation <= AIM * tolerance || (violation <= tolerance && at_an_end)
}

impl VehicleModel {
    /// Advances a state by `size` seconds in equal internal steps of at most `max_step`.
    ///
    /// # Errors
    /// [`Error::Singular`], [`Error::NotFinite`], [`Error::Projection`] or [`Error::Argument`]; the
    /// state is then not usable.
    pub fn step<'a>(
        &self,
        state: &mut State,
        size: f64,
        max_step: f64,
        forces: impl Into<AppliedCourse<'a>>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        let forces = forces.into();
        self.check_course(state, &forces)?;
        ws.touch.set(None);
        let course = Course { forces, track: None, travel: state.travel };
        let count = internal_steps(size, max_step)?;
        let h = size / f64::from(count);
        let begin = state.time;
        for n in 0..count {
            // counted, not accumulated
            let offset = f64::from(n) * h;
            self.runge_kutta(&mut state.bodies, &InternalStep { begin, offset, h }, &course, ws)?;
            let end = if n + 1 == count { begin + size } else { begin + f64::from(n + 1) * h };
            self.project(&mut state.bodies, end, ws)?;
            state.time = end;
        }
        state.travel = state.travel.map(|it| it.after(&forces.acceleration, size));
        Ok(())
    }

    pub(crate) fn check_course(&self, state: &State, forces: &AppliedCourse) -> Result<(), Error> {
        let AppliedCourse { magnets, external, .. } = forces;
        self.check_lengths(state, [magnets.vertical.len(), magnets.lateral.len(), external.len()])
    }

    pub(crate) fn runge_kutta(
        &self,
        bodies: &mut [BodyState],
        step: &InternalStep,
        course: &Course,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        let InternalStep { begin, offset, h } = *step;
        let stages = self.scheme.stages();
        let keeps = h > self.keeps_above;
        ws.start.copy_from_slice(bodies);
        // taken out so that the evaluation may borrow the workspace; returned below
        let mut stage = std::mem::take(&mut ws.stage);
        stage.copy_from_slice(bodies);
        let mut outcome = Ok(());
        for (s, &(node, weight)) in stages.iter().enumerate() {
            let t = offset + node * h;
            // the outputs at the end of the last step often are those of the first stage
            if !(s == 0 && offset == 0.0 && ws.begins(&stage, course)) {
                self.follow_course(course, t, ws);
                outcome = if keeps && s > 0 && ws.is_beside(&stage) {
                    self.evaluate_beside(&stage, begin + t, ws)
                } else {
                    self.evaluate(&stage, begin + t, ws)
                };
                if outcome.is_err() {
                    break;
                }
            }
            if keeps && ws.evaluated {
                ws.keep();
            }
            let ahead = stages.get(s + 1).map_or(0.0, |(next, _)| next * h);
            for (k, body) in stage.iter_mut().enumerate() {
                let (v, w) = ws.acceleration(BodyIndex(k));
                let mut rate = BodyRate::of(body, v, w);
                if let Some(way) = &ws.way {
                    rate.turn(body, way);
                }
                if s == 0 {
                    ws.sum[k] = BodyRate::zero();
                }
                ws.sum[k].add(&rate, weight);
                *body = ws.start[k].moved(&rate, ahead);
            }
        }
        ws.stage = stage;
        outcome?;
        for ((body, start), sum) in bodies.iter_mut().zip(&ws.start).zip(&ws.sum) {
            *body = start.moved(sum, h);
            body.attitude = normalised(body.attitude);
        }
        Ok(())
    }

    /// Loads, rail and frame at a time after the start of the step.
    fn follow_course(&self, course: &Course, t: f64, ws: &mut Workspace) {
        let AppliedCourse { magnets, further, external, acceleration } = &course.forces;
        for k in 0..self.magnets.len() {
            ws.vertical[k] = polynomial(&magnets.vertical[k], t);
            ws.lateral[k] = polynomial(&magnets.lateral[k], t);
        }
        further.add(&mut ws.vertical, &mut ws.lateral, t);
        ws.acceleration = polynomial(acceleration, t);
        self.feed_motors(t, ws);
        self.follow_line(course.travel.map(|travel| travel.after(acceleration, t)), ws);
        if external.is_empty() {
            ws.external.fill([0.0; 6]);
        }
        for (load, course) in ws.external.iter_mut().zip(*external) {
            *load = course.map(|component| polynomial(&component, t));
        }
        if let Some(track) = &course.track {
            ws.touch.follow(track, t);
        }
    }

    /// Closes the joints in position and velocity, with the factors that the workspace holds.
    pub(crate) fn project(
        &self,
        bodies: &mut [BodyState],
        time: f64,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        // kinematics and Jacobians in the workspace will no longer match its factors
        ws.forget();
        self.set_pose(bodies, ws);
        let mut fresh = false;
        let mut before = f64::INFINITY;
        for iteration in 0.. {
            let (violation, joint) = self.residuals(ws);
            if closed(violation, before, self.tolerances.position, iteration) {
                break;
            }
            self.give_up(iteration, violation, joint, time)?;
            if violation > SLOW * before && !fresh {
                self.factor(time, ws)?;
                fresh = true;
            }
            before = violation;
            self.correction(ws);
            for (body, delta) in bodies.iter_mut().zip(ws.solution.chunks_exact(6)) {
                body.displace(delta);
            }
            self.set_pose(bodies, ws);
        }
        before = f64::INFINITY;
        fresh = false;
        for iteration in 0.. {
            self.set_motion(bodies, ws);
            let (violation, joint) = self.rates(ws);
            if closed(violation, before, self.tolerances.velocity, iteration) {
                break;
            }
            self.give_up(iteration, violation, joint, time)?;
            if violation > SLOW * before && !fresh {
                self.factor(time, ws)?;
                fresh = true;
            }
            before = violation;
            self.correction(ws);
            for (body, delta) in bodies.iter_mut().zip(ws.solution.chunks_exact(6)) {
                body.velocity += Vec3::new(delta[0], delta[1], delta[2]);
                body.angular_velocity += Vec3::new(delta[3], delta[4], delta[5]);
            }
        }
        Ok(())
    }

    /// Closes the joints of a state that is nearly consistent, for example one made by hand.
    ///
    /// # Errors
    /// [`Error::Singular`] or [`Error::Projection`].
    pub fn close_joints(&self, state: &mut State, ws: &mut Workspace) -> Result<(), Error> {
        self.prepare(&state.bodies, state.time, ws)?;
        let time = state.time;
        self.project(&mut state.bodies, time, ws)
    }

    fn give_up(
        &self,
        iterations: usize,
        residual: f64,
        joint: JointIndex,
        time: f64,
    ) -> Result<(), Error> {
        if iterations < MOST_CORRECTIONS && residual.is_finite() {
            return Ok(());
        }
        let joint = self.joints[joint].name.clone();
        Err(Error::Projection { time, joint, residual, iterations })
    }

    /// Solves for the smallest change (in the metric of M) that cancels `ws.residual`.
    fn correction(&self, ws: &mut Workspace) {
        let Workspace { solution, residual, factors, .. } = ws;
        let (bodies, joints) = solution.split_at_mut(6 * self.composites.len());
        bodies.fill(0.0);
        for (target, value) in joints.iter_mut().zip(&*residual) {
            *target = -value;
        }
        self.solver.solve(factors, solution);
    }
}

/// Number of equal internal steps.
pub(crate) fn internal_steps(size: f64, max_step: f64) -> Result<u32, Error> {
    let argument = |what, expected: &str, found: f64| Error::Argument {
        what,
        expected: expected.to_owned(),
        found: found.to_string(),
    };
    if !(size.is_finite() && size > 0.0) {
        return Err(argument("step size", "a positive number of seconds", size));
    }
    if !(max_step.is_finite() && max_step > 0.0) {
        return Err(argument("largest internal step", "a positive number of seconds", max_step));
    }
    // a ratio that is whole but for rounding must not cost another step
    let count = (size / max_step * (1.0 - 1e-9)).ceil().max(1.0);
    if count > 1e9 {
        return Err(argument("internal steps per step", "at most 1e9", count));
    }
    // in range by the check above
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Ok(count as u32)
}

#[cfg(test)]
mod tests {
    use super::{MOST_CORRECTIONS, closed};

    /// Slow progress within the tolerance is good enough when no correction is left (it once was an
    /// error), and never before the tolerance.
    #[test]
    fn issue_corrections_used_up_within_the_tolerance_are_no_failure() {
        let (aim, before) = (1e-11, 1e-11);
        assert!(!closed(3.7e-12, before, aim, MOST_CORRECTIONS - 1));
        assert!(closed(3.7e-12, before, aim, MOST_CORRECTIONS));
        assert!(!closed(1.1e-11, 3e-11, aim, MOST_CORRECTIONS));
    }
}
