//! `maglev linearize`: a coupled system and its units as state-space models.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use linear::{IDENTIFYING_STEPS, Linearised, Model, Models};
use maglev::Error;
use master::Setup;
use results::write_whole;
use scenario::{GivenTimes, Override};

use super::system::Opened;
use super::table::table;

const EXAMPLES: &str = "\
Examples:
  maglev linearize scenarios/one-bogie.json --out bogie.mat
  maglev linearize scenarios/standstill.json --out train.npz --outputs 'vehicle.gap_*'
  maglev linearize scenarios/one-magnet.json --set magnet.sample_time=0.001 --out units.json

Every file has A, B, C and D of the coupled system and of each unit, continuous and for one step
(\"_stepped\"), with the names of states, inputs and outputs. A unit that reports no linearisation
is identified from steps, if it can save its state; then there is no model of the coupled system.";

/// Arguments of `maglev linearize`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). It is initialized and linearised, but does not run.
    scenario: PathBuf,
    /// Write all models to FILE: .json, .mat (version 5) or .npz. May be repeated.
    #[arg(long, value_name = "FILE", required = true)]
    out: Vec<PathBuf>,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Communication step (s), instead of the scenario's.
    #[arg(long, value_name = "H")]
    step: Option<f64>,
    /// Identify instances of this name from steps even if they report their linearisation, for a
    /// comparison.
    #[arg(long, value_name = "INSTANCE")]
    identify: Vec<String>,
    /// Free inputs of the coupled system; `*` stands for any text. By default all that are not
    /// connected. To an input that is connected the free one is added.
    #[arg(long, value_name = "INSTANCE.VARIABLE")]
    inputs: Vec<String>,
    /// Outputs of the coupled system. By default all that the units report.
    #[arg(long, value_name = "INSTANCE.VARIABLE")]
    outputs: Vec<String>,
}

/// Format of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Json,
    Mat,
    Npz,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Error> {
        match path.extension().and_then(|it| it.to_str()) {
            Some("json") => Ok(Self::Json),
            Some("mat") => Ok(Self::Mat),
            Some("npz") => Ok(Self::Npz),
            _ => Err(Error::UnknownFormat { path: path.to_owned() }),
        }
    }
}

/// Linearises, and writes the files.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let formats = arguments.out.iter().map(|it| Format::of(it)).collect::<Result<Vec<_>, _>>()?;
    let given = GivenTimes { step: arguments.step, ..GivenTimes::default() };
    let opened = Opened::new(&arguments.scenario, None)?;
    let mut scenario = opened.load(given)?;
    scenario.overrides.clone_from(&arguments.set);
    super::modes::shorten(&mut scenario, IDENTIFYING_STEPS)?;
    let setup = Setup::new(&scenario)?;
    let models = super::at_home(|| {
        let named = |patterns: &[String], name: &str| {
            patterns.iter().any(|pattern| patterns::matches(pattern, name))
        };
        let forced = |name: &str| named(&arguments.identify, name);
        let linearised = Linearised::with_identified(&setup, &forced)?;
        for pattern in arguments.inputs.iter().chain(&arguments.outputs) {
            linearised.system.check_pattern(pattern)?;
        }
        let inputs = |name: &str, connected: bool| match arguments.inputs.as_slice() {
            [] => !connected,
            chosen => named(chosen, name),
        };
        let outputs = |name: &str| match arguments.outputs.as_slice() {
            [] => true,
            chosen => named(chosen, name),
        };
        Models::of(&linearised, inputs, outputs)
    })?;
    for (path, format) in arguments.out.iter().zip(formats) {
        write(&models, path, format)
            .map_err(|source| Error::Write { path: path.clone(), source })?;
    }
    super::print(&page(&models))
}

fn write(models: &Models, path: &Path, format: Format) -> std::io::Result<()> {
    let bytes = match format {
        Format::Json => (models.to_json().to_string() + "\n").into_bytes(),
        Format::Mat => models.to_mat(),
        Format::Npz => models.to_npz()?,
    };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    write_whole(path, &bytes)
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(models: &Models) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "linearised at t = {} s, the start of the scenario", models.point.time);
    for note in &models.notes {
        let _ = writeln!(text, "{note}");
    }
    let head = ["model", "states", "inputs", "outputs", "step (s)", "error", "from"];
    let rows = models.models.iter().map(|it: &Model| {
        let system = &it.system;
        let or_dash = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
        vec![
            it.name.clone(),
            system.states.len().to_string(),
            system.inputs.len().to_string(),
            system.outputs.len().to_string(),
            or_dash(it.step.map(|step| step.to_string())),
            or_dash(it.error.map(|error| format!("{error:.1e}"))),
            it.source.as_str().to_owned(),
        ]
    });
    let head = head.map(str::to_owned).to_vec();
    text + "\n" + &table(std::iter::once(head).chain(rows), &[1, 2, 3, 4, 5])
}
