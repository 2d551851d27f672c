//! Sensor noise: Gaussian, band-limited, a function of seed and time alone.
//!
//! Independent normal numbers g_k at the knots t_k = k·Δ are joined by the cubic B-spline,
//! n(t) = σ·Σ_k g_k·B(t/Δ − k)/√(Σ_k B²(t/Δ − k)): its RMS is σ at every instant, and it has two
//! continuous derivatives. Its power falls as sinc⁸(f·Δ): to one half at the bandwidth f_b = 0.2275/Δ,
//! to 1/19 at 2·f_b, and is below 1/1000 from 3·f_b on. The one-sided density below f_b is about σ²/(1.05·f_b).
//!
//! Knots are counted from t = 0 and their numbers are drawn by their count, so the noise depends
//! neither on steps nor on what was computed before.

use std::cell::Cell;
use std::f64::consts::TAU;

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use serde::{Deserialize, Serialize};

use crate::{
    Error,
    parameters::{finite, positive},
};

/// f_b·Δ, where sinc⁸ is one half.
const HALF_POWER: f64 = 0.227_512;

/// The longest Runge-Kutta step times f_b. The method reads the noise at both ends and in the middle
/// of its steps. At 0.1 the force errs by 4e-5 of its RMS, at 0.2 by 0.6 %, at 0.4 by 30 %.
const MAX_STEP_CYCLES: f64 = 0.1;

/// Highest bandwidth, in Hz: knots can be counted.
const MAX_BANDWIDTH: f64 = 1e9;

/// Knots before t = 0 that have numbers of their own.
const BEFORE_ZERO: i64 = 1 << 40;

/// Noise of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// σ, the RMS, in the sensor's unit.
    pub rms: f64,
    /// f_b, the frequency at which the power density has fallen to one half, in Hz.
    pub bandwidth: f64,
    /// The same seed and stream give the same noise.
    pub seed: u64,
    /// Sensors of one seed differ by this number.
    pub stream: u64,
}

impl Noise {
    pub(crate) fn check(&self, rms: &'static str, bandwidth: &'static str) -> Result<(), Error> {
        finite(rms, self.rms)?;
        if self.rms < 0.0 {
            return Err(Error::OutOfRange { name: rms, value: self.rms, must: "at least 0" });
        }
        if self.rms > 0.0 {
            positive(bandwidth, self.bandwidth)?;
            if self.bandwidth > MAX_BANDWIDTH {
                let must = "at most 1e9";
                return Err(Error::OutOfRange { name: bandwidth, value: self.bandwidth, must });
            }
        }
        Ok(())
    }

    /// Whether Runge-Kutta steps of `step` (s) resolve the noise.
    pub(crate) fn check_step(&self, name: &'static str, step: f64) -> Result<(), Error> {
        let Self { rms, bandwidth, .. } = *self;
        // the allowance lets the values that the message names pass
        if rms == 0.0 || step * bandwidth <= MAX_STEP_CYCLES * (1.0 + 1e-9) {
            return Ok(());
        }
        let [longest, highest] = [bandwidth, step].map(|it| MAX_STEP_CYCLES / it);
        Err(Error::CoarseNoise { name, bandwidth, step, longest, highest })
    }

    /// Value and rate at `time` (s). `knots` only caches.
    pub(crate) fn at(&self, time: f64, knots: &Knots) -> [f64; 2] {
        if self.rms == 0.0 {
            return [0.0; 2];
        }
        let spacing = HALF_POWER / self.bandwidth;
        let place = time / spacing;
        let cell = place.floor();
        let numbers = knots.of(cell as i64, || self.draw(cell as i64));
        let (weights, slopes) = spline(place - cell);
        let [sum, sum_rate] = [dot(&weights, &numbers), dot(&slopes, &numbers)];
        let norm = dot(&weights, &weights).sqrt();
        let norm_rate = dot(&weights, &slopes) / norm;
        let value = sum / norm;
        [self.rms * value, self.rms / spacing * (sum_rate - value * norm_rate) / norm]
    }

    /// The numbers of the four knots around a cell.
    fn draw(&self, cell: i64) -> [f64; 4] {
        let first = cell.saturating_add(BEFORE_ZERO - 1).max(0);
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(self.stream);
        // two u64 per knot
        random.set_word_pos(4 * first as u128);
        std::array::from_fn(|_| normal(random.next_u64(), random.next_u64()))
    }
}

/// The knots' numbers drawn last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Knots(Cell<Option<(i64, [f64; 4])>>);

impl Knots {
    fn of(&self, cell: i64, draw: impl FnOnce() -> [f64; 4]) -> [f64; 4] {
        match self.0.get() {
            Some((known, numbers)) if known == cell => numbers,
            _ => {
                let numbers = draw();
                self.0.set(Some((cell, numbers)));
                numbers
            }
        }
    }
}

/// A normal number from two random words (Box and Muller 1958).
fn normal(a: u64, b: u64) -> f64 {
    let unit = |word: u64| (word >> 11) as f64 / (1u64 << 53) as f64;
    (-2.0 * (1.0 - unit(a)).ln()).sqrt() * (TAU * unit(b)).cos()
}

