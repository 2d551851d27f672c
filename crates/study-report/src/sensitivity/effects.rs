//! Main effects: the mean of a figure at the values of one factor.

/// Most values of a factor that are levels of their own. More are put into classes.
const LEVELS: usize = 24;
/// Classes with equal numbers of settings.
const CLASSES: usize = 12;

/// The mean of a figure at a level of a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Value of the factor, or its mean in a class.
    pub value: f64,
    /// Mean of the figure.
    pub mean: f64,
    /// Standard deviation of the figure among the settings of the level.
    pub deviation: f64,
    /// Number of settings.
    pub count: usize,
}

/// The main effect of a factor on a figure; settings without the figure are left out.
#[must_use]
pub fn main_effect(factor: &[f64], figure: &[f64]) -> Vec<Level> {
    let pairs = factor.iter().copied().zip(figure.iter().copied());
    let mut pairs: Vec<(f64, f64)> =
        pairs.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let equal = |a: &(f64, f64), b: &(f64, f64)| a.0 == b.0;
    if pairs.chunk_by(equal).count() <= LEVELS {
        return pairs.chunk_by(equal).map(level).collect();
    }
    let at = |k: usize| k * pairs.len() / CLASSES;
    (0..CLASSES).map(|k| level(&pairs[at(k)..at(k + 1)])).collect()
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
fn level(pairs: &[(f64, f64)]) -> Level {
    let count = pairs.len() as f64;
    let value = pairs.iter().map(|it| it.0).sum::<f64>() / count;
    let mean = pairs.iter().map(|it| it.1).sum::<f64>() / count;
    let square = pairs.iter().map(|it| (it.1 - mean).powi(2)).sum::<f64>() / count;
    Level { value, mean, deviation: square.sqrt(), count: pairs.len() }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{even, ishigami};
    use super::*;
    use std::f64::consts::PI;

    /// E(f | x₂) = a/2·… : the mean over x₁ and x₃ is 7 sin² x₂.
    #[test]
    fn analytic_the_main_effect_of_ishigami_is_a_squared_sine() {
        let points: Vec<Vec<f64>> = (0..40_000).map(|k| even(k, 3)).collect();
        let figure: Vec<f64> = points.iter().map(|it| ishigami(it)).collect();
        let factor: Vec<f64> = points.iter().map(|it| it[1]).collect();
        let levels = main_effect(&factor, &figure);
        assert_eq!(levels.len(), CLASSES);
        let mean = |from: f64, to: f64| {
            // of 7 sin² over a class: 3.5 − 3.5·mean(cos 2x)
            let integral = |u: f64| (2.0 * PI * (2.0 * u - 1.0)).sin() / (4.0 * PI);
            3.5 - 3.5 * (integral(to) - integral(from)) / (to - from)
        };
        for (k, level) in levels.iter().enumerate() {
            let [from, to] = [k, k + 1].map(|it| it as f64 / CLASSES as f64);
            assert!((level.mean - mean(from, to)).abs() < 0.05, "{level:?} {}", mean(from, to));
        }
    }

    #[test]
    fn analytic_values_of_a_grid_are_levels() {
        let levels = main_effect(&[2.0, 1.0, 2.0, 1.0], &[5.0, 1.0, 7.0, f64::NAN]);
        assert_eq!(levels.len(), 2);
        assert_eq!(levels[0], Level { value: 1.0, mean: 1.0, deviation: 0.0, count: 1 });
        assert_eq!(levels[1], Level { value: 2.0, mean: 6.0, deviation: 1.0, count: 2 });
    }
}
