//! One zero of det N(s), refined and followed.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::explore::NEARLY_REAL;
use crate::gains::Gains;
use crate::space::{Level, Space};
use crate::system::{Controller, Controllers};

/// Iterations before the matrix is factorised again.
const FROZEN: usize = 5;
/// Iterations in all.
const MOST: usize = 13;
/// Change of s, as a fraction, at which it has converged.
const CONVERGED: f64 = 1e-9;
/// Residual ‖N z‖ / ‖z‖ of a converged zero, relative to the size of N's columns at z.
const RESIDUAL: f64 = 1e-9;

/// A zero s of det N, with right and left null vectors.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Number that it keeps while it is followed.
    pub id: usize,
    /// s (1/s). The conjugate is a zero as well if it is not real.
    pub s: c64,
    /// z: N z = 0.
    pub z: Vec<c64>,
    /// w: wᵀN = 0.
    pub w: Vec<c64>,
    /// Changes of s and z from the point before to this one.
    moved: Option<(c64, Vec<c64>)>,
    /// Points since it was refined.
    pub(crate) age: usize,
    factors: Option<std::sync::Arc<PartialPivLu<c64>>>,
}

/// What a system is at one point of a map.
#[derive(Clone, Copy)]
pub struct Point<'a> {
    /// The plant.
    pub space: &'a Space,
    /// The attached part.
    pub level: &'a Level,
    /// The controllers of the space's ports ([`Space::controllers`]).
    pub controllers: &'a Controllers,
}

impl Point<'_> {
    pub(crate) fn factors(&self, s: c64) -> PartialPivLu<c64> {
        let gains = Gains::at(self.controllers, s, false);
        let n = self.space.matrix(s, &gains, self.level, &self.space.response(s));
        PartialPivLu::new(n.as_ref())
    }
}

impl Branch {
    /// Starts at an approximate zero: null vectors by inverse iteration, then refinement.
    #[must_use]
    pub fn near(id: usize, s: c64, point: Point<'_>) -> Option<Self> {
        // slightly beside it, so that the matrix is not singular
        let beside = s + c64::new(1e-7, 1e-7) * s.norm().max(1e-3);
        let factors = point.factors(beside);
        let size = point.space.size(point.level);
        // another start for each number, so that zeros that coincide get different vectors
        let start = |a: f64| -> Vec<c64> {
            let a = a + 0.61 * id as f64;
            let value = |k: usize| c64::new((a * (k + 1) as f64).sin(), (k as f64 * a + 1.0).cos());
            (0..size).map(value).collect()
        };
        let (mut z, mut w) = (start(1.7), start(2.3));
        for _ in 0..3 {
            z = normal(solve(&factors, &z))?;
            w = normal(solve_transposed(&factors, &w))?;
        }
        let factors = Some(std::sync::Arc::new(factors));
        let mut branch = Self { id, s, z, w, moved: None, age: 0, factors };
        branch.refine(point).then_some(branch)
    }

    /// A zero of the plant alone that no force reaches: the same for all controllers.
    #[must_use]
    pub fn fixed(id: usize, s: c64) -> Self {
        Self { id, s, z: Vec::new(), w: Vec::new(), moved: None, age: 0, factors: None }
    }

    /// Of a pair takes the zero with Im s > 0.
    pub(crate) fn mirror(&mut self) {
        if self.s.im < 0.0 {
            let conjugate = |x: &mut c64| *x = x.conj();
            conjugate(&mut self.s);
            self.z.iter_mut().chain(&mut self.w).for_each(conjugate);
            (self.factors, self.moved) = (None, None);
        }
    }

    /// s without an imaginary part that is a rounding error.
    pub(crate) fn place(&self) -> c64 {
        let s = self.s;
        if s.im.abs() <= NEARLY_REAL * s.norm() { c64::new(s.re, 0.0) } else { s }
    }

    /// Where it is likely to be now.
    pub(crate) fn ahead(&self) -> c64 {
        let by = self.moved.as_ref().map_or(c64::new(0.0, 0.0), |(step, _)| *step);
        self.s + by * self.age as f64
    }

    /// Moves to the zero of a near point. `false`, and no change, if there is none within reach.
    pub fn refine(&mut self, point: Point<'_>) -> bool {
        if self.z.is_empty() {
            self.age = 0;
            return true;
        }
        let points = (self.age + 1) as f64;
        let mut next = self.clone();
        let mut found = false;
        if let Some((step, change)) = &self.moved {
            next.s += step * points;
            next.z.iter_mut().zip(change).for_each(|(z, by)| *z += by * points);
            found = next.iterate(point, self.s);
            if !found {
                next = self.clone();
            }
        }
        if found || next.iterate(point, self.s) {
            let change = next.z.iter().zip(&self.z).map(|(a, b)| (a - b) / points).collect();
            next.moved = Some(((next.s - self.s) / points, change));
            next.age = 0;
            *self = next;
            return true;
        }
        false
    }

    /// The zero of a point nearby, however far that is from the last one.
    #[must_use]
    pub fn at(&self, point: Point<'_>) -> Option<Self> {
        let mut next = self.clone();
        (next.moved, next.age) = (None, 0);
        next.refine(point).then_some(next)
    }

