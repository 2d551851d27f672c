//! Decaying oscillations in a record of free motion, by the matrix pencil (Hua and Sarkar 1990, "Matrix pencil method for
//! estimating parameters of exponentially damped/undamped sinusoids in noise").

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use faer::prelude::c64;

/// Samples that are used at most: others are left out evenly.
const MOST: usize = 500;
/// Singular values below this fraction of the largest are noise.
const NOISE: f64 = 1e-5;
/// Oscillations that are looked for at most, twice.
const ORDER: usize = 24;

/// A decaying or growing oscillation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Re λ (1/s).
    pub real: f64,
    /// Im λ (1/s).
    pub imaginary: f64,
    /// Its root of the sum of squares over the record, as a fraction of that of the record without its mean.
    pub share: f64,
}

/// The oscillations in equidistant samples, the strongest first. Empty if the record is too short or does not move.
#[must_use]
pub fn oscillations(samples: &[f64], step: f64) -> Vec<Oscillation> {
    let stride = samples.len().div_ceil(MOST).max(1);
    let y: Vec<f64> = samples.iter().step_by(stride).copied().collect();
    let step = step * stride as f64;
    let (count, mean) = (y.len(), y.iter().sum::<f64>() / y.len().max(1) as f64);
    let y: Vec<f64> = y.iter().map(|it| it - mean).collect();
    let size = y.iter().map(|it| it * it).sum::<f64>().sqrt();
    if count < 30 || !(size > 0.0 && size.is_finite()) {
        return Vec::new();
    }
    let length = count / 3;
    let hankel = Mat::from_fn(count - length, length + 1, |i, j| y[i + j] / size);
    let Ok(svd) = hankel.thin_svd() else { return Vec::new() };
    let order = (0..ORDER.min(length)).take_while(|&k| svd.S()[k] > NOISE * svd.S()[0]).count();
    // rows of V shifted by one sample differ by the factors z
    let v = svd.V().subcols(0, order);
    let (upper, lower) = (v.subrows(0, length), v.subrows(1, length));
    let square = upper.transpose() * upper;
    let turned = square.partial_piv_lu();
    let shift = faer::linalg::solvers::Solve::solve(&turned, upper.transpose() * lower);
    let Ok(factors) = shift.eigenvalues() else { return Vec::new() };
    let table = Mat::from_fn(count, factors.len(), |i, j| {
        // powers by the logarithm: none overflows within a record
        (factors[j].ln() * i as f64).exp()
    });
    let right = Mat::from_fn(count, 1, |i, _| c64::new(y[i], 0.0));
    let amplitudes = table.qr().solve_lstsq(&right);
    let mut all: Vec<Oscillation> = Vec::new();
    for (j, z) in factors.iter().enumerate() {
        let rate = z.ln() / step;
        if rate.im <= 1e-9 || !rate.is_finite() {
            continue;
        }
        // with its conjugate
        let part = |i: usize| 2.0 * (amplitudes[(j, 0)] * table[(i, j)]).re;
        let share = (0..count).map(|i| part(i) * part(i)).sum::<f64>().sqrt() / size;
        all.push(Oscillation { real: rate.re, imaginary: rate.im, share });
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_two_oscillations_on_an_offset_are_found() {
        let at = |k: u32| {
            let t = 0.002 * f64::from(k);
            3.0 + (-0.4 * t).exp() * (40.0 * t).sin()
                + 0.2 * (0.1 * t).exp() * (54.0 * t + 1.0).cos()
        };
        let samples: Vec<f64> = (0..4000).map(at).collect();
        let found = oscillations(&samples, 0.002);
        for (k, wanted) in [(0, (-0.4, 40.0)), (1, (0.1, 54.0))] {
            let it = found[k];
            assert!(
                (it.real - wanted.0).abs() < 1e-3 && (it.imaginary - wanted.1).abs() < 1e-3,
                "{it:?}"
            );
        }
        assert!(found[0].share > found[1].share);
    }

    #[test]
    fn refusal_records_without_motion_have_no_oscillation() {
        assert!(oscillations(&[], 0.1).is_empty());
        assert!(oscillations(&[1.0; 5], 0.1).is_empty());
        assert!(oscillations(&[2.0; 500], 0.1).is_empty());
        assert!(oscillations(&[f64::NAN; 500], 0.1).is_empty());
    }
}
