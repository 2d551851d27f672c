//! The master's side of a worker: a process with one instance.

mod loss;
mod start;
mod talk;

use std::fs::File;
use std::os::unix::net::UnixStream;
use std::process::Child;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use memmap2::MmapRaw;

use super::Isolation;
use super::memory::{Area, Control, control_in, part};
use super::protocol::{Order, Report};
use crate::activity::Activity;
use crate::answer::{Answer, Outcome};
use crate::description::ModelDescription;
use crate::exchange::{Received, Sent, StepLayout};
use crate::fault::Loss;
use crate::functions::Call;
use crate::logger::{self, Message, expand};
use crate::request::{Data, Reply, Request};

/// How long each side waits awake if every worker has a processor of its own. It is longer than a step
/// of most FMUs, since waking a thread takes several µs.
const WATCH: Duration = Duration::from_micros(100);
/// Shortest and longest time asleep between checks that the worker still lives.
const NAPS: [Duration; 2] = [Duration::from_millis(2), Duration::from_millis(50)];
/// Time for a worker to end if calls have no limit.
const PARTING: Duration = Duration::from_secs(10);

/// Workers of this process.
static WORKERS: AtomicUsize = AtomicUsize::new(0);
/// Exchanges that have begun and not ended.
static BUSY: AtomicUsize = AtomicUsize::new(0);

/// How long to wait awake beside this number of awake workers: not at all if they need this processor.
fn watch_time(workers: &AtomicUsize) -> Duration {
    static PROCESSORS: OnceLock<usize> = OnceLock::new();
    let processors =
        PROCESSORS.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from));
    if workers.load(Ordering::Relaxed) < *processors { WATCH } else { Duration::ZERO }
}

/// A process with one instance.
pub(crate) struct Worker {
    child: Child,
    socket: UnixStream,
    memory: File,
    map: MmapRaw,
    area: Area,
    isolation: Isolation,
    stroke: u32,
    /// parts of an exchange that are postponed to the next one
    waiting: u32,
    /// whether an exchange has begun and not ended
    begun: bool,
    /// whether the outputs in memory are those at the end of the last step
    fresh: bool,
    loss: Option<Loss>,
    /// what it was doing when it was lost
    lost_in: Activity,
}

impl Worker {
    fn control(&self) -> &Control {
        // SAFETY: the mapping lives as long as self and is a Control, whose fields are atomic or
        // synchronised by the ring
        unsafe { &*control_in(&self.map) }
    }

    /// Answers a request.
    pub(crate) fn perform(&mut self, request: &Request) -> Reply {
        let lost = Reply { answer: LOST, data: Data::None };
        if self.begun || self.waiting != 0 {
            let answer = self.exchange(0);
            if !answer.can_continue() {
                return Reply { answer, data: Data::None };
            }
        }
        self.fresh = false;
        let limit = self.isolation.call_limit();
        match self.converse(&Order::Perform(request.clone()), limit) {
            Some(Report::Reply(reply)) => reply,
            Some(_) => self.broken("unexpected answer", lost),
            None => lost,
        }
    }

    /// Defines what steps send and receive.
    pub(crate) fn lay_out(&mut self, layout: &StepLayout) -> Answer {
        self.fresh = false;
        self.waiting = 0;
        match Area::map(&self.memory, layout) {
            Ok(area) => self.area = area,
            Err(error) => return self.broken(&error.to_string(), LOST),
        }
        let limit = self.isolation.call_limit();
        match self.converse(&Order::LayOut(layout.clone()), limit) {
            Some(Report::Done) => Answer::good(Call::fmi2SetReal),
            Some(_) => self.broken("unexpected answer", LOST),
            None => LOST,
        }
    }

    /// Writes inputs for the next exchange.
    #[inline]
    pub(crate) fn send(&mut self, sent: &Sent) -> Answer {
        if self.begun {
            let answer = self.finish();
            if !answer.can_continue() {
                return answer;
            }
        }
        self.area.put(sent);
        self.waiting |= part::SEND;
        Answer::good(Call::fmi2SetReal)
    }

