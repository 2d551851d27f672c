//! Input, output and directional derivatives.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{Everything, NONE};
use fmi2_export::sys::fmi2Status;
use fmi2_export::testing::TestInstance;
use fmi2_export::{
    Error, Info, Interface, Model, RealVar, RealVars, Resources, Step, Values, describe,
};

fn initialized() -> TestInstance {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.initialize(0.0).unwrap();
    // Take the history's wobble out: sin(0) = 0.
    for name in ["v_01", "v_02", "v_03"] {
        one.set_real(name, 0.0).unwrap();
    }
    one
}

/// The model integrates ẋ = u exactly, so a cubic input must give the exact quartic. Held inputs
/// would miss it by 1/2 of the slope.
#[test]
fn analytic_a_cubic_input_is_integrated_exactly() {
    let mut one = initialized();
    let u = |t: f64| 1.0 + t * (2.0 + t * (3.0 + t * 4.0));
    let x = |t: f64| t * (1.0 + t * (1.0 + t * (1.0 + t)));
    let mut t: f64 = 0.0;
    for h in [0.5, 0.25, 0.125, 1.0] {
        one.set_real("u", u(t)).unwrap();
        one.set_input_derivative("u", 1, 2.0 + t * (6.0 + t * 12.0)).unwrap();
        one.set_input_derivative("u", 2, 6.0 + t * 24.0).unwrap();
        one.set_input_derivative("u", 3, 24.0).unwrap();
        one.step(t, h).unwrap();
        t += h;
        // The input stands at the end of its polynomial. All numbers are dyadic with few bits;
        // only the division by 3 in the nested form rounds: a few ε of the largest term.
        let tolerance = 8.0 * f64::EPSILON * u(t).abs();
        assert!((one.real("u").unwrap() - u(t)).abs() <= tolerance);
        one.set_real("u", 0.0).unwrap();
        let y = one.real("y").unwrap();
        assert!((y - 0.5 - x(t)).abs() <= 8.0 * f64::EPSILON * x(t), "{y} {}", x(t));
    }
    // Derivatives hold for one step only.
    one.step(t, 1.0).unwrap();
    assert!((one.real("y").unwrap() - 0.5 - x(t)).abs() <= 8.0 * f64::EPSILON * x(t));
}

#[test]
fn issue_input_derivatives_are_checked() {
    let mut one = initialized();
    for (name, order, value, why) in [
        ("u", 0, 1.0, "order 1 to 3"),
        ("u", 4, 1.0, "order 1 to 3"),
        ("u", -1, 1.0, "order 1 to 3"),
        ("u", 1, f64::NAN, "cannot be NaN"),
        ("y", 1, 1.0, "not a continuous input"),
        ("gain", 1, 1.0, "not a continuous input"),
    ] {
        let failure = one.set_input_derivative(name, order, value).unwrap_err();
        assert!(failure.to_string().contains(why), "{failure}");
    }
}

#[test]
fn analytic_output_derivatives() {
    let mut one = initialized();
    one.set_real("u", 0.75).unwrap();
    assert_eq!(one.output_derivative("y", 1).unwrap(), 0.75);
    assert_eq!(one.output_derivative("y", 2).unwrap(), 0.0);
    let failure = one.output_derivative("z_01", 1).unwrap_err();
    assert_eq!(failure.status, fmi2Status::fmi2Discard);
    for (name, order) in [("y", 3), ("y", 0), ("y", -1), ("u", 1)] {
        let failure = one.output_derivative(name, order).unwrap_err();
        assert_eq!(failure.status, fmi2Status::fmi2Error, "{name} {order}");
    }
}

/// Gives as derivative how often it was told to prepare.
struct Prepared(u32, RealVars);

impl Model for Prepared {
    type State = ();

