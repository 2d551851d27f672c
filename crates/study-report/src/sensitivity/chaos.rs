//! A polynomial chaos fitted to the settings of any design, and its Sobol indices.
//!
//! Each factor x becomes u = (rank − ½)/n, evenly distributed over 0 … 1 however x is distributed, so that polynomials
//! of Legendre in 2u − 1 are orthonormal under the distribution of the factor. The figure is the sum of their products
//! up to a total degree, by least squares. Sums of squared coefficients are then variances (Sudret 2008, Reliab. Eng.
//! Syst. Saf. 93). The degree is that which predicts best points left out of the fit, one at a time: with the hat
//! matrix H, the residual of point i without itself is eᵢ/(1 − hᵢᵢ).

use nalgebra::{DMatrix, DVector};

use super::{Index, variance};

/// Most terms.
const TERMS: usize = 260;
/// Highest degree.
const DEGREE: usize = 12;
/// Settings per term, at least.
const PER_TERM: usize = 2;
/// Most settings that are fitted; of more, these many at equal distances in the table.
const MOST: usize = 6000;
/// Predicted part of the variance below which indices mean little.
const GOOD: f64 = 0.9;
/// Correlation of factors from which their effects cannot be told apart.
const CORRELATED: f64 = 0.3;

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Total degree.
    pub degree: usize,
    /// Degrees in each factor, and the coefficient, of each term.
    pub terms: Vec<(Vec<usize>, f64)>,
    /// Part of the variance that is predicted at points left out.
    pub predicted: f64,
    /// Largest correlation between the ranks of two factors.
    pub correlation: f64,
}

impl Fit {
    /// Fits a figure at settings; those without the figure are left out.
    ///
    /// # Errors
    /// There are too few settings for a fit of degree 1.
    pub fn new(settings: &[Vec<f64>], figure: &[f64]) -> Result<Self, String> {
        let known: Vec<usize> = (0..figure.len()).filter(|&k| figure[k].is_finite()).collect();
        let every = known.len().div_ceil(MOST).max(1);
        let known: Vec<usize> = known.into_iter().step_by(every).collect();
        let dimensions = settings.first().map_or(0, Vec::len);
        let columns: Vec<Vec<f64>> = (0..dimensions)
            .map(|d| ranks(&known.iter().map(|&k| settings[k][d]).collect::<Vec<f64>>()))
            .collect();
        // few levels carry low degrees only; a factor that does not vary carries none
        let levels: Vec<usize> = columns.iter().map(|it| count_distinct(it)).collect();
        let values = DVector::from_iterator(known.len(), known.iter().map(|&k| figure[k]));
        let spread = variance(values.as_slice());
        let mut best: Option<Self> = None;
        for degree in 1..=DEGREE {
            let powers = exponents(&levels, degree);
            if powers.len() > TERMS || powers.len() * PER_TERM > known.len() {
                break;
            }
            let Some((coefficients, error)) = least_squares(&columns, &powers, &values) else {
                break;
            };
            let predicted = 1.0 - error / spread;
            if best.as_ref().is_none_or(|it| predicted > it.predicted) {
                let terms = powers.into_iter().zip(coefficients).collect();
                best = Some(Self { degree, terms, predicted, correlation: correlation(&columns) });
            }
        }
        best.ok_or_else(|| {
            format!("{} settings are too few to fit {dimensions} factors", known.len())
        })
    }

    /// The Sobol indices of the fit.
    #[must_use]
    pub fn indices(&self) -> Vec<Index> {
        let dimensions = self.terms.first().map_or(0, |(powers, _)| powers.len());
        let sum = |keep: &dyn Fn(&[usize]) -> bool| -> f64 {
            self.terms.iter().filter(|(powers, _)| keep(powers)).map(|(_, c)| c * c).sum()
        };
        let all = sum(&|powers| powers.iter().any(|it| *it > 0));
        let part = |sum: f64| if all > 0.0 { sum / all } else { 0.0 };
        let index = |d: usize| {
            let alone = |powers: &[usize]| {
                powers.iter().enumerate().all(|(k, power)| (*power > 0) == (k == d))
            };
            let (first, total) = (part(sum(&alone)), part(sum(&|powers| powers[d] > 0)));
            Index { first, total, ..Index::default() }
        };
        (0..dimensions).map(index).collect()
    }

    /// What limits the meaning of the indices, as sentences.
    #[must_use]
    pub fn caveat(&self) -> String {
        let mut text = String::new();
        if self.predicted < GOOD {
            text += " THE FIT IS POOR: take the indices as a hint, or compute more points, or use the design \"saltelli\".";
        }
        if self.correlation > CORRELATED {
            text += &format!(
                " Factors are correlated (up to {:.2}), so that their effects mix.",
                self.correlation
            );
        }
        text
    }
}

/// (rank − ½)/n of each value; equal values share their mean rank.
#[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    for equal in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let middle = before as f64 + 0.5 * equal.len() as f64;
        equal.iter().for_each(|&k| ranks[k] = middle / values.len() as f64);
        before += equal.len();
    }
    ranks
}

fn count_distinct(values: &[f64]) -> usize {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all.len()
}

/// All exponents with a sum of at most `degree`, each below the number of its factor's levels, the constant first.
fn exponents(levels: &[usize], degree: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for levels in levels {
        let longer = |list: &Vec<usize>| {
            let used: usize = list.iter().sum();
            let most = (degree - used).min(levels.saturating_sub(1));
            let list = list.clone();
            (0..=most).map(move |it| list.iter().copied().chain([it]).collect::<Vec<_>>())
        };
        all = all.iter().flat_map(longer).collect();
        if all.len() > TERMS * (degree + 1) {
            break;
        }
    }
    all.sort_by_key(|list| list.iter().sum::<usize>());
    all
}

