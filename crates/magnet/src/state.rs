//! The state of a magnet.

use serde::{Deserialize, Serialize};

/// Everything that changes while stepping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Filter states x₁ … x₅ (eq. 4).
    pub filter: [f64; 5],
    /// Δλ, in Wb: flux linkage beyond that of the operating current at the nominal gap.
    pub flux_deviation: f64,
    /// Operating current i_op, in A: i₀ in the linear law, the current that carries the static
    /// force at the nominal gap in the nonlinear one. Fixed by [`Magnet::initialise`](crate::Magnet::initialise).
    pub operating_current: f64,
    /// Memory of a sampled controller.
    pub hold: Hold,
}

/// Memory of a sampled controller. Instants are counted, t₀ + n·T, so they do not drift.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// Instant t₀ of the first sample, in s.
    pub start: f64,
    /// Number n of the next sample.
    pub next: u64,
    /// Voltage at the coil until then, in V.
    pub applied: f64,
    /// Voltage computed last, in V; the same unless the controller is delayed by one sample.
    pub pending: f64,
}

impl Hold {
    pub(crate) fn new(start: f64, voltage: f64) -> Self {
        Self { start, next: 0, applied: voltage, pending: voltage }
    }

    pub(crate) fn take(&mut self, voltage: f64, delayed: bool) {
        self.applied = if delayed { self.pending } else { voltage };
        self.pending = voltage;
        self.next += 1;
    }
}
