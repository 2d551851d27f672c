//! The `maglev` command: runs scenarios, inspects and validates units.
#![expect(clippy::print_stderr, reason = "a command talks to its user")]
#![expect(clippy::result_large_err, reason = "an error ends the command")]

mod commands;
#[cfg(target_os = "linux")]
mod exits;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

const EXAMPLES: &str = "\
Examples:
  maglev run scenarios/low-speed.json
  maglev inspect target/fmu/vehicle.fmu
  maglev schema > schema.json

Exit status: 0 all is well, 1 a run failed or a unit has errors, 2 bad usage or input.";

/// Runs co-simulations of FMI 2.0 units.
#[derive(Parser)]
#[command(version, about, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scenario and write its results
    #[command(arg_required_else_help = true)]
    Run(commands::run::Arguments),
    /// Go on with a run from its last checkpoint
    #[command(arg_required_else_help = true)]
    Resume(commands::resume::Arguments),
    /// Make an HTML report of results: plots, spectra, tables
    #[command(arg_required_else_help = true)]
    Report(commands::report::Arguments),
    /// Show what a unit offers
    #[command(arg_required_else_help = true)]
    Inspect(commands::inspect::Arguments),
    /// Show the modes of a scenario's coupled system: frequencies, damping, what takes part
    #[command(arg_required_else_help = true)]
    Modes(commands::coupled_modes::Arguments),
    /// Look for defects of a unit without running it
    #[command(arg_required_else_help = true)]
    Validate(commands::validate::Arguments),
    /// Repeat the reference experiments that a unit carries, and compare
    #[command(arg_required_else_help = true)]
    Reference(commands::reference::Arguments),
    /// Print the JSON schema of scenarios.
    Schema,
    /// One check of `validate --dynamic`, in a process of its own.
    #[command(hide = true)]
    ConformanceCheck(commands::conformance::Check),
    /// A serialized state of `validate --dynamic` that goes on in a process of its own.
    #[command(hide = true)]
    ConformanceResume(commands::conformance::Resume),
}

fn main() -> ExitCode {
    if let Some(status) = fmi2_import::isolate::serve_if_worker() {
        return status;
    }
    fmi2_import::witness::report_crashes();
    let command = Cli::parse().command;
    // what a unit does at the end of the process is one of the things that are checked
    let checks_units =
        matches!(command, Command::ConformanceCheck(_) | Command::ConformanceResume(_));
    let outcome = match command {
        Command::Run(arguments) => commands::run::run(&arguments),
        Command::Resume(arguments) => commands::resume::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Modes(arguments) => commands::coupled_modes::run(&arguments),
        Command::Inspect(arguments) => commands::inspect::run(&arguments),
        Command::Validate(arguments) => commands::validate::run(&arguments),
        Command::Reference(arguments) => commands::reference::run(&arguments),
        Command::ConformanceCheck(arguments) => commands::conformance::check(&arguments),
        Command::ConformanceResume(arguments) => Ok(commands::conformance::resume(&arguments)),
        Command::Schema => commands::print(&scenario::Scenario::schema()),
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