    fn declare(_: &Resources, t: &mut Interface) -> Result<Self, Error> {
        t.describe(Info::new("prepared", "Prepared"));
        Ok(Self(0, t.reals("y", 3).output().derivatives(2).done()))
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> {
        Ok(())
    }

    fn outputs(&mut self, (): &(), values: &mut Values, _: f64) -> Result<(), Error> {
        values.reals_mut(self.1).fill(0.0);
        Ok(())
    }

    fn step(&mut self, (): &mut (), _: &mut Values, _: Step) -> Result<(), Error> {
        Ok(())
    }

    fn prepare_derivatives(&mut self, (): &(), _: &Values) -> Result<(), Error> {
        self.0 += 1;
        Ok(())
    }

    fn output_derivative(
        &mut self,
        (): &(),
        _: &Values,
        _: RealVar,
        _: u32,
    ) -> Result<Option<f64>, Error> {
        Ok(Some(f64::from(self.0)))
    }
}

/// A row of derivatives is prepared once, however long it is; a refused one is not prepared.
#[test]
fn invariant_a_row_of_output_derivatives_is_prepared_once() {
    let mut one = TestInstance::new::<Prepared>(NONE).unwrap();
    one.initialize(0.0).unwrap();
    let row = ["y_01", "y_02", "y_03", "y_01"].map(|name| one.reference(name).unwrap());
    for (count, orders) in [(1.0, [1, 1, 1, 2]), (1.0, [1, 1, 3, 1]), (2.0, [2, 2, 1, 1])] {
        let mut out = [count; 4];
        // SAFETY: the component is alive and all arrays have four elements.
        let status = unsafe {
            fmi2_export::ffi::get_real_output_derivatives(
                one.component(),
                row.as_ptr(),
                4,
                orders.as_ptr(),
                out.as_mut_ptr(),
            )
        };
        assert_eq!(status == fmi2Status::fmi2OK, !orders.contains(&3));
        assert_eq!(out, [count; 4]);
    }
}

/// y = x + gain·u² + offset: ∂y/∂u = 2·gain·u; z_k = x·v_k: ∂z_k/∂v_k = x.
#[test]
fn analytic_directional_derivatives_between_steps() {
    for own in [true, false] {
        let mut one = TestInstance::new::<Everything>(NONE).unwrap();
        one.set_boolean("analytic", own).unwrap();
        one.initialize(0.0).unwrap();
        one.step(0.0, 1.0).unwrap();
        let before = one.serialize().unwrap();
        let x = one.real("y").unwrap() - 0.5 - 2.0 * 0.25 * 0.25;
        // Central differences are exact for the quadratic y but for rounding ε·|f|/δ, with
        // δ = ∛ε·0.25 (u's size): 1.5e-10·|f|, and f is about 1.
        let tolerance = if own { 1e-15 } else { 5e-10 };
        let slope = one.derivative("y", "u").unwrap();
        assert!((slope - 1.0).abs() < tolerance, "{slope}");
        let slope = one.derivative("z_02", "v_02").unwrap();
        assert!((slope - x).abs() < tolerance, "{slope}");
        assert_eq!(one.derivative("z_02", "v_03").unwrap(), 0.0);
        assert_eq!(one.derivative("y", "v_01").unwrap(), 0.0);
        // Asking changes nothing.
        assert_eq!(one.serialize().unwrap(), before);
        for (unknown, known) in [("y", "gain"), ("u", "u"), ("y", "y"), ("product", "u")] {
            assert!(one.derivative(unknown, known).is_err(), "{unknown} {known}");
        }
    }
}

/// In initialization mode parameters are known too, and what `initialise` computes counts.
#[test]
fn analytic_directional_derivatives_in_initialization_mode() {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.enter_initialization(0.0).unwrap();
    let (y, power) = (one.real("y").unwrap(), one.real("power").unwrap());
    let tolerance = 5e-10;
    assert!((one.derivative("y", "u").unwrap() - 1.0).abs() < tolerance);
    assert!((one.derivative("y", "gain").unwrap() - 0.0625).abs() < tolerance);
    assert!((one.derivative("y", "offset").unwrap() - 1.0).abs() < tolerance);
    assert!((one.derivative("product", "gain").unwrap() - 3.0).abs() < 5.0 * tolerance);
    assert_eq!(one.real("y").unwrap(), y);
    // The state of the displaced point is not what the model goes on with.
    one.exit_initialization().unwrap();
    assert_eq!(one.real("y").unwrap(), y);
    assert_eq!(one.real("power").unwrap(), power);
}

/// A direction over several inputs is the sum of its parts.
#[test]
fn invariant_directional_derivatives_are_linear_in_the_direction() {
    let mut one = initialized();
    one.set_real("u", 1.5).unwrap();
    one.step(0.0, 1.0).unwrap();
    let y = one.reference("y").unwrap();
    let (u, v) = (one.reference("u").unwrap(), one.reference("v_01").unwrap());
    let mut out = 0.0;
    // SAFETY: the component is alive and the arrays have the lengths stated.
    let status = unsafe {
        fmi2_export::ffi::get_directional_derivative(
            one.component(),
            &raw const y,
            1,
            [u, v].as_ptr(),
            2,
            [-3.0, 8.0].as_ptr(),
            &raw mut out,
        )
    };
    assert_eq!(status, fmi2Status::fmi2OK);
    let expected = -3.0 * one.derivative("y", "u").unwrap();
    // Both are differences with their own δ: ε·|f|/δ with f = 6.5 and, for the direction, with
    // δ = ∛ε/8 (v is 0 with nominal 1): 8·6.5·4e-11 = 2e-9.
    assert!((out - expected).abs() < 5e-9, "{out} {expected}");
}

/// ẋ = u, where u takes derivatives up to the fifth order and v up to the third.
struct Beyond {
    u: RealVar,
    x: RealVar,
}

impl Model for Beyond {
    type State = f64;

