//! How the process of an isolated instance ended.

use std::time::Duration;

/// How a process ended.
#[derive(Debug, Clone)]
pub enum Loss {
    /// A signal ended it.
    Crashed {
        /// Number of the signal.
        signal: i32,
    },
    /// It exited.
    Exited {
        /// Exit status of the process.
        code: i32,
    },
    /// It was killed because a call took too long.
    TimedOut {
        /// The limit.
        limit: Duration,
    },
    /// It was killed because the user ended the run during a call.
    GivenUp,
    /// It was killed because the connection broke.
    Broken {
        /// What broke the connection, in words.
        why: String,
    },
}
