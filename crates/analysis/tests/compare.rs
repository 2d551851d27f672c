//! Coherence and lags against closed solutions.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod signals;

use std::f64::consts::TAU;

use analysis::compare::{best_lag, coherence};
use analysis::spectrum::Welch;
use signals::noise;

/// White noise with a filtered copy of itself and as much independent noise: γ² = 1/2 at every frequency. The estimate
/// over n pieces is biased by (1 - γ²)²/n and scatters with √(2γ²)(1 - γ²)/√n (Bendat and Piersol).
#[test]
fn analytic_coherence_of_equal_parts_is_a_half() {
    let (x, other) = (noise(60_000, 1), noise(60_000, 2));
    let y: Vec<f64> = x.iter().zip(&other).map(|(a, b)| 3.0 * (a + b)).collect();
    let found = coherence(&x, &y, 100.0, &Welch::of_segment(256)).unwrap();
    assert!((found.resolution - 100.0 / 256.0).abs() < 1e-12 && found.pieces == 467);
    let inner = &found.values[2..127];
    let mean = inner.iter().sum::<f64>() / inner.len() as f64;
    assert!((mean - 0.5).abs() < 0.01, "{mean}");
    assert!(inner.iter().all(|it| (it - 0.5).abs() < 0.15));
    let same = coherence(&x, &x, 100.0, &Welch::of_segment(256)).unwrap();
    assert!(same.values.iter().all(|it| (it - 1.0).abs() < 1e-12));
}

/// A burst at 2.0 s of the one and at 0.7345 s of the other signal.
#[test]
fn analytic_the_lag_of_a_burst_is_found_between_samples() {
    let burst = |t: f64| (TAU * 5.0 * t).sin() * (-(t / 0.3).powi(2)).exp();
    let x: Vec<f64> = (0..800).map(|k| 4.0 + burst(f64::from(k) * 0.01 - 2.0)).collect();
    let y: Vec<f64> = (0..300).map(|k| 7.0 - 2.0 * -burst(f64::from(k) * 0.01 - 0.7345)).collect();
    let found = best_lag(&[(&x, &y)], 150).unwrap();
    assert!((found.samples - 126.55).abs() < 0.02, "{found:?}");
    assert!(found.correlation > 0.99 && found.runner_up.unwrap().1 < 0.95, "{found:?}");
    // the other way round the lag is negative
    let back = best_lag(&[(&y, &x)], 150).unwrap();
    assert!((back.samples + 126.55).abs() < 0.02, "{back:?}");
}

/// A sine agrees with itself after each period.
#[test]
fn analytic_a_periodic_signal_has_a_runner_up() {
    let x: Vec<f64> = (0..1000).map(|k| (TAU * f64::from(k) / 50.0).sin()).collect();
    let found = best_lag(&[(&x, &x[100..500])], 200).unwrap();
    let (lag, correlation) = found.runner_up.unwrap();
    assert!(found.correlation > 0.999 && correlation > 0.99, "{found:?}");
    assert!(((lag - found.samples).abs() % 50.0 - 25.0).abs() > 24.9, "{found:?}");
}

#[test]
fn refusal_what_has_no_lag_or_coherence() {
    let (flat, x) = (vec![1.0; 100], noise(100, 3));
    let told = |error: analysis::Error| error.to_string();
    assert!(told(best_lag(&[(&flat, &x)], 50).unwrap_err()).contains("the variance of a signal"));
    assert!(told(best_lag(&[], 50).unwrap_err()).contains("the number of pairs"));
    assert!(told(best_lag(&[(&x[..20], &x)], 50).unwrap_err()).contains("20 samples, and 50"));
    let settings = Welch::of_segment(80);
    assert!(told(coherence(&x, &x, 1.0, &settings).unwrap_err()).contains("120 are needed"));
    assert!(
        told(coherence(&x, &x[1..], 1.0, &settings).unwrap_err()).contains("that of the first")
    );
}
