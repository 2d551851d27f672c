//! The part of a transfer function that some ports see, with as few states as it needs.
//!
//! Of n equal poles with the residue R = Σ L M only as many count as R has rank (Gilbert 1963, "Controllability and
//! observability in multivariable control systems"). Blocks of nearly equal real poles, as those of a body that moves
//! freely, are reduced to what inputs reach and outputs show.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::error::TuneError;
use stability_map::MapError;

/// Poles closer than this fraction of their size are equal.
const SAME: f64 = 1e-7;
/// Directions of a small block below the root of the tolerance, but at least this, are not reached.
const REACHED: f64 = 1e-8;

/// Poles with their residues: y = Σ Re-parts of L (s − λ)⁻¹ M, a block, and D.
#[derive(Debug, Clone)]
pub(crate) struct Modes {
    pairs: Vec<(c64, Vec<c64>, Vec<c64>)>,
    reals: Vec<(f64, Vec<f64>, Vec<f64>)>,
    /// A, B, C.
    dense: Option<[Mat<f64>; 3]>,
    pub direct: Mat<f64>,
}

/// Consecutive rows of a block-diagonal matrix that belong together.
fn blocks(lambda: &Mat<f64>) -> Vec<Vec<usize>> {
    let n = lambda.nrows();
    let mut all: Vec<Vec<usize>> = Vec::new();
    let mut last = 0;
    for k in 0..n {
        let reaches = (k + 1..n).rev().find(|&j| lambda[(k, j)] != 0.0 || lambda[(j, k)] != 0.0);
        match all.last_mut() {
            Some(block) if k > 0 && k <= last => block.push(k),
            _ => all.push(vec![k]),
        }
        last = last.max(reaches.unwrap_or(0));
    }
    all
}

/// The largest residue of all poles.
pub(crate) fn scale(lambda: &Mat<f64>, b: &Mat<f64>, c: &Mat<f64>) -> f64 {
    let size = |block: &Vec<usize>| {
        let norm = |it: f64| it * it;
        let rows: f64 = block.iter().map(|&k| norm(b.row(k).norm_l2())).sum::<f64>();
        let columns: f64 = block.iter().map(|&k| norm(c.col(k).norm_l2())).sum::<f64>();
        (rows * columns).sqrt()
    };
    blocks(lambda).iter().map(size).fold(0.0, f64::max)
}

impl Modes {
    /// From a block-diagonal matrix with its inputs and outputs. Residues up to `nothing` are left out.
    pub fn new(
        lambda: &Mat<f64>,
        b: &Mat<f64>,
        c: &Mat<f64>,
        direct: Mat<f64>,
        nothing: f64,
    ) -> Result<Self, TuneError> {
        let (q, p) = (c.nrows(), b.ncols());
        let mut complex: Vec<(c64, Vec<usize>)> = Vec::new();
        let mut rest: Vec<usize> = Vec::new();
        let mut reals: Vec<(f64, Vec<usize>)> = Vec::new();
        for block in blocks(lambda) {
            match block.as_slice() {
                &[k] => {
                    let value = lambda[(k, k)];
                    match reals.iter_mut().find(|it| (it.0 - value).abs() <= SAME * value.abs()) {
                        Some(group) => group.1.push(k),
                        None => reals.push((value, vec![k])),
                    }
                }
                &[k, l]
                    if lambda[(k, k)] == lambda[(l, l)] && lambda[(k, l)] == -lambda[(l, k)] =>
                {
                    // z = x₁ + i x₂
                    let value = c64::new(lambda[(k, k)], -lambda[(k, l)]);
                    match complex.iter_mut().find(|it| (it.0 - value).norm() <= SAME * value.norm())
                    {
                        Some(group) => group.1.push(k),
                        None => complex.push((value, vec![k])),
                    }
                }
                all => rest.extend(all),
            }
        }
        let failed = |_| MapError::Eigenvalues { what: "the residues of the vehicle side" };
        let mut modes = Self { pairs: Vec::new(), reals: Vec::new(), dense: None, direct };
        for (value, group) in complex {
            // y = Re Σ L z, ż = λ z + M u
            let residue = Mat::from_fn(q, p, |i, j| {
                let term = |&k: &usize| {
                    c64::new(c[(i, k)], -c[(i, k + 1)]) * c64::new(b[(k, j)], b[(k + 1, j)])
                };
                group.iter().map(term).sum::<c64>()
            });
            if residue.norm_max() <= nothing {
                continue;
            }
            let svd = residue.thin_svd().map_err(failed)?;
            for r in 0..q.min(p) {
                let size = svd.S()[r].re;
                if size <= nothing {
                    break;
                }
                let left = (0..q).map(|i| svd.U()[(i, r)] * size.sqrt()).collect();
                let right = (0..p).map(|j| svd.V()[(j, r)].conj() * size.sqrt()).collect();
                modes.pairs.push((value, left, right));
            }
        }
        for (value, group) in reals {
            let term =
                |i: usize, j: usize| group.iter().map(|&k| c[(i, k)] * b[(k, j)]).sum::<f64>();
            let residue = Mat::from_fn(q, p, term);
            if residue.norm_max() <= nothing {
                continue;
            }
            let svd = residue.thin_svd().map_err(failed)?;
            for r in 0..q.min(p) {
                let size = svd.S()[r];
                if size <= nothing {
                    break;
                }
                let left = (0..q).map(|i| svd.U()[(i, r)] * size.sqrt()).collect();
                let right = (0..p).map(|j| svd.V()[(j, r)] * size.sqrt()).collect();
                modes.reals.push((value, left, right));
            }
        }
        if !rest.is_empty() {
            let m = rest.len();
            let a = Mat::from_fn(m, m, |i, j| lambda[(rest[i], rest[j])]);
            let b = Mat::from_fn(m, p, |i, j| b[(rest[i], j)]);
            let c = Mat::from_fn(q, m, |i, j| c[(i, rest[j])]);
            let [a, b, c] = reached([a, b, c], nothing);
            // what outputs show is what inputs of the transposed system reach
            let turned = [&a, &c, &b].map(|it| it.transpose().to_owned());
            let [a, c, b] = reached(turned, nothing).map(|it| it.transpose().to_owned());
            if a.nrows() > 0 {
                modes.dense = Some([a, b, c]);
            }
        }
        Ok(modes)
    }

