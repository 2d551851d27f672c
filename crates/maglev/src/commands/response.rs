//! `maglev response`: frequency responses, margins of loops, root loci.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use clap::Args;
use linear::{LinearSystem, Linearised, Open, eigen};
use maglev::Error;
use master::Setup;
use report::pictures::{PictureFormat, png};
use response::names::{Kind, select};
use response::{BreakPoint, Domain, Loops, Model, breaking, locus, sampled, transfer};
use results::response::{LoopsResult, ResponseFile, RootLocus};
use results::write_whole;
use scenario::{GivenTimes, Override, Scenario};

use super::response_page::page;
use super::system::Opened;

const EXAMPLES: &str = "\
Examples:
  maglev response scenarios/standstill.json --from guideway.chirp_force --to vehicle.gap_01
  maglev response scenarios/one-magnet.json --loop ems_01.voltage --out results/margins
  maglev response scenarios/one-bogie.json --loop 'ems_[01..08].voltage' \\
      --set vehicle.travel_speed=0 --set vehicle.initial_position=12.5
  maglev response scenarios/one-magnet.json --loop ems_01.voltage --hold 0.001 --delay 1
  maglev response scenarios/one-magnet.json --root-locus 'ems_*.gain_gap=2:14:25'

All results hold at one point, the start of the scenario. The exit status is 0 if the closed
system is stable there, and 1 if not: then there are no margins.";

/// Arguments of `maglev response`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). It is initialized and linearised, but does not run.
    scenario: PathBuf,
    /// Input of the responses: one that a unit reports in its linearisation, connected or not.
    #[arg(long, value_name = "INSTANCE.VARIABLE", requires = "to")]
    from: Vec<String>,
    /// Output of the responses. Ranges and stars are allowed: 'vehicle.gap_*'.
    #[arg(long, value_name = "INSTANCE.VARIABLE", requires = "from")]
    to: Vec<String>,
    /// Where loops are broken, for their margins: an output (for all that receive it), an input (for
    /// it alone), or the voltage of a magnet. Several are broken one by one and all at once.
    #[arg(long = "loop", value_name = "INSTANCE.VARIABLE")]
    loops: Vec<String>,
    /// Take the loops as those of a digital controller that holds its output for H seconds.
    #[arg(long, value_name = "H", requires = "loops")]
    hold: Option<f64>,
    /// With --hold: samples after which a value acts.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "hold")]
    delay: usize,
    /// Eigenvalues while a parameter changes, in COUNT values from FIRST to LAST; or while all gains of
    /// the broken loops do: loop=0.1:10:50.
    #[arg(long, value_name = "INSTANCE.VARIABLE=FIRST:LAST:COUNT")]
    root_locus: Option<Sweep>,
    /// Frequencies of the responses (Hz). Margins always look at all frequencies.
    #[arg(long, value_name = "LOW:HIGH", default_value = "0.1:100")]
    band: Band,
    /// Frequencies per decade. Resonances get more.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    per_decade: u16,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
    /// Also write DIR/response.json and the figures, where `maglev report DIR` finds them.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Format of the figures.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "svg", requires = "out", value_parser = format)]
    format: Vec<PictureFormat>,
}

fn format(text: &str) -> Result<PictureFormat, String> {
    match text {
        "svg" => Ok(PictureFormat::Svg),
        "png" => Ok(PictureFormat::Png),
        _ => Err(format!("\"{text}\" is not a format: give svg or png")),
    }
}

/// A range of frequencies (Hz).
#[derive(Debug, Clone, Copy)]
struct Band(f64, f64);

impl FromStr for Band {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("\"{text}\" is not a range of frequencies such as 0.1:100");
        let (low, high) = text.split_once(':').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
        let (low, high) = (number(low)?, number(high)?);
        if low > 0.0 && low < high && high.is_finite() { Ok(Self(low, high)) } else { Err(wrong()) }
    }
}

/// Values of a parameter.
#[derive(Debug, Clone)]
struct Sweep {
    target: String,
    values: Vec<f64>,
}

/// What a sweep calls the gains of the broken loops.
const LOOP_GAIN: &str = "loop";
/// Most values of a sweep.
const MOST: usize = 10_000;

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not of the form instance.variable=first:last:count, as ems_*.gain_gap=2:14:25"
            )
        };
        let (target, range) = text.split_once('=').ok_or_else(wrong)?;
        let parts: Vec<&str> = range.split(':').map(str::trim).collect();
        let [first, last, count] = parts.as_slice() else { return Err(wrong()) };
        let number =
            |text: &str| text.parse::<f64>().ok().filter(|it| it.is_finite()).ok_or_else(wrong);
        let (first, last) = (number(first)?, number(last)?);
        let count: usize = count.parse().map_err(|_| wrong())?;
        if !(2..=MOST).contains(&count) {
            return Err(format!("\"{text}\": the number of values must be from 2 to {MOST}"));
        }
        let place = |k: usize| first + (last - first) * k as f64 / (count - 1) as f64;
        Ok(Self { target: target.trim().to_owned(), values: (0..count).map(place).collect() })
    }
}

