//! A model with a variable of every kind, and trouble on demand.

#![allow(dead_code, clippy::panic, reason = "a test model; every test program uses a part of it")]

use fmi2_export::*;
use serde::{Deserialize, Serialize};

/// What [`Everything`] is asked to do wrong, by its tunable parameter `trouble`.
pub mod trouble {
    pub const PANIC_IN_STEP: i32 = 1;
    pub const ERROR_IN_STEP: i32 = 2;
    pub const DISCARD_LONG_STEPS: i32 = 3;
    pub const NAN_AFTER_STEP: i32 = 4;
    pub const PANIC_IN_OUTPUTS: i32 = 5;
    pub const FATAL_IN_STEP: i32 = 6;
    pub const PANIC_IN_INITIALISE: i32 = 7;
    pub const ERROR_IN_INITIALISE: i32 = 8;
    pub const DISCARD_IN_OUTPUTS: i32 = 9;
    pub const END_IN_STEP: i32 = 10;
}

/// ẋ = u, y = x + gain·u² + offset, z_k = x·v_k, and one variable of everything else.
pub struct Everything {
    gain: RealVar,
    offset: RealVar,
    count: IntegerVar,
    analytic: BooleanVar,
    label: StringVar,
    trouble: IntegerVar,
    u: RealVar,
    v: RealVars,
    mode: IntegerVar,
    switch: BooleanVar,
    note: StringVar,
    y: RealVar,
    z: RealVars,
    steps: IntegerVar,
    odd: BooleanVar,
    echo: StringVar,
    product: RealVar,
    power: RealVar,
    told: RealVar,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct State {
    x: f64,
    steps: i32,
    told: f64,
    /// The gain at the beginning.
    gain: f64,
    history: Vec<f64>,
}

impl Model for Everything {
    type State = State;

    fn declare(resources: &Resources, t: &mut Interface) -> Result<Self, Error> {
        t.describe(
            Info::new("everything", "A \"model\" with <everything> & more")
                .description("Größe")
                .version("1.2.3")
                .author("The authors")
                .copyright("©")
                .license("MIT OR Apache-2.0")
                .experiment(0.0, 10.0, 0.01)
                .tolerance(1e-6),
        );
        let extra = resources.read_if_present("extra.txt")?;
        if let Some(name) = extra {
            t.set_model_name(String::from_utf8_lossy(&name));
        }
        let stiffness = UnitOfMeasure::NEWTON_PER_METRE;
        let this = Self {
            gain: t.real("gain").parameter(2.0).min(0.0).max(10.0).unit(stiffness).done(),
            offset: t
                .real("offset")
                .tunable(0.5)
                .unit(UnitOfMeasure::KELVIN)
                .display("degC")
                .done(),
            count: t.integer("count").parameter(3).min(1).max(9).description("how many").done(),
            analytic: t.boolean("analytic").parameter(false).done(),
            label: t.string("label").parameter("a & <b> \"c\" % #").done(),
            trouble: t.integer("trouble").tunable(0).done(),
            u: t.real("u").input(0.25).unit(UnitOfMeasure::METRE).display("mm").nominal(0.1).done(),
            v: t.reals("v", 3)
                .input(0.0)
                .starts([1.0, 2.0, 3.0])
                .description("input {k}")
                .unit(UnitOfMeasure::METRE)
                .done(),
            mode: t.integer("mode").input(0).done(),
            switch: t.boolean("switch").input(false).done(),
            note: t.string("note").input("none").done(),
            y: t.real("y").output().derivatives(2).unit(UnitOfMeasure::NEWTON).done(),
            z: t.reals("z", 3).output().description("output {k}").done(),
            steps: t.integer("steps").output().done(),
            odd: t.boolean("odd").output().done(),
            echo: t.string("echo").output().done(),
            product: t.real("product").calculated_parameter().done(),
            power: t.real("power").local().done(),
            told: t.real("told").output().discrete().done(),
        };
        t.real("pi").constant(std::f64::consts::PI).done();
        t.depends(this.y, &[this.u]);
        t.depends_elementwise(this.z, this.v);
        t.independent(this.steps);
        t.independent(this.told);
        t.depends(this.echo, &[this.switch.row(), this.note.row(), this.mode.row()]);
        t.initially_depends(this.y, &[this.gain.row(), this.u.row(), this.offset.row()]);
        t.initially_depends_elementwise(this.z, this.v);
        t.initially_depends(this.product, &[this.gain.row(), this.count.row()]);
        t.initially_independent(this.steps);
        Ok(this)
    }

    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<State, Error> {
        match values.integer(self.trouble) {
            trouble::PANIC_IN_INITIALISE => panic!("asked to panic 100% in #initialise#"),
            trouble::ERROR_IN_INITIALISE => return Err(Error::invalid("asked to fail")),
            _ => {}
        }
        let product = values.real(self.gain) * f64::from(values.integer(self.count));
        values.set_real(self.product, product);
        Ok(State { x: time, gain: values.real(self.gain), ..State::default() })
    }

