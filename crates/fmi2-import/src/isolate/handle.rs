//! The master's side of a worker.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd as _;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use memmap2::MmapRaw;
use rustix::fs::MemfdFlags;

use super::memory::{Area, Control, control, control_in, part};
use super::protocol::{Order, Report, read_frame, write_frame};
use super::{ARGUMENT, Isolation};
use crate::component::{
    Answer, Data, IDLE, Identity, LOADING, Outcome, Received, Reply, Request, Sent, StepLayout,
};
use crate::description::ModelDescription;
use crate::instance::{FmuError, FmuFault};
use crate::interrupt;
use crate::library::{Call, Functions, LibraryError};
use crate::logger::{self, Message, expand};
use crate::package::Package;

/// How long each side waits awake when every worker has a processor of its own: longer than a
/// step of most units, as waking a sleeper costs several µs.
const WATCH: Duration = Duration::from_micros(100);
/// Shortest and longest time asleep before a look at whether the worker still lives.
const NAPS: [Duration; 2] = [Duration::from_millis(2), Duration::from_millis(50)];
/// A worker that is asked to end and has no limit otherwise gets this long.
const PARTING: Duration = Duration::from_secs(10);

/// A call that is longer under way when the user wants the end counts as hanging.
const PROMPT: Duration = Duration::from_millis(300);

/// Workers of this process.
static WORKERS: AtomicUsize = AtomicUsize::new(0);
/// Exchanges that have begun and not ended.
static BUSY: AtomicUsize = AtomicUsize::new(0);

/// How long to wait awake when so many workers may be awake too: no time if they need this
/// processor.
fn watch_time(workers: &AtomicUsize) -> Duration {
    static PROCESSORS: OnceLock<usize> = OnceLock::new();
    let processors =
        PROCESSORS.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from));
    if workers.load(Ordering::Relaxed) < *processors { WATCH } else { Duration::ZERO }
}

/// How a worker was lost.
#[derive(Debug, Clone)]
enum Loss {
    Ended(ExitStatus),
    TimedOut(Duration),
    /// the user wants the end
    GivenUp,
    /// the connection broke, though the process lives
    Broken(String),
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
    /// parts of an exchange that wait for the next one
    waiting: u32,
    /// whether an exchange is going on
    begun: bool,
    /// whether the outputs in memory are those at the end of the last step
    fresh: bool,
    loss: Option<Loss>,
    /// the call that it was lost in
    lost_in: u32,
}

impl Worker {
    /// Starts a process, which loads the package's binary and creates an instance.
    pub(crate) fn start(
        package: &Arc<Package>,
        isolation: &Isolation,
        identity: &Identity,
        name: &str,
    ) -> Result<Self, FmuError> {
        let instance = || name.to_owned();
        Functions::check_presence(package).map_err(|error| unloadable(name, &error))?;
        let started = Self::spawn(isolation, name)
            .map_err(|source| FmuFault::NoProcess { instance: instance(), source })?;
        let mut worker = started;
        let order = Order::Start {
            unit: package.path().to_owned(),
            binary: package.binary(),
            identity: identity.clone(),
            memory: isolation.memory,
        };
        let report = worker.converse(&order, isolation.call_limit());
        if matches!(report, Some(Report::Done)) {
            return Ok(worker);
        }
        let messages = worker.take_messages(package.description());
        match report {
            Some(Report::Unloadable(causes)) => {
                Err(FmuFault::Unloadable { instance: instance(), causes }.into())
            }
            Some(_) => Err(FmuFault::Refused { instance: instance(), messages }.into()),
            None => Err(worker.loss(name, None, messages).into()),
        }
    }

