//! Maps the unit's variables to the physics.

use fmi2_export::{
    Error, Interface, Model, RealVar, Resources, Seed, Sensitivity, StateSpace, Step, Values,
};
use magnet::{
    FurtherCourse, InputCourse, InputRates, Magnet, MagnetParameters, OutputRates, Workspace,
};
use serde::{Deserialize, Serialize};

use crate::command::CommandHandles;
use crate::conditions::{self, ConditionHandles};
use crate::lift::LiftHandles;
use crate::linear;
use crate::parameters::ParameterHandles;
use crate::table::{self, DerivedHandles, InputHandles, OutputHandles};

/// The unit: handles of its variables, and the magnet for the parameters last used.
#[derive(Debug, Clone)]
pub struct EmsFmu {
    inputs: InputHandles,
    outputs: OutputHandles,
    derived: DerivedHandles,
    parameters: ParameterHandles,
    command: CommandHandles,
    conditions: ConditionHandles,
    lift: LiftHandles,
    /// Of the instance's name, for the seed of the noise of a state that starts here.
    salt: u64,
    /// A cache: rebuilt if a state was computed with other parameters.
    magnet: Magnet,
    workspace: Workspace,
    /// Derivatives of all outputs, computed once for the calls of one communication point.
    rates: OutputRates,
}

/// Everything that changes while stepping.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct State {
    magnet: magnet::State,
    /// The parameters with which this state was computed; tunable ones may change between steps.
    parameters: MagnetParameters,
    /// Derivatives of the inputs at the end of the last step: for the outputs' derivatives.
    rates: InputRates,
    /// Of the name of the instance in which the run began, whose noise this state keeps.
    salt: u64,
}

impl EmsFmu {
    /// The inputs' values now.
    fn read(&self, values: &Values) -> magnet::MagnetInputs {
        magnet::MagnetInputs {
            gap: values.real(self.inputs.gap),
            gap_rate: values.real(self.inputs.gap_rate),
            acceleration: values.real(self.inputs.acceleration),
            lateral_offset: values.real(self.inputs.lateral_offset),
            static_force: values.real(self.inputs.static_force),
            voltage_command: values.real(self.command.voltage_command),
            transient_voltage: values.real(self.command.transient_voltage),
        }
    }

    /// The parameters' values now, with the noise of an instance whose name has this salt.
    fn parameters(&self, values: &Values, salt: u64) -> Result<MagnetParameters, Error> {
        let read = self.parameters.read(values, &self.command, &self.conditions, salt);
        let lift_loss = values.boolean(self.lift.lift_loss);
        let read = read.map(|read| MagnetParameters { lift_loss, ..read });
        read.map_err(|error| Error::caused(&error))
    }

    /// The magnet with the given parameters.
    fn magnet(&mut self, parameters: &MagnetParameters) -> Result<&Magnet, Error> {
        if self.magnet.parameters() != parameters {
            self.magnet = Magnet::new(*parameters).map_err(|error| Error::caused(&error))?;
        }
        Ok(&self.magnet)
    }
}

