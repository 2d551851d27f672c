//! Extrapolation and interpolation of one signal.

use coupling::Taylor;
use coupling::signal::{Effect, Signal};

/// A cubic and its derivatives.
fn cubic(t: f64) -> Taylor {
    Taylor::cubic([
        1.0 + t * (2.0 - t * (3.0 - 4.0 * t)),
        2.0 - 6.0 * t + 12.0 * t * t,
        -6.0 + 24.0 * t,
        24.0,
    ])
}

/// A parabola and its derivatives.
fn parabola(t: f64) -> Taylor {
    Taylor::cubic([1.0 + 2.0 * t - 3.0 * t * t, 2.0 - 6.0 * t, -6.0, 0.0])
}

fn signal(offered: usize, degree: usize, f: fn(f64) -> Taylor, h: f64) -> Signal {
    let mut signal = Signal::new(offered, degree);
    let seen = |t| {
        let mut point = f(t);
        point.0[offered + 1..].fill(f64::NAN); // what is not provided must not be used
        point
    };
    // unequal steps: 0.7 h, 1.5 h, 0.8 h
    signal.restart(seen(-3.0 * h));
    for (k, length) in [(-2.3, 0.7), (-0.8, 1.5), (0.0, 0.8)] {
        signal.advance(seen(k * h), length * h);
    }
    signal
}

// Sums of at most four terms of size 24 over h^3 = 1e-3: rounding below 4·24·eps/1e-3 = 2e-11.
const ROUNDING: f64 = 1e-10;

#[test]
fn analytic_extrapolation_of_degree_n_is_exact_for_polynomials_of_degree_n() {
    let h = 0.1;
    for offered in 0..=3 {
        for (degree, f) in [(2, parabola as fn(f64) -> Taylor), (3, parabola), (3, cubic)] {
            let mut signal = signal(offered, degree, f, h);
            signal.extrapolate(h);
            let error = signal.polynomial(3, h).value(h) - f(h)[0];
            assert!(error.abs() < ROUNDING, "{offered} {degree} {error:e}");
        }
    }
}

#[test]
fn analytic_interpolation_is_exact_for_its_polynomials() {
    let h = 0.1;
    for (offered, degree, f) in
        [(0, 2, parabola as fn(f64) -> Taylor), (0, 3, cubic), (1, 0, cubic), (2, 2, cubic)]
    {
        let mut signal = signal(offered, degree, f, h);
        let mut end = f(h);
        end.0[offered + 1..].fill(f64::NAN);
        signal.advance(end, h);
        signal.interpolate(h);
        for tau in [0.0, 0.03, 0.1] {
            let error = signal.polynomial(3, h).value(tau) - f(tau)[0];
            assert!(error.abs() < ROUNDING, "{offered} {degree} {error:e}");
        }
    }
}

#[test]
fn invariant_reduced_interpolations_agree_at_both_ends() {
    let h = 0.1;
    let mut signal = signal(1, 2, cubic, h);
    signal.advance(cubic(h), h);
    signal.interpolate(h);
    for limit in 1..=3 {
        let p = signal.polynomial(limit, h);
        assert!(p.0[limit + 1..].iter().all(|x| *x == 0.0));
        assert!((p.value(0.0) - cubic(0.0)[0]).abs() < ROUNDING);
        assert!((p.value(h) - cubic(h)[0]).abs() < ROUNDING);
    }
    assert_eq!(signal.polynomial(0, h)[0], cubic(h)[0]);
}

#[test]
fn invariant_degree_grows_with_history() {
    let h = 0.1;
    let mut signal = Signal::new(0, 3);
    signal.restart(Taylor::cubic([1.0, f64::NAN, f64::NAN, f64::NAN]));
    signal.extrapolate(h);
    assert_eq!(signal.polynomial(3, h), Taylor::constant(1.0));
    signal.advance(Taylor::cubic([2.0, f64::NAN, f64::NAN, f64::NAN]), h);
    signal.extrapolate(h);
    assert_eq!(signal.polynomial(3, h), Taylor::cubic([2.0, 10.0, 0.0, 0.0]));
    assert_eq!(signal.predicted(), [3.0, 10.0, 0.0]);
}

