//! Operating conditions: sensors with faults, failure of the supply, lift-off and set-down.
//!
//! All are off by default, and then nothing here is computed. What they change in time, the
//! [`Condition`], changes at counted instants only ([`Magnet::take_events`]): between them the right
//! side of the differential equation is smooth.

use serde::{Deserialize, Serialize};

use crate::{
    Error,
    inputs::{Direct, MagnetInputs},
    parameters::{Law, MagnetParameters},
    sensors::{Readings, SensorKnots, Sensors},
    sequence::{Phase, Reference, Resting, Sequence},
    state::State,
    system::Magnet,
};

/// Conditions beyond the paper's. [`Default`]: none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Conditions {
    /// Errors and failures of the controller's sensors.
    pub sensors: Option<Sensors>,
    /// Failure of the supply.
    pub supply: Option<SupplyFailure>,
    /// Lift-off and set-down.
    pub sequence: Option<Sequence>,
}

/// Failure of the supply: no voltage at the coil, whose current freewheels.
///
/// In the nonlinear law the flux decays by λ' = −R·i, so at a resting gap the current by e^(−R·t/L);
/// neither changes its sign. In the linear law a current of zero would mean a force of F_s − kᵢ·i₀,
/// which may be negative: there the failure **switches the force off**, and its end switches it on
/// with the flux linkage of the instant of the failure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SupplyFailure {
    /// Whether the supply has failed, whatever the time.
    pub failed: bool,
    /// Time from which on it has failed, in s.
    pub time: Option<f64>,
}

/// What of the conditions changes while stepping.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Condition {
    /// Phase of lift-off and set-down.
    pub phase: Phase,
    /// Whether the supply has failed.
    pub supply_failed: bool,
    /// The gap at initialisation, in m.
    pub(crate) start_gap: f64,
    /// Memory of the sensors.
    pub(crate) readings: Readings,
}

/// What the control law sees at an instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    /// Δc, in m: the gap's reading less the reference gap.
    pub deviation: f64,
    /// What the voltage depends on directly.
    pub direct: Direct,
    /// Voltage of the reference, in V.
    pub base: f64,
}

/// What the control law sees, and the numbers that it comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observation {
    pub seen: Seen,
    /// Readings of gap and acceleration, in m and m/s².
    pub readings: [f64; 2],
    /// Reference gap, in m.
    pub reference_gap: f64,
}

/// True values of the signals that sensors measure, with their rates.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Signals {
    /// Gap and acceleration, in m and m/s².
    pub values: [f64; 2],
    /// Their rates.
    pub rates: [f64; 2],
    /// Command of a controller outside, in V, and its rate.
    pub command: [f64; 2],
}

impl Conditions {
    pub(crate) fn none(&self) -> bool {
        self.sensors.is_none() && self.supply.is_none() && self.sequence.is_none()
    }

    pub(crate) fn check(&self, magnet: &MagnetParameters) -> Result<(), Error> {
        if let Some(sensors) = &self.sensors {
            sensors.check(magnet.control.sampling.is_some())?;
            if magnet.external_controller {
                return Err(Error::Unsupported {
                    what: "noise, bias, resolution and failures of sensors with an external \
                           controller: they are between the sensors and the built-in one",
                });
            }
        }
        let Some(sequence) = &self.sequence else { return Ok(()) };
        sequence.check(magnet.nominal_gap)?;
        if magnet.external_controller {
            return Err(Error::Unsupported {
                what: "lift-off and set-down with an external controller, which has to do them \
                       itself",
            });
        }
        if magnet.law == Law::Linear {
            return Err(Error::Unsupported {
                what: "lift-off and set-down with the linear law, which holds near one gap and \
                       one current only: set nonlinear to true",
            });
        }
        if magnet.limits.current.is_some_and(|range| range.min == 0.0) {
            return Ok(());
        }
        Err(Error::Unsupported {
            what: "lift-off and set-down unless the current is limited to 0 and above, since a \
                   magnet attracts whatever the current's sign: set limit_current to true and \
                   current_min to 0",
        })
    }

    /// Whether `new` conditions can replace these at `time` (s), while stepping.
    ///
    /// # Errors
    /// [`Error::LateChange`] where the reference would jump.
    pub fn check_change(&self, new: &Self, time: f64) -> Result<(), Error> {
        Sequence::check_change(self.sequence, new.sequence, time)
    }

