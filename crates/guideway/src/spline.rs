//! Natural cubic spline through given points: twice continuously differentiable.

use crate::Error;

/// Cubic spline s(x) through (xᵢ, yᵢ) with s″ = 0 at both ends.
///
/// "Natural" ends suit mode shapes of simply supported spans, which carry no moment there. On
/// smooth data the error falls with the fourth power of the spacing inside the range.
/// Source: de Boor, *A Practical Guide to Splines*, chapter IV.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Second derivatives at the points.
    m: Vec<f64>,
}

impl Spline {
    /// Spline through the points; `path` names them in errors.
    ///
    /// # Errors
    /// Fewer than two points, lists of different lengths, non-finite numbers, x not increasing.
    pub fn new(x: &[f64], y: &[f64], path: &str) -> Result<Self, Error> {
        if x.len() != y.len() || x.len() < 2 {
            return Err(Error::invalid(
                path,
                format!("{} abscissae and {} ordinates", x.len(), y.len()),
                "give two lists of the same length, at least 2",
            ));
        }
        if x.iter().chain(y).any(|v| !v.is_finite()) {
            return Err(Error::invalid(path, "a value is not finite", "give finite numbers"));
        }
        if let Some(i) = (1..x.len()).find(|&i| x[i] <= x[i - 1]) {
            return Err(Error::invalid(
                path,
                format!("x[{i}] = {} does not exceed x[{}] = {}", x[i], i - 1, x[i - 1]),
                "sort the points by x and remove duplicates",
            ));
        }
        Ok(Self { x: x.to_vec(), y: y.to_vec(), m: second_derivatives(x, y) })
    }

    /// Abscissae and ordinates.
    pub(crate) fn points(&self) -> (&[f64], &[f64]) {
        (&self.x, &self.y)
    }

    /// First and last abscissa.
    pub fn range(&self) -> (f64, f64) {
        (self.x[0], self.x[self.x.len() - 1])
    }

    /// Smallest distance between neighbouring points.
    pub fn finest_spacing(&self) -> f64 {
        self.x.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min)
    }

    /// `[s, s′, s″]` at `x`; beyond the ends the straight line that continues the spline.
    pub fn at(&self, x: f64) -> [f64; 3] {
        let last = self.x.len() - 1;
        let i = self.x.partition_point(|&k| k <= x).clamp(1, last) - 1;
        let h = self.x[i + 1] - self.x[i];
        let (a, b) = ((self.x[i + 1] - x) / h, (x - self.x[i]) / h);
        if !(0.0..=1.0).contains(&b) {
            let end = if b < 0.0 { self.x[0] } else { self.x[last] };
            let [s, slope, _] = self.at(end);
            return [s + slope * (x - end), slope, 0.0];
        }
        let (y0, y1, m0, m1) = (self.y[i], self.y[i + 1], self.m[i], self.m[i + 1]);
        let h6 = h / 6.0;
        [
            a * y0 + b * y1 + h * h6 * ((a * a * a - a) * m0 + (b * b * b - b) * m1),
            (y1 - y0) / h + h6 * ((1.0 - 3.0 * a * a) * m0 + (3.0 * b * b - 1.0) * m1),
            a * m0 + b * m1,
        ]
    }
}

/// Solves the tridiagonal system for the second derivatives (Thomas algorithm; the matrix is
/// diagonally dominant, so no pivoting is needed).
fn second_derivatives(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let mut m = vec![0.0; n];
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let (h0, h1) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        let rhs = 6.0 * ((y[i + 1] - y[i]) / h1 - (y[i] - y[i - 1]) / h0);
        let pivot = 2.0 * (h0 + h1) - h0 * upper[i - 1];
        upper[i] = h1 / pivot;
        m[i] = (rhs - h0 * m[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        m[i] -= upper[i] * m[i + 1];
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_spline_error_falls_with_the_fourth_power() {
        let error = |n: usize| {
            let x: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
            let y: Vec<f64> = x.iter().map(|x| (std::f64::consts::PI * x).sin()).collect();
            let s = Spline::new(&x, &y, "test").unwrap();
            (0..1000)
                .map(|i| (f64::from(i) + 0.5) / 1000.0)
                .map(|x| (s.at(x)[0] - (std::f64::consts::PI * x).sin()).abs())
                .fold(0.0, f64::max)
        };
        // sin has sin″ = 0 at both ends, so the natural end costs no order: ratio 2⁴ = 16.
        let ratio = error(16) / error(32);
        assert!((15.0..17.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn analytic_spline_is_smooth_and_passes_through_its_points() {
        let (x, y) = ([0.0, 1.0, 1.5, 4.0], [1.0, -1.0, 0.5, 2.0]);
        let s = Spline::new(&x, &y, "test").unwrap();
        for i in 0..4 {
            assert!((s.at(x[i])[0] - y[i]).abs() < 1e-15);
            // Across a point 1e-9 to either side the first two derivatives change by no more
            // than 2e-9 times the next derivative (< 100 here).
            let (l, r) = (s.at(x[i] - 1e-9), s.at(x[i] + 1e-9));
            assert!((l[1] - r[1]).abs() < 1e-6 && (l[2] - r[2]).abs() < 1e-6);
        }
    }

    #[test]
    fn invariant_bad_points_are_refused_by_name() {
        let message = Spline::new(&[0.0, 0.0], &[1.0, 2.0], "shapes[0]").unwrap_err().to_string();
        assert!(message.contains("shapes[0]") && message.contains("x[1] = 0"), "{message}");
    }
}
