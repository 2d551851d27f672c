//! The control law (eq. 3) on the filter's estimates (eq. 5).

use crate::{
    filter::{ACCELERATION_SCALE, Filter},
    parameters::Gains,
};

/// Δv = by_state·x + by_acceleration·q̈: eq. 3 after eq. 5. The gap enters through the filter's
/// states only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ControlLaw {
    /// Voltage per filter state, in V.
    pub by_state: [f64; 5],
    /// Voltage per acceleration, in V·s²/m.
    pub by_acceleration: f64,
}

impl ControlLaw {
    pub(crate) fn new(k: &Gains, filter: &Filter) -> Self {
        let by_estimate = [k.gap, k.gap_velocity, k.acceleration, k.velocity, k.position];
        let mut by_state = [0.0; 5];
        let mut by_acceleration = 0.0;
        for (gain, (c, d)) in by_estimate.iter().zip(filter.c.iter().zip(&filter.d)) {
            for (sum, entry) in by_state.iter_mut().zip(c) {
                *sum += gain * entry;
            }
            by_acceleration += gain * d[1] * ACCELERATION_SCALE;
        }
        Self { by_state, by_acceleration }
    }

    /// Δv, in V, for filter states x and the acceleration q̈ (m/s²).
    #[inline]
    pub(crate) fn voltage(&self, x: &[f64; 5], acceleration: f64) -> f64 {
        let mut voltage = self.by_acceleration * acceleration;
        for (gain, x) in self.by_state.iter().zip(x) {
            voltage += gain * x;
        }
        voltage
    }
}
