//! Wall time of an instance's calls.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// One in so many steps is timed, since reading the clock costs as much as the step of a small unit. A
/// prime, so that it does not coincide with a period of the unit.
const TIMED: u64 = 7;

/// Wall time of an instance, extrapolated from every seventh step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timing {
    timed: u64,
    sent: u64,
    now: bool,
    pub(super) stepping: Duration,
    pub(super) exchanging: Duration,
}

/// Seconds that an empty timed section takes: the cost of reading the clock.
fn clock_cost() -> f64 {
    static COST: OnceLock<f64> = OnceLock::new();
    *COST.get_or_init(|| {
        let shortest = (0..200).map(|_| Instant::now().elapsed()).min();
        shortest.unwrap_or_default().as_secs_f64()
    })
}

impl Timing {
    fn scaled(&self, time: Duration, sections: u64) -> f64 {
        if self.timed == 0 {
            return 0.0;
        }
        #[expect(clippy::cast_precision_loss, reason = "counts of steps")]
        let (timed, sent, sections) = (self.timed as f64, self.sent as f64, sections as f64);
        let net = time.as_secs_f64() - timed * sections * clock_cost();
        net.max(0.0) * sent / timed
    }

    /// Seconds in `fmi2DoStep`.
    #[must_use]
    pub fn step_seconds(&self) -> f64 {
        self.scaled(self.stepping, 1)
    }

    /// Seconds in the calls that set inputs and get outputs.
    #[must_use]
    pub fn exchange_seconds(&self) -> f64 {
        self.scaled(self.exchanging, 2)
    }

    pub(super) fn begin_step(&mut self) {
        self.now = self.sent.is_multiple_of(TIMED);
        self.sent += 1;
        self.timed += u64::from(self.now);
    }

    #[inline]
    pub(super) fn begin(&self) -> Option<Instant> {
        self.now.then(Instant::now)
    }
}
