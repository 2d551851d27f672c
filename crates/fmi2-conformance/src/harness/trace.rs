//! The trace of calls: in memory for findings, and in a file for the case of a crash.

use std::collections::VecDeque;
use std::fmt::Arguments;
use std::fs::File;
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use fmi2_sys::fmi2Status;

/// Number of calls that a finding shows.
const SHOWN: usize = 30;

/// The calls made so far.
#[derive(Debug, Default)]
pub(crate) struct CallTrace {
    calls: Mutex<VecDeque<String>>,
    file: Option<File>,
    quiet: AtomicBool,
}

impl CallTrace {
    /// A trace that is also written to the file, if there is one.
    pub(crate) fn new(file: Option<File>) -> Self {
        Self { file, ..Self::default() }
    }

    /// Records a call before it is made.
    pub(crate) fn call(&self, instance: &str, call: Arguments) {
        if self.quiet.load(Ordering::Relaxed) {
            return;
        }
        self.line(format!("{instance}: {call}"));
    }

    /// Records the status of the last call.
    pub(crate) fn answer(&self, status: fmi2Status) {
        if self.quiet.load(Ordering::Relaxed) {
            return;
        }
        let mut calls = self.calls.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(last) = calls.back_mut() {
            last.push_str(" = ");
            last.push_str(status.name());
        }
    }

    /// Forgets the calls so far.
    pub(crate) fn begin(&self, what: &str) {
        self.calls.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.line(format!("# {what}"));
    }

    /// Makes many calls with a single entry in the trace.
    pub(crate) fn quietly<T>(&self, what: &str, calls: impl FnOnce() -> T) -> T {
        self.line(what.to_owned());
        self.quiet.store(true, Ordering::Relaxed);
        let result = calls();
        self.quiet.store(false, Ordering::Relaxed);
        result
    }

    fn line(&self, text: String) {
        if let Some(mut file) = self.file.as_ref() {
            // unbuffered, for the case of a crash. A trace that cannot be written is not a finding
            let _ = writeln!(file, "{text}");
        }
        let mut calls = self.calls.lock().unwrap_or_else(PoisonError::into_inner);
        if calls.len() == SHOWN {
            calls.pop_front();
        }
        calls.push_back(text);
    }

    /// The last calls, oldest first.
    pub(crate) fn last(&self) -> Vec<String> {
        self.calls.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// The last calls in the text of a trace file.
    pub(crate) fn tail(text: &str) -> Vec<String> {
        let lines: Vec<&str> = text.lines().collect();
        let from = lines.len().saturating_sub(SHOWN);
        lines[from..].iter().map(|line| (*line).to_owned()).collect()
    }
}