    /// Number of states.
    pub fn len(&self) -> usize {
        2 * self.pairs.len() + self.reals.len() + self.dense.as_ref().map_or(0, |it| it[0].nrows())
    }

    /// A, B and C as real matrices.
    pub fn real(&self) -> [Mat<f64>; 3] {
        let (n, q, p) = (self.len(), self.direct.nrows(), self.direct.ncols());
        let (mut a, mut b, mut c) = (Mat::zeros(n, n), Mat::zeros(n, p), Mat::zeros(q, n));
        let mut k = 0;
        for (value, left, right) in &self.pairs {
            a[(k, k)] = value.re;
            a[(k, k + 1)] = -value.im;
            a[(k + 1, k)] = value.im;
            a[(k + 1, k + 1)] = value.re;
            for (j, m) in right.iter().enumerate() {
                (b[(k, j)], b[(k + 1, j)]) = (m.re, m.im);
            }
            for (i, l) in left.iter().enumerate() {
                (c[(i, k)], c[(i, k + 1)]) = (l.re, -l.im);
            }
            k += 2;
        }
        for (value, left, right) in &self.reals {
            a[(k, k)] = *value;
            right.iter().enumerate().for_each(|(j, m)| b[(k, j)] = *m);
            left.iter().enumerate().for_each(|(i, l)| c[(i, k)] = *l);
            k += 1;
        }
        if let Some([da, db, dc]) = &self.dense {
            let m = da.nrows();
            a.as_mut().submatrix_mut(k, k, m, m).copy_from(da);
            b.as_mut().submatrix_mut(k, 0, m, p).copy_from(db);
            c.as_mut().submatrix_mut(0, k, q, m).copy_from(dc);
        }
        [a, b, c]
    }