/// Weights of the knots at −1, 0, 1, 2 for a place u in 0 … 1, and their derivatives by u.
fn spline(u: f64) -> ([f64; 4], [f64; 4]) {
    let v = 1.0 - u;
    let inner = |u: f64| (4.0 + u * u * (3.0 * u - 6.0)) / 6.0;
    let inner_slope = |u: f64| u * (1.5 * u - 2.0);
    (
        [v * v * v / 6.0, inner(u), inner(v), u * u * u / 6.0],
        [-0.5 * v * v, inner_slope(u), -inner_slope(v), 0.5 * u * u],
    )
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const NOISE: Noise = Noise { rms: 2.0, bandwidth: 50.0, seed: 7, stream: 0 };

    fn values(noise: &Noise, count: usize, interval: f64) -> Vec<f64> {
        let knots = Knots::default();
        (0..count).map(|n| noise.at(n as f64 * interval, &knots)[0]).collect()
    }

    /// 100 s hold 22,000 knots, so the RMS scatters by 0.5 % and the fourth moment by 3 %: four times that.
    #[test]
    fn analytic_noise_has_its_rms_and_is_gaussian() {
        let values = values(&NOISE, 100_000, 1e-3);
        let moment = |k: i32| values.iter().map(|v| v.powi(k)).sum::<f64>() / values.len() as f64;
        assert!(moment(1).abs() < 0.1, "{}", moment(1));
        assert!((moment(2).sqrt() / 2.0 - 1.0).abs() < 0.02, "{}", moment(2).sqrt());
        assert!((moment(4) / moment(2).powi(2) - 3.0).abs() < 0.3, "{}", moment(4));
    }

    /// Power in bands of 10 Hz around multiples of the bandwidth, over 400 segments of 0.2 s (Hann),
    /// against sinc⁸. 800 values per band scatter by 4 %; the window leaks a little into the steep
    /// flank.
    #[test]
    fn analytic_power_falls_as_sinc_to_the_eighth() {
        let (count, dt) = (200, 1e-3);
        let all = values(&NOISE, 400 * count, dt);
        let power = |frequency: f64| {
            let mut sum = 0.0;
            for segment in all.chunks(count) {
                let (mut re, mut im) = (0.0, 0.0);
                for (n, v) in segment.iter().enumerate() {
                    let window = (PI * n as f64 / count as f64).sin().powi(2);
                    let (s, c) = (TAU * frequency * n as f64 * dt).sin_cos();
                    re += window * v * c;
                    im += window * v * s;
                }
                sum += re * re + im * im;
            }
            sum
        };
        let band = |centre: f64| power(centre - 5.0) + power(centre) + power(centre + 5.0);
        let sinc8 = |f: f64| {
            let x = PI * f * HALF_POWER / 50.0;
            (x.sin() / x).powi(8)
        };
        let expected = |centre: f64| sinc8(centre - 5.0) + sinc8(centre) + sinc8(centre + 5.0);
        assert!((sinc8(50.0) - 0.5).abs() < 1e-3);
        for centre in [50.0, 100.0] {
            let (found, ideal) = (band(centre) / band(10.0), expected(centre) / expected(10.0));
            assert!((found / ideal - 1.0).abs() < 0.2, "{centre} Hz: {found} is not {ideal}");
        }
        assert!(band(200.0) < 1e-3 * band(10.0));
    }

    /// Central differences over 1e-6 s err by (1e-6·2π·50)²/6.
    #[test]
    fn analytic_rate_is_the_slope_of_the_value() {
        let knots = Knots::default();
        for n in 0..200 {
            let t = f64::from(n) * 1.37e-3;
            let [before, after] = [t - 1e-6, t + 1e-6].map(|t| NOISE.at(t, &knots)[0]);
            let slope = (after - before) / 2e-6;
            assert!((NOISE.at(t, &knots)[1] - slope).abs() < 1e-4 * 600.0, "{t}");
        }
    }

    #[test]
    fn invariant_noise_depends_on_seed_stream_and_time_only() {
        let forward = values(&NOISE, 500, 1.3e-3);
        for n in (0..500).rev() {
            let value = NOISE.at(n as f64 * 1.3e-3, &Knots::default())[0];
            assert_eq!(value.to_bits(), forward[n].to_bits());
        }
        let correlation = |other: &Noise| {
            let other = values(other, 500, 1.3e-3);
            forward.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / (500.0 * 4.0)
        };
        assert!((correlation(&NOISE) - 1.0).abs() < 0.2);
        // 150 independent knots: 0.08, three times that
        assert!(correlation(&Noise { seed: 8, ..NOISE }).abs() < 0.25);
        assert!(correlation(&Noise { stream: 1, ..NOISE }).abs() < 0.25);
        assert!(NOISE.at(-3.0, &Knots::default())[0].is_finite());
        assert!(NOISE.at(-1e30, &Knots::default())[0].is_finite());
    }
}
