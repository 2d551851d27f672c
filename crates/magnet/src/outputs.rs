//! Outputs of the magnet: forces, electrical quantities, estimates, and their derivatives.

use serde::{Deserialize, Serialize};

use crate::{
    Error,
    conditions::{Observation, Seen, Signals},
    filter::ACCELERATION_SCALE,
    inputs::MagnetInputs,
    lateral::{lateral_force, lateral_gradient, lateral_share},
    lift_loss::{LiftLoss, Motion, lost_lift, lost_lift_slopes},
    limits::{LimitsAtWork, Point},
    parameters::Law,
    sensors::SensorKnots,
    state::State,
    system::Magnet,
};

/// Quantities at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnetOutputs {
    /// Levitation force F, in N, attraction positive.
    pub force: f64,
    /// Lateral force on the magnet, in N, left positive.
    pub lateral_force: f64,
    /// Coil current i, in A.
    pub current: f64,
    /// Voltage v that the controller applies, in V, within the voltage limits. An active current
    /// limiter lowers it further inside the power stage.
    pub voltage: f64,
    /// Scaled estimates y₁ … y₅ of eq. 5: gap (250·Δc), gap velocity (2.5·ċ), acceleration
    /// (0.25·q̈), velocity (2.5·q̇), position (250·q). Zero with an external controller.
    pub estimates: [f64; 5],
    /// Readings of gap and acceleration, in m and m/s².
    pub readings: [f64; 2],
    /// Gap that the control law refers to, in m.
    pub reference_gap: f64,
    /// Fraction of the lift at the same current that the offset costs, 0 without lateral force. Part
    /// of the force with lift loss only.
    pub lost_lift: f64,
}

/// Derivatives of the inputs at an instant, as far as outputs' derivatives depend on them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InputRates {
    /// Rate of the gap rate c̈, in m/s².
    pub gap_acceleration: f64,
    /// Rate of the acceleration, in m/s³.
    pub jerk: f64,
    /// Rate of the static force, in N/s.
    pub static_force_rate: f64,
    /// Second derivative of the static force, in N/s².
    pub static_force_acceleration: f64,
    /// Rate of the voltage command, in V/s.
    pub voltage_command_rate: f64,
    /// Rate of the lateral offset, in m/s; for the lateral force, and with lift loss.
    pub offset_rate: f64,
    /// Its rate, in m/s²; for the lateral force, and with lift loss.
    pub offset_acceleration: f64,
}

/// Time derivatives of the outputs at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OutputRates {
    /// dF/dt, in N/s.
    pub force: f64,
    /// d²F/dt², in N/s².
    pub force_second: f64,
    /// di/dt, in A/s.
    pub current: f64,
    /// dv/dt, in V/s; zero while a sampled controller or a limit holds the voltage.
    pub voltage: f64,
    /// y', in 1/s.
    pub estimates: [f64; 5],
}

/// Partial derivatives of the outputs with respect to the inputs at fixed state. Those not listed
/// are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Partials {
    /// ∂F/∂c, in N/m: nonzero only while the current limiter holds the current, or with lift loss.
    pub force_by_gap: f64,
    /// ∂F/∂y, in N/m: nonzero with lift loss only.
    pub force_by_offset: f64,
    /// ∂i/∂y, in A/m: nonzero with lift loss only.
    pub current_by_offset: f64,
    /// Derivatives of the lost fraction of the lift by gap and offset, in 1/m.
    pub lost_lift: [f64; 2],
    /// ∂i/∂c, in A/m: the flux linkage stays when the gap jumps, the current does not.
    pub current_by_gap: f64,
    /// ∂F/∂F_s: one in the linear law, zero in the other.
    pub force_by_static_force: f64,
    /// ∂F_y/∂c, in N/m.
    pub lateral_force_by_gap: f64,
    /// ∂F_y/∂F_s.
    pub lateral_force_by_static_force: f64,
    /// ∂F_y/∂y, in N/m.
    pub lateral_force_by_offset: f64,
    /// ∂v/∂q̈, in V·s²/m.
    pub voltage_by_acceleration: f64,
    /// ∂v/∂(voltage command): one with an external controller and no limit active, else zero.
    pub voltage_by_command: f64,
    /// ∂y₃/∂q̈, in s²/m: the only estimate with feed-through (eq. 5). Zero with an external
    /// controller.
    pub estimate_by_acceleration: f64,
    /// Derivatives of the readings of gap and acceleration by the true values.
    pub reading_slopes: [f64; 2],
}