    /// The next instant of an event after `time` (s), if there is one.
    fn next_after(&self, time: f64) -> Option<f64> {
        let sequence = self.sequence.iter().flat_map(Sequence::instants).map(|(begin, _)| begin);
        let sensors = self.sensors.iter().flat_map(Sensors::instants);
        let supply = self.supply.iter().map(|supply| supply.time);
        let instants = sequence.chain(sensors).chain(supply).flatten();
        instants.filter(|&instant| instant > time).min_by(f64::total_cmp)
    }
}

impl Condition {
    /// Whether the supply or a sensor has failed.
    pub fn has_failure(&self) -> bool {
        self.supply_failed || self.readings.failed.iter().any(Option::is_some)
    }

    /// Whether the coil gets no voltage.
    pub(crate) fn is_off(&self) -> bool {
        self.supply_failed || self.phase == Phase::Off
    }
}

impl SupplyFailure {
    fn is_failed(&self, time: f64) -> bool {
        self.failed || self.time.is_some_and(|begin| time >= begin)
    }
}

impl Magnet {
    /// Whether a failed supply has switched the linear law's force off.
    pub fn force_is_off(&self, state: &State) -> bool {
        self.is_conditioned()
            && state.condition.supply_failed
            && self.electromagnet().law() == Law::Linear
    }

    /// Whether the coil gets no voltage.
    #[inline]
    pub(crate) fn is_off(&self, state: &State) -> bool {
        self.is_conditioned() && state.condition.is_off()
    }

    /// What the control law sees at `time` (s).
    #[inline]
    pub(crate) fn seen(
        &self,
        state: &State,
        time: f64,
        signals: &Signals,
        knots: &SensorKnots,
    ) -> Seen {
        if self.is_conditioned() {
            return self.observe_by_sensors(state, time, signals, knots).seen;
        }
        let [gap, acceleration] = signals.values;
        self.seen_directly(state, gap, Direct { acceleration, command: signals.command[0] })
    }

    /// What the control law sees at the state's time.
    #[inline]
    pub(crate) fn observe(&self, state: &State, inputs: &MagnetInputs) -> Observation {
        if self.is_conditioned() {
            let (signals, knots) = (inputs.signals(), SensorKnots::default());
            return self.observe_by_sensors(state, state.time, &signals, &knots);
        }
        let MagnetInputs { gap, acceleration, voltage_command, .. } = *inputs;
        Observation {
            seen: self.seen_directly(state, gap, Direct { acceleration, command: voltage_command }),
            readings: [gap, acceleration],
            reference_gap: self.electromagnet().nominal_gap,
        }
    }

    #[inline]
    fn seen_directly(&self, state: &State, gap: f64, direct: Direct) -> Seen {
        let coil = self.electromagnet();
        let base = coil.resistance * state.operating_current;
        Seen { deviation: gap - coil.nominal_gap, direct, base }
    }

    #[cold]
    fn observe_by_sensors(
        &self,
        state: &State,
        time: f64,
        signals: &Signals,
        knots: &SensorKnots,
    ) -> Observation {
        let [[gap, _], [acceleration, _]] = self.readings(state, time, signals, knots);
        let reference = self.reference(state, time);
        let direct = Direct {
            acceleration: acceleration - reference.acceleration,
            command: signals.command[0],
        };
        Observation {
            seen: Seen { deviation: gap - reference.gap, direct, base: reference.voltage[0] },
            readings: [gap, acceleration],
            reference_gap: reference.gap,
        }
    }

    /// What the control law sees at the start: readings without noise, so that it starts at rest.
    pub(crate) fn seen_at_rest(&self, state: &State, inputs: &MagnetInputs) -> Seen {
        let mut signals = inputs.signals();
        if self.parameters().conditions.sensors.is_some() {
            signals.values = state.condition.readings.first();
        }
        let [gap, acceleration] = signals.values;
        let reference = self.reference(state, state.time);
        let direct = Direct {
            acceleration: acceleration - reference.acceleration,
            command: signals.command[0],
        };
        Seen { deviation: gap - reference.gap, direct, base: reference.voltage[0] }
    }