impl Model for EmsFmu {
    type State = State;

    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(table::info());
        let inputs = InputHandles::declare(interface);
        let outputs = OutputHandles::declare(interface);
        let derived = DerivedHandles::declare(interface);
        let parameters = ParameterHandles::declare(interface);
        let command = CommandHandles::declare(interface);
        let conditions = ConditionHandles::declare(interface);
        let lift = LiftHandles::declare(interface);
        table::depend(interface, &inputs, &outputs, &derived, &parameters, &command, &conditions);
        table::depend_on_offset(interface, &inputs, &outputs, &parameters, &lift);
        let salt = conditions::salt(resources.instance_name());
        let magnet =
            Magnet::new(MagnetParameters::default()).map_err(|error| Error::caused(&error))?;
        let (workspace, rates) = (Workspace::default(), OutputRates::default());
        Ok(Self {
            inputs,
            outputs,
            derived,
            parameters,
            command,
            conditions,
            lift,
            salt,
            magnet,
            workspace,
            rates,
        })
    }

    fn copied(&self, resources: &Resources) -> Option<Self> {
        Some(Self { salt: conditions::salt(resources.instance_name()), ..self.clone() })
    }

    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<State, Error> {
        let salt = self.salt;
        let parameters = self.parameters(values, salt)?;
        let inputs = self.read(values);
        let derived = self.derived;
        let magnet = self.magnet(&parameters)?;
        let state = magnet.initialise(&inputs, time).map_err(|error| at(time, &error))?;
        let constants = magnet.electromagnet();
        values.set_real(derived.inductance, constants.inductance);
        values.set_real(derived.current_stiffness, constants.current_stiffness);
        values.set_real(derived.gap_stiffness, constants.gap_stiffness);
        values.set_real(derived.nominal_force, constants.nominal_force);
        Ok(State { magnet: state, parameters, rates: InputRates::default(), salt })
    }

    fn outputs(&mut self, state: &State, values: &mut Values, time: f64) -> Result<(), Error> {
        let inputs = self.read(values);
        let outputs = self
            .magnet(&state.parameters)?
            .outputs(&state.magnet, &inputs)
            .map_err(|error| at(time, &error))?;
        values.set_real(self.outputs.force, outputs.force);
        values.set_real(self.outputs.lateral_force, outputs.lateral_force);
        values.set_real(self.outputs.current, outputs.current);
        values.set_real(self.outputs.voltage, outputs.voltage);
        for (variable, estimate) in self.outputs.estimates.iter().zip(outputs.estimates) {
            values.set_real(*variable, estimate);
        }
        let [gap, acceleration] = outputs.readings;
        values.set_real(self.conditions.measured_gap, gap);
        values.set_real(self.conditions.measured_acceleration, acceleration);
        values.set_real(self.conditions.reference_gap, outputs.reference_gap);
        values.set_real(self.lift.lost_lift, outputs.lost_lift);
        Ok(())
    }

    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        let course = InputCourse {
            gap: *values.taylor(self.inputs.gap),
            acceleration: *values.taylor(self.inputs.acceleration),
            voltage_command: *values.taylor(self.command.voltage_command),
            lateral_offset: *values.taylor(self.inputs.lateral_offset),
            further: FurtherCourse {
                gap: *values.further(self.inputs.gap),
                acceleration: *values.further(self.inputs.acceleration),
                voltage_command: *values.further(self.command.voltage_command),
                lateral_offset: *values.further(self.inputs.lateral_offset),
            },
        };
        self.magnet(&state.parameters)?;
        self.magnet
            .step(&mut state.magnet, &course, step.time, step.size, &mut self.workspace)
            .map_err(|error| refused(&error))?;
        let slope = |input| slope(values.taylor(input), values.further(input), step.size);
        let bend = |input| bend(values.taylor(input), values.further(input), step.size);
        state.rates = InputRates {
            gap_acceleration: slope(self.inputs.gap_rate),
            jerk: slope(self.inputs.acceleration),
            static_force_rate: slope(self.inputs.static_force),
            static_force_acceleration: bend(self.inputs.static_force),
            voltage_command_rate: slope(self.command.voltage_command),
            offset_rate: slope(self.inputs.lateral_offset),
            offset_acceleration: bend(self.inputs.lateral_offset),
        };
        Ok(())
    }

    fn parameters_changed(&mut self, state: &mut State, values: &mut Values) -> Result<(), Error> {
        let parameters = self.parameters(values, state.salt)?;
        let inputs = self.read(values);
        let conditions = &state.parameters.conditions;
        conditions
            .check_change(&parameters.conditions, state.magnet.time)
            .map_err(|error| Error::caused(&error))?;
        self.magnet(&parameters)?.apply_changes(&mut state.magnet, &inputs);
        state.parameters = parameters;
        Ok(())
    }

    fn prepare_derivatives(&mut self, state: &State, values: &Values) -> Result<(), Error> {
        let inputs = self.read(values);
        self.rates = self
            .magnet(&state.parameters)?
            .rates(&state.magnet, &inputs, &state.rates)
            .map_err(|error| Error::caused(&error))?;
        Ok(())
    }

    fn output_derivative(
        &mut self,
        state: &State,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        if output == self.outputs.lateral_force {
            let (inputs, lift) = (self.read(values), self.rates);
            let rates = self
                .magnet(&state.parameters)?
                .lateral_rates(&state.magnet, &inputs, &state.rates, &lift)
                .map_err(|error| Error::caused(&error))?;
            return Ok(rates.get(order as usize - 1).copied());
        }
        let (outputs, rates) = (&self.outputs, &self.rates);
        let estimate = || outputs.estimates.iter().position(|&estimate| estimate == output);
        Ok(match order {
            1 if output == outputs.force => Some(rates.force),
            1 if output == outputs.current => Some(rates.current),
            1 if output == outputs.voltage => Some(rates.voltage),
            1 => estimate().and_then(|k| rates.estimates.get(k).copied()),
            2 if output == outputs.force => Some(rates.force_second),
            _ => None,
        })
    }

    fn directional_derivative(
        &mut self,
        state: &State,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        let inputs = self.read(values);
        let (handles, outputs) = (self.inputs, self.outputs);
        let partials = self
            .magnet(&state.parameters)?
            .partials(&state.magnet, &inputs)
            .map_err(|error| Error::caused(&error))?;
        let (gap, static_force) = (seed.real(handles.gap), seed.real(handles.static_force));
        let acceleration = seed.real(handles.acceleration);
        let offset = seed.real(handles.lateral_offset);
        let [_, _, acceleration_estimate, ..] = outputs.estimates;
        result.set_real(
            outputs.force,
            partials.force_by_gap * gap
                + partials.force_by_static_force * static_force
                + partials.force_by_offset * offset,
        );
        result.set_real(
            outputs.lateral_force,
            partials.lateral_force_by_gap * gap
                + partials.lateral_force_by_static_force * static_force
                + partials.lateral_force_by_offset * offset,
        );
        result.set_real(
            outputs.current,
            partials.current_by_gap * gap + partials.current_by_offset * offset,
        );
        let [lost_by_gap, lost_by_offset] = partials.lost_lift;
        result.set_real(self.lift.lost_lift, lost_by_gap * gap + lost_by_offset * offset);
        result.set_real(
            outputs.voltage,
            partials.voltage_by_acceleration * acceleration
                + partials.voltage_by_command * seed.real(self.command.voltage_command),
        );
        result.set_real(acceleration_estimate, partials.estimate_by_acceleration * acceleration);
        let [gap_slope, acceleration_slope] = partials.reading_slopes;
        result.set_real(self.conditions.measured_gap, gap_slope * gap);
        result.set_real(self.conditions.measured_acceleration, acceleration_slope * acceleration);
        Ok(true)
    }

    fn report(
        &mut self,
        state: &State,
        values: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        if request != StateSpace::REQUEST {
            return Ok(None);
        }
        let now = self.read(values);
        let Self { inputs, outputs, command, .. } = self;
        linear::report(&state.parameters, &state.magnet, &now, inputs, outputs, command).map(Some)
    }
}

/// First derivative of an input at the end of a step, after which the kit discards the polynomial.
fn slope(u: &[f64; 4], further: &[f64; 2], size: f64) -> f64 {
    let [fourth, fifth] = further;
    let cube = size * size * size;
    u[1] + size * (u[2] + 0.5 * size * u[3]) + cube / 6.0 * (fourth + 0.25 * size * fifth)
}

/// Second derivative of an input at the end of a step.
fn bend(u: &[f64; 4], [fourth, fifth]: &[f64; 2], size: f64) -> f64 {
    u[2] + size * u[3] + 0.5 * size * size * (fourth + size / 3.0 * fifth)
}

fn at(time: f64, error: &magnet::Error) -> Error {
    Error::caused(error).context(format_args!("at t = {time} s"))
}

/// A closed gap and a lost guidance are the end of what the unit describes: the run ends there, as a result. A smaller step may help against
/// limits that switch too often.
fn refused(error: &magnet::Error) -> Error {
    match error {
        magnet::Error::GapClosed { .. } | magnet::Error::GuidanceLost { .. } => {
            Error::terminated(error)
        }
        magnet::Error::Chattering { .. } => Error::discard(error),
        _ => Error::caused(error),
    }
}
