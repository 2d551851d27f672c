//! How a worker ends: by itself, with its connection, or killed.

use std::io;
use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::{NAPS, Worker};
use crate::activity::Activity;
use crate::fault::FmuFault;
use crate::interrupt;
use crate::logger::Message;

/// A call that has taken longer counts as hanging when the user insists on the end.
const PROMPT: Duration = Duration::from_millis(300);

/// How a worker was lost.
#[derive(Debug, Clone)]
pub(super) enum Loss {
    Ended(ExitStatus),
    TimedOut(Duration),
    /// the user ended the run
    GivenUp,
    /// the connection broke, though the process lives
    Broken(String),
}

impl Worker {
    /// Whether the worker has ended. Kills it if it has taken too long.
    pub(super) fn is_lost(&mut self, begin: Instant, limit: Option<Duration>) -> bool {
        if let Ok(Some(status)) = self.child.try_wait() {
            self.lose(Loss::Ended(status));
        } else if let Some(limit) = limit.filter(|limit| begin.elapsed() > *limit) {
            self.lose(Loss::TimedOut(limit));
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
        self.lose(Loss::Broken(why.to_owned()));
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
        let (instance, call) = (name.to_owned(), self.lost_in);
        match &self.loss {
            Some(Loss::Ended(status)) => match (status.signal(), status.code()) {
                (Some(signal), _) => FmuFault::Crashed { instance, call, signal, time, messages },
                (None, code) => {
                    let code = code.unwrap_or_default();
                    FmuFault::Exited { instance, call, code, time, messages }
                }
            },
            Some(Loss::TimedOut(limit)) => {
                FmuFault::TimedOut { instance, call, limit: *limit, time, messages }
            }
            Some(Loss::GivenUp) => FmuFault::GivenUp { instance, call, time, messages },
            Some(Loss::Broken(why)) => {
                FmuFault::Broken { instance, call, why: why.clone(), time, messages }
            }
            None => FmuFault::Dead { instance },
        }
    }
}
