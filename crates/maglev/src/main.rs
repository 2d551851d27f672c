//! The `maglev` command: runs scenarios, inspects and validates units.
#![expect(clippy::print_stderr, reason = "a command talks to its user")]
#![expect(clippy::result_large_err, reason = "an error ends the command")]

mod cli;
mod commands;
#[cfg(target_os = "linux")]
mod exits;

use std::process::ExitCode;

use clap::Parser as _;

use cli::{Cli, Command};

fn main() -> ExitCode {
    if let Some(status) = fmi2_import::isolate::serve_if_worker() {
        return status;
    }
    fmi2_import::witness::report_crashes();
    let command = Cli::parse().command;
    // the checks include what a unit does at the end of the process
    let checks_units =
        matches!(command, Command::ConformanceCheck(_) | Command::ConformanceResume(_));
    let outcome = match command {
        Command::Run(arguments) => commands::run::run(&arguments),
        Command::Resume(arguments) => commands::resume::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Check(arguments) => commands::check::run(&arguments),
        Command::Response(arguments) => commands::response::run(&arguments),
        Command::Modes(arguments) => commands::modes::run(&arguments),
        Command::Fit(arguments) => commands::fit::run(&arguments),
        Command::Floquet(arguments) => commands::floquet::run(&arguments),
        Command::Map(arguments) => commands::map::run(&arguments),
        Command::Tune(arguments) => commands::tune::run(&arguments),
        Command::Linearize(arguments) => commands::linearize::run(&arguments),
        Command::Bundle(arguments) => commands::bundle::run(&arguments),
        Command::Derive(arguments) => commands::derive::run(&arguments),
        Command::Export(arguments) => commands::export::run(&arguments),
        Command::Inspect(arguments) => commands::inspect::run(&arguments),
        Command::Validate(arguments) => commands::validate::run(&arguments),
        Command::Reference(arguments) => commands::reference::run(&arguments),
        Command::ConformanceCheck(arguments) => commands::conformance::check(&arguments),
        Command::ConformanceResume(arguments) => Ok(commands::conformance::resume(&arguments)),
        Command::Completions(arguments) => commands::completions::run(&arguments),
        Command::Man(arguments) => commands::man::run(&arguments),
        Command::Study(arguments) => commands::study::run(&arguments),
        Command::Schema(arguments) => commands::schema::run(&arguments),
    };
    let status = outcome.unwrap_or_else(|error| {
        commands::tell(&error);
        ExitCode::from(error.exit_status())
    });
    if checks_units {
        fmi2_import::witness::release();
        return status;
    }
    fmi2_import::witness::leave(status)
}
