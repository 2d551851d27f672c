//! One module per subcommand, and what they share: progress ([`display`]), the lines at the end of a
//! run ([`closing`]), [`names`] for options, [`table`]s, [`stdout`].

pub mod analysis;
pub mod bundle;
pub mod check;
pub mod closing;
pub mod completions;
pub mod conformance;
pub mod derive;
pub mod display;
pub mod export;
pub mod fit;
pub mod floquet;
pub mod inspect;
pub mod linearize;
pub mod man;
pub mod map;
pub mod measured;
pub mod modes;
pub mod names;
pub mod orders;
pub mod positions;
pub mod reference;
pub mod report;
pub mod report_figures;
pub mod response;
mod response_page;
pub mod resume;
pub mod run;
pub mod schema;
pub mod stdout;
pub mod study;
pub mod system;
pub mod table;
pub mod tune;
pub mod unit_modes;
pub mod validate;
pub mod verdicts;

use std::io::{self, Write as _};
use std::process::ExitCode;

use maglev::Error;

/// Does work that runs units, and then returns to the working directory, in case a unit changed it.
pub fn at_home<T>(work: impl FnOnce() -> T) -> T {
    let home = std::env::current_dir();
    let result = work();
    if let Ok(home) = home
        && std::env::current_dir().ok().as_ref() != Some(&home)
        && let Err(error) = std::env::set_current_dir(&home)
    {
        let home = home.display();
        eprintln!(
            "warning: a unit changed the working directory, and {home} no longer exists: {error}"
        );
    }
    result
}

/// What errors call stdout.
const STDOUT: &str = "the standard output";

/// Prints text to stdout.
pub fn print(text: &str) -> Result<ExitCode, Error> {
    print_bytes(text.as_bytes())
}

/// Prints to stdout. It is no error if the reader has closed the pipe.
pub fn print_bytes(bytes: &[u8]) -> Result<ExitCode, Error> {
    match io::stdout().write_all(bytes) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: STDOUT.into(), source })
        }
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints an error with its causes and a remedy.
pub fn tell(error: &Error) {
    tell_chain(&error.chain(), error.help());
}

/// Prints causes, outermost first, and a remedy.
pub fn tell_chain(chain: &[String], help: Option<&str>) {
    for (depth, text) in chain.iter().enumerate() {
        match depth {
            0 => eprintln!("error: {text}"),
            _ => eprintln!("{}because: {text}", "  ".repeat(depth)),
        }
    }
    if let Some(help) = help {
        eprintln!("help: {help}");
    }
}
