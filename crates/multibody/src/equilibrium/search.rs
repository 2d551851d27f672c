//! The search itself: Newton steps in poses and multipliers, loads that follow.

use nalgebra::DVector;

use super::holding::{Equilibrium, Guidance, Holding};
use super::statics::Statics;
use crate::dynamics::check_line;
use crate::error::Error;
use crate::index::MagnetIndex;
use crate::loads::{AppliedForces, ExternalLoad, Loads, copy_external};
use crate::math::{conjugate, multiply, rotation_vector};
use crate::model::VehicleModel;
use crate::state::State;
use crate::workspace::Workspace;

/// The search ends as soon as both values are below these.
pub(super) const GOAL_ACCELERATION: f64 = 1e-10;
const GOAL_DEVIATION: f64 = 1e-13;
/// Accepted where rounding prevents further progress.
pub(super) const ACCEPTED_ACCELERATION: f64 = 1e-8;
const ACCEPTED_DEVIATION: f64 = 1e-10;
/// Names of the components of an acceleration.
pub(super) const COMPONENTS: [&str; 6] =
    ["along x", "along y", "along z", "about x", "about y", "about z"];
/// Largest component of limited Newton steps, m or rad, in the order in which they are tried.
const LONGEST: [f64; 2] = [0.01, 0.002];
/// Parts in which the shape of a track follows a flat one.
const PARTS: u8 = 8;
/// Displacement (m) or rotation (rad) of a body that has left its place.
const FAR: f64 = 0.1;
/// Iterations without progress that count as the end of progress.
pub(super) const PATIENCE: usize = 8;
/// Last iterations in which a magnet where the law of guidance has ended tells why the search failed.
const LATELY: usize = 50;
/// Halvings of an offset to where the law of guidance holds.
const HALVINGS: usize = 30;

pub(super) struct Search<'a> {
    pub model: &'a VehicleModel,
    pub holding: &'a Holding,
    pub track: Vec<f64>,
    /// Lateral displacements of the rails; none are zeros.
    pub side: &'a [f64],
    pub guidance: Guidance<'a>,
    pub external: &'a [ExternalLoad],
    pub statics: &'a Statics,
    /// L.
    pub loads: Vec<f64>,
    /// L + K d.
    pub forces: Vec<f64>,
    /// Guidance forces of magnets that pull with `forces`, and how fast they fall with the offset.
    pub lateral: Vec<f64>,
    pub restoring: Vec<f64>,
    /// The magnet (and its offset, m) that was farthest where the law of guidance has ended.
    pub astray: Option<(MagnetIndex, f64)>,
    pub factors: Vec<f64>,
}

