//! The state from which the coupled equations start.

use guideway::Load;
use multibody::{Holding, Loads, MagnetIndex, Rails, Travel};

use super::equations::Scratch;
use super::{MonolithicSystem, told};

/// The static state has converged when no place of the rails changes by more than this (m):
/// rounding of positions of some ten metres.
const SETTLED: f64 = 1e-14;
const MOST_SWEEPS: usize = 100;

impl MonolithicSystem {
    /// Initial state and static loads (N), as in co-simulation: the vehicle in equilibrium below the
    /// track, in a curve in that of steady motion, each magnet
    /// at rest at its gap, the girders bent by the magnets' forces. Magnets on one frame cannot all
    /// be at c0 below a bent or rough track, so some start with another gap.
    pub(super) fn rest(&self, scratch: &mut Scratch) -> Result<(Vec<f64>, Vec<f64>), String> {
        let mut height = vec![0.0; self.loads.len()];
        let mut side = vec![0.0; self.loads.len()];
        let still = vec![0.0; self.loads.len()];
        let parameters = *self.magnet.parameters();
        let guidance = |load: f64, gap: f64, offset: f64| match parameters.pole_width {
            None => [0.0; 2],
            Some(width) if parameters.lift_loss => {
                magnet::lateral_force_with_loss(load, gap, offset, width)
            }
            Some(width) => [
                magnet::lateral_force(load, gap, offset, width),
                magnet::lateral_stiffness(load, gap, offset, width),
            ],
        };
        for _ in 0..MOST_SWEEPS {
            let rails = Rails { height: &height, side: &side };
            let found = self
                .vehicle
                .carried_equilibrium(
                    self.curved(),
                    &rails,
                    &Holding::default(),
                    &guidance,
                    &[],
                    &mut scratch.vehicle,
                )
                .map_err(told)?;
            scratch.bodies = found.state;
            scratch.bodies.travel = self.travel(0.0);
            let loads = found.loads;
            self.magnets_at_rest(&rails, &loads, &still, scratch)?;
            scratch.track.rest(&scratch.places, self.travel_speed)?;
            let mut moved = 0.0_f64;
            for (k, place) in scratch.places.iter().enumerate() {
                let rail = scratch.track.rail(k, place.position[0]);
                let at = [rail.vertical.displacement(), rail.lateral.displacement()];
                moved = moved.max((at[0] - height[k]).abs()).max((at[1] - side[k]).abs());
                [height[k], side[k]] = at;
            }
            if moved < SETTLED {
                // magnets on a rough rail are off their gaps, and the controllers see what that causes
                let accelerations = self.falling(scratch)?;
                let rails = Rails { height: &height, side: &side };
                self.magnets_at_rest(&rails, &loads, &accelerations, scratch)?;
                return Ok((scratch.packed(), loads));
            }
        }
        Err("the static state was not found".into())
    }

    /// The travel at the start, unless the line is straight, level and without cant below the vehicle.
    fn curved(&self) -> Option<Travel> {
        let (line, state) = (self.vehicle.line()?, self.vehicle.initial_state());
        let places = || self.vehicle.magnets().map(|k| self.vehicle.magnet(&state, k).position.x);
        let (from, to) = (places().fold(0.0, f64::min), places().fold(0.0, f64::max));
        self.travel(0.0).filter(|it| !line.is_plain(it.place + from, it.place + to))
    }

    /// Accelerations (m/s², down positive) of the magnets under the forces in scratch memory.
    fn falling(&self, scratch: &mut Scratch) -> Result<Vec<f64>, String> {
        let forces = |of: fn(&Load) -> f64| scratch.places.iter().map(of).collect::<Vec<_>>();
        let (vertical, lateral) = (forces(|load| load.force[0]), forces(|load| load.lateral[0]));
        let loads = Loads { vertical: &vertical, lateral: &lateral };
        self.vehicle.accelerations(&scratch.bodies, &loads, &mut scratch.vehicle).map_err(told)?;
        let down = |k| -self.vehicle.magnet_acceleration(&scratch.vehicle, k).z;
        Ok(self.vehicle.magnets().map(down).collect())
    }

    /// The magnets as they start at their gaps below rails at these heights and places aside (m), and their
    /// forces.
    fn magnets_at_rest(
        &self,
        rails: &Rails,
        loads: &[f64],
        accelerations: &[f64],
        scratch: &mut Scratch,
    ) -> Result<(), String> {
        scratch.magnets.clear();
        for (k, &acceleration) in accelerations.iter().enumerate() {
            let motion = self.vehicle.magnet(&scratch.bodies, MagnetIndex(k));
            let x = self.initial_position + motion.position.x;
            let rail = scratch.track.rail(k, x);
            let inputs = magnet::MagnetInputs {
                gap: self.vehicle.nominal_gap() + rails.height[k] - motion.displacement.z,
                gap_rate: rail.vertical.rate(self.travel_speed) - motion.velocity.z,
                acceleration,
                lateral_offset: motion.displacement.y - rails.side[k],
                static_force: loads[k],
                ..magnet::MagnetInputs::default()
            };
            let magnet = self.magnet.initialise(&inputs, 0.0).map_err(told)?;
            let outputs = self.magnet.outputs(&magnet, &inputs).map_err(told)?;
            let lateral = [outputs.lateral_force, 0.0, 0.0, 0.0];
            scratch.places[k] = Load { lateral, ..Load::standing(outputs.force, x) };
            scratch.magnets.push(magnet);
        }
        Ok(())
    }
}
