//! One Real output that feeds inputs: its history, and the [`Taylor`] polynomial that represents it
//! over a step, with p, p', p'', p''' at the step's beginning tₙ.
//!
//! The source provides derivatives up to order d at every communication point (d = 0: values only).
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
//! The highest derivative that is provided is extrapolated and integrated, and the degree grows with
//! the history after the start. The error of p over the step is O(h^(N+1)). A run that starts in motion
//! lacks history: its first steps have a lower degree, which limits the order of the whole run to
//! d + 2.
//!
//! **Interpolation** when the source has already stepped to tₙ₊₁ (value y₁; y₀ at tₙ). With
//! derivatives, the cubic Hermite polynomial, error O(h⁴):
//!
//! p'' = (6(y₁ − y₀)/h − 4y₀' − 2y₁')/h,  p''' = (6(y₀' + y₁') − 12(y₁ − y₀)/h)/h².
//!
//! A signal of order 6 that has second derivatives is the polynomial of degree 5 through value and two
//! derivatives at both ends instead ([`Taylor::quintic`]), error O(h⁶).
//!
//! Without derivatives, the polynomial of degree m = max(N, 1), or lower with a short history, through
//! y₁, y₀, y₋₁, y₋₂ at h, 0, −s, −s−s', error O(h^(m+1)); g₁₀ = (y₁ − y₀)/h and so on:
//!
//! | m | p' | p'' | p''' |
//! |---|---|---|---|
//! | 1 | g₁₀ | | |
//! | 2 | g₁₀ − h g₁₀₋ | 2 g₁₀₋ | |
//! | 3 | g₁₀ − h g₁₀₋ − h s g₁₀₋₋ | 2 g₁₀₋ + 2(s − h) g₁₀₋₋ | 6 g₁₀₋₋ |
//!
//! **Held** signals change at communication points only (`variability="discrete"` of source or
//! target): over the step, p is the value at its beginning, even if the source has already stepped.
//!
//! **Jumps.** A held input that changes at tₙ makes the outputs that depend on it directly jump
//! there ([`Effect::Jump`]), and the slopes of the unit's other outputs ([`Effect::Kink`]). A polynomial
//! never combines data from both sides: the history restarts with the point at tₙ₊₁. After a jump,
//! interpolation uses the Taylor polynomial about the end. After a kink, it uses the parabola through
//! y₀ with y₁ and y₁' (of order 6: the cubic with y₁'' as well), or the line through both values. A signal that kinks at every communication
//! point, such as the acceleration under a sampled controller, is announced by its connection.

use serde::{Deserialize, Serialize};

use super::taylor::Taylor;

/// The discontinuity of a signal at the beginning of a step, in order of severity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Effect {
    /// The signal is smooth.
    #[default]
    None,
    /// Its slope jumps.
    Kink,
    /// Its value jumps.
    Jump,
}

impl Effect {
    /// A jump, if a held value has changed.
    #[inline]
    pub(super) fn jump_if(changed: bool) -> Self {
        if changed { Self::Jump } else { Self::None }
    }
}

/// One Real output with the data that represent it over a step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// d: highest derivative that the source provides, 0 to 3.
    offered: usize,
    /// N: degree of the extrapolation, 0 to 3.
    degree: usize,
    /// Highest derivative at both ends that interpolation uses, 0 to 2.
    ends: usize,
    /// Whether it changes at communication points only.
    held: bool,
    /// Discontinuity at the beginning of the current step.
    effect: Effect,
    /// The same for the step before. Targets that take the signal extrapolated see this one.
    last_effect: Effect,
    /// Whether the point at the start precedes a jump that the source makes with its first step.
    stale: bool,
    /// y and the derivatives that are provided, the source's latest point first.
    points: [Taylor; 4],
    /// Lengths of the steps between the points, latest first.
    steps: [f64; 3],
    /// Number of points before the latest.
    known: usize,
    /// Whether the source has stepped ahead and the polynomial interpolates.
    ahead: bool,
    polynomial: Taylor,
    /// Extrapolated value and first two derivatives at the step's end.
    predicted: [f64; 3],
    /// Value at the step's end that units used which stepped before the source.
    assumed: f64,
}

impl Signal {
    /// A signal whose source provides derivatives up to `offered`, extrapolated with `degree`.
    #[must_use]
    pub fn new(offered: usize, degree: usize) -> Self {
        let (offered, degree) = (offered.min(3), degree.min(3));
        Self { offered, degree, ends: offered.min(1), ..Self::default() }
    }

    /// The same, interpolated with second derivatives if the source provides them: order 6.
    #[must_use]
    pub fn with_bends(self) -> Self {
        Self { ends: self.offered.min(2), ..self }
    }

    /// Highest derivative at both ends that its interpolation uses, 0 to 2.
    #[inline]
    #[must_use]
    pub fn ends(&self) -> usize {
        self.ends
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

    /// Highest derivative that the source provides.
    #[must_use]
    pub fn offered(&self) -> usize {
        self.offered
    }

    /// Whether both signals are represented in the same way, by the same kind of data.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        let kind = |it: &Self| (it.offered, it.degree, it.ends, it.held);
        kind(self) == kind(other) && other.known <= 3
    }

