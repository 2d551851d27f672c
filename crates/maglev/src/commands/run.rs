//! `maglev run`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use fmi2_import::package::Package;
use maglev::Error;
use maglev::run::Job;
use scenario::{
    AlgorithmName, Checkpoints, GivenTimes, LogLevel, Override, ResultFormat, Scenario,
};

use super::display::{EndOptions, watch};
use super::system::Opened;
use super::{check, names};

const EXAMPLES: &str = "\
Examples:
  maglev run scenarios/one-bogie.json --stop 5 --out /tmp/bogie
  maglev run scenarios/one-bogie.json --set 'ems_*.gain_gap=6' --set vehicle.travel_speed=2
  maglev run scenarios/low-speed.json --checkpoint-every 10 --format csv,parquet
  maglev run target/fmu/ems.fmu --stop 2 --set gap=0.009
  maglev run SYSTEM.ssp --stop 10 --step 0.001
  maglev run scenarios/low-speed.json --json --no-report | jq .real_time_factor

Files in the folder: results.csv or results.parquet (recorded signals), events.csv (warnings
and messages), summary.json (statistics, times, units), the scenario's pictures, and
report.html (an interactive overview).

Ctrl-C ends the run after the current step and keeps the results. With checkpoints,
`maglev resume` continues it. A second Ctrl-C ends a step that hangs.

With --json, stdout has the content of summary.json and nothing else, also for a run that
fails while it steps. Errors are text on stderr, and the exit status is the same as without.";

/// Arguments of `maglev run`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario (.json): units, connections and signals to record. Or a system (.ssp), or one
    /// unit (.fmu), which runs alone and has its outputs recorded.
    scenario: PathBuf,
    /// Folder for the results [default: results/ and the name of the scenario or unit].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Set a parameter or start value. A pattern sets several: m_*.gain=7, m_[01..04].gain=7. For
    /// a unit without a scenario, VARIABLE=VALUE is enough. Can be repeated.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Stop time (s), instead of the scenario's.
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    stop: Option<f64>,
    /// Communication step (s), instead of the scenario's.
    #[arg(long, value_name = "H")]
    step: Option<f64>,
    /// Relative tolerance for the units' own integration, instead of the scenario's.
    #[arg(long, value_name = "TOL")]
    tolerance: Option<f64>,
    /// Coupling algorithm, instead of the scenario's.
    #[arg(long, value_name = "NAME", value_parser = names::algorithms())]
    algorithm: Option<AlgorithmName>,
    /// Degree of the extrapolation of inputs, 0 to 3, instead of the scenario's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=3))]
    extrapolation: Option<u8>,
    /// Threads that step units in parallel. The results are the same for any number.
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    threads: Option<usize>,
    /// Interval between recorded rows (s), instead of the scenario's.
    #[arg(long, value_name = "T")]
    record_interval: Option<f64>,
    /// Write a checkpoint every T simulated seconds, for `maglev resume`.
    #[arg(long, value_name = "T")]
    checkpoint_every: Option<f64>,
    /// Run at most FACTOR simulated seconds per second.
    #[arg(long, value_name = "FACTOR")]
    real_time: Option<f64>,
    /// Record what criteria need, and judge the run by them: files, or names of those that ship,
    /// separated by commas. They become limits of the scenario.
    #[arg(long, value_name = "FILES", value_delimiter = ',')]
    criteria: Vec<String>,
    /// Formats of the results, separated by commas, instead of the scenario's.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = names::formats())]
    format: Vec<ResultFormat>,
    /// Run each unit in a process of its own, so that its crash only ends the run.
    #[arg(long)]
    isolate: bool,
    /// Longest wall time for one step of an isolated unit (s).
    #[arg(long, value_name = "SECONDS")]
    step_timeout: Option<f64>,
    /// Refuse units in which `maglev validate` finds an error, instead of warning.
    #[arg(long)]
    strict: bool,
    /// Messages of units to show. error: those with status fmi2Error or fmi2Fatal. warning (the
    /// default): the first of each instance with a status worse than fmi2OK. info: all. debug: all,
    /// with debug messages turned on. events.csv always has all of them.
    #[arg(long, value_name = "LEVEL", hide_possible_values = true, value_parser = names::log_levels())]
    log_level: Option<LogLevel>,
    /// Write every C call to every unit to this file: time, instance, arguments, status, duration.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    #[command(flatten)]
    end: EndOptions,
}

fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("not a whole number of 1 or more".to_owned()),
        Ok(threads) => Ok(threads),
    }
}

/// Runs the scenario, or the unit.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let given = GivenTimes { stop: arguments.stop, step: arguments.step };
    let name = arguments.scenario.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(name.as_str()));
    let mut scenario = if is_unit(&arguments.scenario) {
        let unit = Package::describe(&arguments.scenario)?;
        scenario::alone(&arguments.scenario, &unit, given, &arguments.set)?
    } else {
        // a system is kept beside the results, for scenario-as-run.json and `maglev resume`
        let opened = Opened::new(&arguments.scenario, Some(&folder))?;
        let mut scenario = opened.load(given)?;
        scenario.overrides.clone_from(&arguments.set);
        scenario
    };
    match check::criteria(&arguments.criteria) {
        Ok(criteria) => scenario.add_limits(criteria),
        Err(error) => {
            super::tell_chain(&results::causes(&error), error.help());
            return Ok(ExitCode::from(2));
        }
    }
    change(&mut scenario, arguments);
    let job = Job { scenario: &scenario, name: &name, folder: &folder };
    let terminal = arguments.end.terminal(&folder, scenario.log_level);
    watch(&terminal, |observer| job.run(observer))
}

/// Whether the file is a unit rather than a scenario.
fn is_unit(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("fmu"))
}

/// Replaces settings of the scenario by those of the command line.
fn change(scenario: &mut Scenario, arguments: &Arguments) {
    scenario.strict |= arguments.strict;
    if let Some(tolerance) = arguments.tolerance {
        scenario.experiment.tolerance = Some(tolerance);
        scenario.instances.values_mut().for_each(|instance| instance.tolerance = None);
    }
    if let Some(name) = arguments.algorithm {
        scenario.algorithm.name = name;
    }
    if arguments.extrapolation.is_some() {
        scenario.algorithm.extrapolation = arguments.extrapolation;
    }
    if let Some(threads) = arguments.threads {
        scenario.algorithm.threads = threads;
    }
    if let Some(interval) = arguments.record_interval {
        scenario.record.interval = Some(interval);
    }
    if let Some(every) = arguments.checkpoint_every {
        scenario.checkpoint = Some(Checkpoints { every });
    }
    scenario.log_level = arguments.log_level.unwrap_or(scenario.log_level);
    if arguments.trace.is_some() {
        scenario.trace.clone_from(&arguments.trace);
    }
    scenario.real_time = arguments.real_time.or(scenario.real_time);
    if !arguments.format.is_empty() {
        scenario.record.format.clone_from(&arguments.format);
    }
    if arguments.isolate {
        scenario.isolation.all = true;
        scenario.instances.values_mut().for_each(|instance| instance.isolate = None);
    }
    if let Some(limit) = arguments.step_timeout {
        scenario.isolation.step_timeout = Some(limit);
    }
}
