//! A complete unit: Dahlquist's test equation ẋ = −k·(x − u), stepped exactly.

use fmi2_export::{Error, Info, Interface, Model, RealVar, Resources, Step, UnitOfMeasure, Values};

struct Dahlquist {
    k: RealVar,
    x0: RealVar,
    u: RealVar,
    x: RealVar,
}

impl Model for Dahlquist {
    /// x
    type State = f64;

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface.describe(Info::new("dahlquist", "Dahlquist").experiment(0.0, 10.0, 0.1));
        let k = interface.real("k").tunable(1.0).min(0.0).unit(UnitOfMeasure::PER_SECOND).done();
        let x0 = interface.real("x0").parameter(1.0).description("x at first").done();
        let u = interface.real("u").input(0.0).done();
        let x = interface.real("x").output().done();
        interface.independent(x);
        interface.initially_depends(x, &[x0]);
        Ok(Self { k, x0, u, x })
    }

    fn initialise(&mut self, values: &mut Values, _: f64) -> Result<f64, Error> {
        Ok(values.real(self.x0))
    }

    fn outputs(&mut self, x: &f64, values: &mut Values, _: f64) -> Result<(), Error> {
        values.set_real(self.x, *x);
        Ok(())
    }

    fn step(&mut self, x: &mut f64, values: &mut Values, step: Step) -> Result<(), Error> {
        // With u = u₀ + u̇·t: x(h) = x·e^(−kh) + u₀·(1 − e^(−kh)) + u̇·(h − (1 − e^(−kh))/k).
        let ([u, rate, ..], kh) = (*values.taylor(self.u), values.real(self.k) * step.size);
        let gone = -(-kh).exp_m1();
        let lag = if kh > 0.0 { 1.0 - gone / kh } else { 0.0 };
        *x += (u - *x) * gone + rate * step.size * lag;
        Ok(())
    }
}

fmi2_export::export!(Dahlquist);
