//! Signals whose spectra are known.
#![allow(dead_code, reason = "every test file uses its part")]

use std::f64::consts::{PI, TAU};

use analysis::spectrum::{Scale, Spectrum, Window};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// A sine.
pub fn sine(count: usize, rate: f64, frequency: f64, amplitude: f64) -> Vec<f64> {
    (0..count).map(|i| amplitude * (TAU * frequency * i as f64 / rate).sin()).collect()
}

/// White noise, evenly spread from -1 to 1.
pub fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let half = f64::from(1_u32 << 31);
    (0..count).map(|_| f64::from(random.next_u32()) / half - 1.0).collect()
}

/// A linear congruence that a script in any language repeats with the same bits: x' = (1103515245 x + 12345)
/// mod 2³¹ from 1, scaled to -1 to 1.
pub fn congruence(count: usize) -> Vec<f64> {
    let mut x: u64 = 1;
    let mut next = || {
        x = (1_103_515_245 * x + 12_345) % (1 << 31);
        x as f64 / f64::from(1_u32 << 30) - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// Displacement of x'' + 2ζω₀x' + ω₀²x = u, exact for u that is constant between samples.
pub fn oscillator(force: &[f64], rate: f64, frequency: f64, damping: f64) -> Vec<f64> {
    let (h, natural) = (1.0 / rate, TAU * frequency);
    let (decay, damped) = (damping * natural, natural * (1.0 - damping * damping).sqrt());
    let (e, c, s) = ((-decay * h).exp(), (damped * h).cos(), (damped * h).sin() / damped);
    let (mut x, mut v) = (0.0, 0.0);
    let step = |&u: &f64| {
        let rest = u / (natural * natural);
        let (y, w) = (x - rest, v);
        x = rest + e * ((c + decay * s) * y + s * w);
        v = e * (-natural * natural * s * y + (c - decay * s) * w);
        x
    };
    force.iter().map(step).collect()
}

/// The density that a stationary oscillation with a half-power width of `width` bins about bin `centre` is
/// expected to have through a window: Σ a(τ) e^(-πΔτ) cos 2π(k - centre)τ, with a the window's correlation.
pub fn expected_line(window: Window, width: f64, centre: f64, bins: usize) -> Spectrum {
    let length = 1024;
    let weights = window.samples(length);
    let correlation = |lag: usize| -> f64 {
        let pairs = weights.iter().zip(&weights[lag..]);
        let decay = (-PI * width * lag as f64 / length as f64).exp();
        pairs.map(|(a, b)| a * b).sum::<f64>() * decay
    };
    let terms: Vec<f64> = (0..length).map(correlation).collect();
    let value = |k: usize| {
        let turn = TAU * (k as f64 - centre) / length as f64;
        let term = |(lag, a): (usize, &f64)| a * (turn * lag as f64).cos();
        terms.iter().enumerate().map(term).sum::<f64>() - 0.5 * terms[0]
    };
    Spectrum {
        resolution: 1.0,
        values: (0..bins).map(value).collect(),
        scale: Scale::Density,
        window,
    }
}
