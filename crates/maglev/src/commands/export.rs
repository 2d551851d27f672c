//! `maglev export`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::system::Opened;
use clap::{ArgGroup, Args, ValueEnum};
use maglev::Error;
use scenario::{GivenTimes, Override};
use ssp::SspVersion;

const EXAMPLES: &str = "\
Examples:
  maglev export scenarios/one-bogie.json --ssp one-bogie.ssp
  maglev export scenarios/one-bogie.json --ssp soft.ssp --set guideway.stiffness_factor=0.5
  maglev export SYSTEM.ssp --scenario my-system

SSP (System Structure and Parameterization) describes units, connections and values, but no
coupling algorithm, recording, events or inputs over time. These go into an annotation, which
`maglev run FILE.ssp` reads and other tools do not; the command says what is in it.";

/// Arguments of `maglev export`.
#[derive(Args)]
#[command(
    after_help = EXAMPLES,
    group = ArgGroup::new("format").args(["ssp", "scenario"]).required(true)
)]
pub struct Arguments {
    /// The scenario (.json), or a system (.ssp, or the .ssd of an unpacked one).
    input: PathBuf,
    /// Write an SSP archive with the units.
    #[arg(long, value_name = "FILE")]
    ssp: Option<PathBuf>,
    /// Write a scenario, scenario.json and its units, into this folder.
    #[arg(long, value_name = "DIR")]
    scenario: Option<PathBuf>,
    /// Version of SSP.
    #[arg(long, value_name = "VERSION", default_value = "1.0", requires = "ssp")]
    ssp_version: Version,
    /// Set a parameter or start value, as for `maglev run`. Can be repeated.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE", requires = "ssp")]
    set: Vec<Override>,
}

/// A version of SSP.
#[derive(Clone, Copy, ValueEnum)]
enum Version {
    #[value(name = "1.0")]
    V1,
    #[value(name = "2.0")]
    V2,
}

/// Writes the archive or the scenario.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    match (&arguments.ssp, &arguments.scenario) {
        (Some(archive), _) => to_ssp(arguments, archive),
        (_, Some(folder)) => to_scenario(&arguments.input, folder),
        // clap demands one of them
        (None, None) => Ok(ExitCode::from(2)),
    }
}

fn to_ssp(arguments: &Arguments, archive: &Path) -> Result<ExitCode, Error> {
    let opened = Opened::new(&arguments.input, None)?;
    let mut scenario = opened.load(GivenTimes::default())?;
    tell(&scenario.notes);
    scenario.overrides.clone_from(&arguments.set);
    let version = match arguments.ssp_version {
        Version::V1 => SspVersion::V1,
        Version::V2 => SspVersion::V2,
    };
    let exported = super::at_home(|| ssp::export(&scenario, version, archive))?;
    let mut text = String::new();
    // writing to a String cannot fail
    let _ = writeln!(
        text,
        "{}: SSP {}, {} components, {} connections",
        archive.display(),
        version.as_str(),
        exported.components,
        exported.connections
    );
    for note in &exported.notes {
        let _ = writeln!(text, "note: {note}");
    }
    super::print(&text)
}

fn to_scenario(system: &Path, folder: &Path) -> Result<ExitCode, Error> {
    if !ssp::is_system(system) {
        return Err(Error::NoSystem { path: system.to_owned() });
    }
    let kept = folder.join("scenario.json");
    if kept.exists() {
        let cause = format!("{} exists, and may have been edited", kept.display());
        super::tell_chain(&[cause], Some("give another folder, or remove this file first"));
        return Ok(ExitCode::from(2));
    }
    let imported = ssp::import(system, folder)?;
    let mut text = format!("{}\n", imported.scenario.display());
    for note in &imported.notes {
        let _ = writeln!(text, "note: {note}");
    }
    super::print(&text)
}

fn tell(notes: &[String]) {
    for note in notes {
        eprintln!("note: {note}");
    }
}
