//! Mode shapes of a girder: sines, splines through tables, or piecewise cubics.

use std::f64::consts::PI;

use crate::cubics::PiecewiseCubics;
use crate::propagator::NODES;
use crate::{Pole, Spline};

/// φₙ and its first two derivatives at one place, one entry per mode.
#[derive(Debug, Clone, Default)]
pub(crate) struct ShapeRow {
    pub value: Vec<f64>,
    pub slope: Vec<f64>,
    pub curvature: Vec<f64>,
}

impl ShapeRow {
    pub fn with_modes(modes: usize) -> Self {
        let zeros = vec![0.0; modes];
        Self { value: zeros.clone(), slope: zeros.clone(), curvature: zeros }
    }
}

/// The shapes of all modes of a girder.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ModeShapes {
    /// φₙ = sin(nπx/L); `filter[n-1]` is the ratio of its mean under a pole that is entirely on the
    /// span to its value at the pole's centre: Σ wₗ cos(nπsₗ/L).
    Sine { length: f64, filter: Vec<f64> },
    /// Splines through tabulated points, 0 at both ends.
    Tables(Vec<Spline>),
    /// Cubics that may be other than 0 at the ends. A pole's force is spread evenly over its length,
    /// the limit of many discrete forces, because a few of them would cross a step of the track one by
    /// one.
    Cubics(PiecewiseCubics),
}

impl ModeShapes {
    /// Sine shapes of `modes` modes over a length (m).
    pub fn sine(length: f64, modes: usize, pole: &Pole) -> Self {
        let base = PI / length;
        Self::Sine { length, filter: (1..=modes).map(|n| pole.filter(base * n as f64)).collect() }
    }

    /// φₙ(x) at a single place, 0 ≤ x ≤ L.
    pub fn at(&self, x: f64, row: &mut ShapeRow) {
        match self {
            Self::Sine { length, filter } => sines(*length, x, filter, |_| 1.0, row),
            Self::Tables(splines) => {
                for (n, spline) in splines.iter().enumerate() {
                    [row.value[n], row.slope[n], row.curvature[n]] = spline.at(x);
                }
            }
            Self::Cubics(cubics) => cubics.at(x, row),
        }
    }

    /// Σ wₗ φₙ(x + sₗ) for a pole centred at x that is entirely on the span.
    pub fn under_pole(&self, x: f64, pole: &Pole, row: &mut ShapeRow) {
        match self {
            Self::Sine { length, filter } => sines(*length, x, filter, |w| w, row),
            Self::Tables(splines) => {
                for (n, spline) in splines.iter().enumerate() {
                    let mut sum = [0.0; 3];
                    for &(offset, share) in pole.points() {
                        let s = spline.at(x + offset);
                        sum = std::array::from_fn(|i| sum[i] + share * s[i]);
                    }
                    [row.value[n], row.slope[n], row.curvature[n]] = sum;
                }
            }
            Self::Cubics(cubics) => {
                let half = 0.5 * pole.length();
                if half > 0.0 { cubics.mean(x - half, x + half, row) } else { cubics.at(x, row) }
            }
        }
    }

    /// Whether a pole's force is spread evenly, also where the pole reaches beyond the span.
    pub fn spread_evenly(&self) -> bool {
        matches!(self, Self::Cubics(_))
    }

    /// The pole filter of sine modes.
    pub fn sine_filter(&self) -> Option<&[f64]> {
        match self {
            Self::Sine { filter, .. } => Some(filter),
            Self::Tables(_) | Self::Cubics(_) => None,
        }
    }
}

/// `see(n, filterₙ·sin((n+1)πxⱼ/L))` at several places close together: one sine and cosine in their
/// middle, rotated to each place.
pub(crate) fn sines_at_nodes(
    length: f64,
    places: [f64; NODES],
    filter: &[f64],
    mut see: impl FnMut(usize, [f64; NODES]),
) {
    let base = PI / length;
    let middle = 0.5 * (places[0] + places[NODES - 1]);
    let (sm, cm) = libm::sincos(base * middle);
    let turn = places.map(|x| small_sincos(base * (x - middle)));
    let s1: [f64; NODES] = std::array::from_fn(|j| sm * turn[j].1 + cm * turn[j].0);
    let c1: [f64; NODES] = std::array::from_fn(|j| cm * turn[j].1 - sm * turn[j].0);
    let (mut s, mut c) = (s1, c1);
    for (n, w) in filter.iter().enumerate() {
        see(n, s.map(|s| w * s));
        for j in 0..NODES {
            (s[j], c[j]) = (s[j] * c1[j] + c[j] * s1[j], c[j] * c1[j] - s[j] * s1[j]);
        }
    }
}

/// sin(nθ) and its derivatives for θ = πx/L, by rotating a unit vector n times by θ; times the weight
/// that `of` takes from the filter.
fn sines(length: f64, x: f64, filter: &[f64], of: impl Fn(f64) -> f64, row: &mut ShapeRow) {
    let base = PI / length;
    let (s1, c1) = libm::sincos(base * x);
    let (mut s, mut c) = (s1, c1);
    for (n, &filter) in filter.iter().enumerate() {
        let k = base * (n + 1) as f64;
        let w = of(filter);
        row.value[n] = w * s;
        row.slope[n] = w * k * c;
        row.curvature[n] = -w * k * k * s;
        (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
    }
}

/// Sine and cosine, by their series for angles within a sub-step: the first terms left out are
/// (1/8)¹¹/11! = 3e-18 and (1/8)¹⁰/10! = 3e-16.
fn small_sincos(a: f64) -> (f64, f64) {
    if a.abs() > 0.125 {
        return libm::sincos(a);
    }
    let b = a * a;
    let s = 1.0 - b / 6.0 * (1.0 - b / 20.0 * (1.0 - b / 42.0 * (1.0 - b / 72.0)));
    let c = 1.0 - b / 2.0 * (1.0 - b / 12.0 * (1.0 - b / 30.0 * (1.0 - b / 56.0)));
    (a * s, c)
}
