//! The end of a run: writes all files first, and then terminates the units, which may fail once more.

use std::fs;

use in_memory::{Signals, metrics, ride};
use indexmap::IndexMap;

use super::course::Course;
use super::journal::Journal;
use super::output::Files;
use super::pace::Pacer;
use super::{Job, Observer, remove_checkpoint, totals};
use crate::error::Error;
use master::participant::Participant;
use master::{Setup, Simulation};
use results::Folder;
use results::summary::{RunFailure, SignalSummary, Status, Summary};
use results::{EventKind, EventLog, Gatherer};

/// A run whose files are written and whose units are not terminated yet.
pub(super) struct RunEnd<'a> {
    job: &'a Job<'a>,
    observer: &'a mut dyn Observer,
    folder: Folder,
    journal: Journal,
    summary: Summary,
    /// the first error
    outcome: Result<(), Error>,
}

impl<'a> Course<'a> {
    /// Completes the results, also those of a failed run. They stay complete whatever the units do afterwards.
    pub(super) fn finish(
        mut self,
        result: Result<Status, Error>,
        mut simulation: Option<&mut Simulation<'_>>,
    ) -> RunEnd<'a> {
        let result = result.or_else(|error| match error.given_up().map(ToString::to_string) {
            Some(place) => {
                self.interrupted_in(&place);
                Ok(Status::Interrupted)
            }
            None => Err(error),
        });
        let noted = self.note_end(&result, simulation.as_deref_mut());
        let complete = matches!(result, Ok(status) if is_complete(status));
        let keeps_checkpoint = self.origin.is_some() && !complete;
        let (mut end, files, mut written) = self.write(&result, simulation.as_deref());
        if written.is_ok() {
            written = end.settle(files, keeps_checkpoint);
        }
        // the first error counts
        end.outcome = result.map(|_| ()).and(noted).and(written);
        end
    }

    /// Logs the last messages of the units, and how the run ended.
    fn note_end(
        &mut self,
        result: &Result<Status, Error>,
        simulation: Option<&mut Simulation<'_>>,
    ) -> Result<(), Error> {
        let time = self.setup.time_after(self.progress.done);
        let heard = match simulation {
            Some(simulation) => self.listen(simulation),
            None => self.journal.listen_to_strays(time, self.observer),
        };
        let noted = heard.and(match result {
            Ok(Status::Interrupted) => {
                let text = std::mem::take(&mut self.progress.interruption);
                self.journal.note(time, EventKind::Interrupted, text)
            }
            Err(error) => self.journal.note(time, EventKind::Failed, error.chain().join(": ")),
            Ok(_) => Ok(()),
        });
        noted.map_err(|e| self.failed(e))
    }

    /// Writes tables, pictures, events and summary. Returns the summary also if writing fails.
    fn write(
        self,
        result: &Result<Status, Error>,
        simulation: Option<&Simulation<'_>>,
    ) -> (RunEnd<'a>, Files, Result<(), Error>) {
        let Self { job, setup, observer, folder, output, mut journal, progress, earlier, .. } =
            self;
        let (scenario, system) = (setup.scenario(), setup.system());
        let failed = |source| Error::Output { path: job.folder.to_owned(), running: true, source };
        let gatherers = output.gatherers.clone();
        let (files, completed) = output.finish(progress.done > 0);
        let reached = progress.ended.unwrap_or_else(|| setup.time_after(progress.done));
        let ride_quality =
            result.as_ref().ok().and_then(|_| ride::judge(setup, Signals::Folder(job.folder)));
        let participants = simulation.map_or(&[][..], Simulation::participants);
        for text in totals::warned_steps(participants) {
            observer.notice(&text);
        }
        let mut noted = Ok(());
        for text in ride_quality.iter().flat_map(ride::notes) {
            observer.notice(&text);
            noted = noted.and(journal.note(reached, EventKind::Note, text));
        }
        let ended = result.as_ref().ok();
        let judged = ended.map(|_| {
            let as_run = fs::read_to_string(job.folder.join(results::AS_RUN)).ok();
            metrics::judge(setup, Signals::Folder(job.folder), as_run, ride_quality.as_ref())
        });
        let (metrics, listed) = match judged.transpose() {
            Ok(None) => (Vec::new(), Ok(())),
            Ok(Some(verdicts)) if verdicts.is_empty() => (verdicts, Ok(())),
            Ok(Some(verdicts)) => {
                let written = results::write_metrics(job.folder, &verdicts);
                (verdicts, written)
            }
            Err(error) => {
                let text =
                    format!("figures are not computed: {}", results::causes(&error).join(": "));
                observer.warning(&text);
                (Vec::new(), journal.note(reached, EventKind::Warning, text))
            }
        };
        noted = noted.and(listed);
        let logged = journal.publish();
        let parts = journal.summary();
        let experiment = scenario.experiment;
        let coupling = simulation.map(Simulation::coupling).unwrap_or_default();
        let instances = totals::instances(setup, participants, &earlier, &parts);
        let run_seconds = earlier.run_seconds + progress.run.as_secs_f64();
        let wall_time = totals::wall_time(
            self.begin,
            progress.start,
            run_seconds,
            coupling.threads,
            &instances,
        );
        let simulated = reached - experiment.start;
        let summary = Summary {
            run: folder.run().to_owned(),
            scenario: job.name.to_owned(),
            title: scenario.title.clone(),
            status: *result.as_ref().unwrap_or(&Status::Failed),
            ended_by: progress.ended_by,
            error: result.as_ref().err().map(failure),
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
                setup.coupling(),
                (coupling, self.accuracy),
            ),
            initial_loops: progress.loops,
            wall_time,
            master_version: env!("CARGO_PKG_VERSION").to_owned(),
            overrides: scenario.overrides.iter().map(ToString::to_string).collect(),
            units: totals::units(scenario, system, &instances),
            instances,
            real_time: self.pacer.as_ref().map(Pacer::statistics),
            events: parts.events,
            signals: signals(setup, participants, &gatherers),
            ride_quality,
            metrics,
            messages: parts.messages,
            omitted_messages: parts.omitted,
            tables: files.tables.clone(),
            pictures: files.pictures.clone(),
        };
        let written = summary.write(job.folder);
        let result = completed.and(noted.and(logged).and(written).map_err(failed));
        let end = RunEnd { job, observer, folder, journal, summary, outcome: Ok(()) };
        (end, files, result)
    }
}

