//! The sampled controller: when it acts, and what it holds in between.

use serde::{Deserialize, Serialize};

use crate::{
    Error,
    inputs::Course,
    parameters::Sampling,
    runge_kutta::{self, Drive},
    system::{Magnet, State},
};

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

    fn take(&mut self, voltage: f64, delayed: bool) {
        self.applied = if delayed { self.pending } else { voltage };
        self.pending = voltage;
        self.next += 1;
    }
}

/// Instants closer than this part of a sample time count as one, so that a step which ends on a
/// sampling instant by intention does so in spite of rounding.
const COINCIDENCE: f64 = 1e-9;

/// Integrates over `size` from `time`, in pieces that end at sampling instants. A sample that falls
/// on the end of a step is taken at the start of the next, when the inputs of that instant are
/// known.
pub(crate) fn integrate(
    magnet: &Magnet,
    sampling: Sampling,
    state: &mut State,
    course: &Course,
    time: f64,
    size: f64,
) -> Result<(), Error> {
    let rounding = 4.0 * f64::EPSILON * (time.abs() + size);
    let tolerance = COINCIDENCE * sampling.period + rounding;
    let mut elapsed = 0.0;
    while elapsed < size {
        let due = state.hold.start + state.hold.next as f64 * sampling.period - time;
        if due <= elapsed + tolerance {
            let [_, acceleration] = course.at(elapsed);
            let voltage = magnet.demand(state, acceleration);
            state.hold.take(voltage, sampling.delayed);
            continue;
        }
        let end = if due < size - tolerance { due } else { size };
        let drive = Drive { course, time, held: Some(state.hold.applied) };
        runge_kutta::integrate(magnet, state, &drive, elapsed, end)?;
        elapsed = end;
    }
    Ok(())
}
