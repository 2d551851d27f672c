//! A matrix by its eigenvalues, in real coordinates: a resolvent costs as many divisions as it has rows.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::elimination::solve;
use crate::error::MapError;

/// Largest relative error of the response at the check.
const LARGEST_ERROR: f64 = 1e-7;

/// Real eigenvalues closer than this fraction of the largest share a block: their eigenvectors may be parallel, as
/// those of a body that moves freely.
const CLUSTER: f64 = 1e-6;
/// Largest number of sweeps of the balancing.
const SWEEPS: usize = 20;
/// Iterations for the basis of a block, each of which gains two digits.
const BASIS_ITERATIONS: usize = 10;

/// A diagonal entry λ, a block of two rows [[a, b], [−b, a]] for a pair a ± bi, or a small block.
#[derive(Debug, Clone)]
enum Block {
    Real(f64),
    Pair(f64, f64),
    Dense(Mat<f64>, Vec<c64>),
}

/// A = X Λ X⁻¹ with a real X and blocks Λ.
#[derive(Debug, Clone)]
pub struct Modal {
    blocks: Vec<Block>,
    /// X.
    basis: Mat<f64>,
    factors: PartialPivLu<f64>,
}

impl Modal {
    /// Decomposes a matrix.
    ///
    /// # Errors
    /// The eigenvalues do not converge, or the eigenvectors are too close to parallel for responses from them.
    pub fn new(a: &Mat<f64>) -> Result<Self, MapError> {
        let n = a.nrows();
        if n == 0 {
            let basis = Mat::zeros(0, 0);
            let factors = PartialPivLu::new(basis.as_ref());
            return Ok(Self { blocks: Vec::new(), basis, factors });
        }
        let (balanced, scale) = balanced(a);
        // complex arithmetic: the real one of faer 0.24 leaves residuals of 1e-3 where eigenvalues nearly coincide
        let complex = Mat::from_fn(n, n, |i, j| c64::new(balanced[(i, j)], 0.0));
        let failed = |_| MapError::Eigenvalues { what: "the vehicle side of the loop" };
        let eigen = complex.eigen().map_err(failed)?;
        let (mut blocks, mut basis, mut next) = (Vec::new(), Mat::zeros(n, n), 0);
        let values: Vec<c64> = (0..n).map(|k| eigen.S()[k]).collect();
        let reach = CLUSTER * values.iter().map(|it| it.norm()).fold(0.0, f64::max);
        let mut clustered = vec![false; n];
        for cluster in clusters(&values, reach) {
            cluster.iter().for_each(|&k| clustered[k] = true);
            let (block, columns) = dense(&balanced, &values, &cluster)?;
            basis.as_mut().submatrix_mut(0, next, n, columns.ncols()).copy_from(&columns);
            next += columns.ncols();
            blocks.push(block);
        }
        for k in (0..n).filter(|&k| !clustered[k]) {
            let value = values[k];
            let column = eigen.U().col(k);
            let largest = (0..n).map(|i| column[i]).max_by(|a, b| a.norm().total_cmp(&b.norm()));
            let turn = largest.map_or(c64::new(1.0, 0.0), |it| it.conj() / it.norm());
            let real = value.im.abs() <= reach;
            let width = if real { 1 } else { 2 };
            if (value.im < 0.0 && !real) || next + width > n {
                continue;
            }
            blocks.push(if real { Block::Real(value.re) } else { Block::Pair(value.re, value.im) });
            for i in 0..n {
                let x = column[i] * turn;
                basis[(i, next)] = x.re;
                if !real {
                    basis[(i, next + 1)] = x.im;
                }
            }
            next += width;
        }
        if next < n {
            return Err(MapError::Defective { error: 1.0 });
        }
        for i in 0..n {
            for j in 0..n {
                basis[(i, j)] *= scale[i];
            }
        }
        let factors = PartialPivLu::new(basis.as_ref());
        let modal = Self { blocks, basis, factors };
        modal.check(a)?;
        Ok(modal)
    }

