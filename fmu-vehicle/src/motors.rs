//! Linear induction motors: a resource, what feeds them, and their forces as outputs.

use fmi2_export::{
    BooleanVar, Error, Interface, RealVar, RealVars, Resources, UnitOfMeasure, Values, VariableRow,
};
use linear_motor::{Motor, MotorDescription};
use multibody::{
    ComponentIndex, Error as VehicleError, MotorControl, MotorCourse, VehicleModel, Workspace,
};

use crate::journey::Journey;
use crate::state::State;

/// Name of the resource; without it there are no motors.
const FILE: &str = "motor.json";
const HERTZ: UnitOfMeasure = UnitOfMeasure::new("Hz").s(-1);

/// The motors of the resources, if there are any.
pub(crate) fn read(resources: &Resources) -> Result<Option<MotorDescription>, Error> {
    let Some(bytes) = resources.read_if_present(FILE)? else { return Ok(None) };
    let text = String::from_utf8(bytes)
        .map_err(|_| Error::invalid(format!("resource {FILE}: not UTF-8; save it as UTF-8")))?;
    let failed =
        |e: linear_motor::Error| Error::caused(&e).context(format_args!("resource {FILE}"));
    MotorDescription::from_json(&text).map(Some).map_err(failed)
}

/// The vehicle with the motors, if there are any.
pub(crate) fn place(
    model: VehicleModel,
    motors: Option<&MotorDescription>,
) -> Result<VehicleModel, Error> {
    let Some(motors) = motors else { return Ok(model) };
    let failed = |e: VehicleError| Error::caused(&e).context(format_args!("resource {FILE}"));
    model.with_motors(motors).map_err(failed)
}

/// Handles of the variables that only a vehicle with motors has.
#[derive(Debug, Clone)]
pub(crate) struct MotorHandles {
    fed_directly: BooleanVar,
    slip_frequency: RealVar,
    max_current: RealVar,
    wanted: RealVar,
    current: RealVar,
    frequency: RealVar,
    height: RealVars,
    thrust: RealVars,
    vertical: RealVars,
    gap: RealVars,
    position: RealVars,
    feed: [RealVar; 2],
    power: RealVar,
    /// Memory for heights at an instant.
    now: Vec<[f64; 4]>,
}

impl MotorHandles {
    /// Declares the variables of a vehicle with motors.
    pub fn declare(
        interface: &mut Interface,
        model: &VehicleModel,
        motors: Option<&MotorDescription>,
    ) -> Result<Option<Self>, Error> {
        let Some(description) = motors else { return Ok(None) };
        let law = Motor::new(description).map_err(|e| Error::caused(&e))?;
        let count = model.motor_count();
        let fed_directly = interface
            .boolean("motor_fed_directly")
            .parameter(false)
            .description(
                "Whether motor_current and motor_frequency feed the motors; otherwise the traction control \
                 does, for the thrust that speed_change and motor_thrust_demand need",
            )
            .done();
        let mut parameter = |name: &str, start: f64, [min, max]: [f64; 2], unit, text: &str| {
            let declared = interface.real(name).parameter(start).unit(unit).min(min).max(max);
            declared.description(text).done()
        };
        let slip_frequency = parameter(
            "motor_slip_frequency",
            law.control_slip(),
            [1e-3, 1e4],
            HERTZ,
            "Slip frequency that the traction control keeps; the opposite in braking",
        );
        let max_current = parameter(
            "motor_max_current",
            law.max_current(),
            [1e-3, 1e6],
            UnitOfMeasure::AMPERE,
            "Largest current of the traction control, r.m.s. of a phase",
        );
        let mut input = |name: &str, unit, nominal: f64, text: &str| {
            interface.real(name).input(0.0).unit(unit).nominal(nominal).description(text).done()
        };
        let wanted = input(
            "motor_thrust_demand",
            UnitOfMeasure::NEWTON,
            1e4,
            "Thrust of all motors that is wanted in addition to that of speed_change, forward positive",
        );
        let current = input(
            "motor_current",
            UnitOfMeasure::AMPERE,
            100.0,
            "Current of each motor with motor_fed_directly, r.m.s. of a phase",
        );
        let frequency = input(
            "motor_frequency",
            HERTZ,
            10.0,
            "Frequency of the motors with motor_fed_directly; negative with the phases reversed",
        );
        let height = interface
            .reals("motor_track_displacement", count)
            .input(0.0)
            .unit(UnitOfMeasure::METRE)
            .display("mm")
            .nominal(1e-3)
            .description("Height of the track at motor {k}, up positive")
            .done();
        let mut row = |name: &str, order: u32, unit, nominal: f64, text: &str| {
            let declared = interface.reals(name, count).output().derivatives(order);
            declared.unit(unit).nominal(nominal).description(text).done()
        };
        let newton = UnitOfMeasure::NEWTON;
        let thrust = row(
            "motor_thrust",
            0,
            newton,
            1e3,
            "Thrust of motor {k} on the vehicle, forward positive",
        );
        let vertical = row(
            "motor_vertical_force",
            0,
            newton,
            1e3,
            "Normal force on motor {k}, up positive as force: attraction is negative; the guideway takes \
             the opposite",
        );
        let metre = UnitOfMeasure::METRE;
        let gap =
            row("motor_gap", 0, metre, 1e-2, "Clearance between motor {k} and the reaction plate");
        let position = row("motor_position", 1, metre, 10.0, "Place of motor {k} along the track");
        let mut output = |name: &str, unit, nominal: f64, text: &str| {
            interface.real(name).output().unit(unit).nominal(nominal).description(text).done()
        };
        let feed = [
            output(
                "motor_feed_current",
                UnitOfMeasure::AMPERE,
                100.0,
                "Current that the motors take",
            ),
            output("motor_feed_frequency", HERTZ, 10.0, "Frequency of the motors' supply"),
        ];
        let power = output(
            "motor_power",
            UnitOfMeasure::WATT,
            1e5,
            "Electrical power of all motors: thrust, heat of plate and windings; 0 with a table of forces",
        );
        Ok(Some(Self {
            fed_directly,
            slip_frequency,
            max_current,
            wanted,
            current,
            frequency,
            height,
            thrust,
            vertical,
            gap,
            position,
            feed,
            power,
            now: vec![[0.0; 4]; count],
        }))
    }

