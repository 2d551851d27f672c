//! The record of calls, kept in memory for findings and in a file for the case of a crash.

use std::collections::VecDeque;
use std::fmt::Arguments;
use std::fs::File;
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use fmi2_sys::fmi2Status;

/// Calls that a finding shows.
const SHOWN: usize = 30;

/// The calls made so far.
#[derive(Debug, Default)]
pub(crate) struct CallTrace {
    calls: Mutex<VecDeque<String>>,
    file: Option<File>,
    quiet: AtomicBool,
}

impl CallTrace {
    /// A trace that is also written to the file.
    pub(crate) fn new(file: Option<File>) -> Self {
        Self { file, ..Self::default() }
    }

    /// Notes a call that is about to be made.
    pub(crate) fn call(&self, instance: &str, call: Arguments) {
        if self.quiet.load(Ordering::Relaxed) {
            return;
        }
        self.line(format!("{instance}: {call}"));
    }

    /// Notes what the last call returned.
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

    /// Begins anew.
    pub(crate) fn begin(&self, what: &str) {
        self.calls.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.line(format!("# {what}"));
    }

    /// Makes calls that are noted as a whole.
    pub(crate) fn quietly<T>(&self, what: &str, calls: impl FnOnce() -> T) -> T {
        self.line(what.to_owned());
        self.quiet.store(true, Ordering::Relaxed);
        let result = calls();
        self.quiet.store(false, Ordering::Relaxed);
        result
    }

    fn line(&self, text: String) {
        if let Some(mut file) = self.file.as_ref() {
            // unbuffered: a crash must leave it whole. A trace that cannot be written is no finding
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

    /// The last calls out of a trace's file.
    pub(crate) fn tail(text: &str) -> Vec<String> {
        let lines: Vec<&str> = text.lines().collect();
        let from = lines.len().saturating_sub(SHOWN);
        lines[from..].iter().map(|line| (*line).to_owned()).collect()
    }
}
