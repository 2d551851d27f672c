//! A whole run: from a scenario to results, summary and pictures.
//!
//! [`Setup`] checks a scenario, and [`Simulation`](master::Simulation) steps it; other programs can use
//! these two alone. This module adds everything that a run writes, and what keeps it safe:
//!
//! | noun | what it is |
//! |---|---|
//! | [`Job`] | what to run, and the folder for the results |
//! | [`Observer`] | whoever watches: progress, notes, warnings, and the wish to end |
//! | `Course` | everything that one run works with, from its start to its end |
//! | `Shared` | the course behind a lock, so that a hanging step can be given up |
//! | `RunOutput` | the recorded signals: table, statistics, curves, pictures |
//! | `Journal` | messages of units, and events |
//! | `Pacer` | waits for real time |
//! | [`Checkpoint`] | the state of a run in a file; `CheckpointOrigin` is what all checkpoints of a run share |
//! | `RunEnd` | a run whose files are written and whose units are still to be terminated |

mod checkpoint;
mod course;
mod end;
mod journal;
mod output;
mod pace;
mod shared;
mod totals;

use std::cell::RefCell;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use in_memory::accuracy::{self, Choice};
use in_memory::as_run;
use indexmap::IndexSet;

use checkpoint::CheckpointOrigin;
pub use checkpoint::{Checkpoint, CheckpointError, VERSION as CHECKPOINT_VERSION};
use course::{Course, Progress};
use fmi2_import::witness;
use journal::Journal;
use master::Setup;
use output::RunOutput;
use results::summary::AccuracyReport;
use results::{EventLog, Folder, Summary};
use scenario::{ResultFormat, Scenario};
use totals::Earlier;

use crate::error::Error;

/// Watches a run. Its functions are called by the thread that works on the run at that time.
pub trait Observer: Send {
    /// Stepping begins; so many steps remain.
    fn begin(&mut self, steps: u64) {
        let _ = steps;
    }

    /// So many steps are done; `factor` is simulated time over wall time.
    fn progress(&mut self, done: u64, time: f64, factor: f64) {
        let _ = (done, time, factor);
    }

    /// A note, which is no error.
    fn notice(&mut self, text: &str) {
        let _ = text;
    }

    /// A message of a unit that the scenario's `log_level` selects.
    fn message(&mut self, text: &str) {
        self.notice(text);
    }

    /// Something that may make the results invalid.
    fn warning(&mut self, text: &str) {
        self.notice(text);
    }

    /// Whether to end the run after this step.
    fn interrupted(&self) -> bool {
        false
    }
}

/// An observer that ignores everything.
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
    /// Folder for the results; made if needed.
    pub folder: &'a Path,
}

impl Job<'_> {
    /// Runs the scenario. Results, summary and pictures are also written for a run that fails or is
    /// interrupted after its start.
    ///
    /// # Errors
    /// Whatever stops the run, see [`Error`].
    pub fn run(&self, observer: &mut dyn Observer) -> Result<Summary, Error> {
        let folder = at_start(self.folder)?;
        let result = Job { folder: &folder, ..*self }.chosen(observer);
        result.map_err(|error| error.with_folder(&folder, self.folder))
    }

    /// Chooses step and algorithm first, if the scenario asks for an accuracy.
    fn chosen(&self, observer: &mut dyn Observer) -> Result<Summary, Error> {
        let watched = RefCell::new(&mut *observer);
        let choice = accuracy::choose(
            self.scenario,
            &mut |text| watched.borrow_mut().notice(text),
            &mut || watched.borrow().interrupted(),
        )?;
        match choice {
            None => self.run_there(None, observer),
            Some(Choice { scenario, report }) => {
                observer.notice(&format!("accuracy: {}", report.explanation));
                Job { scenario: &scenario, ..*self }.run_there(Some(report), observer)
            }
        }
    }

    fn run_there(
        &self,
        accuracy: Option<AccuracyReport>,
        observer: &mut dyn Observer,
    ) -> Result<Summary, Error> {
        let begin = Instant::now();
        witness::rescue_with(results::write_now);
        let setup = Setup::new(self.scenario)?;
        let keeps = setup.scenario().checkpoint_stride();
        if keeps.is_some() {
            can_serialize(&setup)?;
        }
        let mut origin = keeps
            .map(|_| CheckpointOrigin::new(self.name, self.scenario, setup.system()))
            .transpose()?;
        let failed =
            |source| Error::Output { path: self.folder.to_owned(), running: false, source };
        fs::create_dir_all(self.folder).map_err(failed)?;
        let folder = Folder::claim(self.folder, planned_files(&setup)).map_err(failed)?;
        if let Some(it) = &mut origin {
            folder.run().clone_into(&mut it.run);
            it.keep(accuracy.as_ref());
        }
        let journal =
            Journal::create(self.folder).map_err(failed)?.showing(self.scenario.log_level);
        as_run::write(folder.run(), self.scenario, setup.system(), self.folder).map_err(failed)?;
        let output = RunOutput::create(&setup, self.folder).map_err(failed)?;
        let mut course = Course {
            job: self,
            setup: &setup,
            observer,
            begin,
            folder,
            output,
            journal,
            origin,
            pacer: None,
            earlier: Earlier::default(),
            accuracy,
            progress: Progress::default(),
        };
        course.note_findings()?;
        course.complete(None)
    }
}