/// √(2k+1)·P_k(2u − 1) for k up to `degree`.
#[expect(clippy::cast_precision_loss, reason = "small degrees")]
fn legendre(u: f64, degree: usize) -> Vec<f64> {
    let x = 2.0 * u - 1.0;
    let mut p = vec![1.0, x];
    for k in 1..degree.max(1) {
        let n = k as f64;
        p.push(((2.0 * n + 1.0) * x * p[k] - n * p[k - 1]) / (n + 1.0));
    }
    p.iter().enumerate().map(|(k, it)| it * (2.0 * k as f64 + 1.0).sqrt()).collect()
}

/// Coefficients, and the mean square of what is predicted wrongly at points left out; `None` if the points do not
/// determine the coefficients.
#[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
fn least_squares(
    columns: &[Vec<f64>],
    powers: &[Vec<usize>],
    values: &DVector<f64>,
) -> Option<(Vec<f64>, f64)> {
    let degree = powers.iter().flatten().copied().max()?;
    let rows = values.len();
    let mut matrix = DMatrix::zeros(rows, powers.len());
    for row in 0..rows {
        let polynomials: Vec<Vec<f64>> =
            columns.iter().map(|it| legendre(it[row], degree)).collect();
        for (term, powers) in powers.iter().enumerate() {
            let factors = powers.iter().zip(&polynomials).map(|(power, it)| it[*power]);
            matrix[(row, term)] = factors.product();
        }
    }
    let normal = matrix.tr_mul(&matrix);
    let scale = normal.diagonal().max();
    let cholesky = normal.cholesky()?;
    // few levels cannot carry high degrees: the last pivot is then rounding
    let least = cholesky.l_dirty().diagonal().min();
    if least * least < 1e-10 * scale {
        return None;
    }
    let coefficients = cholesky.solve(&matrix.tr_mul(values));
    let residuals = values - &matrix * &coefficients;
    let solved = cholesky.solve(&matrix.transpose());
    let error = |row: usize| {
        let own: f64 =
            matrix.row(row).iter().zip(solved.column(row).iter()).map(|(a, b)| a * b).sum();
        (residuals[row] / (1.0 - own).max(1e-9)).powi(2)
    };
    let error = (0..rows).map(error).sum::<f64>() / rows as f64;
    Some((coefficients.iter().copied().collect(), error))
}

/// Largest magnitude of a correlation between two columns.
fn correlation(columns: &[Vec<f64>]) -> f64 {
    let centred: Vec<DVector<f64>> = columns
        .iter()
        .map(|it| DVector::from_iterator(it.len(), it.iter().map(|u| u - 0.5)))
        .collect();
    let mut most = 0.0_f64;
    for (k, a) in centred.iter().enumerate() {
        for b in &centred[..k] {
            let size = a.norm() * b.norm();
            most = if size > 0.0 { most.max((a.dot(b) / size).abs()) } else { most };
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::super::tests::{closed_form, even, ishigami};
    use super::*;

    #[test]
    fn analytic_the_indices_of_ishigami_are_found_from_any_sample() {
        let settings: Vec<Vec<f64>> = (0..1000).map(|k| even(k, 3)).collect();
        let figure: Vec<f64> = settings.iter().map(|it| ishigami(it)).collect();
        let fit = Fit::new(&settings, &figure).unwrap();
        assert!(
            fit.predicted > 0.99 && fit.caveat().is_empty(),
            "{} {}",
            fit.predicted,
            fit.degree
        );
        for (found, [first, total]) in fit.indices().iter().zip(closed_form()) {
            // degree 8 or 9 leaves below 0.1 % of the variance
            assert!((found.first - first).abs() < 0.01, "{found:?} {first}");
            assert!((found.total - total).abs() < 0.01, "{found:?} {total}");
        }
    }

    /// Ranks make the indices independent of how a factor is scaled.
    #[test]
    fn invariant_scales_of_factors_do_not_matter() {
        let settings: Vec<Vec<f64>> = (0..300).map(|k| even(k, 2)).collect();
        let figure: Vec<f64> = settings.iter().map(|it| it[0] + 2.0 * it[1] * it[0]).collect();
        let scaled: Vec<Vec<f64>> =
            settings.iter().map(|it| vec![(9.0 * it[0]).exp(), 1e9 * it[1]]).collect();
        assert_eq!(Fit::new(&settings, &figure), Fit::new(&scaled, &figure));
    }

    #[test]
    fn issue_poor_fits_and_correlated_factors_are_said() {
        let settings: Vec<Vec<f64>> = (0..60).map(|k| even(k, 3)).collect();
        let rough: Vec<f64> = settings.iter().map(|it| (300.0 * it[0]).sin()).collect();
        assert!(Fit::new(&settings, &rough).unwrap().caveat().contains("POOR"));
        let same: Vec<Vec<f64>> =
            settings.iter().map(|it| vec![it[0], it[0] + 0.3 * it[1]]).collect();
        let figure: Vec<f64> = settings.iter().map(|it| it[0]).collect();
        assert!(Fit::new(&same, &figure).unwrap().caveat().contains("correlated"));
        assert!(Fit::new(&settings[..5], &figure[..5]).unwrap_err().contains("too few"));
    }
}
