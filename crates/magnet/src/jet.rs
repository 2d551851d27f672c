//! Values with their first and second derivatives by two variables.

use std::ops::{Div, Mul};

/// A function of (u, v) at a point: its value, (∂u, ∂v) and (∂uu, ∂uv, ∂vv).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet {
    pub value: f64,
    pub first: [f64; 2],
    pub second: [f64; 3],
}

impl Mul for Jet {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let ([au, av], [bu, bv]) = (self.first, other.first);
        let mixed = [2.0 * au * bu, au * bv + av * bu, 2.0 * av * bv];
        let (a, b) = (self.value, other.value);
        Self {
            value: a * b,
            first: [au * b + a * bu, av * b + a * bv],
            second: std::array::from_fn(|k| self.second[k] * b + mixed[k] + a * other.second[k]),
        }
    }
}

impl Div for Jet {
    type Output = Self;

    #[allow(
        clippy::suspicious_arithmetic_impl,
        reason = "a quotient is a product with the inverse"
    )]
    fn div(self, other: Self) -> Self {
        let ([u, v], r) = (other.first, 1.0 / other.value);
        let products = [u * u, u * v, v * v];
        let inverse = Self {
            value: r,
            first: [-r * r * u, -r * r * v],
            second: std::array::from_fn(|k| r * r * (2.0 * r * products[k] - other.second[k])),
        };
        self * inverse
    }
}
