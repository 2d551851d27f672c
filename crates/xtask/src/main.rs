//! The project's tasks: `cargo xtask package | run | test | docs | screenshot | sanitize | codegen | paper | reference | binaries | merge`.

// A task runner talks to its user on the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod binaries;
mod check;
mod documentation;
mod licences;
mod package;
mod picture;
mod python;
mod reference;
mod sanitize;
mod screenshot;
mod target;
mod workspace;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::{package::Order, target::Target};

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
        /// Build for this system, instead of the one at hand; may be given repeatedly, and all
        /// libraries go into one .fmu. A Linux target may end in the oldest glibc that must do
        #[arg(long, value_name = "TRIPLE")]
        target: Vec<Target>,
        /// Build for every Linux with glibc 2.17 or later, and check that the libraries keep to it
        #[arg(long)]
        portable: bool,
        /// Build the command `maglev` for the same systems, as maglev-PLATFORM-PROCESSOR beside them
        #[arg(long)]
        maglev: bool,
        /// Folder for the .fmu files [default: target/fmu]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Print what the libraries in .fmu files need and export, and check it
    Binaries {
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Newest glibc that those for Linux may need, such as 2.17
        #[arg(long, value_name = "VERSION")]
        glibc: Option<String>,
    },
    /// Compute the units' reference results anew where they left their tolerance (part of codegen)
    Reference {
        /// Change nothing, fail on a difference
        #[arg(long)]
        check: bool,
    },
    /// Join .fmu files of one unit, packed on several systems, into one
    Merge {
        out: PathBuf,
        #[arg(required = true)]
        files: Vec<PathBuf>,
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
    /// Everything that must pass: format, lints, generated files, Rust and Python tests, docs, guide
    Test {
        /// Leave out the Python tests (no fmpy at hand)
        #[arg(long)]
        no_python: bool,
    },
    /// Make a book of the guide, target/docs/html, and check its links
    Docs,
    /// Random calls on the units, built with the address and leak sanitizers (Linux, x86_64)
    Sanitize {
        /// Calls on each unit
        #[arg(long, default_value_t = 1_000_000)]
        calls: u64,
    },
    /// Take docs/report.png, the picture of the 5 km/h run's report (installs Chromium where allowed)
    Screenshot,
    /// Run the scenarios of the paper's figures, and write docs/paper.md with its pictures
    Paper {
        /// Take the results of the last time instead of running the scenarios
        #[arg(long)]
        keep_results: bool,
    },
    /// Regenerate what is generated and committed: FMI bindings, model descriptions, layouts, schema,
    /// reference pages of the guide
    Codegen {
        /// Change nothing, fail on a difference
        #[arg(long)]
        check: bool,
    },
}

/// How long a user has to wait the first time.
const FIRST_BUILD: &str = " (the first time: about 3 minutes on two cores)";

fn main() -> Result<()> {
    match Cli::parse().task {
        Task::Package { check, only, mut target, portable, maglev, out } => {
            if portable {
                target.push(target::PORTABLE.parse().map_err(anyhow::Error::msg)?);
            }
            let glibc = target.iter().find_map(|target| target.glibc.clone());
            let files =
                package::package(&Order { check, only, targets: target, maglev, out, also: &[] })?;
            if glibc.is_some() { binaries::report(&files, glibc.as_deref()) } else { Ok(()) }
        }
        Task::Binaries { files, glibc } => binaries::report(&files, glibc.as_deref()),
        Task::Reference { check } => reference::codegen(check),
        Task::Merge { out, files } => package::merge(&out, &files),
        Task::Run { scenario, options } => {
            let first = if workspace::maglev().exists() { "" } else { FIRST_BUILD };
            eprintln!("[1/2] Build the units and the command `maglev`{first}, and pack the units");
            package::package(&Order { also: &[workspace::COMMAND], ..Order::default() })?;
            eprintln!("[2/2] Run {}", scenario.display());
            workspace::run_maglev(&scenario, &options)
        }
        Task::Test { no_python } => check::all(!no_python),
        Task::Docs => check::guide(),
        Task::Sanitize { calls } => sanitize::run(calls),
        Task::Screenshot => screenshot::take(),
        Task::Paper { keep_results } => paper(keep_results),
        Task::Codegen { check } => check::codegen(check),
    }
}

/// Builds what the paper's scenarios need, and starts the program that runs them and writes the page.
fn paper(keep_results: bool) -> Result<()> {
    if !keep_results {
        package::package(&Order { also: &[workspace::COMMAND], ..Order::default() })?;
    }
    let program = workspace::build_program("paper")?;
    let options = if keep_results { &["--keep-results"][..] } else { &[] };
    workspace::run(program, options)
}
