//! Whether residuals are white, and quantiles.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _, StudentsT};

/// Most lags of the test for whiteness.
const LAGS: usize = 20;
/// Residuals count as white if a test of white noise would find a statistic as large with at least this probability.
const LEVEL: f64 = 0.01;

/// The Ljung-Box test: Q = n(n+2) Σ ρ_k²/(n-k) over the first m lags has a χ² distribution with m degrees of freedom if the
/// residuals are white. Source: G. M. Ljung, G. E. P. Box, Biometrika 65 (1978) 297-303.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Whiteness {
    /// Lags m.
    pub lags: usize,
    /// Q.
    pub statistic: f64,
    /// Probability of a Q as large, of white noise.
    pub probability: f64,
    /// Correlation of neighbours.
    pub first_lag: f64,
    /// Whether the residuals pass as white: `probability` is 0.01 or more.
    pub white: bool,
}

/// Autocorrelation coefficients of a signal about its mean, from lag 0 to `lags`. All 0 if it is constant.
#[must_use]
pub fn autocorrelation(values: &[f64], lags: usize) -> Vec<f64> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n.max(1) as f64;
    let power: f64 = values.iter().map(|it| (it - mean).powi(2)).sum();
    let at = |lag: usize| {
        if power > 0.0 && lag < n {
            let pairs = values.iter().zip(&values[lag..]);
            pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / power
        } else {
            0.0
        }
    };
    (0..=lags).map(at).collect()
}

/// Tests residuals at equal intervals.
#[must_use]
pub fn whiteness(residuals: &[f64]) -> Whiteness {
    let n = residuals.len();
    let lags = (n / 5).clamp(1, LAGS);
    let correlations = autocorrelation(residuals, lags);
    let count = n as f64;
    let terms = correlations.iter().enumerate().skip(1);
    let sum: f64 = terms.map(|(k, it)| it * it / (count - k as f64).max(1.0)).sum();
    let statistic = count * (count + 2.0) * sum;
    let probability = ChiSquared::new(lags as f64).map_or(0.0, |it| it.sf(statistic));
    Whiteness { lags, statistic, probability, first_lag: correlations[1], white: probability >= LEVEL }
}

/// The factor from a standard error to half of a 95 % interval, with so many degrees of freedom.
#[must_use]
pub fn student_95(freedom: usize) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1) as f64).map_or(1.959_964, |it| it.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x_(k+1) = a·x_k + noise has the coefficients a^k.
    #[test]
    fn analytic_coefficients_of_a_first_order_process() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let white: Vec<f64> = (0..20_000).map(|_| noise()).collect();
        let mut x = 0.0;
        let coloured: Vec<f64> = white
            .iter()
            .map(|it| {
                x = 0.6 * x + it;
                x
            })
            .collect();
        let found = autocorrelation(&coloured, 3);
        for (k, it) in found.iter().enumerate() {
            assert!((it - 0.6_f64.powi(k as i32)).abs() < 0.03, "{found:?}");
        }
        assert!(whiteness(&white).white && !whiteness(&coloured).white);
        assert!((student_95(10) - 2.228_139).abs() < 1e-5 && (student_95(100_000) - 1.959_99).abs() < 1e-4);
    }
}
