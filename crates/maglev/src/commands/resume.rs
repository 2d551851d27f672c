//! `maglev resume`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use maglev::Error;
use scenario::LogLevel;

use super::display::{End, watch};

const EXAMPLES: &str = "\
Examples:
  maglev run scenarios/low-speed.json --checkpoint-every 10 --out /tmp/low-speed
  maglev resume /tmp/low-speed      # after a crash, a full disk, Ctrl-C

The run goes on from its last checkpoint with the settings that it began with; its results are those
of a run without the stop, byte for byte. The files of the units must still be where they were.";

/// Arguments of `maglev resume`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The results folder of the run.
    folder: PathBuf,
    /// Make no report (report.html) at the end.
    #[arg(long)]
    no_report: bool,
    /// Say nothing unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
}

/// Goes on with the run.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let folder = &arguments.folder;
    let level = LogLevel::default();
    let end = End { folder, quiet: arguments.quiet, report: !arguments.no_report, level };
    watch(&end, |observer| maglev::run::resume(folder, observer))
}
