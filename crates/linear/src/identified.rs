//! A discrete state-space model from the responses of a system to impulses.
//!
//! The eigensystem realization algorithm (Juang and Pappa 1985): the Hankel matrix of the responses has the rank
//! of the system, and its singular vectors give a balanced realization.

use faer::Mat;
use faer::linalg::solvers::Svd;

use super::error::LinearError;

/// x⁺ = A x + B u, y = C x + D u, where y is the output at the end of the step over which u is held.
#[derive(Debug, Clone)]
pub struct Identified {
    /// A.
    pub a: Mat<f64>,
    /// B.
    pub b: Mat<f64>,
    /// C.
    pub c: Mat<f64>,
    /// D.
    pub d: Mat<f64>,
}

impl Identified {
    /// From `responses[k][(i, j)]`: output i at the end of step k after input j was one in step 0 alone. Rows and
    /// columns must be scaled to about equal size. Directions whose singular value is below `noise` times the
    /// largest are left out.
    ///
    /// Row block r and column block c of the Hankel matrix hold the response of step 1 + r + c, for all r and c
    /// among the `offsets`, the first of which is zero. They need not be neighbours: far ones show slow motions. The last response that is used
    /// is that of step 2 + 2 · the largest offset.
    ///
    /// # Errors
    /// The singular values cannot be found.
    pub fn new(responses: &[Mat<f64>], offsets: &[usize], noise: f64) -> Result<Self, LinearError> {
        let d = responses.first().cloned().unwrap_or_else(Mat::new);
        let (p, m) = (d.nrows(), d.ncols());
        let hankel = |shift: usize| {
            Mat::from_fn(offsets.len() * p, offsets.len() * m, |i, j| {
                let step = 1 + offsets[i / p] + offsets[j / m] + shift;
                responses.get(step).map_or(0.0, |it| it[(i % p, j % m)])
            })
        };
        let first = hankel(0);
        if first.nrows() == 0 || first.ncols() == 0 {
            return Ok(Self { a: Mat::new(), b: Mat::zeros(0, m), c: Mat::zeros(p, 0), d });
        }
        let svd = Svd::new_thin(first.as_ref()).map_err(|_| LinearError::Eigenvalues)?;
        let sizes: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let largest = sizes.first().copied().unwrap_or(0.0);
        let n = sizes.iter().take_while(|&&size| size > noise * largest && size > 0.0).count();
        let (u, v) = (svd.U().subcols(0, n), svd.V().subcols(0, n));
        let root = |k: usize| sizes[k].sqrt();
        let shifted = u.transpose() * hankel(1) * v;
        Ok(Self {
            a: Mat::from_fn(n, n, |i, j| shifted[(i, j)] / (root(i) * root(j))),
            // the first blocks have offset zero
            b: Mat::from_fn(n, m, |i, j| root(i) * v[(j, i)]),
            c: Mat::from_fn(p, n, |i, j| u[(i, j)] * root(j)),
            d,
        })
    }

    /// The responses of the first `count` steps to an impulse in step 0.
    #[must_use]
    pub fn responses(&self, count: usize) -> Vec<Mat<f64>> {
        let mut state = self.b.clone();
        let mut all = vec![self.d.clone()];
        while all.len() < count {
            all.push(&self.c * &state);
            state = &self.a * &state;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The impulse responses of a known system give a system with its eigenvalues, and its responses.
    #[test]
    fn analytic_a_known_system_is_found_again() {
        let a =
            Mat::from_fn(3, 3, |i, j| [[0.9, 0.3, 0.0], [-0.3, 0.9, 0.1], [0.0, 0.0, 0.5]][i][j]);
        let known = Identified {
            a: a.clone(),
            b: Mat::from_fn(3, 2, |i, j| [[0.0, 0.2], [1.0, 0.0], [0.5, -1.0]][i][j]),
            c: Mat::from_fn(1, 3, |_, j| [1.0, 0.0, 2.0][j]),
            d: Mat::from_fn(1, 2, |_, j| [0.25, 0.0][j]),
        };
        let found = Identified::new(&known.responses(33), &[0, 1, 2, 3, 5, 9, 15], 1e-10).unwrap();
        let sorted = |a: &Mat<f64>| {
            let mut all: Vec<(f64, f64)> =
                a.eigenvalues().unwrap().iter().map(|z| (z.re, z.im)).collect();
            all.sort_by(|a, b| a.partial_cmp(b).unwrap());
            all
        };
        let (wanted, values) = (sorted(&a), sorted(&found.a));
        assert_eq!(values.len(), 3);
        for (a, b) in wanted.iter().zip(&values) {
            assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9, "{a:?} {b:?}");
        }
        for (a, b) in known.responses(60).iter().zip(found.responses(60)) {
            assert!((a - b).norm_max() < 1e-9);
        }
    }
}