/// Computes what is asked for and prints it.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    if arguments.from.is_empty() && arguments.loops.is_empty() && arguments.root_locus.is_none() {
        return Err(Error::NothingAsked);
    }
    let opened = Opened::new(&arguments.scenario, arguments.out.as_deref())?;
    let scenario = opened.load(GivenTimes::default())?;
    let system = linearised(&scenario, &arguments.set)?;
    let mut file =
        ResponseFile { operating_point: system.point.clone(), ..ResponseFile::default() };
    let values = linear::eigenvalues(&system.matrix()?)?;
    file.stable = values.iter().all(|it| Domain::Continuous.side(*it) < 0);
    let growing = values.iter().copied().filter_map(eigen::upper).filter(|it| it.re >= 0.0);
    file.growing = growing.map(|it| (it.re, it.norm() / TAU)).collect();
    if !arguments.from.is_empty() {
        let open = Open {
            inputs: ports(&system, Kind::Input, &arguments.from, LinearSystem::input)?,
            outputs: ports(&system, Kind::Output, &arguments.to, LinearSystem::output)?,
            ..Open::default()
        };
        let Band(low, high) = arguments.band;
        let between = system.open(&open)?;
        file.responses =
            transfer::responses(&between, (low, high), usize::from(arguments.per_decade))?;
    }
    let broken = if arguments.loops.is_empty() { None } else { Some(broken(&system, arguments)?) };
    if let Some((open, names)) = &broken {
        file.loops = Some(analysed(open, names, arguments)?);
        let stable = file.loops.as_ref().is_none_or(|it| it.stable);
        file.stable &= stable;
    }
    if let Some(sweep) = &arguments.root_locus {
        file.root_locus = Some(root_locus(sweep, &scenario, arguments, broken.as_ref())?);
    }
    if let Some(folder) = &arguments.out {
        write(&file, folder, &arguments.format)?;
    }
    if arguments.json {
        super::print(&as_json(&file))?;
    } else {
        super::print(&page(&file))?;
    }
    Ok(if file.stable { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The scenario at its start, with some values set.
fn linearised(scenario: &Scenario, set: &[Override]) -> Result<LinearSystem, Error> {
    let mut scenario = scenario.clone();
    scenario.overrides.extend_from_slice(set);
    // one step is enough, so the step need not divide the scenario's time
    scenario.experiment.stop = scenario.experiment.start + scenario.experiment.step;
    scenario.record.interval = None;
    scenario.checkpoint = None;
    let setup = Setup::new(&scenario)?;
    Ok(super::at_home(|| Linearised::at_start(&setup))?.system)
}

fn ports<P>(
    system: &LinearSystem,
    kind: Kind,
    patterns: &[String],
    port: impl Fn(&LinearSystem, &str) -> Result<P, linear::LinearError>,
) -> Result<Vec<P>, Error> {
    let mut found = Vec::new();
    for pattern in patterns {
        for name in select(system, kind, pattern)? {
            found.push(port(system, &name)?);
        }
    }
    Ok(found)
}

/// The loop transfer functions, and where the loops are broken.
fn broken(system: &LinearSystem, arguments: &Arguments) -> Result<(Model, Vec<String>), Error> {
    let mut names: Vec<String> = Vec::new();
    for pattern in &arguments.loops {
        for name in select(system, Kind::Either, pattern)? {
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    let points = names.iter().map(|name| BreakPoint::new(system, name));
    let points = points.collect::<Result<Vec<_>, _>>()?;
    let open = breaking::loops(system, &points)?;
    let open = match arguments.hold {
        Some(period) => sampled::sampled(&open, period, arguments.delay, &names.join(", "))?,
        None => open,
    };
    Ok((open, names))
}

fn analysed(open: &Model, names: &[String], arguments: &Arguments) -> Result<LoopsResult, Error> {
    let mut found = Loops::new(open, names)?.analyse(true)?;
    found.sampled = arguments.hold.map(|period| (period, arguments.delay));
    Ok(found)
}

fn root_locus(
    sweep: &Sweep,
    scenario: &Scenario,
    arguments: &Arguments,
    broken: Option<&(Model, Vec<String>)>,
) -> Result<RootLocus, Error> {
    let mut lists = Vec::new();
    if sweep.target == LOOP_GAIN {
        let Some((open, _)) = broken else { return Err(Error::NoLoop) };
        for gain in &sweep.values {
            lists.push(locus::with_gain(open, *gain)?);
        }
        return Ok(locus::root_locus("loop gain", &sweep.values, &lists));
    }
    for value in &sweep.values {
        let mut set = arguments.set.clone();
        set.push(Override { target: sweep.target.clone(), value: value.to_string() });
        lists.push(linear::eigenvalues(&linearised(scenario, &set)?.matrix()?)?);
    }
    Ok(locus::root_locus(&sweep.target, &sweep.values, &lists))
}

fn as_json(file: &ResponseFile) -> String {
    // plain data, which always prints
    serde_json::to_string(file).unwrap_or_default() + "\n"
}

/// Writes response.json and the figures.
fn write(file: &ResponseFile, folder: &Path, formats: &[PictureFormat]) -> Result<(), Error> {
    let mut files = vec![(results::RESPONSE.to_owned(), as_json(file).into_bytes())];
    let plot = |name: &str| {
        let file = name.to_owned();
        move |source| Error::Plot { file, source }
    };
    for (name, svg) in report::response_figures(file).map_err(plot("the figures"))? {
        for format in formats {
            files.push(match format {
                PictureFormat::Svg => (format!("{name}.svg"), svg.clone().into_bytes()),
                PictureFormat::Png => {
                    let pixels = png(&svg, 2.0).map_err(|message| Error::Pixels {
                        file: format!("{name}.png"),
                        message,
                    })?;
                    (format!("{name}.png"), pixels)
                }
            });
        }
    }
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Write { path, source }
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    for (name, content) in &files {
        let path = folder.join(name);
        write_whole(&path, content).map_err(failed(&path))?;
    }
    let names: Vec<&str> = files.iter().map(|it| it.0.as_str()).collect();
    results::add_files(folder, names).map_err(failed(folder))
}
