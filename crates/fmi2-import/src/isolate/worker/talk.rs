//! Orders to a worker over the socket.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use super::Worker;
use crate::isolate::protocol::{Order, Report, read_frame, write_frame};

impl Worker {
    /// Sends an order and waits for the report on it. `None` if the worker is lost.
    pub(super) fn converse(&mut self, order: &Order, limit: Option<Duration>) -> Option<Report> {
        if self.loss.is_some() {
            return None;
        }
        self.strike(0);
        let mut patient = Patient { begin: Instant::now(), limit, worker: self };
        let report = write_frame(&mut patient, order).and_then(|()| read_frame(&mut patient));
        match report {
            Ok(report) => Some(report),
            Err(error) => {
                self.hung_up(&error);
                None
            }
        }
    }
}

/// Reads and writes, and checks in between that the worker lives.
struct Patient<'a> {
    worker: &'a mut Worker,
    begin: Instant,
    limit: Option<Duration>,
}

impl Patient<'_> {
    fn again<T>(
        &mut self,
        mut attempt: impl FnMut(&mut UnixStream) -> io::Result<T>,
    ) -> io::Result<T> {
        loop {
            match attempt(&mut self.worker.socket) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if self.worker.is_lost(self.begin, self.limit) {
                        return Err(io::ErrorKind::BrokenPipe.into());
                    }
                }
                result => return result,
            }
        }
    }
}

impl Read for Patient<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.again(|socket| socket.read(buffer))
    }
}

impl Write for Patient<'_> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.again(|socket| socket.write(buffer))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