    /// Discards the history, at the start or after an event.
    pub fn restart(&mut self, now: Taylor) {
        self.points = [now; 4];
        self.steps = [0.0; 3];
        self.known = 0;
        self.ahead = false;
        (self.effect, self.last_effect) = (Effect::None, Effect::None);
        self.stale = false;
    }

    /// The discontinuity that its targets see at the beginning of the current step.
    #[inline]
    #[must_use]
    pub fn effect_on_targets(&self) -> Effect {
        if self.held {
            // targets take the value at the beginning: the point before the source's latest
            let begin = usize::from(self.ahead);
            Effect::jump_if(self.points[begin][0] != self.points[begin + 1][0])
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

    /// Sets the discontinuity at the beginning of the current step.
    #[inline]
    pub fn set_effect(&mut self, effect: Effect) {
        self.effect = if self.stale { Effect::Jump } else { effect };
    }

    /// Announces a jump at the beginning of the source's first step, whatever its inputs do then.
    pub fn expect_jump(&mut self) {
        self.stale = true;
    }

    /// Adds the point at the end of a step of length `h` that the source has made.
    #[inline]
    pub fn advance(&mut self, now: Taylor, h: f64) {
        self.points = [now, self.points[0], self.points[1], self.points[2]];
        self.steps = [h, self.steps[0], self.steps[1]];
        self.known = (self.known + 1).min(3);
        self.discard_before_jump();
    }

    /// Replaces the latest point after the source has repeated its step.
    #[inline]
    pub fn revise(&mut self, now: Taylor) {
        self.points[0] = now;
        self.discard_before_jump();
    }

    #[inline]
    fn discard_before_jump(&mut self) {
        if self.effect != Effect::None {
            self.known = 0;
        }
    }

    /// Value and first two derivatives that the extrapolation gives at the end of the step.
    #[inline]
    #[must_use]
    pub fn predicted(&self) -> [f64; 3] {
        self.predicted
    }

    /// The source's latest point.
    #[inline]
    #[must_use]
    pub fn now(&self) -> &Taylor {
        &self.points[0]
    }

    /// The polynomial of the current step, reduced to what the target can take: derivatives up to
    /// `limit` (0: the newest known value, held over the step).
    #[inline]
    #[must_use]
    pub fn polynomial(&self, limit: usize, h: f64) -> Taylor {
        let p = self.polynomial;
        if self.held {
            return p;
        }
        match (limit, self.ahead) {
            (3 | 4, true) if self.ends > 1 => p.reduced(limit, h),
            (3.., _) => p,
            (0, true) => Taylor::constant(self.points[0][0]),
            (_, true) => p.ending_at(self.points[0][0], limit, h),
            (_, false) => p.up_to(limit),
        }
    }

    /// Computes the polynomial from data up to the step's beginning.
    #[inline]
    pub fn extrapolate(&mut self, h: f64) {
        self.ahead = false;
        self.last_effect = std::mem::take(&mut self.effect);
        // until the source has finished its first step, even if it repeats it
        self.stale &= self.steps[0] == 0.0;
        self.set_effect(Effect::None);
        let e = self.offered.min(self.degree);
        let mut p = self.points[0].up_to(e);
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
        self.predicted = [p.value(h), p.rate(h), p[2] + h * p[3]];
        self.assumed = self.predicted[0];
        self.polynomial = p;
    }

    /// Computes the polynomial from an assumed value and first derivatives at the step's end, which
    /// replace those of the source as far as [`ends`](Self::ends) says.
    #[inline]
    pub fn assume(&mut self, end: [f64; 3], h: f64) {
        for (now, end) in self.points[0].0.iter_mut().zip(&end[..=self.ends]) {
            *now = *end;
        }
        self.interpolate(h);
        self.assumed = end[0];
    }

    /// The value at the step's end that units used which stepped before the source.
    #[inline]
    #[must_use]
    pub fn assumed(&self) -> f64 {
        self.assumed
    }

    /// Computes the polynomial between the step's beginning and its end, to which the source has
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
            // about the end of the step, with the derivatives that the source provides there
            end.up_to(self.offered).shifted(-h)
        } else if self.effect == Effect::Kink && self.ends >= 2 {
            let twist = 6.0 * (end[0] - begin[0] - h * (end[1] - 0.5 * h * end[2])) / (h * h * h);
            Taylor::cubic([end[0], end[1], end[2], twist]).shifted(-h)
        } else if self.effect == Effect::Kink && self.offered >= 1 {
            Taylor::cubic([begin[0], 2.0 * slope - end[1], 2.0 * (end[1] - slope) / h, 0.0])
        } else if self.ends >= 2 {
            let data = |p: &Taylor| [p[0], p[1], p[2]];
            Taylor::quintic(data(&begin), data(&end), h)
        } else if self.offered >= 1 {
            Taylor::hermite([begin[0], begin[1]], [end[0], end[1]], h)
        } else {
            let (y0, ym, ymm) = (begin[0], before[0], earlier[0]);
            let m = self.degree.max(1).min(self.known);
            if m <= 1 {
                Taylor::cubic([y0, slope, 0.0, 0.0])
            } else {
                let [_, s, r] = self.steps;
                let back = (y0 - ym) / s;
                let bend = (slope - back) / (h + s);
                let mut p = Taylor::cubic([y0, slope - h * bend, 2.0 * bend, 0.0]);
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
}
