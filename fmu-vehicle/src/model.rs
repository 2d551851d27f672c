//! Maps the unit's variables to the physics.

mod outputs;

use fmi2_export::{
    Error, Interface, Model, Motions, RealVar, RealVars, Resources, Seed, Sensitivity, StateSpace,
    Step, Values,
};
use linear_motor::MotorDescription;
use multibody::{
    AppliedCourse, AppliedForces, Contact, Equilibrium, FurtherCourse, Holding, LoadCourse, Loads,
    MagnetIndex, ObservedIndex, Rails, Travel, VehicleModel, Workspace,
};
use track_line::Line;

use crate::adjustments::{AS_IN_FILE, Adjustments};
use crate::contact::{ContactHandles, check_linear};
use crate::dependencies::{Handles, depend};
use crate::external::{ExternalHandles, ExternalLoads};
use crate::jerks::Jerks;
use crate::journey::JourneyHandles;
use crate::line::{self, LineHandles};
use crate::linear;
use crate::modes::{self, At};
use crate::motors::{self, MotorHandles};
use crate::resting::Resting;
use crate::start;
use crate::state::{LoadRates, State};
use crate::table::{self, InputHandles, OutputHandles, ParameterHandles, SidewaysHandles};

/// The unit: the assembled vehicle, the handles of its variables, scratch memory.
#[derive(Debug, Clone)]
pub struct VehicleFmu {
    /// A cache: built anew if a state belongs to other values of the parameters.
    model: VehicleModel,
    /// Fingerprint of the parameters' values that `model` was built for.
    key: u64,
    /// The last equilibrium, with what it was found for.
    resting: Resting,
    adjustments: Adjustments,
    inputs: InputHandles,
    outputs: OutputHandles,
    parameters: ParameterHandles,
    contact: ContactHandles,
    external: ExternalHandles,
    journey: JourneyHandles,
    sideways: SidewaysHandles,
    /// The line of the resources; the vehicle's model has it too.
    line: Option<Line>,
    line_outputs: Option<LineHandles>,
    /// The motors of the resources; the vehicle's model has them too.
    motor_file: Option<MotorDescription>,
    motors: Option<MotorHandles>,
    /// Memory for the values of the external loads.
    loads: ExternalLoads,
    work: Workspace,
    /// Used for derivatives, so that `work` keeps the results of the current state.
    probe: Workspace,
    /// Scratch state: a step runs on it and is copied when it has succeeded.
    trial: multibody::State,
    jerks: Jerks,
}

/// Internal steps above this keep factors over stages, s. Those of the shipped scenarios, 1 ms, do not.
const FACTORS_KEPT_ABOVE: f64 = 1.5e-3;

/// The vehicle on its line and with its motors, as this unit steps it.
fn ready(
    model: VehicleModel,
    line: Option<&Line>,
    motors: Option<&MotorDescription>,
) -> Result<VehicleModel, Error> {
    let model = motors::place(line::place(model, line)?, motors)?;
    Ok(model.with_factors_kept_above(FACTORS_KEPT_ABOVE))
}

/// Only a step whose joints cannot be closed may succeed with a smaller size.
fn refused(error: &multibody::Error) -> Error {
    match error {
        multibody::Error::Projection { .. } => Error::discard(error),
        _ => Error::caused(error),
    }
}

impl VehicleFmu {
    /// Makes the vehicle be that of the parameters' values, whose fingerprint is `key`.
    fn use_vehicle(&mut self, key: u64, values: &Values) -> Result<(), Error> {
        if self.key == key {
            return Ok(());
        }
        let model = self.adjustments.build(values)?;
        let model = ready(model, self.line.as_ref(), self.motor_file.as_ref())?;
        self.work = model.workspace();
        self.probe = model.workspace();
        self.trial = model.initial_state();
        self.jerks = Jerks::new(&model);
        (self.model, self.key) = (model, key);
        Ok(())
    }

    /// Makes the vehicle be that of a state, which may have been restored.
    fn use_vehicle_of(&mut self, state: &State, values: &Values) -> Result<(), Error> {
        if self.key == state.key {
            return Ok(());
        }
        let key = self.adjustments.key(values);
        if key != state.key {
            let text = "the vehicle's state belongs to other parameters; initialize again";
            return Err(Error::invalid(text));
        }
        self.use_vehicle(key, values)
    }