    /// What the forces depend on, besides the track at each motor.
    fn rows(&self) -> [VariableRow; 6] {
        let Self { fed_directly, slip_frequency, max_current, wanted, current, frequency, .. } =
            self;
        let [slip, most] = [slip_frequency.row(), max_current.row()];
        [fed_directly.row(), slip, most, wanted.row(), current.row(), frequency.row()]
    }

    /// Inputs that act directly on bodies of a group.
    pub fn acting_on(
        &self,
        model: &VehicleModel,
        component: Option<ComponentIndex>,
    ) -> Vec<VariableRow> {
        let own: Vec<VariableRow> = (0..self.height.len())
            .filter(|&k| model.motor_component(k) == component)
            .map(|k| self.height.get(k).row())
            .collect();
        if own.is_empty() {
            return own;
        }
        [&[self.wanted.row(), self.current.row(), self.frequency.row()], &own[..]].concat()
    }

    /// Declares the dependencies of the outputs, with what the static equilibrium depends on.
    pub fn depend(&self, interface: &mut Interface, rest: &[VariableRow], speed: &[VariableRow]) {
        let inputs = [self.wanted.row(), self.current.row(), self.frequency.row()];
        let all = [&self.rows()[..], rest, speed].concat();
        for row in [self.thrust, self.vertical] {
            for k in 0..row.len() {
                let own = self.height.get(k).row();
                interface.depends(row.get(k), &[&inputs[..], &[own]].concat());
                interface.initially_depends(row.get(k), &[&all[..], &[own]].concat());
            }
        }
        interface.depends_elementwise(self.gap, self.height);
        interface.initially_depends(self.gap, &[rest, &[self.height.row()]].concat());
        interface.independent(self.position);
        for output in self.feed {
            interface.depends(output, &inputs);
            interface.initially_depends(output, &all);
        }
        interface.depends(self.power, &[&inputs[..], &[self.height.row()]].concat());
        interface.initially_depends(self.power, &[&all[..], &[self.height.row()]].concat());
    }

    /// What the places of the motors depend on at the start.
    pub fn position(&self) -> RealVars {
        self.position
    }

    fn control(&self, values: &Values, input: impl Fn(RealVar) -> [f64; 4]) -> MotorControl {
        if values.boolean(self.fed_directly) {
            let (current, frequency) = (input(self.current), input(self.frequency));
            return MotorControl::Fed { current, frequency };
        }
        MotorControl::Thrust {
            wanted: input(self.wanted),
            slip_frequency: values.real(self.slip_frequency),
            max_current: values.real(self.max_current),
        }
    }

