//! Ending the runs of this process on Ctrl-C and SIGTERM.
//!
//! After the first signal a run ends at the end of its step. After the second one it does not wait for a
//! step that does not return. The process of an isolated instance is killed, and the run completes its
//! results as interrupted. A call in this process cannot be ended; the results up to the last finished
//! step are completed in another thread, and then the process must end. A program calls [`ask`] for each
//! signal and does what its result says.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time for a call to return after the second signal.
const GRACE: Duration = Duration::from_millis(700);
/// Longest time to wait for complete results.
const PATIENCE: Duration = Duration::from_secs(20);

static ASKED: AtomicU32 = AtomicU32::new(0);
static RUNS: Mutex<Runs> = Mutex::new(Runs { active: 0, given_up: 0 });
static CHANGED: Condvar = Condvar::new();

/// Runs of this process.
struct Runs {
    active: u32,
    /// those that will not end, but whose results are complete
    given_up: u32,
}

/// What to do after a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interruption {
    /// Nothing: runs will end after their steps.
    Asked,
    /// Nothing: all runs have ended.
    Ended,
    /// End the process with [`end_at_once`](crate::witness::end_at_once): there is no run, or one that will
    /// not end.
    GivenUp,
}

/// Asks all runs to end, the second time urgently. Call it in a thread for signals, not in a signal
/// handler, since the second call waits for the runs.
pub fn ask() -> Interruption {
    let first = ASKED.fetch_add(1, Ordering::SeqCst) == 0;
    let mut runs = runs();
    if first {
        return Interruption::Asked;
    }
    if runs.active == 0 {
        return Interruption::GivenUp;
    }
    CHANGED.notify_all();
    let begin = Instant::now();
    while runs.active > runs.given_up {
        let left = PATIENCE.saturating_sub(begin.elapsed());
        if left.is_zero() {
            return Interruption::GivenUp;
        }
        runs = wait(runs, left);
    }
    if runs.active == 0 { Interruption::Ended } else { Interruption::GivenUp }
}

/// Whether a run is still active after this time.
#[must_use]
pub fn still_running(after: Duration) -> bool {
    let begin = Instant::now();
    let mut runs = runs();
    while runs.active > 0 {
        let left = after.saturating_sub(begin.elapsed());
        if left.is_zero() {
            return true;
        }
        runs = wait(runs, left);
    }
    false
}

/// Whether there was a second signal.
#[inline]
pub fn insisted() -> bool {
    ASKED.load(Ordering::Relaxed) > 1
}

/// Executes `run`. If it does not end soon after the second signal, `rescue` is called once in another
/// thread while the run continues.
pub fn guard<T>(rescue: impl FnOnce() + Send, run: impl FnOnce() -> T) -> T {
    /// Ends the run even if it panics.
    struct Active<'a>(&'a AtomicU32);
    impl Drop for Active<'_> {
        fn drop(&mut self) {
            let mut runs = runs();
            runs.active -= 1;
            runs.given_up -= self.0.swap(ENDED, Ordering::SeqCst) & GIVEN_UP;
            CHANGED.notify_all();
        }
    }
    const GIVEN_UP: u32 = 1;
    const ENDED: u32 = 2;
    let state = AtomicU32::new(0);
    std::thread::scope(|scope| {
        runs().active += 1;
        let active = Active(&state);
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
        // without this thread the run works too, but cannot be given up
        let _ = std::thread::Builder::new().name("interrupt".to_owned()).spawn_scoped(scope, watch);
        let result = run();
        drop(active);
        result
    })
}

fn runs() -> MutexGuard<'static, Runs> {
    RUNS.lock().unwrap_or_else(PoisonError::into_inner)
}

fn wait(runs: MutexGuard<'static, Runs>, longest: Duration) -> MutexGuard<'static, Runs> {
    CHANGED.wait_timeout(runs, longest).unwrap_or_else(PoisonError::into_inner).0
}
