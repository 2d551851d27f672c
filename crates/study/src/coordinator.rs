//! Lets worker processes compute points, and collects their rows.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::folder::{self, Counts, journals};
use crate::journal::{Entry, Journal, JournalError, Rows, adopt};
use crate::queue::{Loss, Queue};
use crate::worker::{Answer, Task, timed_out};
use crate::{Design, Row, Runner, Status, Study, StudyError};

/// Time between two looks at signals and time-outs.
const LOOK: Duration = Duration::from_millis(50);
/// Time that a point may take beyond the study's limit before its process is killed: the process itself ends it between
/// two steps.
const GRACE: Duration = Duration::from_secs(2);
/// A worker gets points ahead while they take less than this.
const SHORT: Duration = Duration::from_millis(20);
/// Points that a worker has at a time.
const AHEAD: usize = 16;
/// Text of a worker's stderr that is kept.
const SAID: usize = 2000;

/// What to compute, where, and by how many processes.
#[derive(Debug, Clone)]
pub struct Order {
    /// The results folder.
    pub folder: PathBuf,
    /// Number of processes.
    pub workers: usize,
    /// The first and the last point, or all points.
    pub points: Option<(u64, u64)>,
    /// Whether points that crashed, timed out or failed are computed again.
    pub retry: bool,
}

/// Watches a study.
pub trait Watcher {
    /// Points that are to be computed, and points of the order that are there already.
    fn begin(&mut self, to_do: u64, there: u64);

    /// A point is done.
    fn point(&mut self, done: u64, row: &Row);

    /// Something that the user should know.
    fn notice(&mut self, text: &str);

    /// 0, 1 to end after the points that have begun, 2 to end at once.
    fn interrupted(&self) -> u32;
}

/// What an order has led to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// What the results have of all points of the study. `None` if only some were ordered: `maglev study merge` writes
    /// the results.
    pub counts: Option<Counts>,
    /// Points of the order.
    pub ordered: u64,
    /// Points of the order that have a row.
    pub done: u64,
}

/// Computes the points that have no row yet, and writes the results.
///
/// # Errors
/// The units do not fit, a file cannot be written, or workers cannot work.
pub fn coordinate(
    study: &Study,
    order: &Order,
    command: &(dyn Fn() -> io::Result<Command> + Sync),
    watcher: &mut dyn Watcher,
) -> Result<Outcome, StudyError> {
    let folder = std::path::absolute(&order.folder)
        .map_err(|source| StudyError::Output { folder: order.folder.clone(), source })?;
    let failed = |source| StudyError::Output { folder: order.folder.clone(), source };
    let last = study.count();
    let (first, last) = order.points.unwrap_or((1, last));
    for number in [first, last] {
        study.point(number)?;
    }
    // an earlier part of these results has the step of all points
    if let Ok(before) = Study::of_results(&folder)
        && before.identity() == study.identity()
        && let Some(chosen) = before.chosen()
    {
        study.adopt(Some(chosen.clone()));
    }
    {
        let watcher = RefCell::new(&mut *watcher);
        let mut tell = |text: &str| watcher.borrow_mut().notice(text);
        let mut interrupted = || watcher.borrow().interrupted() > 0;
        study.choose(&mut tell, &mut interrupted)?;
    }
    if let Some(chosen) = study.chosen() {
        watcher.notice(&format!("accuracy: {}", chosen.accuracy.explanation));
    }
    // finds mistakes before a process is started; other points may fail, which is a row
    let runner = Runner::new(study)?;
    let units = runner.units().to_vec();
    drop(runner);
    let name = match order.points {
        None => "run.jsonl".to_owned(),
        Some((first, last)) => format!("points-{first:09}-{last:09}.jsonl"),
    };
    let path = journals(&folder).join(name);
    let mut journal = Journal::open(&path).map_err(|error| match error {
        JournalError::Busy => StudyError::Busy { journal: path.clone() },
        JournalError::Io(source) => failed(source),
    })?;
    let known = Rows::read(&journals(&folder)).map_err(failed)?;
    let queue = Queue::new(study, &known, (first, last), order.retry);
    let ordered = last + 1 - first;
    let to_do = (first..=last)
        .filter_map(|number| study.point(number).ok())
        .filter(|point| queue.is_open(&point.name))
        .count() as u64;
    watcher.begin(to_do, ordered - to_do);
    // a unit may change the working directory of its process
    let mut file = study.file().clone();
    file.scenario = std::path::absolute(&file.scenario).map_err(failed)?;
    if let Design::Table { file: path } = &mut file.design {
        *path = std::path::absolute(&*path).map_err(failed)?;
    }
    let task = Task {
        study: file,
        path: study.path().to_owned(),
        folder: folder.clone(),
        identity: study.identity().to_owned(),
        chosen: study.chosen().cloned(),
        prove: true,
    };
    let workers = order.workers.clamp(1, usize::try_from(to_do.max(1)).unwrap_or(usize::MAX));
    let crew = Crew { study, queue: &queue, task: &task, proves: true.into(), command };
    let computed =
        if to_do > 0 { crew.compute(workers, &mut journal, watcher, &failed) } else { Ok(0) };
    let synced = journal.sync().map_err(failed);
    let counts = if order.points.is_none() {
        // also of a study that ends early: what is there can be looked at
        let written = Rows::read(&journals(&folder))
            .and_then(|mut rows| folder::write(study, &units, &folder, &mut rows));
        Some(written.map_err(failed))
    } else {
        folder::write_study_alone(study, &units, &folder).map_err(failed)?;
        None
    };
    let done = ordered - to_do + computed?;
    synced?;
    Ok(Outcome { counts: counts.transpose()?, ordered, done })
}

