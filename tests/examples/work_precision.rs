//! Work-precision diagram of the coupling algorithms on the full train: error against wall time.
//!
//! ```sh
//! cargo xtask package && cargo build --release -p maglev-cli
//! cargo run --release -p system-tests --example work_precision [-- ALGORITHM…]
//! ```
//!
//! Runs what is not in `target/work-precision` yet (names of algorithms restrict it to these), then
//! prints the table of docs/coupling.md and draws docs/work-precision.svg from all that is there. The
//! reference is the monolithic model, which has no coupling.

#![allow(clippy::print_stdout, reason = "a program of the command line")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "as in tests")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use plotters::prelude::*;
use serde_json::{Value, json};
use system_tests::monolithic::{MonolithicSetup, MonolithicSystem};
use system_tests::{root, start};

const STEPS: [f64; 8] = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2];
const INTERVAL: f64 = 0.02;
/// Tolerance of the monolithic model's integration: its own error is below 1e-8 of the gaps' deviation.
const TOLERANCE: f64 = 1e-10;
/// A part of the low-speed scenario.
struct Case {
    name: &'static str,
    title: &'static str,
    settings: &'static [&'static str],
    speed: f64,
    position: f64,
    stop: f64,
}

const CASES: [Case; 2] = [
    Case {
        name: "moving",
        title: "5 km/h on rough girders, 2 s",
        settings: &["vehicle.initial_position=10"],
        speed: 5.0 / 3.6,
        position: 10.0,
        stop: 2.0,
    },
    Case {
        name: "standing",
        title: "standstill, chirp through 4 Hz, 4 s",
        settings: &[
            "vehicle.travel_speed=0",
            "vehicle.initial_position=37.5",
            "guideway.irregularity_on=false",
            "guideway.chirp_on=true",
            "guideway.chirp_position=37.5",
        ],
        speed: 0.0,
        position: 37.5,
        stop: 4.0,
    },
];

fn algorithms() -> Vec<(&'static str, Value)> {
    let iterated = |tolerance: f64| json!({ "tolerance": tolerance });
    vec![
        ("jacobi 0", json!({ "name": "jacobi", "extrapolation": 0 })),
        ("jacobi 1", json!({ "name": "jacobi", "extrapolation": 1 })),
        ("jacobi 2", json!({ "name": "jacobi", "extrapolation": 2 })),
        ("gauss-seidel 0", json!({ "name": "gauss-seidel", "extrapolation": 0 })),
        ("gauss-seidel 1", json!({ "name": "gauss-seidel", "extrapolation": 1 })),
        ("gauss-seidel 2", json!({ "name": "gauss-seidel", "extrapolation": 2 })),
        ("gauss-seidel 3", json!({ "name": "gauss-seidel", "extrapolation": 3 })),
        ("iterated", json!({ "name": "iterated", "iteration": iterated(1e-7) })),
        (
            "iterated 6",
            json!({ "name": "iterated", "iteration": { "tolerance": 1e-9, "order": 6 } }),
        ),
        ("newton", json!({ "name": "newton", "iteration": iterated(1e-7) })),
    ]
}

/// Gaps of the monolithic model at all recorded times, kept in a file.
fn reference(case: &Case) -> Vec<f64> {
    let file = root().join("target/work-precision").join(case.name).join("monolithic.json");
    if let Ok(text) = fs::read(&file) {
        return serde_json::from_slice(&text).unwrap();
    }
    let patch = match case.speed {
        0.0 => json!({
            "irregularity": { "on": false },
            "chirp": { "on": true, "position": case.position }
        }),
        _ => json!({}),
    };
    let mut setup = MonolithicSetup::of_layouts("two-car", "three-spans", &patch).unwrap();
    (setup.travel_speed, setup.initial_position) = (case.speed, case.position);
    let count = (case.stop / INTERVAL).round() as u32;
    let times: Vec<f64> = (0..=count).map(|k| f64::from(k) * INTERVAL).collect();
    let solution = MonolithicSystem::new(&setup).unwrap().solve(&times, TOLERANCE).unwrap();
    let gaps: Vec<f64> = solution.magnets.iter().flatten().map(|magnet| magnet.gap).collect();
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(&file, json!(gaps).to_string()).unwrap();
    gaps
}

fn folder(case: &Case, algorithm: &str, step: f64) -> PathBuf {
    let name = format!("{}-{:.0}us", algorithm.replace(' ', "-"), step * 1e6);
    root().join("target/work-precision").join(case.name).join(name)
}

/// Runs what has not been run.
fn run(case: &Case, algorithm: &str, settings: &Value, step: f64) {
    let out = folder(case, algorithm, step);
    if out.join("summary.json").exists() {
        return;
    }
    let text = fs::read_to_string(root().join("scenarios/low-speed.json")).unwrap();
    let mut scenario: Value = serde_json::from_str(&text).unwrap();
    let order = scenario["algorithm"]["order"].take();
    scenario["algorithm"] = settings.clone();
    scenario["algorithm"]["order"] = order;
    scenario["record"] = json!({ "interval": INTERVAL, "signals": ["vehicle.gap_[01..64]"] });
    scenario["plots"] = json!([]);
    scenario["experiment"] = json!({ "start": 0.0, "stop": case.stop, "step": step });
    for unit in scenario["units"].as_object_mut().unwrap().values_mut() {
        *unit = json!(root().join("scenarios").join(unit.as_str().unwrap()));
    }
    fs::create_dir_all(out.parent().unwrap()).unwrap();
    let file = out.with_extension("json");
    fs::write(&file, scenario.to_string()).unwrap();
    let mut args = vec!["run".to_owned(), file.display().to_string(), "--quiet".to_owned()];
    args.extend(["--out".to_owned(), out.display().to_string()]);
    args.extend(case.settings.iter().flat_map(|&it| ["--set".to_owned(), it.to_owned()]));
    let output = start(&args).unwrap();
    if !output.status.success() {
        // a coupling that is unstable at this step drives a magnet to the rail
        let said = String::from_utf8_lossy(&output.stderr);
        println!("{}, {algorithm}, {step} s: {said}", case.name);
        fs::remove_dir_all(&out).unwrap();
    }
}

