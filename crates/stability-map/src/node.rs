//! The determinant at one point of the boundary, for any controllers and attached parts.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::error::MapError;
use crate::gains::Gains;
use crate::space::{Level, Space};
use crate::system::Controllers;

/// Eigenvalues of the response below this fraction of the largest are zero.
const NOTHING: f64 = 1e-12;

const ZERO: c64 = c64::new(0.0, 0.0);
const ONE: c64 = c64::new(1.0, 0.0);

/// Σᵢ wᵢ pᵢ, by parts.
#[derive(Debug, Clone, Default)]
struct Products {
    re: Vec<f64>,
    im: Vec<f64>,
    /// Sum of those with weight 1.
    rest: c64,
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

    /// det N Π (s − λ) with the plant's poles in the region, up to a positive factor and to powers of s + a, a > 0, that
    /// keep it finite.
    pub fn determinant(
        &self,
        space: &Space,
        level: &Level,
        controllers: &Controllers,
        anchor: f64,
    ) -> c64 {
        let gains = Gains::at(controllers, self.s, false);
        let raw = match &self.kind {
            Kind::Diagonal(diagonal) => diagonal.determinant(self.s, &gains, level),
            Kind::Whole(response) => determinant(space.matrix(self.s, &gains, level, response)),
        };
        let scale = (self.s + anchor).inv();
        let attached = (0..level.a.nrows()).fold(ONE, |product, _| {
            let next = product * scale;
            next / next.l1_norm()
        });
        raw * self.poles * attached
    }
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
        let largest = d.iter().map(|d| d.norm()).fold(0.0, f64::max);
        let (live, dead): (Vec<usize>, Vec<usize>) =
            (0..p).partition(|&k| d[k].norm() > NOTHING * largest);
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
                        let of = |&k: &usize| j[(a, k)] * x[(k, b)];
                        products.push(Products {
                            re: live.iter().map(|k| of(k).re).collect(),
                            im: live.iter().map(|k| of(k).im).collect(),
                            rest: dead.iter().map(of).sum(),
                        });
                    }
                }
            }
            channels.push(Channel { ratio, products });
        }
        let (re, im) = live.iter().map(|&k| (d[k].re, d[k].im)).unzip();
        Ok((Self { re, im, channels, across }, misfit))
    }

    fn determinant(&self, s: c64, gains: &Gains, level: &Level) -> c64 {
        let alpha: c64 =
            self.channels.iter().enumerate().map(|(i, it)| gains.of(i, 0) * it.ratio).sum();
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
        let mut product = ONE;
        for k in 0..n {
            product *= c64::new(w_re[k], w_im[k]);
            if k % 8 == 7 {
                product /= product.l1_norm();
            }
        }
        product /= product.l1_norm();
        for k in 0..n {
            let inverse = 1.0 / (w_re[k] * w_re[k] + w_im[k] * w_im[k]);
            w_re[k] *= inverse;
            w_im[k] *= -inverse;
        }
        let g = level.a.nrows();
        if g == 0 {
            return product;
        }
        let (rows, columns) = (self.across.nrows(), self.across.ncols());
        let mut inner = self.across.clone();
        for (i, channel) in self.channels.iter().enumerate() {
            let k = gains.of(i, 0);
            for (place, p) in channel.products.iter().enumerate() {
                let (mut re, mut im) = (0.0, 0.0);
                for q in 0..n {
                    re += w_re[q] * p.re[q] - w_im[q] * p.im[q];
                    im += w_re[q] * p.im[q] + w_im[q] * p.re[q];
                }
                inner[(place / columns, place % columns)] += k * (c64::new(re, im) + p.rest);
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
        product * determinant(schur)
    }
}

/// Numbers that fit on the stack.
const MOST: usize = 256;

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
