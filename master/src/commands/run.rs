//! `maglev run`

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use master::error::Error;
use master::run::{Job, Observer};
use master::scenario::{AlgorithmName, Scenario};
use master::summary::{Status, Summary};
use master::system::Override;

const EXAMPLES: &str = "\
Examples:
  maglev run scenarios/one-bogie.json --stop 5 --out /tmp/bogie
  maglev run scenarios/one-bogie.json --set 'ems_*.gain_gap=6' --set vehicle.travel_speed=2

Writes results.csv (recorded signals), summary.json (statistics, times, units) and the scenario's
pictures. Ctrl-C ends a run cleanly and keeps what was recorded.";

/// Arguments of `maglev run`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario: a .json file that names units, connections and what to record.
    scenario: PathBuf,
    /// Folder for the results [default: results/ and the name of the scenario].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Set a parameter or start value, of several by a pattern (m_*.gain=7, m_[01..04].gain=7);
    /// may be given repeatedly.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE", value_parser = parse_override)]
    set: Vec<Override>,
    /// Stop time (s) instead of the scenario's.
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    stop: Option<f64>,
    /// Communication step (s) instead of the scenario's.
    #[arg(long, value_name = "H")]
    step: Option<f64>,
    /// Coupling algorithm instead of the scenario's: jacobi, gauss-seidel.
    #[arg(long, value_name = "NAME")]
    algorithm: Option<AlgorithmName>,
    /// Degree of the extrapolation of inputs, 0 to 3, instead of the scenario's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=3))]
    extrapolation: Option<u8>,
    /// Interval between recorded rows (s) instead of the scenario's.
    #[arg(long, value_name = "T")]
    record_interval: Option<f64>,
    /// Say nothing unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
}

fn parse_override(text: &str) -> Result<Override, String> {
    let (target, value) = text
        .split_once('=')
        .ok_or_else(|| format!("\"{text}\" is not of the form instance.variable=value"))?;
    Ok(Override { target: target.trim().to_owned(), value: value.trim().to_owned() })
}

/// Runs the scenario.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let mut scenario = Scenario::load(&arguments.scenario)?;
    if let Some(stop) = arguments.stop {
        scenario.experiment.stop = stop;
    }
    if let Some(step) = arguments.step {
        scenario.experiment.step = step;
    }
    if let Some(name) = arguments.algorithm {
        scenario.algorithm.name = name;
    }
    if let Some(degree) = arguments.extrapolation {
        scenario.algorithm.extrapolation = degree;
    }
    if let Some(interval) = arguments.record_interval {
        scenario.record.interval = Some(interval);
    }
    let name = arguments.scenario.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(name.as_str()));
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    // without a handler the run still works, only Ctrl-C ends it at once
    let handled = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).is_ok();
    let mut display = Display::new(stop, arguments.quiet);
    if !handled {
        display.notice("Ctrl-C will lose the results of this run");
    }
    let job = Job { scenario: &scenario, name: &name, overrides: &arguments.set, folder: &folder };
    let outcome = job.run(&mut display);
    display.close();
    let summary = outcome.inspect_err(|error| {
        if error.exit_status() == 1 && !arguments.quiet {
            eprintln!("results until then: {}", folder.display());
        }
    })?;
    if !arguments.quiet {
        print_end(&summary, &folder)?;
    }
    Ok(match summary.status {
        Status::Finished => ExitCode::SUCCESS,
        Status::Interrupted | Status::Failed => ExitCode::FAILURE,
    })
}

fn print_end(summary: &Summary, folder: &Path) -> Result<(), Error> {
    let wall = summary.wall_time;
    if summary.status == Status::Interrupted {
        eprintln!("interrupted at {} s; what was recorded is kept", summary.reached);
    }
    #[expect(clippy::cast_precision_loss, reason = "for people to read")]
    let steps = summary.steps.max(1) as f64;
    let mut text = format!(
        "{} steps of {} s in {:.2} s ({:.1} times real time; {:.0} % in the units, {:.2} µs per step \
         in the master)\n",
        summary.steps,
        summary.step,
        wall.run_seconds,
        summary.real_time_factor,
        100.0 * wall.units_seconds / wall.run_seconds.max(f64::MIN_POSITIVE),
        1e6 * wall.master_seconds / steps,
    );
    let files = ["results.csv", "summary.json"].into_iter();
    for name in files.chain(summary.pictures.iter().map(String::as_str)) {
        text += &format!("{}\n", folder.join(name).display());
    }
    super::print(&text).map(|_| ())
}

/// Progress on a terminal, notices as lines.
struct Display {
    bar: Option<ProgressBar>,
    stop: Arc<AtomicBool>,
    quiet: bool,
}

impl Display {
    fn new(stop: Arc<AtomicBool>, quiet: bool) -> Self {
        Self { bar: None, stop, quiet }
    }

    fn close(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Display {
    fn begin(&mut self, steps: u64) {
        if self.quiet || !std::io::stderr().is_terminal() {
            return;
        }
        let bar =
            ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr_with_hz(10));
        let style = "{percent:>3} % {bar:40} {msg} (left: {eta})";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        self.bar = Some(bar);
    }

    fn progress(&mut self, done: u64, time: f64, factor: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position(done);
            bar.set_message(format!("{time:.2} s, {factor:.1} × real time"));
        }
    }

    fn notice(&mut self, text: &str) {
        match &self.bar {
            _ if self.quiet => {}
            Some(bar) => bar.suspend(|| eprintln!("note: {text}")),
            None => eprintln!("note: {text}"),
        }
    }

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
