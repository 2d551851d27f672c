//! Mode shapes that are cubic polynomials between common knots.

use crate::Spline;
use crate::pole::gauss_legendre;
use crate::shapes::ShapeRow;

/// Functions on 0 ≤ x ≤ L, each a cubic polynomial between each knot and the next.
///
/// Values may be other than 0 at the ends, and slopes may jump at knots (hinges, points of a beam that
/// is soft in shear).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PiecewiseCubics {
    knots: Vec<f64>,
    /// Interval by interval, function by function: coefficients in powers of the distance from the
    /// interval's first knot.
    coefficients: Vec<[f64; 4]>,
    functions: usize,
}

impl PiecewiseCubics {
    /// From at least two increasing knots and, interval by interval, the functions' coefficients.
    pub fn new(knots: Vec<f64>, coefficients: Vec<[f64; 4]>, functions: usize) -> Self {
        Self { knots, coefficients, functions }
    }

    /// The splines, on all their knots together, for 0 ≤ x ≤ `length`.
    pub fn of_splines(splines: &[Spline], length: f64) -> Self {
        let mut knots: Vec<f64> = splines.iter().flat_map(|s| s.points().0).copied().collect();
        knots.retain(|x| (1e-9 * length..(1.0 - 1e-9) * length).contains(x));
        knots.extend([0.0, length]);
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        let mut coefficients = Vec::new();
        for ends in knots.windows(2) {
            for spline in splines {
                // the second derivative is linear between the knots
                let (a, b) = (spline.at(ends[0]), spline.at(ends[1]));
                let third = (b[2] - a[2]) / (ends[1] - ends[0]);
                coefficients.push([a[0], a[1], 0.5 * a[2], third / 6.0]);
            }
        }
        Self::new(knots, coefficients, splines.len())
    }

    fn interval(&self, x: f64) -> usize {
        self.knots.partition_point(|&k| k <= x).clamp(1, self.knots.len() - 1) - 1
    }

    /// Coefficients of the functions in an interval.
    fn of_interval(&self, i: usize) -> &[[f64; 4]] {
        &self.coefficients[i * self.functions..(i + 1) * self.functions]
    }

    /// Value, slope and curvature of all functions at x, with those ends included.
    pub fn at(&self, x: f64, row: &mut ShapeRow) {
        let i = self.interval(x);
        let s = x - self.knots[i];
        for (n, c) in self.of_interval(i).iter().enumerate() {
            row.value[n] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
            row.slope[n] = c[1] + s * (2.0 * c[2] + 3.0 * s * c[3]);
            row.curvature[n] = 2.0 * c[2] + 6.0 * s * c[3];
        }
    }

    /// Mean over a length of which the part from x = a to b may reach beyond the ends, where the
    /// functions are 0: ∫φ dx/(b − a) and its derivatives with respect to the place of the whole
    /// length. So a step of φ at an end is a ramp of the mean, and its slope includes it.
    pub fn mean(&self, a: f64, b: f64, row: &mut ShapeRow) {
        let per_length = 1.0 / (b - a);
        let last = self.knots[self.knots.len() - 1];
        let (from, to) = (a.max(0.0), b.min(last));
        let (i, j) = (self.interval(from), self.interval(to));
        for n in 0..self.functions {
            let mut integral = 0.0;
            for k in i..=j {
                let c = &self.of_interval(k)[n];
                let (s, e) = (from.max(self.knots[k]), to.min(self.knots[k + 1]));
                let (s, e) = (s - self.knots[k], e - self.knots[k]);
                integral += primitive(c, e) - primitive(c, s);
            }
            let (mut slope, mut curvature) = (0.0, 0.0);
            for (k, x, inside, sign) in [(j, to, b <= last, 1.0), (i, from, a >= 0.0, -1.0)] {
                if !inside {
                    continue;
                }
                let (c, s) = (&self.of_interval(k)[n], x - self.knots[k]);
                slope += sign * (c[0] + s * (c[1] + s * (c[2] + s * c[3])));
                curvature += sign * (c[1] + s * (2.0 * c[2] + 3.0 * s * c[3]));
            }
            row.value[n] = integral * per_length;
            row.slope[n] = slope * per_length;
            row.curvature[n] = curvature * per_length;
        }
    }

