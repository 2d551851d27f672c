//! `maglev floquet`: stability of a train that moves over an endless row of spans.

mod page;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::{Mutex, PoisonError};

use clap::Args;
use figure::{FigureLine, FigurePanel, HeatMap, draw_heat_map, draw_over};
use floquet::{Accuracy, FloquetError, Motion, MovingTrain, Place, Row};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use maglev::Error;
use results::Journal;
use scenario::{GivenTimes, Override, Scenario};
use serde::{Deserialize, Serialize};

use super::analysis::Files;
use super::system::Opened;
use page::page;

const EXAMPLES: &str = "\
Examples:
  maglev floquet scenarios/low-speed.json --speeds 5
  maglev floquet scenarios/low-speed.json --speeds 2:80:40 --above 3 --out results/moving
  maglev floquet scenarios/low-speed.json --speeds 2:80:40 --above 3 --out results/map \\
      --y guideway.stiffness_factor=0.4:1.4:40

The spans of the guideway are continued without end, on a smooth track. The exit status is 0 if
no motion grows, and 1 if one does.";

/// Values along an axis: A:B:N for N equally spaced values from A to B, or a list A,B,C.
#[derive(Debug, Clone, PartialEq)]
struct Grid(Vec<f64>);

impl FromStr for Grid {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let value: f64 =
                text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
            if value.is_finite() { Ok(value) } else { Err(format!("`{text}` is not finite")) }
        };
        let parts: Vec<&str> = text.split(':').collect();
        let values = match parts.as_slice() {
            [list] => list.split(',').map(number).collect::<Result<Vec<f64>, String>>()?,
            [first, last, count] => {
                let (first, last) = (number(first)?, number(last)?);
                let count: usize = count
                    .trim()
                    .parse()
                    .ok()
                    .filter(|count| (2..=100_000).contains(count))
                    .ok_or_else(|| {
                        format!("`{count}` is not a number of values from 2 to 100000")
                    })?;
                let step = (last - first) / (count - 1) as f64;
                (0..count).map(|k| first + step * k as f64).collect()
            }
            _ => return Err("write A:B:N, or values with commas between them".to_owned()),
        };
        if values.windows(2).all(|pair| pair[0] < pair[1]) {
            Ok(Self(values))
        } else {
            Err("the values must increase".to_owned())
        }
    }
}

fn speeds(text: &str) -> Result<Grid, String> {
    let grid: Grid = text.parse()?;
    match grid.0.iter().find(|&&speed| speed <= 0.0) {
        Some(speed) => Err(format!(
            "{speed} m/s: a speed must be positive; `maglev modes` computes the standing train"
        )),
        None => Ok(grid),
    }
}

/// Growth rates (1/s) below this of modes that do not act on the girders are rounding errors of free rigid motions.
const LEAST_GROWTH: f64 = 1e-2;

/// A parameter and its values.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    target: String,
    values: Vec<f64>,
}

impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (target, grid) = text
            .split_once('=')
            .filter(|(target, _)| target.contains('.'))
            .ok_or("write INSTANCE.VARIABLE=A:B:N")?;
        Ok(Self { target: target.to_owned(), values: grid.parse::<Grid>()?.0 })
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(format!("{text} is not a finite number of at least 0"))
    }
}

fn positive(text: &str) -> Result<f64, String> {
    not_negative(text).and_then(|value| match value > 0.0 {
        true => Ok(value),
        false => Err("it must be positive".to_owned()),
    })
}

/// Arguments of `maglev floquet`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). It is initialized and linearised, but does not run; its speed does not matter.
    scenario: PathBuf,
    /// Speeds (m/s): A:B:N for N values from A to B, or a list with commas.
    #[arg(long, value_name = "A:B:N", value_parser = speeds)]
    speeds: Grid,
    /// A parameter to vary as well, such as guideway.stiffness_factor=0.4:1.4:40.
    #[arg(long, value_name = "INSTANCE.VARIABLE=A:B:N")]
    y: Option<Axis>,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Judge only motions of at least this frequency. Slow motions of the car bodies hardly depend
    /// on the girders.
    #[arg(long, value_name = "HZ", default_value = "0", value_parser = not_negative)]
    above: f64,
    /// Largest error of a growth rate (1/s), by halving the step of the integration.
    #[arg(long, value_name = "RATE", default_value = "0.001", value_parser = positive)]
    tolerance: f64,
    /// Leave out states of a large train whose share in its response is below this. 0 keeps all.
    #[arg(long, value_name = "SHARE", default_value = "0.000001", value_parser = not_negative)]
    reduction: f64,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
    /// Also write DIR/floquet.json and the picture DIR/floquet.svg. Started again with the same DIR, an
    /// interrupted map continues.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Everything, as JSON.
