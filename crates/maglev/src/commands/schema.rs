//! `maglev schema`

use std::process::ExitCode;

use clap::{Args, ValueEnum};
use criteria::CriteriaFile;
use maglev::Error;
use scenario::Scenario;
use study::StudyFile;
use tune::Tuning;

const EXAMPLES: &str = "\
Examples:
  maglev schema > schema.json
  maglev schema vehicle > vehicle.schema.json

An editor that knows JSON Schema completes and explains the keys of a file that begins with
  \"$schema\": \"schema.json\"";

/// The schemas of the layouts and of track lines, as the repository publishes them. Tests of `multibody`, `guideway` and
/// `track-line` keep them current; so the command does without the code that makes them.
const VEHICLE: &str = include_str!("../../../../fmu-vehicle/resources/schema.json");
const GUIDEWAY: &str = include_str!("../../../../fmu-guideway/resources/schema.json");
const LINE: &str = include_str!("../../../../fmu-vehicle/resources/line-schema.json");

/// Arguments of `maglev schema`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The kind of file.
    #[arg(default_value = "scenario")]
    of: FileKind,
}

/// A kind of file that has a schema.
#[derive(Clone, Copy, ValueEnum)]
enum FileKind {
    /// A scenario.
    Scenario,
    /// Criteria of `maglev check`.
    Criteria,
    /// A study of `maglev study`.
    Study,
    /// A tuning of `maglev tune`.
    Tuning,
    /// The layout of a vehicle, vehicle.json.
    Vehicle,
    /// The layout of a guideway, guideway.json.
    Guideway,
    /// The line of a track with curves, line.json of a vehicle.
    Line,
}

/// Prints the schema.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    match arguments.of {
        FileKind::Scenario => super::print(&Scenario::schema()),
        FileKind::Criteria => super::print(&CriteriaFile::json_schema()),
        FileKind::Study => super::print(&StudyFile::json_schema()),
        FileKind::Tuning => super::print(&Tuning::json_schema()),
        FileKind::Vehicle => super::print(VEHICLE),
        FileKind::Guideway => super::print(GUIDEWAY),
        FileKind::Line => super::print(LINE),
    }
}