    /// ∫φₙ² dx of all functions: Gauss points that are exact for these polynomials.
    pub fn squares(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.functions];
        for (i, ends) in self.knots.windows(2).enumerate() {
            let h = ends[1] - ends[0];
            for (point, weight) in gauss_legendre(4) {
                let s = 0.5 * h * (1.0 + point);
                for (sum, c) in sums.iter_mut().zip(self.of_interval(i)) {
                    let value = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
                    *sum += 0.5 * h * weight * value * value;
                }
            }
        }
        sums
    }
}

/// ∫ of the cubic from 0 to s.
fn primitive(c: &[f64; 4], s: f64) -> f64 {
    s * (c[0] + s * (c[1] / 2.0 + s * (c[2] / 3.0 + s * c[3] / 4.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 + x on 0 … 2, then 3 − (x − 2)³ to 5.
    fn cubics() -> PiecewiseCubics {
        let coefficients = vec![[1.0, 1.0, 0.0, 0.0], [3.0, 0.0, 0.0, -1.0]];
        PiecewiseCubics::new(vec![0.0, 2.0, 5.0], coefficients, 1)
    }

    fn mean(a: f64, b: f64) -> [f64; 3] {
        let mut row = ShapeRow::with_modes(1);
        cubics().mean(a, b, &mut row);
        [row.value[0], row.slope[0], row.curvature[0]]
    }

    #[test]
    fn analytic_means_are_integrals_across_knots_and_ends() {
        // ∫₁² 1 + x = 5/2, ∫₂³ 3 − (x−2)³ = 11/4
        assert!((mean(1.0, 3.0)[0] - 21.0 / 8.0).abs() < 1e-15);
        // half a metre over the start: ∫₀^0.5 1 + x = 0.625
        assert!((mean(-0.5, 0.5)[0] - 0.625).abs() < 1e-15);
        // beyond the end: φ(4) = −5, ∫₄⁵ = 3 − (81 − 16)/4
        assert!((mean(4.0, 6.0)[0] - (3.0 - 65.0 / 4.0) / 2.0).abs() < 1e-14);
        // ∫(1+x)² = 26/3; ∫₀³(3 − s³)² = 27 − 6·81/4 + 3⁷/7
        let exact = 26.0 / 3.0 + 27.0 - 121.5 + 2187.0 / 7.0;
        assert!((cubics().squares()[0] / exact - 1.0).abs() < 1e-14);
    }

    #[test]
    fn order_slope_and_curvature_are_derivatives_of_the_mean() {
        for centre in [-0.2, 0.1, 1.0, 1.9, 3.0, 4.8, 5.2] {
            let (l, e) = (0.8, 1e-5);
            let at = |x: f64| mean(x - 0.5 * l, x + 0.5 * l);
            let (before, here, after) = (at(centre - e), at(centre), at(centre + e));
            for order in 0..2 {
                let difference = (after[order] - before[order]) / (2.0 * e);
                // polynomials of order 4 with derivatives below 100: e²·100/6 plus rounding 1e-15/e
                assert!((difference - here[order + 1]).abs() < 1e-8, "{centre} {order}");
            }
        }
    }

    #[test]
    fn invariant_splines_keep_their_values() {
        let x: Vec<f64> = (0..=10).map(|i| 0.5 * f64::from(i)).collect();
        let coarse = [0.0, 2.2, 5.0];
        let splines = [
            Spline::new(&x, &x.iter().map(|x| x.cos()).collect::<Vec<_>>(), "a").unwrap(),
            Spline::new(&coarse, &[1.0, -1.0, 0.3], "b").unwrap(),
        ];
        let cubics = PiecewiseCubics::of_splines(&splines, 5.0);
        let mut row = ShapeRow::with_modes(2);
        for k in 0..=50 {
            let x = 0.1 * f64::from(k);
            cubics.at(x, &mut row);
            for (n, spline) in splines.iter().enumerate() {
                let s = spline.at(x);
                let found = [row.value[n], row.slope[n], row.curvature[n]];
                for (a, b) in s.iter().zip(found) {
                    assert!((a - b).abs() < 1e-13, "{x} {n}: {a} {b}");
                }
            }
        }
    }
}
