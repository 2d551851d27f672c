//! A controller of your own for a levitation magnet, as an FMI 2.0 co-simulation unit in Rust.
//!
//! A continuous controller: state feedback of the gap and its rate, with damping by the magnet's own
//! velocity z, which is integrated from the accelerometer and leaks with the rate ω:
//!
//! z' = q̈ − ω·z,  Δv = k_gap·(c − c₀) + k_rate·ċ + k_velocity·z + k_acceleration·q̈
//!
//! in V, beyond the magnet's operating point. Your own law replaces `Law` and the dependencies in
//! `declare`; its state replaces `State`.

use fmi2_export::{
    Error, Info, Interface, Model, RealVar, Resources, StateSpace, Step, UnitOfMeasure, Values,
};
use serde::{Deserialize, Serialize};

/// Handles of the variables.
pub struct StateFeedback {
    gap: RealVar,
    gap_rate: RealVar,
    acceleration: RealVar,
    voltage: RealVar,
    transient_voltage: RealVar,
    set_point: RealVar,
    k_gap: RealVar,
    k_rate: RealVar,
    k_velocity: RealVar,
    k_acceleration: RealVar,
    leak: RealVar,
}

/// Everything that changes while stepping.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct State {
    /// z, in m/s.
    velocity: f64,
    /// Part of the voltage at the start that does not last, in V.
    transient_voltage: f64,
    /// Slopes of gap, gap rate and acceleration at the end of the last step.
    slopes: [f64; 3],
}

/// The law, with its gains.
struct Law {
    gap: f64,
    rate: f64,
    velocity: f64,
    acceleration: f64,
}

impl Law {
    fn voltage(&self, deviation: f64, rate: f64, velocity: f64, acceleration: f64) -> f64 {
        self.gap * deviation
            + self.rate * rate
            + self.velocity * velocity
            + self.acceleration * acceleration
    }
}

impl StateFeedback {
    fn law(&self, values: &Values) -> Law {
        Law {
            gap: values.real(self.k_gap),
            rate: values.real(self.k_rate),
            velocity: values.real(self.k_velocity),
            acceleration: values.real(self.k_acceleration),
        }
    }
}

