//! `maglev study report`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use maglev::Error;
use study_report::{StudyReportError, StudyResults};

const EXPLANATION: &str = "\
Writes one HTML file that needs no network: maps of a figure over two factors with contours and
the boundary of stability, main effects and Sobol indices, quantiles over seeds, the Pareto front,
scatter plots, parallel coordinates, and a table of all points with links to the reports of those
that were kept. Each picture can be saved as SVG. It shows the points that metrics.csv holds.";

/// Arguments of `maglev study report`.
#[derive(Args)]
#[command(after_help = EXPLANATION)]
pub struct Arguments {
    /// The results folder of the study.
    folder: PathBuf,
    /// Title of the report [default: that of the study].
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// File of the report [default: report.html in the folder].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the report and prints its path.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    match make(arguments) {
        Ok(path) => super::super::print(&format!("{}\n", path.display())),
        Err(error) => {
            super::super::tell_chain(&results::causes(&error), Some(error.help()));
            Ok(ExitCode::from(if error.is_bad_input() { 2 } else { 1 }))
        }
    }
}

fn make(arguments: &Arguments) -> Result<PathBuf, StudyReportError> {
    let study = StudyResults::read(&arguments.folder)?;
    let path = arguments.out.clone().unwrap_or_else(|| arguments.folder.join(results::REPORT));
    study_report::write(&study, arguments.title.as_deref(), &path)?;
    Ok(path)
}
