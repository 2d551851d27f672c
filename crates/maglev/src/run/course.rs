//! The course of one run: start and steps.

use std::io;
use std::time::{Duration, Instant};

use super::checkpoint::{CheckpointError, CheckpointOrigin};
use super::desk::{Desk, Halt};
use super::journal::Journal;
use super::output::RunOutput;
use super::pace::{Pacer, WallClock};
use super::totals::Earlier;
use super::{Job, Observer};
use crate::error::Error;
use fmi2_import::interrupt;
use master::simulation::FeedLoop;
use master::{Setup, Simulation, SimulationState};
use results::EventKind;
use results::Folder;
use results::summary::SolvedLoop;
use results::summary::{Status, Summary};

/// Time between two reports of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);

/// The parts of one run.
pub(super) struct Run<'a> {
    pub(super) job: &'a Job<'a>,
    pub(super) setup: &'a Setup,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) begin: Instant,
    pub(super) folder: Folder,
    pub(super) output: RunOutput<'a>,
    pub(super) journal: Journal,
    /// there if checkpoints are written
    pub(super) origin: Option<CheckpointOrigin>,
    pub(super) pacer: Option<Pacer<WallClock>>,
    pub(super) earlier: Earlier,
    pub(super) progress: Progress,
}

/// What comes after a step.
enum Next {
    Step,
    Checkpoint,
    End(Status),
}

/// Wall time of stepping, and what had been done when it began.
struct Watch {
    begin: Instant,
    /// the last report of progress
    told: Instant,
    done: u64,
    time: f64,
}

/// How far a run has got.
pub(super) struct Progress {
    pub(super) done: u64,
    pub(super) start: Duration,
    pub(super) run: Duration,
    pub(super) loops: Vec<SolvedLoop>,
    /// who ended the run early, and during what
    pub(super) interruption: String,
}

impl Default for Progress {
    fn default() -> Self {
        let (start, run) = (Duration::ZERO, Duration::ZERO);
        Self { done: 0, start, run, loops: Vec::new(), interruption: "by the user".to_owned() }
    }
}

impl<'a> Run<'a> {
    /// Tells what was noticed while the scenario was checked.
    pub(super) fn note_findings(&mut self) -> Result<(), Error> {
        let system = &self.setup.system();
        let mut texts = self.setup.scenario().notes.clone();
        texts.extend(system.notices(self.setup.scenario().experiment.step));
        texts.extend(self.setup.layout().loops.iter().map(FeedLoop::notice));
        let start = self.setup.time_after(0);
        for text in texts {
            self.observer.notice(&text);
            self.journal.note(start, EventKind::Note, text).map_err(|e| self.failed(e))?;
        }
        Ok(())
    }

    /// Starts, steps to the end and writes what belongs to the end.
    pub(super) fn complete(self, from: Option<&SimulationState>) -> Result<Summary, Error> {
        let setup = self.setup;
        let desk = Desk::new(self);
        let run = || {
            let mut simulation = None;
            let result = match Self::start(&desk, setup, from) {
                Ok(started) => Self::step_all(&desk, simulation.insert(started)),
                Err(halt) => Err(halt),
            };
            desk.complete(result, simulation.as_mut())
        };
        interrupt::guard(|| desk.rescue(), run)
    }

