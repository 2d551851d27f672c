//! A whole run: from a checked scenario to results, summary and pictures.

mod output;
mod plan;
mod selection;
mod totals;

use std::path::Path;
use std::time::{Duration, Instant};

use output::Output;
use selection::Selection;

use crate::coupling::{Algorithm, Exchange, GaussSeidel, Jacobi};
use crate::error::Error;
use crate::graph::SignalGraph;
use crate::initialize::{SolvedLoop, initialize};
use crate::logger::Message;
use crate::participant::Participant;
use crate::scenario::{AlgorithmName, Scenario};
use crate::summary::{Failure, SignalSummary, Status, Summary, UnitMessage, UnitSummary, WallTime};
use crate::system::{Override, System};

/// Time between two reports of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);
/// Messages of units kept for the summary.
const MAX_MESSAGES: usize = 200;

/// Watches a run.
pub trait Observer {
    /// Stepping begins, with so many steps to come.
    fn begin(&mut self, steps: u64) {
        let _ = steps;
    }

    /// So many steps are done; `factor` is simulated time over wall time.
    fn progress(&mut self, done: u64, time: f64, factor: f64) {
        let _ = (done, time, factor);
    }

    /// Something worth telling that is no error.
    fn notice(&mut self, text: &str) {
        let _ = text;
    }

    /// Whether the run shall end now.
    fn interrupted(&self) -> bool {
        false
    }
}

/// An observer that looks away.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unobserved;

impl Observer for Unobserved {}

/// What to run and where to put the results.
#[derive(Debug, Clone)]
pub struct Job<'a> {
    /// The scenario, with paths of units relative to the working directory.
    pub scenario: &'a Scenario,
    /// Name of the scenario, for the summary.
    pub name: &'a str,
    /// Values that replace those of the scenario.
    pub overrides: &'a [Override],
    /// Folder for the results; made if needed.
    pub folder: &'a Path,
}

impl Job<'_> {
    /// Runs it. Whatever happens after the start, what was recorded is kept: results.csv,
    /// summary.json and the pictures are written also for a run that fails or is interrupted.
    ///
    /// # Errors
    /// Whatever stops the run, see [`Error`].
    pub fn run(&self, observer: &mut dyn Observer) -> Result<Summary, Error> {
        let begin = Instant::now();
        self.scenario.check()?;
        let system = System::new(self.scenario, self.overrides)?;
        let selection = Selection::new(self.scenario, &system)?;
        let order = plan::sequence(self.scenario, &system)?;
        tell_findings(&system, observer);
        let output = Output::create(self.folder, self.scenario, &system, &selection)?;
        let mut run = Run {
            job: self,
            system: &system,
            selection: &selection,
            order: &order,
            observer,
            begin,
            output,
            participants: Vec::new(),
            progress: Progress { time: self.scenario.experiment.start, ..Progress::default() },
        };
        let result = run.start().and_then(|mut started| run.step_all(&mut started));
        run.progress.listen(&mut run.participants, run.observer);
        let summary = run.finish(&result);
        // the first error is the one that matters
        result.and(summary)
    }
}

/// What a run steps with.
struct Started {
    algorithm: Box<dyn Algorithm<Participant>>,
    exchange: Exchange,
}

/// The parts of one run.
struct Run<'a> {
    job: &'a Job<'a>,
    system: &'a System,
    selection: &'a Selection,
    order: &'a [usize],
    observer: &'a mut dyn Observer,
    begin: Instant,
    output: Output,
    participants: Vec<Participant>,
    progress: Progress,
}

