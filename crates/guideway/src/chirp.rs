//! Excitation force of eq. 13.

use std::f64::consts::PI;

use crate::Error;
use crate::description::ChirpDescription;

/// A·sin(π(t−t₀)²) at a fixed place, from t₀ until its frequency reaches the last one.
///
/// The instantaneous frequency is d(phase)/dt/2π = t−t₀ in Hz. So that the force ends without a
/// jump, it stops at the last zero of the sine, t−t₀ = √k with k the largest integer ≤ f_end².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChirpForce {
    amplitude: f64,
    position: f64,
    start: f64,
    end: f64,
}

impl ChirpForce {
    /// Checks the description; `default_position` (m) is used where it gives none.
    pub(crate) fn new(
        given: &ChirpDescription,
        default_position: f64,
    ) -> Result<Option<Self>, Error> {
        if !given.on {
            return Ok(None);
        }
        let position = given.position.unwrap_or(default_position);
        for (name, value) in [
            ("amplitude", given.amplitude),
            ("position", position),
            ("start", given.start),
            ("end_frequency", given.end_frequency),
        ] {
            if !value.is_finite() {
                return Err(Error::invalid(
                    format!("chirp.{name}"),
                    format!("{value}"),
                    "give a finite value",
                ));
            }
        }
        if given.end_frequency < 0.0 {
            return Err(Error::invalid(
                "chirp.end_frequency",
                format!("{} Hz", given.end_frequency),
                "give a frequency of at least 0",
            ));
        }
        let zeros = (given.end_frequency * given.end_frequency).floor();
        Ok(Some(Self {
            amplitude: given.amplitude,
            position,
            start: given.start,
            end: given.start + zeros.sqrt(),
        }))
    }

    /// Force (N) at time t (s), positive downward.
    pub fn at(&self, t: f64) -> f64 {
        if t <= self.start || t >= self.end {
            return 0.0;
        }
        let s = t - self.start;
        // Reduce the phase π·s² to one turn before taking the sine: s² is up to 1e4 half turns.
        let half_turns = s * s;
        self.amplitude * libm::sin(PI * (half_turns - 2.0 * (0.5 * half_turns).floor()))
    }

    /// Position along the track (m).
    pub fn position(&self) -> f64 {
        self.position
    }

    /// Upper bound of the change of its phase (rad) between t and t + h.
    pub(crate) fn phase(&self, t: f64, h: f64) -> f64 {
        if t + h <= self.start || t >= self.end {
            return 0.0;
        }
        2.0 * PI * ((t + h).min(self.end) - self.start) * h
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chirp(end_frequency: f64) -> ChirpForce {
        let given = ChirpDescription {
            on: true,
            amplitude: 2.0,
            start: 1.0,
            end_frequency,
            ..ChirpDescription::default()
        };
        ChirpForce::new(&given, 12.5).unwrap().unwrap()
    }

    #[test]
    fn analytic_frequency_in_hz_equals_time_in_s() {
        let c = chirp(100.0);
        // Zeros at t−t₀ = √k; between the k-th and the next the sign is (−1)ᵏ.
        for k in [1u32, 2, 99, 5000] {
            let middle = 1.0 + (f64::from(k) + 0.5).sqrt();
            let expected = if k % 2 == 0 { 2.0 } else { -2.0 };
            // (k + 0.5) is recovered from its root to about k·ε, the sine is flat there.
            assert!((c.at(middle) - expected).abs() < 1e-9, "{k}");
        }
        assert_eq!((c.at(0.5), c.at(1.0), c.at(101.0), c.at(200.0)), (0.0, 0.0, 0.0, 0.0));
        assert_eq!(c.position(), 12.5);
    }

    #[test]
    fn invariant_the_force_ends_without_a_jump() {
        // f_end² = 110.25 is no integer: the end is put at the last zero, √110 s.
        let c = chirp(10.5);
        let end = 1.0 + 110f64.sqrt();
        assert_eq!(c.at(end), 0.0);
        // Slope there is 2π·f·A ≈ 132 N/s.
        assert!(c.at(end - 1e-6).abs() < 1.4e-4 && c.at(end - 1e-6) != 0.0);
    }
}
