//! `maglev study`: many variants of a scenario.

mod keeper;
mod progress;
mod report;

use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::str::FromStr;

use clap::{Args, Subcommand};
use maglev::Error;
use serde_json::json;
use study::{Counts, Order, Outcome, Study, StudyError, StudyFile, coordinate, merge};

use super::stdout::Reserved;
use super::system::Opened;
use keeper::Keeper;
use progress::Progress;

/// Exit status that asks to try again, EX_TEMPFAIL of sysexits.h.
pub const TRY_AGAIN: u8 = 75;

const EXAMPLES: &str = "\
Examples:
  maglev study points study.json
  maglev study run study.json
  maglev study run study.json --points 1..100 --out /scratch/study
  maglev study merge /scratch/study
  maglev study report results/study

docs/studies.md explains the file, docs/cluster.md how to use many machines.";

const RUN: &str = "\
Files in the folder: metrics.csv (a row per point: factors, status, figures), dataset/ (the same in
Parquet), failures.csv (why points failed), study.json (the study as run), and what the study
keeps: signals/ and runs/. journal/ has each row since it was computed.

A point that fails is a row with its status. Ctrl-C, a kill or a full disk loses at most the
points that are being computed: the same command continues. Points that are there are not computed
again, unless the scenario, a unit or the figures have changed.

Exit status: 0 if all points are computed, whatever their status; 75 if another process computes
them or points remain, so try again; 2 for an invalid study.";

/// Arguments of `maglev study`.
#[derive(Args)]
#[command(after_help = EXAMPLES, arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: StudyCommand,
}

/// The subcommands of `maglev study`.
#[derive(Subcommand)]
enum StudyCommand {
    /// Compute the points of a study that are not there yet
    #[command(arg_required_else_help = true)]
    Run(RunArguments),
    /// Print the points of a study as CSV
    #[command(arg_required_else_help = true)]
    Points(PointsArguments),
    /// Write the results of points that were computed apart
    #[command(arg_required_else_help = true)]
    Merge(MergeArguments),
    /// Make an HTML report of a study: maps, effects, Sobol indices, Pareto front, table
    #[command(arg_required_else_help = true)]
    Report(report::Arguments),
    /// Computes points for `study run`, in a process of its own
    #[command(hide = true)]
    Worker,
}

/// Arguments of `maglev study run`.
#[derive(Args)]
#[command(after_help = RUN)]
struct RunArguments {
    /// The study (.json): a scenario, factors, and which combinations are computed.
    study: PathBuf,
    /// Folder for the results [default: results/ and the name of the study].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of processes [default: one for each core].
    #[arg(long, value_name = "N", value_parser = workers)]
    workers: Option<usize>,
    /// Compute this point only, in one process; the results are written by `study merge`.
    #[arg(long, value_name = "K", conflicts_with = "points")]
    point: Option<u64>,
    /// Compute these points only; the results are written by `study merge`.
    #[arg(long, value_name = "A..B")]
    points: Option<Span>,
    /// Compute points again that failed, crashed or took too long.
    #[arg(long)]
    retry: bool,
    /// Print the counts as JSON on stdout, and nothing else there.
    #[arg(long)]
    json: bool,
    /// Print nothing unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
}

/// Arguments of `maglev study points`.
#[derive(Args)]
struct PointsArguments {
    /// The study (.json).
    study: PathBuf,
    /// Print the number of points only.
    #[arg(long)]
    count: bool,
}

/// Arguments of `maglev study merge`.
#[derive(Args)]
struct MergeArguments {
    /// The results folder of the study.
    folder: PathBuf,
    /// Folders of the same study whose points are added to it.
    others: Vec<PathBuf>,
    /// Print the counts as JSON.
    #[arg(long)]
    json: bool,
}

/// The first and the last number of points.
#[derive(Debug, Clone, Copy)]
struct Span(u64, u64);

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        match parts {
            Some((first, last)) if 1 <= first && first <= last => Ok(Self(first, last)),
            _ => {
                Err("not of the form A..B with whole numbers, 1 or more, such as 1..100".to_owned())
            }
        }
    }
}

fn workers(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("not a whole number of 1 or more".to_owned()),
        Ok(workers) => Ok(workers),
    }
}

/// Does what the subcommand asks for.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    match &arguments.command {
        StudyCommand::Run(arguments) => compute(arguments),
        StudyCommand::Points(arguments) => points(arguments),
        StudyCommand::Merge(arguments) => merge_folders(arguments),
        StudyCommand::Report(arguments) => report::run(arguments),
        StudyCommand::Worker => serve(),
    }
}

/// A study, and its scenario, which may be that of a system.
fn load(path: &Path, results: Option<&Path>) -> Result<(Study, Opened), Error> {
    let mut file = StudyFile::load(path)?;
    let opened = Opened::new(&file.scenario, results)?;
    file.scenario.clone_from(&opened.path);
    Ok((Study::new(file, path)?, opened))
}

