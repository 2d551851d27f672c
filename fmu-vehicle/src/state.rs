//! The state of the vehicle.

use fmi2_export::Values;
use multibody::ExternalLoad;
use serde::{Deserialize, Serialize};

use crate::external::ExternalHandles;
use crate::journey::Journey;
use crate::table::{InputHandles, SidewaysHandles};

/// Everything that changes while stepping.
#[derive(Debug, Serialize, Deserialize)]
pub struct State {
    pub(crate) vehicle: multibody::State,
    /// Speed and place of the frame.
    pub(crate) journey: Journey,
    /// Fingerprint of the parameters that the vehicle was built with.
    pub(crate) key: u64,
    /// |λ| of the vehicle's fastest motion at the start, 1/s.
    pub(crate) fastest: f64,
    /// Static load of each magnet, N.
    pub(crate) loads: Vec<f64>,
    /// Rates of the inputs at the end of the last step.
    pub(crate) rates: LoadRates,
}

/// Rates of the inputs. The kit discards them at the end of a step.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LoadRates {
    pub force: Vec<f64>,
    pub lateral_force: Vec<f64>,
    pub track_rate: Vec<f64>,
    pub side_rate: Vec<f64>,
    pub external: Vec<ExternalLoad>,
    /// Of the motors' inputs: thrust, current, frequency, then heights; empty without motors.
    pub motors: Vec<f64>,
    pub bends: LoadBends,
}

/// Second derivatives of the inputs.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LoadBends {
    pub force: Vec<f64>,
    pub lateral_force: Vec<f64>,
    pub track_rate: Vec<f64>,
    pub side_rate: Vec<f64>,
    pub external: Vec<ExternalLoad>,
}

impl Clone for LoadBends {
    fn clone(&self) -> Self {
        Self {
            force: self.force.clone(),
            lateral_force: self.lateral_force.clone(),
            track_rate: self.track_rate.clone(),
            side_rate: self.side_rate.clone(),
            external: self.external.clone(),
        }
    }

    /// Reuses the memory.
    fn clone_from(&mut self, source: &Self) {
        self.force.clone_from(&source.force);
        self.lateral_force.clone_from(&source.lateral_force);
        self.track_rate.clone_from(&source.track_rate);
        self.side_rate.clone_from(&source.side_rate);
        self.external.clone_from(&source.external);
    }
}

impl LoadRates {
    pub fn zero(magnets: usize, observed: usize) -> Self {
        Self {
            force: vec![0.0; magnets],
            lateral_force: vec![0.0; magnets],
            track_rate: vec![0.0; magnets],
            side_rate: vec![0.0; magnets],
            external: vec![[0.0; 6]; observed],
            motors: Vec::new(),
            bends: LoadBends {
                force: vec![0.0; magnets],
                lateral_force: vec![0.0; magnets],
                track_rate: vec![0.0; magnets],
                side_rate: vec![0.0; magnets],
                external: vec![[0.0; 6]; observed],
            },
        }
    }

    pub fn after(
        &mut self,
        inputs: &InputHandles,
        sideways: &SidewaysHandles,
        external: &ExternalHandles,
        values: &Values,
        size: f64,
    ) {
        let at_the_end = |u: &[f64; 4]| u[1] + size * (u[2] + 0.5 * size * u[3]);
        let bend = |u: &[f64; 4]| u[2] + size * u[3];
        for (bends, variables) in self.bends.external.iter_mut().zip(external.bodies()) {
            *bends = variables.map(|variable| bend(values.taylor(variable)));
        }
        for (rates, variables) in self.external.iter_mut().zip(external.bodies()) {
            *rates = variables.map(|variable| at_the_end(values.taylor(variable)));
        }
        let LoadBends { force, lateral_force, track_rate, side_rate, .. } = &mut self.bends;
        let square = 0.5 * size * size;
        for (rates, bends, input) in [
            (&mut self.force, force, inputs.force),
            (&mut self.lateral_force, lateral_force, inputs.lateral_force),
            (&mut self.track_rate, track_rate, inputs.track_rate),
            (&mut self.side_rate, side_rate, sideways.rate),
        ] {
            let both = rates.iter_mut().zip(bends.iter_mut());
            for ((rate, end), u) in both.zip(values.taylors(input)) {
                *rate = at_the_end(u);
                *end = bend(u);
            }
            let both = rates.iter_mut().zip(bends);
            for ((rate, end), [fourth, fifth]) in both.zip(values.furthers(input)) {
                *rate += square * size / 3.0 * (fourth + 0.25 * size * fifth);
                *end += square * (fourth + size / 3.0 * fifth);
            }
        }
    }
}

impl Clone for State {
    fn clone(&self) -> Self {
        let LoadRates { force, lateral_force, track_rate, side_rate, external, motors, bends } =
            &self.rates;
        Self {
            vehicle: self.vehicle.clone(),
            journey: self.journey,
            key: self.key,
            fastest: self.fastest,
            loads: self.loads.clone(),
            rates: LoadRates {
                force: force.clone(),
                lateral_force: lateral_force.clone(),
                track_rate: track_rate.clone(),
                side_rate: side_rate.clone(),
                external: external.clone(),
                motors: motors.clone(),
                bends: bends.clone(),
            },
        }
    }

    /// Reuses the memory, so that saving and restoring need not allocate.
    fn clone_from(&mut self, source: &Self) {
        self.vehicle.clone_from(&source.vehicle);
        self.journey = source.journey;
        self.key = source.key;
        self.fastest = source.fastest;
        self.loads.clone_from(&source.loads);
        self.rates.force.clone_from(&source.rates.force);
        self.rates.lateral_force.clone_from(&source.rates.lateral_force);
        self.rates.track_rate.clone_from(&source.rates.track_rate);
        self.rates.side_rate.clone_from(&source.rates.side_rate);
        self.rates.external.clone_from(&source.rates.external);
        self.rates.motors.clone_from(&source.rates.motors);
        self.rates.bends.clone_from(&source.rates.bends);
    }
}
