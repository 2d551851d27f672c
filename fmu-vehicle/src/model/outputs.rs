//! What the vehicle shows of its state.

use fmi2_export::{Error, RealVar, Values};
use multibody::{AppliedForces, MagnetIndex, ObservedIndex};

use super::{VehicleFmu, find};
use crate::state::State;

impl VehicleFmu {
    pub(super) fn write_magnets(&self, state: &State, values: &mut Values, travelled: f64) {
        let (outputs, inputs) = (&self.outputs, &self.inputs);
        for k in 0..state.loads.len() {
            let motion = self.model.magnet(&state.vehicle, MagnetIndex(k));
            let height = values.real(inputs.track_displacement.get(k));
            let rate = values.real(inputs.track_rate.get(k));
            let gap = self.model.nominal_gap() + height - motion.displacement.z;
            values.set_real(outputs.gap.get(k), gap);
            values.set_real(outputs.gap_rate.get(k), rate - motion.velocity.z);
            let down = -self.model.magnet_acceleration(&self.work, MagnetIndex(k)).z;
            values.set_real(outputs.acceleration.get(k), down);
            let side = values.real(self.sideways.displacement.get(k));
            values.set_real(outputs.lateral_offset.get(k), motion.displacement.y - side);
            values.set_real(outputs.position.get(k), travelled + motion.position.x);
        }
        values.reals_mut(outputs.static_load).copy_from_slice(&state.loads);
    }

    pub(super) fn write_observed(&self, state: &State, values: &mut Values) {
        for (k, body) in self.outputs.observed.iter().enumerate() {
            let motion = self.model.observed_motion(&state.vehicle, ObservedIndex(k));
            values.set_real(body.lateral_displacement, motion.displacement.y);
            values.set_real(body.vertical_displacement, motion.displacement.z);
            let angles = self.model.observed_attitude(&state.vehicle, ObservedIndex(k));
            for (variable, angle) in body.attitude.iter().zip(angles) {
                values.set_real(*variable, angle);
            }
            let centre = self.model.observed_acceleration(&self.work, ObservedIndex(k));
            for (variable, value) in body.acceleration.iter().zip(centre.iter()) {
                values.set_real(*variable, *value);
            }
            for i in 0..body.point_vertical.len() {
                let point = self.model.point_acceleration(&self.work, ObservedIndex(k), i);
                values.set_real(body.point_lateral.get(i), point.y);
                values.set_real(body.point_vertical.get(i), point.z);
            }
        }
    }

    /// Finds the rates of the magnets' accelerations, and their second derivatives if they are `bent`.
    pub(super) fn differentiate(
        &mut self,
        state: &State,
        values: &Values,
        bent: bool,
    ) -> Result<(), Error> {
        if let Some(motors) = &mut self.motors {
            motors.hold(state, values, &mut [&mut self.work, &mut self.probe])?;
        }
        let Self { model, inputs, sideways, contact, external, loads, work, probe, jerks, .. } =
            self;
        let forces = AppliedForces {
            magnets: inputs.loads(values),
            external: loads.hold(external, values),
            acceleration: state.journey.acceleration,
        };
        let track = contact.track(values, (inputs, &*sideways), state.journey.speed);
        jerks
            .find(model, state, &forces, track.as_ref(), [work, probe], bent)
            .map_err(|e| Error::caused(&e))
    }

    /// Second derivatives on a straight track, of outputs that have them for interpolation.
    pub(super) fn second_derivative(
        &mut self,
        state: &State,
        values: &Values,
        output: RealVar,
    ) -> Result<Option<f64>, Error> {
        if let Some(k) = find(self.outputs.acceleration, output) {
            self.differentiate(state, values, true)?;
            return Ok(Some(self.jerks.snap(k)));
        }
        let outputs = &self.outputs;
        if find(outputs.static_load, output).is_some() {
            return Ok(Some(0.0));
        }
        let inertial = |k: usize| self.model.magnet_acceleration(&self.work, MagnetIndex(k));
        if let Some(k) = find(outputs.lateral_offset, output) {
            return Ok(Some(inertial(k).y - state.rates.side_rate[k]));
        }
        Ok(find(outputs.position, output).map(|k| inertial(k).x))
    }
}
