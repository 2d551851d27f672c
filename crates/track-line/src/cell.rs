//! Short pieces of the line on which the position is a power series.

use nalgebra::{Matrix3, Vector3};

use crate::frame::Frame;
use crate::profile::Cubic;

/// Order of the series. On a cell of [`LENGTH`] at a curvature of 1/5 m the first term left out is below
/// (0.1)¹⁰/10! = 3e-17 m.
const ORDER: usize = 10;
/// Longest cell, m.
pub(crate) const LENGTH: f64 = 1.0;

/// Heading, slope and cant as polynomials about the middle of a cell, and the position as a series.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cell {
    /// Arc length at its beginning and at its middle, m.
    pub start: f64,
    pub middle: f64,
    heading: Cubic,
    slope: Cubic,
    cant: Cubic,
    place: [Vector3<f64>; ORDER],
}

/// Coefficients of cosine and sine of a polynomial.
fn circular(angle: &Cubic) -> [[f64; ORDER]; 2] {
    let (mut cos, mut sin) = ([0.0; ORDER], [0.0; ORDER]);
    (sin[0], cos[0]) = angle[0].sin_cos();
    let rate = [angle[1], 2.0 * angle[2], 3.0 * angle[3]];
    for n in 0..ORDER - 1 {
        let (mut c, mut s) = (0.0, 0.0);
        for (k, rate) in rate.iter().enumerate().take(n + 1) {
            c -= rate * sin[n - k];
            s += rate * cos[n - k];
        }
        cos[n + 1] = c / (n + 1) as f64;
        sin[n + 1] = s / (n + 1) as f64;
    }
    [cos, sin]
}

fn product(a: &[f64; ORDER], b: &[f64; ORDER]) -> [f64; ORDER] {
    std::array::from_fn(|n| (0..=n).map(|k| a[k] * b[n - k]).sum())
}

/// Value, first and second derivative of a cubic.
fn angle(cubic: &Cubic, u: f64) -> [f64; 3] {
    let [a, b, c, d] = *cubic;
    [a + u * (b + u * (c + u * d)), b + u * (2.0 * c + 3.0 * u * d), 2.0 * c + 6.0 * u * d]
}

impl Cell {
    /// A cell from `start` on, whose angles are polynomials about its middle, and which begins at `place`.
    pub fn new(start: f64, middle: f64, angles: [Cubic; 3], place: &Vector3<f64>) -> Self {
        let [heading, slope, cant] = angles;
        let ([cos_h, sin_h], [cos_s, sin_s]) = (circular(&heading), circular(&slope));
        let tangent = [product(&cos_s, &cos_h), product(&cos_s, &sin_h), sin_s];
        let mut series = [Vector3::zeros(); ORDER];
        for n in 1..ORDER {
            let scale = 1.0 / n as f64;
            series[n] = Vector3::from_fn(|axis, _| scale * tangent[axis][n - 1]);
        }
        let mut cell = Self { start, middle, heading, slope, cant, place: series };
        cell.place[0] = place - cell.position(start);
        cell
    }

    /// p(s).
    pub fn position(&self, s: f64) -> Vector3<f64> {
        let u = s - self.middle;
        self.place.iter().rev().fold(Vector3::zeros(), |sum, term| sum * u + term)
    }

    /// The frame at s.
    pub fn frame(&self, s: f64) -> Frame {
        let u = s - self.middle;
        let [h, h1, h2] = angle(&self.heading, u);
        let [e, e1, e2] = angle(&self.slope, u);
        let [c, c1, c2] = angle(&self.cant, u);
        let ((sh, ch), (se, ce), (sc, cc)) = (h.sin_cos(), e.sin_cos(), c.sin_cos());
        let axes = Matrix3::new(
            ch * ce,
            -sh * cc - ch * se * sc,
            sh * sc - ch * se * cc,
            sh * ce,
            ch * cc - sh * se * sc,
            -ch * sc - sh * se * cc,
            se,
            ce * sc,
            ce * cc,
        );
        let curvature = Vector3::new(c1 + h1 * se, -e1 * cc + h1 * ce * sc, e1 * sc + h1 * ce * cc);
        let (turn, turn1) = (h1 * ce, h2 * ce - h1 * se * e1);
        let curvature_rate = Vector3::new(
            c2 + h2 * se + h1 * ce * e1,
            -e2 * cc + e1 * sc * c1 + turn1 * sc + turn * cc * c1,
            e2 * sc + e1 * cc * c1 + turn1 * cc - turn * sc * c1,
        );
        Frame { s, position: self.position(s), axes, curvature, curvature_rate }
    }
}