#[derive(Serialize)]
struct Report {
    magnets: usize,
    states: usize,
    /// States of the reduced train, and the largest relative error of its response.
    reduced_states: Option<usize>,
    reduction_error: Option<f64>,
    period_m: f64,
    spans_per_period: usize,
    above_hz: f64,
    /// Of modes that neither feel nor press on the girders (1/s); absent if there are none.
    growth_of_left_out: Option<f64>,
    /// The least stable mode of the train on a rigid track, of at least above_hz: growth (1/s) and frequency (Hz).
    on_rigid_track: Option<[f64; 2]>,
    speeds: Vec<f64>,
    y: Option<YAxis>,
    /// By value of y, then by speed.
    points: Vec<Vec<Point>>,
    check: Option<Check>,
}

#[derive(Serialize)]
struct YAxis {
    parameter: String,
    values: Vec<f64>,
}

#[derive(Serialize)]
struct Point {
    speed: f64,
    /// Growth of the critical motion (1/s); absent if all that can be resolved are slower than --above.
    growth: Option<f64>,
    frequency_hz: Option<f64>,
    damping_ratio: Option<f64>,
    /// Growth rates below this are not resolved.
    floor: Option<f64>,
    steps: Option<usize>,
    error: Option<f64>,
    multipliers: Vec<[f64; 4]>,
    failed: Option<String>,
}

/// The fastest growing point, with all states of the train.
#[derive(Serialize)]
struct Check {
    speed: f64,
    y: Option<f64>,
    growth: f64,
    growth_reduced: f64,
}

/// Computes the multipliers and prints them.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let opened = Opened::new(&arguments.scenario, arguments.out.as_deref())?;
    let mut scenario = opened.load(GivenTimes::default())?;
    scenario.overrides.clone_from(&arguments.set);
    let (report, trains, journal) = super::at_home(|| compute(&scenario, arguments))?;
    if let Some(folder) = &arguments.out {
        write(&report, arguments, folder)?;
    }
    if let Some(journal) = journal {
        journal.remove();
    }
    if arguments.json {
        super::print(&as_json(&report))?;
    } else {
        super::print(&page(&report, &trains, arguments))?;
    }
    let grows = report.points.iter().flatten().any(|it| it.growth.is_some_and(|rate| rate > 0.0));
    let others = report.growth_of_left_out.is_some_and(|rate| rate > LEAST_GROWTH);
    Ok(if grows || others { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn compute(
    scenario: &Scenario,
    arguments: &Arguments,
) -> Result<(Report, Vec<MovingTrain>, Option<Journal>), Error> {
    let accuracy = Accuracy {
        tolerance: arguments.tolerance,
        reduction: arguments.reduction,
        above: arguments.above,
    };
    let with = |axis: &Axis, value: f64| {
        let mut scenario = scenario.clone();
        let (target, value) = (axis.target.clone(), value.to_string());
        scenario.overrides.push(Override { target, value });
        scenario
    };
    let mut trains = Vec::new();
    match &arguments.y {
        None => trains.push(MovingTrain::read(scenario, accuracy)?),
        Some(axis) => {
            let bar = bar(axis.values.len(), "linearised");
            for &value in &axis.values {
                let scenario = with(axis, value);
                // girders alone do not change the train
                let same = trains.first().filter(|first: &&MovingTrain| {
                    axis.target
                        .strip_prefix(&first.train.guideway)
                        .is_some_and(|it| it.starts_with('.'))
                });
                let train = match same {
                    Some(first) => first.on(Row::read(&scenario, &first.train.guideway)?),
                    None => MovingTrain::read(&scenario, accuracy)?,
                };
                trains.push(train);
                bar.inc(1);
            }
            bar.finish_and_clear();
        }
    }
    let speeds = &arguments.speeds.0;
    let (found, journal) = survey(&trains, scenario, arguments)?;
    let check = check(&trains, &found, arguments)?;
    let first = &trains[0];
    let left_out =
        trains.iter().map(|it| it.train.modal.left_out).fold(f64::NEG_INFINITY, f64::max);
    let rigid = trains.iter().filter_map(|it| it.train.modal.slowest(arguments.above));
    let rigid = rigid.max_by(|a, b| a.re.total_cmp(&b.re));
    let report = Report {
        magnets: first.train.magnets,
        states: first.train.states,
        reduced_states: first.reduction.as_ref().map(|it| it.states.1),
        reduction_error: trains
            .iter()
            .filter_map(|it| it.reduction.as_ref().map(|it| it.error))
            .reduce(f64::max),
        period_m: first.row.period,
        spans_per_period: first.row.spans,
        above_hz: arguments.above,
        growth_of_left_out: left_out.is_finite().then_some(left_out),
        on_rigid_track: rigid.map(|it| [it.re, it.norm() / std::f64::consts::TAU]),
        speeds: speeds.clone(),
        y: arguments
            .y
            .as_ref()
            .map(|it| YAxis { parameter: it.target.clone(), values: it.values.clone() }),
        points: found
            .iter()
            .map(|row| {
                row.iter().zip(speeds).map(|(it, &v)| point(it, v, arguments.above)).collect()
            })
            .collect(),
        check,
    };
    Ok((report, trains, journal))
}

/// A point of the map in its journal.
#[derive(Serialize, Deserialize)]
struct Known {
    place: Place,
    motion: Motion,
}

/// The file with the points of a map in progress.
const JOURNAL: &str = "floquet-points.jsonl";

/// By train, then by speed.
type Motions = Vec<Vec<Result<Motion, FloquetError>>>;

/// All points, and where they are kept until the files are written. With a folder, those of an interrupted map are taken
/// from there.
fn survey(
    trains: &[MovingTrain],
    scenario: &Scenario,
    arguments: &Arguments,
) -> Result<(Motions, Option<Journal>), Error> {
    let speeds = &arguments.speeds.0;
    let mut known = HashMap::new();
    let mut journal = None;
    if let Some(folder) = &arguments.out {
        let (opened, points) =
            Journal::open::<Known>(folder, JOURNAL, "map", &task(scenario, arguments))?;
        known.extend(points.into_iter().map(|it| (it.place, it.motion)));
        journal = Some(opened);
    }
    let bar = bar(trains.len() * speeds.len(), "points");
    bar.inc(known.len() as u64);
    let failure = Mutex::new(None);
    let done = |place: Place, motion: &Result<Motion, FloquetError>| {
        if let (Some(journal), Ok(motion)) = (&journal, motion) {
            let written = journal.add(&Known { place, motion: motion.clone() });
            if let (Err(error), Ok(mut failure)) = (written, failure.lock()) {
                *failure = Some(error);
            }
        }
        bar.inc(1);
    };
    let found = floquet::map(trains, speeds, &known, &done);
    bar.finish_and_clear();
    if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error.into());
    }
    Ok((found, journal))
}

