//! Points that are still to be computed, for several workers.

use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::Study;
use crate::journal::Rows;

/// How often a point is tried whose process is killed from outside: by a user, a batch system, or for want of memory.
pub(crate) const KILLS: u32 = 100;

/// The points that no worker has begun.
pub(crate) struct Queue<'a> {
    study: &'a Study,
    known: &'a Rows,
    /// whether points without a regular row are computed again
    retry: bool,
    state: Mutex<State>,
}

struct State {
    /// the next number that was not looked at
    next: u64,
    last: u64,
    /// points whose process ended
    again: VecDeque<u64>,
    crashes: HashMap<u64, u32>,
    kills: HashMap<u64, u32>,
    closed: bool,
}

/// How the process of a point ended before its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loss {
    /// By its own fault.
    Crashed,
    /// By a signal from outside, which only Unix tells.
    #[cfg_attr(not(unix), expect(dead_code, reason = "see above"))]
    Killed,
}

impl<'a> Queue<'a> {
    pub(crate) fn new(
        study: &'a Study,
        known: &'a Rows,
        (first, last): (u64, u64),
        retry: bool,
    ) -> Self {
        let state = State {
            next: first,
            last,
            again: VecDeque::new(),
            crashes: HashMap::new(),
            kills: HashMap::new(),
            closed: false,
        };
        Self { study, known, retry, state: Mutex::new(state) }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a point is still to be computed.
    pub(crate) fn is_open(&self, name: &str) -> bool {
        match self.known.status(name) {
            None => true,
            Some(status) => self.retry && !status.is_regular(),
        }
    }

    /// The next point to compute.
    pub(crate) fn take(&self) -> Option<u64> {
        let mut state = self.state();
        if state.closed {
            return None;
        }
        if let Some(number) = state.again.pop_front() {
            return Some(number);
        }
        while state.next <= state.last {
            let number = state.next;
            state.next += 1;
            let point = self.study.point(number).ok()?;
            if self.is_open(&point.name) {
                return Some(number);
            }
        }
        None
    }

    /// Returns a point that was not begun.
    pub(crate) fn give_back(&self, number: u64) {
        self.state().again.push_back(number);
    }

    /// Returns a point whose process ended. False if it has been tried often enough.
    pub(crate) fn lost(&self, number: u64, loss: Loss) -> bool {
        let mut state = self.state();
        let (counts, most) = match loss {
            Loss::Crashed => (&mut state.crashes, self.study.file().tries),
            Loss::Killed => (&mut state.kills, KILLS),
        };
        let count = counts.entry(number).or_insert(0);
        *count += 1;
        let again = *count < most;
        if again {
            state.again.push_front(number);
        }
        again
    }

    /// No more points are given out.
    pub(crate) fn close(&self) {
        self.state().closed = true;
    }
}