    /// The transfer function at a point.
    pub fn at(&self, s: c64) -> Mat<c64> {
        let (q, p) = (self.direct.nrows(), self.direct.ncols());
        let mut y = Mat::from_fn(q, p, |i, j| c64::new(self.direct[(i, j)], 0.0));
        for (value, left, right) in &self.pairs {
            // the mean of the pole's and its conjugate's part
            let (one, other) = (0.5 / (s - value), 0.5 / (s - value.conj()));
            for (j, m) in right.iter().enumerate() {
                let (a, b) = (m * one, m.conj() * other);
                for (i, l) in left.iter().enumerate() {
                    y[(i, j)] += l * a + l.conj() * b;
                }
            }
        }
        for (value, left, right) in &self.reals {
            let factor = (s - value).inv();
            for (j, m) in right.iter().enumerate() {
                for (i, l) in left.iter().enumerate() {
                    y[(i, j)] += factor * (l * m);
                }
            }
        }
        if let Some([a, b, c]) = &self.dense {
            let n = a.nrows();
            let pencil = Mat::from_fn(n, n, |i, j| {
                let value = c64::new(-a[(i, j)], 0.0);
                if i == j { s + value } else { value }
            });
            let right = Mat::from_fn(n, p, |i, j| c64::new(b[(i, j)], 0.0));
            let x = PartialPivLu::new(pencil.as_ref()).solve(&right);
            y += Mat::from_fn(q, n, |i, j| c64::new(c[(i, j)], 0.0)) * x;
        }
        y
    }
}

impl Modes {
    /// The answer to one vector of inputs.
    pub fn apply(&self, s: c64, u: &[c64]) -> Vec<c64> {
        let q = self.direct.nrows();
        let row = |i: usize| u.iter().enumerate().map(|(j, u)| *u * self.direct[(i, j)]).sum();
        let mut y: Vec<c64> = (0..q).map(row).collect();
        for (value, left, right) in &self.pairs {
            let (mut a, mut b) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
            for (m, u) in right.iter().zip(u) {
                a += m * u;
                b += m.conj() * u;
            }
            let (a, b) = (a * (0.5 / (s - value)), b * (0.5 / (s - value.conj())));
            y.iter_mut().zip(left).for_each(|(y, l)| *y += l * a + l.conj() * b);
        }
        for (value, left, right) in &self.reals {
            let a = right.iter().zip(u).map(|(m, u)| *u * *m).sum::<c64>() / (s - value);
            y.iter_mut().zip(left).for_each(|(y, l)| *y += a * *l);
        }
        if let Some([a, b, c]) = &self.dense {
            let n = a.nrows();
            let pencil = Mat::from_fn(n, n, |i, j| {
                let value = c64::new(-a[(i, j)], 0.0);
                if i == j { s + value } else { value }
            });
            let entry = |i: usize| u.iter().enumerate().map(|(j, u)| *u * b[(i, j)]).sum::<c64>();
            let right = Mat::from_fn(n, 1, |i, _| entry(i));
            let x = PartialPivLu::new(pencil.as_ref()).solve(&right);
            for (i, y) in y.iter_mut().enumerate() {
                *y += (0..n).map(|j| x[(j, 0)] * c[(i, j)]).sum::<c64>();
            }
        }
        y
    }
}

/// A, B, C of the states that inputs reach.
fn reached([a, b, c]: [Mat<f64>; 3], nothing: f64) -> [Mat<f64>; 3] {
    let n = a.nrows();
    let size = a.norm_l2().max(1e-300);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut waiting: Vec<Vec<f64>> =
        (0..b.ncols()).map(|j| (0..n).map(|i| b[(i, j)]).collect()).collect();
    let first = b.norm_l2();
    if first * c.norm_l2() <= nothing {
        return [Mat::zeros(0, 0), Mat::zeros(0, b.ncols()), Mat::zeros(c.nrows(), 0)];
    }
    let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    // an input direction counts if its residue could
    let mut limit = (REACHED * first).max(nothing / c.norm_l2());
    while !waiting.is_empty() && basis.len() < n {
        let mut fresh: Vec<Vec<f64>> = Vec::new();
        // the largest first, so that small ones are judged by what is left of them
        waiting.sort_by(|a, b| norm(b).total_cmp(&norm(a)));
        for mut x in std::mem::take(&mut waiting) {
            for _ in 0..2 {
                for v in basis.iter().chain(&fresh) {
                    let along: f64 = v.iter().zip(&x).map(|(v, x)| v * x).sum();
                    x.iter_mut().zip(v).for_each(|(x, v)| *x -= along * v);
                }
            }
            let rest = norm(&x);
            if rest > limit && basis.len() + fresh.len() < n {
                x.iter_mut().for_each(|x| *x /= rest);
                fresh.push(x);
            }
        }
        for x in &fresh {
            waiting.push((0..n).map(|i| (0..n).map(|j| a[(i, j)] * x[j]).sum()).collect());
        }
        basis.extend(fresh);
        limit = REACHED * size;
    }
    let v = Mat::from_fn(n, basis.len(), |i, j| basis[j][i]);
    [v.transpose() * &a * &v, v.transpose() * b, c * v]
}
