//! The determinant at one point of the boundary, for any controllers and attached parts.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::error::MapError;
use crate::gains::{Gains, Rational};
use crate::space::{Level, Space};
use crate::system::Controllers;

/// A response below this fraction of the largest is zero.
const NOTHING: f64 = 1e-12;

const ZERO: c64 = c64::new(0.0, 0.0);
const ONE: c64 = c64::new(1.0, 0.0);

/// Σᵢ wᵢ pᵢ, by parts.
#[derive(Debug, Clone, Default)]
struct Products {
    re: Vec<f64>,
    im: Vec<f64>,
}

/// A measurement's response relative to the first one's.
#[derive(Debug, Clone)]
struct Channel {
    ratio: c64,
    /// By rows of Z and columns of Y; empty if the attached part does not reach the measurement.
    products: Vec<Products>,
}

/// The response with its eigenvalues: V₁ = T diag(d) T⁻¹, Vᵢ = ratioᵢ V₁.
#[derive(Debug, Clone)]
struct Diagonal {
    re: Vec<f64>,
    im: Vec<f64>,
    channels: Vec<Channel>,
    /// From Y to Z directly.
    across: Mat<c64>,
}

#[derive(Debug, Clone)]
enum Kind {
    Diagonal(Diagonal),
    Whole(Mat<c64>),
}

/// A point s of the boundary.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub t: f64,
    pub s: c64,
    /// Π (s − λ)/(s + aλ) over the plant's poles inside the region.
    poles: c64,
    kind: Kind,
    /// Largest relative part of a response that is not proportional to the first one's.
    pub misfit: f64,
}

impl Node {
    /// `poles` are those of the plant inside the region. `equal`: all controllers are equal.
    pub fn new(
        space: &Space,
        (t, s): (f64, c64),
        poles: &[c64],
        anchor: f64,
        equal: bool,
    ) -> Result<Self, MapError> {
        let response = space.response(s);
        let poles = poles.iter().map(|&pole| (s - pole) / (s + pole.norm().max(anchor))).product();
        let (kind, misfit) = if equal {
            let (diagonal, misfit) = Diagonal::new(space, &response)?;
            (Kind::Diagonal(diagonal), misfit)
        } else {
            (Kind::Whole(response), 0.0)
        };
        Ok(Self { t, s, poles, kind, misfit })
    }

    /// det N Π (s − λ) over the plant's poles in the region, as a product: the eigenvalues of I − Σ kᵢ Vᵢ are appended
    /// to `factors`, in the order of the neighbouring nodes; the rest is returned, up to a positive factor and to powers
    /// of s + a, a > 0, that keep it finite.
    pub fn determinant(
        &self,
        space: &Space,
        level: &Level,
        (controllers, rational): (&Controllers, Option<&Rational>),
        anchor: f64,
        factors: &mut Vec<c64>,
    ) -> c64 {
        let rest = match &self.kind {
            Kind::Diagonal(diagonal) => {
                let gains: Vec<c64> = match rational {
                    Some(rational) => rational.at(self.s),
                    None => {
                        let gains = Gains::at(controllers, self.s, false);
                        (0..space.channels).map(|i| gains.of(i, 0)).collect()
                    }
                };
                diagonal.determinant(self.s, &gains, level, factors)
            }
            Kind::Whole(response) => {
                let gains = Gains::at(controllers, self.s, false);
                determinant(space.matrix(self.s, &gains, level, response))
            }
        };
        let scale = (self.s + anchor).inv();
        let attached = (0..level.a.nrows()).fold(ONE, |product, _| {
            let next = product * scale;
            next / next.l1_norm()
        });
        rest * self.poles * attached
    }

    /// Number of factors.
    pub fn factors(&self) -> usize {
        match &self.kind {
            Kind::Diagonal(diagonal) => diagonal.re.len(),
            Kind::Whole(_) => 0,
        }
    }