impl Run<'_> {
    /// Instantiates, initializes and lays out the exchange.
    fn start(&mut self) -> Result<Started, Error> {
        let scenario = self.job.scenario;
        let mut instances = plan::instantiate(self.system)?;
        self.progress.loops =
            initialize(self.system, &mut instances, scenario.experiment, scenario.initialization)?;
        let algorithm: Box<dyn Algorithm<Participant>> = match scenario.algorithm.name {
            AlgorithmName::Jacobi => Box::new(Jacobi),
            AlgorithmName::GaussSeidel => Box::new(GaussSeidel::new(self.order.to_vec())),
        };
        let time = scenario.experiment.start;
        let failed = |source| Error::Step { time, source };
        let (participants, mut exchange) =
            plan::plan(scenario, self.system, self.selection, instances, &*algorithm)
                .map_err(failed)?;
        self.participants = participants;
        exchange.start(time, &mut self.participants).map_err(failed)?;
        for (k, participant) in self.participants.iter_mut().enumerate() {
            let highest = participant.probe_inputs().map_err(failed)?;
            exchange.limit(k, highest);
            // a unit may have complained about what was only probed
            participant.instance_mut().take_messages();
        }
        self.progress.start = self.begin.elapsed();
        Ok(Started { algorithm, exchange })
    }

    fn step_all(&mut self, started: &mut Started) -> Result<Status, Error> {
        let begin = Instant::now();
        let status = self.steps(started, begin);
        self.progress.run = begin.elapsed();
        let status = status?;
        let time = self.progress.time;
        for participant in &mut self.participants {
            let terminated = participant.instance_mut().terminate();
            terminated.map_err(|source| Error::Step { time, source })?;
        }
        Ok(status)
    }

    fn steps(&mut self, started: &mut Started, begin: Instant) -> Result<Status, Error> {
        let Started { algorithm, exchange } = started;
        let experiment = self.job.scenario.experiment;
        let steps = experiment.steps()?;
        let slots = self.selection.slots(&self.participants);
        self.observer.begin(steps);
        let mut told = begin;
        self.output.take(self.progress.time, &self.participants, &slots)?;
        for n in 0..steps {
            #[expect(clippy::cast_precision_loss, reason = "steps() allows at most 2^53")]
            let time_of = |n: u64| experiment.start + n as f64 * experiment.step;
            let time = time_of(n);
            algorithm
                .step(exchange, &mut self.participants, time, experiment.step)
                .map_err(|source| Error::Step { time, source })?;
            self.progress.steps = n + 1;
            self.progress.time = time_of(n + 1);
            self.output.take(self.progress.time, &self.participants, &slots)?;
            if self.observer.interrupted() {
                return Ok(Status::Interrupted);
            }
            let now = Instant::now();
            if now - told > PROGRESS_INTERVAL {
                told = now;
                let simulated = self.progress.time - experiment.start;
                let factor = simulated / (now - begin).as_secs_f64();
                self.observer.progress(n + 1, self.progress.time, factor);
                self.progress.listen(&mut self.participants, self.observer);
            }
        }
        Ok(Status::Finished)
    }

    /// Completes the results, also those of a run that failed.
    fn finish(self, result: &Result<Status, Error>) -> Result<Summary, Error> {
        let Self { job, system, selection, output, progress, participants, .. } = self;
        let Output { folder, table, gatherers, curves, .. } = output;
        let written = |source| Error::Output { path: job.folder.to_owned(), running: true, source };
        let rows = table.rows();
        table.finish().map_err(written)?;
        let pictures = if progress.steps > 0 {
            output::draw(job.scenario, system, selection, &folder, curves)?
        } else {
            Vec::new()
        };
        let signals = selection.ports[..selection.recorded]
            .iter()
            .zip(&gatherers)
            .map(|(&port, gatherer)| {
                let unit = selection::base_unit(system, port);
                let statistics = gatherer.statistics();
                (system.port_name(port), SignalSummary { unit, statistics })
            })
            .collect();
        let experiment = job.scenario.experiment;
        let units = totals::units(job.scenario, system, &participants);
        let wall_time = progress.wall_time(self.begin, &units);
        let simulated = progress.time - experiment.start;
        let run_seconds = wall_time.run_seconds;
        let summary = Summary {
            scenario: job.name.to_owned(),
            title: job.scenario.title.clone(),
            status: *result.as_ref().unwrap_or(&Status::Failed),
            error: result.as_ref().err().map(Failure::from),
            start: experiment.start,
            stop: experiment.stop,
            step: experiment.step,
            steps: progress.steps,
            reached: progress.time,
            rows,
            real_time_factor: if run_seconds > 0.0 { simulated / run_seconds } else { 0.0 },
            algorithm: totals::algorithm_summary(job.scenario, system, self.order),
            initial_loops: progress.loops,
            wall_time,
            master_version: env!("CARGO_PKG_VERSION").to_owned(),
            overrides: job.overrides.iter().map(ToString::to_string).collect(),
            units,
            signals,
            messages: progress.messages,
            pictures,
        };
        summary.write(&folder).map_err(written)?;
        Ok(summary)
    }
}

/// What happens in a run, gathered for the summary.
#[derive(Default)]
struct Progress {
    steps: u64,
    time: f64,
    start: Duration,
    run: Duration,
    loops: Vec<SolvedLoop>,
    messages: Vec<UnitMessage>,
    warned: Vec<bool>,
}

impl Progress {
    fn wall_time<'a>(
        &self,
        begin: Instant,
        units: impl IntoIterator<Item = (&'a String, &'a UnitSummary)>,
    ) -> WallTime {
        let in_units = |unit: &UnitSummary| unit.step_seconds + unit.exchange_seconds;
        let units_seconds: f64 = units.into_iter().map(|(_, unit)| in_units(unit)).sum();
        let run_seconds = self.run.as_secs_f64();
        WallTime {
            total_seconds: begin.elapsed().as_secs_f64(),
            start_seconds: self.start.as_secs_f64(),
            run_seconds,
            units_seconds,
            master_seconds: (run_seconds - units_seconds).max(0.0),
        }
    }

    /// Takes the units' messages and tells the first grave one of each unit.
    fn listen(&mut self, participants: &mut [Participant], observer: &mut dyn Observer) {
        self.warned.resize(participants.len(), false);
        for (participant, warned) in participants.iter_mut().zip(&mut self.warned) {
            let instance = participant.instance_mut();
            let messages = instance.take_messages();
            let warns = instance.warned() || messages.iter().any(|message| message.grave);
            if warns && !std::mem::replace(warned, true) {
                let text = messages
                    .iter()
                    .find(|message| message.grave)
                    .map_or("a call returned fmi2Warning", |message| message.text.as_str());
                observer.notice(&format!("unit {} warns: {text}", instance.name()));
            }
            keep(&mut self.messages, instance.name(), messages);
        }
    }
}

fn keep(kept: &mut Vec<UnitMessage>, instance: &str, messages: Vec<Message>) {
    let room = MAX_MESSAGES.saturating_sub(kept.len());
    kept.extend(messages.into_iter().take(room).map(|message| UnitMessage {
        instance: instance.to_owned(),
        status: message.status,
        text: message.text,
    }));
}

fn tell_findings(system: &System, observer: &mut dyn Observer) {
    let mut told = Vec::new();
    for plan in &system.instances {
        let path = plan.package.path();
        if told.contains(&path) {
            continue;
        }
        told.push(path);
        for finding in plan.package.findings() {
            observer.notice(&format!("{}: {}", path.display(), finding.message));
        }
    }
    let stepping = SignalGraph::stepping(system);
    for component in stepping.loops() {
        observer.notice(&format!(
            "algebraic loop, cut by extrapolation: {}",
            stepping.names(system, &component)
        ));
    }
}
