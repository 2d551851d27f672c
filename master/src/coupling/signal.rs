//! One Real output that feeds inputs: its history, and the polynomial that stands for it during a
//! step.
//!
//! With τ = t − tₙ, a polynomial is kept as its Taylor coefficients at the step's beginning,
//! `[p, p', p'', p''']`, so p(τ) = p + p' τ + p''/2 τ² + p'''/6 τ³.
//!
//! The source offers derivatives up to order d at every communication point (d = 0: values only).
//! Points are at t₀ = tₙ, t₁ = t₀ − s₀, t₂ = t₁ − s₁ … with the lengths s of the last steps, which
//! need not be equal: all polynomials come from Newton's divided differences, f₀₁ = (z₀ − z₁)/s₀,
//! f₀₁₂ = (f₀₁ − f₁₂)/(s₀ + s₁) and so on.
//!
//! **Extrapolation** of degree N from data up to tₙ. With e = min(d, N), p takes y, y' … y⁽ᵉ⁾ from
//! the source. The derivatives above e come from the history of z = y⁽ᵉ⁾: the derivatives at tₙ of
//! the polynomial of degree m = min(N − e, points known) through z₀ … z_m,
//!
//! | m | z' | z'' | z''' |
//! |---|---|---|---|
//! | 1 | f₀₁ | | |
//! | 2 | f₀₁ + s₀ f₀₁₂ | 2 f₀₁₂ | |
//! | 3 | f₀₁ + s₀ f₀₁₂ + s₀(s₀+s₁) f₀₁₂₃ | 2 f₀₁₂ + 2(2s₀+s₁) f₀₁₂₃ | 6 f₀₁₂₃ |
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
//! y₁, y₀, y₋₁, y₋₂ at h, 0, −s, −s−s', error O(h^(m+1)); g₁₀ = (y₁ − y₀)/h and so on:
//!
//! | m | p' | p'' | p''' |
//! |---|---|---|---|
//! | 1 | g₁₀ | | |
//! | 2 | g₁₀ − h g₁₀₋ | 2 g₁₀₋ | |
//! | 3 | g₁₀ − h g₁₀₋ − h s g₁₀₋₋ | 2 g₁₀₋ + 2(s − h) g₁₀₋₋ | 6 g₁₀₋₋ |

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
    /// Lengths of the steps between the points, latest first.
    steps: [f64; 3],
    /// Number of points before the latest.
    known: usize,
    /// Whether the source has stepped ahead and the polynomial interpolates.
    ahead: bool,
    polynomial: Taylor,
    /// Value and first derivative at the step's end as they were extrapolated.
    predicted: [f64; 2],
    /// Value at the step's end that those have gone by who stepped before the source.
    supposed: f64,
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

    /// Forgets the history: at the start or after an event.
    pub fn restart(&mut self, now: Taylor) {
        self.points = [now; 4];
        self.steps = [0.0; 3];
        self.known = 0;
        self.ahead = false;
    }

    /// Takes the point at the end of a step of length `h` that the source has made.
    #[inline]
    pub fn advance(&mut self, now: Taylor, h: f64) {
        self.points = [now, self.points[0], self.points[1], self.points[2]];
        self.steps = [h, self.steps[0], self.steps[1]];
        self.known = (self.known + 1).min(3);
    }

    /// Replaces the latest point, when the source has made its step again.
    #[inline]
    pub fn revise(&mut self, now: Taylor) {
        self.points[0] = now;
    }

    /// Value and first derivative at the end of the step as the extrapolation has them.
    #[inline]
    #[must_use]
    pub fn predicted(&self) -> [f64; 2] {
        self.predicted
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
        let m = (self.degree - e).min(self.known);
        if m > 0 {
            let [s0, s1, s2] = self.steps;
            let z = |k: usize| self.points[k][e];
            let f01 = (z(0) - z(1)) / s0;
            if m == 1 {
                p[e + 1] = f01;
            } else {
                let f12 = (z(1) - z(2)) / s1;
                let f012 = (f01 - f12) / (s0 + s1);
                p[e + 1] = f01 + s0 * f012;
                p[e + 2] = 2.0 * f012;
                // degree 3 above e = 0
                if m == 3 {
                    let f123 = (f12 - (z(2) - z(3)) / s2) / (s1 + s2);
                    let f0123 = (f012 - f123) / (s0 + s1 + s2);
                    p[1] += s0 * (s0 + s1) * f0123;
                    p[2] += 2.0 * (2.0 * s0 + s1) * f0123;
                    p[3] = 6.0 * f0123;
                }
            }
        }
        self.predicted = [
            p[0] + h * (p[1] + h / 2.0 * (p[2] + h / 3.0 * p[3])),
            p[1] + h * (p[2] + h / 2.0 * p[3]),
        ];
        self.supposed = self.predicted[0];
        self.polynomial = p;
    }

    /// Sets the polynomial from a guess of value and first derivative at the step's end, in the
    /// place of the source's own.
    #[inline]
    pub fn suppose(&mut self, end: [f64; 2], h: f64) {
        self.points[0][0] = end[0];
        if self.offered > 0 {
            self.points[0][1] = end[1];
        }
        self.interpolate(h);
        self.supposed = end[0];
    }

    /// The value at the step's end that those have gone by who stepped before the source.
    #[inline]
    #[must_use]
    pub fn supposed(&self) -> f64 {
        self.supposed
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
            let (y0, ym, ymm) = (begin[0], before[0], earlier[0]);
            let m = self.degree.max(1).min(self.known);
            if m <= 1 {
                [y0, slope, 0.0, 0.0]
            } else {
                let [_, s, r] = self.steps;
                let back = (y0 - ym) / s;
                let bend = (slope - back) / (h + s);
                let mut p = [y0, slope - h * bend, 2.0 * bend, 0.0];
                if m == 3 {
                    let earlier_bend = (back - (ym - ymm) / r) / (s + r);
                    let twist = (bend - earlier_bend) / (h + s + r);
                    p[1] -= h * s * twist;
                    p[2] += 2.0 * (s - h) * twist;
                    p[3] = 6.0 * twist;
                }
                p
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
            signal.advance(end, h);
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
        signal.advance(cubic(h), h);
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
        signal.advance([2.0, f64::NAN, f64::NAN, f64::NAN], h);
        signal.extrapolate(h);
        assert_eq!(signal.polynomial(3, h), [2.0, 10.0, 0.0, 0.0]);
        assert_eq!(signal.predicted(), [3.0, 10.0]);
    }
}