    /// Compares (sI − A) X (sI − Λ)⁻¹ X⁻¹ b with b at a frequency among the eigenvalues.
    fn check(&self, a: &Mat<f64>) -> Result<(), MapError> {
        let n = a.nrows();
        let mut sizes: Vec<f64> = self.poles().map(|pole| pole.norm()).collect();
        sizes.sort_by(f64::total_cmp);
        let s = c64::new(0.0, sizes[n / 2].max(1e-3));
        let b = Mat::from_fn(n, 1, |i, _| ((i * i) as f64 * 0.7).sin());
        let coordinates = self.factors.solve(&b);
        let mut h: Vec<c64> = (0..n).map(|i| c64::new(coordinates[(i, 0)], 0.0)).collect();
        self.resolve(s, &mut h);
        let part = |f: &dyn Fn(c64) -> f64| Mat::from_fn(n, 1, |i, _| f(h[i]));
        let (re, im) = (&self.basis * part(&|x| x.re), &self.basis * part(&|x| x.im));
        let (a_re, a_im) = (a * &re, a * &im);
        let (mut error, mut size) = (0.0_f64, 0.0_f64);
        for i in 0..n {
            let x = c64::new(re[(i, 0)], im[(i, 0)]);
            let ax = c64::new(a_re[(i, 0)], a_im[(i, 0)]);
            error = error.max((s * x - ax - b[(i, 0)]).norm());
            size = size.max((s * x).norm()).max(ax.norm()).max(1.0);
        }
        let error = error / size;
        if error.is_finite() && error < LARGEST_ERROR {
            return Ok(());
        }
        Err(MapError::Defective { error })
    }

    /// Number of states.
    #[must_use]
    pub fn len(&self) -> usize {
        self.basis.nrows()
    }

    /// Whether there are no states.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All eigenvalues.
    pub fn poles(&self) -> impl Iterator<Item = c64> + '_ {
        self.blocks.iter().flat_map(|block| match block {
            Block::Real(a) => vec![c64::new(*a, 0.0)],
            Block::Pair(a, b) => vec![c64::new(*a, *b), c64::new(*a, -b)],
            Block::Dense(_, values) => values.clone(),
        })
    }

    /// Λ.
    #[must_use]
    pub fn matrix(&self) -> Mat<f64> {
        let mut all = Mat::zeros(self.len(), self.len());
        let mut k = 0;
        for block in &self.blocks {
            match block {
                Block::Real(a) => all[(k, k)] = *a,
                Block::Pair(a, b) => {
                    all[(k, k)] = *a;
                    all[(k, k + 1)] = *b;
                    all[(k + 1, k)] = -b;
                    all[(k + 1, k + 1)] = *a;
                }
                Block::Dense(t, _) => {
                    all.as_mut().submatrix_mut(k, k, t.nrows(), t.nrows()).copy_from(t);
                }
            }
            k += block.len();
        }
        all
    }

    /// X⁻¹ B.
    #[must_use]
    pub fn inputs(&self, b: &Mat<f64>) -> Mat<f64> {
        self.factors.solve(b)
    }

    /// C X.
    #[must_use]
    pub fn outputs(&self, c: &Mat<f64>) -> Mat<f64> {
        c * &self.basis
    }

    /// h ← (sI − Λ)⁻¹ h.
    #[inline]
    pub fn resolve(&self, s: c64, h: &mut [c64]) {
        self.blocks(s, h, 1.0);
    }

    /// h ← (sI − Λᵀ)⁻¹ h.
    #[inline]
    pub fn resolve_transposed(&self, s: c64, h: &mut [c64]) {
        self.blocks(s, h, -1.0);
    }

    #[inline]
    fn blocks(&self, s: c64, h: &mut [c64], sign: f64) {
        let mut k = 0;
        for block in &self.blocks {
            match block {
                Block::Real(a) => h[k] /= s - a,
                Block::Pair(a, b) => {
                    let (t, b) = (s - a, sign * b);
                    let inverse = (t * t + b * b).inv();
                    let (first, second) = (h[k], h[k + 1]);
                    h[k] = (t * first + second * b) * inverse;
                    h[k + 1] = (t * second - first * b) * inverse;
                }
                Block::Dense(t, _) => {
                    let h = &mut h[k..k + t.nrows()];
                    let pencil = |i: usize, j: usize| {
                        let entry = if sign > 0.0 { t[(i, j)] } else { t[(j, i)] };
                        if i == j { s - entry } else { c64::new(-entry, 0.0) }
                    };
                    let size = h.len();
                    let mut rows: Vec<c64> =
                        (0..size * size).map(|k| pencil(k / size, k % size)).collect();
                    solve(&mut rows, h);
                }
            }
            k += block.len();
        }
    }
}

