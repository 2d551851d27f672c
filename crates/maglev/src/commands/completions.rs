//! `maglev completions`

use std::process::ExitCode;

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;
use maglev::Error;

use crate::cli::Cli;

const EXAMPLES: &str = "\
Examples:
  maglev completions bash > ~/.local/share/bash-completion/completions/maglev
  maglev completions fish > ~/.config/fish/completions/maglev.fish";

/// Arguments of `maglev completions`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints the shell's script.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "maglev", &mut script);
    super::print_bytes(&script)
}
