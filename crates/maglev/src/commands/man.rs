//! `maglev man`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Command, CommandFactory as _};
use clap_mangen::Man;
use maglev::Error;
use results::write_whole;

use crate::cli::Cli;

const EXAMPLES: &str = "\
Examples:
  maglev man | man -l -
  maglev man --out ~/.local/share/man/man1";

/// Arguments of `maglev man`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Write one file per page, maglev.1, maglev-run.1 and so on, into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Prints the pages or writes their files.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let pages = pages();
    let Some(folder) = &arguments.out else {
        return super::print_bytes(
            &pages.into_iter().flat_map(|(_, page)| page).collect::<Vec<u8>>(),
        );
    };
    let failed = |path: &Path, source| Error::Write { path: path.into(), source };
    std::fs::create_dir_all(folder).map_err(|source| failed(folder, source))?;
    for (name, page) in pages {
        let path = folder.join(name);
        write_whole(&path, &page).map_err(|source| failed(&path, source))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// File name and text of every page: the command's, then the subcommands'.
fn pages() -> Vec<(String, Vec<u8>)> {
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    let shown = command.get_subcommands().filter(|it| !it.is_hide_set());
    let commands: Vec<Command> = std::iter::once(&command).chain(shown).cloned().collect();
    commands.into_iter().map(page).collect()
}

fn page(command: Command) -> (String, Vec<u8>) {
    let page = Man::new(command).source(concat!("maglev ", env!("MAGLEV_VERSION")));
    let mut text = Vec::new();
    // writing to a Vec cannot fail
    let _ = page.render(&mut text);
    (page.get_filename(), text)
}
