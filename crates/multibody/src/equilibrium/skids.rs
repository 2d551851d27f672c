//! Static equilibrium on the landing skids, without forces of the magnets.
//!
//! The search is that for the nominal gap with the skids' springs in the place of the holding ones:
//! Newton steps in poses and multipliers, in which a skid that touches has its stiffness k and one off
//! the rail a thousandth of it, so that a body that is off the rail as a whole comes down.

use super::holding::{Equilibrium, Holding};
use super::search::{ACCEPTED_ACCELERATION, COMPONENTS, GOAL_ACCELERATION, PATIENCE};
use super::statics::Statics;
use crate::contact::{Contact, TrackContact};
use crate::error::Error;
use crate::index::MagnetIndex;
use crate::loads::{AppliedForces, ExternalLoad, Loads, copy_external};
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::state::State;
use crate::workspace::Workspace;

/// Largest component of a Newton step, m or rad: the depth of contacts changes by fractions of a
/// millimetre, and a body that leaves the rail must find it again.
const LONGEST: f64 = 2e-3;
/// Stiffness of a skid off the rail, by that of one on it.
const OFF_THE_RAIL: f64 = 1e-3;

impl VehicleModel {
    /// Finds the static equilibrium on the skids below a track whose surface is at the heights `track`
    /// (m, one per magnet, up positive), without forces of the magnets. It starts from `levitated`, the
    /// equilibrium at the nominal gap, keeps its external loads, and returns the skids' forces as its loads.
    ///
    /// # Errors
    /// [`Error::Argument`] without skids, otherwise those of [`VehicleModel::equilibrium`].
    pub fn skid_equilibrium(
        &self,
        track: &[f64],
        contact: &Contact,
        holding: &Holding,
        levitated: &Equilibrium,
        ws: &mut Workspace,
    ) -> Result<Equilibrium, Error> {
        let Some(skid) = contact.skid else {
            return Err(Error::Argument {
                what: "equilibrium on the skids",
                expected: "skids in force".to_owned(),
                found: "none".to_owned(),
            });
        };
        let mut state = levitated.state.clone();
        self.check_lengths(&state, [track.len(), track.len(), 0])?;
        self.follow_line(None, ws);
        let drop = skid.gap - self.nominal_gap;
        for body in &mut state.bodies {
            body.position.z -= drop;
        }
        let still = vec![0.0; track.len()];
        let (speed, side_rate) = (0.0, &[][..]);
        let track =
            TrackContact { contact: *contact, speed, height: track, rate: &still, side_rate };
        let statics = self.static_problem(holding, ws)?;
        let factors = vec![0.0; statics.analysis.factorisation.storage];
        let mut landing = Landing {
            model: self,
            holding,
            statics: &statics,
            track,
            external: &levitated.external,
            factors,
        };
        landing.run(&mut state, ws)
    }
}

struct Landing<'a> {
    model: &'a VehicleModel,
    holding: &'a Holding,
    statics: &'a Statics,
    track: TrackContact<'a>,
    external: &'a [ExternalLoad],
    factors: Vec<f64>,
}

