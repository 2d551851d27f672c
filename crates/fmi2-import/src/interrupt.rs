//! What Ctrl-C and SIGTERM do to the runs of this process.
//!
//! The first one asks: a run ends after its step, see [`Observer::interrupted`](master::simulation::Observer).
//! The second one insists: a step that does not return is given up. An isolated unit's process is
//! killed, and its run completes its results as an interrupted one. A call in this process cannot be
//! ended; then the results are completed beside it, up to the last finished step, and nothing is left
//! to do but to end the process. A program says so with [`ask`], and ends itself when that says that
//! it should.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A step, or another call, may still return so long after the second signal.
pub const GRACE: Duration = Duration::from_millis(700);
/// Longest wait for results to be completed.
const PATIENCE: Duration = Duration::from_secs(20);

static ASKED: AtomicU32 = AtomicU32::new(0);
static RUNS: Mutex<Runs> = Mutex::new(Runs { going: 0, given_up: 0 });
static CHANGED: Condvar = Condvar::new();

/// Runs of this process.
struct Runs {
    going: u32,
    /// those of them that will not end, but whose results are complete
    given_up: u32,
}

/// What comes of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interruption {
    /// Runs will end after their steps.
    Asked,
    /// All runs have ended by themselves.
    Ended,
    /// There is no run, or one that will not end: the process is to be ended,
    /// see [`end_at_once`](crate::witness::end_at_once).
    GivenUp,
}

/// Asks all runs to end, the second time urgently. Call it from a thread for signals, not from a signal
/// handler: the second time it waits for the runs.
pub fn ask() -> Interruption {
    let first = ASKED.fetch_add(1, Ordering::SeqCst) == 0;
    let mut runs = runs();
    if first {
        return Interruption::Asked;
    }
    if runs.going == 0 {
        return Interruption::GivenUp;
    }
    CHANGED.notify_all();
    let begin = Instant::now();
    while runs.going > runs.given_up {
        let left = PATIENCE.saturating_sub(begin.elapsed());
        if left.is_zero() {
            return Interruption::GivenUp;
        }
        runs = wait(runs, left);
    }
    if runs.going == 0 { Interruption::Ended } else { Interruption::GivenUp }
}

/// Whether a run is still going on after a while.
#[must_use]
pub fn goes_on(after: Duration) -> bool {
    let begin = Instant::now();
    let mut runs = runs();
    while runs.going > 0 {
        let left = after.saturating_sub(begin.elapsed());
        if left.is_zero() {
            return true;
        }
        runs = wait(runs, left);
    }
    false
}

/// Whether the user wants the end now.
#[inline]
pub fn insisted() -> bool {
    ASKED.load(Ordering::Relaxed) > 1
}

/// Makes a run. If the user insists on its end and it does not end soon, `rescue` is called once, in
/// another thread, while the run goes on, if it does.
pub fn guard<T>(rescue: impl FnOnce() + Send, run: impl FnOnce() -> T) -> T {
    /// Ends the run also when it panics.
    struct Going<'a>(&'a AtomicU32);
    impl Drop for Going<'_> {
        fn drop(&mut self) {
            let mut runs = runs();
            runs.going -= 1;
            runs.given_up -= self.0.swap(ENDED, Ordering::SeqCst) & GIVEN_UP;
            CHANGED.notify_all();
        }
    }
    const GIVEN_UP: u32 = 1;
    const ENDED: u32 = 2;
    let state = AtomicU32::new(0);
    std::thread::scope(|scope| {
        runs().going += 1;
        let going = Going(&state);
        let watch = || {
            let mut runs = runs();
            let mut since = None;
            while state.load(Ordering::SeqCst) & ENDED == 0 {
                match since.map(|since: Instant| GRACE.saturating_sub(since.elapsed())) {
                    None if insisted() => since = Some(Instant::now()),
                    None => runs = CHANGED.wait(runs).unwrap_or_else(PoisonError::into_inner),
                    Some(Duration::ZERO) => break,
                    Some(left) => runs = wait(runs, left),
                }
            }
            drop(runs);
            if since.is_some() && state.load(Ordering::SeqCst) & ENDED == 0 {
                rescue();
                let mut runs = self::runs();
                if state.load(Ordering::SeqCst) & ENDED == 0 {
                    state.store(GIVEN_UP, Ordering::SeqCst);
                    runs.given_up += 1;
                    CHANGED.notify_all();
                }
            }
        };
        // without it the run goes as well, only that nobody can give it up
        let _ = std::thread::Builder::new().name("interrupt".to_owned()).spawn_scoped(scope, watch);
        let result = run();
        drop(going);
        result
    })
}

fn runs() -> MutexGuard<'static, Runs> {
    RUNS.lock().unwrap_or_else(PoisonError::into_inner)
}

fn wait(runs: MutexGuard<'static, Runs>, longest: Duration) -> MutexGuard<'static, Runs> {
    CHANGED.wait_timeout(runs, longest).unwrap_or_else(PoisonError::into_inner).0
}
