//! A process that computes points: it reads orders and writes answers as lines of JSON.
//!
//! The first order is a `Task`, the others are numbers of points. Points are answered in the order of the orders. The
//! end of the orders ends the process; so does the end of the process that gives them.

use std::io::{self, BufRead, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use scenario::Scenario;
use serde::{Deserialize, Serialize};

use crate::chosen::ChosenStep;
use crate::folder::{run_folder, write_signals};
use crate::{Computed, KeepRuns, Limits, Row, Runner, Status, Study, StudyFile};

/// What a worker computes points of.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Task {
    pub(crate) study: StudyFile,
    pub(crate) path: PathBuf,
    /// the results folder
    pub(crate) folder: PathBuf,
    /// what the points depend on
    pub(crate) identity: String,
    /// the step for the accuracy that the scenario asks for
    pub(crate) chosen: Option<ChosenStep>,
    /// whether to find out first which instances can be used again
    pub(crate) prove: bool,
}

/// What a worker answers.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Answer {
    /// It can compute points.
    Ready,
    /// It cannot compute points, or not keep what they give.
    Unable(String),
    /// A point is computed.
    Point { number: u64, row: Row, seconds: f64 },
    /// It ends, and another one must continue.
    Worn,
}

/// Makes a whole results folder of a scenario.
pub trait RunKeeper {
    /// Runs the scenario into the folder, with a report. A run that fails also leaves a folder.
    ///
    /// # Errors
    /// The folder cannot be written, in words.
    fn keep(&self, scenario: &Scenario, name: &str, folder: &Path) -> Result<(), String>;
}

/// Works until the orders end.
///
/// # Errors
/// The orders cannot be read, or the answers not written.
pub fn serve(
    orders: &mut dyn BufRead,
    answers: &mut dyn Write,
    keeper: &dyn RunKeeper,
) -> io::Result<()> {
    let mut line = String::new();
    if orders.read_line(&mut line)? == 0 {
        return Ok(());
    }
    let unable = |answers: &mut dyn Write, text: String| say(answers, &Answer::Unable(text));
    let task: Task = serde_json::from_str(&line)?;
    let study = match Study::new(task.study, &task.path) {
        Ok(study) => study,
        Err(error) => return unable(answers, error.chain().join(": ")),
    };
    if study.identity() != task.identity {
        let text = "the scenario or a unit has changed since the study was started";
        return unable(answers, text.to_owned());
    }
    study.adopt(task.chosen);
    let mut runner = match Runner::new(&study) {
        Ok(runner) => runner,
        Err(error) => return unable(answers, error.chain().join(": ")),
    };
    if task.prove
        && let Err(error) = runner.prove_resets()
    {
        return unable(answers, error.chain().join(": "));
    }
    say(answers, &Answer::Ready)?;
    loop {
        line.clear();
        if orders.read_line(&mut line)? == 0 {
            return Ok(());
        }
        let number: u64 = serde_json::from_str(&line)?;
        let Computed { row, signals, time, .. } = match timed(&study, &mut runner, number) {
            Ok(computed) => computed,
            Err(error) => return unable(answers, error.chain().join(": ")),
        };
        if !signals.names.is_empty()
            && let Err(error) = write_signals(&task.folder, &row.run, signals)
        {
            return unable(answers, format!("cannot write kept signals: {error}"));
        }
        if keeps_run(study.file().keep.runs, &row) {
            let folder = run_folder(&task.folder, &row.run);
            let kept = runner
                .scenario(number)
                .map_err(|error| error.chain().join(": "))
                .and_then(|scenario| keeper.keep(&scenario, &row.run, &folder));
            // a scenario that does not fit its units leaves no folder
            if let Err(error) = kept.filter_unless_failed(row.status) {
                return unable(answers, error);
            }
        }
        say(answers, &Answer::Point { number, row, seconds: time.as_secs_f64() })?;
        if runner.is_worn() {
            return say(answers, &Answer::Worn);
        }
    }
}

/// Computes a point within the time that the study allows.
fn timed(
    study: &Study,
    runner: &mut Runner<'_>,
    number: u64,
) -> Result<Computed, crate::StudyError> {
    let Some(limit) = study.file().timeout else {
        return runner.compute(number, &mut |_| ControlFlow::Continue(()));
    };
    let begin = Instant::now();
    let limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
    let mut computed = runner.compute(number, &mut |_| match begin.elapsed() > limit {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    })?;
    if computed.row.status == Status::TimedOut {
        computed.row.message = timed_out(study);
        computed.row.reached = None;
    }
    Ok(computed)
}

/// Why a point has the status `timed-out`.
pub(crate) fn timed_out(study: &Study) -> String {
    format!(
        "it took longer than the {} s that the study allows",
        study.file().timeout.unwrap_or(0.0)
    )
}

fn keeps_run(keep: KeepRuns, row: &Row) -> bool {
    match keep {
        KeepRuns::None => false,
        KeepRuns::All => row.status != Status::TimedOut,
        KeepRuns::Failures => row.status == Status::Failed || row.limits == Some(Limits::Failed),
    }
}

/// Leaves out the error of a run that fails in the same way as its point.
trait UnlessFailed {
    fn filter_unless_failed(self, status: Status) -> Self;
}

impl UnlessFailed for Result<(), String> {
    fn filter_unless_failed(self, status: Status) -> Self {
        if status == Status::Failed { Ok(()) } else { self }
    }
}

fn say(answers: &mut dyn Write, answer: &Answer) -> io::Result<()> {
    let mut text = serde_json::to_string(answer)?;
    text.push('\n');
    answers.write_all(text.as_bytes())?;
    answers.flush()
}