/// Gaps at all recorded times, and the wall time of stepping.
fn results(folder: &Path) -> Option<(Vec<f64>, f64)> {
    let summary: Value =
        serde_json::from_slice(&fs::read(folder.join("summary.json")).ok()?).ok()?;
    let table = fs::read_to_string(folder.join("results.csv")).ok()?;
    let gaps = table
        .lines()
        .skip(1)
        .flat_map(|line| {
            line.split(',').skip(1).map(|cell| cell.parse::<f64>().unwrap_or(f64::NAN))
        })
        .collect();
    Some((gaps, summary["wall_time"]["run_seconds"].as_f64()?))
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x * x));
    f64::sqrt(sum / f64::max(count, 1.0))
}

/// Per algorithm: step, wall time, and error of the gaps relative to their deviation from 8 mm.
type Curves = BTreeMap<usize, Vec<(f64, f64, f64)>>;

fn measured(case: &Case) -> Curves {
    let mut curves = Curves::new();
    let truth = reference(case);
    let size = rms(truth.iter().map(|gap| gap - 8e-3));
    for (k, (algorithm, _)) in algorithms().iter().enumerate() {
        for step in STEPS {
            if let Some((gaps, seconds)) = results(&folder(case, algorithm, step)) {
                let error = rms(gaps.iter().zip(&truth).map(|(a, b)| a - b)) / size;
                curves.entry(k).or_default().push((step, seconds, error));
            }
        }
    }
    curves
}

fn print(case: &Case, curves: &Curves) {
    println!("\n{}: error, wall time\n", case.title);
    let steps: Vec<String> = STEPS.iter().map(|step| format!("{} ms", step * 1e3)).collect();
    println!("| algorithm | {} |\n|---{}|", steps.join(" | "), "|---".repeat(STEPS.len()));
    for (&k, points) in curves {
        let cell = |step: &f64| match points.iter().find(|(it, ..)| it == step) {
            Some((_, seconds, error)) => format!("{:.2e} %, {seconds:.2} s", 100.0 * error),
            None => String::new(),
        };
        let cells: Vec<String> = STEPS.iter().map(cell).collect();
        println!("| {} | {} |", algorithms()[k].0, cells.join(" | "));
    }
}

fn draw(all: &[Curves]) {
    let path = root().join("docs/work-precision.svg");
    let area = SVGBackend::new(&path, (1000, 480)).into_drawing_area();
    area.fill(&WHITE).unwrap();
    for ((case, curves), part) in CASES.iter().zip(all).zip(area.split_evenly((1, 2))) {
        let points = || curves.values().flatten().filter(|it| it.2 > 0.0);
        let span = |pick: fn(&(f64, f64, f64)) -> f64| {
            let least = points().map(pick).fold(f64::INFINITY, f64::min);
            let most = points().map(pick).fold(0.0, f64::max).min(1.0 / 0.5);
            (least * 0.7)..(most * 1.4)
        };
        let seconds = {
            let it = span(|it| it.1);
            it.start..points().map(|it| it.1).fold(0.0, f64::max) * 1.4
        };
        let mut chart = ChartBuilder::on(&part)
            .caption(case.title, ("sans-serif", 16))
            .margin(10)
            .x_label_area_size(36)
            .y_label_area_size(56)
            .build_cartesian_2d(seconds.log_scale(), span(|it| it.2).log_scale())
            .unwrap();
        chart
            .configure_mesh()
            .x_desc("wall time (s)")
            .y_desc("error of the gaps, relative")
            .y_label_formatter(&|y| format!("{y:.0e}"))
            .draw()
            .unwrap();
        for (&k, points) in curves {
            let colour = Palette99::pick(k).to_rgba();
            let line: Vec<(f64, f64)> =
                points.iter().filter(|it| it.2 < 2.0).map(|it| (it.1, it.2)).collect();
            chart
                .draw_series(LineSeries::new(line.clone(), colour.stroke_width(2)))
                .unwrap()
                .label(algorithms()[k].0)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2))
                });
            let marks = line.into_iter().map(|point| Circle::new(point, 3, colour.filled()));
            chart.draw_series(marks).unwrap();
        }
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .position(SeriesLabelPosition::UpperRight)
            .draw()
            .unwrap();
    }
    area.present().unwrap();
}

fn main() {
    let only: Vec<String> = std::env::args().skip(1).collect();
    for case in &CASES {
        for (algorithm, settings) in algorithms() {
            if !only.is_empty() && !only.iter().any(|it| it == algorithm) {
                continue;
            }
            // a Jacobian of 64 magnets costs as much as hundreds of steps: too slow at small ones
            for step in STEPS.into_iter().filter(|&it| algorithm != "newton" || it >= 1e-3) {
                run(case, algorithm, &settings, step);
            }
        }
    }
    let all: Vec<Curves> = CASES.iter().map(measured).collect();
    for (case, curves) in CASES.iter().zip(&all) {
        print(case, curves);
    }
    draw(&all);
}
