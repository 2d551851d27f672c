//! `maglev report`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use criteria::Metric;
use indexmap::IndexMap;
use maglev::Error;
use measured::MeasuredError;
use report::{ReportError, pictures};
use results::{ReadError, RunResults};

use super::measured::RecordArguments;
use super::report_figures::FigureArguments;
use super::{check, measured as record, modes};

const EXAMPLES: &str = "\
Examples:
  maglev report results/low-speed
  maglev report --modes results/low-speed
  maglev report /tmp/a /tmp/b --out compared.html
  maglev report results/low-speed --measured bridge.csv --map 'w=guideway.midspan_displacement_02:mm'
  maglev report results/low-speed --format svg,png      # results/low-speed/figures/
  maglev report results/low-speed --format svg --size 90x60 --no-title --log amplitude

Writes one HTML file that needs no network: 3D view, time histories, spectra with the modes
marked, tables, and what ran. Several folders are compared in one report; those of a pattern such
as gain-* are sorted by their numbers. With --format svg or png it writes the scenario's
pictures and their spectra as files for papers, into the folder figures beside the report.";

/// Arguments of `maglev report`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folders with results.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Compute the modes of the coupled system first, if modes.json is missing (4 s for a train).
    #[arg(long)]
    modes: bool,
    /// Judge the runs by these criteria instead of their own limits, as `maglev check` does.
    #[arg(long, value_name = "FILES", value_delimiter = ',')]
    criteria: Vec<String>,
    /// Title of the report, and of figures [default: what ran].
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// File of the report [default: report.html in the first folder].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Formats to write, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "html")]
    format: Vec<ReportFormat>,
    /// Show measured time series beside the runs: a CSV or Parquet file, or a JSON file that names one.
    #[arg(long, value_name = "FILE")]
    measured: Option<PathBuf>,
    #[command(flatten)]
    record: RecordArguments,
    #[command(flatten)]
    figures: FigureArguments,
}

/// Format of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ReportFormat {
    Html,
    Svg,
    Png,
}

/// Writes the report or the figures and prints their paths.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    if let Some(option) = arguments.figures.given()
        && !arguments.format.iter().any(|it| *it != ReportFormat::Html)
    {
        let cause = format!("{option} is an option of figures, but the report is a page");
        super::tell_chain(&[cause], Some("add --format svg or --format png"));
        return Ok(ExitCode::from(2));
    }
    if arguments.modes {
        modes::of_folders(&arguments.folders)?;
    }
    let criteria = match check::criteria(&arguments.criteria) {
        Ok(criteria) => criteria,
        Err(error) => {
            super::tell_chain(&results::causes(&error), error.help());
            return Ok(ExitCode::from(2));
        }
    };
    if arguments.measured.is_none() && arguments.record.is_given() {
        let cause =
            "--map, --time-column and --offset describe a record, but none is given".to_owned();
        super::tell_chain(&[cause], Some("add --measured FILE"));
        return Ok(ExitCode::from(2));
    }
    match make(arguments, &criteria) {
        Ok((text, paths)) => {
            let lines = paths.iter().map(|path| format!("{}\n", path.display()));
            super::print(&(text + &lines.collect::<String>()))
        }
        Err(Failure::Record(error)) => {
            super::tell_chain(&error.chain(), error.help());
            Ok(ExitCode::from(2))
        }
        Err(Failure::Report(error)) => {
            super::tell_chain(&error.chain(), error.help());
            Ok(ExitCode::from(if error.is_bad_input() { 2 } else { 1 }))
        }
    }
}

/// Why nothing was made.
enum Failure {
    Report(ReportError),
    Record(MeasuredError),
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        Self::Report(error)
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::Report(error.into())
    }
}

impl From<MeasuredError> for Failure {
    fn from(error: MeasuredError) -> Self {
        Self::Record(error)
    }
}

/// Makes what is asked for. Returns what to print, and the paths of the files.
fn make(
    arguments: &Arguments,
    criteria: &IndexMap<String, Metric>,
) -> Result<(String, Vec<PathBuf>), Failure> {
    let folders = &arguments.folders;
    let mut runs: Vec<RunResults> =
        folders.iter().map(|it| RunResults::read(it)).collect::<Result<_, _>>()?;
    if !criteria.is_empty() {
        runs.iter_mut().for_each(|run| run.verdicts = report::judge(run, criteria));
    }
    report::order(&mut runs);
    let beside = match &arguments.measured {
        Some(path) => Some(record::beside(path, &arguments.record, &runs)?),
        None => None,
    };
    let title = arguments.title.as_deref();
    let first = folders.first().map_or(Path::new(""), PathBuf::as_path);
    let path = arguments.out.clone().unwrap_or_else(|| first.join(results::REPORT));
    let figures = path.with_file_name("figures");
    let mut written = Vec::new();
    let mut text = String::new();
    let formats: Vec<pictures::PictureFormat> = arguments
        .format
        .iter()
        .filter_map(|format| match format {
            ReportFormat::Html => None,
            ReportFormat::Svg => Some(pictures::PictureFormat::Svg),
            ReportFormat::Png => Some(pictures::PictureFormat::Png),
        })
        .collect();
    if !formats.is_empty() {
        written.extend(pictures::write(
            &runs,
            &figures,
            &formats,
            &arguments.figures.options(title),
        )?);
    }
    if let Some(beside) = &beside {
        text = beside.lines();
    }
    if arguments.format.contains(&ReportFormat::Html) {
        let mut pages = match beside {
            Some(beside) => beside.write(runs, title, Vec::new(), &path)?,
            None => {
                report::write_titled(&runs, title, &path)?;
                vec![path]
            }
        };
        pages.append(&mut written);
        written = pages;
    }
    let below = written.iter().filter_map(|path| path.strip_prefix(first).ok()?.to_str());
    results::add_files(first, below)
        .map_err(|source| ReportError::Write { path: first.join(results::FILES), source })?;
    Ok((text, written))
}
