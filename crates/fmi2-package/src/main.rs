//! The command `fmi2-package`: packs a built library into an .fmu.

// A command prints to the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use fmi2_package::{Archive, Error, describe, host};

/// Packs a library that was made with fmi2-export into an .fmu
#[derive(Parser)]
#[command(name = "fmi2-package", version)]
struct Cli {
    /// The built library, for the system that this command runs on
    library: PathBuf,
    /// Folder that becomes resources/
    #[arg(long)]
    resources: Option<PathBuf>,
    /// Folder that becomes documentation/
    #[arg(long)]
    documentation: Option<PathBuf>,
    /// The library for another system, such as win64=target/x86_64-pc-windows-gnu/release/x.dll
    #[arg(long, value_name = "PLATFORM=FILE", value_parser = other_system)]
    binary: Vec<(String, PathBuf)>,
    /// The .fmu; without it, a file here that is named after the model identifier
    #[arg(long, short)]
    out: Option<PathBuf>,
}

fn other_system(text: &str) -> Result<(String, PathBuf), String> {
    let (platform, file) = text.split_once('=').ok_or("expected PLATFORM=FILE")?;
    Ok((platform.into(), file.into()))
}

fn main() -> ExitCode {
    match pack(&Cli::parse()) {
        Ok(file) => {
            println!("{}", file.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {}", chain(&error));
            ExitCode::FAILURE
        }
    }
}

/// The error and its causes, separated by colons.
fn chain(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

fn pack(cli: &Cli) -> Result<PathBuf, Error> {
    let description = describe(&cli.library, cli.resources.as_deref())?;
    let mut archive = Archive::new(&description)?;
    archive.binary(host()?, &cli.library)?;
    for (platform, file) in &cli.binary {
        archive.binary(platform, file)?;
    }
    let folders = [("resources", &cli.resources), ("documentation", &cli.documentation)];
    for (name, folder) in folders {
        if let Some(folder) = folder {
            archive.folder(name, folder)?;
        }
    }
    let name = || Path::new(&format!("{}.fmu", archive.identifier())).to_path_buf();
    let out = cli.out.clone().unwrap_or_else(name);
    archive.write(&out)?;
    Ok(out)
}
