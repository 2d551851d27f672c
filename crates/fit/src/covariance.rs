//! What data know about parameters: standard errors, correlations, what is not determined.

use std::ops::Range;

use nalgebra::{DMatrix, SymmetricEigen};

use crate::statistics::autoregressive_covariance;

/// An eigenvalue of the normalised information matrix below this is none: the differences have about 8 digits.
const SINGULAR: f64 = 1e-9;
/// A parameter with at least this share of a direction that the data do not see is not determined.
const SHARE: f64 = 0.1;

/// The information of a least-squares fit, in the units of the parameters.
///
/// With the derivatives J of weighted residuals r, the covariance is s²(JᵀJ)⁻¹ with s² = rᵀr/(n - p) if the residuals are
/// white. If they are not, it is (JᵀJ)⁻¹ JᵀΓJ (JᵀJ)⁻¹ with the covariances Γ of the residuals in time, of an autoregressive
/// process that is fitted to them.
#[derive(Debug, Clone)]
pub struct Information {
    /// Standard errors for white residuals; NaN of a parameter at a bound or without influence.
    pub errors: Vec<f64>,
    /// Standard errors for residuals that are correlated in time.
    pub correlated_errors: Vec<f64>,
    /// Correlation coefficients of the estimates; NaN where a standard error is.
    pub correlations: Vec<Vec<f64>>,
    /// Whether the data do not determine the parameter at all: it has no influence, or that of others cancels it.
    pub undetermined: Vec<bool>,
}

impl Information {
    /// Of weighted residuals and their derivatives by parameters that are scaled by their ranges.
    pub(crate) fn new(
        residuals: &[f64],
        derivatives: &[Vec<f64>],
        groups: &[Range<usize>],
        at_bound: &[bool],
        ranges: &[f64],
    ) -> Self {
        let count = derivatives.len();
        let norms: Vec<f64> =
            derivatives.iter().map(|it| it.iter().map(|it| it * it).sum::<f64>().sqrt()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        // what does not move the values at all, of rounding
        let silent = |k: usize| norms[k] <= 1e-10 * largest.max(f64::MIN_POSITIVE);
        let free: Vec<usize> = (0..count).filter(|&k| !at_bound[k] && !silent(k)).collect();
        let normal = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let (j, k) = (free[a], free[b]);
            let products = derivatives[j].iter().zip(&derivatives[k]).map(|(x, y)| x * y);
            products.sum::<f64>() / (norms[j] * norms[k])
        });
        if free.is_empty() {
            return Self {
                errors: vec![f64::NAN; count],
                correlated_errors: vec![f64::NAN; count],
                correlations: vec![vec![f64::NAN; count]; count],
                undetermined: (0..count).map(|k| !at_bound[k]).collect(),
            };
        }
        let eigen = SymmetricEigen::new(normal);
        let mut inverse = DMatrix::zeros(free.len(), free.len());
        let mut undetermined: Vec<bool> = (0..count).map(|k| !at_bound[k] && silent(k)).collect();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > SINGULAR {
                inverse += vector * vector.transpose() / *value;
                continue;
            }
            for (k, share) in free.iter().zip(vector.iter()) {
                undetermined[*k] |= share * share > SHARE;
            }
        }
        let freedom = residuals.len().saturating_sub(free.len()).max(1) as f64;
        let power = residuals.iter().map(|it| it * it).sum::<f64>() / freedom;
        let robust = &inverse * middle(residuals, derivatives, groups, &free, &norms) * &inverse;
        let spread = |matrix: &DMatrix<f64>, factor: f64| {
            let mut errors = vec![f64::NAN; count];
            for (a, &k) in free.iter().enumerate() {
                if !undetermined[k] {
                    errors[k] = (factor * matrix[(a, a)]).max(0.0).sqrt() * ranges[k] / norms[k];
                }
            }
            errors
        };
        let mut correlations = vec![vec![f64::NAN; count]; count];
        for (a, &j) in free.iter().enumerate() {
            for (b, &k) in free.iter().enumerate() {
                correlations[j][k] = inverse[(a, b)] / (inverse[(a, a)] * inverse[(b, b)]).sqrt();
            }
        }
        Self {
            errors: spread(&inverse, power),
            correlated_errors: spread(&robust, residuals.len() as f64 / freedom),
            correlations,
            undetermined,
        }
    }
}

/// JᵀΓJ of the scaled derivatives.
fn middle(
    residuals: &[f64],
    derivatives: &[Vec<f64>],
    groups: &[Range<usize>],
    free: &[usize],
    norms: &[f64],
) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(free.len(), free.len());
    for group in groups {
        let columns: Vec<&[f64]> = free.iter().map(|&k| &derivatives[k][group.clone()]).collect();
        let covariances = autoregressive_covariance(&residuals[group.clone()]);
        for (lag, covariance) in covariances.iter().enumerate() {
            let products = |a: usize, b: usize| {
                columns[a].iter().zip(&columns[b][lag..]).map(|(x, y)| x * y).sum::<f64>()
            };
            for a in 0..free.len() {
                for b in 0..free.len() {
                    let both =
                        if lag == 0 { products(a, b) } else { products(a, b) + products(b, a) };
                    sum[(a, b)] += covariance * both / (norms[free[a]] * norms[free[b]]);
                }
            }
        }
    }
    sum
}