    /// Puts the eigenvalues of the response in the order of those of a neighbour, each next to the nearest. Whether that
    /// changed their order.
    pub fn follow(&mut self, neighbour: &Self) -> bool {
        let (Kind::Diagonal(mine), Kind::Diagonal(other)) = (&mut self.kind, &neighbour.kind)
        else {
            return false;
        };
        let values = |it: &Diagonal| -> Vec<c64> {
            it.re.iter().zip(&it.im).map(|(re, im)| c64::new(*re, *im)).collect()
        };
        let pairs = nearest_pairs(&values(other), &values(mine));
        if pairs.iter().all(|(i, k)| i == k) {
            return false;
        }
        let mut order = vec![0; mine.re.len()];
        pairs.into_iter().for_each(|(i, k)| order[i] = k);
        let sorted = |list: &[f64]| -> Vec<f64> { order.iter().map(|&k| list[k]).collect() };
        (mine.re, mine.im) = (sorted(&mine.re), sorted(&mine.im));
        for products in mine.channels.iter_mut().flat_map(|it| &mut it.products) {
            (products.re, products.im) = (sorted(&products.re), sorted(&products.im));
        }
        true
    }
}

/// Pairs (i, k) of equally many values on both sides, the nearest first.
pub(crate) fn nearest_pairs(left: &[c64], right: &[c64]) -> Vec<(usize, usize)> {
    let n = left.len().min(right.len());
    let mut all: Vec<(f64, usize, usize)> = (0..n)
        .flat_map(|i| (0..n).map(move |k| (i, k)))
        .map(|(i, k)| ((left[i] - right[k]).norm(), i, k))
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut used, mut taken) = (vec![false; n], vec![false; n]);
    let mut pairs = Vec::with_capacity(n);
    for (_, i, k) in all {
        if !used[i] && !taken[k] {
            (used[i], taken[k]) = (true, true);
            pairs.push((i, k));
        }
    }
    pairs
}

impl Diagonal {
    fn new(space: &Space, response: &Mat<c64>) -> Result<(Self, f64), MapError> {
        let p = space.ports;
        let block = |i: usize| response.submatrix(i * p, 0, p, p);
        let reached = |i: usize| response.submatrix(i * p, p, p, space.columns);
        let bottom = response.submatrix(space.channels * p, 0, space.rows, p);
        let across =
            response.submatrix(space.channels * p, p, space.rows, space.columns).to_owned();
        let first = (0..space.channels).find(|&i| block(i).norm_max() > 0.0).unwrap_or(0);
        if space.channels == 0 || p == 0 {
            let empty = Self { re: vec![], im: vec![], channels: vec![], across };
            return Ok((empty, 0.0));
        }
        let reference = block(first);
        let product = |a: usize| -> c64 {
            let (x, y) = (reference, block(a));
            (0..p).flat_map(|j| (0..p).map(move |i| x[(i, j)].conj() * y[(i, j)])).sum()
        };
        let square = product(first);
        let failed = |_| MapError::Eigenvalues { what: "the plant's response" };
        let eigen = reference.to_owned().eigen().map_err(failed)?;
        let t = eigen.U().to_owned();
        let factors = PartialPivLu::new(t.as_ref());
        let d: Vec<c64> = (0..p).map(|k| eigen.S()[k]).collect();
        let j = bottom.to_owned() * &t;
        let largest_reach = (0..space.channels).map(|i| reached(i).norm_max()).fold(0.0, f64::max);
        let mut misfit: f64 = 0.0;
        let mut channels = Vec::new();
        for i in 0..space.channels {
            let ratio = if square == ZERO { ZERO } else { product(i) / square };
            let size = block(i).norm_max();
            if size > 0.0 {
                let rest = (0..p).flat_map(|c| (0..p).map(move |r| (r, c)));
                let off = rest
                    .map(|(r, c)| (block(i)[(r, c)] - ratio * reference[(r, c)]).norm())
                    .fold(0.0, f64::max);
                misfit = misfit.max(off / size);
            }
            let reach = reached(i).to_owned();
            let mut products = Vec::new();
            if reach.norm_max() > NOTHING * largest_reach && space.columns > 0 {
                let x = factors.solve(&reach);
                for a in 0..space.rows {
                    for b in 0..space.columns {
                        let of = |k: usize| j[(a, k)] * x[(k, b)];
                        products.push(Products {
                            re: (0..p).map(|k| of(k).re).collect(),
                            im: (0..p).map(|k| of(k).im).collect(),
                        });
                    }
                }
            }
            channels.push(Channel { ratio, products });
        }
        let (re, im) = d.iter().map(|d| (d.re, d.im)).unzip();
        Ok((Self { re, im, channels, across }, misfit))
    }

