//! `maglev check`: judges runs by criteria.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use criteria::{CriteriaError, CriteriaFile, Metric, Verdict};
use indexmap::IndexMap;
use maglev::Error;
use results::{ReadError, RunResults};
use serde::Serialize;
use thiserror::Error;

use super::{modes, verdicts};

const EXAMPLES: &str = "\
Examples:
  maglev check results/low-speed
  maglev check results/low-speed --modes --criteria cjj-t-262,stability
  maglev check results/a results/b --criteria my-criteria.json --json

Without --criteria a run is judged by the limits of its scenario, or by all criteria that ship
if it has none: cjj-t-262, shanghai, frequency, mbbo, ride-comfort, stability. The margin is in
per cent of the limit. The exit status is 1 if a limit is exceeded, if a figure that is not
optional is missing, or if a run failed or did not reach its end.";

/// Arguments of `maglev check`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folders with results.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Criteria: files, or names of those that ship, separated by commas.
    #[arg(long, value_name = "FILES", value_delimiter = ',')]
    criteria: Vec<String>,
    /// Compute the modes of the coupled system first, if modes.json is missing (4 s for a train).
    #[arg(long)]
    modes: bool,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
}

/// Why runs cannot be judged.
#[derive(Debug, Error)]
pub enum CheckError {
    /// A criteria file.
    #[error(transparent)]
    Criteria(#[from] CriteriaError),
    /// A results folder.
    #[error(transparent)]
    Results(#[from] ReadError),
    /// Two files have a criterion of the same name.
    #[error("the criterion {name} occurs in {first} and in {second}")]
    Twice {
        /// Its name.
        name: String,
        /// The file that is named first.
        first: String,
        /// The other file.
        second: String,
    },
    /// The limits of a run have another form.
    #[error("cannot use the limits in {path}")]
    Limits {
        /// The scenario as run.
        path: PathBuf,
        /// What differs.
        #[source]
        source: serde_json::Error,
    },
}

impl CheckError {
    /// How to fix it.
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Criteria(error) => Some(error.help()),
            Self::Results(error) => error.help(),
            Self::Twice { .. } => Some("rename one of them"),
            Self::Limits { .. } => Some("run the scenario again, or give criteria with --criteria"),
        }
    }
}

/// The verdict on one run.
#[derive(Serialize)]
struct RunVerdict {
    folder: String,
    title: String,
    /// From summary.json; none of a run that has not ended.
    status: Option<String>,
    passed: bool,
    /// Why the run itself does not pass.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<String>,
    criteria: Vec<Verdict>,
}

/// Judges the runs and prints the verdicts.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    if arguments.modes {
        modes::of_folders(&arguments.folders)?;
    }
    let verdicts = match judge(arguments) {
        Ok(verdicts) => verdicts,
        Err(error) => {
            super::tell_chain(&results::causes(&error), error.help());
            return Ok(ExitCode::from(2));
        }
    };
    if arguments.json {
        // plain data, which always prints
        super::print(&(serde_json::to_string_pretty(&verdicts).unwrap_or_default() + "\n"))?;
    } else {
        super::print(&verdicts.iter().map(text).collect::<Vec<_>>().join("\n"))?;
    }
    let passed = verdicts.iter().all(|it| it.passed);
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn judge(arguments: &Arguments) -> Result<Vec<RunVerdict>, CheckError> {
    let given = criteria(&arguments.criteria)?;
    let all = criteria(&CriteriaFile::shipped_names().map(str::to_owned))?;
    let of = |folder: &PathBuf| {
        let run = RunResults::read(folder)?;
        let own = || {
            let path = folder.join(results::AS_RUN);
            report::own_metrics(&run).map_err(|source| CheckError::Limits { path, source })
        };
        let own = if given.is_empty() { own()? } else { IndexMap::new() };
        let metrics = [&given, &own, &all].into_iter().find(|it| !it.is_empty()).unwrap_or(&all);
        let criteria = report::judge(&run, metrics);
        let status = run.summary["status"].as_str().map(str::to_owned);
        let problem = problem(&run, status.as_deref());
        Ok(RunVerdict {
            folder: folder.display().to_string(),
            title: run.title(),
            passed: problem.is_none() && criteria.iter().all(Verdict::passes),
            status,
            problem,
            criteria,
        })
    };
    arguments.folders.iter().map(of).collect()
}

/// The criteria of all files.
pub fn criteria(names: &[String]) -> Result<IndexMap<String, Metric>, CheckError> {
    let mut all: IndexMap<String, Metric> = IndexMap::new();
    let mut files: IndexMap<String, &String> = IndexMap::new();
    for file in names {
        for (name, metric) in CriteriaFile::load(file)?.criteria {
            if let Some(first) = files.insert(name.clone(), file) {
                let (first, second) = (first.clone(), file.clone());
                return Err(CheckError::Twice { name, first, second });
            }
            all.insert(name, metric);
        }
    }
    Ok(all)
}

/// Why a run does not pass whatever its figures are.
fn problem(run: &RunResults, status: Option<&str>) -> Option<String> {
    let until = run.summary["reached"].as_f64().map(|it| format!(" at {it} s")).unwrap_or_default();
    match status {
        None => Some("the run has not ended".to_owned()),
        Some("failed") => Some(format!("the run failed{until}")),
        Some("interrupted") => Some(format!("the run was interrupted{until}")),
        Some(_) => None,
    }
}

fn text(run: &RunVerdict) -> String {
    let RunVerdict { folder, title, status, passed, problem, criteria } = run;
    let mut text = format!("{folder}: {title}\n{}", verdicts::text(criteria));
    let unrecorded = |it: &Verdict| it.reason.contains("recorded");
    if criteria.iter().any(unrecorded) {
        text += "`maglev run SCENARIO --criteria NAMES` records what criteria need\n";
    }
    if status.as_deref().is_some_and(|it| it == "terminated" || it == "stopped") {
        text += &format!("the run ended early, with status {}\n", status.as_deref().unwrap_or(""));
    }
    if let Some(problem) = problem {
        text += &format!("{problem}: its figures are those until then\n");
    }
    text + if *passed { "passed\n" } else { "FAILED\n" }
}
