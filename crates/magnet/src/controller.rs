//! The controller alone: filter and control law (eqs 3-5) without a magnet.

use serde::{Deserialize, Serialize};

use crate::{
    Error, InputCourse,
    control_law::ControlLaw,
    filter::{ACCELERATION_SCALE, Filter, POSITION_SCALE},
    inputs::Taylor,
    parameters::{Controller, FilterDesign, MagnetParameters, finite, positive},
    sampling::{self, Next},
    state::Hold,
    step_map::MapCache,
};

/// Everything that describes a controller without its magnet. [`Default`] is the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ControllerParameters {
    /// Nominal gap c₀, in m: the set point.
    pub nominal_gap: f64,
    /// Gains of eq. 3, and the sampling.
    pub control: Controller,
    /// Design of the filter.
    pub filter: FilterDesign,
}

impl Default for ControllerParameters {
    fn default() -> Self {
        let MagnetParameters { nominal_gap, control, filter, .. } = MagnetParameters::default();
        Self { nominal_gap, control, filter }
    }
}

/// Measured signals at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ControllerInputs {
    /// Gap c, in m.
    pub gap: f64,
    /// Rate of the gap ċ, in m/s: for the filter's start.
    pub gap_rate: f64,
    /// Inertial acceleration q̈ of the magnet, in m/s², positive downward.
    pub acceleration: f64,
}

/// Everything that changes while stepping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ControllerState {
    /// Filter states x₁ … x₅ (eq. 4).
    pub filter: [f64; 5],
    /// Memory of a sampled controller; its voltages are Δv.
    pub hold: Hold,
    /// Whether a sampled controller takes its next sample now: at the start of the next step.
    pub due: bool,
    /// The part of Δv, in V, that the gap's rate caused at the start.
    pub transient_voltage: f64,
}

/// Quantities at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerOutputs {
    /// Δv of eq. 3, in V.
    pub voltage: f64,
    /// Scaled estimates y₁ … y₅ of eq. 5.
    pub estimates: [f64; 5],
}

/// Time derivatives of the outputs at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ControllerRates {
    /// dΔv/dt, in V/s; zero while a sampled controller holds it.
    pub voltage: f64,
    /// y', in 1/s.
    pub estimates: [f64; 5],
}

/// Caches the maps of recent step sizes; never influences a result.
#[derive(Debug, Clone, Default)]
pub struct ControllerWorkspace(MapCache<5, 5, 13>);

/// Filter and control law (eqs 3-5), ready to step. It never changes.
///
/// The filter is linear and is integrated exactly for inputs that are polynomials over the step; a
/// sampled controller is too, from sample to sample.
#[derive(Debug, Clone, PartialEq)]
pub struct VoltageController {
    parameters: ControllerParameters,
    filter: Filter,
    control_law: ControlLaw,
    /// Filter matrix by (Δc, q̈), and the numbers that determine it and A.
    by_input: [[f64; 2]; 5],
    key: [f64; 5],
}

impl VoltageController {
    /// Builds a controller.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the first value that is not acceptable.
    pub fn new(parameters: ControllerParameters) -> Result<Self, Error> {
        positive("nominal gap (m)", parameters.nominal_gap)?;
        parameters.control.gains.check()?;
        if let Some(sampling) = parameters.control.sampling {
            sampling.check()?;
        }
        parameters.filter.check()?;
        let filter = Filter::new(&parameters.filter);
        let control_law = ControlLaw::new(&parameters.control.gains, &filter);
        let by_input = filter.b.map(|[c, q]| [POSITION_SCALE * c, ACCELERATION_SCALE * q]);
        let design = &parameters.filter;
        let key = [
            design.gap_cutoff,
            design.gap_damping,
            design.velocity_cutoff,
            design.velocity_damping,
            design.position_cutoff,
        ];
        Ok(Self { parameters, filter, control_law, by_input, key })
    }

    /// The parameters of the controller.
    pub fn parameters(&self) -> &ControllerParameters {
        &self.parameters
    }

    /// Matrices of the filter.
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// x' = A·x + B·(Δc, q̈) of the continuous controller: A in 1/s, and B.
    pub fn linear_system(&self) -> (&[[f64; 5]; 5], &[[f64; 2]; 5]) {
        (&self.filter.a, &self.by_input)
    }

    /// ∂Δv/∂x of the continuous controller, in V.
    pub fn voltage_by_state(&self) -> &[f64; 5] {
        &self.control_law.by_state
    }

    /// ∂Δv/∂q̈ between steps, in V·s²/m: zero while a sampled controller holds its voltage. The gap
    /// does not feed through.
    pub fn voltage_by_acceleration(&self, state: &ControllerState) -> f64 {
        if self.follows_inputs(state) { self.control_law.by_acceleration } else { 0.0 }
    }