impl Block {
    fn len(&self) -> usize {
        match self {
            Self::Real(_) => 1,
            Self::Pair(..) => 2,
            Self::Dense(t, _) => t.nrows(),
        }
    }
}

/// Groups of two or more real eigenvalues that are nearly equal.
fn clusters(values: &[c64], reach: f64) -> Vec<Vec<usize>> {
    let mut real: Vec<usize> = (0..values.len()).filter(|&k| values[k].im.abs() <= reach).collect();
    real.sort_by(|&i, &j| values[i].re.total_cmp(&values[j].re));
    let mut all: Vec<Vec<usize>> = Vec::new();
    for k in real {
        match all.last_mut() {
            Some(last) if last.last().is_some_and(|&it| values[k].re - values[it].re <= reach) => {
                last.push(k);
            }
            _ => all.push(vec![k]),
        }
    }
    all.retain(|cluster| cluster.len() > 1);
    all
}

/// The block of a cluster and an orthonormal basis of its invariant subspace, by inverse iteration.
fn dense(a: &Mat<f64>, values: &[c64], cluster: &[usize]) -> Result<(Block, Mat<f64>), MapError> {
    let n = a.nrows();
    let mean = cluster.iter().map(|&k| values[k].re).sum::<f64>() / cluster.len() as f64;
    let others = (0..n).filter(|k| !cluster.contains(k)).map(|k| (values[k] - mean).norm());
    let distance = others.fold(f64::INFINITY, f64::min);
    let distance = if distance.is_finite() { distance } else { 1.0 };
    let shift = mean + 0.01 * distance;
    let pencil = Mat::from_fn(n, n, |i, j| if i == j { a[(i, j)] - shift } else { a[(i, j)] });
    let factors = PartialPivLu::new(pencil.as_ref());
    let start = |i: usize, j: usize| ((i * (j + 2) + j) as f64 * 0.7 + 0.3).sin();
    let mut basis = Mat::from_fn(n, cluster.len(), start);
    for _ in 0..BASIS_ITERATIONS {
        basis = factors.solve(&basis).qr().compute_thin_Q();
    }
    let block = basis.transpose() * a * &basis;
    let failed = |_| MapError::Eigenvalues { what: "the vehicle side of the loop" };
    let values = block.eigenvalues().map_err(failed)?;
    Ok((Block::Dense(block, values), basis))
}

/// S⁻¹ A S with powers of two on the diagonal S, so that rows and columns have equal size (Osborne 1960).
fn balanced(a: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
    let n = a.nrows();
    let (mut a, mut scale) = (a.clone(), vec![1.0; n]);
    for _ in 0..SWEEPS {
        let mut done = true;
        for k in 0..n {
            let others = || (0..n).filter(move |&j| j != k);
            let column: f64 = others().map(|j| a[(j, k)].abs()).sum();
            let row: f64 = others().map(|j| a[(k, j)].abs()).sum();
            let factor = (0.5 * (row / column).log2()).round().exp2();
            if column == 0.0 || row == 0.0 || factor == 1.0 || !factor.is_normal() {
                continue;
            }
            done = false;
            scale[k] *= factor;
            for j in 0..n {
                a[(j, k)] *= factor;
                a[(k, j)] /= factor;
            }
        }
        if done {
            break;
        }
    }
    (a, scale)
}
