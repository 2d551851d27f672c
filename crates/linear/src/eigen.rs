//! Eigenvalues of real matrices that are not symmetric.

use faer::Mat;
use faer::prelude::c64;

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
    balanced(matrix).eigenvalues().map_err(|_| LinearError::Eigenvalues)
}

/// One eigenvalue, and the share of each state in it.
pub struct Eigen {
    /// 1/s.
    pub value: c64,
    /// |wⱼ vⱼ| with left and right eigenvectors w and v, of sum 1.
    pub shares: Vec<f64>,
}

/// Eigenvalues of a real matrix with the participation of the states, one per conjugate pair.
///
/// Left eigenvectors are the right ones of the transposed matrix. (The inverse of all right ones would
/// be inaccurate for every mode if a few are nearly parallel, as with 64 equal magnets.)
///
/// # Errors
/// The iteration does not converge.
pub fn eigen(matrix: &Mat<f64>) -> Result<Vec<Eigen>, LinearError> {
    let failed = |_| LinearError::Eigenvalues;
    let matrix = balanced(matrix);
    let right = matrix.eigen().map_err(failed)?;
    let left = matrix.transpose().to_owned().eigen().map_err(failed)?;
    let n = matrix.nrows();
    let values: Vec<c64> = (0..n).map(|k| right.S()[k]).collect();
    let mut others: Vec<(usize, c64)> = (0..n).map(|k| (k, left.S()[k])).collect();
    let mut found = Vec::new();
    for (k, value) in values.iter().enumerate() {
        let nearest = others
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| (a.1 - value).norm().total_cmp(&(b.1 - value).norm()));
        let Some(place) = nearest.map(|(place, _)| place) else { break };
        let (other, _) = others.swap_remove(place);
        let Some(value) = upper(*value) else { continue };
        let mut shares: Vec<f64> =
            (0..n).map(|j| (left.U()[(j, other)] * right.U()[(j, k)]).norm()).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        found.push(Eigen { value, shares });
    }
    Ok(found)
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

/// The matrix with its coordinates scaled by powers of two so that rows and columns have equal size
/// (Osborne 1960; Parlett and Reinsch 1969). The eigenvalues are the same, with smaller rounding errors.
#[must_use]
pub fn balanced(matrix: &Mat<f64>) -> Mat<f64> {
    let mut matrix = matrix.clone();
    let n = matrix.nrows();
    for _ in 0..SWEEPS {
        let mut balanced = true;
        for k in 0..n {
            let (mut column, mut row) = (0.0, 0.0);
            for j in (0..n).filter(|&j| j != k) {
                column += matrix[(j, k)].abs();
                row += matrix[(k, j)].abs();
            }
            if column == 0.0 || row == 0.0 {
                continue;
            }
            let factor = (0.5 * (row / column).log2()).round().exp2();
            if factor != 1.0 && factor.is_finite() && factor > 0.0 {
                balanced = false;
                for j in 0..n {
                    matrix[(j, k)] *= factor;
                    matrix[(k, j)] /= factor;
                }
            }
        }
        if balanced {
            break;
        }
    }
    matrix
}
