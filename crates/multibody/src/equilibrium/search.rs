//! The search itself: Newton steps in poses and multipliers, loads that follow.

use nalgebra::DVector;

use super::holding::{Equilibrium, Guidance, Holding};
use super::statics::Statics;
use crate::error::Error;
use crate::index::MagnetIndex;
use crate::loads::{AppliedForces, ExternalLoad, Loads, copy_external};
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
/// Iterations without progress that count as the end of progress.
pub(super) const PATIENCE: usize = 8;

pub(super) struct Search<'a> {
    pub model: &'a VehicleModel,
    pub holding: &'a Holding,
    pub track: &'a [f64],
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
    pub factors: Vec<f64>,
}

impl Search<'_> {
    pub fn run(&mut self, state: &mut State, ws: &mut Workspace) -> Result<Equilibrium, Error> {
        let mut best = (f64::INFINITY, f64::INFINITY);
        let mut stalled = 0;
        for iteration in 1..=self.holding.iterations {
            let move_size = self.newton(state, ws)?;
            let deviation = self.hold(state);
            self.loads.copy_from_slice(&self.forces);
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
        for (k, force) in self.forces.iter().enumerate() {
            let offset = self.model.magnet(state, MagnetIndex(k)).displacement;
            let gap = self.model.nominal_gap + self.track[k] - offset.z;
            [self.lateral[k], self.restoring[k]] = (self.guidance)(*force, gap, offset.y);
        }
        largest
    }

    /// One Newton step; returns its largest component.
    fn newton(&mut self, state: &mut State, ws: &mut Workspace) -> Result<f64, Error> {
        self.hold(state);
        let model = self.model;
        ws.forget();
        ws.vertical.copy_from_slice(&self.forces);
        ws.lateral.copy_from_slice(&self.lateral);
        copy_external(&mut ws.external, self.external);
        model.set_kinematics(&state.bodies, ws);
        model.apply_forces(ws);
        model.residuals(ws);
        self.assemble(ws);
        let solver = &self.statics.analysis.factorisation;
        solver.factor(&mut self.factors).map_err(|vanished| model.singular(vanished, 0.0))?;
        model.static_right_hand_side(ws);
        solver.solve(&self.factors, &mut ws.solution);
        let mut largest = 0.0_f64;
        for (body, delta) in state.bodies.iter_mut().zip(ws.solution.chunks_exact(6)) {
            largest = delta.iter().fold(largest, |m, d| m.max(d.abs()));
            body.displace(delta);
        }
        if !largest.is_finite() {
            return Err(Error::NotFinite { what: "the static equilibrium".to_owned(), time: 0.0 });
        }
        Ok(largest)
    }

    fn assemble(&mut self, ws: &Workspace) {
        let (statics, factors) = (self.statics, &mut self.factors);
        factors.fill(0.0);
        let (holding, restoring) = (self.holding, &self.restoring);
        self.model.stiffness(&ws.kin, &statics.fits, holding, restoring, &mut |i, j, block| {
            statics.add(i, j, &block, factors);
        });
        for (joint, places) in self.model.joints.iter().zip(&statics.places.joints) {
            joint.store_jacobian(&ws.kin, places, factors);
        }
    }

    /// Largest acceleration under the loads and the guidance forces alone.
    fn acceleration(&self, state: &State, ws: &mut Workspace) -> Result<f64, Error> {
        let magnets = Loads { vertical: &self.loads, lateral: &self.lateral };
        let forces = AppliedForces { magnets, external: self.external };
        self.model.accelerations(state, forces, ws)?;
        let n = 6 * self.model.composites.len();
        Ok(ws.solution[..n].iter().fold(0.0, |m, a| m.max(a.abs())))
    }
}