/// What is computed, in one line.
fn task(scenario: &Scenario, arguments: &Arguments) -> String {
    let set: Vec<String> = scenario.overrides.iter().map(ToString::to_string).collect();
    let axis = arguments.y.as_ref().map(|it| (&it.target, &it.values));
    let Arguments { speeds, above, tolerance, reduction, .. } = arguments;
    let numbers = [above, tolerance, reduction];
    serde_json::json!({ "scenario": scenario, "set": set, "speeds": speeds.0, "y": axis, "accuracy": numbers })
        .to_string()
}

fn bar(count: usize, what: &'static str) -> ProgressBar {
    let bar =
        ProgressBar::with_draw_target(Some(count as u64), ProgressDrawTarget::stderr_with_hz(5));
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}, {eta} left") {
        bar.set_style(style);
    }
    bar.set_message(what);
    bar
}

/// Computes the fastest growing point of a reduced train again with all states.
fn check(
    trains: &[MovingTrain],
    found: &[Vec<Result<Motion, FloquetError>>],
    arguments: &Arguments,
) -> Result<Option<Check>, Error> {
    let above = arguments.above;
    let worst = found
        .iter()
        .enumerate()
        .flat_map(|(k, row)| row.iter().flatten().map(move |motion| (k, motion)))
        .filter_map(|(k, motion)| Some((k, motion, motion.multipliers.critical(above)?)))
        .max_by(|a, b| a.2.growth.total_cmp(&b.2.growth));
    let Some((k, motion, critical)) = worst else { return Ok(None) };
    if trains[k].reduction.is_none() {
        return Ok(None);
    }
    Ok(Some(Check {
        speed: motion.speed,
        y: arguments.y.as_ref().map(|axis| axis.values[k]),
        growth: trains[k].unreduced(motion, critical.value)?,
        growth_reduced: critical.growth,
    }))
}

