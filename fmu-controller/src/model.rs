//! Maps the unit's variables to the physics.

use fmi2_export::{
    Error, Interface, Model, RealVar, Resources, Seed, Sensitivity, StateSpace, Step, Values,
};
use magnet::{
    ControllerInputs, ControllerParameters, ControllerRates, ControllerState, ControllerWorkspace,
    InputCourse, VoltageController,
};
use serde::{Deserialize, Serialize};

use crate::table::{self, ParameterHandles, Signals};

/// The unit: handles of its variables, and the controller for the parameters last used.
#[derive(Debug, Clone)]
pub struct ControllerFmu {
    signals: Signals,
    parameters: ParameterHandles,
    /// A cache: rebuilt if a state was computed with other parameters.
    controller: VoltageController,
    workspace: ControllerWorkspace,
    /// Derivatives of all outputs, computed once for the calls of one communication point.
    rates: ControllerRates,
}

/// Everything that changes while stepping.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct State {
    controller: ControllerState,
    /// The parameters with which this state was computed; tunable ones may change between steps.
    parameters: ControllerParameters,
    /// Rate of the acceleration at the end of the last step: for the outputs' derivatives.
    jerk: f64,
}

impl ControllerFmu {
    fn read(&self, values: &Values) -> ControllerInputs {
        ControllerInputs {
            gap: values.real(self.signals.gap),
            gap_rate: values.real(self.signals.gap_rate),
            acceleration: values.real(self.signals.acceleration),
        }
    }

    /// The controller with the given parameters.
    fn controller(
        &mut self,
        parameters: &ControllerParameters,
    ) -> Result<&VoltageController, Error> {
        if self.controller.parameters() != parameters {
            self.controller =
                VoltageController::new(*parameters).map_err(|error| Error::caused(&error))?;
        }
        Ok(&self.controller)
    }
}

impl Model for ControllerFmu {
    type State = State;

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(table::info());
        let signals = Signals::declare(interface);
        let parameters = ParameterHandles::declare(interface);
        signals.depend(interface, &parameters);
        let controller = VoltageController::new(ControllerParameters::default())
            .map_err(|error| Error::caused(&error))?;
        let (workspace, rates) = (ControllerWorkspace::default(), ControllerRates::default());
        Ok(Self { signals, parameters, controller, workspace, rates })
    }

    fn copied(&self, _: &Resources) -> Option<Self> {
        Some(self.clone())
    }

    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<State, Error> {
        let parameters = self.parameters.read(values).map_err(|error| Error::caused(&error))?;
        let inputs = self.read(values);
        let controller = self
            .controller(&parameters)?
            .initialise(&inputs, time)
            .map_err(|error| at(time, &error))?;
        Ok(State { controller, parameters, jerk: 0.0 })
    }

    fn outputs(&mut self, state: &State, values: &mut Values, _: f64) -> Result<(), Error> {
        let inputs = self.read(values);
        let outputs = self.controller(&state.parameters)?.outputs(&state.controller, &inputs);
        values.set_real(self.signals.voltage, outputs.voltage);
        values.set_real(self.signals.held_voltage, outputs.voltage);
        values.set_real(self.signals.transient_voltage, state.controller.transient_voltage);
        for (variable, estimate) in self.signals.estimates.iter().zip(outputs.estimates) {
            values.set_real(*variable, estimate);
        }
        Ok(())
    }

    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        let course = InputCourse {
            gap: *values.taylor(self.signals.gap),
            acceleration: *values.taylor(self.signals.acceleration),
            ..InputCourse::default()
        };
        self.controller(&state.parameters)?;
        self.controller
            .step(&mut state.controller, &course, step.time, step.size, &mut self.workspace)
            .map_err(|error| at(step.time, &error))?;
        let [_, first, second, third] = course.acceleration;
        state.jerk = first + step.size * (second + 0.5 * step.size * third);
        Ok(())
    }

    fn parameters_changed(&mut self, state: &mut State, values: &mut Values) -> Result<(), Error> {
        let parameters = self.parameters.read(values).map_err(|error| Error::caused(&error))?;
        self.controller(&parameters)?;
        state.parameters = parameters;
        Ok(())
    }

    fn prepare_derivatives(&mut self, state: &State, values: &Values) -> Result<(), Error> {
        let inputs = self.read(values);
        self.rates =
            self.controller(&state.parameters)?.rates(&state.controller, &inputs, state.jerk);
        Ok(())
    }

    fn output_derivative(
        &mut self,
        _: &State,
        _: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        if order != 1 {
            return Ok(None);
        }
        if output == self.signals.voltage {
            return Ok(Some(self.rates.voltage));
        }
        if output == self.signals.transient_voltage {
            return Ok(Some(0.0));
        }
        let estimate = self.signals.estimates.iter().position(|&estimate| estimate == output);
        Ok(estimate.and_then(|k| self.rates.estimates.get(k).copied()))
    }

    fn directional_derivative(
        &mut self,
        state: &State,
        _: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        let Signals { acceleration, voltage, held_voltage, estimates, .. } = self.signals;
        let [_, _, acceleration_estimate, ..] = estimates;
        let controller = self.controller(&state.parameters)?;
        let along = seed.real(acceleration);
        for output in [voltage, held_voltage] {
            result.set_real(output, controller.voltage_by_acceleration(&state.controller) * along);
        }
        result.set_real(acceleration_estimate, magnet::ACCELERATION_SCALE * along);
        Ok(true)
    }

    /// The report `linear`: eqs 3-5, with x = (x₁ … x₅).
    fn report(
        &mut self,
        state: &State,
        _: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        if request != StateSpace::REQUEST {
            return Ok(None);
        }
        if state.parameters.control.sampling.is_some() {
            return Err(Error::invalid(
                "a sampled controller has no linear differential equation; set sample_time to 0",
            ));
        }
        let signals = self.signals;
        let controller = self.controller(&state.parameters)?;
        let mut system = StateSpace::default();
        for name in ["x1", "x2", "x3", "x4", "x5"] {
            system.state(name);
        }
        let inputs = [system.input(signals.gap), system.input(signals.acceleration)];
        let (a, b) = controller.linear_system();
        for (i, (a, b)) in a.iter().zip(b).enumerate() {
            for (j, &value) in a.iter().enumerate() {
                system.a(i, j, value);
            }
            for (&input, &value) in inputs.iter().zip(b) {
                system.b(i, input, value);
            }
        }
        let [_, acceleration] = inputs;
        for output in [signals.voltage, signals.held_voltage] {
            let voltage = system.output(output);
            for (j, &value) in controller.voltage_by_state().iter().enumerate() {
                system.c(voltage, j, value);
            }
            system.d(voltage, acceleration, controller.voltage_by_acceleration(&state.controller));
        }
        // constant
        system.output(signals.transient_voltage);
        let filter = controller.filter();
        for (k, &estimate) in signals.estimates.iter().enumerate() {
            let row = system.output(estimate);
            for (j, &value) in filter.c[k].iter().enumerate() {
                system.c(row, j, value);
            }
            let [_, by_acceleration] = filter.d[k];
            system.d(row, acceleration, magnet::ACCELERATION_SCALE * by_acceleration);
        }
        system.to_json().map(Some)
    }
}

fn at(time: f64, error: &magnet::Error) -> Error {
    Error::caused(error).context(format_args!("at t = {time} s"))
}