    fn spawn(isolation: &Isolation, name: &str) -> io::Result<Self> {
        let memory = File::from(rustix::fs::memfd_create("isolated-unit", MemfdFlags::CLOEXEC)?);
        let map = control(&memory)?;
        let area = Area::map(&memory, &StepLayout::default())?;
        let (socket, theirs) = UnixStream::pair()?;
        let program = match &isolation.program {
            Some(program) => program.clone(),
            None => std::env::current_exe()?,
        };
        let mut command = Command::new(&program);
        // Ctrl-C is for the master, which ends its workers
        command.process_group(0).stdin(Stdio::null());
        // both are closed in whatever else this process starts
        let (shared, end) = (memory.try_clone()?, theirs);
        let numbers = [shared.as_raw_fd(), end.as_raw_fd()];
        command
            .arg(ARGUMENT)
            .args(numbers.map(|number| number.to_string()))
            .arg(std::process::id().to_string())
            .arg(name);
        let keep = move || {
            rustix::io::fcntl_setfd(&shared, rustix::io::FdFlags::empty())?;
            rustix::io::fcntl_setfd(&end, rustix::io::FdFlags::empty())?;
            Ok(())
        };
        // SAFETY: between fork and exec, only two fcntl are called
        let child = unsafe { command.pre_exec(keep) }.spawn().map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", program.display()))
        })?;
        // with the command goes its hold on their end, so that the socket ends with the worker
        drop(command);
        WORKERS.fetch_add(1, Ordering::Relaxed);
        let worker = Self {
            child,
            socket,
            memory,
            map,
            area,
            isolation: isolation.clone(),
            stroke: 0,
            waiting: 0,
            begun: false,
            fresh: false,
            loss: None,
            lost_in: IDLE,
        };
        worker.control().mark.store(LOADING, Ordering::Relaxed);
        worker.socket.set_read_timeout(Some(NAPS[1]))?;
        worker.socket.set_write_timeout(Some(NAPS[1]))?;
        Ok(worker)
    }

    fn control(&self) -> &Control {
        // SAFETY: the mapping lives as long as self and is a Control, whose fields are atomic or
        // looked after by the ring
        unsafe { &*control_in(&self.map) }
    }

    /// Answers a request.
    pub(crate) fn perform(&mut self, request: &Request) -> Reply {
        let lost = Reply { answer: LOST, data: Data::None };
        if self.begun || self.waiting != 0 {
            let answer = self.exchange(0);
            if !answer.goes_on() {
                return Reply { answer, data: Data::None };
            }
        }
        self.fresh = false;
        let limit = self.isolation.call_limit();
        match self.converse(&Order::Perform(request.clone()), limit) {
            Some(Report::Reply(reply)) => reply,
            Some(_) => self.broken("an answer that does not fit", lost),
            None => lost,
        }
    }

    /// Tells what steps send and receive.
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
            Some(_) => self.broken("an answer that does not fit", LOST),
            None => LOST,
        }
    }

    /// Leaves inputs for the next exchange.
    #[inline]
    pub(crate) fn send(&mut self, sent: &Sent) -> Answer {
        if self.begun {
            let answer = self.finish();
            if !answer.goes_on() {
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

    /// Ends the step that has begun, or makes one.
    #[inline]
    pub(crate) fn do_step(&mut self, time: f64, size: f64, save: Option<usize>) -> Answer {
        if !self.begun {
            let _ = self.begin_step(time, size, save);
        }
        let answer = self.finish();
        self.fresh = answer.goes_on();
        answer
    }

    /// Reads the outputs, which have come with the step, or else are asked for.
    #[inline]
    pub(crate) fn receive(&mut self, received: &mut Received) -> Answer {
        if !self.fresh {
            let answer = self.exchange(part::RECEIVE);
            if !answer.goes_on() {
                return answer;
            }
        }
        self.area.take(received);
        Answer::good(Call::fmi2GetReal)
    }

    /// Takes the unit's messages, with variable references expanded.
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
            if !answer.goes_on() || parts == 0 {
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

    /// Waits asleep, looking after the worker from time to time.
    #[cold]
    fn wait(&mut self) -> bool {
        let begin = Instant::now();
        let mut nap = NAPS[0];
        while !self.control().to_master.sleep(self.stroke, nap) {
            if self.is_lost(begin, self.isolation.step_timeout) {
                // its last stroke may have come just before its end
                return self.control().to_master.has_rung(self.stroke);
            }
            nap = (nap * 2).min(NAPS[1]);
        }
        true
    }

    /// Whether the worker has ended, or its time is up.
    fn is_lost(&mut self, begin: Instant, limit: Option<Duration>) -> bool {
        if let Ok(Some(status)) = self.child.try_wait() {
            self.lose(Loss::Ended(status));
        } else if let Some(limit) = limit.filter(|limit| begin.elapsed() > *limit) {
            self.lose(Loss::TimedOut(limit));
        } else if interrupt::insisted() && begin.elapsed() > PROMPT {
            self.lose(Loss::GivenUp);
        }
        self.loss.is_some()
    }

    fn lose(&mut self, loss: Loss) {
        if self.loss.is_none() {
            self.lost_in = self.control().mark.load(Ordering::Relaxed);
            self.loss = Some(loss);
            self.end();
        }
    }

    fn broken<T>(&mut self, why: &str, value: T) -> T {
        self.lose(Loss::Broken(why.to_owned()));
        value
    }

    /// Sends an order and waits for the report on it; `None` when the worker is lost.
    fn converse(&mut self, order: &Order, limit: Option<Duration>) -> Option<Report> {
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

    /// The connection has ended: mostly because the process has.
    fn hung_up(&mut self, error: &io::Error) {
        let begin = Instant::now();
        while !self.is_lost(begin, None) {
            if begin.elapsed() > Duration::from_secs(1) {
                return self.broken(&error.to_string(), ());
            }
            std::thread::sleep(NAPS[0]);
        }
    }

    /// Kills the process if it lives.
    fn end(&mut self) {
        // both fail only when there is none
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Why the worker is gone.
    pub(crate) fn loss(&self, name: &str, time: Option<f64>, messages: Vec<Message>) -> FmuFault {
        let instance = name.to_owned();
        let call = match self.lost_in {
            LOADING => "dlopen",
            mark => Call::from_number(mark).map_or("no call", Call::name),
        };
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

const LOST: Answer = Answer { call: Call::fmi2DoStep, outcome: Outcome::Lost };

fn unloadable(name: &str, error: &LibraryError) -> FmuError {
    FmuFault::Unloadable { instance: name.to_owned(), causes: super::causes(error) }.into()
}

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

/// Reads and writes while looking after the worker.
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
