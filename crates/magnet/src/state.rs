//! The state of a magnet.

use serde::{Deserialize, Serialize};

use crate::conditions::Condition;

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
    /// Time of this state, in s.
    pub time: f64,
    /// Failures, lift-off and set-down.
    pub condition: Condition,
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
    /// Voltages computed at the last samples, in V: that of sample n at n modulo their number.
    pub pending: [f64; MAX_DELAY + 1],
}

/// The longest delay of a sampled controller, in samples.
pub const MAX_DELAY: usize = 15;

impl Hold {
    pub(crate) fn new(start: f64, voltage: f64) -> Self {
        Self { start, next: 0, applied: voltage, pending: [voltage; MAX_DELAY + 1] }
    }

    /// Takes a sample: its voltage is applied `delay` samples later.
    pub(crate) fn take(&mut self, voltage: f64, delay: usize) {
        self.pending[self.place(0)] = voltage;
        self.applied = self.upcoming(delay);
        self.next += 1;
    }

    /// The voltage that the next sample applies, if it was computed `delay` samples before.
    pub(crate) fn upcoming(&self, delay: usize) -> f64 {
        self.pending[self.place(delay)]
    }

    /// Place of the sample `delay` samples before the next one.
    fn place(&self, delay: usize) -> usize {
        let count = self.pending.len();
        let next = (self.next % count as u64) as usize;
        (next + count - delay.min(MAX_DELAY)) % count
    }
}
