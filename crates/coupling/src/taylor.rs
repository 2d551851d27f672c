//! A polynomial over a step, by its Taylor coefficients at the step's beginning.

use std::ops::{AddAssign, Index, IndexMut};

use serde::{Deserialize, Serialize};

/// Number of coefficients.
pub const COEFFICIENTS: usize = 6;

/// The value and the first five derivatives of a function at the beginning of a step. With the time
/// τ since then, p(τ) = p₀ + p₁ τ + p₂/2! τ² + … + p₅/5! τ⁵.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Taylor(pub [f64; COEFFICIENTS]);

impl Taylor {
    /// The function that is zero everywhere.
    pub const ZERO: Self = Self([0.0; COEFFICIENTS]);

    /// A function that keeps one value.
    #[inline]
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self::cubic([value, 0.0, 0.0, 0.0])
    }

    /// A polynomial of degree 3 at most.
    #[inline]
    #[must_use]
    pub const fn cubic([p0, p1, p2, p3]: [f64; 4]) -> Self {
        Self([p0, p1, p2, p3, 0.0, 0.0])
    }

    /// The cubic with these values and slopes at the beginning and at the end of a step.
    #[inline]
    #[must_use]
    pub fn hermite([y0, r0]: [f64; 2], [y1, r1]: [f64; 2], size: f64) -> Self {
        let slope = (y1 - y0) / size;
        Self::cubic([
            y0,
            r0,
            (6.0 * slope - 4.0 * r0 - 2.0 * r1) / size,
            (6.0 * (r0 + r1) - 12.0 * slope) / (size * size),
        ])
    }

    /// The polynomial of degree 5 with these values, slopes and second derivatives at the beginning and
    /// at the end of a step.
    #[inline]
    #[must_use]
    pub fn quintic([y0, r0, b0]: [f64; 3], [y1, r1, b1]: [f64; 3], size: f64) -> Self {
        // what the parabola at the beginning leaves to be made up at the end, in steps
        let value = y1 - y0 - size * (r0 + 0.5 * size * b0);
        let rate = size * (r1 - r0 - size * b0);
        let bend = size * size * (b1 - b0);
        let cube = size * size * size;
        Self([
            y0,
            r0,
            b0,
            6.0 * (10.0 * value - 4.0 * rate + 0.5 * bend) / cube,
            24.0 * (7.0 * rate - 15.0 * value - bend) / (cube * size),
            120.0 * (6.0 * value - 3.0 * rate + 0.5 * bend) / (cube * size * size),
        ])
    }

    /// p(τ).
    #[inline]
    #[must_use]
    pub fn value(&self, tau: f64) -> f64 {
        let [p0, p1, p2, p3, p4, p5] = self.0;
        let p3 = p3 + tau / 4.0 * (p4 + tau / 5.0 * p5);
        p0 + tau * (p1 + tau / 2.0 * (p2 + tau / 3.0 * p3))
    }

    /// p'(τ).
    #[inline]
    #[must_use]
    pub fn rate(&self, tau: f64) -> f64 {
        let [_, p1, p2, p3, p4, p5] = self.0;
        let p3 = p3 + tau / 3.0 * (p4 + tau / 4.0 * p5);
        p1 + tau * (p2 + tau / 2.0 * p3)
    }

    /// The same function, expanded about τ instead.
    #[inline]
    #[must_use]
    pub fn shifted(&self, tau: f64) -> Self {
        let [_, _, p2, p3, p4, p5] = self.0;
        let bend = p2 + tau * (p3 + tau / 2.0 * (p4 + tau / 3.0 * p5));
        let twist = p3 + tau * (p4 + tau / 2.0 * p5);
        Self([self.value(tau), self.rate(tau), bend, twist, p4 + tau * p5, p5])
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
            Self::cubic([p0, (end - p0) / size, 0.0, 0.0])
        } else {
            Self::cubic([p0, p1, 2.0 * (end - p0 - size * p1) / (size * size), 0.0])
        }
    }

    /// A polynomial of lower degree that replaces this one over a step. With the size δ of the step:
    ///
    /// | degree | polynomial | error of its integral over the step |
    /// |---|---|---|
    /// | 0 | the value in the middle, held | p'' δ³/24 |
    /// | 1 | the line through both ends | −p'' δ³/12 |
    /// | 2 | through both ends, with the slope at the first | O(p''' δ⁴) |
    /// | 3, 4 | through both ends, with both slopes | p'''' δ⁵/720 |
    #[inline]
    #[must_use]
    pub fn reduced(&self, degree: usize, size: f64) -> Self {
        match degree {
            0 => Self::constant(self.value(size / 2.0)),
            1 | 2 => self.ending_at(self.value(size), degree, size),
            3 | 4 if self.0[4..] != [0.0; 2] => {
                let [p0, p1, ..] = self.0;
                Self::hermite([p0, p1], [self.value(size), self.rate(size)], size)
            }
            _ => *self,
        }
    }

    /// factor · p + offset.
    #[inline]
    #[must_use]
    pub fn scaled(&self, factor: f64, offset: f64) -> Self {
        let mut scaled = self.0.map(|p| factor * p);
        scaled[0] = factor * self.0[0] + offset;
        Self(scaled)
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
