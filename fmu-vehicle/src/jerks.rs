//! Rates of the magnets' accelerations, computed once per communication point.

use fmi2_export::Values;
use multibody::{Error, Loads, MagnetIndex, VehicleModel, Workspace};

use crate::state::State;
use crate::table::InputHandles;

/// Rates of the magnets' accelerations (down positive), with what they were computed for.
#[derive(Debug)]
pub(crate) struct Jerks {
    known: bool,
    state: multibody::State,
    force: Vec<f64>,
    lateral: Vec<f64>,
    force_rate: Vec<f64>,
    lateral_rate: Vec<f64>,
    jerk: Vec<f64>,
}

impl Jerks {
    pub fn new(model: &VehicleModel) -> Self {
        let zero = || vec![0.0; model.counts().magnets];
        Self {
            known: false,
            state: model.initial_state(),
            force: zero(),
            lateral: zero(),
            force_rate: zero(),
            lateral_rate: zero(),
            jerk: zero(),
        }
    }

    /// Discards rates of another state or other inputs. A comparison costs more than reading one
    /// rate, so it is done once for all rates that are read together.
    pub fn check(&mut self, state: &State, values: &Values, inputs: &InputHandles) {
        self.known = self.known
            && self.force == values.reals(inputs.force)
            && self.lateral == values.reals(inputs.lateral_force)
            && self.force_rate == state.rates.force
            && self.lateral_rate == state.rates.lateral_force
            && self.state == state.vehicle;
    }

    /// The rates of all magnets, computed if necessary.
    pub fn all(
        &mut self,
        model: &VehicleModel,
        state: &State,
        values: &Values,
        inputs: &InputHandles,
        [work, probe]: [&mut Workspace; 2],
    ) -> Result<&[f64], Error> {
        if !self.known {
            let rates = Loads { vertical: &state.rates.force, lateral: &state.rates.lateral_force };
            model.jerks(&state.vehicle, &inputs.loads(values), &rates, work, probe)?;
            for (k, jerk) in self.jerk.iter_mut().enumerate() {
                *jerk = -model.magnet_jerk(work, probe, MagnetIndex(k)).z;
            }
            self.remember(state, values, inputs);
        }
        Ok(&self.jerk)
    }

    fn remember(&mut self, state: &State, values: &Values, inputs: &InputHandles) {
        self.known = true;
        self.state.clone_from(&state.vehicle);
        self.force.copy_from_slice(values.reals(inputs.force));
        self.lateral.copy_from_slice(values.reals(inputs.lateral_force));
        self.force_rate.copy_from_slice(&state.rates.force);
        self.lateral_rate.copy_from_slice(&state.rates.lateral_force);
    }
}