fn compute(arguments: &RunArguments) -> Result<ExitCode, Error> {
    let folder = match &arguments.out {
        Some(folder) => folder.clone(),
        None => Path::new("results").join(load(&arguments.study, None)?.0.name()),
    };
    let (study, _) = load(&arguments.study, Some(&folder))?;
    let points = arguments.point.map(|it| (it, it)).or(arguments.points.map(|it| (it.0, it.1)));
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let order = Order {
        folder: folder.clone(),
        workers: arguments.workers.unwrap_or_else(cores),
        points,
        retry: arguments.retry,
    };
    let stdout = arguments.json.then(Reserved::new).transpose()?;
    let mut progress = Progress::new(arguments.quiet);
    let outcome = coordinate(&study, &order, &worker, &mut progress);
    progress.close();
    let outcome = match outcome {
        Err(error) if error.can_try_again() => {
            let error = Error::from(error);
            super::tell(&error);
            return Ok(ExitCode::from(TRY_AGAIN));
        }
        outcome => outcome?,
    };
    match stdout {
        Some(stdout) => stdout.print(&as_json(&outcome))?,
        None if arguments.quiet => {}
        None => {
            super::print(&closing(&outcome, &folder))?;
        }
    }
    Ok(status(outcome.done == outcome.ordered))
}

fn points(arguments: &PointsArguments) -> Result<ExitCode, Error> {
    let (study, _opened) = load(&arguments.study, None)?;
    if arguments.count {
        return super::print(&format!("{}\n", study.count()));
    }
    let quoted = |text: &str| match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    };
    let mut text = String::from("point");
    for name in study.file().factors.keys() {
        text += &format!(",{name}");
    }
    text += ",run\n";
    for point in study.points() {
        text += &point.number.to_string();
        for value in &point.values {
            text += &format!(",{}", quoted(&value.to_string()));
        }
        text += &format!(",{}\n", point.name);
        if text.len() > 1 << 16 {
            super::print(&std::mem::take(&mut text))?;
        }
    }
    super::print(&text)
}

fn merge_folders(arguments: &MergeArguments) -> Result<ExitCode, Error> {
    let counts = match merge(&arguments.folder, &arguments.others) {
        Err(error @ StudyError::Busy { .. }) => {
            super::tell(&error.into());
            return Ok(ExitCode::from(TRY_AGAIN));
        }
        counts => counts?,
    };
    let outcome = Outcome { counts: Some(counts), ordered: counts.points, done: counts.done };
    if arguments.json {
        super::print(&as_json(&outcome))?;
    } else {
        super::print(&closing(&outcome, &arguments.folder))?;
    }
    Ok(status(counts.done == counts.points))
}

fn status(complete: bool) -> ExitCode {
    if complete { ExitCode::SUCCESS } else { ExitCode::from(TRY_AGAIN) }
}

fn as_json(outcome: &Outcome) -> String {
    let counts = outcome.counts.map(|Counts { points, done, failed, beyond }| {
        json!({ "points": points, "done": done, "failed": failed, "beyond_limits": beyond })
    });
    let all = json!({ "ordered": outcome.ordered, "done": outcome.done, "study": counts });
    format!("{all:#}\n")
}

/// The lines at the end.
fn closing(outcome: &Outcome, folder: &Path) -> String {
    let folder = folder.display();
    let Some(Counts { points, done, failed, beyond }) = outcome.counts else {
        let Outcome { done, ordered, .. } = outcome;
        let rest = if done < ordered { "\nto continue: the same command" } else { "" };
        return format!(
            "{done} of {ordered} points are computed; `maglev study merge {folder}` writes the results{rest}\n"
        );
    };
    let mut text = format!("{done} of {points} points are computed");
    if failed > 0 {
        text += &format!(", {failed} of them failed (failures.csv has the reasons)");
    }
    if beyond > 0 {
        text += &format!(", {beyond} exceed a limit");
    }
    text += &format!("\n{folder}/{}\n{folder}/dataset\n", study::METRICS);
    if done < points {
        text += "to continue: the same command\n";
    }
    text
}

/// The command of a worker: this program.
fn worker() -> io::Result<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["study", "worker"]);
    Ok(command)
}

/// Works for a coordinator until it ends.
fn serve() -> Result<ExitCode, Error> {
    // ends with the coordinator, also if that is killed
    #[cfg(target_os = "linux")]
    let _ = rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL));
    // the coordinator decides what Ctrl-C means
    let _ = ctrlc::set_handler(|| {});
    let mut answers = Reserved::new()?;
    let mut orders = BufReader::new(io::stdin());
    let served = study::worker::serve(&mut orders, answers.file(), &Keeper);
    served.map_err(|source| Error::Write { path: "the answers of a worker".into(), source })?;
    Ok(ExitCode::SUCCESS)
}
