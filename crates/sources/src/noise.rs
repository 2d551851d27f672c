//! Normally distributed values at equal intervals.
//!
//! Value n is a function of the seed and n alone, so that a run that is resumed, or that repeats a step, sees the same
//! values: two numbers from SplitMix64 (Steele, Lea & Flood, "Fast splittable pseudorandom number generators", 2014),
//! turned into a normally distributed one by Box and Muller.

use std::f64::consts::TAU;

use scenario::{Interpolation, NoiseSignal};

use crate::{Break, MAX_BREAKS, SourceError};

/// Noise.
#[derive(Debug, Clone)]
pub struct Noise(NoiseSignal);

impl Noise {
    pub(crate) fn new(signal: NoiseSignal) -> Self {
        Self(signal)
    }

    pub(crate) fn interpolation(&self) -> Interpolation {
        self.0.interpolation
    }

    #[expect(clippy::cast_possible_truncation, reason = "a cast of a float saturates")]
    pub(crate) fn index(&self, time: f64) -> i64 {
        let interval = self.0.interval;
        let n = (time / interval).floor() as i64;
        // the quotient of a time n · interval may be rounded to below n
        if self.time(n.saturating_add(1)) <= time { n.saturating_add(1) } else { n }
    }

    /// Time of a value (s).
    #[expect(clippy::cast_precision_loss, reason = "exact up to 2^53 values")]
    fn time(&self, n: i64) -> f64 {
        n as f64 * self.0.interval
    }

    pub(crate) fn piece(&self, index: i64, time: f64) -> [f64; 4] {
        let now = self.value(index);
        if self.0.interpolation == Interpolation::Hold {
            return [now, 0.0, 0.0, 0.0];
        }
        let slope = (self.value(index.wrapping_add(1)) - now) / self.0.interval;
        [now + slope * (time - self.time(index)), slope, 0.0, 0.0]
    }

    fn value(&self, n: i64) -> f64 {
        let state = mixed(self.0.seed ^ mixed(n.cast_unsigned()));
        let radius = (-2.0 * (1.0 - uniform(mixed(state))).ln()).sqrt();
        let angle = TAU * uniform(mixed(state ^ 0x5851_f42d_4c95_7f2d));
        self.0.mean + self.0.rms * radius * angle.cos()
    }

    pub(crate) fn breaks(&self, start: f64, stop: f64) -> Result<Vec<Break>, SourceError> {
        if self.0.interpolation != Interpolation::Hold {
            return Ok(Vec::new());
        }
        let mut breaks = Vec::new();
        for n in self.index(start).. {
            let time = self.time(n);
            if time >= stop {
                break;
            }
            if breaks.len() >= MAX_BREAKS {
                return Err(SourceError::TooMany);
            }
            if time >= start {
                breaks.push(Break { time, jump: true });
            }
        }
        Ok(breaks)
    }
}

/// One step of SplitMix64.
fn mixed(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) from the upper 53 bits.
#[expect(clippy::cast_precision_loss, reason = "53 bits")]
fn uniform(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}