    fn declare(_: &Resources, interface: &mut Interface) -> Result<Self, Error> {
        interface
            .describe(Info::new("beyond", "Integrator of a quintic").experiment(0.0, 1.0, 0.1));
        let u = interface.real("u").input(0.0).takes(5).description("Rate").done();
        interface.real("v").input(0.0).description("Nothing").done();
        let x = interface.real("x").output().derivatives(1).interpolated(2);
        let x = x.description("Integral").done();
        interface.independent(x);
        Ok(Self { u, x })
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<f64, Error> {
        Ok(0.0)
    }

    fn outputs(&mut self, state: &f64, values: &mut Values, _: f64) -> Result<(), Error> {
        values.set_real(self.x, *state);
        Ok(())
    }

    fn step(&mut self, state: &mut f64, values: &mut Values, step: Step) -> Result<(), Error> {
        let h = step.size;
        let ([u, a, b, c], [d, e]) = (*values.taylor(self.u), *values.further(self.u));
        let beyond = c + h / 5.0 * (d + h / 6.0 * e);
        *state += h * (u + h / 2.0 * (a + h / 3.0 * (b + h / 4.0 * beyond)));
        Ok(())
    }
}

/// u = t⁵: the input and its integral at the end of the step, and nothing of it is left for the next step.
#[test]
fn analytic_a_quintic_input_is_integrated_exactly() {
    let mut one = TestInstance::new::<Beyond>(NONE).unwrap();
    one.initialize(0.0).unwrap();
    let factorials = [1.0, 1.0, 2.0, 6.0, 24.0, 120.0];
    let (t, h) = (0.0, 2.0);
    one.set_input_derivative("u", 4, 0.0).unwrap();
    one.set_input_derivative("u", 5, factorials[5]).unwrap();
    one.step(t, h).unwrap();
    let ends = |one: &mut TestInstance, x: f64| {
        assert_eq!(one.real("u").unwrap(), 32.0);
        assert!((one.real("x").unwrap() - x).abs() < 1e-13);
    };
    ends(&mut one, 64.0 / 6.0);
    one.step(h, h).unwrap();
    ends(&mut one, 64.0 / 6.0 + 64.0);
    for (name, order) in [("u", 6), ("v", 4)] {
        let failure = one.set_input_derivative(name, order, 1.0).unwrap_err().to_string();
        assert!(failure.contains(&format!("order 1 to {}", order - 1)), "{failure}");
    }
    let description = describe::<Beyond>(&Resources::new(NONE)).unwrap();
    for line in [
        r#"maxOutputDerivativeOrder="2""#,
        r#"<Inputs order="5" variables="1"/>"#,
        r#"<Outputs order="1" variables="3"/>"#,
        r#"<Interpolation order="2" variables="3"/>"#,
    ] {
        assert!(description.contains(line), "{line}: {description}");
    }
}