fn point(motion: &Result<Motion, FloquetError>, speed: f64, above: f64) -> Point {
    match motion {
        Ok(motion) => {
            let critical = motion.multipliers.critical(above);
            let list = motion.multipliers.all.iter();
            Point {
                speed,
                growth: critical.map(|it| it.growth),
                frequency_hz: critical.map(|it| it.frequency),
                damping_ratio: critical.map(|it| it.damping_ratio()),
                floor: Some(motion.multipliers.floor),
                steps: Some(motion.steps),
                error: Some(motion.error),
                multipliers: list
                    .map(|it| [it.value.re, it.value.im, it.growth, it.frequency])
                    .collect(),
                failed: None,
            }
        }
        Err(error) => Point {
            speed,
            growth: None,
            frequency_hz: None,
            damping_ratio: None,
            floor: None,
            steps: None,
            error: None,
            multipliers: Vec::new(),
            failed: Some(results::causes(error).join(", because ")),
        },
    }
}

fn as_json(report: &Report) -> String {
    // plain data, which always prints
    serde_json::to_string_pretty(report).unwrap_or_default() + "\n"
}

fn write(report: &Report, arguments: &Arguments, folder: &Path) -> Result<(), Error> {
    let picture = picture(report, arguments)
        .map_err(|source| Error::Plot { file: "floquet.svg".to_owned(), source })?;
    let files = Files::new(folder)?;
    files.write("floquet.json", as_json(report).as_bytes())?;
    files.write("floquet.svg", picture.as_bytes())
}

fn picture(report: &Report, arguments: &Arguments) -> Result<String, figure::PlotError> {
    let title = arguments.scenario.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    // what decays faster than can be resolved is drawn at that limit
    let value = |it: &Point| it.growth.or(it.floor);
    let decay = |it: &Point| value(it).map_or(f64::NAN, |growth| -growth);
    let decays = || report.points.iter().flatten().map(decay).filter(|it| it.is_finite());
    let speed = "speed (m/s)";
    if let Some(axis) = &report.y
        && report.speeds.len() > 1
        && axis.values.len() > 1
    {
        return draw_heat_map(&HeatMap {
            title: format!("{title}: decay of the least damped motion"),
            xlabel: speed.to_owned(),
            ylabel: axis.parameter.clone(),
            legend: "decay rate (1/s)".to_owned(),
            x: report.speeds.clone(),
            y: axis.values.clone(),
            largest: decays().map(f64::abs).fold(0.0, f64::max),
            values: report.points.iter().map(|row| row.iter().map(decay).collect()).collect(),
            marks: Vec::new(),
            own: None,
            crossings: HashMap::new(),
        });
    }
    let over_speed = report.speeds.len() > 1;
    let curve = |of: &dyn Fn(&Point) -> Option<f64>| FigureLine {
        label: String::new(),
        points: report
            .points
            .iter()
            .enumerate()
            .flat_map(|(k, row)| row.iter().map(move |it| (k, it)))
            .filter_map(|(k, it)| {
                let y = report.y.as_ref().map_or(0.0, |axis| axis.values[k]);
                Some((if over_speed { it.speed } else { y }, of(it)?))
            })
            .collect(),
    };
    let panel = |label: &str, line| FigurePanel { ylabel: label.to_owned(), lines: vec![line] };
    let xlabel =
        report.y.as_ref().filter(|_| !over_speed).map_or(speed, |it| it.parameter.as_str());
    draw_over(
        &format!("{title}: least damped motion of the moving train"),
        xlabel,
        &[
            panel("growth (1/s)", curve(&value)),
            panel("frequency (Hz)", curve(&|it| it.frequency_hz)),
        ],
    )
}

// writing to a String cannot fail, so the results of writeln! are dropped

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn refusal_grids_that_are_not_increasing_numbers() {
        assert_eq!("1:2:3".parse::<Grid>().unwrap().0, [1.0, 1.5, 2.0]);
        assert_eq!("1,4".parse::<Grid>().unwrap().0, [1.0, 4.0]);
        for wrong in ["", "a", "1:2", "1:2:1", "2:1:5", "3,1", "1:inf:3", "1:2:3:4"] {
            assert!(wrong.parse::<Grid>().is_err(), "{wrong}");
        }
        assert!(speeds("0:5:3").unwrap_err().contains("maglev modes"));
        assert!("gain=1:2:3".parse::<Axis>().is_err() && "a.b=1:2:3".parse::<Axis>().is_ok());
    }
}
