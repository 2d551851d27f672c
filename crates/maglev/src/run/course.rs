//! The course of one run: start, steps, checkpoints.

use std::io;
use std::time::{Duration, Instant};

use super::checkpoint::{CheckpointError, CheckpointOrigin};
use super::journal::Journal;
use super::output::RunOutput;
use super::pace::{Pacer, WallClock};
use super::shared::{Halt, Shared};
use super::totals::Earlier;
use super::{Job, Observer};
use crate::error::Error;
use fmi2_import::interrupt;
use master::simulation::AlgebraicLoop;
use master::{Setup, Simulation, SimulationState};
use results::EventKind;
use results::Folder;
use results::summary::SolvedLoop;
use results::summary::{AccuracyReport, Status, Summary};

/// Time between two reports of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);
/// Steps of more than this many times those that a unit suggests are noted.
const COARSE: f64 = 100.0;

/// Everything that one run works with, from its start to its end.
pub(super) struct Course<'a> {
    pub(super) job: &'a Job<'a>,
    pub(super) setup: &'a Setup,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) begin: Instant,
    pub(super) folder: Folder,
    pub(super) output: RunOutput<'a>,
    pub(super) journal: Journal,
    /// `None` if the run writes no checkpoints
    pub(super) origin: Option<CheckpointOrigin>,
    pub(super) pacer: Option<Pacer<WallClock>>,
    pub(super) earlier: Earlier,
    /// how step and algorithm were chosen
    pub(super) accuracy: Option<AccuracyReport>,
    pub(super) progress: Progress,
}

/// What comes after a step.
enum Next {
    Step,
    Checkpoint,
    End(Status),
}

/// Wall time of stepping, and where it began.
struct Watch {
    begin: Instant,
    /// the last report of progress
    reported: Instant,
    done: u64,
    time: f64,
}

/// How far a run has got.
pub(super) struct Progress {
    pub(super) done: u64,
    /// time of a stop condition within the last step (s)
    pub(super) ended: Option<f64>,
    pub(super) start: Duration,
    pub(super) run: Duration,
    pub(super) loops: Vec<SolvedLoop>,
    /// who interrupted the run, and during which call
    pub(super) interruption: String,
    /// why the run ended before its stop time, if it did as a result
    pub(super) ended_by: Option<String>,
}

impl Default for Progress {
    fn default() -> Self {
        let (start, run) = (Duration::ZERO, Duration::ZERO);
        Self {
            done: 0,
            ended: None,
            start,
            run,
            loops: Vec::new(),
            interruption: "by the user".to_owned(),
            ended_by: None,
        }
    }
}

impl<'a> Course<'a> {
    /// Reports and logs the notes that the check of the scenario made.
    pub(super) fn note_findings(&mut self) -> Result<(), Error> {
        let system = &self.setup.system();
        let mut texts = self.setup.scenario().notes.clone();
        texts.extend(self.setup.scenario().out_of_time());
        texts.extend(system.notices(self.setup.scenario().experiment.step));
        texts.extend(self.setup.coupling().loops.iter().map(AlgebraicLoop::notice));
        let start = self.setup.time_after(0);
        for text in texts {
            self.observer.notice(&text);
            self.journal.note(start, EventKind::Note, text).map_err(|e| self.failed(e))?;
        }
        Ok(())
    }

    /// Starts, steps to the end and completes the results.
    pub(super) fn complete(self, from: Option<&SimulationState>) -> Result<Summary, Error> {
        let setup = self.setup;
        let shared = Shared::new(self);
        let run = || {
            let mut simulation = None;
            let result = match Self::start(&shared, setup, from) {
                Ok(started) => Self::step_all(&shared, simulation.insert(started)),
                Err(halt) => Err(halt),
            };
            shared.complete(result, simulation.as_mut())
        };
        interrupt::guard(|| shared.rescue(), run)
    }