    fn determinant(&self, s: c64, gains: &[c64], level: &Level, factors: &mut Vec<c64>) -> c64 {
        let alpha: c64 =
            self.channels.iter().zip(gains).map(|(channel, k)| channel.ratio * k).sum();
        let n = self.re.len();
        let (mut w_re, mut w_im) = ([0.0; MOST], [0.0; MOST]);
        let mut spilled: (Vec<f64>, Vec<f64>);
        let (w_re, w_im): (&mut [f64], &mut [f64]) = if n <= MOST {
            (&mut w_re[..n], &mut w_im[..n])
        } else {
            spilled = (vec![0.0; n], vec![0.0; n]);
            (&mut spilled.0, &mut spilled.1)
        };
        for k in 0..n {
            w_re[k] = 1.0 - (alpha.re * self.re[k] - alpha.im * self.im[k]);
            w_im[k] = -(alpha.re * self.im[k] + alpha.im * self.re[k]);
        }
        factors.extend(w_re.iter().zip(&*w_im).map(|(re, im)| c64::new(*re, *im)));
        for k in 0..n {
            let inverse = 1.0 / (w_re[k] * w_re[k] + w_im[k] * w_im[k]);
            w_re[k] *= inverse;
            w_im[k] *= -inverse;
        }
        let g = level.a.nrows();
        if g == 0 {
            return ONE;
        }
        let (rows, columns) = (self.across.nrows(), self.across.ncols());
        let mut inner = self.across.clone();
        for (i, channel) in self.channels.iter().enumerate() {
            let k = gains[i];
            for (place, p) in channel.products.iter().enumerate() {
                let (mut re, mut im) = (0.0, 0.0);
                for q in 0..n {
                    re += w_re[q] * p.re[q] - w_im[q] * p.im[q];
                    im += w_re[q] * p.im[q] + w_im[q] * p.re[q];
                }
                inner[(place / columns, place % columns)] += k * c64::new(re, im);
            }
        }
        // sI − A − β inner γ
        let schur = Mat::from_fn(g, g, |r, c| {
            let mut sum = if r == c { s } else { ZERO } - level.a[(r, c)];
            for a in 0..rows {
                for b in 0..columns {
                    sum -= inner[(a, b)] * (level.beta[(r, a)] * level.gamma[(b, c)]);
                }
            }
            sum
        });
        determinant(schur)
    }
}

/// Numbers that fit on the stack.
const MOST: usize = 64;

/// A determinant by elimination with pivots, divided by its size.
fn determinant(mut m: Mat<c64>) -> c64 {
    let n = m.nrows();
    let mut product = ONE;
    for k in 0..n {
        let size = |i: usize| m[(i, k)].l1_norm();
        let pivot = (k..n).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(k);
        if pivot != k {
            for j in k..n {
                let swapped = m[(k, j)];
                m[(k, j)] = m[(pivot, j)];
                m[(pivot, j)] = swapped;
            }
            product = -product;
        }
        let head = m[(k, k)];
        if head == ZERO {
            return ZERO;
        }
        product *= head;
        product /= product.l1_norm();
        let inverse = head.inv();
        for i in k + 1..n {
            let factor = m[(i, k)] * inverse;
            m[(i, k)] = factor;
        }
        for j in k + 1..n {
            let above = m[(k, j)];
            for i in k + 1..n {
                let factor = m[(i, k)];
                m[(i, j)] -= factor * above;
            }
        }
    }
    product
}