    /// Equilibrium below the track as it is now: at rest on a straight track, otherwise in steady motion along
    /// the line.
    fn equilibrium(
        &mut self,
        values: &Values,
        travel: Option<Travel>,
        time: f64,
    ) -> Result<Equilibrium, Error> {
        let holding = Holding {
            stiffness: values.real(self.parameters.holding_stiffness),
            ..Holding::default()
        };
        self.loads.hold(&self.external, values);
        let external = &self.loads.now;
        // all that the equilibrium depends on: an importer that connects units asks for it again and again
        let numbers = [holding.stiffness, values.real(self.parameters.pole_width)];
        let flags = [self.parameters.lateral_guidance, self.sideways.lift_loss];
        let flags = flags.map(|flag| f64::from(u8::from(values.boolean(flag))));
        let track = [self.inputs.track_displacement, self.sideways.displacement];
        let track = track.map(|row| values.reals(row));
        let carried = line::curved(&self.model, travel);
        let way = carried.map_or([f64::NAN; 2], |it| [it.place, it.speed]);
        let asked = [&numbers, &flags, &way, track[0], track[1], external.as_flattened()];
        if let Some(mut known) = self.resting.find(self.key, &asked) {
            known.state.time = time;
            return Ok(known);
        }
        let rails = Rails {
            height: values.reals(self.inputs.track_displacement),
            side: values.reals(self.sideways.displacement),
        };
        // the same law as in the ems unit, bit for bit: the equilibrium uses the forces that the
        // magnets then exert
        let guided = values.boolean(self.parameters.lateral_guidance);
        let width = values.real(self.parameters.pole_width);
        let loss = values.boolean(self.sideways.lift_loss);
        let guidance = |load: f64, gap: f64, offset: f64| {
            if !guided {
                return [0.0; 2];
            }
            if loss {
                return magnet::lateral_force_with_loss(load, gap, offset, width);
            }
            [
                magnet::lateral_force(load, gap, offset, width),
                magnet::lateral_stiffness(load, gap, offset, width),
            ]
        };
        let mut equilibrium = self
            .model
            .carried_equilibrium(carried, &rails, &holding, &guidance, external, &mut self.work)
            .map_err(|e| Error::caused(&e).context(format_args!("at t = {time} s")))?;
        self.resting.remember(self.key, &asked, &equilibrium);
        equilibrium.state.time = time;
        Ok(equilibrium)
    }

    /// Static equilibrium on the skids below the track as it is now.
    fn landed(
        &mut self,
        values: &Values,
        contact: &Contact,
        levitated: &Equilibrium,
    ) -> Result<multibody::State, Error> {
        let track = values.reals(self.inputs.track_displacement);
        let found = self
            .model
            .skid_equilibrium(track, contact, &Holding::default(), levitated, &mut self.work)
            .map_err(|e| {
                let time = levitated.state.time;
                Error::caused(&e).context(format_args!("start_on_skids at t = {time} s"))
            })?;
        Ok(multibody::State { time: levitated.state.time, ..found.state })
    }

    /// At the nominal gap no stop and no skid may touch, or it would not be an equilibrium.
    fn check_levitated(
        &self,
        values: &Values,
        state: &multibody::State,
        speed: f64,
    ) -> Result<(), Error> {
        let Some(track) = self.contact.track(values, (&self.inputs, &self.sideways), speed) else {
            return Ok(());
        };
        let touches = |k: &MagnetIndex| self.model.contact_force(state, *k, &track).z != 0.0;
        match self.model.magnets().find(touches) {
            None => Ok(()),
            Some(k) => Err(Error::invalid(format!(
                "magnet {} touches the rail at the start: the track is too rough for stops and skids at \
                 these gaps (contact_stop_gap, contact_skid_gap)",
                k.0 + 1
            ))),
        }
    }
}

/// Index of a variable in a row.
fn find(row: RealVars, variable: RealVar) -> Option<usize> {
    variable
        .value_reference()
        .checked_sub(row.checked_get(0)?.value_reference())
        .map(|k| k as usize)
        .filter(|k| *k < row.len())
}

