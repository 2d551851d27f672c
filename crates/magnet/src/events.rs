//! Events at counted instants within a step: samples of the controller, failures, phases of lift-off
//! and set-down.

use crate::{
    Error,
    conditions::Signals,
    inputs::{InputCourse, MagnetInputs},
    runge_kutta::{self, Excitation},
    sampling::{self, Next},
    sensors::SensorKnots,
    state::State,
    system::Magnet,
};

/// Instants closer than this fraction of a step count as one, so that a step that is meant to end at
/// an instant does so despite rounding.
const COINCIDENCE: f64 = 1e-9;

impl Magnet {
    /// Integrates over `size` from `time`, in pieces that end at events. An event that falls on the
    /// end of a step is taken at the start of the next, when the inputs of that instant are known.
    pub(crate) fn integrate(
        &self,
        state: &mut State,
        course: &InputCourse,
        time: f64,
        size: f64,
    ) -> Result<(), Error> {
        let knots = SensorKnots::default();
        let tolerance = COINCIDENCE * size + 4.0 * f64::EPSILON * (time.abs() + size);
        let mut elapsed = 0.0;
        while elapsed < size {
            let signals = course.signals(elapsed);
            let mut until =
                self.take_events(state, [time, elapsed, size], tolerance, &signals, &knots);
            if let Some(instant) = self.next_switch(time + elapsed + tolerance)
                && instant - time < size - tolerance
            {
                until = until.min(instant - time);
            }
            let held = match (self.is_off(state), self.is_sampled()) {
                (true, _) => Some(0.0),
                (false, true) => Some(state.hold.applied),
                (false, false) => None,
            };
            let drive = Excitation { course, time, held, knots: &knots };
            runge_kutta::integrate(self, state, &drive, elapsed, until)?;
            elapsed = until;
        }
        Ok(())
    }

    /// Takes the events that are due `elapsed` after the start of a step of `size` from `time`.
    /// Returns until when the controller's voltage then remains.
    fn take_events(
        &self,
        state: &mut State,
        [time, elapsed, size]: [f64; 3],
        tolerance: f64,
        signals: &Signals,
        knots: &SensorKnots,
    ) -> f64 {
        let now = time + elapsed;
        if self.is_conditioned() {
            self.switch(state, now, tolerance, signals.values, knots);
        }
        let Some(sampling) = self.parameters().control.sampling else { return size };
        loop {
            match sampling::next(&state.hold, sampling.period, time, elapsed, size) {
                Next::Hold { until } => return until,
                Next::Sample => {
                    if let Some(sensors) = &self.parameters().conditions.sensors {
                        sensors.sample(&mut state.condition.readings, now, signals.values, knots);
                    }
                    let seen = self.seen(state, now, signals, knots);
                    let voltage = self.demand(state, &seen);
                    state.hold.take(voltage, sampling.delay);
                }
            }
        }
    }

    /// The state after the events that are due at its time. Outputs have the values before them, their
    /// derivatives those after them: the former end a step, the latter are for the next one.
    pub(crate) fn after_events(&self, state: &State, inputs: &MagnetInputs) -> State {
        let mut next = *state;
        if self.is_sampled() || self.is_conditioned() {
            let signals = inputs.signals();
            let tolerance = 4.0 * f64::EPSILON * state.time.abs();
            // a step so short that only what is due now falls into it
            let step = [state.time, 0.0, tolerance];
            self.take_events(&mut next, step, tolerance, &signals, &SensorKnots::default());
        }
        next
    }

    /// Takes changed failures, lift-off and set-down into a state that was computed with others, at
    /// the state's time.
    pub fn apply_changes(&self, state: &mut State, inputs: &MagnetInputs) {
        let values = inputs.signals().values;
        self.switch(state, state.time, 0.0, values, &SensorKnots::default());
    }
}