    /// Begins an exchange with a step.
    #[inline]
    pub(crate) fn begin_step(&mut self, time: f64, size: f64, save: Option<usize>) -> Answer {
        self.control().set_step(time, size);
        let mut parts = part::STEP | part::RECEIVE;
        if let Some(slot) = save.and_then(|slot| u32::try_from(slot).ok()) {
            self.control().slot.store(slot, Ordering::Relaxed);
            parts |= part::SAVE;
        }
        self.begin(parts);
        Answer::good(Call::fmi2DoStep)
    }

    /// Ends the step that has begun, or makes a whole one.
    #[inline]
    pub(crate) fn do_step(&mut self, time: f64, size: f64, save: Option<usize>) -> Answer {
        if !self.begun {
            let _ = self.begin_step(time, size, save);
        }
        let answer = self.finish();
        self.fresh = answer.can_continue();
        answer
    }

    /// Reads the outputs. They came with the step; otherwise they are requested first.
    #[inline]
    pub(crate) fn receive(&mut self, received: &mut Received) -> Answer {
        if !self.fresh {
            let answer = self.exchange(part::RECEIVE);
            if !answer.can_continue() {
                return answer;
            }
        }
        self.area.take(received);
        Answer::good(Call::fmi2GetReal)
    }

    /// Takes the FMU's messages, with variable references expanded.
    pub(crate) fn take_messages(&mut self, description: &ModelDescription) -> Vec<Message> {
        let mut messages = self.control().ring.take();
        for message in &mut messages {
            message.text = expand(&message.text, description);
        }
        messages
    }

    fn exchange(&mut self, parts: u32) -> Answer {
        if self.begun {
            let answer = self.finish();
            if !answer.can_continue() || parts == 0 {
                return answer;
            }
        }
        self.begin(parts);
        self.finish()
    }

    fn begin(&mut self, parts: u32) {
        let parts = parts | std::mem::take(&mut self.waiting);
        self.begun = true;
        BUSY.fetch_add(1, Ordering::Relaxed);
        self.fresh = false;
        self.strike(parts);
    }

    fn strike(&mut self, parts: u32) {
        self.stroke = self.stroke.wrapping_add(1);
        let stroke = self.stroke;
        let control = self.control();
        let watch = u32::try_from(watch_time(&WORKERS).as_micros()).unwrap_or(0);
        control.watch.store(watch, Ordering::Relaxed);
        control.parts.store(parts, Ordering::Relaxed);
        control.to_worker.ring(stroke);
    }

    /// Waits for the end of an exchange.
    #[inline]
    fn finish(&mut self) -> Answer {
        self.begun = false;
        let ended = self.loss.is_none()
            && (self.control().to_master.watch(self.stroke, watch_time(&BUSY)) || self.wait());
        BUSY.fetch_sub(1, Ordering::Relaxed);
        if !ended {
            return LOST;
        }
        let control = self.control();
        if control.ring.has_some() {
            logger::note_arrival();
        }
        control.answer()
    }

    /// Waits asleep, and checks from time to time that the worker lives.
    #[cold]
    fn wait(&mut self) -> bool {
        let begin = Instant::now();
        let mut nap = NAPS[0];
        while !self.control().to_master.sleep(self.stroke, nap) {
            if self.is_lost(begin, self.isolation.step_timeout) {
                // it may have answered just before its end
                return self.control().to_master.has_rung(self.stroke);
            }
            nap = (nap * 2).min(NAPS[1]);
        }
        true
    }
}

const LOST: Answer = Answer { call: Call::fmi2DoStep, outcome: Outcome::Lost };

impl Drop for Worker {
    fn drop(&mut self) {
        WORKERS.fetch_sub(1, Ordering::Relaxed);
        if self.begun {
            let _ = self.finish();
        }
        if self.loss.is_none() {
            let limit = self.isolation.call_limit().unwrap_or(PARTING);
            if matches!(self.converse(&Order::Free, Some(limit)), Some(Report::Done)) {
                let begin = Instant::now();
                while !self.is_lost(begin, Some(limit)) {
                    std::thread::sleep(Duration::from_micros(200));
                }
            }
        }
        self.end();
    }
}
