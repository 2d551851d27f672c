//! One Real output that feeds inputs: its history, and the polynomial that stands for it during a
//! step.
//!
//! With τ = t − tₙ, a polynomial is kept as its Taylor coefficients at the step's beginning,
//! `[p, p', p'', p''']`, so p(τ) = p + p' τ + p''/2 τ² + p'''/6 τ³.
//!
//! **Extrapolation** of degree N from data up to tₙ. The source offers derivatives up to order d
//! at every communication point (d = 0: values only). With e = min(d, N), p takes y, y' … y⁽ᵉ⁾
//! from the source. The derivatives above e come from z = y⁽ᵉ⁾'s history z₀ (at tₙ), z₁ (at tₙ₋₁)
//! …: the derivatives at tₙ of the polynomial of degree m = min(N − e, points known) through z₀ … z_m,
//!
//! | m | z' | z'' | z''' |
//! |---|---|---|---|
//! | 1 | (z₀ − z₁)/h | | |
//! | 2 | (3z₀ − 4z₁ + z₂)/2h | (z₀ − 2z₁ + z₂)/h² | |
//! | 3 | (11z₀ − 18z₁ + 9z₂ − 2z₃)/6h | (2z₀ − 5z₁ + 4z₂ − z₃)/h² | (z₀ − 3z₁ + 3z₂ − z₃)/h³ |
//!
//! So the highest derivative on offer is extrapolated and integrated, and the degree grows with
//! the history after the start. The error of p over the step is O(h^(N+1)). A start with motion
//! lacks history: its first steps are of lower degree, which limits the order of a whole run to
//! d + 2.
//!
//! **Interpolation** when the source has already stepped to tₙ₊₁ (value y₁; y₀ at tₙ). With
//! derivatives on offer, the cubic Hermite polynomial, error O(h⁴):
//!
//! p'' = (6(y₁ − y₀)/h − 4y₀' − 2y₁')/h,  p''' = (6(y₀' + y₁') − 12(y₁ − y₀)/h)/h².
//!
//! From values alone, the polynomial of degree m = max(N, 1), or as much as history allows, through
//! y₁, y₀, y₋₁, y₋₂, error O(h^(m+1)):
//!
//! | m | p' | p'' | p''' |
//! |---|---|---|---|
//! | 1 | (y₁ − y₀)/h | | |
//! | 2 | (y₁ − y₋₁)/2h | (y₁ − 2y₀ + y₋₁)/h² | |
//! | 3 | (2y₁ + 3y₀ − 6y₋₁ + y₋₂)/6h | (y₁ − 2y₀ + y₋₁)/h² | (y₁ − 3y₀ + 3y₋₁ − y₋₂)/h³ |
//!
//! The formulas are those of Newton's divided differences on equal steps; the step is therefore
//! constant between two [`Signal::restart`]s.

use serde::{Deserialize, Serialize};

/// A function over the step by its value and first three derivatives at the step's beginning.
pub type Taylor = [f64; 4];

/// One Real output with what is needed to represent it over a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// d: highest derivative that the source offers, 0 to 3.
    offered: usize,
    /// N: degree of the extrapolation, 0 to 3.
    degree: usize,
    /// y and its derivatives on offer at the source's latest point, then at those before.
    points: [Taylor; 4],
    /// Number of points before the latest.
    known: usize,
    /// Whether the source has stepped ahead and the polynomial interpolates.
    ahead: bool,
    polynomial: Taylor,
}

impl Signal {
    /// A signal whose source offers derivatives up to `offered`, extrapolated with `degree`.
    #[must_use]
    pub fn new(offered: usize, degree: usize) -> Self {
        Self { offered: offered.min(3), degree: degree.min(3), ..Self::default() }
    }

    /// Highest derivative that the source offers.
    #[must_use]
    pub fn offered(&self) -> usize {
        self.offered
    }

