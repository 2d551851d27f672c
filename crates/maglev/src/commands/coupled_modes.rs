//! `maglev modes`: the modes of a whole system.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use maglev::Error;
use master::Setup;
use master::modes::ModesError;
use results::modes::{
    CoupledMode, CoupledModes, Eigenvalue, InputFamily, ModesFile, UncoupledStates,
};
use results::write_whole;
use scenario::{AlgorithmName, Given, Override, Scenario};

use super::modes::{families, shown};

const EXAMPLES: &str = "\
Examples:
  maglev modes scenarios/one-magnet.json
  maglev modes scenarios/low-speed.json --set vehicle.travel_speed=0 --set vehicle.initial_position=37.5
  maglev modes scenarios/one-magnet.json --algorithm jacobi --extrapolation 0 --step 0.005

The verdict holds at the start of the scenario only, and says which units take no part in it there.

Exit status: 0 all modes die away, as the equations have them and as stepped; 1 some grow; 2 bad input.";

/// Arguments of `maglev modes`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario; it is started and linearised there, not run.
    scenario: PathBuf,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Communication step (s) instead of the scenario's.
    #[arg(long, value_name = "H")]
    step: Option<f64>,
    /// Coupling algorithm instead of the scenario's.
    #[arg(long, value_name = "NAME")]
    algorithm: Option<AlgorithmName>,
    /// Degree of the extrapolation of inputs, 0 to 3, instead of the scenario's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=3))]
    extrapolation: Option<u8>,
    /// Show so many modes, the least damped first; 0 shows all.
    #[arg(long, value_name = "N", default_value_t = 20)]
    count: usize,
    /// Leave out modes above this frequency.
    #[arg(long, value_name = "HZ")]
    below: Option<f64>,
    /// Leave out modes in which instances of this name take no part of at least 10 %.
    #[arg(long, value_name = "INSTANCE")]
    of: Option<String>,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
    /// Write everything into DIR/modes.json, where `maglev report DIR` finds it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Finds the modes and prints them.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let given = Given { step: arguments.step, ..Given::default() };
    let mut scenario = Scenario::load_with(&arguments.scenario, given)?;
    scenario.algorithm.name = arguments.algorithm.unwrap_or(scenario.algorithm.name);
    let degree = scenario.algorithm.extrapolation;
    scenario.algorithm.extrapolation = arguments.extrapolation.or(degree);
    scenario.overrides.clone_from(&arguments.set);
    let modes = find(&mut scenario)?;
    let algorithm = scenario.algorithm.name.as_str();
    if let Some(folder) = &arguments.out {
        write(&modes, &scenario, folder)?;
    }
    if arguments.json {
        super::print(&as_json(&modes, &scenario))?;
    } else {
        super::print(&page(&modes, algorithm, arguments))?;
    }
    let dies_away = modes.stable && modes.stepped_stable;
    Ok(if dies_away { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The modes of a scenario at its start.
fn find(scenario: &mut Scenario) -> Result<CoupledModes, Error> {
    if let Some((name, _)) = scenario.instances.iter().find(|(_, instance)| instance.every > 1) {
        let error = ModesError::Slow { instance: name.clone() };
        return Err(master::Error::from(error).into());
    }
    // what is found holds for any span of time: the step need not divide the scenario's
    scenario.experiment.stop = scenario.experiment.start + scenario.experiment.step;
    scenario.record.interval = None;
    scenario.checkpoint = None;
    let setup = Setup::new(scenario)?;
    Ok(super::at_home(|| master::modes::find(&setup))?)
}

/// Finds the modes of the scenario that ran and puts them beside its results.
pub(super) fn of_results(folder: &Path) -> Result<(), Error> {
    let mut scenario = Scenario::load(&folder.join(results::AS_RUN))?;
    let modes = find(&mut scenario)?;
    write(&modes, &scenario, folder)
}

fn write(modes: &CoupledModes, scenario: &Scenario, folder: &Path) -> Result<(), Error> {
    let path = folder.join(results::MODES);
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| write_whole(&path, as_json(modes, scenario).as_bytes()))
        .and_then(|()| results::add_files(folder, [results::MODES]));
    written.map_err(|source| Error::Output { path, running: true, source })
}

fn as_json(modes: &CoupledModes, scenario: &Scenario) -> String {
    let algorithm = &scenario.algorithm;
    let file = ModesFile {
        algorithm: algorithm.name.as_str().to_owned(),
        extrapolation: algorithm.degree(),
        modes: modes.clone(),
    };
    // plain data, which always prints
    serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(modes: &CoupledModes, algorithm: &str, arguments: &Arguments) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{} states, {} modes", modes.states, modes.modes.len());
    let _ = writeln!(
        text,
        "linearised at                 t = {} s, the start of the scenario",
        modes.operating_point.time
    );
    let _ = writeln!(text, "as the equations have them    {}", verdict(modes.stable, &modes.apart));
    let _ = writeln!(
        text,
        "as stepped                    {} ({algorithm}, {} s; the coupling's own largest multiplier: {:.3})",
        verdict(modes.stepped_stable, &modes.apart),
        modes.step,
        modes.coupling_multiplier
    );
    for apart in &modes.apart {
        let _ = writeln!(text, "\n{}", uncoupled(apart));
        let received = modes.operating_point.inputs.get(&apart.instance);
        let inputs: Vec<String> = received.into_iter().flatten().map(span).collect();
        if !inputs.is_empty() {
            let _ = writeln!(text, "  inputs of {} here: {}", apart.instance, inputs.join(", "));
        }
    }
    list(&mut text, modes, arguments);
    text
}

/// What the eigenvalues say, and of what they say nothing.
fn verdict(stable: bool, apart: &[UncoupledStates]) -> String {
    let missing: Vec<&str> =
        apart.iter().filter(|it| it.entirely()).map(|it| it.instance.as_str()).collect();
    match (stable, missing.as_slice()) {
        (false, _) => "UNSTABLE at this operating point".to_owned(),
        (true, []) => "stable at this operating point".to_owned(),
        (true, _) => {
            format!("stable at this operating point, WITHOUT {}", missing.join(", "))
        }
    }
}

/// Names of states shown of a unit that takes part with others of its states.
const NAMED: usize = 6;

fn uncoupled(apart: &UncoupledStates) -> String {
    let UncoupledStates { instance, of, states } = apart;
    if apart.entirely() {
        return format!(
            "{instance} takes no part: none of its {of} states is coupled with another unit at this \
             point. Its modes below are\nthose of the unit alone, and stability with {instance} is not \
             shown: start the scenario where it is coupled."
        );
    }
    let more = if states.len() > NAMED { ", …" } else { "" };
    let named = &states[..states.len().min(NAMED)];
    format!(
        "{} of {of} states of {instance} are coupled with no other unit at this point: {}{more}",
        states.len(),
        named.join(", ")
    )
}

/// A family of inputs with the range of its values.
fn span(family: &InputFamily) -> String {
    let InputFamily { name, min, max, unit, .. } = family;
    let unit = unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
    if min == max {
        format!("{name} {min:.4}{unit}")
    } else {
        format!("{name} {min:.4} … {max:.4}{unit}")
    }
}

/// The table of modes.
fn list(text: &mut String, modes: &CoupledModes, arguments: &Arguments) {
    let _ = writeln!(
        text,
        "\n{:>9} {:>9}  {:>9} {:>9} {:>9}  {:<24} takes part",
        "Hz", "damping", "as stepped", "damping", "error", "eigenvalue 1/s"
    );
    let wanted = |mode: &&CoupledMode| {
        let low = arguments.below.is_none_or(|limit| mode.continuous.frequency_hz <= limit);
        low && arguments.of.as_ref().is_none_or(|name| {
            let pattern = |key: &str| patterns::matches(name, key);
            let share: f64 =
                mode.participation.iter().filter(|(key, _)| pattern(key)).map(|(_, x)| x).sum();
            share >= 0.1
        })
    };
    let count = if arguments.count == 0 { usize::MAX } else { arguments.count };
    for mode in modes.modes.iter().filter(wanted).take(count) {
        let now = &mode.continuous;
        let stepped = mode.stepped.as_ref().map_or_else(
            || format!("{:>10} {:>9} {:>9}", "-", "-", "-"),
            |it| {
                let error = mode.relative_error.unwrap_or(f64::NAN);
                format!("{:>10.4} {:>9.4} {:>9}", it.frequency_hz, it.damping_ratio, percent(error))
            },
        );
        let parts = mode.participation.iter().map(|(name, share)| (name.as_str(), *share));
        let _ = writeln!(
            text,
            "{:>9.4} {:>9.4}  {stepped}  {:<24} {}",
            now.frequency_hz,
            now.damping_ratio,
            value(now),
            shown(families(parts))
        );
    }
}

fn percent(part: f64) -> String {
    format!("{:.1e} %", 100.0 * part)
}

fn value(it: &Eigenvalue) -> String {
    if it.imaginary == 0.0 {
        format!("{:.4}", it.real)
    } else {
        format!("{:.4} ± {:.4}i", it.real, it.imaginary)
    }
}