/// Continues a run from the checkpoint in its results folder. The results are those of a run without
/// the interruption.
///
/// # Errors
/// There is no checkpoint, it does not fit the units or the results, or the run fails.
pub fn resume(folder: &Path, observer: &mut dyn Observer) -> Result<Summary, Error> {
    let begin = Instant::now();
    witness::rescue_with(results::write_now);
    let checkpoint = Checkpoint::read(folder)?;
    let folder = &at_start(folder)?;
    let mut scenario = checkpoint.scenario(folder).map_err(CheckpointError::from)?;
    // keep the trace of the interrupted run
    scenario.trace = None;
    let setup = Setup::new(&scenario)?;
    let origin = checkpoint.origin(&scenario, setup.system())?;
    let accuracy = checkpoint.accuracy();
    let Checkpoint { run, name, simulation, output, journal, mut earlier, .. } = checkpoint;
    earlier.resumed += 1;
    let mut claimed =
        Folder::reclaim(folder, &run, planned_files(&setup)).map_err(CheckpointError::from)?;
    let output = RunOutput::resume(&setup, folder, output)?;
    let journal = Journal::resume(folder, journal)
        .map_err(|source| CheckpointError::Results { path: EventLog::path(folder), source })?
        .showing(scenario.log_level);
    claimed.reopen().map_err(|source| Error::Output {
        path: folder.to_owned(),
        running: false,
        source,
    })?;
    let job = Job { scenario: &scenario, name: &name, folder };
    let course = Course {
        job: &job,
        setup: &setup,
        observer,
        begin,
        folder: claimed,
        output,
        journal,
        origin: Some(origin),
        pacer: None,
        earlier,
        accuracy,
        progress: Progress::default(),
    };
    course.complete(Some(&simulation))
}

/// The absolute path of a folder, taken before a unit can change the working directory.
fn at_start(folder: &Path) -> Result<PathBuf, Error> {
    let failed = |source| Error::Output { path: folder.to_owned(), running: false, source };
    std::path::absolute(folder).map_err(failed)
}

/// Files that a run writes besides those of every run.
fn planned_files(setup: &Setup) -> Vec<String> {
    let scenario = setup.scenario();
    let parquet = scenario.record.format.contains(&ResultFormat::Parquet);
    let pictures = scenario.plots.iter().map(|plot| plot.file.clone());
    let metrics = !(scenario.objectives.is_empty() && scenario.limits.is_empty());
    pictures
        .chain(parquet.then(|| results::PARQUET.to_owned()))
        .chain(metrics.then(|| results::METRICS.to_owned()))
        .collect()
}

/// Checks that all units can serialize their states.
fn can_serialize(setup: &Setup) -> Result<(), Error> {
    let mut units = IndexSet::new();
    for plan in &setup.system().instances {
        if !plan.description().co_simulation.can_serialize_fmu_state {
            units.insert(plan.package.path().to_owned());
        }
    }
    let units: Vec<PathBuf> = units.into_iter().collect();
    if units.is_empty() { Ok(()) } else { Err(Error::NoCheckpoints { units }) }
}

fn remove_checkpoint(folder: &Path) -> io::Result<()> {
    match fs::remove_file(Checkpoint::path(folder)) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
