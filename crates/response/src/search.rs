//! Roots and minima of functions of one variable, within brackets.

/// Largest number of evaluations.
const MOST: usize = 100;
/// (3 − √5)/2.
const GOLDEN: f64 = 0.381_966_011_250_105;

/// A root between `a` and `b`, where f has the values `fa` and `fb` of different signs, to within
/// `tolerance`: false position with the Illinois rule, and bisection where that is slow.
pub fn root(
    mut f: impl FnMut(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
    tolerance: f64,
) -> f64 {
    for k in 0..MOST {
        if fa == 0.0 || (b - a).abs() <= tolerance {
            return a;
        }
        if fb == 0.0 {
            return b;
        }
        let secant = (a * fb - b * fa) / (fb - fa);
        let x = if k % 3 == 2 || !secant.is_finite() { 0.5 * (a + b) } else { secant };
        let fx = f(x);
        if fx == 0.0 {
            return x;
        }
        if (fx > 0.0) == (fb > 0.0) {
            (b, fb) = (x, fx);
            fa *= 0.5;
        } else {
            // b is always the latest point
            (a, fa, b, fb) = (b, fb, x, fx);
        }
        if (b - a).abs() <= tolerance || fx.abs() < 1e-14 {
            return x;
        }
    }
    b
}

/// A minimum between `a` and `b`, and its value, to within `tolerance`: parabolas and golden section
/// (Brent 1973, "Algorithms for minimization without derivatives").
pub fn minimum(
    mut f: impl FnMut(f64) -> f64,
    (mut a, mut b): (f64, f64),
    (start, value): (f64, f64),
    tolerance: f64,
) -> (f64, f64) {
    let (mut x, mut w, mut v) = (start, start, start);
    let (mut fx, mut fw, mut fv) = (value, value, value);
    let (mut step, mut before) = (0.0_f64, 0.0_f64);
    for _ in 0..MOST {
        let middle = 0.5 * (a + b);
        if (x - middle).abs() <= 2.0 * tolerance - 0.5 * (b - a) {
            break;
        }
        // the parabola through the three best points
        let (r, q) = ((x - w) * (fx - fv), (x - v) * (fx - fw));
        let p = (x - v) * q - (x - w) * r;
        let q = 2.0 * (q - r);
        let p = if q > 0.0 { -p } else { p };
        let q = q.abs();
        let last = before;
        before = step;
        let inside = p > q * (a - x) && p < q * (b - x);
        if q > 0.0 && inside && p.abs() < (0.5 * q * last).abs() {
            step = p / q;
            let u = x + step;
            if u - a < 2.0 * tolerance || b - u < 2.0 * tolerance {
                step = tolerance.copysign(middle - x);
            }
        } else {
            before = if x < middle { b - x } else { a - x };
            step = GOLDEN * before;
        }
        let u = x + if step.abs() >= tolerance { step } else { tolerance.copysign(step) };
        let fu = f(u);
        if fu <= fx {
            if u < x {
                b = x
            } else {
                a = x
            }
            (v, fv, w, fw, x, fx) = (w, fw, x, fx, u, fu);
        } else {
            if u < x {
                a = u
            } else {
                b = u
            }
            if fu <= fw || w == x {
                (v, fv, w, fw) = (w, fw, u, fu);
            } else if fu <= fv || v == x || v == w {
                (v, fv) = (u, fu);
            }
        }
    }
    (x, fx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_roots_and_minima() {
        let f = |x: f64| x.powi(3) - 2.0;
        let x = root(f, (0.0, f(0.0)), (4.0, f(4.0)), 1e-14);
        assert!((x - 2.0_f64.cbrt()).abs() < 1e-12, "{x}");
        let steep = |x: f64| (50.0 * (x - 0.3)).tanh();
        let x = root(steep, (-5.0, steep(-5.0)), (9.0, steep(9.0)), 1e-13);
        assert!((x - 0.3).abs() < 1e-11, "{x}");
        let g = |x: f64| (x - 0.7).powi(2) + 3.0 + (x - 0.7).powi(4);
        let (x, y) = minimum(g, (-2.0, 2.0), (0.1, g(0.1)), 1e-8);
        assert!((x - 0.7).abs() < 1e-6 && (y - 3.0).abs() < 1e-12, "{x} {y}");
        // at the end of its bracket
        let (x, y) = minimum(|x| x, (1.0, 2.0), (1.5, 1.5), 1e-8);
        assert!((x - 1.0).abs() < 1e-6 && (y - 1.0).abs() < 1e-6);
    }
}
