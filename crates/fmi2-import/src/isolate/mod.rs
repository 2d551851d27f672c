//! Instances in worker processes of their own, where a crash, an exit or an endless loop of the
//! unit's code is caught and named instead of ending the run without a word.
//!
//! A worker is the program itself, started again: [`serve_if_worker`] at the beginning of `main`
//! turns it into one. Master and worker share a piece of memory (`memfd_create`). In it lie the
//! values that a step sends and receives, and two bells: words that one side writes and the other
//! waits for, first by looking at it again and again, then asleep (`futex`). A step is one exchange:
//! the worker sets all inputs, steps, and reads all outputs between two strokes of the bells. What is
//! not part of a step goes as a message over a pair of sockets. Messages of the unit lie in a ring
//! in the shared memory, so that those before a crash are not lost.
//!
//! Workers are told to die with their master, are the first that Linux ends when memory runs
//! out, and hold their memory limit themselves.

use std::path::PathBuf;
use std::time::Duration;

#[cfg(target_os = "linux")]
mod handle;
#[cfg(target_os = "linux")]
mod memory;
#[cfg(target_os = "linux")]
mod protocol;
#[cfg(target_os = "linux")]
mod ring;
#[cfg(target_os = "linux")]
mod serve;
#[cfg(not(target_os = "linux"))]
mod unsupported;

#[cfg(target_os = "linux")]
pub(crate) use handle::Worker;
#[cfg(target_os = "linux")]
pub(crate) use ring::Ring;
#[cfg(target_os = "linux")]
pub use serve::serve_if_worker;
#[cfg(not(target_os = "linux"))]
pub(crate) use unsupported::Worker;
#[cfg(not(target_os = "linux"))]
pub use unsupported::serve_if_worker;

/// First argument of a program that is to be a worker.
#[cfg(target_os = "linux")]
const ARGUMENT: &str = "isolated-worker";

/// How long a call outside of stepping may take if only the step has a limit: units may read large
/// files while they initialize.
const LONGEST_CALL: Duration = Duration::from_secs(60);

/// An error and its causes, as texts.
#[cfg(target_os = "linux")]
fn causes(error: &dyn std::error::Error) -> Vec<String> {
    std::iter::successors(Some(error), |error| error.source()).map(ToString::to_string).collect()
}

/// How instances are isolated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Isolation {
    /// The program to start as worker, which must call [`serve_if_worker`]; left out: this program.
    pub program: Option<PathBuf>,
    /// Longest time for the exchange of one step.
    pub step_timeout: Option<Duration>,
    /// Longest time for any other call; left out: 60 s or the step's limit, whichever is longer, if
    /// the step has a limit.
    pub call_timeout: Option<Duration>,
    /// Bytes of address space that a worker may have.
    pub memory: Option<u64>,
}

impl Isolation {
    /// Longest time for a call that is no step.
    #[must_use]
    pub fn call_limit(&self) -> Option<Duration> {
        self.call_timeout.or_else(|| self.step_timeout.map(|limit| limit.max(LONGEST_CALL)))
    }
}
