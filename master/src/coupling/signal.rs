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
//!
//! **Held** signals change at communication points only (`variability="discrete"` of source or
//! target): over the step p is the value at its beginning, also when the source has stepped already.
//!
//! **Over a jump.** A held input that changes at tₙ makes the outputs that depend on it directly jump
//! there ([`Effect::Jump`]), and the slopes of the unit's other outputs ([`Effect::Kink`]). Data from
//! both sides are then never put into one polynomial: history begins anew with the point at tₙ₊₁, and
//! interpolation takes, after a jump, the Taylor polynomial about the end; after a kink, the parabola
//! through y₀ with y₁ and y₁', or the line through both values.

use serde::{Deserialize, Serialize};

/// A function over the step by its value and first three derivatives at the step's beginning.
pub type Taylor = [f64; 4];

/// What a discontinuity at the beginning of a step does to a signal, the worse the greater.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Effect {
    /// Nothing: the signal is smooth.
    #[default]
    None,
    /// Its slope jumps.
    Kink,
    /// Its value jumps.
    Jump,
}

/// One Real output with what is needed to represent it over a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// d: highest derivative that the source offers, 0 to 3.
    offered: usize,
    /// N: degree of the extrapolation, 0 to 3.
    degree: usize,
    /// Whether it changes at communication points only.
    held: bool,
    /// What happens to it at the beginning of the current step.
    effect: Effect,
    /// The same of the step before, which those feel who take it extrapolated.
    last_effect: Effect,
    /// Whether the point at the start is from before a jump that its source makes with its first step.
    stale: bool,
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

    /// A signal that changes at communication points only.
    #[must_use]
    pub fn held() -> Self {
        Self { held: true, ..Self::default() }
    }

    /// Whether it changes at communication points only.
    #[inline]
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.held
    }

    /// Highest derivative that the source offers.
    #[must_use]
    pub fn offered(&self) -> usize {
        self.offered
    }

    /// Whether the other signal is represented in the same way, by data of the same kind.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        let kind = |it: &Self| (it.offered, it.degree, it.held);
        kind(self) == kind(other) && other.known <= 3
    }

    /// Forgets the history: at the start or after an event.
    pub fn restart(&mut self, now: Taylor) {
        self.points = [now; 4];
        self.steps = [0.0; 3];
        self.known = 0;
        self.ahead = false;
        (self.effect, self.last_effect) = (Effect::None, Effect::None);
        self.stale = false;
    }

    /// What whoever takes it feels at the beginning of the current step.
    #[inline]
    #[must_use]
    pub fn felt(&self) -> Effect {
        if self.held {
            // held inputs are those of the beginning: the point before the source's latest
            let begin = usize::from(self.ahead);
            let changed = self.points[begin][0] != self.points[begin + 1][0];
            if changed { Effect::Jump } else { Effect::None }
        } else if self.ahead {
            self.effect
        } else {
            self.last_effect
        }
    }

    /// Whether it jumps at the beginning of the step that its source has made.
    #[inline]
    #[must_use]
    pub fn jumps(&self) -> bool {
        self.effect == Effect::Jump
    }

    /// Takes note of what happens to it at the beginning of the current step.
    #[inline]
    pub fn react(&mut self, effect: Effect) {
        self.effect = if self.stale { Effect::Jump } else { effect };
    }

    /// Lets it jump at the beginning of the source's first step, whatever its inputs do then.
    pub fn expect_jump(&mut self) {
        self.stale = true;
    }

    /// Takes the point at the end of a step of length `h` that the source has made.
    #[inline]
    pub fn advance(&mut self, now: Taylor, h: f64) {
        self.points = [now, self.points[0], self.points[1], self.points[2]];
        self.steps = [h, self.steps[0], self.steps[1]];
        self.known = (self.known + 1).min(3);
        self.forget_before_jump();
    }

    /// Replaces the latest point, when the source has made its step again.
    #[inline]
    pub fn revise(&mut self, now: Taylor) {
        self.points[0] = now;
        self.forget_before_jump();
    }

    #[inline]
    fn forget_before_jump(&mut self) {
        if self.effect != Effect::None {
            self.known = 0;
        }
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
        if self.held {
            return p;
        }
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
        self.last_effect = std::mem::take(&mut self.effect);
        // until the source has made its first step, however often
        self.stale &= self.steps[0] == 0.0;
        self.react(Effect::None);
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
        if self.held {
            return;
        }
        let [end, begin, before, earlier] = self.points;
        let slope = (end[0] - begin[0]) / h;
        self.polynomial = if self.effect == Effect::Jump {
            self.about_the_end(h)
        } else if self.effect == Effect::Kink && self.offered >= 1 {
            [begin[0], 2.0 * slope - end[1], 2.0 * (end[1] - slope) / h, 0.0]
        } else if self.offered >= 1 {
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

    /// The Taylor polynomial about the end of the step, with the derivatives on offer there.
    fn about_the_end(&self, h: f64) -> Taylor {
        let mut end = [0.0; 4];
        end[..=self.offered].copy_from_slice(&self.points[0][..=self.offered]);
        let [y, d, dd, ddd] = end;
        [
            y - h * (d - h / 2.0 * (dd - h / 3.0 * ddd)),
            d - h * (dd - h / 2.0 * ddd),
            dd - h * ddd,
            ddd,
        ]
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

    /// Held over the step from its beginning on, whether the source has stepped or not.
    #[test]
    fn analytic_held_signals_are_those_of_the_beginning() {
        let mut signal = Signal::held();
        signal.restart([1.0; 4]);
        for (n, value) in [1.0, 12.0, 12.0].into_iter().enumerate() {
            signal.extrapolate(0.1);
            let begin = [1.0, 1.0, 12.0][n];
            assert_eq!(signal.polynomial(3, 0.1), [begin, 0.0, 0.0, 0.0]);
            let felt = if n == 2 { Effect::Jump } else { Effect::None };
            assert_eq!(signal.felt(), felt, "before the source");
            signal.advance([value, f64::NAN, f64::NAN, f64::NAN], 0.1);
            signal.interpolate(0.1);
            assert_eq!(signal.polynomial(3, 0.1), [begin, 0.0, 0.0, 0.0]);
            assert_eq!(signal.felt(), felt, "after the source");
        }
    }

    /// A cubic that jumps by 5 at the beginning of a step: within the step only what came after the
    /// jump is used, and the history begins anew.
    #[test]
    fn analytic_nothing_is_put_through_a_jump() {
        let h = 0.1;
        for offered in 0..=3 {
            let mut signal = signal(offered, 2, cubic, h);
            let jumped = |t: f64| {
                let mut point = cubic(t);
                point[0] += 5.0;
                point[offered + 1..].fill(f64::NAN);
                point
            };
            signal.extrapolate(h);
            signal.react(Effect::Jump);
            signal.advance(jumped(h), h);
            signal.interpolate(h);
            let p = signal.polynomial(3, h);
            let end = value(&p, h) - jumped(h)[0];
            assert!(end.abs() < ROUNDING, "{offered}: {end:e}");
            // what is left of the Taylor series about the end, over the whole step
            let rest = [0.5, 0.03, 0.005, 0.0][offered];
            let begin = (value(&p, 0.0) - cubic(0.0)[0] - 5.0).abs();
            assert!(begin <= rest + ROUNDING, "{offered}: {begin:e}");
            signal.extrapolate(h);
            assert_eq!(signal.felt(), Effect::Jump, "for those who step before the source");
            let now = jumped(h);
            let known = std::array::from_fn(|k| if k <= offered.min(2) { now[k] } else { 0.0 });
            assert_eq!(signal.polynomial(3, h), known, "nothing from before the jump");
            signal.advance(jumped(2.0 * h), h);
            signal.extrapolate(h);
            assert_eq!(signal.felt(), Effect::None);
        }
    }

    /// A slope that jumps leaves the value at the beginning in place.
    #[test]
    fn analytic_a_kink_keeps_the_value_at_the_beginning() {
        let h = 0.1;
        for offered in 0..=2 {
            let mut signal = signal(offered, 2, |_| [1.0, 0.0, 0.0, 0.0], h);
            signal.extrapolate(h);
            signal.react(Effect::Kink);
            // 1 + 3 t + 4 t² from t = 0 on
            let mut end = [1.0 + 3.0 * h + 4.0 * h * h, 3.0 + 8.0 * h, 8.0, 0.0];
            end[offered + 1..].fill(f64::NAN);
            signal.advance(end, h);
            signal.interpolate(h);
            for tau in [0.0, 0.04, h] {
                let truth = 1.0 + tau * (3.0 + 4.0 * tau);
                let line = 4.0 * tau * (h - tau);
                let error = (value(&signal.polynomial(3, h), tau) - truth).abs();
                let allowed = if offered == 0 { line } else { 0.0 };
                assert!(error <= allowed + ROUNDING, "{offered} {tau}: {error:e}");
            }
        }
    }
}
