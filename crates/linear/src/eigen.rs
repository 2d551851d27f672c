//! Eigenvalues of real matrices that are not symmetric.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{self, ComputeEigenvectors, EvdParams};
use faer::prelude::c64;
use faer::{Mat, Par, Spec};

use super::error::LinearError;

/// Imaginary parts below this fraction of an eigenvalue are rounding errors: a double eigenvalue splits by
/// the square root of the rounding error.
const NEARLY_REAL: f64 = 1e-4;
/// Largest number of sweeps of the balancing, which usually converges in a few.
const SWEEPS: usize = 20;

/// All eigenvalues of a real matrix.
///
/// # Errors
/// The iteration does not converge.
pub fn eigenvalues(matrix: &Mat<f64>) -> Result<Vec<c64>, LinearError> {
    Ok(Decomposition::of(&balanced(matrix).matrix, false)?.values)
}

/// One eigenvalue, and the state motion that belongs to it.
pub struct Eigen {
    /// 1/s.
    pub value: c64,
    /// |wⱼ vⱼ| with left and right eigenvectors w and v, of sum 1.
    pub shares: Vec<f64>,
    /// Right eigenvector v: the states move with Re(v e^(λt)). Its largest element is 1.
    pub shape: Vec<c64>,
    /// Left eigenvector w with wᴴ v = 1: wᴴ x is how much of the mode is in a state x.
    pub left: Vec<c64>,
}

/// Eigenvalues of a real matrix with the participation of the states, one per conjugate pair.
///
/// Left and right eigenvectors come from the same real Schur form. (The inverse of all right ones would
/// be inaccurate for every mode if a few are nearly parallel, as with 64 equal magnets.)
///
/// # Errors
/// The iteration does not converge.
pub fn eigen(matrix: &Mat<f64>) -> Result<Vec<Eigen>, LinearError> {
    let Balanced { matrix, scale } = balanced(matrix);
    let Decomposition { values, left, right } = Decomposition::of(&matrix, true)?;
    let mut found = Vec::new();
    for (k, value) in values.iter().enumerate() {
        let vector = |matrix: &Mat<f64>| column(matrix, &values, k);
        let Some(value) = upper(*value) else { continue };
        let (mut left, mut shape) = (vector(&left), vector(&right));
        let shares = shares(&left, &shape);
        unscale(&mut shape, &scale);
        left.iter_mut().zip(&scale).for_each(|(w, scale)| *w /= *scale);
        let product: c64 = left.iter().zip(&shape).map(|(w, v)| w.conj() * v).sum();
        left.iter_mut().for_each(|w| *w /= product.conj());
        found.push(Eigen { value, shares, shape, left });
    }
    Ok(found)
}

/// Share of each state in a mode, |wᵢvᵢ| of the left and the right eigenvector; their sum is 1.
pub(crate) fn shares(left: &[c64], shape: &[c64]) -> Vec<f64> {
    let mut shares: Vec<f64> = left.iter().zip(shape).map(|(w, v)| (w * v).norm()).collect();
    let sum: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= sum);
    shares
}

/// Takes the balancing out of a right eigenvector, whose largest element becomes 1.
pub(crate) fn unscale(shape: &mut [c64], scale: &[f64]) {
    shape.iter_mut().zip(scale).for_each(|(v, scale)| *v *= *scale);
    let largest = shape.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).copied();
    if let Some(largest) = largest.filter(|it| it.norm() > 0.0) {
        shape.iter_mut().for_each(|v| *v /= largest);
    }
}

/// The eigenvector of eigenvalue k. A conjugate pair has its real and imaginary parts in two columns.
fn column(matrix: &Mat<f64>, values: &[c64], k: usize) -> Vec<c64> {
    let (re, im, sign) = match values[k].im {
        im if im > 0.0 => (k, Some(k + 1), 1.0),
        im if im < 0.0 => (k - 1, Some(k), -1.0),
        _ => (k, None, 0.0),
    };
    let part = |i, column: Option<usize>| column.map_or(0.0, |column| sign * matrix[(i, column)]);
    (0..matrix.nrows()).map(|i| c64::new(matrix[(i, re)], part(i, im))).collect()
}

/// Eigenvalues and, if wanted, left and right eigenvectors, as faer stores them.
struct Decomposition {
    values: Vec<c64>,
    left: Mat<f64>,
    right: Mat<f64>,
}