    /// Whether the voltage now follows from the inputs now: always without sampling, and at a sample
    /// unless it acts one later.
    fn follows_inputs(&self, state: &ControllerState) -> bool {
        self.parameters.control.sampling.is_none_or(|it| state.due && it.delay == 0)
    }

    /// The state to start from at `time` (s): the filter at [`Filter::rest`].
    ///
    /// # Errors
    /// Inputs that are not finite.
    pub fn initialise(
        &self,
        inputs: &ControllerInputs,
        time: f64,
    ) -> Result<ControllerState, Error> {
        finite("gap (m)", inputs.gap)?;
        finite("gap rate (m/s)", inputs.gap_rate)?;
        finite("acceleration (m/s²)", inputs.acceleration)?;
        let deviation = inputs.gap - self.parameters.nominal_gap;
        let filter = self.filter.rest(deviation, inputs.gap_rate, inputs.acceleration);
        let voltage = self.control_law.voltage(&filter, inputs.acceleration);
        let lasting = self.control_law.voltage(&self.filter.rest(deviation, 0.0, 0.0), 0.0);
        let hold = Hold::new(time, voltage);
        Ok(ControllerState { filter, hold, due: true, transient_voltage: voltage - lasting })
    }

    /// Advances the state over `size` (s) from `time` (s), while gap and acceleration follow
    /// `course`. Exact to rounding. After an error the state is unchanged.
    ///
    /// # Errors
    /// A size that is not positive, or inputs that are not finite.
    pub fn step(
        &self,
        state: &mut ControllerState,
        course: &InputCourse,
        time: f64,
        size: f64,
        workspace: &mut ControllerWorkspace,
    ) -> Result<(), Error> {
        positive("step size (s)", size)?;
        course.check_finite()?;
        let Some(sampling) = self.parameters.control.sampling else {
            self.advance(state, course, size, workspace);
            return Ok(());
        };
        let mut elapsed = 0.0;
        while elapsed < size {
            match sampling::next(&state.hold, sampling.period, time, elapsed, size) {
                Next::Sample => {
                    let acceleration = course.direct(elapsed).acceleration;
                    let voltage = self.control_law.voltage(&state.filter, acceleration);
                    state.hold.take(voltage, sampling.delay);
                }
                Next::Hold { until } => {
                    self.advance(state, &course.after(elapsed), until - elapsed, workspace);
                    elapsed = until;
                }
            }
        }
        let after = sampling::next(&state.hold, sampling.period, time + size, 0.0, size);
        state.due = matches!(after, Next::Sample);
        Ok(())
    }

    fn advance(
        &self,
        state: &mut ControllerState,
        course: &InputCourse,
        size: f64,
        workspace: &mut ControllerWorkspace,
    ) {
        let [gap, rate, second, third] = course.gap;
        let deviation: Taylor = [gap - self.parameters.nominal_gap, rate, second, third];
        let inputs = [&deviation, &course.acceleration];
        let system = || self.linear_system();
        let inputs = (inputs, [course.further.gap, course.further.acceleration]);
        state.filter = workspace.0.step(&self.key, system, &state.filter, inputs, size);
    }

    /// All outputs for a state and the inputs of the same instant. Where a sample is due, the voltage is
    /// the one that it sets: the value from this instant on.
    pub fn outputs(&self, state: &ControllerState, inputs: &ControllerInputs) -> ControllerOutputs {
        let ControllerInputs { gap, acceleration, .. } = *inputs;
        let voltage = if self.follows_inputs(state) {
            self.control_law.voltage(&state.filter, acceleration)
        } else if let Some(sampling) = self.parameters.control.sampling.filter(|_| state.due) {
            // an earlier sample, which acts from now on
            state.hold.upcoming(sampling.delay)
        } else {
            state.hold.applied
        };
        let deviation = gap - self.parameters.nominal_gap;
        let estimates = self.filter.estimates(&state.filter, deviation, acceleration);
        ControllerOutputs { voltage, estimates }
    }

    /// Time derivatives of the outputs; `jerk` is the acceleration's rate, in m/s³.
    pub fn rates(
        &self,
        state: &ControllerState,
        inputs: &ControllerInputs,
        jerk: f64,
    ) -> ControllerRates {
        let ControllerInputs { gap, acceleration, .. } = *inputs;
        let deviation = gap - self.parameters.nominal_gap;
        let filter = self.filter.rates(&state.filter, deviation, acceleration);
        ControllerRates {
            voltage: if self.parameters.control.sampling.is_some() {
                0.0
            } else {
                self.control_law.voltage(&filter, jerk)
            },
            // The gap has no feed-through to the estimates, so its rate is not needed here.
            estimates: self.filter.estimates(&filter, 0.0, jerk),
        }
    }
}
