//! The course of one run: start, steps, end.

use std::io;
use std::time::{Duration, Instant};

use super::checkpoint::Origin;
use super::journal::Journal;
use super::loops::FeedLoop;
use super::output::{Files, Output};
use super::pace::{Pacer, WallClock};
use super::totals::{self, Earlier};
use super::{Job, Observer, Setup, Simulation, SimulationState, remove_checkpoint, ride};
use crate::error::Error;
use crate::initialize::SolvedLoop;
use crate::participant::Participant;
use crate::record::{Gatherer, Kind};
use crate::summary::{CouplingSummary, Failure, SignalSummary, Status, Summary};

/// Time between two reports of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);

/// The parts of one run.
pub(super) struct Run<'a> {
    pub(super) job: &'a Job<'a>,
    pub(super) setup: &'a Setup,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) begin: Instant,
    pub(super) output: Output<'a>,
    pub(super) journal: Journal,
    /// there if checkpoints are written
    pub(super) origin: Option<Origin>,
    pub(super) pacer: Option<Pacer<WallClock>>,
    pub(super) earlier: Earlier,
    pub(super) progress: Progress,
}

/// How far a run has got.
#[derive(Default)]
pub(super) struct Progress {
    done: u64,
    start: Duration,
    run: Duration,
    loops: Vec<SolvedLoop>,
}

impl<'a> Run<'a> {
    /// Tells what was noticed while the scenario was checked.
    pub(super) fn note_findings(&mut self) -> Result<(), Error> {
        let system = &self.setup.system;
        let mut texts = system.notices(self.setup.scenario.experiment.step);
        texts.extend(self.setup.layout.loops.iter().map(FeedLoop::notice));
        let start = self.setup.time_after(0);
        for text in texts {
            self.observer.notice(&text);
            self.journal.note(start, Kind::Note, text).map_err(|e| self.failed(e))?;
        }
        Ok(())
    }

    /// Starts, steps to the end and writes what belongs to the end.
    pub(super) fn complete(mut self, from: Option<&SimulationState>) -> Result<Summary, Error> {
        let mut simulation = None;
        let result = match self.start(from) {
            Ok(started) => self.step_all(simulation.insert(started)),
            Err(error) => Err(error),
        };
        self.finish(result, simulation)
    }

