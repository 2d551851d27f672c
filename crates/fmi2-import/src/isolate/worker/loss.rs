//! How a worker ends: by itself, with its connection, or killed.

use std::io;
use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::{NAPS, Worker};
use crate::activity::Activity;
use crate::fault::{FmuFault, Loss};
use crate::interrupt;
use crate::logger::Message;

/// A call that has taken longer counts as hanging when the user insists on the end.
const PROMPT: Duration = Duration::from_millis(300);

impl Worker {
    /// Whether the worker has ended. Kills it if it has taken too long.
    pub(super) fn is_lost(&mut self, begin: Instant, limit: Option<Duration>) -> bool {
        if let Ok(Some(status)) = self.child.try_wait() {
            self.lose(loss_of(status));
        } else if let Some(limit) = limit.filter(|limit| begin.elapsed() > *limit) {
            self.lose(Loss::TimedOut { limit });
        } else if interrupt::insisted() && begin.elapsed() > PROMPT {
            self.lose(Loss::GivenUp);
        }
        self.loss.is_some()
    }

    pub(super) fn lose(&mut self, loss: Loss) {
        if self.loss.is_none() {
            self.lost_in = Activity::from_number(self.control().mark.load(Ordering::Relaxed));
            self.loss = Some(loss);
            self.end();
        }
    }

    pub(super) fn broken<T>(&mut self, why: &str, value: T) -> T {
        self.lose(Loss::Broken { why: why.to_owned() });
        value
    }

    /// Handles the end of the connection. Usually the process has ended too.
    pub(super) fn hung_up(&mut self, error: &io::Error) {
        let begin = Instant::now();
        while !self.is_lost(begin, None) {
            if begin.elapsed() > Duration::from_secs(1) {
                return self.broken(&error.to_string(), ());
            }
            std::thread::sleep(NAPS[0]);
        }
    }

    /// Kills the process if it lives.
    pub(super) fn end(&mut self) {
        // both fail only if there is none
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Why the worker has ended.
    pub(crate) fn loss(&self, name: &str, time: Option<f64>, messages: Vec<Message>) -> FmuFault {
        let instance = name.to_owned();
        match self.loss.clone() {
            Some(how) => FmuFault::Lost { instance, how, call: self.lost_in, time, messages },
            None => FmuFault::Dead { instance },
        }
    }
}

fn loss_of(status: ExitStatus) -> Loss {
    match status.signal() {
        Some(signal) => Loss::Crashed { signal },
        None => Loss::Exited { code: status.code().unwrap_or_default() },
    }
}