impl Model for StateFeedback {
    type State = State;

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(Info::new("state_feedback", "State feedback of a levitation magnet"));
        let mut input = |name: &str, start: f64, unit, text: &str| {
            interface.real(name).input(start).unit(unit).description(text).done()
        };
        let gap = input("gap", 0.008, UnitOfMeasure::METRE, "Air gap, positive when open");
        let gap_rate = input(
            "gap_rate",
            0.0,
            UnitOfMeasure::METRE_PER_SECOND,
            "Rate of the gap, positive when it opens",
        );
        let acceleration = input(
            "acceleration",
            0.0,
            UnitOfMeasure::METRE_PER_SECOND_SQUARED,
            "Inertial acceleration of the magnet, positive downward",
        );
        let mut output = |name: &str, text: &str| {
            let output = interface.real(name).output().derivatives(1);
            output.unit(UnitOfMeasure::VOLT).nominal(10.0).description(text).done()
        };
        let voltage = output("voltage", "Voltage beyond the magnet's operating point");
        let transient_voltage =
            output("transient_voltage", "Part of the voltage at initialization that does not last");
        let set_point = interface
            .real("set_point")
            .parameter(0.008)
            .unit(UnitOfMeasure::METRE)
            .min(1e-6)
            .description("Air gap to hold")
            .done();
        let mut gain = |name: &str, start: f64, text: &str| {
            interface.real(name).tunable(start).description(text).done()
        };
        let k_gap = gain("k_gap", 4000.0, "Gain on the gap's deviation, V/m");
        let k_rate = gain("k_rate", 100.0, "Gain on the gap's rate, V s/m");
        let k_velocity = gain("k_velocity", 200.0, "Gain on the magnet's velocity, V s/m");
        let k_acceleration = gain("k_acceleration", 4.0, "Gain on the acceleration, V s2/m");
        let leak = interface
            .real("leak")
            .tunable(5.0)
            .unit(UnitOfMeasure::PER_SECOND)
            .min(0.1)
            .description("Rate at which the integrated velocity decays")
            .done();
        // what acts on an output at the same instant, not through the state
        interface.depends(voltage, &[gap, gap_rate, acceleration]);
        interface.independent(transient_voltage);
        interface.initially_depends(
            voltage,
            &[gap, gap_rate, acceleration, set_point, k_gap, k_rate, k_acceleration],
        );
        interface.initially_depends(
            transient_voltage,
            &[gap_rate, acceleration, k_rate, k_acceleration],
        );
        Ok(Self {
            gap,
            gap_rate,
            acceleration,
            voltage,
            transient_voltage,
            set_point,
            k_gap,
            k_rate,
            k_velocity,
            k_acceleration,
            leak,
        })
    }

    fn initialise(&mut self, values: &mut Values, _: f64) -> Result<State, Error> {
        let (rate, acceleration) = (values.real(self.gap_rate), values.real(self.acceleration));
        let transient_voltage = self.law(values).voltage(0.0, rate, 0.0, acceleration);
        Ok(State { velocity: 0.0, transient_voltage, slopes: [0.0; 3] })
    }

    fn outputs(&mut self, state: &State, values: &mut Values, _: f64) -> Result<(), Error> {
        let deviation = values.real(self.gap) - values.real(self.set_point);
        let (rate, acceleration) = (values.real(self.gap_rate), values.real(self.acceleration));
        let voltage = self.law(values).voltage(deviation, rate, state.velocity, acceleration);
        values.set_real(self.voltage, voltage);
        values.set_real(self.transient_voltage, state.transient_voltage);
        Ok(())
    }

    /// Exact for an acceleration that is a polynomial: each power of time is integrated from the one
    /// below it.
    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        let (h, leak) = (step.size, values.real(self.leak));
        let course = *values.taylor(self.acceleration);
        // responses to 1, t, t²/2, t³/6
        let decay = (-leak * h).exp();
        let mut response = -(-leak * h).exp_m1() / leak;
        let mut power = 1.0;
        let mut velocity = decay * state.velocity;
        for (k, derivative) in course.into_iter().enumerate() {
            velocity += response * derivative;
            power *= h / (k + 1) as f64;
            response = (power - response) / leak;
        }
        state.velocity = velocity;
        state.slopes = [self.gap, self.gap_rate, self.acceleration].map(|input| {
            let [_, first, second, third] = *values.taylor(input);
            first + h * (second + 0.5 * h * third)
        });
        Ok(())
    }

    fn output_derivative(
        &mut self,
        state: &State,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        if order != 1 || output != self.voltage {
            return Ok((order == 1).then_some(0.0));
        }
        let [gap, rate, jerk] = state.slopes;
        let z = values.real(self.acceleration) - values.real(self.leak) * state.velocity;
        Ok(Some(self.law(values).voltage(gap, rate, z, jerk)))
    }

    /// The linearisation, for `maglev modes`. Without it the unit runs, but has no modes.
    fn report(
        &mut self,
        _: &State,
        values: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        if request != StateSpace::REQUEST {
            return Ok(None);
        }
        let law = self.law(values);
        let mut system = StateSpace::default();
        let z = system.state("velocity");
        let inputs = [self.gap, self.gap_rate, self.acceleration].map(|u| system.input(u));
        let voltage = system.output(self.voltage);
        system.output(self.transient_voltage); // constant
        system.a(z, z, -values.real(self.leak));
        system.b(z, inputs[2], 1.0);
        system.c(voltage, z, law.velocity);
        for (input, gain) in inputs.into_iter().zip([law.gap, law.rate, law.acceleration]) {
            system.d(voltage, input, gain);
        }
        system.to_json().map(Some)
    }
}

fmi2_export::export!(StateFeedback);