    fn start(&mut self, from: Option<&SimulationState>) -> Result<Simulation<'a>, Error> {
        let mut simulation = self.setup.start()?;
        self.progress.loops = simulation.loops().to_vec();
        for limit in simulation.limits() {
            self.observer.notice(limit);
            let noted = self.journal.note(simulation.time(), Kind::Note, limit);
            noted.map_err(|e| self.failed(e))?;
        }
        match from {
            Some(state) => {
                simulation.restore(state)?;
                self.progress.done = simulation.done();
                let text = "from the checkpoint";
                self.journal
                    .note(simulation.time(), Kind::Resumed, text)
                    .map_err(|e| self.failed(e))?;
            }
            None => {
                self.output.take(&simulation).map_err(|e| self.failed(e))?;
                // a unit that fails to serialize its state shall do so now, not after hours
                self.checkpoint(&mut simulation, Duration::ZERO)?;
            }
        }
        self.progress.start = self.begin.elapsed();
        Ok(simulation)
    }

    fn step_all(&mut self, simulation: &mut Simulation<'_>) -> Result<Status, Error> {
        let begin = Instant::now();
        let real_time = self.setup.scenario.real_time;
        let now = simulation.time();
        self.pacer = real_time.map(|factor| Pacer::new(WallClock::new(), factor, now));
        let status = self.steps(simulation, begin);
        self.progress.run = begin.elapsed();
        let terminated = simulation.terminate();
        // the first error is the one that matters
        let status = status?;
        terminated?;
        simulation.check_loops()?;
        Ok(status)
    }

    fn steps(&mut self, simulation: &mut Simulation<'_>, begin: Instant) -> Result<Status, Error> {
        let keeps = self.setup.scenario.checkpoint_stride();
        let first = (simulation.done(), simulation.time());
        self.observer.begin(simulation.remaining());
        let mut told = begin;
        while simulation.remaining() > 0 {
            let rejected = simulation.rejected();
            match simulation.step() {
                Err(Error::Step { time, source }) if source.asks_to_end() => {
                    self.observer.notice(&source.to_string());
                    let noted = self.journal.note(time, Kind::Terminated, source.to_string());
                    return noted.map(|()| Status::Terminated).map_err(|e| self.failed(e));
                }
                stepped => stepped?,
            }
            let done = simulation.done();
            self.progress.done = done;
            self.output.take(simulation).map_err(|e| self.failed(e))?;
            if self.journal.has_news() {
                self.listen(simulation).map_err(|e| self.failed(e))?;
            }
            let rejected = simulation.rejected() - rejected;
            if rejected > 0 {
                let text = format!("{rejected} steps taken back: their error was too large");
                let noted = self.journal.note(simulation.time(), Kind::Rejected, text);
                noted.map_err(|e| self.failed(e))?;
            }
            self.hold(simulation.time()).map_err(|e| self.failed(e))?;
            let now = Instant::now();
            if keeps.is_some_and(|stride| done.is_multiple_of(stride)) && simulation.remaining() > 0
            {
                self.checkpoint(simulation, now - begin)?;
            }
            if self.observer.interrupted() {
                self.checkpoint(simulation, now - begin)?;
                return Ok(Status::Interrupted);
            }
            if now - told > PROGRESS_INTERVAL {
                told = now;
                let factor = (simulation.time() - first.1) / (now - begin).as_secs_f64();
                self.observer.progress(done - first.0, simulation.time(), factor);
            }
        }
        Ok(Status::Finished)
    }

    fn listen(&mut self, simulation: &mut Simulation<'_>) -> io::Result<()> {
        let time = simulation.time();
        self.journal.listen(time, simulation.participants_mut(), self.observer)
    }

    /// Waits until the time is due, if the run is held to real time.
    #[inline]
    fn hold(&mut self, time: f64) -> io::Result<()> {
        let Some(pacer) = &mut self.pacer else { return Ok(()) };
        let observer = &*self.observer;
        match pacer.hold(time, || observer.interrupted()) {
            Some(late) => self.journal.note(time, Kind::Overrun, format!("{late:.6} s late")),
            None => Ok(()),
        }
    }

    /// Writes a checkpoint, if there are to be any.
    fn checkpoint(&mut self, simulation: &mut Simulation<'_>, run: Duration) -> Result<(), Error> {
        let Some(origin) = &self.origin else { return Ok(()) };
        let state = simulation.state()?;
        let time = simulation.time();
        let earlier = self.earlier.and(run.as_secs_f64(), simulation.participants());
        let written = self
            .journal
            .note(time, Kind::Checkpoint, "written")
            .and_then(|()| Ok((self.output.state()?, self.journal.state()?)))
            .and_then(|(output, journal)| {
                origin.checkpoint(state, output, journal, earlier).write(self.job.folder)
            });
        written.map_err(|e| self.failed(e))
    }

    fn failed(&self, source: io::Error) -> Error {
        Error::Output { path: self.job.folder.to_owned(), running: true, source }
    }

    /// Completes the results, also those of a run that failed.
    fn finish(
        mut self,
        result: Result<Status, Error>,
        mut simulation: Option<Simulation<'_>>,
    ) -> Result<Summary, Error> {
        let time = self.setup.time_after(self.progress.done);
        let mut told = match &mut simulation {
            Some(simulation) => self.listen(simulation),
            None => Ok(()),
        };
        told = told.and(match &result {
            Ok(Status::Interrupted) => self.journal.note(time, Kind::Interrupted, "by the user"),
            Err(error) => self.journal.note(time, Kind::Failed, error.chain().join(": ")),
            Ok(_) => Ok(()),
        });
        let told = told.map_err(|e| self.failed(e));
        let finished = matches!(result, Ok(Status::Finished));
        let (folder, keeps) = (self.job.folder, self.origin.is_some());
        let failed = |source| Error::Output { path: folder.to_owned(), running: true, source };
        let participants = simulation.as_ref().map_or(&[][..], Simulation::participants);
        let coupling = simulation.as_ref().map(Simulation::coupling).unwrap_or_default();
        let written = self.write(&result, participants, coupling);
        // the first error is the one that matters
        result?;
        told?;
        let (summary, files) = written?;
        if finished {
            remove_checkpoint(folder).map_err(failed)?;
        }
        // a checkpoint needs the table that it was written with
        if let Some(spare) = files.spare.filter(|_| finished || !keeps) {
            std::fs::remove_file(spare).map_err(failed)?;
        }
        Ok(summary)
    }

    /// Writes tables, pictures, events and summary.
    fn write(
        self,
        result: &Result<Status, Error>,
        participants: &[Participant],
        coupling: CouplingSummary,
    ) -> Result<(Summary, Files), Error> {
        let Self { job, setup, observer, output, mut journal, progress, earlier, .. } = self;
        let Setup { scenario, system, .. } = setup;
        let failed = |source| Error::Output { path: job.folder.to_owned(), running: true, source };
        let gatherers = output.gatherers.clone();
        let (files, completed) = output.finish(progress.done > 0);
        let reached = setup.time_after(progress.done);
        let ride_quality = result.as_ref().ok().and_then(|_| ride::judge(setup, job.folder));
        let points = ride_quality.iter().flat_map(|quality| &quality.points);
        let mut noted = Ok(());
        for warning in points.flat_map(|point| &point.warnings) {
            let text = format!("ride_quality: {warning}");
            observer.notice(&text);
            noted = noted.and(journal.note(reached, Kind::Note, text));
        }
        let (told, logged) = journal.finish();
        let experiment = scenario.experiment;
        let instances = totals::instances(setup, participants, &earlier, &told.discarded);
        let run_seconds = earlier.run_seconds + progress.run.as_secs_f64();
        let simulated = reached - experiment.start;
        let summary = Summary {
            scenario: job.name.to_owned(),
            title: scenario.title.clone(),
            status: *result.as_ref().unwrap_or(&Status::Failed),
            error: result.as_ref().err().map(Failure::from),
            start: experiment.start,
            stop: experiment.stop,
            step: experiment.step,
            steps: progress.done,
            reached,
            rows: files.rows,
            resumed: earlier.resumed,
            real_time_factor: if run_seconds > 0.0 { simulated / run_seconds } else { 0.0 },
            algorithm: totals::algorithm_summary(
                scenario,
                system,
                &setup.layout.blueprint,
                coupling,
            ),
            initial_loops: progress.loops,
            wall_time: totals::wall_time(self.begin, progress.start, run_seconds, &instances),
            master_version: env!("CARGO_PKG_VERSION").to_owned(),
            overrides: job.overrides.iter().map(ToString::to_string).collect(),
            units: totals::units(scenario, system, &instances),
            instances,
            real_time: self.pacer.as_ref().map(Pacer::statistics),
            events: told.events,
            signals: signals(setup, &gatherers),
            ride_quality,
            messages: told.messages,
            tables: files.tables.clone(),
            pictures: files.pictures.clone(),
        };
        let written = summary.write(job.folder);
        completed.and(noted.and(logged).and(written).map_err(failed))?;
        Ok((summary, files))
    }
}

fn signals(setup: &Setup, gatherers: &[Gatherer]) -> indexmap::IndexMap<String, SignalSummary> {
    let columns = setup.selection.columns(&setup.system);
    columns
        .into_iter()
        .zip(gatherers)
        .map(|(column, gatherer)| {
            let statistics = gatherer.statistics();
            (column.name, SignalSummary { unit: column.unit, statistics })
        })
        .collect()
}
