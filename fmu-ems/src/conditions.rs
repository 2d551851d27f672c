//! Sensors with faults, failure of the supply, lift-off and set-down: parameters and outputs.

use fmi2_export::{BooleanVar, IntegerVar, Interface, RealVar, UnitOfMeasure, Values, VariableRow};
use magnet::{
    Conditions, Error, FailedReading, MAX_DELAY, Noise, Sensor, SensorFailure, Sensors, Sequence,
    SupplyFailure,
};

/// Handles of the parameters and outputs. They are declared last, so that the value references of
/// all other variables stay what they were.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConditionHandles {
    /// Gap, acceleration.
    sensors: [SensorHandles; 2],
    noise_seed: IntegerVar,
    supply_failed: BooleanVar,
    supply_failure_time: RealVar,
    start_without_current: BooleanVar,
    lift_off_time: RealVar,
    set_down_time: RealVar,
    transition_time: RealVar,
    landing_gap: RealVar,
    pub delay_samples: IntegerVar,
    pub measured_gap: RealVar,
    pub measured_acceleration: RealVar,
    pub reference_gap: RealVar,
}

/// Handles of one sensor.
#[derive(Debug, Clone, Copy)]
struct SensorHandles {
    noise: RealVar,
    bandwidth: RealVar,
    bias: RealVar,
    resolution: RealVar,
    failed: BooleanVar,
    failure_time: RealVar,
    failure_mode: IntegerVar,
    open_reading: RealVar,
}

impl ConditionHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let metre = UnitOfMeasure::METRE;
        let acceleration = UnitOfMeasure::METRE_PER_SECOND_SQUARED;
        let sensors = [
            SensorHandles::declare(interface, "gap", metre, 0.02),
            SensorHandles::declare(interface, "acceleration", acceleration, 50.0),
        ];
        let noise_seed = interface
            .integer("noise_seed")
            .parameter(0)
            .min(0)
            .description(
                "Seed of the noise of both sensors. The instance's name counts as well, so that \
                 magnets with one seed have different noise",
            )
            .done();
        let supply_failed = interface
            .boolean("supply_failed")
            .tunable(false)
            .description(
                "The supply has failed: no voltage. Nonlinear law: the current decays with L/R; \
                 linear law: the force is switched off",
            )
            .done();
        let supply_failure_time = interface
            .real("supply_failure_time")
            .parameter(0.0)
            .unit(UnitOfMeasure::SECOND)
            .min(0.0)
            .description("Time from which on the supply has failed; 0: never")
            .done();
        let start_without_current = interface
            .boolean("start_without_current")
            .parameter(false)
            .description(
                "The magnet starts without current, at a gap that something else holds (landing \
                 skids), and lifts off at lift_off_time. Needs nonlinear, limit_current and a \
                 current_min of 0",
            )
            .done();
        let lift_off_time = interface
            .real("lift_off_time")
            .tunable(0.0)
            .unit(UnitOfMeasure::SECOND)
            .description(
                "Time at which the lift-off begins, with start_without_current: the flux rises in \
                 a quarter of transition_time, the reference gap moves to the nominal gap in the \
                 rest",
            )
            .done();
        let set_down_time = interface
            .real("set_down_time")
            .tunable(0.0)
            .unit(UnitOfMeasure::SECOND)
            .min(0.0)
            .description(
                "Time at which the set-down begins, the lift-off backwards; 0: never. Needs \
                 nonlinear, limit_current and a current_min of 0",
            )
            .done();
        let transition_time = interface
            .real("transition_time")
            .parameter(2.0)
            .unit(UnitOfMeasure::SECOND)
            .min(0.0)
            .description("Duration of the lift-off and of the set-down")
            .done();
        let landing_gap = interface
            .real("landing_gap")
            .parameter(0.017)
            .unit(metre)
            .display("mm")
            .min(0.0)
            .description(
                "Reference gap at the end of the set-down, a little more than the gap on the skids",
            )
            .done();
        let delay_samples = interface
            .integer("delay_samples")
            .parameter(0)
            .min(0)
            .max(MAX_DELAY as i32)
            .description(
                "Samples after which a sampled controller applies a voltage; sample_delay means at \
                 least 1",
            )
            .done();
        let mut output = |name: &'static str, unit, nominal: f64, text: &'static str| {
            let output = interface.real(name).output().unit(unit).nominal(nominal);
            output.description(text).done()
        };
        Self {
            sensors,
            noise_seed,
            supply_failed,
            supply_failure_time,
            start_without_current,
            lift_off_time,
            set_down_time,
            transition_time,
            landing_gap,
            delay_samples,
            measured_gap: output("measured_gap", metre, 0.008, "Reading of the gap sensor"),
            measured_acceleration: output(
                "measured_acceleration",
                acceleration,
                1.0,
                "Reading of the acceleration sensor, positive downward",
            ),
            reference_gap: output(
                "reference_gap",
                metre,
                0.008,
                "Gap that the control law refers to: the nominal gap but for lift-off and set-down",
            ),
        }
    }

    /// The conditions, from the values of the variables; `salt` is added to the seed.
    pub(crate) fn read(&self, values: &Values, salt: u64) -> Result<Conditions, Error> {
        let after_zero = |variable| Some(values.real(variable)).filter(|time| *time != 0.0);
        let seed = salt.wrapping_add(values.integer(self.noise_seed).unsigned_abs().into());
        let [gap, acceleration] = &self.sensors;
        let sensors = Sensors {
            gap: gap.read(values, seed, 0),
            acceleration: acceleration.read(values, seed, 1),
        };
        let ideal = [gap, acceleration].iter().all(|sensor| sensor.is_ideal(values));
        let supply = SupplyFailure {
            failed: values.boolean(self.supply_failed),
            time: after_zero(self.supply_failure_time),
        };
        let value = values.real(self.lift_off_time);
        let lift_off = values.boolean(self.start_without_current).then_some(value);
        if lift_off.is_none() && value != 0.0 {
            return Err(Error::Needs {
                name: "lift-off time (s)",
                value,
                needs: "a magnet that starts without current: set start_without_current to true",
            });
        }
        let set_down = after_zero(self.set_down_time);
        let sequence = Sequence {
            lift_off,
            set_down,
            transition: values.real(self.transition_time),
            landing_gap: values.real(self.landing_gap),
        };
        Ok(Conditions {
            sensors: (!ideal).then_some(sensors),
            supply: (supply.failed || supply.time.is_some()).then_some(supply),
            sequence: (lift_off.is_some() || set_down.is_some()).then_some(sequence),
        })
    }

    /// Parameters that determine the readings at the start.
    pub(crate) fn of_readings(&self) -> Vec<VariableRow> {
        let mut rows = vec![VariableRow::from(self.noise_seed)];
        for sensor in &self.sensors {
            let SensorHandles { noise, bandwidth, bias, resolution, .. } = *sensor;
            let SensorHandles { failed, failure_time, failure_mode, open_reading, .. } = *sensor;
            let reals = [noise, bandwidth, bias, resolution, failure_time, open_reading];
            rows.extend(reals.map(VariableRow::from));
            rows.extend([VariableRow::from(failed), VariableRow::from(failure_mode)]);
        }
        rows
    }

    /// Parameters that determine whether the magnet is switched on at the start.
    pub(crate) fn of_start(&self) -> Vec<VariableRow> {
        let reals = [
            self.supply_failure_time,
            self.lift_off_time,
            self.set_down_time,
            self.transition_time,
            self.landing_gap,
        ];
        let mut rows: Vec<VariableRow> = reals.into_iter().map(VariableRow::from).collect();
        rows.extend([self.supply_failed, self.start_without_current].map(VariableRow::from));
        rows
    }
}

