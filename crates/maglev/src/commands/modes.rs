//! `maglev modes`: the modes of a whole system.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use linear::{LinearError, Linearised};
use maglev::Error;
use master::Setup;
use master::system::InstanceSetup;
use results::modes::{
    CoupledMode, CoupledModes, CoupledParts, Eigenvalue, InputFamily, ModeShapes, ModesFile,
    UncoupledStates,
};
use results::write_whole;
use scenario::{AlgorithmName, GivenTimes, Override, Scenario};

use super::names;
use super::orders;
use super::positions::{self, Positions};
use super::system::Opened;
use super::table::table;
use super::unit_modes::{families, root, shown};

const EXAMPLES: &str = "\
Examples:
  maglev modes scenarios/one-magnet.json
  maglev modes scenarios/one-magnet.json --algorithm jacobi --extrapolation 0 --step 0.005
  maglev modes scenarios/low-speed.json --of guideway --set vehicle.travel_speed=0 \\
      --set vehicle.initial_position=37.5
  maglev modes scenarios/standstill.json --positions 0:75:0.5 --out results/positions
  maglev modes scenarios/standstill.json --orders --step 0.005

The result holds at one point, the start of the scenario. It names the units that are not
coupled there. The exit status is 0 if all modes decay, both continuous and as stepped, and
1 if one grows.";