impl Magnet {
    /// All outputs for a state and the inputs of the same instant.
    ///
    /// # Errors
    /// Inputs that are not finite, or a closed gap.
    #[inline]
    pub fn outputs(&self, state: &State, inputs: &MagnetInputs) -> Result<MagnetOutputs, Error> {
        inputs.check()?;
        let gap = inputs.gap;
        let (flux, mut current) = self.flux_and_current(state, inputs.place());
        let mut force =
            self.electromagnet().force_of_flux(state.operating_current, flux, inputs.static_force);
        if self.force_is_off(state) {
            (force, current) = (0.0, 0.0);
        }
        let mut aside = None;
        if let Some(law) = self.lift_loss() {
            let total = self.total_flux(state.operating_current, flux);
            force = law.force_of_flux(inputs.place(), total);
            aside = Some(law.lateral_of_flux(inputs.place(), total));
        }
        let width = self.parameters().pole_width;
        let Observation { seen, readings, reference_gap } = self.observe(state, inputs);
        Ok(MagnetOutputs {
            force,
            lateral_force: aside.unwrap_or_else(|| {
                width.map_or(0.0, |width| lateral_force(force, gap, inputs.lateral_offset, width))
            }),
            current,
            voltage: self.voltage(state, &seen),
            estimates: self.estimates(state, &seen),
            readings,
            reference_gap,
            lost_lift: width.map_or(0.0, |width| lost_lift(gap, inputs.lateral_offset, width)),
        })
    }

    /// Voltage that the controller applies, in V.
    fn voltage(&self, state: &State, seen: &Seen) -> f64 {
        if self.is_off(state) {
            0.0
        } else if self.is_sampled() {
            state.hold.applied
        } else {
            self.demand(state, seen)
        }
    }

    fn estimates(&self, state: &State, seen: &Seen) -> [f64; 5] {
        if self.parameters().external_controller {
            return [0.0; 5];
        }
        self.filter().estimates(&state.filter, seen.deviation, seen.direct.acceleration)
    }

    /// The active limits.
    pub fn limits_at_work(&self, state: &State, inputs: &MagnetInputs) -> LimitsAtWork {
        let MagnetInputs { gap, gap_rate, .. } = *inputs;
        if self.is_off(state) || self.parameters().limits.none() {
            return LimitsAtWork::FREE;
        }
        let command = if self.is_sampled() {
            state.hold.applied
        } else {
            let seen = self.seen(state, state.time, &inputs.signals(), &SensorKnots::default());
            self.command(&state.filter, &seen)
        };
        let (_, current) = self.flux_and_current(state, inputs.place());
        // the offset's rate is an input's rate, which the mode of an instant does not know
        let aside = [inputs.lateral_offset, 0.0];
        self.mode(&Point { gap, gap_rate, aside, current, command })
    }

    /// Time derivatives of the outputs.
    ///
    /// The gap's own rate cancels from the force's: with the flux linkage λ = L·i, F = λ²/(4K) and
    /// λ' = v − R·i, so F' = λ·(v − R·i)/(2K) and F'' = [(v − R·i)² + λ·(v' − R·i')]/(2K); linear,
    /// F' = F_s' + (kᵢ/L₀)·(Δv − R·Δi) and F'' = F_s'' + (kᵢ/L₀)·(Δv' − R·Δi'). While the current
    /// limiter holds i, only the gap moves the force.
    ///
    /// Where the controller samples, or a failure begins, at the state's time, the derivatives are
    /// those after it (the limit from the right), for the inputs given.
    ///
    /// # Errors
    /// Inputs that are not finite, or a closed gap.
    pub fn rates(
        &self,
        state: &State,
        inputs: &MagnetInputs,
        rates: &InputRates,
    ) -> Result<OutputRates, Error> {
        inputs.check()?;
        if self.is_exact() {
            return Ok(self.smooth_rates(state, inputs, rates));
        }
        Ok(self.smooth_rates(&self.after_events(state, inputs), inputs, rates))
    }