impl Model for VehicleFmu {
    type State = State;

    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        let text = resources.read_to_string("vehicle.json")?;
        let failed = |e: multibody::Error| Error::caused(&e).context("resource vehicle.json");
        let (layout, model) = VehicleModel::described(&text).map_err(failed)?;
        let line = line::read(resources)?;
        let motor_file = motors::read(resources)?;
        let model = ready(model, line.as_ref(), motor_file.as_ref())?;
        interface.describe(table::info(&model));
        let parameters = ParameterHandles::declare(interface);
        let inputs = InputHandles::declare(interface, model.counts().magnets);
        let outputs = OutputHandles::declare(interface, &model);
        table::declare_constants(interface, &model);
        let contact = ContactHandles::declare(interface, &model);
        let external = ExternalHandles::declare(interface, &model);
        let adjustments = Adjustments::declare(interface, layout)?;
        let journey = JourneyHandles::declare(interface, &parameters);
        let sideways = SidewaysHandles::declare(interface, model.counts().magnets);
        let line_outputs = LineHandles::declare(interface, line.as_ref());
        let motors = MotorHandles::declare(interface, &model, motor_file.as_ref())?;
        let handles = Handles {
            inputs: &inputs,
            outputs: &outputs,
            parameters: &parameters,
            contact: &contact,
            external: &external,
            journey: &journey,
            sideways: &sideways,
            line: line_outputs.as_ref(),
            motors: motors.as_ref(),
            adjustments: &adjustments,
        };
        depend(interface, &model, &handles);
        Ok(Self {
            work: model.workspace(),
            probe: model.workspace(),
            trial: model.initial_state(),
            jerks: Jerks::new(&model),
            loads: external.memory(),
            model,
            key: AS_IN_FILE,
            resting: Resting::default(),
            adjustments,
            inputs,
            outputs,
            parameters,
            contact,
            external,
            journey,
            sideways,
            line,
            line_outputs,
            motor_file,
            motors,
        })
    }

    fn copied(&self, _: &Resources) -> Option<Self> {
        Some(self.clone())
    }

    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<State, Error> {
        let key = self.adjustments.key(values);
        self.use_vehicle(key, values)?;
        values.set_real(self.adjustments.mass(), self.model.total_mass());
        // the start's equilibrium is that of motors without current
        for work in [&mut self.work, &mut self.probe] {
            work.supply(None).map_err(|e| Error::caused(&e))?;
        }
        let journey = self.journey.start(values, time);
        let (contact, landed) = self.contact.start(&self.model, values, journey.speed)?;
        let travel = line::travel(&self.model, &journey, time);
        line::check_start(&self.model, travel, landed)?;
        let equilibrium = self.equilibrium(values, travel, time)?;
        start::check_place(&self.model, &equilibrium.state)?;
        let mut vehicle = if landed {
            self.landed(values, &contact, &equilibrium)?
        } else {
            self.check_levitated(values, &equilibrium.state, journey.speed)?;
            equilibrium.state
        };
        vehicle.travel = travel;
        let mut rates = LoadRates::zero(equilibrium.loads.len(), self.loads.now.len());
        rates.motors = vec![0.0; self.motors.as_ref().map_or(0, MotorHandles::rate_count)];
        // found when the simulation begins
        let fastest = 0.0;
        Ok(State { vehicle, journey, key, fastest, rates, loads: equilibrium.loads })
    }

    fn begins(&mut self, state: &mut State) -> Result<(), Error> {
        // known at the start's equilibrium, which is that of motors without current
        self.probe.supply(None).map_err(|e| Error::caused(&e))?;
        if let Some(found) = self.resting.found() {
            state.fastest = start::fastest(&self.model, found, &mut self.probe)?;
        }
        Ok(())
    }

    fn outputs(&mut self, state: &State, values: &mut Values, time: f64) -> Result<(), Error> {
        self.use_vehicle_of(state, values)?;
        if let Some(motors) = &mut self.motors {
            motors.hold(state, values, &mut [&mut self.work])?;
        }
        let external = self.loads.hold(&self.external, values);
        self.model
            .accelerations_in_contact(
                &state.vehicle,
                AppliedForces {
                    magnets: self.inputs.loads(values),
                    external,
                    acceleration: state.journey.acceleration,
                },
                self.contact
                    .track(values, (&self.inputs, &self.sideways), state.journey.speed)
                    .as_ref(),
                &mut self.work,
            )
            .map_err(|e| Error::caused(&e))?;
        self.contact.write(&self.model, state, (&self.inputs, &self.sideways), values);
        self.write_magnets(state, values, state.journey.place_at(time));
        self.write_observed(state, values);
        if let Some(motors) = &self.motors {
            motors.write(&self.model, state, &self.work, values, state.journey.place_at(time));
        }
        if let Some(outputs) = &self.line_outputs {
            outputs.write(&self.model, state.journey.place_at(time), values);
        }
        let outputs = &self.outputs;
        let speed = state.journey.speed + self.model.relative_speed(&state.vehicle);
        values.set_real(outputs.speed, speed);
        let (opening, rate) = self.model.constraint_violation(&state.vehicle, &mut self.work);
        values.set_real(outputs.joint_opening, opening);
        values.set_real(outputs.joint_opening_rate, rate);
        values.set_real(outputs.kinetic_energy, self.model.kinetic_energy(&state.vehicle));
        Ok(())
    }

    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        self.use_vehicle_of(state, values)?;
        let magnets = LoadCourse {
            vertical: values.taylors(self.inputs.force),
            lateral: values.taylors(self.inputs.lateral_force),
        };
        let mut speed = self.journey.speed_course(values);
        if self.motors.is_some() {
            speed = motors::spread(speed, state.journey.speed, step.size);
        }
        let [_, a, j, s] = speed;
        let course = AppliedCourse {
            magnets,
            further: FurtherCourse {
                vertical: values.furthers(self.inputs.force),
                lateral: values.furthers(self.inputs.lateral_force),
            },
            external: self.loads.follow(&self.external, values),
            acceleration: [a, j, s, 0.0],
        };
        let track = self.contact.course(values, (&self.inputs, &self.sideways), speed);
        let max_step =
            values.real(self.parameters.max_step).min(start::longest_step(state.fastest));
        self.trial.clone_from(&state.vehicle);
        self.trial.time = step.time;
        self.trial.travel = line::travel(&self.model, &state.journey, step.time)
            .map(|travel| Travel { speed: speed[0], ..travel });
        let jump = speed[0] - state.journey.speed;
        if let Some(motors) = &self.motors {
            motors.follow(values, speed, &mut self.work)?;
        } else if jump != 0.0 {
            self.model.jump(&mut self.trial, jump, &mut self.work).map_err(|e| refused(&e))?;
        }
        self.model
            .step_in_contact(
                &mut self.trial,
                step.size,
                max_step,
                course,
                track.as_ref(),
                &mut self.work,
            )
            .map_err(|e| refused(&e))?;
        state.vehicle.clone_from(&self.trial);
        state.journey = state.journey.after(speed, step);
        state.vehicle.travel = line::travel(&self.model, &state.journey, step.end());
        state.rates.after(&self.inputs, &self.sideways, &self.external, values, step.size);
        if let Some(motors) = &self.motors {
            motors.keep_rates(values, step.size, &mut state.rates.motors);
        }
        Ok(())
    }

    fn prepare_derivatives(&mut self, state: &State, values: &Values) -> Result<(), Error> {
        self.use_vehicle_of(state, values)?;
        let rails = (&self.inputs, &self.sideways);
        self.jerks.check(state, values, rails, &self.contact, &self.external);
        Ok(())
    }

    fn output_derivative(
        &mut self,
        state: &State,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        self.use_vehicle_of(state, values)?;
        let (gap, gap_rate) = (self.outputs.gap, self.outputs.gap_rate);
        let (acceleration, position) = (self.outputs.acceleration, self.outputs.position);
        let bend = |k: usize| {
            // on a line, the gap's axis turns
            let turned = self.model.magnet_apparent(&state.vehicle, &self.work, MagnetIndex(k)).z;
            let rail = state.rates.track_rate.get(k).copied().unwrap_or(0.0);
            values.real(acceleration.get(k)) + rail - turned
        };
        if let Some(k) = find(gap, output) {
            return Ok(match order {
                1 => Some(values.real(gap_rate.get(k))),
                2 => Some(bend(k)),
                _ => None,
            });
        }
        if order == 2 {
            return self.second_derivative(state, values, output);
        }
        if order != 1 {
            return Ok(None);
        }
        if let Some(k) = find(gap_rate, output) {
            return Ok(Some(bend(k)));
        }
        if let Some(k) = find(acceleration, output) {
            self.differentiate(state, values, false)?;
            return Ok(Some(self.jerks.jerk(k)));
        }
        if let Some(k) = find(self.contact.force, output) {
            let rail =
                self.contact.track(values, (&self.inputs, &self.sideways), state.journey.speed);
            let slope = rail.map_or(0.0, |track| {
                let [by_gap, by_rate] =
                    self.model.contact_slopes(&state.vehicle, MagnetIndex(k), &track);
                by_gap.z * values.real(gap_rate.get(k)) + by_rate.z * bend(k)
            });
            return Ok(Some(slope));
        }
        if let Some(k) = find(self.outputs.lateral_offset, output) {
            let moves = self.model.magnet(&state.vehicle, MagnetIndex(k)).velocity.y;
            return Ok(Some(moves - values.real(self.sideways.rate.get(k))));
        }
        if let Some(k) = find(position, output) {
            let relative = self.model.magnet(&state.vehicle, MagnetIndex(k)).velocity.x;
            return Ok(Some(state.journey.speed + relative));
        }
        let motors = self.motors.as_ref();
        if let Some(rate) = motors.and_then(|it| it.position_rate(&self.model, state, output)) {
            return Ok(Some(rate));
        }
        Ok(find(self.outputs.static_load, output).map(|_| 0.0))
    }

    fn directional_derivative(
        &mut self,
        state: &State,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        self.use_vehicle_of(state, values)?;
        if self.motors.is_some() {
            // differences of the outputs know the motors' forces
            return Ok(false);
        }
        let (inputs, outputs) = (&self.inputs, &self.outputs);
        result.reals_mut(outputs.gap).copy_from_slice(seed.reals(inputs.track_displacement));
        result.reals_mut(outputs.gap_rate).copy_from_slice(seed.reals(inputs.track_rate));
        let sides = seed.reals(self.sideways.displacement);
        for (offset, side) in result.reals_mut(outputs.lateral_offset).iter_mut().zip(sides) {
            *offset = -side;
        }
        let magnets =
            Loads { vertical: seed.reals(inputs.force), lateral: seed.reals(inputs.lateral_force) };
        let external = self.loads.seed(&self.external, seed);
        let forces = AppliedForces { magnets, external, acceleration: 0.0 };
        let track = self.contact.track(values, (inputs, &self.sideways), state.journey.speed);
        let height = seed.reals(inputs.track_displacement);
        let rate = seed.reals(inputs.track_rate);
        let side_rate = seed.reals(self.sideways.rate);
        let moved = track.as_ref().map(|track| (track, [height, rate, side_rate]));
        self.model
            .load_response_in_contact(&state.vehicle, forces, moved, &mut self.probe)
            .map_err(|e| Error::caused(&e))?;
        for k in 0..state.loads.len() {
            let slope = track.as_ref().map_or(0.0, |track| {
                let [by_gap, by_rate] =
                    self.model.contact_slopes(&state.vehicle, MagnetIndex(k), track);
                by_gap.z * height[k] + by_rate.z * rate[k]
            });
            result.set_real(self.contact.force.get(k), slope);
            let down = -self.model.magnet_response(&self.probe, MagnetIndex(k)).z;
            result.set_real(outputs.acceleration.get(k), down);
        }
        for (k, body) in outputs.observed.iter().enumerate() {
            let centre = self.model.observed_response(&self.probe, ObservedIndex(k));
            for (variable, value) in body.acceleration.iter().zip(centre.iter()) {
                result.set_real(*variable, *value);
            }
            for i in 0..body.point_vertical.len() {
                let point = self.model.point_response(&self.probe, ObservedIndex(k), i);
                result.set_real(body.point_lateral.get(i), point.y);
                result.set_real(body.point_vertical.get(i), point.z);
            }
        }
        Ok(true)
    }

    /// Requests: `modes`, optionally followed by options as JSON, `linear` and
    /// `motions`.
    fn report(
        &mut self,
        state: &State,
        values: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        self.use_vehicle_of(state, values)?;
        if [StateSpace::REQUEST, Motions::REQUEST].contains(&request) {
            motors::refuse_report(&self.model, request)?;
            let straight = line::steady(&self.model, state)?;
            let state = straight.as_ref().unwrap_or(state);
            let Self { model, inputs, outputs, contact, external, sideways, .. } = self;
            let handles = linear::Handles { inputs, outputs, contact, external, sideways };
            let report =
                if request == StateSpace::REQUEST { linear::report } else { linear::motions };
            return report(model, state, values, &handles).map(Some);
        }
        let (name, options) = request.split_once(' ').unwrap_or((request, ""));
        if name != "modes" {
            return Ok(None);
        }
        motors::refuse_report(&self.model, name)?;
        let options = modes::ModesOptions::read(options)?;
        let answer = match options.at {
            At::State => {
                let straight = line::steady(&self.model, state)?;
                let state = straight.as_ref().unwrap_or(state);
                let track =
                    self.contact.track(values, (&self.inputs, &self.sideways), state.journey.speed);
                let magnets = self.inputs.loads(values);
                let external = self.loads.hold(&self.external, values);
                let acceleration = state.journey.acceleration;
                let forces = AppliedForces { magnets, external, acceleration };
                check_linear(&self.model, &state.vehicle, track.as_ref())?;
                modes::report(&self.model, &state.vehicle, &forces, track.as_ref(), &options)
            }
            At::Equilibrium => {
                let found = self.equilibrium(values, state.vehicle.travel, state.vehicle.time)?;
                let magnets = Loads { vertical: &found.loads, lateral: &found.lateral };
                let external = &found.external;
                let forces = AppliedForces { magnets, external, acceleration: 0.0 };
                modes::report(&self.model, &found.state, &forces, None, &options)
            }
        };
        answer.map(Some)
    }
}
