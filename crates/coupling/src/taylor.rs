//! A polynomial over a step, by its Taylor coefficients at the step's beginning.

use std::ops::{AddAssign, Index, IndexMut};

use serde::{Deserialize, Serialize};

/// The value and the first three derivatives of a function at the beginning of a step. With the time
/// τ since then, p(τ) = p₀ + p₁ τ + p₂/2 τ² + p₃/6 τ³.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Taylor(pub [f64; 4]);

impl Taylor {
    /// The function that is zero everywhere.
    pub const ZERO: Self = Self([0.0; 4]);

    /// A function that keeps one value.
    #[inline]
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0, 0.0])
    }

    /// p(τ).
    #[inline]
    #[must_use]
    pub fn value(&self, tau: f64) -> f64 {
        let [p0, p1, p2, p3] = self.0;
        p0 + tau * (p1 + tau / 2.0 * (p2 + tau / 3.0 * p3))
    }

    /// p'(τ).
    #[inline]
    #[must_use]
    pub fn rate(&self, tau: f64) -> f64 {
        let [_, p1, p2, p3] = self.0;
        p1 + tau * (p2 + tau / 2.0 * p3)
    }

    /// The same function, expanded about τ instead.
    #[inline]
    #[must_use]
    pub fn shifted(&self, tau: f64) -> Self {
        let [_, _, p2, p3] = self.0;
        Self([self.value(tau), self.rate(tau), p2 + tau * p3, p3])
    }

    /// The derivatives up to an order; the higher ones are zero.
    #[inline]
    #[must_use]
    pub fn up_to(&self, order: usize) -> Self {
        Self(std::array::from_fn(|k| if k <= order { self.0[k] } else { 0.0 }))
    }

    /// Degree 1: the line from the value at the beginning to `end`. Degree 2 and above: the parabola
    /// through both values with the slope at the beginning.
    #[inline]
    #[must_use]
    pub fn ending_at(&self, end: f64, degree: usize, size: f64) -> Self {
        let [p0, p1, ..] = self.0;
        if degree <= 1 {
            Self([p0, (end - p0) / size, 0.0, 0.0])
        } else {
            Self([p0, p1, 2.0 * (end - p0 - size * p1) / (size * size), 0.0])
        }
    }

    /// A polynomial of lower degree that replaces this one over a step. With the size δ of the step:
    ///
    /// | degree | polynomial | error of its integral over the step |
    /// |---|---|---|
    /// | 0 | the value in the middle, held | p'' δ³/24 |
    /// | 1 | the line through both ends | −p'' δ³/12 |
    /// | 2 | through both ends, with the slope at the first | O(p''' δ⁴) |
    #[inline]
    #[must_use]
    pub fn reduced(&self, degree: usize, size: f64) -> Self {
        match degree {
            0 => Self::constant(self.value(size / 2.0)),
            1 | 2 => self.ending_at(self.value(size), degree, size),
            _ => *self,
        }
    }

    /// factor · p + offset.
    #[inline]
    #[must_use]
    pub fn scaled(&self, factor: f64, offset: f64) -> Self {
        let [p0, p1, p2, p3] = self.0;
        Self([factor * p0 + offset, factor * p1, factor * p2, factor * p3])
    }
}

impl Index<usize> for Taylor {
    type Output = f64;

    #[inline]
    fn index(&self, order: usize) -> &f64 {
        &self.0[order]
    }
}

impl IndexMut<usize> for Taylor {
    #[inline]
    fn index_mut(&mut self, order: usize) -> &mut f64 {
        &mut self.0[order]
    }
}

impl AddAssign for Taylor {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a += b);
    }
}
