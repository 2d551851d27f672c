//! `maglev resume`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use maglev::Error;
use scenario::LogLevel;

use super::display::{EndOptions, watch};

const EXAMPLES: &str = "\
Examples:
  maglev run scenarios/low-speed.json --checkpoint-every 10 --out /tmp/low-speed
  maglev resume /tmp/low-speed      # after a crash, a full disk, Ctrl-C

The run continues from its last checkpoint with its original settings. The results are the
same, byte for byte, as those of a run without the interruption. The units' files must still
be where they were. --json prints the same as for `maglev run`.";

/// Arguments of `maglev resume`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The results folder of the run.
    folder: PathBuf,
    #[command(flatten)]
    end: EndOptions,
}

/// Resumes the run.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let folder = &arguments.folder;
    let terminal = arguments.end.terminal(folder, LogLevel::default());
    watch(&terminal, |observer| maglev::run::resume(folder, observer))
}