    /// Feeds the motors over a step with this speed.
    pub fn follow(
        &self,
        values: &Values,
        speed: [f64; 4],
        work: &mut Workspace,
    ) -> Result<(), Error> {
        let control = self.control(values, |input| *values.taylor(input));
        let course = MotorCourse { control, speed, height: values.taylors(self.height) };
        work.supply(Some(&course)).map_err(|e| Error::caused(&e))
    }

    /// Feeds the motors at a communication point.
    pub fn hold(
        &mut self,
        state: &State,
        values: &Values,
        works: &mut [&mut Workspace],
    ) -> Result<(), Error> {
        let rates = &state.rates.motors;
        let inputs = [self.wanted, self.current, self.frequency];
        let rate = |k: usize| rates.get(k).copied().unwrap_or(0.0);
        let control = self.control(values, |input| {
            let k = inputs.iter().position(|it| it.value_reference() == input.value_reference());
            [values.real(input), k.map_or(0.0, rate), 0.0, 0.0]
        });
        for (k, now) in self.now.iter_mut().enumerate() {
            *now = [values.real(self.height.get(k)), rate(inputs.len() + k), 0.0, 0.0];
        }
        let Journey { speed, acceleration, jerk, .. } = state.journey;
        let course =
            MotorCourse { control, speed: [speed, acceleration, jerk, 0.0], height: &self.now };
        works.iter_mut().try_for_each(|work| {
            work.supply(Some(&course)).map_err(|e: VehicleError| Error::caused(&e))
        })
    }

    /// Keeps the rates of the inputs at the end of a step.
    pub fn keep_rates(&self, values: &Values, size: f64, rates: &mut [f64]) {
        let at_the_end = |u: &[f64; 4]| u[1] + size * (u[2] + 0.5 * size * u[3]);
        let inputs = [self.wanted, self.current, self.frequency];
        let single = inputs.map(|input| at_the_end(values.taylor(input)));
        let heights = values.taylors(self.height).iter().map(at_the_end);
        for (rate, value) in rates.iter_mut().zip(single.into_iter().chain(heights)) {
            *rate = value;
        }
    }

    /// How many rates are kept.
    pub fn rate_count(&self) -> usize {
        3 + self.height.len()
    }

    /// Writes the outputs after an evaluation.
    pub fn write(
        &self,
        model: &VehicleModel,
        state: &State,
        work: &Workspace,
        values: &mut Values,
        travelled: f64,
    ) {
        for (k, motor) in work.motors().iter().enumerate() {
            values.set_real(self.thrust.get(k), motor.forces.thrust);
            values.set_real(self.vertical.get(k), -motor.forces.normal);
            values.set_real(self.gap.get(k), motor.gap);
            let place = model.motor_motion(&state.vehicle, k).map_or(0.0, |it| it.position.x);
            values.set_real(self.position.get(k), travelled + place);
        }
        let feed = work.feed();
        values.set_real(self.feed[0], feed.current);
        values.set_real(self.feed[1], feed.frequency);
        values.set_real(self.power, model.motor_power(work).unwrap_or(0.0));
    }

    /// Rate of a motor's place, m/s, if the output is that of one.
    pub fn position_rate(
        &self,
        model: &VehicleModel,
        state: &State,
        output: RealVar,
    ) -> Option<f64> {
        let first = self.position.checked_get(0)?.value_reference();
        let k = output.value_reference().checked_sub(first)? as usize;
        if k >= self.position.len() {
            return None;
        }
        let motion = model.motor_motion(&state.vehicle, k)?;
        Some(state.journey.speed + motion.velocity.x)
    }
}

/// The speed over a step of this size (s) that begins at the speed `from`, m/s: motors cannot give the impulse of a
/// jump, so it is spread over the step.
pub(crate) fn spread([v, a, j, s]: [f64; 4], from: f64, size: f64) -> [f64; 4] {
    [from, a + (v - from) / size, j, s]
}

/// Refuses a linearisation.
pub(crate) fn refuse_report(model: &VehicleModel, request: &str) -> Result<(), Error> {
    if model.motor_count() == 0 {
        return Ok(());
    }
    Err(Error::invalid(format!(
        "the report {request} of a vehicle with motors ({FILE}) is not supported; take {FILE} out of the resources: \
         without current the motors exert no force, and small motions are the same"
    )))
}