    /// Rates of what the voltage depends on directly, and of the reference's voltage.
    pub(crate) fn seen_rates(&self, state: &State, signals: &Signals) -> (Direct, f64) {
        let [_, jerk] = signals.rates;
        let command = signals.command[1];
        if !self.is_conditioned() {
            return (Direct { acceleration: jerk, command }, 0.0);
        }
        let time = state.time;
        let [_, [_, jerk]] = self.readings(state, time, signals, &SensorKnots::default());
        let reference = self.reference(state, time);
        (Direct { acceleration: jerk - reference.jerk, command }, reference.voltage[1])
    }

    /// Readings of gap and acceleration with their rates.
    pub(crate) fn readings(
        &self,
        state: &State,
        time: f64,
        signals: &Signals,
        knots: &SensorKnots,
    ) -> [[f64; 2]; 2] {
        let Signals { values, rates, .. } = *signals;
        let memory = &state.condition.readings;
        match &self.parameters().conditions.sensors {
            Some(sensors) => sensors.read(memory, time, values, rates, knots),
            None => [[values[0], rates[0]], [values[1], rates[1]]],
        }
    }

    /// Derivatives of the readings of gap and acceleration by the true values: 0 for a sensor that
    /// has failed or is read at samples only.
    pub(crate) fn reading_slopes(&self, state: &State) -> [f64; 2] {
        let Some(sensors) = &self.parameters().conditions.sensors else { return [1.0; 2] };
        let both = sensors.both();
        let failed = &state.condition.readings.failed;
        std::array::from_fn(|k| f64::from(failed[k].is_none() && both[k].is_analog()))
    }

    /// The reference at `time` (s).
    pub(crate) fn reference(&self, state: &State, time: f64) -> Reference {
        let coil = self.electromagnet();
        let Some(sequence) = &self.parameters().conditions.sequence else {
            let voltage = [coil.resistance * state.operating_current, 0.0];
            return Reference { gap: coil.nominal_gap, acceleration: 0.0, jerk: 0.0, voltage };
        };
        let rest = Resting {
            nominal_gap: coil.nominal_gap,
            start_gap: state.condition.start_gap,
            flux: coil.inductance * state.operating_current,
            resistance: coil.resistance,
            constant: coil.constant,
        };
        sequence.reference(state.condition.phase, time, &rest)
    }

    /// The condition to start in, for true values of gap and acceleration.
    pub(crate) fn first_condition(&self, time: f64, values: [f64; 2]) -> Result<Condition, Error> {
        let Conditions { sensors, supply, sequence } = &self.parameters().conditions;
        for (name, begin) in sequence.iter().flat_map(Sequence::begins) {
            if let Some(value) = begin.filter(|&begin| begin < time) {
                let must = "at or after the time at which the run starts";
                return Err(Error::OutOfRange { name, value, must });
            }
        }
        Ok(Condition {
            phase: sequence.map(|it| it.phase(time)).unwrap_or_default(),
            supply_failed: supply.is_some_and(|it| it.is_failed(time)),
            start_gap: values[0],
            readings: sensors.map(|it| it.start(time, values)).unwrap_or_default(),
        })
    }

    /// Whether the coil starts without current.
    pub(crate) fn starts_without_current(&self, condition: &Condition) -> bool {
        let lifts_off =
            self.parameters().conditions.sequence.is_some_and(|it| it.lift_off.is_some());
        let failed = condition.supply_failed && self.electromagnet().law() == Law::Nonlinear;
        lifts_off || failed
    }

    /// Takes the changes of the condition that are due at `time` (s); instants up to `tolerance` (s)
    /// later count as now.
    pub(crate) fn switch(
        &self,
        state: &mut State,
        time: f64,
        tolerance: f64,
        values: [f64; 2],
        knots: &SensorKnots,
    ) {
        let Conditions { sensors, supply, sequence } = &self.parameters().conditions;
        let (condition, now) = (&mut state.condition, time + tolerance);
        if let Some(sensors) = sensors {
            sensors.switch(&mut condition.readings, now, values, knots);
        }
        condition.phase = sequence.map(|it| it.phase(now)).unwrap_or_default();
        condition.supply_failed = supply.is_some_and(|it| it.is_failed(now));
    }

    /// The next instant at which the condition changes, after `time` (s).
    pub(crate) fn next_switch(&self, time: f64) -> Option<f64> {
        self.parameters().conditions.next_after(time)
    }
}