impl SensorHandles {
    fn declare(
        interface: &mut Interface,
        quantity: &'static str,
        unit: UnitOfMeasure,
        open: f64,
    ) -> Self {
        let name = |what: &str| format!("{quantity}_sensor_{what}");
        let noise = interface
            .real(name("noise"))
            .tunable(0.0)
            .unit(unit)
            .min(0.0)
            .description(format!(
                "RMS of the {quantity} sensor's noise, a function of time and seed"
            ))
            .done();
        let bandwidth = interface
            .real(name("bandwidth"))
            .parameter(200.0)
            .unit(UnitOfMeasure::HERTZ)
            .min(0.0)
            .description("Frequency at which the noise's power density has fallen to one half")
            .done();
        let bias = interface
            .real(name("bias"))
            .tunable(0.0)
            .unit(unit)
            .description(format!("Constant error of the {quantity} sensor"))
            .done();
        let resolution = interface
            .real(name("resolution"))
            .parameter(0.0)
            .unit(unit)
            .min(0.0)
            .description(format!(
                "Step to whose multiples the {quantity}'s reading is rounded, at each sample of \
                 the controller and held until the next; 0: continuous. Needs sample_time",
            ))
            .done();
        let failed = interface
            .boolean(name("failed"))
            .tunable(false)
            .description(format!("The {quantity} sensor has failed"))
            .done();
        let failure_time = interface
            .real(name("failure_time"))
            .parameter(0.0)
            .unit(UnitOfMeasure::SECOND)
            .min(0.0)
            .description("Time from which on the sensor has failed; 0: never")
            .done();
        let failure_mode = interface
            .integer(name("failure_mode"))
            .parameter(1)
            .min(1)
            .max(3)
            .description(format!(
                "What the failed sensor reads. 1: its last reading, 2: zero, 3: \
                 {quantity}_sensor_open_reading",
            ))
            .done();
        let open_reading = interface
            .real(name("open_reading"))
            .parameter(open)
            .unit(unit)
            .description("Reading of an open circuit, failure mode 3")
            .done();
        Self {
            noise,
            bandwidth,
            bias,
            resolution,
            failed,
            failure_time,
            failure_mode,
            open_reading,
        }
    }

    fn read(&self, values: &Values, seed: u64, stream: u64) -> Sensor {
        let reading = match values.integer(self.failure_mode) {
            1 => FailedReading::Last,
            2 => FailedReading::Value(0.0),
            _ => FailedReading::Value(values.real(self.open_reading)),
        };
        Sensor {
            bias: values.real(self.bias),
            noise: Noise {
                rms: values.real(self.noise),
                bandwidth: values.real(self.bandwidth),
                seed,
                stream,
            },
            resolution: values.real(self.resolution),
            failure: SensorFailure {
                failed: values.boolean(self.failed),
                time: Some(values.real(self.failure_time)).filter(|time| *time != 0.0),
                reading,
            },
        }
    }

    /// Whether the sensor has no fault.
    fn is_ideal(&self, values: &Values) -> bool {
        let zeros = [self.noise, self.bias, self.resolution, self.failure_time];
        zeros.iter().all(|&it| values.real(it) == 0.0) && !values.boolean(self.failed)
    }
}

/// A number for an instance's name (FNV-1a), by which magnets with one seed differ.
pub(crate) fn salt(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
