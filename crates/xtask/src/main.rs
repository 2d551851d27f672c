//! The project's tasks: `cargo xtask package | run | test | codegen`.

// A task runner talks to its user on the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod check;
mod documentation;
mod package;
mod python;
mod workspace;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "The project's tasks", version)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build the units and pack them into target/fmu/*.fmu
    Package {
        /// Fail where a committed modelDescription/*.xml differs from the unit's table
        #[arg(long)]
        check: bool,
        /// Pack only the units whose name starts so
        #[arg(long)]
        only: Option<String>,
    },
    /// Package the units and run a scenario with the release build of `maglev`
    Run {
        /// The scenario
        #[arg(default_value = "scenarios/low-speed.json")]
        scenario: PathBuf,
        /// Options handed to `maglev run`
        #[arg(last = true)]
        options: Vec<String>,
    },
    /// Everything that must pass: format, lints, generated files, Rust and Python tests, docs
    Test {
        /// Leave out the Python tests (no fmpy at hand)
        #[arg(long)]
        no_python: bool,
    },
    /// Regenerate what is generated and committed: FMI bindings, model descriptions, layouts, schema
    Codegen {
        /// Change nothing, fail on a difference
        #[arg(long)]
        check: bool,
    },
}

fn main() -> Result<()> {
    match Cli::parse().task {
        Task::Package { check, only } => package::package(check, only.as_deref()).map(drop),
        Task::Run { scenario, options } => {
            package::package(false, None)?;
            workspace::run_maglev(&scenario, &options)
        }
        Task::Test { no_python } => check::all(!no_python),
        Task::Codegen { check } => check::codegen(check),
    }
}
