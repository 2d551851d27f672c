//! Transfer functions of controllers at a complex frequency.

use faer::prelude::c64;

use crate::elimination::solve;
use crate::system::{Controller, Controllers};

/// Transfer functions from each channel to the output, and their derivatives by s.
#[derive(Debug, Clone)]
pub struct Gains {
    /// Per channel, one value if all controllers are equal, else one per loop.
    pub value: Vec<Vec<c64>>,
    /// dk/ds, likewise; empty if not asked for.
    pub slope: Vec<Vec<c64>>,
}

impl Gains {
    /// k(s) = C (sI − A)⁻¹ B + D.
    #[must_use]
    pub fn at(controllers: &Controllers, s: c64, slopes: bool) -> Self {
        let count = match controllers {
            Controllers::Equal(..) => 1,
            Controllers::Each(all) => all.len(),
        };
        let channels = if controllers.is_empty() { 0 } else { controllers.get(0).d.len() };
        let empty = || vec![Vec::with_capacity(count); channels];
        let (mut value, mut slope) = (empty(), empty());
        let mut space = Vec::new();
        for k in 0..count {
            let controller = controllers.get(k);
            let left = row(controller, s, &mut space);
            for (i, value) in value.iter_mut().enumerate() {
                let b = |j: usize| controller.b[(j, i)];
                let sum: c64 = left.iter().enumerate().map(|(j, y)| *y * b(j)).sum();
                value.push(sum + controller.d[i]);
            }
            if slopes {
                let squared = solve_row(controller, s, &left, &mut space);
                for (i, slope) in slope.iter_mut().enumerate() {
                    let sum: c64 =
                        squared.iter().enumerate().map(|(j, y)| *y * controller.b[(j, i)]).sum();
                    slope.push(-sum);
                }
            }
        }
        Self { value, slope }
    }

    /// k of a channel and a loop.
    #[inline]
    #[must_use]
    pub fn of(&self, channel: usize, loop_: usize) -> c64 {
        let all = &self.value[channel];
        all[if all.len() == 1 { 0 } else { loop_ }]
    }

    /// dk/ds of a channel and a loop.
    #[inline]
    #[must_use]
    pub fn slope_of(&self, channel: usize, loop_: usize) -> c64 {
        let all = &self.slope[channel];
        all[if all.len() == 1 { 0 } else { loop_ }]
    }
}

/// The transfer functions of equal controllers as polynomials over one denominator.
#[derive(Debug, Clone)]
pub(crate) struct Rational {
    /// From the highest power on.
    denominator: Vec<f64>,
    numerators: Vec<Vec<f64>>,
}

/// Largest relative error of the polynomials.
const EXACT: f64 = 1e-6;

impl Rational {
    /// By the method of Leverrier and Faddeev: (sI − A)⁻¹ = Σ Mₖ sⁿ⁻ᵏ / det(sI − A). None where rounding spoils it.
    pub fn new(controllers: &Controllers) -> Option<Self> {
        let Controllers::Equal(one, _) = controllers else { return None };
        let (n, channels) = (one.a.nrows(), one.d.len());
        let mut denominator = vec![1.0];
        let mut numerators: Vec<Vec<f64>> = one.d.iter().map(|d| vec![*d]).collect();
        let mut m = faer::Mat::<f64>::identity(n, n);
        for k in 1..=n {
            let by_m: Vec<f64> =
                (0..n).map(|j| (0..n).map(|i| one.c[i] * m[(i, j)]).sum()).collect();
            let am = &one.a * &m;
            let next = -(0..n).map(|i| am[(i, i)]).sum::<f64>() / k as f64;
            for (i, numerator) in numerators.iter_mut().enumerate() {
                let value: f64 = (0..n).map(|j| by_m[j] * one.b[(j, i)]).sum();
                numerator.push(value + one.d[i] * next);
            }
            denominator.push(next);
            m = am;
            (0..n).for_each(|i| m[(i, i)] += next);
        }
        let rational = Self { denominator, numerators };
        let mut near = Vec::new();
        let fits = [0.3, 8.0, 60.0, 900.0].iter().all(|&omega| {
            let s = c64::new(-0.05 * omega, omega);
            let exact = Gains::at(controllers, s, false);
            near.clear();
            rational.at(s, &mut near);
            (0..channels).all(|i| {
                let value = exact.of(i, 0);
                (near[i] - value).norm() <= EXACT * value.norm()
            })
        });
        fits.then_some(rational)
    }

    /// Appends one value per channel; returns the denominator.
    pub fn at(&self, s: c64, values: &mut Vec<c64>) -> c64 {
        let polynomial = |list: &[f64]| {
            list.iter().fold(c64::new(0.0, 0.0), |sum, &coefficient| sum * s + coefficient)
        };
        let denominator = polynomial(&self.denominator);
        let inverse = denominator.inv();
        values.extend(self.numerators.iter().map(|list| polynomial(list) * inverse));
        denominator
    }
}

/// C (sI − A)⁻¹.
fn row(controller: &Controller, s: c64, space: &mut Vec<c64>) -> Vec<c64> {
    let c: Vec<c64> = controller.c.iter().map(|&x| c64::new(x, 0.0)).collect();
    solve_row(controller, s, &c, space)
}

/// The row y (sI − A)⁻¹.
fn solve_row(controller: &Controller, s: c64, y: &[c64], m: &mut Vec<c64>) -> Vec<c64> {
    let n = y.len();
    m.clear();
    // the transposed matrix by rows
    for i in 0..n {
        for j in 0..n {
            let a = c64::new(-controller.a[(j, i)], 0.0);
            m.push(if i == j { s + a } else { a });
        }
    }
    let mut x = y.to_vec();
    solve(m, &mut x);
    x
}
