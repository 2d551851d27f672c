//! The `maglev` command: runs scenarios, inspects and validates units.
#![expect(clippy::print_stderr, reason = "a command talks to its user")]
#![expect(clippy::result_large_err, reason = "an error ends the command")]

mod commands;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Runs co-simulations of FMI 2.0 units.
#[derive(Parser)]
#[command(version, about, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scenario and write its results.
    Run(commands::run::Arguments),
    /// Show what a unit offers.
    Inspect(commands::inspect::Arguments),
    /// Look for defects of a unit without running it.
    Validate(commands::validate::Arguments),
    /// Print the JSON schema of scenarios.
    Schema,
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Run(arguments) => commands::run::run(&arguments),
        Command::Inspect(arguments) => commands::inspect::run(&arguments),
        Command::Validate(arguments) => commands::validate::run(&arguments),
        Command::Schema => commands::print(&master::scenario::Scenario::schema()),
    };
    outcome.unwrap_or_else(|error| {
        commands::report(&error);
        ExitCode::from(error.exit_status())
    })
}
