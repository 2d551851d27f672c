//! The command line, in one declaration: clap parses it, and makes the help, the completions and the
//! manual pages of it.

use clap::{Parser, Subcommand};

use crate::commands;

const HELP: &str = "\
Examples:
  maglev run scenarios/low-speed.json
  maglev inspect target/fmu/vehicle.fmu
  maglev schema > schema.json

Exit statuses:
  0  success: the run reached its stop time, a stop condition ended it, or a
     unit ended it with fmi2Terminated; all modes decay, for response those
     of the closed system; tune keeps all limits; check finds no limit
     exceeded; validate finds no error; reference results are within tolerance
  1  a failed run or verdict: the run failed or was interrupted (results
     until then are kept); a unit refuses to start with its parameters; a mode
     grows; a fit does not converge; tune does not keep all limits; a run does
     not pass check; validate finds an error; reference results are outside their
     tolerance; a report cannot be written
  2  bad usage or input: unknown option, invalid scenario or layout, a unit or
     file that cannot be read, a folder that is in use or has no results
  75 try again: another process computes the points of a study, or points
     remain";

/// Runs co-simulations of FMI 2.0 units.
#[derive(Parser)]
#[command(
    name = "maglev",
    version = env!("MAGLEV_VERSION"),
    max_term_width = 100,
    arg_required_else_help = true,
    after_help = HELP
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Subcommand)]
pub enum Command {
    /// Run a scenario, or one unit, and write the results
    #[command(arg_required_else_help = true)]
    Run(commands::run::Arguments),
    /// Resume a run from its last checkpoint
    #[command(arg_required_else_help = true)]
    Resume(commands::resume::Arguments),
    /// Make an HTML report of results: plots, spectra, tables
    #[command(arg_required_else_help = true)]
    Report(commands::report::Arguments),
    /// Judge runs by criteria: figures, limits, margins
    #[command(arg_required_else_help = true)]
    Check(commands::check::Arguments),
    /// Show parameters, signals and capabilities of a unit
    #[command(arg_required_else_help = true)]
    Inspect(commands::inspect::Arguments),
    /// Make a new unit of one with other resources, such as another layout
    #[command(arg_required_else_help = true)]
    Derive(commands::derive::Arguments),
    /// Pack a scenario with its units and the master into one unit
    #[command(arg_required_else_help = true)]
    Bundle(commands::bundle::Arguments),
    /// Write a scenario as an SSP archive for other tools, or an SSP archive as a scenario
    #[command(arg_required_else_help = true)]
    Export(commands::export::Arguments),
    /// Show the modes of a coupled system: frequencies, damping, participation
    #[command(arg_required_else_help = true)]
    Modes(commands::modes::Arguments),
    /// Show whether a train that moves over an endless row of spans is stable
    #[command(arg_required_else_help = true)]
    Floquet(commands::floquet::Arguments),
    /// Map the least damping of a coupled system over two parameters
    #[command(arg_required_else_help = true)]
    Map(commands::map::Arguments),
    /// Fit parameters to a measured record, with confidence intervals
    #[command(arg_required_else_help = true)]
    Fit(commands::fit::Arguments),
    /// Find gains of controllers that maximise damping, within limits of margins and voltage
    #[command(arg_required_else_help = true)]
    Tune(commands::tune::Arguments),
    /// Write a coupled system and its units as state-space models: A, B, C, D with names
    #[command(arg_required_else_help = true)]
    Linearize(commands::linearize::Arguments),
    /// Show frequency responses and stability margins of a coupled system, without a run
    #[command(arg_required_else_help = true)]
    Response(commands::response::Arguments),
    /// Check a unit against FMI 2.0
    #[command(arg_required_else_help = true)]
    Validate(commands::validate::Arguments),
    /// Repeat the reference experiments that a unit contains, and compare
    #[command(arg_required_else_help = true)]
    Reference(commands::reference::Arguments),
    /// Compute many variants of a scenario: grids, samples, seeds
    Study(commands::study::Arguments),
    /// Print the JSON schema of scenarios, studies, criteria, tunings, or layouts
    Schema(commands::schema::Arguments),
    /// Print completions for a shell
    #[command(arg_required_else_help = true)]
    Completions(commands::completions::Arguments),
    /// Print the manual pages, or write them into a folder
    Man(commands::man::Arguments),
    /// One check of `validate --dynamic`, in a process of its own
    #[command(hide = true)]
    ConformanceCheck(commands::conformance::Check),
    /// Restores a serialized state of `validate --dynamic` in a process of its own
    #[command(hide = true)]
    ConformanceResume(commands::conformance::Resume),
}