impl Landing<'_> {
    fn run(&mut self, state: &mut State, ws: &mut Workspace) -> Result<Equilibrium, Error> {
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        for iteration in 1..=self.holding.iterations {
            // the check costs too much far from the solution
            if self.newton(state, ws)? > 1e-8 {
                continue;
            }
            let acceleration = self.acceleration(state, ws)?;
            stalled = if acceleration < 0.5 * best { 0 } else { stalled + 1 };
            best = acceleration.min(best);
            let accepted = acceleration <= ACCEPTED_ACCELERATION && stalled >= PATIENCE;
            if acceleration <= GOAL_ACCELERATION || accepted {
                return Ok(Equilibrium {
                    state: state.clone(),
                    loads: ws.touch.force.iter().map(|force| force.z).collect(),
                    lateral: vec![0.0; self.track.height.len()],
                    external: self.external.to_vec(),
                    iterations: iteration,
                    acceleration,
                });
            }
        }
        Err(self.failure(state, ws)?)
    }

    /// One Newton step; returns its largest component.
    fn newton(&mut self, state: &mut State, ws: &mut Workspace) -> Result<f64, Error> {
        let model = self.model;
        ws.forget();
        ws.vertical.fill(0.0);
        ws.lateral.fill(0.0);
        copy_external(&mut ws.external, self.external);
        // a step before may have left one
        ws.acceleration = 0.0;
        ws.touch.set(Some(&self.track));
        model.set_kinematics(&state.bodies, ws);
        model.apply_forces(ws);
        model.residuals(ws);
        self.assemble(state, ws);
        let solver = &self.statics.analysis.factorisation;
        solver.factor(&mut self.factors).map_err(|vanished| model.singular(vanished, 0.0))?;
        model.static_right_hand_side(ws);
        solver.solve(&self.factors, &mut ws.solution);
        let steps = &mut ws.solution[..6 * model.composites.len()];
        // NaN counts as largest
        let largest = steps.iter().fold(0.0_f64, |m, d| if d.abs() <= m { m } else { d.abs() });
        if largest > LONGEST {
            steps.iter_mut().for_each(|step| *step *= LONGEST / largest);
        }
        for (body, delta) in state.bodies.iter_mut().zip(steps.chunks_exact(6)) {
            body.displace(delta);
        }
        if !largest.is_finite() {
            return Err(Error::NotFinite { what: "the static equilibrium".to_owned(), time: 0.0 });
        }
        Ok(largest)
    }

    fn assemble(&mut self, state: &State, ws: &Workspace) {
        let Self { model, holding, statics, track, factors, .. } = self;
        factors.fill(0.0);
        let free = vec![0.0; track.height.len()];
        let mut add = |i: crate::index::BodyIndex, j: crate::index::BodyIndex, block| {
            statics.add(i, j, &block, factors);
        };
        model.stiffness(&ws.kin, &[], holding, &free, None, &mut add);
        for k in model.magnets() {
            let row = model.magnet_row(&ws.kin, k, &Vec3::z());
            let body = model.magnets[k].body;
            add(body, body, row * row.transpose() * stiffness(model, state, k, track));
        }
        for (joint, places) in model.joints.iter().zip(&statics.places.joints) {
            joint.store_jacobian(&ws.kin, places, factors);
        }
    }

    /// Largest acceleration on the skids.
    fn acceleration(&self, state: &State, ws: &mut Workspace) -> Result<f64, Error> {
        let none = vec![0.0; self.track.height.len()];
        let magnets = Loads { vertical: &none, lateral: &none };
        let forces = AppliedForces { magnets, external: self.external, acceleration: 0.0 };
        self.model.accelerations_in_contact(state, forces, Some(&self.track), ws)?;
        let n = 6 * self.model.composites.len();
        Ok(ws.solution[..n].iter().fold(0.0, |m, a| m.max(a.abs())))
    }

    /// The error with the largest remaining acceleration.
    fn failure(&self, state: &State, ws: &mut Workspace) -> Result<Error, Error> {
        let acceleration = self.acceleration(state, ws)?;
        let rates = &ws.solution[..6 * self.model.composites.len()];
        let worst = rates.iter().position(|a| a.abs() >= acceleration).unwrap_or(0);
        Ok(Error::Landing {
            iterations: self.holding.iterations,
            body: self.model.composites[worst / 6].name.clone(),
            component: COMPONENTS[worst % 6],
            acceleration,
        })
    }
}

/// Stiffness of a magnet's skid for a Newton step, N/m.
fn stiffness(model: &VehicleModel, state: &State, k: MagnetIndex, track: &TrackContact) -> f64 {
    let (clearance, _) = model.at_rail(&state.bodies, None, k, &track.at(k.0));
    track.contact.skid.map_or(0.0, |skid| {
        let off = if clearance.gap > skid.gap { 1.0 } else { OFF_THE_RAIL };
        skid.stiffness * off
    })
}