    fn report(
        &mut self,
        state: &State,
        values: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        match request {
            "x" => Ok(Some(format!("x is {} at u = {}", state.x, values.real(self.u)))),
            "nothing" => Ok(Some(String::new())),
            "fail" => Err(Error::invalid("asked to fail")),
            "panic" => panic!("asked to panic in a report"),
            _ => Ok(None),
        }
    }

    fn outputs(&mut self, state: &State, values: &mut Values, _: f64) -> Result<(), Error> {
        let trouble = values.integer(self.trouble);
        match trouble {
            trouble::PANIC_IN_OUTPUTS => panic!("asked to panic in outputs"),
            trouble::DISCARD_IN_OUTPUTS => return Err(Error::discard("no outputs")),
            _ => {}
        }
        let u = values.real(self.u);
        let mut y = state.x + values.real(self.gain) * u * u + values.real(self.offset);
        if trouble == trouble::NAN_AFTER_STEP && state.steps > 0 {
            y = f64::NAN;
        }
        values.set_real(self.y, y);
        for k in 0..3 {
            let z = state.x * values.reals(self.v)[k];
            values.reals_mut(self.z)[k] = z;
        }
        values.set_real(self.power, state.x * u + state.gain);
        values.set_real(self.told, state.told);
        values.set_integer(self.steps, state.steps);
        values.set_boolean(self.odd, state.steps % 2 != 0);
        let note = values.string(self.note);
        let echo = format!("{note}|{}|{}", values.integer(self.mode), values.boolean(self.switch));
        values.set_string(self.echo, &echo);
        Ok(())
    }

    fn step(&mut self, state: &mut State, values: &mut Values, step: Step) -> Result<(), Error> {
        let trouble = values.integer(self.trouble);
        if trouble == trouble::DISCARD_LONG_STEPS && step.size > 0.1 {
            return Err(Error::discard("the step is longer than 0.1 s"));
        }
        if trouble == trouble::END_IN_STEP {
            return Err(Error::terminated("the end is reached"));
        }
        // As a real model would leave things when it fails in the middle.
        state.steps += 1;
        match trouble {
            trouble::PANIC_IN_STEP => panic!("asked to panic"),
            trouble::ERROR_IN_STEP => return Err(Error::invalid("asked to fail")),
            trouble::FATAL_IN_STEP => return Err(Error::fatal("asked to take all down")),
            _ => {}
        }
        let (h, [u, first, second, third]) = (step.size, *values.taylor(self.u));
        // The exact integral of the input's polynomial.
        state.x += h * (u + h / 2.0 * (first + h / 3.0 * (second + h / 4.0 * third)));
        state.history.push(values.taylors(self.v).iter().map(|v| v[0]).sum());
        state.x += 1e-3 * state.history.iter().sum::<f64>().sin();
        Ok(())
    }

    fn parameters_changed(&mut self, state: &mut State, values: &mut Values) -> Result<(), Error> {
        state.told += values.real(self.offset);
        Ok(())
    }

    fn output_derivative(
        &mut self,
        _: &State,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        Ok(match (output == self.y, order) {
            (true, 1) => Some(values.real(self.u)),
            (true, _) => Some(0.0),
            (false, _) => None,
        })
    }

    fn directional_derivative(
        &mut self,
        state: &State,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        // Written before it is known whether it counts: the kit must not mind.
        let slope = 2.0 * values.real(self.gain) * values.real(self.u);
        result.set_real(self.y, slope * seed.real(self.u));
        for (result, seed) in result.reals_mut(self.z).iter_mut().zip(seed.reals(self.v)) {
            *result = state.x * seed;
        }
        Ok(values.boolean(self.analytic))
    }
}

/// A folder with no resources.
pub const NONE: &str = "/nonexistent/resources";
