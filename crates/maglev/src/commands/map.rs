//! `maglev map`: the least damped mode over two parameters.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use maglev::Error;
use maps::{Axis, Known, MapAxis, MapCell, Request, StabilityMap};
use scenario::{GivenTimes, Override};

use super::analysis::{self, Bar, Files};
use super::system::Opened;

const EXAMPLES: &str = "\
Examples:
  maglev map scenarios/standstill.json --x ems_*.gain_gap=2:14:100 \\
      --y guideway.frequency_01=4:10:100 --out results/map
  maglev map scenarios/standstill.json --x guideway.damping_01=0.005,0.01,0.02
  maglev map scenarios/standstill.json --x ems_*.gain_gap=2:14:25 \\
      --y guideway.stiffness_factor=0.4:1.4:25 --over vehicle.initial_position=0:75:6

A map is valid for small motions about the start of the scenario. The exit status is 0 if all
modes decay at every point, and 1 if one grows at a point. An interrupted map continues if it
is started again with the same --out.";

/// Arguments of `maglev map`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). It starts and is linearised, but does not run.
    scenario: PathBuf,
    /// Parameter of the columns: FROM:TO:COUNT, or values with commas between.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUES")]
    x: Axis,
    /// Parameter of the rows.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUES")]
    y: Option<Axis>,
    /// Parameter over which the worst is taken, such as the train's position. The system starts
    /// anew for each value.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUES")]
    over: Option<Axis>,
    /// Show only modes up to this frequency.
    #[arg(long, value_name = "HZ")]
    below: Option<f64>,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Write map.json, map.parquet, map.svg and map.png to DIR.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Title of the picture, instead of the scenario's.
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Threads. Default: as many as the machine has cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Random points that are compared with all eigenvalues of the system.
    #[arg(long, value_name = "N", default_value_t = 20)]
    check: usize,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
}

/// Computes a map, prints it and writes its files.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let opened = Opened::new(&arguments.scenario, arguments.out.as_deref())?;
    let mut scenario = opened.load(GivenTimes::default())?;
    scenario.overrides.clone_from(&arguments.set);
    if let Some(title) = &arguments.title {
        scenario.title.clone_from(title);
    }
    let request = Request {
        scenario,
        x: arguments.x.clone(),
        y: arguments.y.clone(),
        over: arguments.over.clone(),
        below: arguments.below,
        threads: analysis::threads(arguments.threads),
        checks: arguments.check,
    };
    let bar = Bar::new("{bar:30} {pos}/{len} points, {eta} left, {msg}");
    let map = super::at_home(|| maps::map(&request, arguments.out.as_deref(), &bar));
    bar.close();
    let map = map?;
    if let Some(folder) = &arguments.out {
        write(&map, folder)?;
    }
    if arguments.json {
        super::print(&as_json(&map))?;
    } else {
        super::print(&page(&map, arguments.out.as_deref()))?;
    }
    Ok(if map.stable() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn as_json(map: &StabilityMap) -> String {
    // plain data, which always prints
    serde_json::to_string(map).unwrap_or_default() + "\n"
}

fn write(map: &StabilityMap, folder: &Path) -> Result<(), Error> {
    let files = Files::new(folder)?;
    files.write("map.json", as_json(map).as_bytes())?;
    maps::write_parquet(map, &folder.join("map.parquet"))?;
    files.picture("map", maps::picture(map), 1.0)
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(map: &StabilityMap, folder: Option<&Path>) -> String {
    let mut text = String::new();
    let all: Vec<(usize, usize, &MapCell)> = map
        .cells
        .iter()
        .enumerate()
        .flat_map(|(row, cells)| cells.iter().enumerate().map(move |(c, cell)| (c, row, cell)))
        .collect();
    let growing = all.iter().filter(|it| it.2.growing > 0).count();
    let _ = writeln!(text, "{} points; a mode grows at {growing} of them", all.len());
    let extreme =
        |sign: f64| all.iter().min_by(|a, b| (sign * a.2.damping).total_cmp(&(sign * b.2.damping)));
    for (name, found) in [("worst", extreme(1.0)), ("best", extreme(-1.0))] {
        let Some((column, row, cell)) = found else { continue };
        let _ = write!(
            text,
            "{name}: least damping ratio {:.4} at {:.4} Hz, with {}",
            cell.damping,
            cell.frequency_hz,
            at(&map.x, *column)
        );
        if let Some(y) = &map.y {
            let _ = write!(text, ", {}", at(y, *row));
        }
        if let (Some(over), Some(value)) = (&map.over, cell.at) {
            let _ = write!(text, ", {} = {value}", over.target);
        }
        let _ = writeln!(text);
    }
    for note in &map.notes {
        let _ = writeln!(text, "note: {note}");
    }
    let counted = all.iter().filter(|it| it.2.evidence == Known::Counted).count();
    let _ = writeln!(text, "counted: {counted} of {} points", all.len());
    if !map.checks.is_empty() {
        let worst = map.checks.iter().map(|it| it.distance).fold(0.0, f64::max);
        let same = map.checks.iter().filter(|it| (it.growing > 0) == (it.mapped > 0)).count();
        let _ = writeln!(
            text,
            "checked: {} random points against all eigenvalues: largest distance {worst:.1e}, {same} with the same verdict",
            map.checks.len()
        );
    }
    for check in &map.checks {
        let Some(restarted) = check.restarted else { continue };
        let column = map.x.values.iter().position(|x| *x == check.x);
        let row = map
            .y
            .as_ref()
            .zip(check.y)
            .and_then(|(axis, y)| axis.values.iter().position(|it| *it == y));
        if let Some(cell) = column.map(|c| &map.cells[row.unwrap_or(0)][c]) {
            let _ = writeln!(
                text,
                "started anew at {}: least damping ratio {restarted:.6}, in the map {:.6}",
                check.y.map_or_else(|| check.x.to_string(), |y| format!("{}, {y}", check.x)),
                cell.damping
            );
        }
    }
    let [survey, total] = map.seconds;
    let _ = writeln!(text, "time: {survey:.1} s for the map, {total:.1} s with start and checks");
    if let Some(folder) = folder {
        let _ = writeln!(
            text,
            "files: map.json, map.parquet, map.svg, map.png in {}",
            folder.display()
        );
    }
    text
}

fn at(axis: &MapAxis, k: usize) -> String {
    format!("{} = {}", axis.target, axis.values[k])
}
