//! Shifted and reduced polynomials.

use coupling::Taylor;

/// The shifted polynomial takes the same values: all terms are exact in these numbers.
#[test]
fn analytic_a_shifted_polynomial_is_the_same_function() {
    let p = Taylor::cubic([1.0, -2.0, 3.0, 6.0]);
    let at = |p: &Taylor, t: f64| p[0] + p[1] * t + p[2] * t * t / 2.0 + p[3] * t * t * t / 6.0;
    let q = p.shifted(0.5);
    for t in [0.0, 0.25, 0.5, 1.0, 2.0] {
        assert!((at(&q, t) - at(&p, t + 0.5)).abs() < 1e-14, "{t}");
    }
}

/// The table of errors, by integrals of cubics: 0.5 and the coefficients are exact, sums of four
/// terms below 2 round by less than 1e-15.
#[test]
fn analytic_errors_of_reduced_polynomials_are_those_documented() {
    let integral =
        |p: &Taylor, h: f64| h * (p[0] + h / 2.0 * (p[1] + h / 3.0 * (p[2] + h / 4.0 * p[3])));
    let (parabola, h) = (Taylor::cubic([1.0, -2.0, 3.0, 0.0]), 0.5);
    for (degree, error) in [(0, 3.0 / 24.0), (1, -3.0 / 12.0), (2, 0.0), (3, 0.0)] {
        let found = integral(&parabola, h) - integral(&parabola.reduced(degree, h), h);
        assert!((found - error * h * h * h).abs() < 1e-15, "{degree}: {found}");
    }
    let cubic = Taylor::cubic([1.0, -2.0, 3.0, 6.0]);
    for degree in [1, 2, 3] {
        let p = cubic.reduced(degree, h);
        assert!((p.value(h) - cubic.value(h)).abs() < 1e-15);
    }
}
