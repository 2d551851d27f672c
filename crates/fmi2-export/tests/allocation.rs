//! Stepping and saving must not allocate.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::hint::black_box;

use allocation_counter::measure;
use fmi2_export::testing::TestInstance;
use fmi2_export::*;

/// ẋ_k = u_k.
struct Integrators {
    u: RealVars,
    x: RealVars,
}

impl Model for Integrators {
    type State = [f64; 8];

    fn declare(_: &Resources, t: &mut Interface) -> Result<Self, Error> {
        t.describe(Info::new("integrators", "Integrators"));
        let u = t.reals("u", 8).input(0.0).done();
        let x = t.reals("x", 8).output().done();
        t.string("label").parameter("eight").done();
        Ok(Self { u, x })
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<[f64; 8], Error> {
        Ok([0.0; 8])
    }

    fn outputs(&mut self, x: &[f64; 8], values: &mut Values, _: f64) -> Result<(), Error> {
        values.reals_mut(self.x).copy_from_slice(x);
        Ok(())
    }

    fn step(&mut self, x: &mut [f64; 8], values: &mut Values, step: Step) -> Result<(), Error> {
        for (x, u) in x.iter_mut().zip(values.taylors(self.u)) {
            *x += step.size * (u[0] + step.size / 2.0 * u[1]);
        }
        Ok(())
    }
}

#[test]
fn issue_stepping_saving_and_restoring_do_not_allocate() {
    let mut one = TestInstance::new::<Integrators>("none").unwrap();
    one.initialize(0.0).unwrap();
    let (inputs, outputs): (Vec<u32>, Vec<u32>) = ((0..8).collect(), (8..16).collect());
    let mut values = [0.0; 8];
    // The first save makes the memory, the first derivative the scratch.
    one.save().unwrap();
    one.derivative("x_01", "u_01").unwrap();
    let counted = measure(|| {
        for k in 0..1000 {
            one.set_reals(&inputs, &[1.0; 8]).unwrap();
            one.set_input_derivative("u_03", 1, 2.0).unwrap();
            one.step(f64::from(k) * 0.5, 0.5).unwrap();
            one.reals(&outputs, &mut values).unwrap();
            one.derivative("x_01", "u_01").unwrap();
            one.save().unwrap();
            one.restore().unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
    assert_eq!(values[0], 500.0);
    assert_eq!(values[2], 500.0 + 1000.0 * 0.25);
    // The counter does count.
    assert!(measure(|| drop(black_box(vec![1.0]))).count_total > 0);
}