/// Arguments of `maglev modes`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). It is initialized and linearised, but does not run.
    scenario: PathBuf,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Communication step (s), instead of the scenario's.
    #[arg(long, value_name = "H")]
    step: Option<f64>,
    /// Coupling algorithm, instead of the scenario's.
    #[arg(long, value_name = "NAME", value_parser = names::algorithms())]
    algorithm: Option<AlgorithmName>,
    /// Degree of the extrapolation of inputs, 0 to 3, instead of the scenario's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=3))]
    extrapolation: Option<u8>,
    /// Where the train may stand: the start, for each of these values of a parameter, by default the
    /// parameter initial_position of the one unit that has it. Shows the least damping of the
    /// continuous modes at each, and the worst. With --out, also as positions.json and positions.svg.
    #[arg(long, value_name = "[INSTANCE.PARAMETER=]FIRST:LAST:STEP")]
    positions: Option<Positions>,
    /// Compare all orders in which Gauss-Seidel can step the kinds of units, with extrapolation of degree
    /// 1, 2 and 3 or that of --extrapolation: errors of the modes below 30 Hz or --below, the most exact
    /// first.
    #[arg(long, conflicts_with_all = ["positions", "algorithm", "of", "out"])]
    orders: bool,
    /// Show at most N modes, the least damped first. 0 shows all.
    #[arg(long, value_name = "N", default_value_t = 20)]
    count: usize,
    /// Show only modes up to this frequency.
    #[arg(long, value_name = "HZ")]
    below: Option<f64>,
    /// Show only modes in which instances of this name participate with 10 % or more. `*` stands
    /// for any text: ems_*.
    #[arg(long, value_name = "INSTANCE")]
    of: Option<String>,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
    /// Also write everything to DIR/modes.json, where `maglev report DIR` finds it.
    ///
    /// The shapes of the modes go to DIR/mode-shapes.json.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Computes the modes and prints them.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let given = GivenTimes { step: arguments.step, ..GivenTimes::default() };
    let opened = Opened::new(&arguments.scenario, arguments.out.as_deref())?;
    let mut scenario = opened.load(given)?;
    scenario.algorithm.name = arguments.algorithm.unwrap_or(scenario.algorithm.name);
    let degree = scenario.algorithm.extrapolation;
    scenario.algorithm.extrapolation = arguments.extrapolation.or(degree);
    scenario.overrides.clone_from(&arguments.set);
    if let Some(positions) = &arguments.positions {
        shorten(&mut scenario, 1)?;
        return positions::run(&mut scenario, positions, arguments.out.as_deref(), arguments.json);
    }
    if arguments.orders {
        let Arguments { extrapolation, below, json, .. } = *arguments;
        return orders::run(&mut scenario, extrapolation, below, json);
    }
    let (modes, shapes) = find(&mut scenario, arguments.of.as_deref(), arguments.out.is_some())?;
    let algorithm = scenario.algorithm.name.as_str();
    if let Some(folder) = &arguments.out {
        write(&modes, &shapes, &scenario, folder)?;
    }
    if arguments.json {
        super::print(&as_json(&modes, &scenario))?;
    } else {
        super::print(&page(&modes, algorithm, arguments))?;
    }
    let all_decay = modes.stable && modes.stepped_stable;
    Ok(if all_decay { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Cuts a scenario down to so many steps after its start.
pub(super) fn shorten(scenario: &mut Scenario, steps: u32) -> Result<(), Error> {
    if let Some((name, _)) = scenario.instances.iter().find(|(_, instance)| instance.every > 1) {
        return Err(LinearError::Slow { instance: name.clone() }.into());
    }
    // few steps are enough, so the step need not divide the scenario's time
    let time = f64::from(steps) * scenario.experiment.step;
    scenario.experiment.stop = scenario.experiment.start + time;
    scenario.record.interval = None;
    scenario.checkpoint = None;
    Ok(())
}

/// The modes of a scenario at its start, if it has instances of that name, and their shapes if wanted.
fn find(
    scenario: &mut Scenario,
    of: Option<&str>,
    shapes: bool,
) -> Result<(CoupledModes, ModeShapes), Error> {
    shorten(scenario, 1)?;
    let setup = Setup::new(scenario)?;
    if let Some(name) = of {
        let named = |it: &InstanceSetup| patterns::matches(name, &it.name);
        if !setup.system().instances.iter().any(named) {
            return Err(master::Error::from(setup.system().unknown_instance("--of", name)).into());
        }
    }
    Ok(super::at_home(|| {
        let start = if shapes { Linearised::with_motions } else { Linearised::at_start };
        linear::modes::with_shapes(&start(&setup)?)
    })?)
}

/// Computes the modes of the runs in results folders that have no modes.json yet. Folders without results are left to
/// those who read them.
pub(super) fn of_folders(folders: &[PathBuf]) -> Result<(), Error> {
    let without = |folder: &&PathBuf| {
        results::RunResults::exist_in(folder) && !folder.join(results::MODES).exists()
    };
    folders.iter().filter(without).try_for_each(|folder| of_results(folder))
}

/// Computes the modes of the scenario that ran and writes them to its results folder.
fn of_results(folder: &Path) -> Result<(), Error> {
    let mut scenario = Scenario::load(&folder.join(results::AS_RUN))?;
    let (modes, shapes) = find(&mut scenario, None, true)?;
    write(&modes, &shapes, &scenario, folder)
}

fn write(
    modes: &CoupledModes,
    shapes: &ModeShapes,
    scenario: &Scenario,
    folder: &Path,
) -> Result<(), Error> {
    // plain data, which always prints
    let shapes = serde_json::to_string(shapes).unwrap_or_default() + "\n";
    write_files(
        folder,
        &[(results::MODES, as_json(modes, scenario)), (results::MODE_SHAPES, shapes)],
    )
}

/// Writes files to a results folder and lists them there.
pub(super) fn write_files(folder: &Path, files: &[(&'static str, String)]) -> Result<(), Error> {
    let fail = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Write { path, source }
    };
    std::fs::create_dir_all(folder).map_err(fail(folder))?;
    for (name, text) in files {
        let path = folder.join(name);
        write_whole(&path, text.as_bytes())
            .and_then(|()| results::add_files(folder, [*name]))
            .map_err(fail(&path))?;
    }
    Ok(())
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
        "linearised at    t = {} s, the start of the scenario",
        modes.operating_point.time
    );
    let _ = writeln!(text, "continuous       {}", verdict(modes.stable, &modes.apart));
    let _ = writeln!(
        text,
        "as stepped       {} ({algorithm}, {} s; largest multiplier of the coupling itself: {:.3})",
        verdict(modes.stepped_stable, &modes.apart),
        modes.step,
        modes.coupling_multiplier
    );
    let limit = 0.5 / modes.step;
    let folds = |mode: &&CoupledMode| mode.continuous.imaginary > std::f64::consts::TAU * limit;
    let above = modes.modes.iter().filter(folds).count();
    if above > 0 {
        let _ = writeln!(
            text,
            "                 {above} {} above {limit} Hz, half a period per step. Values at steps look like \
             a lower frequency;\n                 \"as stepped\" is the nearest of the frequencies that \
             look alike.",
            if above == 1 { "mode is" } else { "modes are" }
        );
    }
    for parts in &modes.parts {
        let _ = writeln!(text, "coupled          {}", carriers(parts));
    }
    for apart in &modes.apart {
        let _ = writeln!(text, "\n{}", uncoupled(apart));
        let received = modes.operating_point.inputs.get(&apart.instance);
        let inputs: Vec<String> = received.into_iter().flatten().map(span).collect();
        if !inputs.is_empty() {
            let _ = writeln!(text, "  inputs of {} here: {}", apart.instance, inputs.join(", "));
        }
    }
    text + "\n" + &list(modes, arguments)
}

/// What the eigenvalues show, and the units for which they do not show it.
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

/// Which parts of a unit are coupled with others, such as the girders under the train.
pub(super) fn carriers(parts: &CoupledParts) -> String {
    let CoupledParts { instance, coupled, apart } = parts;
    match (coupled.as_slice(), apart.as_slice()) {
        ([], _) => format!("WARNING: no part of {instance} ({})", apart.join(", ")),
        (_, []) => format!("{} of {instance}", coupled.join(", ")),
        (_, _) => format!("{} of {instance}, not {}", coupled.join(", "), apart.join(", ")),
    }
}

/// Most names of uncoupled states shown of a unit that has coupled ones too.
const NAMED: usize = 6;

fn uncoupled(apart: &UncoupledStates) -> String {
    let UncoupledStates { instance, of, states } = apart;
    if apart.entirely() {
        return format!(
            "{instance} does not participate: none of its {of} states is coupled with another unit at \
             this point. Its\nmodes below are those of the unit alone, and the result does not \
             include {instance}. Start the scenario where it is coupled."
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
fn list(modes: &CoupledModes, arguments: &Arguments) -> String {
    let wanted = |mode: &&CoupledMode| {
        let low = arguments.below.is_none_or(|limit| mode.continuous.frequency_hz <= limit);
        low && arguments.of.as_ref().is_none_or(|name| {
            let named = mode.participation.iter().filter(|(key, _)| patterns::matches(name, key));
            named.map(|(_, share)| share).sum::<f64>() >= 0.1
        })
    };
    let count = if arguments.count == 0 { usize::MAX } else { arguments.count };
    let head =
        ["Hz", "damping", "as stepped", "damping", "error", "eigenvalue 1/s", "participation"];
    let rows = modes.modes.iter().filter(wanted).take(count).map(|mode| {
        let Eigenvalue { frequency_hz, damping_ratio, real, imaginary } = mode.continuous;
        let stepped = mode.stepped.as_ref();
        let number = |value: Option<f64>| digits(value, |it| format!("{it:.4}"));
        let parts = mode.participation.iter().map(|(name, share)| (name.as_str(), *share));
        vec![
            number(Some(frequency_hz)),
            number(Some(damping_ratio)),
            number(stepped.map(|it| it.frequency_hz)),
            number(stepped.map(|it| it.damping_ratio)),
            digits(mode.relative_error, |it| format!("{:.1e} %", 100.0 * it)),
            root(real, imaginary),
            shown(families(parts)),
        ]
    });
    let head = head.map(str::to_owned).to_vec();
    table(std::iter::once(head).chain(rows), &[0, 1, 2, 3, 4])
}

/// A number as text, or a dash where there is none.
fn digits(value: Option<f64>, text: impl Fn(f64) -> String) -> String {
    value.filter(|it| it.is_finite()).map_or_else(|| "-".to_owned(), text)
}