    /// Residual inverse iteration (Neumaier 1985) with a factorisation that is kept, and Newton's method for
    /// wᵀ N(s) z = 0.
    fn iterate(&mut self, point: Point<'_>, started: c64) -> bool {
        if self.z.len() != point.space.size(point.level) {
            return false;
        }
        let mut since = 0;
        for _ in 0..MOST {
            let gains = Gains::at(point.controllers, self.s, true);
            let applied = point.space.apply(self.s, &gains, point.level, &self.z);
            let by_s = dot(&self.w, &applied.slope);
            let step = -dot(&self.w, &applied.value) / by_s;
            if !(step.re.is_finite() && step.im.is_finite()) {
                return false;
            }
            let reach = 0.3 * self.s.norm().max(1e-2);
            let step = if step.norm() > reach { step * (reach / step.norm()) } else { step };
            self.s += step;
            let residual: Vec<c64> =
                applied.value.iter().zip(&applied.slope).map(|(r, d)| *r + step * *d).collect();
            let scale = norm(&applied.slope) * self.s.norm().max(1e-3) + norm(&self.z);
            if step.norm() <= CONVERGED * self.s.norm().max(1e-3)
                && norm(&residual) <= RESIDUAL * scale
            {
                return (self.s - started).norm() <= 0.5 * started.norm().max(0.1);
            }
            if since >= FROZEN || self.factors.is_none() {
                since = 0;
                let beside = self.s * c64::new(1.0, 1e-9);
                let factors = point.factors(beside);
                let Some(z) = normal(solve(&factors, &self.z)) else { return false };
                let Some(w) = normal(solve_transposed(&factors, &self.w)) else { return false };
                (self.z, self.w) = (z, w);
                self.factors = Some(std::sync::Arc::new(factors));
                continue;
            }
            since += 1;
            if let Some(factors) = &self.factors {
                let change = solve(factors, &residual);
                let moved = self.z.iter().zip(&change).map(|(z, c)| *z - *c).collect();
                let Some(z) = normal(moved) else { return false };
                self.z = z;
            }
        }
        false
    }

    /// Damping ratio −Re s/|s|.
    #[must_use]
    pub fn damping(&self) -> f64 {
        damping(self.s)
    }

    /// Whether this is the same zero as another: equal s and parallel vectors.
    #[must_use]
    pub fn same(&self, other: &Self) -> bool {
        let near = |limit: f64| (self.s - other.s).norm() <= limit * self.s.norm().max(1e-3);
        if self.z.is_empty() || other.z.is_empty() {
            // a multiple zero that no force reaches counts as often as it occurs
            return near(0.0);
        }
        near(1e-7) && {
            let product: c64 = self.z.iter().zip(&other.z).map(|(a, b)| a.conj() * b).sum();
            product.norm() > 1.0 - 1e-4
        }
    }

    /// Shares of the plant, of the attached part and of the controllers in the mode: Σ |left · right| of their states,
    /// of sum 1. (The plant's are its own modal coordinates.)
    #[must_use]
    pub fn shares(&self, point: Point<'_>) -> [f64; 3] {
        let Point { space, level, controllers } = point;
        let gains = Gains::at(controllers, self.s, true);
        let (left, right) = space.plant_states(self.s, &gains, level, (&self.w, &self.z));
        let plant: f64 = left.iter().zip(&right).map(|(a, b)| (a * b).norm()).sum();
        let split = space.ports;
        let attached: f64 =
            self.w[split..].iter().zip(&self.z[split..]).map(|(a, b)| (a * b).norm()).sum();
        let seen = space.measured(self.s, level, &self.z);
        let mut control = 0.0;
        let pencil = |controller: &Controller| {
            let k = controller.a.nrows();
            let pencil = Mat::from_fn(k, k, |r, c| {
                let a = c64::new(-controller.a[(r, c)], 0.0);
                if r == c { self.s + a } else { a }
            });
            PartialPivLu::new(pencil.as_ref())
        };
        let mut factors: Option<PartialPivLu<c64>> = None;
        for j in 0..split {
            let controller = controllers.get(j);
            let k = controller.a.nrows();
            let factors = match factors.take() {
                Some(same) if matches!(controllers, Controllers::Equal(..)) => factors.insert(same),
                _ => factors.insert(pencil(controller)),
            };
            let driven = |r: usize| -> c64 {
                let of = |i: usize| seen[i * split + j] * controller.b[(r, i)];
                (0..space.channels).map(of).sum()
            };
            let b: Vec<c64> = (0..k).map(driven).collect();
            let c: Vec<c64> = controller.c.iter().map(|x| self.w[j] * *x).collect();
            let (x, y) = (solve(factors, &b), solve_transposed(factors, &c));
            control += x.iter().zip(&y).map(|(a, b)| (a * b).norm()).sum::<f64>();
        }
        let sum = plant + attached + control;
        [plant / sum, attached / sum, control / sum]
    }
}

/// −Re s/|s|, and 1 for s = 0.
#[must_use]
pub fn damping(s: c64) -> f64 {
    if s.norm() > 0.0 { -s.re / s.norm() } else { 0.0 }
}

pub(crate) fn norm(x: &[c64]) -> f64 {
    x.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt()
}

fn dot(a: &[c64], b: &[c64]) -> c64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn normal(mut x: Vec<c64>) -> Option<Vec<c64>> {
    let size = norm(&x);
    if !(size.is_finite() && size > 0.0) {
        return None;
    }
    x.iter_mut().for_each(|x| *x /= size);
    Some(x)
}

fn solve(factors: &PartialPivLu<c64>, x: &[c64]) -> Vec<c64> {
    let right = Mat::from_fn(x.len(), 1, |i, _| x[i]);
    let y = factors.solve(&right);
    (0..x.len()).map(|i| y[(i, 0)]).collect()
}

fn solve_transposed(factors: &PartialPivLu<c64>, x: &[c64]) -> Vec<c64> {
    let right = Mat::from_fn(x.len(), 1, |i, _| x[i]);
    let y = factors.solve_transpose(&right);
    (0..x.len()).map(|i| y[(i, 0)]).collect()
}