    /// Whether the other signal is represented in the same way, by data of the same kind.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        (self.offered, self.degree) == (other.offered, other.degree) && other.known <= 3
    }

    /// Forgets the history: at the start, after an event, or when the step changes.
    pub fn restart(&mut self, now: Taylor) {
        self.points = [now; 4];
        self.known = 0;
        self.ahead = false;
    }

    /// Takes the point at the end of a step that the source has made.
    #[inline]
    pub fn advance(&mut self, now: Taylor) {
        self.points = [now, self.points[0], self.points[1], self.points[2]];
        self.known = (self.known + 1).min(3);
    }

    /// The source's latest point.
    #[inline]
    #[must_use]
    pub fn now(&self) -> &Taylor {
        &self.points[0]
    }

    /// The polynomial of the current step, reduced to what the target can take: derivatives up to
    /// `limit` (0: a value held over the step, the newest that is known).
    #[inline]
    #[must_use]
    pub fn polynomial(&self, limit: usize, h: f64) -> Taylor {
        let p = self.polynomial;
        match (limit, self.ahead) {
            (3.., _) => p,
            (0, true) => [self.points[0][0], 0.0, 0.0, 0.0],
            (_, true) => self.lower_interpolation(limit, h),
            (_, false) => std::array::from_fn(|k| if k <= limit { p[k] } else { 0.0 }),
        }
    }

    /// Sets the polynomial from data up to the step's beginning.
    #[inline]
    pub fn extrapolate(&mut self, h: f64) {
        self.ahead = false;
        let e = self.offered.min(self.degree);
        let mut p = [0.0; 4];
        p[..=e].copy_from_slice(&self.points[0][..=e]);
        let z = |k: usize| self.points[k][e];
        match (self.degree - e).min(self.known) {
            0 => {}
            1 => p[e + 1] = (z(0) - z(1)) / h,
            2 => {
                p[e + 1] = (3.0 * z(0) - 4.0 * z(1) + z(2)) / (2.0 * h);
                p[e + 2] = (z(0) - 2.0 * z(1) + z(2)) / (h * h);
            }
            _ => {
                // degree 3 above e = 0
                p[1] = (11.0 * z(0) - 18.0 * z(1) + 9.0 * z(2) - 2.0 * z(3)) / (6.0 * h);
                p[2] = (2.0 * z(0) - 5.0 * z(1) + 4.0 * z(2) - z(3)) / (h * h);
                p[3] = (z(0) - 3.0 * z(1) + 3.0 * z(2) - z(3)) / (h * h * h);
            }
        }
        self.polynomial = p;
    }

    /// Sets the polynomial between the step's beginning and its end, to which the source has
    /// [advanced](Signal::advance).
    #[inline]
    pub fn interpolate(&mut self, h: f64) {
        self.ahead = true;
        let [end, begin, before, earlier] = self.points;
        let slope = (end[0] - begin[0]) / h;
        self.polynomial = if self.offered >= 1 {
            [
                begin[0],
                begin[1],
                (6.0 * slope - 4.0 * begin[1] - 2.0 * end[1]) / h,
                (6.0 * (begin[1] + end[1]) - 12.0 * slope) / (h * h),
            ]
        } else {
            let (y1, y0, ym, ymm) = (end[0], begin[0], before[0], earlier[0]);
            let bend = (y1 - 2.0 * y0 + ym) / (h * h);
            match self.degree.max(1).min(self.known) {
                0 | 1 => [y0, slope, 0.0, 0.0],
                2 => [y0, (y1 - ym) / (2.0 * h), bend, 0.0],
                _ => [
                    y0,
                    (2.0 * y1 + 3.0 * y0 - 6.0 * ym + ymm) / (6.0 * h),
                    bend,
                    (y1 - 3.0 * y0 + 3.0 * ym - ymm) / (h * h * h),
                ],
            }
        };
    }

    /// An interpolation of degree 1 or 2 through both ends, for targets that take no more.
    fn lower_interpolation(&self, limit: usize, h: f64) -> Taylor {
        let p = self.polynomial;
        let (y0, y1) = (p[0], self.points[0][0]);
        if limit == 1 {
            [y0, (y1 - y0) / h, 0.0, 0.0]
        } else {
            [y0, p[1], 2.0 * (y1 - y0 - h * p[1]) / (h * h), 0.0]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(p: &Taylor, tau: f64) -> f64 {
        p[0] + tau * (p[1] + tau * (p[2] / 2.0 + tau * p[3] / 6.0))
    }

    /// A cubic and its derivatives.
    fn cubic(t: f64) -> Taylor {
        [1.0 + t * (2.0 - t * (3.0 - 4.0 * t)), 2.0 - 6.0 * t + 12.0 * t * t, -6.0 + 24.0 * t, 24.0]
    }

    /// A parabola and its derivatives.
    fn parabola(t: f64) -> Taylor {
        [1.0 + 2.0 * t - 3.0 * t * t, 2.0 - 6.0 * t, -6.0, 0.0]
    }

    fn signal(offered: usize, degree: usize, f: fn(f64) -> Taylor, h: f64) -> Signal {
        let mut signal = Signal::new(offered, degree);
        let seen = |t| {
            let mut point = f(t);
            point[offered + 1..].fill(f64::NAN); // what is not on offer must not be used
            point
        };
        signal.restart(seen(-3.0 * h));
        for k in [-2.0, -1.0, 0.0] {
            signal.advance(seen(k * h));
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
                let error = value(&signal.polynomial(3, h), h) - f(h)[0];
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
            end[offered + 1..].fill(f64::NAN);
            signal.advance(end);
            signal.interpolate(h);
            for tau in [0.0, 0.03, 0.1] {
                let error = value(&signal.polynomial(3, h), tau) - f(tau)[0];
                assert!(error.abs() < ROUNDING, "{offered} {degree} {error:e}");
            }
        }
    }

    #[test]
    fn invariant_reduced_interpolations_meet_both_ends() {
        let h = 0.1;
        let mut signal = signal(1, 2, cubic, h);
        signal.advance(cubic(h));
        signal.interpolate(h);
        for limit in 1..=3 {
            let p = signal.polynomial(limit, h);
            assert!(p[limit + 1..].iter().all(|x| *x == 0.0));
            assert!((value(&p, 0.0) - cubic(0.0)[0]).abs() < ROUNDING);
            assert!((value(&p, h) - cubic(h)[0]).abs() < ROUNDING);
        }
        assert_eq!(signal.polynomial(0, h)[0], cubic(h)[0]);
    }

    #[test]
    fn invariant_degree_grows_with_history() {
        let h = 0.1;
        let mut signal = Signal::new(0, 3);
        signal.restart([1.0, f64::NAN, f64::NAN, f64::NAN]);
        signal.extrapolate(h);
        assert_eq!(signal.polynomial(3, h), [1.0, 0.0, 0.0, 0.0]);
        signal.advance([2.0, f64::NAN, f64::NAN, f64::NAN]);
        signal.extrapolate(h);
        assert_eq!(signal.polynomial(3, h), [2.0, 10.0, 0.0, 0.0]);
    }
}