    fn start(
        shared: &Shared<'a>,
        setup: &'a Setup,
        from: Option<&SimulationState>,
    ) -> Result<Simulation<'a>, Halt> {
        let mut simulation = setup.start()?;
        if let Some(state) = from {
            simulation.restore(state).map_err(|error| Error::from(CheckpointError::from(error)))?;
        }
        shared.with(|course| course.started(&simulation, from.is_some()))?;
        if from.is_none() {
            // a unit that fails to serialize its state should fail now, not after hours
            Self::checkpoint(shared, &mut simulation, Duration::ZERO)?;
        }
        shared.with(|course| {
            course.progress.start = course.begin.elapsed();
            Ok(())
        })?;
        Ok(simulation)
    }

    /// Records the values at the start, or logs that the run is resumed.
    fn started(&mut self, simulation: &Simulation<'_>, resumed: bool) -> Result<(), Error> {
        self.progress.loops = simulation.loops().to_vec();
        let time = simulation.time();
        let coarse = coarse(self.setup);
        let notes = simulation.notes().iter().chain(&coarse).filter(|_| !resumed);
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

    fn step_all(shared: &Shared<'a>, simulation: &mut Simulation<'_>) -> Result<Status, Halt> {
        let begin = Instant::now();
        let (now, remaining) = (simulation.time(), simulation.remaining());
        shared.with(|course| {
            let real_time = course.setup.scenario().real_time;
            course.pacer = real_time.map(|factor| Pacer::new(WallClock::new(), factor, now));
            course.observer.begin(remaining);
            Ok(())
        })?;
        let status = Self::steps(shared, simulation, begin);
        shared.with(|course| {
            course.progress.run = begin.elapsed();
            Ok(())
        })?;
        let status = status?;
        simulation.check_loops()?;
        Ok(status)
    }

    fn steps(
        shared: &Shared<'a>,
        simulation: &mut Simulation<'_>,
        begin: Instant,
    ) -> Result<Status, Halt> {
        let mut clock =
            Watch { begin, reported: begin, done: simulation.done(), time: simulation.time() };
        if shared.with(|course| course.stop(simulation))? {
            return Ok(Status::Stopped);
        }
        while simulation.remaining() > 0 {
            let before = simulation.rejected();
            let stepped = simulation.step();
            let rejected = simulation.rejected() - before;
            let next = shared.with(|course| match stepped {
                Ok(()) => course.take(simulation, rejected, &mut clock),
                Err(error) => course.ended(error),
            })?;
            match next {
                Next::Step => {}
                Next::Checkpoint => Self::checkpoint(shared, simulation, begin.elapsed())?,
                Next::End(Status::Interrupted) => {
                    Self::checkpoint(shared, simulation, begin.elapsed())?;
                    return Ok(Status::Interrupted);
                }
                Next::End(status) => return Ok(status),
            }
        }
        Ok(Status::Finished)
    }

    /// Handles a failed step: `fmi2Discard` with `fmi2Terminated` is a regular end of the run.
    fn ended(&mut self, error: master::Error) -> Result<Next, Error> {
        match error {
            master::Error::Step { time, source } if source.asks_to_end() => {
                // a warning, since the run is shorter than asked for: also where notes are not shown
                self.observer.warning(&source.to_string());
                self.progress.ended_by = Some(source.to_string());
                let noted = self.journal.note(time, EventKind::Terminated, source.to_string());
                noted.map(|()| Next::End(Status::Terminated)).map_err(|e| self.failed(e))
            }
            error => Err(error.into()),
        }
    }

    /// Records a finished step, and decides what comes next.
    fn take(
        &mut self,
        simulation: &mut Simulation<'_>,
        rejected: u64,
        clock: &mut Watch,
    ) -> Result<Next, Error> {
        let (done, time) = (simulation.done(), simulation.time());
        self.progress.done = done;
        self.output.take(simulation).map_err(|e| self.failed(e))?;
        for (time, text) in simulation.take_news() {
            self.observer.notice(&format!("at {time} s: {text}"));
            self.journal.note(time, EventKind::Event, text).map_err(|e| self.failed(e))?;
        }
        if self.journal.has_news() {
            self.listen(simulation).map_err(|e| self.failed(e))?;
            let ended = self.journal.ended(simulation.participants());
            ended.map_err(|source| master::Error::Step { time, source })?;
        }
        if rejected > 0 {
            let text = format!("{rejected} steps were repeated: their error was too large");
            self.journal.note(time, EventKind::Rejected, text).map_err(|e| self.failed(e))?;
        }
        if self.stop(simulation)? {
            return Ok(Next::End(Status::Stopped));
        }
        self.hold(time).map_err(|e| self.failed(e))?;
        if self.observer.interrupted() {
            return Ok(Next::End(Status::Interrupted));
        }
        let now = Instant::now();
        if now - clock.reported > PROGRESS_INTERVAL {
            clock.reported = now;
            let factor = (time - clock.time) / (now - clock.begin).as_secs_f64();
            self.observer.progress(done - clock.done, time, factor);
        }
        let keeps = self.setup.scenario().checkpoint_stride();
        let due = keeps.is_some_and(|stride| done.is_multiple_of(stride));
        Ok(if due && simulation.remaining() > 0 { Next::Checkpoint } else { Next::Step })
    }

    /// Whether a stop condition ends the run here. Logs it.
    fn stop(&mut self, simulation: &Simulation<'_>) -> Result<bool, Error> {
        let Some(text) = simulation.stopped() else { return Ok(false) };
        let time = simulation.time();
        self.observer.notice(&format!("the run ends at {time} s: {text}"));
        self.progress.ended_by = Some(text.to_owned());
        self.progress.ended = Some(time);
        let noted = self.journal.note(time, EventKind::Stopped, text);
        let noted = noted.and(self.output.take_last(simulation));
        noted.map(|()| true).map_err(|e| self.failed(e))
    }

    pub(super) fn listen(&mut self, simulation: &mut Simulation<'_>) -> io::Result<()> {
        let time = simulation.time();
        self.journal.listen(time, simulation.participants_mut(), self.observer)
    }

    /// Waits until the time is due, if the run is limited to real time.
    #[inline]
    fn hold(&mut self, time: f64) -> io::Result<()> {
        let Some(pacer) = &mut self.pacer else { return Ok(()) };
        let observer = &*self.observer;
        match pacer.hold(time, || observer.interrupted()) {
            Some(late) => self.journal.note(time, EventKind::Overrun, format!("{late:.6} s late")),
            None => Ok(()),
        }
    }

    /// Writes a checkpoint, if the run writes any.
    fn checkpoint(
        shared: &Shared<'a>,
        simulation: &mut Simulation<'_>,
        run_time: Duration,
    ) -> Result<(), Halt> {
        if !shared.with(|course| Ok(course.origin.is_some()))? {
            return Ok(());
        }
        let state = simulation.state()?;
        shared.with(|course| course.keep(state, simulation, run_time))
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

    /// Stores the call in which the run was interrupted, for the log.
    pub(super) fn interrupted_in(&mut self, place: &str) {
        self.progress.interruption = format!("by the user; {place}");
    }

    pub(super) fn failed(&self, source: io::Error) -> Error {
        Error::Output { path: self.job.folder.to_owned(), running: true, source }
    }
}

/// A sentence about steps far above those that a unit suggests: the run may end in order, and mean nothing.
fn coarse(setup: &Setup) -> Option<String> {
    let step = setup.scenario().experiment.step;
    let suggested = setup.system().instances.iter().filter_map(|it| {
        let size = it.description().default_experiment.step_size?;
        (size > 0.0 && step > COARSE * size).then_some((size, &it.name))
    });
    let (size, name) = suggested.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "steps of {step} s are {:.0} times those that {name} suggests ({size} s, DefaultExperiment), and nothing \
         measures their error: compare with a smaller step, or ask for an \"accuracy\"",
        step / size
    ))
}
