//! `maglev report`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use maglev::Error;
use report::{ReportError, pictures};
use results::RunResults;

use super::modes;

const EXAMPLES: &str = "\
Examples:
  maglev report results/low-speed
  maglev report --modes results/low-speed
  maglev report /tmp/a /tmp/b --out compared.html
  maglev report results/low-speed --format svg,png      # results/low-speed/figures/

Writes one HTML file that needs no network: 3D view, time histories, spectra with the modes
marked, tables, and what ran. Several folders are compared in one report. With --format svg
or png it writes the scenario's pictures and their spectra as files for papers, into the
folder figures beside the report.";

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
    /// File of the report [default: report.html in the first folder].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Formats to write, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "html")]
    format: Vec<ReportFormat>,
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
    if arguments.modes {
        // make() reports a folder without results
        let without = |folder: &&PathBuf| {
            RunResults::exist_in(folder) && !folder.join(results::MODES).exists()
        };
        for folder in arguments.folders.iter().filter(without) {
            modes::of_results(folder)?;
        }
    }
    match make(arguments) {
        Ok(paths) => {
            let lines = paths.iter().map(|path| format!("{}\n", path.display()));
            super::print(&lines.collect::<String>())
        }
        Err(error) => {
            super::tell_chain(&error.chain(), error.help());
            Ok(ExitCode::from(if error.is_bad_input() { 2 } else { 1 }))
        }
    }
}

fn make(arguments: &Arguments) -> Result<Vec<PathBuf>, ReportError> {
    let folders = &arguments.folders;
    let runs: Vec<RunResults> =
        folders.iter().map(|it| RunResults::read(it)).collect::<Result<_, _>>()?;
    let first = folders.first().map_or(Path::new(""), PathBuf::as_path);
    let path = arguments.out.clone().unwrap_or_else(|| first.join(results::REPORT));
    let figures = path.with_file_name("figures");
    let mut written = Vec::new();
    if arguments.format.contains(&ReportFormat::Html) {
        report::write(&runs, &path)?;
        written.push(path);
    }
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
        written.extend(pictures::write(&runs, &figures, &formats)?);
    }
    let below = written.iter().filter_map(|path| path.strip_prefix(first).ok()?.to_str());
    results::add_files(first, below)
        .map_err(|source| ReportError::Write { path: first.join(results::FILES), source })?;
    Ok(written)
}
