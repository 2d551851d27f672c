//! The determinant at one point of the boundary, for any controllers and attached parts.

use std::sync::Arc;

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

/// A measurement's response, with the eigenvectors of the first one's.
#[derive(Debug)]
struct Channel {
    /// Diagonal of T⁻¹ Vᵢ T.
    d: Vec<c64>,
    /// For each row of Z and column of Y, one number per coupled eigenvalue; empty if the attached part does not reach
    /// the measurement.
    products: Vec<c64>,
}

/// The response with its eigenvalues: V₁ = T diag(d) T⁻¹; Vᵢ has the same eigenvectors but for the misfit.
#[derive(Debug)]
struct Diagonal {
    d: Vec<c64>,
    /// Eigenvalues through which the attached part is reached.
    coupled: Vec<usize>,
    channels: Vec<Channel>,
    /// From Y to Z directly.
    across: Mat<c64>,
}

#[derive(Debug)]
enum Kind {
    Diagonal(Diagonal),
    Whole(Mat<c64>),
}

/// A point s of the boundary.
#[derive(Debug)]
pub(crate) struct Node {
    pub t: f64,
    pub s: c64,
    /// Π (s − λ)/(s + aλ) over the plant's poles inside the region.
    poles: c64,
    kind: Kind,
    /// Largest relative part of a response that is not proportional to the first one's.
    pub misfit: f64,
}

/// A node with its factors in the order of the neighbouring nodes.
#[derive(Debug)]
pub(crate) struct Placed {
    pub node: Arc<Node>,
    order: Vec<usize>,
}

/// The parts of a system of which a determinant is made.
#[derive(Clone, Copy)]
pub(crate) struct Made<'a> {
    pub space: &'a Space,
    pub level: &'a Level,
    pub controllers: &'a Controllers,
    pub rational: Option<&'a Rational>,
    pub anchor: f64,
}

/// Memory that is used again from node to node.
#[derive(Default)]
pub(crate) struct Scratch {
    gains: Vec<c64>,
    inverse: Vec<c64>,
    inner: Vec<c64>,
    half: Vec<c64>,
    schur: Vec<c64>,
}

/// det N Π (s − λ) over the plant's poles in the region, as a product.
pub(crate) struct Product {
    /// The eigenvalues of I − Σ kᵢ Vᵢ.
    pub factors: Vec<c64>,
    /// What is left, up to a positive factor and to powers of s + a, a > 0, that keep it finite.
    pub rest: c64,
    /// The denominator of the controllers' transfer functions, if it is known.
    pub denominator: Option<c64>,
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

    fn values(&self) -> &[c64] {
        match &self.kind {
            Kind::Diagonal(diagonal) => &diagonal.d,
            Kind::Whole(_) => &[],
        }
    }
}

impl Placed {
    /// The first node of a boundary: any order.
    pub fn first(node: Arc<Node>) -> Self {
        Self { order: (0..node.values().len()).collect(), node }
    }

    /// A node with its factors in the order of a neighbour's, each next to the nearest.
    pub fn beside(node: Arc<Node>, neighbour: &Self) -> Self {
        let all = neighbour.node.values();
        let left: Vec<c64> = neighbour.order.iter().map(|&k| all[k]).collect();
        let mut order = vec![0; left.len()];
        nearest_pairs(&left, node.values()).into_iter().for_each(|(i, k)| order[i] = k);
        Self { node, order }
    }

    /// Whether another one has the same order.
    pub fn like(&self, other: &Self) -> bool {
        self.order == other.order
    }

    /// The determinant of a system at this node.
    pub fn determinant(&self, of: Made<'_>, scratch: &mut Scratch) -> Product {
        let (node, mut factors, mut denominator) = (&self.node, Vec::new(), None);
        let rest = match &node.kind {
            Kind::Diagonal(diagonal) => {
                scratch.gains.clear();
                match of.rational {
                    Some(rational) => {
                        denominator = Some(rational.at(node.s, &mut scratch.gains));
                    }
                    None => {
                        let gains = Gains::at(of.controllers, node.s, false);
                        scratch.gains.extend((0..of.space.channels).map(|i| gains.of(i, 0)));
                    }
                }
                diagonal.determinant(node.s, of.level, &self.order, &mut factors, scratch)
            }
            Kind::Whole(response) => {
                let gains = Gains::at(of.controllers, node.s, false);
                let n = of.space.matrix(node.s, &gains, of.level, response);
                let mut rows: Vec<c64> = Vec::with_capacity(n.nrows() * n.ncols());
                (0..n.nrows()).for_each(|i| rows.extend((0..n.ncols()).map(|j| n[(i, j)])));
                determinant(&mut rows, n.nrows())
            }
        };
        let scale = (node.s + of.anchor).inv();
        let attached = (0..of.level.a.nrows()).fold(ONE, |product, _| {
            let next = product * scale;
            next / next.l1_norm()
        });
        Product { factors, rest: rest * node.poles * attached, denominator }
    }
}