/// Collects the rows of other folders, and writes the results of a folder.
///
/// # Errors
/// A folder has no study, a study differs, or a file cannot be read or written.
pub fn merge(folder: &Path, others: &[PathBuf]) -> Result<Counts, StudyError> {
    let failed = |source| StudyError::Output { folder: folder.to_owned(), source };
    let study = Study::of_results(folder)?;
    let path = journals(folder).join("merged.jsonl");
    for other in others {
        let mut journal = Journal::open(&path).map_err(|error| match error {
            JournalError::Busy => StudyError::Busy { journal: path.clone() },
            JournalError::Io(source) => failed(source),
        })?;
        let theirs = Study::of_results(other)?;
        let step = |study: &Study| study.chosen().map(|chosen| chosen.step);
        if theirs.identity() != study.identity() || step(&theirs) != step(&study) {
            return Err(StudyError::Differs { folder: other.clone(), from: folder.to_owned() });
        }
        let known = Rows::read(&journals(folder)).map_err(failed)?;
        adopt(&journals(other), &mut journal, &known).map_err(failed)?;
        for kept in ["signals", "runs"] {
            copy_missing(&other.join(kept), &folder.join(kept)).map_err(failed)?;
        }
    }
    let mut rows = Rows::read(&journals(folder)).map_err(failed)?;
    folder::write(&study, &study.units(), folder, &mut rows).map_err(failed)
}

/// Copies the folders that are missing.
fn copy_missing(from: &Path, to: &Path) -> io::Result<()> {
    let entries = match std::fs::read_dir(from) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    std::fs::create_dir_all(to)?;
    for entry in entries {
        let (from, to) = {
            let entry = entry?;
            (entry.path(), to.join(entry.file_name()))
        };
        if from.is_dir() {
            copy_missing(&from, &to)?;
        } else if !to.exists() {
            std::fs::copy(&from, &to)?;
        }
    }
    Ok(())
}

/// What a worker's thread reports.
enum Report {
    Row {
        row: Row,
        seconds: f64,
    },
    /// Not enough processes can work.
    Broken(StudyError),
}

/// A process, and when it must have answered.
#[derive(Default)]
struct Slot {
    child: Option<Child>,
    deadline: Option<Instant>,
    /// whether it was killed because its point took too long
    timed_out: bool,
}

/// The processes of a study.
struct Crew<'a> {
    study: &'a Study,
    queue: &'a Queue<'a>,
    task: &'a Task,
    /// whether the first and the last point can be stepped to find out which instances can be used again
    proves: AtomicBool,
    command: &'a (dyn Fn() -> io::Result<Command> + Sync),
}