impl Decomposition {
    fn of(matrix: &Mat<f64>, vectors: bool) -> Result<Self, LinearError> {
        let n = matrix.nrows();
        let size = if vectors { n } else { 0 };
        let wanted = if vectors { ComputeEigenvectors::Yes } else { ComputeEigenvectors::No };
        let (mut left, mut right) = (Mat::zeros(size, size), Mat::zeros(size, size));
        let (mut real, mut imaginary) = (Diag::<f64>::zeros(n), Diag::<f64>::zeros(n));
        let settings = Spec::<EvdParams, f64>::default();
        let scratch = evd::evd_scratch::<f64>(n, wanted, wanted, Par::Seq, settings);
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| LinearError::Eigenvalues)?;
        evd::evd_real(
            matrix.as_ref(),
            real.as_mut(),
            imaginary.as_mut(),
            vectors.then(|| left.as_mut()),
            vectors.then(|| right.as_mut()),
            Par::Seq,
            MemStack::new(&mut memory),
            settings,
        )
        .map_err(|_| LinearError::Eigenvalues)?;
        let value = |k| c64::new(real.column_vector()[k], imaginary.column_vector()[k]);
        Ok(Self { values: (0..n).map(value).collect(), left, right })
    }
}

/// Selects every real eigenvalue, and of a conjugate pair the one with positive imaginary part. A double
/// real eigenvalue that rounding has split into a pair counts as two real ones.
#[must_use]
pub fn upper(value: c64) -> Option<c64> {
    if value.im.abs() <= NEARLY_REAL * value.norm() {
        return Some(c64::new(value.re, 0.0));
    }
    (value.im > 0.0).then_some(value)
}

/// A matrix whose coordinates are scaled.
pub struct Balanced {
    /// D⁻¹ A D.
    pub matrix: Mat<f64>,
    /// D, powers of two.
    pub scale: Vec<f64>,
}

/// The matrix with its coordinates scaled by powers of two so that rows and columns have equal size
/// (Osborne 1960; Parlett and Reinsch 1969). The eigenvalues are the same, with smaller rounding errors.
#[must_use]
pub fn balanced(matrix: &Mat<f64>) -> Balanced {
    let n = matrix.nrows();
    let scale = scales(matrix, SWEEPS);
    let matrix = Mat::from_fn(n, n, |i, j| matrix[(i, j)] * scale[j] / scale[i]);
    Balanced { matrix, scale }
}

/// D of [`balanced`], after so many sweeps.
pub(crate) fn scales(matrix: &Mat<f64>, sweeps: usize) -> Vec<f64> {
    let n = matrix.nrows();
    let (mut columns, mut rows) = (vec![Vec::new(); n], vec![Vec::new(); n]);
    for (j, column) in matrix.col_iter().enumerate() {
        for (i, value) in column.iter().enumerate().filter(|&(i, value)| i != j && *value != 0.0) {
            columns[j].push((i, value.abs()));
            rows[i].push((j, value.abs()));
        }
    }
    let mut scale = vec![1.0_f64; n];
    for _ in 0..sweeps {
        let mut balanced = true;
        for k in 0..n {
            let column = columns[k].iter().map(|&(i, x)| x / scale[i]).sum::<f64>() * scale[k];
            let row = rows[k].iter().map(|&(j, x)| x * scale[j]).sum::<f64>() / scale[k];
            if column == 0.0 || row == 0.0 {
                continue;
            }
            let factor = (0.5 * (row / column).log2()).round().exp2();
            if factor != 1.0 && factor.is_finite() && factor > 0.0 {
                balanced = false;
                scale[k] *= factor;
            }
        }
        if balanced {
            break;
        }
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::*;

    /// wᴴ A = λ wᴴ, A v = λ v and wᴴ v = 1, in the coordinates of the matrix although it is balanced.
    #[test]
    fn analytic_left_and_right_eigenvectors_belong_to_the_matrix() {
        let (k, d) = (4e6, 3.0);
        let rows = [
            [0.0, 1.0, 0.0, 0.0],
            [-2.0 * k, -d, k, 0.1],
            [0.0, 0.0, -20.0, 1e-4],
            [1e5, 0.0, 0.0, -7.0],
        ];
        let a = Mat::from_fn(4, 4, |i, j| rows[i][j]);
        for it in eigen(&a).unwrap() {
            let size = |x: &[c64]| x.iter().map(|x| x.norm()).fold(0.0, f64::max);
            let value = it.value;
            let right: Vec<c64> = (0..4)
                .map(|i| (0..4).map(|j| it.shape[j] * a[(i, j)]).sum::<c64>() - value * it.shape[i])
                .collect();
            let left: Vec<c64> = (0..4)
                .map(|j| {
                    let seen: c64 = (0..4).map(|i| it.left[i].conj() * a[(i, j)]).sum();
                    seen - value * it.left[j].conj()
                })
                .collect();
            assert!(size(&right) < 1e-9 * 8e6 * size(&it.shape), "{right:?}");
            assert!(size(&left) < 1e-9 * 8e6 * size(&it.left), "{left:?}");
            let product: c64 = it.left.iter().zip(&it.shape).map(|(w, v)| w.conj() * v).sum();
            assert!((product - 1.0).norm() < 1e-12, "{product}");
        }
    }
}