/// Pairs (i, k) of equally many values on both sides, each with the nearest that is left; those with the nearest partner
/// come first.
pub(crate) fn nearest_pairs(left: &[c64], right: &[c64]) -> Vec<(usize, usize)> {
    let n = left.len().min(right.len());
    let mut taken = vec![false; n];
    let nearest = |i: usize, taken: &[bool]| {
        let free = (0..n).filter(|&k| !taken[k]);
        free.fold((0, f64::INFINITY), |best, k| {
            let distance = (left[i] - right[k]).norm_sqr();
            if distance < best.1 { (k, distance) } else { best }
        })
    };
    let mut wanted: Vec<(usize, usize, f64)> = (0..n)
        .map(|i| {
            let (k, distance) = nearest(i, &taken);
            (i, k, distance)
        })
        .collect();
    wanted.sort_unstable_by(|a, b| a.2.total_cmp(&b.2));
    let mut pairs = Vec::with_capacity(n);
    for (i, k, _) in wanted {
        let k = if taken[k] { nearest(i, &taken).0 } else { k };
        taken[k] = true;
        pairs.push((i, k));
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
            let empty = Self { d: vec![], coupled: vec![], channels: vec![], across };
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
        let mut diagonals: Vec<Vec<c64>> = Vec::new();
        let mut products: Vec<Option<Mat<c64>>> = Vec::new();
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
            // what is not proportional counts to first order
            let turned = if size > 0.0 { block(i).to_owned() * &t } else { Mat::zeros(p, p) };
            let turned = factors.solve(&turned);
            diagonals.push((0..p).map(|k| turned[(k, k)]).collect());
            let reach = reached(i).to_owned();
            let any = reach.norm_max() > NOTHING * largest_reach && space.columns > 0;
            products.push(any.then(|| {
                let x = factors.solve(&reach);
                // a row per place, a column per eigenvalue
                Mat::from_fn(space.rows * space.columns, p, |place, k| {
                    j[(place / space.columns, k)] * x[(k, place % space.columns)]
                })
            }));
        }
        let size = |m: &Mat<c64>, k: usize| m.col(k).norm_max();
        let of = |k: usize| products.iter().flatten().map(|m| size(m, k)).fold(0.0, f64::max);
        let largest = (0..p).map(of).fold(0.0, f64::max);
        let coupled: Vec<usize> = (0..p).filter(|&k| of(k) > NOTHING * largest).collect();
        let channels = diagonals
            .into_iter()
            .zip(&products)
            .map(|(d, products)| Channel {
                d,
                products: products.as_ref().map_or_else(Vec::new, |m| {
                    let row = |place: usize| coupled.iter().map(move |&k| m[(place, k)]);
                    (0..m.nrows()).flat_map(row).collect()
                }),
            })
            .collect();
        Ok((Self { d, coupled, channels, across }, misfit))
    }

    /// The eigenvalues of I − Σ kᵢ Vᵢ in that order, and the determinant of what is attached.
    fn determinant(
        &self,
        s: c64,
        level: &Level,
        order: &[usize],
        factors: &mut Vec<c64>,
        scratch: &mut Scratch,
    ) -> c64 {
        let Scratch { gains, inverse, inner, half, schur } = scratch;
        let w = |k: usize| -> c64 {
            ONE - self.channels.iter().zip(&*gains).map(|(it, gain)| it.d[k] * gain).sum::<c64>()
        };
        factors.extend(order.iter().map(|&k| w(k)));
        let g = level.a.nrows();
        if g == 0 {
            return ONE;
        }
        inverse.clear();
        inverse.extend(self.coupled.iter().map(|&k| {
            let w = w(k);
            w.conj() * (1.0 / w.norm_sqr())
        }));
        let (rows, columns) = (self.across.nrows(), self.across.ncols());
        inner.clear();
        inner.extend((0..rows * columns).map(|k| self.across[(k / columns, k % columns)]));
        let m = inverse.len();
        for (channel, &k) in self.channels.iter().zip(&*gains) {
            if m == 0 {
                break;
            }
            for (inner, products) in inner.iter_mut().zip(channel.products.chunks_exact(m)) {
                *inner += k * inverse.iter().zip(products).map(|(w, p)| w * p).sum::<c64>();
            }
        }
        // inner γ, then sI − A − β inner γ
        half.clear();
        half.extend((0..rows * g).map(|k| -> c64 {
            let (a, c) = (k / g, k % g);
            (0..columns).map(|b| inner[a * columns + b] * level.gamma[(b, c)]).sum()
        }));
        schur.clear();
        schur.extend((0..g * g).map(|k| {
            let (r, c) = (k / g, k % g);
            let by: c64 = (0..rows).map(|a| half[a * g + c] * level.beta[(r, a)]).sum();
            (if r == c { s } else { ZERO }) - level.a[(r, c)] - by
        }));
        determinant(schur, g)
    }
}

/// The determinant of a matrix by rows, by elimination with pivots, divided by its size.
fn determinant(m: &mut [c64], n: usize) -> c64 {
    let mut product = ONE;
    for k in 0..n {
        let size = |i: usize| m[i * n + k].l1_norm();
        let pivot = (k..n).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(k);
        if pivot != k {
            (k..n).for_each(|j| m.swap(k * n + j, pivot * n + j));
            product = -product;
        }
        let head = m[k * n + k];
        if head == ZERO {
            return ZERO;
        }
        product *= head;
        product /= product.l1_norm();
        let inverse = head.inv();
        let (above, below) = m.split_at_mut((k + 1) * n);
        let above = &above[k * n..];
        for row in below.chunks_exact_mut(n) {
            let factor = row[k] * inverse;
            for j in k + 1..n {
                row[j] -= factor * above[j];
            }
        }
    }
    product
}