    fn smooth_rates(
        &self,
        state: &State,
        inputs: &MagnetInputs,
        rates: &InputRates,
    ) -> OutputRates {
        let mode = self.limits_at_work(state, inputs);
        let signals = Signals {
            values: [inputs.gap, inputs.acceleration],
            rates: [inputs.gap_rate, rates.jerk],
            command: [inputs.voltage_command, rates.voltage_command_rate],
        };
        let seen = self.seen(state, state.time, &signals, &SensorKnots::default());
        let (direct, base_rate) = self.seen_rates(state, &signals);
        let (filter, estimates) = self.filter_rates(state, &seen, direct.acceleration);
        let held = self.is_sampled() || mode.voltage_is_limited() || self.is_off(state);
        let voltage_rate = if held { 0.0 } else { base_rate + self.deviation(&filter, direct) };
        let voltage = self.voltage(state, &seen);
        if self.force_is_off(state) {
            return OutputRates { estimates, ..OutputRates::default() };
        }
        let coil = Coil { mode, voltage, voltage_rate };
        let (force, force_second, current) = self.force_rates(state, inputs, rates, &coil);
        OutputRates { force, force_second, current, voltage: voltage_rate, estimates }
    }

    /// x' of the filter and y' of its estimates.
    fn filter_rates(&self, state: &State, seen: &Seen, jerk: f64) -> ([f64; 5], [f64; 5]) {
        if self.parameters().external_controller {
            return ([0.0; 5], [0.0; 5]);
        }
        let filter = self.filter().rates(&state.filter, seen.deviation, seen.direct.acceleration);
        // The gap has no feed-through to the estimates, so its rate is not needed here.
        (filter, self.filter().estimates(&filter, 0.0, jerk))
    }

    /// F', F'' and i'.
    fn force_rates(
        &self,
        state: &State,
        inputs: &MagnetInputs,
        rates: &InputRates,
        coil: &Coil,
    ) -> (f64, f64, f64) {
        let magnet = self.electromagnet();
        let (gap, gap_rate) = (inputs.gap, inputs.gap_rate);
        let (flux, current) = self.flux_and_current(state, inputs.place());
        let static_rates = match magnet.law() {
            Law::Linear => (rates.static_force_rate, rates.static_force_acceleration),
            Law::Nonlinear => (0.0, 0.0),
        };
        if let Some(law) = self.lift_loss() {
            let motion = Motion {
                rates: [gap_rate, rates.offset_rate],
                bends: [rates.gap_acceleration, rates.offset_acceleration],
            };
            if coil.mode.current_is_limited() {
                let [first, second] = law.rates_at_current(inputs.place(), &motion, current);
                return (first, second, 0.0);
            }
            let aside = [inputs.lateral_offset, rates.offset_rate];
            let current_rate = self.current_rate([gap, gap_rate], aside, current, coil.voltage);
            let total = self.total_flux(state.operating_current, flux);
            let flux_rate = coil.voltage - magnet.resistance * current;
            let flux_second = coil.voltage_rate - magnet.resistance * current_rate;
            let course = [total, flux_rate, flux_second];
            let [first, second] = law.rates_of_flux(inputs.place(), &motion, course);
            return (first, second, current_rate);
        }
        if coil.mode.current_is_limited() {
            let (by_gap, _) = magnet.force_gradient(gap, current);
            let curvature = match magnet.law() {
                Law::Linear => 0.0,
                Law::Nonlinear => -3.0 * by_gap / gap,
            };
            let second = by_gap * rates.gap_acceleration + curvature * gap_rate * gap_rate;
            return (static_rates.0 + by_gap * gap_rate, static_rates.1 + second, 0.0);
        }
        let current_rate = magnet.current_rate(gap, gap_rate, current, coil.voltage);
        let flux_rate = coil.voltage - magnet.resistance * current;
        let flux_second = coil.voltage_rate - magnet.resistance * current_rate;
        let (per_flux, spread) = match magnet.law() {
            Law::Linear => (magnet.current_stiffness / magnet.inductance, 0.0),
            Law::Nonlinear => (current / gap, flux_rate * flux_rate / (2.0 * magnet.constant)),
        };
        let force = static_rates.0 + per_flux * flux_rate;
        (force, static_rates.1 + per_flux * flux_second + spread, current_rate)
    }