impl Crew<'_> {
    /// Computes what the queue gives. Returns the number of rows.
    fn compute(
        &self,
        workers: usize,
        journal: &mut Journal,
        watcher: &mut dyn Watcher,
        failed: &dyn Fn(io::Error) -> StudyError,
    ) -> Result<u64, StudyError> {
        let slots: Vec<Arc<Mutex<Slot>>> = (0..workers).map(|_| Arc::default()).collect();
        let (sender, receiver) = mpsc::channel();
        thread::scope(|scope| {
            for slot in &slots {
                let (sender, slot) = (sender.clone(), Arc::clone(slot));
                scope.spawn(move || self.employ(&slot, &sender));
            }
            drop(sender);
            let end = |how: Option<StudyError>| {
                self.queue.close();
                slots.iter().for_each(kill);
                how
            };
            let (mut done, mut error, mut told) = (0, None, false);
            loop {
                let mut entries = Vec::new();
                match receiver.recv_timeout(LOOK) {
                    Ok(report) => {
                        let more = std::iter::from_fn(|| receiver.try_recv().ok());
                        for report in std::iter::once(report).chain(more) {
                            match report {
                                Report::Row { row, seconds } => {
                                    entries.push(Entry { row, seconds })
                                }
                                Report::Broken(broken) => error = error.or(end(Some(broken))),
                            }
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                if !entries.is_empty() {
                    if let Err(source) = journal.append(&entries) {
                        error = error.or(end(Some(failed(source))));
                        continue;
                    }
                    for entry in &entries {
                        done += 1;
                        watcher.point(done, &entry.row);
                    }
                }
                match watcher.interrupted() {
                    0 => {}
                    1 if !told => {
                        told = true;
                        self.queue.close();
                        watcher.notice(
                            "the study ends after the points that have begun; another Ctrl-C ends them now",
                        );
                    }
                    1 => {}
                    _ => drop(end(None)),
                }
                self.end_slow_points(&slots);
            }
            error.map_or(Ok(done), Err)
        })
    }

    /// Kills processes whose points take too long.
    fn end_slow_points(&self, slots: &[Arc<Mutex<Slot>>]) {
        for slot in slots {
            let late = lock(slot).deadline.is_some_and(|deadline| Instant::now() > deadline);
            if late {
                lock(slot).timed_out = true;
                kill(slot);
            }
        }
    }

    /// When a process must have answered that works on so many points.
    fn deadline(&self, points: u32) -> Option<Instant> {
        let limit = Duration::try_from_secs_f64(self.study.file().timeout?).ok()?;
        Instant::now().checked_add(limit.checked_mul(points)?.saturating_add(GRACE))
    }

    /// Keeps one process at work until the queue is empty.
    fn employ(&self, slot: &Mutex<Slot>, sender: &Sender<Report>) {
        let mut idle_ends = 0;
        while let Some(first) = self.queue.take() {
            match self.work(slot, first, sender) {
                Ok(End::Done) => return,
                Ok(End::Renew) => idle_ends = 0,
                Ok(End::Early(reason)) => {
                    idle_ends += 1;
                    if idle_ends >= 10 {
                        let _ = sender.send(Report::Broken(StudyError::Worker { reason }));
                        return;
                    }
                }
                Err(error) => {
                    let _ = sender.send(Report::Broken(error));
                    return;
                }
            }
        }
    }

    /// Starts a process and gives it points, the first one first, until it ends.
    fn work(
        &self,
        slot: &Mutex<Slot>,
        first: u64,
        sender: &Sender<Report>,
    ) -> Result<End, StudyError> {
        let mut pending = VecDeque::from([first]);
        let started = (self.command)().and_then(|mut command| {
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()
        });
        let mut child = started.map_err(|error| {
            self.queue.give_back(first);
            StudyError::Spawn(error)
        })?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(mut orders), Some(answers), Some(errors)) = pipes else {
            let error = io::Error::other("the process has no pipes");
            return Err(StudyError::Spawn(error));
        };
        let said = thread::spawn(move || tail(errors));
        let proves = self.proves.load(Ordering::Relaxed);
        let task = Task { prove: proves, ..self.task.clone() };
        // a few points are begun before it is ready
        let deadline = self.deadline(8);
        *lock(slot) = Slot { child: Some(child), deadline, timed_out: false };
        let ended = self.converse(slot, &task, (&mut orders, answers), &mut pending, sender);
        drop(orders);
        let (status, late) = {
            let mut slot = lock(slot);
            let status = slot.child.take().map(|mut child| child.wait());
            (status, slot.timed_out)
        };
        let said = said.join().unwrap_or_default();
        let status = status.transpose().map_err(StudyError::Spawn)?;
        if let Talk::Unable(reason) = ended {
            pending.into_iter().for_each(|number| self.queue.give_back(number));
            return Err(StudyError::Worker { reason });
        }
        let Some(number) = pending.pop_front() else {
            return Ok(if ended == Talk::Done { End::Done } else { End::Renew });
        };
        pending.into_iter().for_each(|number| self.queue.give_back(number));
        if matches!(ended, Talk::Worn) {
            self.queue.give_back(number);
            return Ok(End::Renew);
        }
        if ended == Talk::Unready && proves {
            // the points that are stepped first may be to blame, and they have their turn
            self.proves.store(false, Ordering::Relaxed);
            self.queue.give_back(number);
            return Ok(End::Renew);
        }
        if late && ended != Talk::Unready {
            self.report(number, Status::TimedOut, timed_out(self.study), sender);
            return Ok(End::Renew);
        }
        let (loss, how) = judge(status);
        let reason = if said.is_empty() { how } else { format!("{how}; it said: {said}") };
        if ended == Talk::Unready {
            self.queue.give_back(number);
            return Ok(End::Early(reason));
        }
        if !self.queue.lost(number, loss) {
            let tries = match loss {
                Loss::Crashed => self.study.file().tries,
                Loss::Killed => crate::queue::KILLS,
            };
            let text = format!("its process ended in each of {tries} tries, last by {reason}");
            self.report(number, Status::Crashed, text, sender);
        }
        Ok(End::Renew)
    }

    fn report(&self, number: u64, status: Status, text: String, sender: &Sender<Report>) {
        if let Ok(point) = self.study.point(number) {
            let row = Row::without_figures(point.name, status, text);
            let _ = sender.send(Report::Row { row, seconds: 0.0 });
        }
    }

    /// Gives orders and takes answers until one side ends. `pending` are the points that are ordered and not answered.
    fn converse(
        &self,
        slot: &Mutex<Slot>,
        task: &Task,
        (orders, answers): (&mut ChildStdin, ChildStdout),
        pending: &mut VecDeque<u64>,
        sender: &Sender<Report>,
    ) -> Talk {
        let mut answers = BufReader::new(answers);
        let mut line = String::new();
        let text = serde_json::to_string(task).unwrap_or_default() + "\n";
        if orders.write_all(text.as_bytes()).is_err() {
            return Talk::Unready;
        }
        let mut answer = |line: &mut String| -> Option<Answer> {
            line.clear();
            let read = answers.read_line(line).ok().filter(|it| *it > 0);
            read.and_then(|_| serde_json::from_str(line).ok())
        };
        match answer(&mut line) {
            Some(Answer::Ready) => {}
            Some(Answer::Unable(reason)) => return Talk::Unable(reason),
            _ => return Talk::Unready,
        }
        let mut ahead = 1;
        let mut sent = 0;
        loop {
            while pending.len() < ahead
                && let Some(number) = self.queue.take()
            {
                pending.push_back(number);
            }
            if pending.is_empty() {
                return Talk::Done;
            }
            let text: String = pending.iter().skip(sent).map(|it| format!("{it}\n")).collect();
            lock(slot).deadline = self.deadline(1);
            if orders.write_all(text.as_bytes()).is_err() {
                return Talk::Lost;
            }
            match answer(&mut line) {
                Some(Answer::Point { number, row, seconds }) => {
                    pending.retain(|it| *it != number);
                    sent = pending.len();
                    ahead = if seconds < SHORT.as_secs_f64() { AHEAD } else { 1 };
                    if sender.send(Report::Row { row, seconds }).is_err() {
                        return Talk::Done;
                    }
                }
                Some(Answer::Unable(reason)) => return Talk::Unable(reason),
                Some(Answer::Worn) => return Talk::Worn,
                Some(Answer::Ready) | None => return Talk::Lost,
            }
        }
    }
}

/// How the work with one process ended.
enum End {
    /// The queue is empty.
    Done,
    /// Another process continues.
    Renew,
    /// It ended before it was ready.
    Early(String),
}

/// How the conversation with a process ended.
#[derive(Debug, PartialEq, Eq)]
enum Talk {
    Done,
    Unready,
    Unable(String),
    Worn,
    Lost,
}

fn lock(slot: &Mutex<Slot>) -> MutexGuard<'_, Slot> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

fn kill(slot: &Arc<Mutex<Slot>>) {
    if let Some(child) = &mut lock(slot).child {
        // it may have ended already
        let _ = child.kill();
    }
}

/// Whose fault the end of a process is, and how it ended.
fn judge(status: Option<ExitStatus>) -> (Loss, String) {
    #[cfg(unix)]
    if let Some(signal) = status.and_then(|it| std::os::unix::process::ExitStatusExt::signal(&it)) {
        // SIGHUP, SIGINT, SIGKILL and SIGTERM come from outside; the kernel kills for want of memory
        let loss = if [1, 2, 9, 15].contains(&signal) { Loss::Killed } else { Loss::Crashed };
        return (loss, format!("signal {signal}"));
    }
    let code = status.and_then(|it| it.code());
    (Loss::Crashed, code.map_or("an unknown status".to_owned(), |it| format!("exit status {it}")))
}

/// The end of what a process says, on one line.
fn tail(mut errors: impl io::Read) -> String {
    let (mut kept, mut buffer) = (Vec::new(), [0; 4096]);
    while let Ok(n @ 1..) = errors.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..n]);
        let surplus = kept.len().saturating_sub(SAID);
        kept.drain(..surplus);
    }
    String::from_utf8_lossy(&kept).split_whitespace().collect::<Vec<_>>().join(" ")
}
