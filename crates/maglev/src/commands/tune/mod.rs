//! `maglev tune`: parameters of controllers that make a system damped and robust under several conditions.

mod confirm;
mod files;
mod page;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use maglev::Error;
use scenario::{GivenTimes, Override};
use tune::{Condition, Constraints, Irregularity, NoiseOption, Objective, Request, Tuning, Varied};

use super::analysis::{self, Bar};
use super::system::Opened;
use confirm::{Confirmation, Window, confirm};

const EXAMPLES: &str = "\
Examples:
  maglev tune scenarios/one-magnet.json --vary 'ems_*.gain_gap=2:14' \\
      --vary 'ems_*.gain_acceleration=1:40' --noise gap=1e-5:500 --max-voltage 5
  maglev tune scenarios/standstill.json --file examples/tuning/train.json --out results/tuned
  maglev tune scenarios/standstill.json --file examples/tuning/train.json \\
      --confirm guideway.midspan_displacement_02=12:20

A condition sets parameters, as --condition 'soft:guideway.frequency_01=5'; the worst of all
conditions counts. The exit status is 0 if the values found keep all limits, and 1 if not.";

/// Arguments of `maglev tune`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). It is initialized and linearised, but runs only with --confirm.
    scenario: PathBuf,
    /// A tuning file (.json) with all that the other options say. They add to it.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    /// A parameter that may change, with its bounds; `:log` for steps by factors.
    #[arg(long, value_name = "INSTANCE.VARIABLE=FROM:TO")]
    vary: Vec<Varied>,
    /// A condition under which the result must hold. Default: the scenario as it is.
    #[arg(long, value_name = "NAME:INSTANCE.VARIABLE=VALUE,...")]
    condition: Vec<Condition>,
    /// What is optimised: damping, decay, modulus or voltage [default: damping].
    #[arg(long, value_name = "OBJECTIVE")]
    objective: Option<Objective>,
    /// Least damping ratio [default: none, but all modes must decay].
    #[arg(long, value_name = "RATIO")]
    min_damping: Option<f64>,
    /// Least modulus margin of one loop and of all alike; 0 for none [default: 0.5].
    #[arg(long, value_name = "MARGIN")]
    min_modulus: Option<f64>,
    /// Least delay margin (s) of one loop and of all alike; 0 for none [default: 0.001].
    #[arg(long, value_name = "SECONDS")]
    min_delay: Option<f64>,
    /// Largest r.m.s. voltage (V) from noise and irregularity.
    #[arg(long, value_name = "VOLTS")]
    max_voltage: Option<f64>,
    /// Noise of a sensor: the input that reads it, its r.m.s. and its bandwidth (Hz).
    #[arg(long, value_name = "INPUT=RMS:BANDWIDTH")]
    noise: Vec<NoiseOption>,
    /// Move the guideway's irregularity under the train with this speed (m/s).
    #[arg(long, value_name = "SPEED")]
    irregularity: Option<f64>,
    /// Only modes between these frequencies (Hz) count; those outside must decay.
    #[arg(long, value_name = "LOW:HIGH", value_parser = band)]
    band: Option<[f64; 2]>,
    /// A mode does not count if no parameter, changed by a fifth of its range, changes its damping ratio
    /// by this fraction [default: 0.1].
    #[arg(long, value_name = "FRACTION")]
    influence: Option<f64>,
    /// Seed of the random points [default: 1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Random points among which starts are chosen [default: 60].
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Searches from different points [default: 4].
    #[arg(long, value_name = "N")]
    starts: Option<usize>,
    /// Evaluations of a search at most [default: 400].
    #[arg(long, value_name = "N")]
    evaluations: Option<usize>,
    /// Points of the front of damping against modulus margin; 0 for none [default: 7].
    #[arg(long, value_name = "N")]
    front: Option<usize>,
    /// Run the scenario before and after, and compare this signal's oscillation between two times with
    /// the prediction. The disturbance must have ended before.
    #[arg(long, value_name = "INSTANCE.VARIABLE=FROM:TO")]
    confirm: Option<Window>,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Write tune.json, tuned.json (a scenario with the values found), front.svg and front.png to DIR.
    /// Started again with the same DIR, an interrupted tuning continues.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads. Default: as many as the machine has cores. The result does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
}

fn band(text: &str) -> Result<[f64; 2], String> {
    let wrong = || format!("\"{text}\" is not of the form LOW:HIGH, as 4:12");
    let (low, high) = text.split_once(':').ok_or_else(wrong)?;
    let number = |it: &str| it.trim().parse::<f64>().map_err(|_| wrong());
    Ok([number(low)?, number(high)?])
}

impl Arguments {
    /// The tuning file with the options added.
    fn tuning(&self) -> Result<Tuning, tune::TuneError> {
        let mut tuning = self.file.as_deref().map(Tuning::load).transpose()?.unwrap_or_default();
        for it in &self.vary {
            tuning.vary.insert(it.target.clone(), it.bounds);
        }
        for it in &self.condition {
            tuning.conditions.insert(it.name.clone(), it.set.clone());
        }
        for it in &self.noise {
            tuning.noise.insert(it.input.clone(), it.noise);
        }
        if let Some(speed) = self.irregularity {
            let amplitude = tuning.irregularity.and_then(|it| it.amplitude);
            tuning.irregularity = Some(Irregularity { speed, amplitude });
        }
        // 0 takes a limit away
        let limit = |given: Option<f64>, file: Option<f64>| match given {
            Some(0.0) => None,
            Some(value) => Some(value),
            None => file,
        };
        let before = tuning.constraints;
        tuning.constraints = Constraints {
            damping: limit(self.min_damping, before.damping),
            modulus: limit(self.min_modulus, before.modulus),
            delay: limit(self.min_delay, before.delay),
            voltage: limit(self.max_voltage, before.voltage),
        };
        tuning.objective = self.objective.unwrap_or(tuning.objective);
        tuning.band = self.band.or(tuning.band);
        tuning.influence = self.influence.unwrap_or(tuning.influence);
        tuning.seed = self.seed.unwrap_or(tuning.seed);
        tuning.samples = self.samples.unwrap_or(tuning.samples);
        tuning.starts = self.starts.unwrap_or(tuning.starts);
        tuning.evaluations = self.evaluations.unwrap_or(tuning.evaluations);
        tuning.front = self.front.unwrap_or(tuning.front);
        Ok(tuning)
    }
}

/// Tunes, prints the result and writes its files.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let opened = Opened::new(&arguments.scenario, arguments.out.as_deref())?;
    let mut scenario = opened.load(GivenTimes::default())?;
    scenario.overrides.clone_from(&arguments.set);
    let request = Request {
        scenario,
        tuning: arguments.tuning()?,
        threads: analysis::threads(arguments.threads),
    };
    let bar = Bar::new("{bar:30} {pos} of at most {len} evaluations, {msg}");
    let found = super::at_home(|| tune::tune(&request, arguments.out.as_deref(), &bar));
    bar.close();
    let result = found?;
    let confirmed: Vec<Confirmation> = match &arguments.confirm {
        Some(window) => super::at_home(|| confirm(&request.scenario, &result, window))?,
        None => Vec::new(),
    };
    if let Some(folder) = &arguments.out {
        files::write(&result, &confirmed, &request.scenario, &opened.path, folder)?;
    }
    let text = if arguments.json {
        files::as_json(&result, &confirmed)
    } else {
        page::page(&result, &confirmed, arguments)
    };
    super::print(&text)?;
    Ok(if result.kept { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