    /// First and second derivative of the lateral force, in N/s and N/s², from those of the levitation
    /// force, of which it is a fraction that gap and offset determine.
    ///
    /// # Errors
    /// As [`Magnet::outputs`].
    pub fn lateral_rates(
        &self,
        state: &State,
        inputs: &MagnetInputs,
        rates: &InputRates,
        lift: &OutputRates,
    ) -> Result<[f64; 2], Error> {
        let Some(width) = self.parameters().pole_width else { return Ok([0.0; 2]) };
        let force = self.outputs(state, inputs)?.force;
        let share = match self.lift_loss() {
            Some(law) => law.lateral_share(inputs.place()),
            None => lateral_share(inputs.gap, inputs.lateral_offset, width),
        };
        let [share, first, second] = share.course(&Motion {
            rates: [inputs.gap_rate, rates.offset_rate],
            bends: [rates.gap_acceleration, rates.offset_acceleration],
        });
        Ok([
            lift.force * share + force * first,
            lift.force_second * share + 2.0 * lift.force * first + force * second,
        ])
    }

    /// Partial derivatives of the outputs with respect to the inputs.
    ///
    /// # Errors
    /// Inputs that are not finite, or a closed gap.
    pub fn partials(&self, state: &State, inputs: &MagnetInputs) -> Result<Partials, Error> {
        let outputs = self.outputs(state, inputs)?;
        let MagnetInputs { gap, lateral_offset, .. } = *inputs;
        let mode = self.limits_at_work(state, inputs);
        let force_is_off = self.force_is_off(state);
        let (force_by_gap, current_by_gap) = if force_is_off {
            (0.0, 0.0)
        } else if mode.current_is_limited() {
            (self.electromagnet().force_gradient(gap, outputs.current).0, 0.0)
        } else {
            (0.0, self.electromagnet().current_by_gap(gap, outputs.current))
        };
        let force_by_static_force = match self.electromagnet().law() {
            Law::Linear if !force_is_off => 1.0,
            _ => 0.0,
        };
        let reading_slopes = self.reading_slopes(state);
        let [by_force, by_gap, by_offset] = self
            .parameters()
            .pole_width
            .map_or([0.0; 3], |width| lateral_gradient(outputs.force, gap, lateral_offset, width));
        let held = self.is_sampled() || mode.voltage_is_limited() || self.is_off(state);
        let (by_acceleration, by_command) = if held { (0.0, 0.0) } else { self.feed_through() };
        let mut partials = Partials {
            force_by_gap,
            current_by_gap,
            force_by_offset: 0.0,
            current_by_offset: 0.0,
            lost_lift: self
                .parameters()
                .pole_width
                .map_or([0.0; 2], |width| lost_lift_slopes(gap, lateral_offset, width)),
            force_by_static_force,
            lateral_force_by_gap: by_gap + by_force * force_by_gap,
            lateral_force_by_static_force: by_force * force_by_static_force,
            lateral_force_by_offset: by_offset,
            voltage_by_acceleration: by_acceleration * reading_slopes[1],
            voltage_by_command: by_command,
            estimate_by_acceleration: if self.parameters().external_controller {
                0.0
            } else {
                ACCELERATION_SCALE * reading_slopes[1]
            },
            reading_slopes,
        };
        if let Some(law) = self.lift_loss() {
            let limited = mode.current_is_limited();
            self.spread(law, state, inputs, limited, &mut partials);
        }
        Ok(partials)
    }

    /// What lift loss changes in the partial derivatives.
    fn spread(
        &self,
        law: &LiftLoss,
        state: &State,
        inputs: &MagnetInputs,
        limited: bool,
        partials: &mut Partials,
    ) {
        let place = inputs.place();
        let (flux, current) = self.flux_and_current(state, place);
        let (force, lateral, by_place) = if limited {
            let force = law.force_at_current(place, current);
            (force, law.lateral_at_current(place, current), [0.0; 2])
        } else {
            let total = self.total_flux(state.operating_current, flux);
            let per_flux = law.reluctance(place);
            let by_place = [per_flux.by_gap * total, per_flux.by_offset * total];
            (law.force_at_flux(place, total), law.lateral_at_flux(place, total), by_place)
        };
        partials.force_by_gap = force.by_gap;
        partials.force_by_offset = force.by_offset;
        partials.lateral_force_by_gap = lateral.by_gap;
        partials.lateral_force_by_offset = lateral.by_offset;
        [partials.current_by_gap, partials.current_by_offset] = by_place;
    }
}

/// The electrical side of one instant.
struct Coil {
    mode: LimitsAtWork,
    voltage: f64,
    voltage_rate: f64,
}