    fn start(
        desk: &Desk<'a>,
        setup: &'a Setup,
        from: Option<&SimulationState>,
    ) -> Result<Simulation<'a>, Halt> {
        let mut simulation = setup.start()?;
        if let Some(state) = from {
            simulation.restore(state).map_err(|error| Error::from(CheckpointError::from(error)))?;
        }
        desk.with(|run| run.started(&simulation, from.is_some()))?;
        if from.is_none() {
            // a unit that fails to serialize its state shall do so now, not after hours
            Self::checkpoint(desk, &mut simulation, Duration::ZERO)?;
        }
        desk.with(|run| {
            run.progress.start = run.begin.elapsed();
            Ok(())
        })?;
        Ok(simulation)
    }

    /// Takes the values at the start, or notes that the run goes on.
    fn started(&mut self, simulation: &Simulation<'_>, resumed: bool) -> Result<(), Error> {
        self.progress.loops = simulation.loops().to_vec();
        let time = simulation.time();
        let notes = simulation.notes().iter().filter(|_| !resumed);
        for text in simulation.limits().iter().chain(notes) {
            self.observer.notice(text);
            self.journal.note(time, EventKind::Note, text).map_err(|e| self.failed(e))?;
        }
        let taken = if resumed {
            self.progress.done = simulation.done();
            self.journal.note(time, EventKind::Resumed, "from the checkpoint")
        } else {
            self.output.take(simulation)
        };
        taken.map_err(|e| self.failed(e))
    }

    fn step_all(desk: &Desk<'a>, simulation: &mut Simulation<'_>) -> Result<Status, Halt> {
        let begin = Instant::now();
        let (now, remaining) = (simulation.time(), simulation.remaining());
        desk.with(|run| {
            let real_time = run.setup.scenario().real_time;
            run.pacer = real_time.map(|factor| Pacer::new(WallClock::new(), factor, now));
            run.observer.begin(remaining);
            Ok(())
        })?;
        let status = Self::steps(desk, simulation, begin);
        desk.with(|run| {
            run.progress.run = begin.elapsed();
            Ok(())
        })?;
        let status = status?;
        simulation.check_loops()?;
        Ok(status)
    }

    fn steps(
        desk: &Desk<'a>,
        simulation: &mut Simulation<'_>,
        begin: Instant,
    ) -> Result<Status, Halt> {
        let mut clock =
            Watch { begin, told: begin, done: simulation.done(), time: simulation.time() };
        while simulation.remaining() > 0 {
            let before = simulation.rejected();
            let stepped = simulation.step();
            let rejected = simulation.rejected() - before;
            let next = desk.with(|run| match stepped {
                Ok(()) => run.take(simulation, rejected, &mut clock),
                Err(error) => run.ended(error),
            })?;
            match next {
                Next::Step => {}
                Next::Checkpoint => Self::checkpoint(desk, simulation, begin.elapsed())?,
                Next::End(Status::Interrupted) => {
                    Self::checkpoint(desk, simulation, begin.elapsed())?;
                    return Ok(Status::Interrupted);
                }
                Next::End(status) => return Ok(status),
            }
        }
        Ok(Status::Finished)
    }

    /// A step that failed: some failures are the ends of runs.
    fn ended(&mut self, error: master::Error) -> Result<Next, Error> {
        match error {
            master::Error::Step { time, source } if source.asks_to_end() => {
                self.observer.notice(&source.to_string());
                let noted = self.journal.note(time, EventKind::Terminated, source.to_string());
                noted.map(|()| Next::End(Status::Terminated)).map_err(|e| self.failed(e))
            }
            error => Err(error.into()),
        }
    }

    /// Takes what a step has brought.
    fn take(
        &mut self,
        simulation: &mut Simulation<'_>,
        rejected: u64,
        clock: &mut Watch,
    ) -> Result<Next, Error> {
        let (done, time) = (simulation.done(), simulation.time());
        self.progress.done = done;
        self.output.take(simulation).map_err(|e| self.failed(e))?;
        if self.journal.has_news() {
            self.listen(simulation).map_err(|e| self.failed(e))?;
            let ended = self.journal.ended(simulation.participants());
            ended.map_err(|source| master::Error::Step { time, source })?;
        }
        if rejected > 0 {
            let text = format!("{rejected} steps taken back: their error was too large");
            self.journal.note(time, EventKind::Rejected, text).map_err(|e| self.failed(e))?;
        }
        self.hold(time).map_err(|e| self.failed(e))?;
        if self.observer.interrupted() {
            return Ok(Next::End(Status::Interrupted));
        }
        let now = Instant::now();
        if now - clock.told > PROGRESS_INTERVAL {
            clock.told = now;
            let factor = (time - clock.time) / (now - clock.begin).as_secs_f64();
            self.observer.progress(done - clock.done, time, factor);
        }
        let keeps = self.setup.scenario().checkpoint_stride();
        let due = keeps.is_some_and(|stride| done.is_multiple_of(stride));
        Ok(if due && simulation.remaining() > 0 { Next::Checkpoint } else { Next::Step })
    }

    pub(super) fn listen(&mut self, simulation: &mut Simulation<'_>) -> io::Result<()> {
        let time = simulation.time();
        self.journal.listen(time, simulation.participants_mut(), self.observer)
    }

    /// Waits until the time is due, if the run is held to real time.
    #[inline]
    fn hold(&mut self, time: f64) -> io::Result<()> {
        let Some(pacer) = &mut self.pacer else { return Ok(()) };
        let observer = &*self.observer;
        match pacer.hold(time, || observer.interrupted()) {
            Some(late) => self.journal.note(time, EventKind::Overrun, format!("{late:.6} s late")),
            None => Ok(()),
        }
    }

    /// Writes a checkpoint, if there are to be any.
    fn checkpoint(
        desk: &Desk<'a>,
        simulation: &mut Simulation<'_>,
        run_time: Duration,
    ) -> Result<(), Halt> {
        if !desk.with(|run| Ok(run.origin.is_some()))? {
            return Ok(());
        }
        let state = simulation.state()?;
        desk.with(|run| run.keep(state, simulation, run_time))
    }

    fn keep(
        &mut self,
        state: SimulationState,
        simulation: &Simulation<'_>,
        run_time: Duration,
    ) -> Result<(), Error> {
        let Some(origin) = &self.origin else { return Ok(()) };
        let earlier = self.earlier.and(run_time.as_secs_f64(), simulation.participants());
        let written = self
            .journal
            .note(simulation.time(), EventKind::Checkpoint, "written")
            .and_then(|()| Ok((self.output.state()?, self.journal.state()?)))
            .and_then(|(output, journal)| {
                origin.checkpoint(state, output, journal, earlier).write(self.job.folder)
            });
        written.map_err(|e| self.failed(e))
    }

    /// Notes where the run was when it was interrupted.
    pub(super) fn interrupted_in(&mut self, place: &str) {
        self.progress.interruption = format!("by the user; {place}");
    }

    pub(super) fn failed(&self, source: io::Error) -> Error {
        Error::Output { path: self.job.folder.to_owned(), running: true, source }
    }
}
