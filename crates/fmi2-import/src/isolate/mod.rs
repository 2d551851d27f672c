//! Instances in worker processes of their own. A crash, an exit or an endless loop in the code of the
//! FMU is reported with instance and call, and does not end the master.
//!
//! A worker is this program, started again: [`serve_if_worker`] at the beginning of `main` turns it into
//! one. Master and worker share memory (`memfd_create`). It contains the values that a step sends and
//! receives, and two bells: words that one side writes and the other waits for, first by polling, then
//! asleep (`futex`). A step is one exchange: between two strokes of the bells the worker sets all inputs,
//! steps, and reads all outputs. Everything else is sent as a message over a pair of sockets. Log
//! messages are stored in a ring in the shared memory, so that those before a crash are not lost.
//!
//! Linux kills a worker when its master ends, and kills workers first when memory runs out. A worker
//! sets its memory limit itself.

use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Duration;

#[cfg(target_os = "linux")]
mod memory;
#[cfg(target_os = "linux")]
mod protocol;
#[cfg(target_os = "linux")]
mod serve;
#[cfg(not(target_os = "linux"))]
mod unsupported;
#[cfg(target_os = "linux")]
mod worker;

#[cfg(target_os = "linux")]
pub use serve::serve_if_worker;
#[cfg(not(target_os = "linux"))]
pub(crate) use unsupported::Worker;
#[cfg(not(target_os = "linux"))]
pub use unsupported::serve_if_worker;
#[cfg(target_os = "linux")]
pub(crate) use worker::Worker;

/// First argument of a worker.
#[cfg(target_os = "linux")]
const ARGUMENT: &str = "isolated-worker";

/// Longest time for a call outside of stepping if only the step has a limit. FMUs may read large files
/// while they initialize.
const LONGEST_CALL: Duration = Duration::from_secs(60);

/// The program to start as worker where the settings name none, instead of this one.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Chooses the program to start as worker for all instances whose settings name none. It must call [`serve_if_worker`].
/// For a process that cannot be a worker itself, such as an interpreter. Only the first call counts.
pub fn work_in(program: PathBuf) {
    PROGRAM.get_or_init(|| program);
}

/// Settings of isolated instances.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Isolation {
    /// The program to start as worker, which must call [`serve_if_worker`]; `None`: that of
    /// [`work_in`], or this program.
    pub program: Option<PathBuf>,
    /// Longest time for the exchange of one step.
    pub step_timeout: Option<Duration>,
    /// Longest time for any other call; `None`: 60 s or the limit of the step, whichever is longer, if
    /// the step has a limit.
    pub call_timeout: Option<Duration>,
    /// Bytes of address space that a worker may have.
    pub memory: Option<u64>,
}

impl Isolation {
    /// Longest time for a call that is not a step.
    pub(crate) fn call_limit(&self) -> Option<Duration> {
        self.call_timeout.or_else(|| self.step_timeout.map(|limit| limit.max(LONGEST_CALL)))
    }
}
