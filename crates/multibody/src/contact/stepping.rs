//! Internal steps with contact.
//!
//! Off the rail an internal step is the one without contact, bit for bit. Where a magnet touches or
//! leaves the rail within a step, the step is repeated so that it ends there: the force has a kink,
//! which a step across it would integrate to second order only. While a magnet touches, steps are
//! smaller. With the rates of all contacts of a body, weighted by its acceleration per force w at each
//! magnet, one step covers at most
//! 0.2 of 1/ω, ω² = Σ k w (a classical Runge-Kutta step then loses 1e-6 of an oscillation's energy),
//! 0.2 of 1/Σ k χ d w, and half of 1/Σ μ N w/√(s² + s₀²), the decay of a slow slip (the error of such a
//! step is 3e-4 of the slip). A fast impact (χ ḋ far above 1) is stepped by its own time 1/√(k χ ḋ w).
//! All this follows from the state alone.
//!
//! A step that starts off the rail knows nothing of this bound. If it is longer than the bound and one of
//! its stages meets the rail, its end means nothing: the rail may have thrown the magnet out again within
//! it. Such a step is halved until it meets the rail at its end at most, or is within the bound.

use super::track::TrackCourse;
use crate::composite::Composite;
use crate::error::Error;
use crate::integrate::{Course, InternalStep, internal_steps};
use crate::loads::AppliedCourse;
use crate::math::{Mat3, Vec3, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::{BodyState, State};
use crate::workspace::Workspace;

/// Largest internal step in contact, by the fastest rate of normal forces and of friction.
const NORMAL: f64 = 0.2;
const FRICTION: f64 = 0.5;
/// A force of the rail that an open contact meets within a step counts if it would change the speed at
/// which the magnet moves towards the rail by more than this fraction.
const STRUCK: f64 = 1e-4;
/// Changes of contact within one internal step that are located. Further ones are stepped across.
const MOST_CHANGES: usize = 200;
/// Repetitions that locate one change.
const MOST_REPETITIONS: usize = 8;
/// Smallest fraction of an internal step that locating a change may leave.
const LEAST: f64 = 1e-7;

impl VehicleModel {
    /// Like [`VehicleModel::step`], with the contacts of the magnets with the rail.
    ///
    /// # Errors
    /// As [`VehicleModel::step`].
    pub fn step_in_contact<'a>(
        &self,
        state: &mut State,
        size: f64,
        max_step: f64,
        forces: impl Into<AppliedCourse<'a>>,
        track: Option<&TrackCourse>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        let forces = forces.into();
        let Some(track) = track.filter(|track| track.contact.any()) else {
            return self.step(state, size, max_step, forces, ws);
        };
        self.check_course(state, &forces)?;
        self.check_track(track.height.len(), track.rate.len())?;
        ws.touch.contact = Some(track.contact);
        let course = Course { forces, track: Some(*track), travel: state.travel };
        let count = internal_steps(size, max_step)?;
        let h = size / f64::from(count);
        let begin = state.time;
        for n in 0..count {
            let offset = f64::from(n) * h;
            self.advance(state, &InternalStep { begin, offset, h }, &course, ws)?;
            state.time = if n + 1 == count { begin + size } else { begin + f64::from(n + 1) * h };
        }
        state.travel = state.travel.map(|it| it.after(&forces.acceleration, size));
        Ok(())
    }

    pub(crate) fn check_track(&self, heights: usize, rates: usize) -> Result<(), Error> {
        for (what, found) in [("heights of the track", heights), ("rates of the track", rates)] {
            if found != self.magnets.len() {
                return Err(Error::Argument {
                    what,
                    expected: self.magnets.len().to_string(),
                    found: found.to_string(),
                });
            }
        }
        Ok(())
    }

    /// One internal step, divided where magnets touch.
    fn advance(
        &self,
        state: &mut State,
        whole: &InternalStep,
        course: &Course,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        let InternalStep { begin, offset, h: size } = *whole;
        let least = LEAST * size;
        let (mut done, mut changes) = (0.0, 0);
        self.clearances(&state.bodies, course, offset, ws);
        // a remainder below the smallest step is rounding
        while size - done > least {
            std::mem::swap(&mut ws.touch.before, &mut ws.touch.after);
            let left = size - done;
            let bound = self.contact_step(ws);
            // in equal parts
            let mut h = if left > bound { left / (left / bound).ceil() } else { left };
            ws.touch.start.copy_from_slice(&state.bodies);
            for repetition in 0.. {
                let part = InternalStep { begin, offset: offset + done, h };
                ws.touch.push.fill(0.0);
                let outcome = self
                    .runge_kutta(&mut state.bodies, &part, course, ws)
                    .and_then(|()| self.project(&mut state.bodies, begin + part.offset + h, ws));
                if let Err(error) = outcome {
                    h = self.struck_within(h, true, ws).ok_or(error)?;
                    state.bodies.copy_from_slice(&ws.touch.start);
                    continue;
                }
                self.clearances(&state.bodies, course, part.offset + h, ws);
                let change = self.first_change(h, ws).map(|fraction| (fraction * h).max(least));
                let sooner = change
                    .filter(|sooner| *sooner < h)
                    .filter(|_| repetition < MOST_REPETITIONS && changes < MOST_CHANGES);
                if sooner.is_some() {
                    changes += usize::from(repetition == 0);
                }
                let Some(shorter) = sooner.or_else(|| self.struck_within(h, false, ws)) else {
                    break;
                };
                h = shorter;
                state.bodies.copy_from_slice(&ws.touch.start);
            }
            done += h;
        }
        Ok(())
    }

    /// Clearances and slips of all magnets at a time after the start of the step.
    fn clearances(&self, bodies: &[BodyState], course: &Course, t: f64, ws: &mut Workspace) {
        let Some(track) = &course.track else { return };
        let way = self.way(course.travel.map(|it| it.after(&course.forces.acceleration, t)));
        for k in self.magnets() {
            let rail = track.at(k.0, t);
            (ws.touch.after[k], ws.touch.slip[k]) = self.at_rail(bodies, way.as_ref(), k, &rail);
        }
    }

    /// Fraction of the last internal step at which a contact first closes or opens.
    fn first_change(&self, h: f64, ws: &Workspace) -> Option<f64> {
        let touch = &ws.touch;
        let contact = touch.contact?;
        touch
            .before
            .iter()
            .zip(&touch.after)
            .filter_map(|(before, after)| contact.change(*before, *after, h))
            .min_by(f64::total_cmp)
    }

    /// A shorter step, if the last one was too long for contacts that were open at its start and that its
    /// stages met.
    fn struck_within(&self, h: f64, failed: bool, ws: &mut Workspace) -> Option<f64> {
        let touch = &mut ws.touch;
        let contact = touch.contact?;
        touch.open.fill([0.0; 2]);
        let mut struck = failed;
        for (k, magnet) in self.magnets.iter().enumerate() {
            let (before, push) = (touch.before[k], touch.push[k]);
            if push == 0.0 || contact.closed(before).next().is_some() {
                continue;
            }
            let up = self.mobilities[k][2];
            let after = if failed { 0.0 } else { touch.after[k].rate.abs() };
            let speed = before.rate.abs().max(after);
            struck |= push * up * h > STRUCK * speed;
            let [stiffness, impact] = &mut touch.open[magnet.body.0];
            let (most, damped) = contact.stiffest();
            *stiffness += most * up;
            *impact += damped * before.rate.abs() * up;
        }
        let rates = touch.rates.iter().zip(&touch.open).filter(|(_, open)| open[0] > 0.0);
        let inverse = rates.fold(0.0_f64, |inverse, (closed, open)| {
            inverse.max((closed[0] + open[0]).sqrt() / NORMAL).max((closed[3] + open[1]).sqrt())
        });
        // infinite where no stage met the rail
        let bound = 1.0 / inverse;
        (struck && h > bound).then(|| (0.5 * h).max(bound))
    }

    /// Longest internal step from the clearances in `before`; infinite where nothing touches.
    fn contact_step(&self, ws: &mut Workspace) -> f64 {
        let Workspace { touch, .. } = ws;
        let Some(contact) = touch.contact else { return f64::INFINITY };
        touch.rates.fill([0.0; 4]);
        let mut inverse = 0.0_f64;
        for (k, magnet) in self.magnets.iter().enumerate() {
            for closed in contact.closed(touch.before[k]) {
                let law = closed.law;
                let [along, across, up] = self.mobilities[k];
                let [stiffness, damping, friction, impact] = &mut touch.rates[magnet.body.0];
                *stiffness += law.stiffness * up;
                *damping += law.stiffness * law.damping * closed.depth.max(0.0) * up;
                let drag = law.friction * closed.normal() * contact.per_slip(touch.slip[k]);
                *friction += drag * along.max(across);
                *impact += law.stiffness * law.damping * closed.rate.max(0.0) * up;
                inverse = inverse
                    .max(stiffness.sqrt() / NORMAL)
                    .max(*damping / NORMAL)
                    .max(*friction / FRICTION)
                    .max(impact.sqrt());
            }
        }
        1.0 / inverse
    }
}

/// Acceleration per force at a point of a body without joints, along the world's axes in the initial
/// pose, 1/kg.
pub(crate) fn mobility(body: &Composite, local: &Vec3) -> [f64; 3] {
    let axes = rotation_matrix(body.start.attitude);
    let inverse = body.inertia.try_inverse().unwrap_or_else(Mat3::zeros);
    [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| {
        let moment = local.cross(&axes.tr_mul(&axis));
        1.0 / body.mass + moment.dot(&(inverse * moment))
    })
}
