//! Real time: a run limited by the wall clock.
//!
//! Step n is due (tₙ − t_begin)/factor after the beginning. A step that ends earlier waits: it sleeps
//! until shortly before, and spins for the rest, because sleeping is only exact to about 50 µs. A step
//! that ends later is an overrun. The next steps catch up, so the schedule never drifts.

use std::time::{Duration, Instant};

use results::summary::{OverrunClass, RealTime};

/// Part of a wait that is spun.
const SPUN: Duration = Duration::from_micros(200);
/// Longest single sleep, so that Ctrl-C is noticed.
const NAP: Duration = Duration::from_millis(50);
/// Upper limits of the classes of overruns (s). One more class is above them.
const LIMITS: [f64; 5] = [1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// The wall clock, or the clock of a test.
pub(super) trait Clock {
    /// Time since some fixed moment.
    fn now(&self) -> Duration;
    /// Waits for about that long.
    fn sleep(&self, time: Duration);
}

/// The wall clock.
pub(super) struct WallClock(Instant);

impl WallClock {
    pub(super) fn new() -> Self {
        Self(Instant::now())
    }
}

impl Clock for WallClock {
    fn now(&self) -> Duration {
        self.0.elapsed()
    }

    fn sleep(&self, time: Duration) {
        if time > SPUN {
            std::thread::sleep((time - SPUN).min(NAP));
        } else {
            std::hint::spin_loop();
        }
    }
}

/// Delays the steps of a run until they are due.
pub(super) struct Pacer<C> {
    clock: C,
    factor: f64,
    begin: Duration,
    start: f64,
    steps: u64,
    counts: [u64; LIMITS.len() + 1],
    worst: f64,
    sum: f64,
}

impl<C: Clock> Pacer<C> {
    /// Begins now, at the simulated time `start`.
    pub(super) fn new(clock: C, factor: f64, start: f64) -> Self {
        let begin = clock.now();
        Self {
            clock,
            factor,
            begin,
            start,
            steps: 0,
            counts: Default::default(),
            worst: 0.0,
            sum: 0.0,
        }
    }

    /// Waits until `time` is due, or until the run is interrupted. Returns by how much it is late (s).
    pub(super) fn hold(&mut self, time: f64, interrupted: impl Fn() -> bool) -> Option<f64> {
        let due = (time - self.start) / self.factor;
        self.steps += 1;
        let elapsed = || (self.clock.now() - self.begin).as_secs_f64();
        let late = elapsed() - due;
        if late <= 0.0 {
            let mut left = -late;
            while left > 0.0 && !interrupted() {
                self.clock.sleep(Duration::try_from_secs_f64(left).unwrap_or(NAP));
                left = due - elapsed();
            }
            return None;
        }
        let class = LIMITS.iter().position(|&limit| late < limit).unwrap_or(LIMITS.len());
        self.counts[class] += 1;
        self.worst = self.worst.max(late);
        self.sum += late;
        Some(late)
    }

    /// Numbers for the summary.
    pub(super) fn statistics(&self) -> RealTime {
        let overruns: u64 = self.counts.iter().sum();
        let limits = LIMITS.iter().copied().map(Some).chain([None]);
        #[expect(clippy::cast_precision_loss, reason = "a count of steps")]
        let mean_seconds = if overruns > 0 { self.sum / overruns as f64 } else { 0.0 };
        RealTime {
            factor: self.factor,
            steps: self.steps,
            overruns,
            worst_seconds: self.worst,
            mean_seconds,
            distribution: limits
                .zip(self.counts)
                .map(|(below_seconds, count)| OverrunClass { below_seconds, count })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Time passes only by sleeping and by what a test adds.
    #[derive(Default)]
    struct Fake {
        now: Cell<f64>,
        slept: Cell<f64>,
    }

    impl Clock for &Fake {
        fn now(&self) -> Duration {
            Duration::from_secs_f64(self.now.get())
        }

        fn sleep(&self, time: Duration) {
            // less than a nanosecond is left at the end
            let time = time.as_secs_f64().max(1e-9);
            self.slept.set(self.slept.get() + time);
            self.now.set(self.now.get() + time);
        }
    }

    /// Steps of 10 ms at twice real time are due every 5 ms. Work of 1 ms leaves 4 ms to wait; one
    /// step of 22 ms work makes it and the three after it late, by 17, 13, 9, 5 and 1 ms.
    #[test]
    fn analytic_overruns_are_counted_and_made_up_for() {
        let clock = Fake::default();
        let mut pacer = Pacer::new(&clock, 2.0, 1.0);
        let mut late = Vec::new();
        for n in 1..=20 {
            clock.now.set(clock.now.get() + if n == 5 { 22e-3 } else { 1e-3 });
            late.extend(pacer.hold(1.0 + f64::from(n) * 10e-3, || false));
        }
        let expected = [17e-3, 13e-3, 9e-3, 5e-3, 1e-3];
        assert_eq!(late.len(), expected.len());
        // nanoseconds of the clock, and 2^-53 of the numbers
        assert!(late.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{late:?}");
        let statistics = pacer.statistics();
        assert_eq!((statistics.steps, statistics.overruns), (20, 5));
        assert!((statistics.worst_seconds - 17e-3).abs() < 1e-8);
        assert!((statistics.mean_seconds - 9e-3).abs() < 1e-8);
        let counts: Vec<u64> = statistics.distribution.iter().map(|class| class.count).collect();
        assert_eq!(counts[4], 2, "17 and 13 ms: {counts:?}");
        assert_eq!(counts.iter().sum::<u64>(), 5);
        // twenty steps of 5 ms, less the work: the schedule has not drifted
        assert!((clock.now.get() - 0.1).abs() < 1e-7);
        assert!((clock.slept.get() - (0.1 - 19e-3 - 22e-3)).abs() < 1e-7);
    }

    #[test]
    fn issue_an_interrupted_run_waits_no_longer() {
        let clock = Fake::default();
        let mut pacer = Pacer::new(&clock, 1.0, 0.0);
        assert!(pacer.hold(1e9, || true).is_none());
        assert_eq!(clock.slept.get(), 0.0);
    }
}
