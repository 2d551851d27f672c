//! Which factors matter: main effects and Sobol indices.
//!
//! The first-order index S of a factor is the part of a figure's variance that its main effect explains, the total
//! index T also what it explains together with others. How they are computed depends on the design:
//!
//! - `saltelli`: the estimators of Saltelli et al. (2010) and Jansen (1999), with bootstrap intervals: [`saltelli`];
//! - complete grids: the analysis of variance of the grid, exact for equally weighted values: [`grid`];
//! - everything else: those of a fitted polynomial chaos, with the quality of its fit: [`chaos`].

pub mod chaos;
pub mod effects;
pub mod grid;
pub mod saltelli;

use crate::settings::Settings;
use crate::study_results::StudyResults;
use chaos::Fit;
pub use effects::{Level, main_effect};

/// Sobol indices of one figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Indices {
    /// One for each factor.
    pub factors: Vec<Index>,
    /// How they were computed, and what limits their meaning.
    pub method: String,
    /// Part of the variance of single points that only their seeds cause.
    pub seeds: Option<f64>,
}

/// The indices of one factor, with 95 % intervals where they are known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Index {
    /// First-order index.
    pub first: f64,
    /// Total index.
    pub total: f64,
    /// Interval of the first-order index.
    pub first_interval: Option<[f64; 2]>,
    /// Interval of the total index.
    pub total_interval: Option<[f64; 2]>,
}

/// Fewest settings with a figure.
const FEWEST: usize = 8;

/// The Sobol indices of a figure, given at all points; a text says why there are none.
///
/// # Errors
/// The figure is known at too few settings or does not vary, or no method fits the design.
pub fn indices(
    study: &StudyResults,
    settings: &Settings,
    figure: &[f64],
) -> Result<Indices, String> {
    let means = settings.means(figure);
    let known = means.iter().filter(|it| it.is_finite()).count();
    if settings.factors.is_empty() {
        return Err("the study has no factors besides seeds".to_owned());
    }
    if known < FEWEST {
        return Err(format!("{known} settings have this figure; {FEWEST} are needed"));
    }
    let (total, within) = (variance(&means), settings.variance_within(figure));
    if total <= 0.0 || total.is_nan() {
        return Err("this figure is the same at all settings".to_owned());
    }
    let lost = means.len() - known;
    let left_out = match lost {
        0 => String::new(),
        _ => format!(" Left out: {lost} of {} settings, which lack the figure.", means.len()),
    };
    let repeated = settings.points.iter().map(Vec::len).max().unwrap_or(1);
    let of_means = if repeated > 1 { " Figures are means over seeds." } else { "" };
    let (factors, method) = if study.design() == "saltelli" {
        let it = saltelli::estimate(&means, settings.factors.len())?;
        let method = format!(
            "Saltelli's estimator of first-order indices (2010) and Jansen's of total indices (1999) from {} of {} rows \
             of the design; lines: 95 % of {} bootstrap samples.",
            it.used,
            it.rows,
            saltelli::SAMPLES
        );
        (it.factors, method)
    } else if let Some(factors) = grid::decompose(&settings.values, &means) {
        let method = "Analysis of variance of the complete grid: exact if the values of a factor are equally likely.";
        (factors, method.to_owned())
    } else {
        let fit = Fit::new(&settings.values, &means)?;
        let method = format!(
            "From a fit, since the design is not Saltelli's and no complete grid: polynomial chaos of degree {} with {} \
             terms over the ranks of the factors; it predicts {:.1} % of the variance at points left out of it.{}",
            fit.degree,
            fit.terms.len(),
            100.0 * fit.predicted,
            fit.caveat()
        );
        (fit.indices(), method)
    };
    #[expect(clippy::cast_precision_loss, reason = "few seeds")]
    let seeds = within.map(|within| {
        let between = (total - within / repeated as f64).max(0.0);
        within / (within + between)
    });
    Ok(Indices { factors, method: format!("{method}{of_means}{left_out}"), seeds })
}

/// Variance of the finite values.
#[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
pub(crate) fn variance(values: &[f64]) -> f64 {
    let finite = || values.iter().copied().filter(|it| it.is_finite());
    let count = finite().count() as f64;
    let mean = finite().sum::<f64>() / count;
    finite().map(|it| (it - mean).powi(2)).sum::<f64>() / count
}

#[cfg(test)]
pub(crate) mod tests {
    use std::f64::consts::PI;

    /// The function of Ishigami and Homma (1990) with a = 7, b = 0.1 of three values in 0 … 1, each spread over −π … π.
    pub(crate) fn ishigami(u: &[f64]) -> f64 {
        let x: Vec<f64> = u.iter().map(|it| PI * (2.0 * it - 1.0)).collect();
        x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
    }

    /// Its indices in closed form: first-order, total.
    pub(crate) fn closed_form() -> [[f64; 2]; 3] {
        let (a, b) = (7.0_f64, 0.1);
        let alone = 0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2);
        let second = a * a / 8.0;
        let both = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
        let all = alone + second + both;
        [[alone / all, (alone + both) / all], [second / all, second / all], [0.0, both / all]]
    }

    /// Points of the additive recurrence of Roberts: low discrepancy in any number of dimensions.
    pub(crate) fn even(index: usize, dimensions: usize) -> Vec<f64> {
        let mut ratio = 2.0_f64;
        for _ in 0..40 {
            ratio = (1.0 + ratio).powf(1.0 / (dimensions as f64 + 1.0));
        }
        (1..=dimensions).map(|d| (0.5 + index as f64 * ratio.powi(-(d as i32))).fract()).collect()
    }

    #[test]
    fn analytic_the_closed_form_is_the_published_one() {
        let expected = [[0.3139, 0.5576], [0.4424, 0.4424], [0.0, 0.2437]];
        for (it, published) in closed_form().iter().flatten().zip(expected.iter().flatten()) {
            assert!((it - published).abs() < 5e-5, "{it} {published}");
        }
    }
}
