//! Whether residuals are white, and quantiles.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _, StudentsT};

/// Most lags of the test for whiteness.
const LAGS: usize = 20;
/// Highest order of an autoregressive process.
const ORDERS: usize = 30;
/// Correlations below this have decayed.
const DECAYED: f64 = 1e-3;
/// Most lags of a covariance.
const FARTHEST: usize = 2000;
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

/// Autocovariances of a signal, from lag 0 to where they have decayed: those of the autoregressive process that fits it best.
///
/// The coefficients of each order follow from the autocorrelation by Levinson's recursion (Yule and Walker), and the order
/// from Akaike's criterion, n·ln(variance of the innovations) + 2·order. Unlike the estimated autocovariances themselves,
/// which sum up to nothing, those of the process tell the power at low frequencies.
#[must_use]
pub fn autoregressive_covariance(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let most = (n / 10).min(ORDERS);
    let known = autocorrelation(values, most);
    let power = values.iter().map(|it| it * it).sum::<f64>() / n.max(1) as f64;
    let (mut coefficients, mut innovation) = (Vec::new(), 1.0);
    let mut best = (0.0, Vec::new());
    for order in 1..=most {
        let predicted: f64 = coefficients
            .iter()
            .enumerate()
            .map(|(k, a): (usize, &f64)| a * known[order - 1 - k])
            .sum();
        let reflection = (known[order] - predicted) / innovation;
        if reflection.is_nan() || reflection.abs() >= 1.0 {
            break;
        }
        let mirrored: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(mirrored).for_each(|(a, b)| *a -= reflection * b);
        coefficients.push(reflection);
        innovation *= 1.0 - reflection * reflection;
        let criterion = n as f64 * f64::ln(innovation) + 2.0 * order as f64;
        if criterion < best.0 {
            best = (criterion, coefficients.clone());
        }
    }
    let order = best.1.len();
    let mut correlations = known[..=order].to_vec();
    // as long as the largest of the last ones counts
    while correlations.len() < n.min(FARTHEST)
        && correlations.iter().rev().take(order).any(|it| it.abs() > DECAYED)
    {
        let last = correlations.len();
        let next = best.1.iter().enumerate().map(|(k, a)| a * correlations[last - 1 - k]).sum();
        correlations.push(next);
    }
    correlations.iter().map(|it| it * power).collect()
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
    Whiteness {
        lags,
        statistic,
        probability,
        first_lag: correlations[1],
        white: probability >= LEVEL,
    }
}

/// The factor from a standard error to half of a 95 % interval, with so many degrees of freedom.
#[must_use]
pub fn student_95(freedom: usize) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1) as f64).map_or(1.959_964, |it| it.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;

    /// x_(k+1) = a·x_k + noise has the coefficients a^k.
    #[test]
    fn analytic_coefficients_of_a_first_order_process() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut noise = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
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
        assert!(whiteness(&white).white, "{:?}", whiteness(&white));
        assert!(!whiteness(&coloured).white, "{:?}", whiteness(&coloured));
        // 0.6^k over 1 - 0.6², of noise with 1/12
        let covariances = autoregressive_covariance(&coloured);
        let sum = covariances.iter().enumerate().map(|(k, it)| if k == 0 { *it } else { 2.0 * it });
        let exact = 1.0 / 12.0 / (0.4 * 0.4);
        assert!((sum.sum::<f64>() / exact - 1.0).abs() < 0.1, "{covariances:?}");
        assert!(covariances.len() < 60, "{}", covariances.len());
        assert!(
            (student_95(10) - 2.228_139).abs() < 1e-5
                && (student_95(100_000) - 1.959_99).abs() < 1e-4
        );
    }
}