impl RunEnd<'_> {
    fn failed(&self, source: std::io::Error) -> Error {
        Error::Output { path: self.job.folder.to_owned(), running: true, source }
    }

    /// Removes files that are of no use after the end, and lists the others.
    fn settle(&mut self, files: Files, keeps_checkpoint: bool) -> Result<(), Error> {
        let removed = if keeps_checkpoint {
            // resuming needs the table
            Ok(())
        } else {
            files.spare.map_or(Ok(()), fs::remove_file)
        };
        let finished = is_complete(self.summary.status);
        let cleared = if finished { remove_checkpoint(self.job.folder) } else { Ok(()) };
        let listed = self.folder.complete(&[&log_name(self.job)]);
        removed.and(cleared).and(listed).map_err(|e| self.failed(e))
    }

    /// Terminates the units, and returns the outcome of the run. Adds their messages and a failure to events
    /// and summary.
    pub(super) fn close(
        mut self,
        simulation: Option<&mut Simulation<'_>>,
    ) -> Result<Summary, Error> {
        let terminated = simulation.map_or(Ok(()), |simulation| self.terminate(simulation));
        self.outcome.and(terminated).map(|()| self.summary)
    }

    fn terminate(&mut self, simulation: &mut Simulation<'_>) -> Result<(), Error> {
        let time = simulation.time();
        let terminated = simulation.terminate().map_err(Error::from);
        let before = self.journal.summary().events;
        let participants = simulation.participants_mut();
        let mut noted = self.journal.listen(time, participants, self.observer);
        if let Err(error) = &terminated {
            let text = error.chain().join(": ");
            noted = noted.and(self.journal.note(time, EventKind::Failed, text));
            self.summary.error.get_or_insert_with(|| failure(error));
        }
        let logged = self.journal.summary();
        if logged.events != before {
            (self.summary.events, self.summary.messages) = (logged.events, logged.messages);
            self.summary.omitted_messages = logged.omitted;
            for (instance, sent) in self.summary.instances.values_mut().zip(logged.sent) {
                instance.messages = sent;
            }
            noted = noted.and(self.journal.publish());
            noted = noted.and(self.summary.write(self.job.folder));
        }
        let noted = noted.and(self.folder.complete(&[])).map_err(|e| self.failed(e));
        terminated.and(noted)
    }
}

/// Whether there is nothing to resume.
fn is_complete(status: Status) -> bool {
    matches!(status, Status::Finished | Status::Stopped)
}

/// File name of the event log.
fn log_name(job: &Job<'_>) -> String {
    let path = EventLog::path(job.folder);
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn signals(
    setup: &Setup,
    participants: &[Participant],
    gatherers: &[Gatherer],
) -> IndexMap<String, SignalSummary> {
    let columns = setup.selection().columns(setup.system());
    let slots = setup.selection().slots(participants);
    let text = |k: usize| {
        let (participant, slot) = slots.get(k)?;
        participants[*participant].text(*slot).map(|text| text.to_string_lossy().into_owned())
    };
    (0..)
        .zip(columns)
        .zip(gatherers)
        .map(|((k, column), gatherer)| {
            let (statistics, final_text) = (gatherer.statistics(), text(k));
            let not_finite = if final_text.is_some() { 0 } else { gatherer.left_out() };
            (column.name, SignalSummary { unit: column.unit, final_text, statistics, not_finite })
        })
        .collect()
}

/// An error in the form of the summary.
fn failure(error: &Error) -> RunFailure {
    RunFailure { causes: error.chain(), help: error.help().map(str::to_owned) }
}
