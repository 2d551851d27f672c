//! The project's tasks, started as `cargo xtask TASK`; `cargo xtask --help` lists them.

// A program that prints to the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod agreement;
mod binaries;
mod bundles;
mod check;
mod documentation;
mod figures;
mod licences;
mod merge;
mod mutants;
mod package;
mod picture;
mod python;
mod reference;
mod sanitize;
mod screenshot;
mod target;
mod wheel;
mod windows;
mod wine;
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
    /// Build the units and pack them into target/fmu/*.fmu, and two bundles of them
    Package {
        /// Fail if a committed modelDescription/*.xml is stale
        #[arg(long)]
        check: bool,
        /// Pack only the units whose name starts with PREFIX
        #[arg(long, value_name = "PREFIX")]
        only: Option<String>,
        /// Build for this system instead of the current one.
        /// Repeat it for an .fmu with libraries for several systems.
        /// A Linux triple may end in the oldest glibc to support: TRIPLE.2.17
        #[arg(long, value_name = "TRIPLE", verbatim_doc_comment)]
        target: Vec<Target>,
        /// Build for any Linux with glibc 2.17 or later, and check the libraries
        #[arg(long)]
        portable: bool,
        /// Build the command too, as maglev-PLATFORM-PROCESSOR beside the units
        #[arg(long)]
        maglev: bool,
        /// Folder for the .fmu files [default: target/fmu]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Print and check what the libraries in .fmu files need and export
    Binaries {
        /// The .fmu files
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Newest glibc that Linux libraries may need, such as 2.17
        #[arg(long, value_name = "VERSION")]
        glibc: Option<String>,
    },
    /// Compute reference results that are out of tolerance anew (part of codegen)
    Reference {
        /// Write nothing; fail if results are out of tolerance
        #[arg(long)]
        check: bool,
    },
    /// Merge .fmu files of one unit, packed on several systems, into one.
    /// Given folders, each unit, bundle and library of bundles in them.
    #[command(verbatim_doc_comment)]
    Merge {
        /// The new .fmu file, or the new folder
        out: PathBuf,
        /// The .fmu files, or the folders, to merge
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
    /// Build units, bundles and command for Windows, run them under wine, compare with Linux.
    /// Installs a compiler, a linker and wine from Debian's packages if they are missing.
    /// Writes target/windows/fmu/*.fmu with binaries for both systems.
    #[command(verbatim_doc_comment)]
    Windows,
    /// Build the Python package into target/wheel: a wheel with the units and the command
    Wheel {
        /// Build for any Linux with glibc 2.17 or later
        #[arg(long)]
        portable: bool,
        /// Install it into an environment of its own, and run its tests there
        #[arg(long)]
        test: bool,
    },
    /// Build and package the units, and run a scenario
    Run {
        /// The scenario
        #[arg(default_value = "scenarios/low-speed.json")]
        scenario: PathBuf,
        /// Options for `maglev run`
        #[arg(last = true)]
        options: Vec<String>,
    },
    /// Run all checks: format, lints, Rust and Python tests, generated files, documentation
    Test {
        /// Run only format, lints and fast tests, with the dev profile.
        /// Takes less than two minutes after a build; use it while you edit.
        #[arg(long, conflicts_with = "no_python", verbatim_doc_comment)]
        quick: bool,
        /// Skip the Python tests and the guide
        #[arg(long)]
        no_python: bool,
    },
    /// Build the guide as a book in target/docs/html, and check its links
    Docs,
    /// Make random calls on the units under address and leak sanitizers (Linux, x86_64)
    Sanitize {
        /// Number of calls on each unit
        #[arg(long, default_value_t = 1_000_000)]
        calls: u64,
    },
    /// Change the code of the physics one place at a time, and see whether a test fails.
    /// Takes seconds for each of thousands of mutants, so it is not part of `test`.
    /// A survivor that crates/xtask/mutants.json does not accept is an error.
    #[command(verbatim_doc_comment)]
    Mutants(mutants::Selection),
    /// Take docs/report.png, the picture of a report (may install Chromium)
    Screenshot,
    /// Draw the pictures of docs/stability.md anew, each by the page's own command
    Figures,
    /// Run the scenarios of the paper's figures, and write docs/paper.md
    Paper {
        /// Use the results of the previous run instead of running the scenarios
        #[arg(long)]
        keep_results: bool,
    },
    /// Run the study of the paper's readings, and write its dataset and docs/paper.md
    ///
    /// Takes ten minutes on two cores. What is there is not computed again.
    Readings,
    /// Regenerate the committed files that are generated from code
    ///
    /// These are: FMI bindings, model descriptions, schema, reference pages, reference results.
    Codegen {
        /// Write nothing; fail if a file is stale
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
            let files = package::package(&Order {
                check,
                only,
                targets: target,
                maglev,
                out,
                ..Order::default()
            })?;
            if glibc.is_some() { binaries::report(&files, glibc.as_deref()) } else { Ok(()) }
        }
        Task::Binaries { files, glibc } => binaries::report(&files, glibc.as_deref()),
        Task::Reference { check } => reference::codegen(check),
        Task::Merge { out, files } => merge::merge(&out, &files),
        Task::Windows => windows::run(),
        Task::Wheel { portable, test } => {
            let wheel = wheel::build(portable)?;
            println!("{}", wheel.display());
            if test { wheel::test(&wheel) } else { Ok(()) }
        }
        Task::Run { scenario, options } => {
            let first = if workspace::maglev().exists() { "" } else { FIRST_BUILD };
            eprintln!("[1/2] Build the units and the command `maglev`{first}, and pack the units");
            package::package(&Order { also: &[workspace::COMMAND], ..Order::default() })?;
            eprintln!("[2/2] Run {}", scenario.display());
            workspace::run_maglev(&scenario, &options)
        }
        Task::Test { quick: true, .. } => check::quick(),
        Task::Test { quick: false, no_python } => check::all(!no_python),
        Task::Docs => check::guide(),
        Task::Sanitize { calls } => sanitize::run(calls),
        Task::Mutants(selection) => mutants::run(&selection),
        Task::Screenshot => screenshot::take(),
        Task::Figures => figures::draw(),
        Task::Paper { keep_results } => paper(keep_results),
        Task::Readings => {
            package::package(&Order { also: &[workspace::COMMAND], ..Order::default() })?;
            workspace::run(workspace::build_program("paper")?, &["--readings"])
        }
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn issue_13_lines_of_help_fit_100_columns() {
        let mut texts = vec![Cli::command().render_long_help().to_string()];
        for task in Cli::command().get_subcommands_mut() {
            texts.push(task.render_help().to_string());
            texts.push(task.render_long_help().to_string());
        }
        for line in texts.iter().flat_map(|text| text.lines()) {
            assert!(line.chars().count() <= 100, "{line}");
        }
    }
}