impl Search<'_> {
    /// Full Newton steps and, if they do not arrive, steps of limited length from the same start: the
    /// equations are those of large rotations, and full steps may leave the region where they help.
    pub fn run(&mut self, state: &mut State, ws: &mut Workspace) -> Result<Equilibrium, Error> {
        let (start, loads) = (state.clone(), self.loads.clone());
        let first = match self.iterate(state, f64::INFINITY, ws) {
            Ok(found) => return Ok(found),
            Err(error) => error,
        };
        for longest in LONGEST {
            state.clone_from(&start);
            self.loads.copy_from_slice(&loads);
            if let Ok(found) = self.run_in_parts(state, longest, ws) {
                return Ok(found);
            }
        }
        if matches!(first, Error::Equilibrium { .. } | Error::Unguided { .. }) {
            return Err(first);
        }
        Err(self.displaced(&start, state).unwrap_or(first))
    }

    /// By way of a flat track, below which guidance and loads settle first. Then the vehicle moves with the mean height of
    /// the track, whose shape follows in parts: magnets that the springs K push down would be pushed sideways as well.
    fn run_in_parts(
        &mut self,
        state: &mut State,
        longest: f64,
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        let track = self.track.clone();
        self.track.fill(0.0);
        let mean = track.iter().sum::<f64>() / track.len().max(1) as f64;
        let mut found = self.iterate(state, longest, ws);
        state.bodies.iter_mut().for_each(|body| body.position.z += mean);
        for part in 1..=PARTS {
            let fraction = f64::from(part) / f64::from(PARTS);
            for (height, goal) in self.track.iter_mut().zip(&track) {
                *height = if part == PARTS { *goal } else { mean + fraction * (goal - mean) };
            }
            if found.is_ok() {
                found = self.iterate(state, longest, ws);
            }
        }
        found
    }

    /// The error that names the heaviest body that has left its place.
    fn displaced(&self, start: &State, state: &State) -> Option<Error> {
        let moves = start.bodies.iter().zip(&state.bodies).zip(&self.model.composites);
        let far = moves.filter_map(|((from, to), composite)| {
            let turn = rotation_vector(multiply(conjugate(from.attitude), to.attitude));
            let shift = to.position - from.position;
            let (amount, axis) = if turn.amax() > FAR { (turn, 3) } else { (shift, 0) };
            let worst = amount.iamax();
            (amount[worst].abs() > FAR).then_some((composite, amount[worst], axis + worst))
        });
        let (composite, moved, component) = far.max_by(|a, b| a.0.mass.total_cmp(&b.0.mass))?;
        Some(Error::Unheld {
            body: composite.name.clone(),
            component: COMPONENTS[component],
            moved,
        })
    }

    fn iterate(
        &mut self,
        state: &mut State,
        longest: f64,
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        let mut best = (f64::INFINITY, f64::INFINITY);
        let (mut stalled, mut astray) = (0, None);
        for iteration in 1..=self.holding.iterations {
            let move_size = self.newton(state, longest, ws)?;
            let deviation = self.hold(state);
            astray = self.astray.map(|it| (iteration, it)).or(astray);
            // the loads follow once the springs K hold the vehicle
            if move_size <= longest {
                self.loads.copy_from_slice(&self.forces);
            }
            // the check costs too much far from the solution
            if move_size > 1e-8 {
                continue;
            }
            let acceleration = self.acceleration(state, ws)?;
            let done = acceleration <= GOAL_ACCELERATION && deviation <= GOAL_DEVIATION;
            let better = acceleration < 0.5 * best.0 || deviation < 0.5 * best.1;
            stalled = if better { 0 } else { stalled + 1 };
            best = (acceleration.min(best.0), deviation.min(best.1));
            let accepted = acceleration <= ACCEPTED_ACCELERATION && deviation <= ACCEPTED_DEVIATION;
            if done || (accepted && stalled >= PATIENCE) {
                if let Some((magnet, offset)) = self.astray {
                    return Err(Error::Unguided { magnet, offset });
                }
                self.move_along(state, ws)?;
                return Ok(Equilibrium {
                    state: state.clone(),
                    loads: self.loads.clone(),
                    lateral: self.lateral.clone(),
                    external: self.external.to_vec(),
                    iterations: iteration,
                    acceleration,
                });
            }
        }
        if let Some((last, (magnet, offset))) = astray
            && last + LATELY > self.holding.iterations
        {
            return Err(Error::Unguided { magnet, offset });
        }
        Err(self.failure(state, ws)?)
    }

    /// The error with the largest remaining acceleration.
    fn failure(&mut self, state: &State, ws: &mut Workspace) -> Result<Error, Error> {
        let acceleration = self.acceleration(state, ws)?;
        let rates = &ws.solution[..6 * self.model.composites.len()];
        let worst = rates.iter().position(|a| a.abs() >= acceleration).unwrap_or(0);
        let composite = &self.model.composites[worst / 6];
        let resistance = match worst % 6 {
            0..3 => composite.mass,
            axis => composite.inertia[(axis - 3, axis - 3)],
        };
        Ok(Error::Equilibrium {
            iterations: self.holding.iterations,
            body: composite.name.clone(),
            component: COMPONENTS[worst % 6],
            acceleration,
            unbalanced: resistance * acceleration,
            guided: self.restoring.iter().any(|k| *k > 0.0),
            deviation: self.hold(state),
        })
    }

    /// Sets the forces to L + K d and the guidance forces that follow from them. Returns the
    /// largest component of d.
    fn hold(&mut self, state: &State) -> f64 {
        let mut largest = 0.0_f64;
        self.forces.copy_from_slice(&self.loads);
        for fit in &self.statics.fits {
            let deviation = DVector::from_iterator(
                fit.magnets.len(),
                fit.magnets
                    .iter()
                    .map(|&k| self.track[k] - self.model.magnet(state, k).displacement.z),
            );
            let fitted = &fit.basis * (fit.basis.tr_mul(&deviation));
            largest = largest.max(fitted.amax());
            for (value, &k) in fitted.iter().zip(&fit.magnets) {
                self.forces[k] += self.holding.stiffness * value;
            }
        }
        self.astray = None;
        for k in 0..self.forces.len() {
            let offset = self.model.magnet(state, MagnetIndex(k)).displacement;
            let gap = self.model.nominal_gap + self.track[k] - offset.z;
            let offset = offset.y - self.side.get(k).copied().unwrap_or(0.0);
            let mut law = (self.guidance)(self.forces[k], gap, offset);
            if !law[0].is_finite() {
                law = self.beyond(self.forces[k], gap, offset, law);
                let farther = self.astray.is_none_or(|(_, most)| most.abs() < offset.abs());
                if farther && law[0].is_finite() {
                    self.astray = Some((MagnetIndex(k), offset));
                }
            }
            [self.lateral[k], self.restoring[k]] = law;
        }
        largest
    }

    /// The law of guidance where it has ended, continued by a tangent, so that the search may pass there.
    fn beyond(&self, force: f64, gap: f64, offset: f64, law: [f64; 2]) -> [f64; 2] {
        let mut at = offset;
        for _ in 0..HALVINGS {
            at *= 0.5;
            let [pull, restoring] = (self.guidance)(force, gap, at);
            if pull.is_finite() {
                return [pull - restoring * (offset - at), restoring];
            }
        }
        law
    }

    /// Gives the bodies of an equilibrium on a line the velocities with which it carries them, as far as the
    /// joints allow; elsewhere they are at rest.
    fn move_along(&self, state: &mut State, ws: &mut Workspace) -> Result<(), Error> {
        if self.model.way(state.travel).is_none() {
            return Ok(());
        }
        self.model.carry(state)?;
        self.model.close_joints(state, ws)
    }

    /// One Newton step, shortened to components of at most `longest`; returns its largest one before.
    fn newton(
        &mut self,
        state: &mut State,
        longest: f64,
        ws: &mut Workspace,
    ) -> Result<f64, Error> {
        self.hold(state);
        let model = self.model;
        ws.forget();
        ws.vertical.copy_from_slice(&self.forces);
        ws.lateral.copy_from_slice(&self.lateral);
        copy_external(&mut ws.external, self.external);
        model.carry(state)?;
        // a step before may have left one
        ws.acceleration = 0.0;
        model.set_kinematics(&state.bodies, ws);
        model.apply_forces(ws);
        check_line(state.time, ws)?;
        model.residuals(ws);
        self.assemble(ws);
        let solver = &self.statics.analysis.factorisation;
        solver.factor(&mut self.factors).map_err(|vanished| model.singular(vanished, 0.0))?;
        model.static_right_hand_side(ws);
        self.carried_inertia(state, ws)?;
        solver.solve(&self.factors, &mut ws.solution);
        let steps = &mut ws.solution[..6 * model.composites.len()];
        // NaN counts as largest
        let largest = steps.iter().fold(0.0_f64, |m, d| if d.abs() <= m { m } else { d.abs() });
        if !largest.is_finite() {
            return Err(Error::NotFinite { what: "the static equilibrium".to_owned(), time: 0.0 });
        }
        if largest > longest {
            steps.iter_mut().for_each(|step| *step *= longest / largest);
        }
        for (body, delta) in state.bodies.iter_mut().zip(steps.chunks_exact(6)) {
            body.displace(delta);
        }
        Ok(largest)
    }

    fn assemble(&mut self, ws: &Workspace) {
        let (statics, factors) = (self.statics, &mut self.factors);
        factors.fill(0.0);
        let (holding, restoring) = (self.holding, &self.restoring);
        let (fits, way) = (&statics.fits, ws.way.as_ref());
        self.model.stiffness(&ws.kin, fits, holding, restoring, way, &mut |i, j, block| {
            statics.add(i, j, &block, factors);
        });
        for (joint, places) in self.model.joints.iter().zip(&statics.places.joints) {
            joint.store_jacobian(&ws.kin, places, factors);
        }
    }

    fn carried_inertia(&self, state: &State, ws: &mut Workspace) -> Result<(), Error> {
        self.model
            .carried_inertia(&state.bodies, ws)
            .map_err(|cause| Error::OffLine { time: state.time, cause })
    }

    /// Largest acceleration, beside that of carried bodies, under the loads and the guidance forces alone.
    fn acceleration(&self, state: &State, ws: &mut Workspace) -> Result<f64, Error> {
        let n = 6 * self.model.composites.len();
        if ws.way.is_some() {
            self.unbalanced(state, ws)?;
            return Ok(ws.solution[..n].iter().fold(0.0, |m, a| m.max(a.abs())));
        }
        let magnets = Loads { vertical: &self.loads, lateral: &self.lateral };
        let forces = AppliedForces { magnets, external: self.external, acceleration: 0.0 };
        self.model.accelerations(state, forces, ws)?;
        Ok(ws.solution[..n].iter().fold(0.0, |m, a| m.max(a.abs())))
    }

    /// What the forces that are not in balance with the inertia of carried bodies would accelerate.
    fn unbalanced(&self, state: &State, ws: &mut Workspace) -> Result<(), Error> {
        let model = self.model;
        ws.forget();
        ws.vertical.copy_from_slice(&self.loads);
        ws.lateral.copy_from_slice(&self.lateral);
        copy_external(&mut ws.external, self.external);
        model.set_kinematics(&state.bodies, ws);
        model.apply_forces(ws);
        check_line(state.time, ws)?;
        // the joints do not move
        ws.residual.fill(0.0);
        model.static_right_hand_side(ws);
        self.carried_inertia(state, ws)?;
        model.factor(state.time, ws)?;
        model.solver.solve(&ws.factors, &mut ws.solution);
        model.check_finite(state.time, ws)
    }
}
