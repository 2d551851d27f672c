//! One module per subcommand.

pub mod conformance;
pub mod coupled_modes;
pub mod display;
pub mod inspect;
pub mod modes;
pub mod reference;
pub mod report;
pub mod resume;
pub mod run;
pub mod validate;

use std::io::{self, Write as _};
use std::process::ExitCode;

use maglev::Error;

/// Does what runs units, and goes back to the folder that this program was started in, if a unit has
/// left it.
pub fn at_home<T>(work: impl FnOnce() -> T) -> T {
    let home = std::env::current_dir();
    let result = work();
    if let Ok(home) = home
        && std::env::current_dir().ok().as_ref() != Some(&home)
        && let Err(error) = std::env::set_current_dir(&home)
    {
        let home = home.display();
        eprintln!("warning: a unit left the working directory {home}, and it is gone: {error}");
    }
    result
}

/// Prints to stdout; a reader that has gone away is no error.
pub fn print(text: &str) -> Result<ExitCode, Error> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Output { path: "the terminal".into(), running: true, source })
        }
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints an error with its causes and how to mend it.
pub fn tell(error: &Error) {
    tell_chain(&error.chain(), error.help());
}

/// Prints causes, outermost first, and how to mend it.
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