/// Held over the step from its beginning on, whether the source has stepped or not.
#[test]
fn analytic_held_signals_are_those_of_the_beginning() {
    let mut signal = Signal::held();
    signal.restart(Taylor([1.0; 6]));
    for (n, value) in [1.0, 12.0, 12.0].into_iter().enumerate() {
        signal.extrapolate(0.1);
        let begin = [1.0, 1.0, 12.0][n];
        assert_eq!(signal.polynomial(3, 0.1), Taylor::constant(begin));
        let felt = if n == 2 { Effect::Jump } else { Effect::None };
        assert_eq!(signal.effect_on_targets(), felt, "before the source");
        signal.advance(Taylor::cubic([value, f64::NAN, f64::NAN, f64::NAN]), 0.1);
        signal.interpolate(0.1);
        assert_eq!(signal.polynomial(3, 0.1), Taylor::constant(begin));
        assert_eq!(signal.effect_on_targets(), felt, "after the source");
    }
}

/// A cubic that jumps by 5 at the beginning of a step: within the step only data from after the
/// jump are used, and the history restarts.
#[test]
fn analytic_no_polynomial_crosses_a_jump() {
    let h = 0.1;
    for offered in 0..=3 {
        let mut signal = signal(offered, 2, cubic, h);
        let jumped = |t: f64| {
            let mut point = cubic(t);
            point[0] += 5.0;
            point.0[offered + 1..].fill(f64::NAN);
            point
        };
        signal.extrapolate(h);
        signal.set_effect(Effect::Jump);
        signal.advance(jumped(h), h);
        signal.interpolate(h);
        let p = signal.polynomial(3, h);
        let end = p.value(h) - jumped(h)[0];
        assert!(end.abs() < ROUNDING, "{offered}: {end:e}");
        // what is left of the Taylor series about the end, over the whole step
        let rest = [0.5, 0.03, 0.005, 0.0][offered];
        let begin = (p.value(0.0) - cubic(0.0)[0] - 5.0).abs();
        assert!(begin <= rest + ROUNDING, "{offered}: {begin:e}");
        signal.extrapolate(h);
        assert_eq!(
            signal.effect_on_targets(),
            Effect::Jump,
            "for units that step before the source"
        );
        let now = jumped(h);
        let known = now.up_to(offered.min(2));
        assert_eq!(signal.polynomial(3, h), known, "nothing from before the jump");
        signal.advance(jumped(2.0 * h), h);
        signal.extrapolate(h);
        assert_eq!(signal.effect_on_targets(), Effect::None);
    }
}

/// A slope that jumps leaves the value at the beginning in place.
#[test]
fn analytic_a_kink_keeps_the_value_at_the_beginning() {
    let h = 0.1;
    for offered in 0..=2 {
        let mut signal = signal(offered, 2, |_| Taylor::constant(1.0), h);
        signal.extrapolate(h);
        signal.set_effect(Effect::Kink);
        // 1 + 3 t + 4 t² from t = 0 on
        let mut end = Taylor::cubic([1.0 + 3.0 * h + 4.0 * h * h, 3.0 + 8.0 * h, 8.0, 0.0]);
        end.0[offered + 1..].fill(f64::NAN);
        signal.advance(end, h);
        signal.interpolate(h);
        for tau in [0.0, 0.04, h] {
            let truth = 1.0 + tau * (3.0 + 4.0 * tau);
            let line = 4.0 * tau * (h - tau);
            let error = (signal.polynomial(3, h).value(tau) - truth).abs();
            let allowed = if offered == 0 { line } else { 0.0 };
            assert!(error <= allowed + ROUNDING, "{offered} {tau}: {error:e}");
        }
    }
}
