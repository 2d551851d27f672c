//! `maglev fit`: parameters of a scenario from a measured record.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use fit::least_squares::Settings;
use fit::{Fit, Order, Progress, Varied};
use in_memory::accuracy::{Choice, choose_step};
use indicatif::ProgressBar;
use maglev::Error;
use maglev::run::{Job, Unobserved};
use measured::Record;
use report::ReportError;
use results::{RunResults, write_whole};
use scenario::{GivenTimes, Override, Recorded, Scenario};

use super::measured::{Beside, RecordArguments};
use super::system::Opened;

/// Trials for each parameter, if no number is given.
const TRIALS: usize = 8;

const EXAMPLES: &str = "\
Examples:
  maglev fit scenarios/one-magnet.json --measured bridge.csv --map 'w=guideway.midspan_displacement_01:mm' \\
      --vary guideway.frequency_01=5:9 --vary guideway.damping_01=0.002:0.05
  maglev fit scenarios/standstill.json --measured record.json --vary 'ems_*.gain_gap=4:12' --out results/gains
  maglev fit scenarios/one-magnet.json --measured bridge.csv --vary guideway.frequency_01=5:9 --vary offset=-0.1:0.1

Least squares between the bounds. The folder gets fit.json, fitted.json (a scenario that extends the
given one by the fitted values), both runs, and a report with record, runs and residuals.";

/// Arguments of `maglev fit`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp).
    scenario: PathBuf,
    /// The record: a CSV or Parquet file, or a JSON file that names one.
    #[arg(long, value_name = "FILE")]
    measured: PathBuf,
    #[command(flatten)]
    record: RecordArguments,
    /// A parameter to fit, and its bounds; "offset" is that of the record's clock. May be repeated.
    #[arg(long, required = true, value_name = "INSTANCE.VARIABLE=LOW:HIGH[:START]")]
    vary: Vec<Varied>,
    /// Set a parameter or start value that does not vary, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Sets of parameters to try before the search begins at the best [default: 8 for each parameter].
    #[arg(long, value_name = "N")]
    trials: Option<usize>,
    /// Most iterations.
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u16).range(1..))]
    iterations: u16,
    /// Runs at the same time [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Folder for the results [default: results/NAME-fit].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print fit.json on stdout, and nothing else there.
    #[arg(long)]
    json: bool,
    /// Show no progress.
    #[arg(long, short)]
    quiet: bool,
}

/// Fits, and writes what was found. The exit status is 1 if the search does not converge.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let name = arguments.scenario.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder =
        arguments.out.clone().unwrap_or_else(|| Path::new("results").join(format!("{name}-fit")));
    let opened = Opened::new(&arguments.scenario, Some(&folder))?;
    let mut scenario = opened.load(GivenTimes::default())?;
    scenario.overrides.extend_from_slice(&arguments.set);
    // all runs of the fit have one step
    let tell = |text: &str| {
        if !arguments.quiet {
            eprintln!("note: {text}");
        }
    };
    let chosen = super::at_home(|| choose_step(&scenario, &mut |it| tell(it), &mut || false))?;
    if let Some(Choice { scenario: chosen, report }) = chosen {
        tell(&format!("accuracy: {}", report.explanation));
        scenario = chosen;
    }
    let spec =
        arguments.record.spec(&arguments.measured).map_err(|error| Error::Fit(error.into()))?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let order = Order {
        scenario: &scenario,
        spec: &spec,
        varied: &arguments.vary,
        settings: Settings {
            trials: arguments.trials.unwrap_or(TRIALS * arguments.vary.len()),
            iterations: arguments.iterations.into(),
        },
        threads: arguments.threads.map_or(cores, usize::from),
    };
    let mut shown = Shown::new(arguments.quiet);
    let found = super::at_home(|| fit::fit(&order, &mut |it| shown.update(it)));
    shown.close();
    let found = found.map_err(Error::Fit)?;
    let json = serde_json::to_string(&found).unwrap_or_default() + "\n";
    let written = write(&found, &scenario, (arguments, &opened), &folder, &json)?;
    if arguments.json {
        super::print(&json)?;
    } else {
        let paths: String = written.iter().map(|it| format!("{}\n", it.display())).collect();
        super::print(&(page(&found) + &paths))?;
    }
    Ok(if found.converged { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Progress on a terminal.
struct Shown(Option<ProgressBar>);

impl Shown {
    fn new(quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal();
        Self(visible.then(ProgressBar::new_spinner))
    }

    fn update(&mut self, progress: Progress) {
        if let Some(bar) = &self.0 {
            bar.set_message(format!(
                "{} runs, least relative difference {:.4}",
                progress.runs, progress.best
            ));
            bar.tick();
        }
    }

    fn close(&mut self) {
        if let Some(bar) = self.0.take() {
            bar.finish_and_clear();
        }
    }
}

/// Writes the folder. Returns what a reader should look at.
fn write(
    found: &Fit,
    scenario: &Scenario,
    (arguments, opened): (&Arguments, &Opened),
    folder: &Path,
    json: &str,
) -> Result<Vec<PathBuf>, Error> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Write { path, source }
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let mut written = Vec::new();
    let mut put = |name: &str, text: &str| {
        let path = folder.join(name);
        write_whole(&path, text.as_bytes()).map_err(failed(&path))?;
        written.push(path);
        Ok::<(), Error>(())
    };
    put("fit.json", json)?;
    let base = std::path::absolute(&opened.path).map_err(failed(&opened.path))?;
    // what --set changes is no part of the file that the patch extends
    if arguments.set.is_empty()
        && let Some(patch) = fit::patch::patch(found, scenario, &base)
    {
        let text = serde_json::to_string_pretty(&patch).unwrap_or_default() + "\n";
        put("fitted.json", &text)?;
    }
    let Some(record) = &found.record else { return Ok(written) };
    let mut runs = Vec::new();
    for (name, values) in [("fitted", true), ("before", false)] {
        let mut scenario = recording(scenario, record);
        if values {
            scenario.overrides.extend(overrides(found));
        }
        let place = folder.join(name);
        let ran = super::at_home(|| {
            Job { scenario: &scenario, name, folder: &place }.run(&mut Unobserved)
        });
        match ran {
            Ok(_) => runs.push(RunResults::read(&place).map_err(ReportError::from)?),
            // the values before need not run
            Err(_) if !values && place.exists() => {}
            Err(error) => return Err(error),
        }
    }
    let mut alignment = found.alignment;
    alignment.offset = found.offset();
    let compared =
        runs.iter().map(|run| measured::compare(record, (&run.name(), &run.table), alignment));
    let comparisons =
        compared.collect::<Result<Vec<_>, _>>().map_err(|error| Error::Fit(error.into()))?;
    let beside = Beside { record: record.clone(), comparisons };
    let title = format!("{}: fitted to {}", scenario.title, found.file);
    let report = folder.join(results::REPORT);
    let pages = beside.write(runs, Some(&title), vec![fit::section(found)], &report)?;
    written.extend(pages);
    Ok(written)
}

/// A scenario that also records the signals of the record, in each step.
fn recording(scenario: &Scenario, record: &Record) -> Scenario {
    let mut scenario = scenario.clone();
    let signals = record.columns.iter().map(|it| Recorded::Signal(it.signal.clone()));
    let others = std::mem::take(&mut scenario.record.signals);
    scenario.record.signals = signals.chain(others).collect();
    scenario.record.interval = None;
    scenario.checkpoint = None;
    scenario
}

fn overrides(found: &Fit) -> Vec<Override> {
    let own = found.parameters.iter().filter(|it| it.target.contains('.'));
    own.map(|it| Override { target: it.target.clone(), value: it.value.to_string() }).collect()
}

/// The result as lines.
fn page(found: &Fit) -> String {
    let white = found.is_white();
    let head = ["parameter", "unit", "before", "fitted", "+- 95 %", "remark"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for it in &found.parameters {
        let half = it.interval(white).filter(|_| it.determined);
        let remark = match it {
            it if it.at_bound => "at its bound",
            it if !it.determined => "NOT DETERMINED by the record",
            _ => "",
        };
        rows.push(vec![
            it.target.clone(),
            it.unit.clone().unwrap_or_default(),
            it.before.map_or_else(String::new, |it| format!("{it}")),
            digits(it.value, half),
            half.map_or_else(|| "-".to_owned(), |half| format!("{half:.2e}")),
            remark.to_owned(),
        ]);
    }
    let mut text = super::table::table(rows, &[2, 3, 4]);
    let head = ["signal", "values", "RMS before", "RMS residual", "white"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for it in &found.signals {
        let unit = it.unit.as_deref().unwrap_or("");
        rows.push(vec![
            it.signal.clone(),
            it.samples.to_string(),
            it.rms_before.map_or_else(|| "-".to_owned(), |it| format!("{it:.4e} {unit}")),
            format!("{:.4e} {unit}", it.rms_after),
            if it.whiteness.white { "yes" } else { "no" }.to_owned(),
        ]);
    }
    text += "\n";
    text += &super::table::table(rows, &[1, 2, 3]);
    text += &format!(
        "\n{} runs, {} iterations, {:.1} s{}\n",
        found.runs,
        found.iterations,
        found.seconds,
        if found.converged { "" } else { ", NOT CONVERGED" }
    );
    for it in &found.warnings {
        text += &format!("warning: {it}\n");
    }
    text += &fit::patch::options(found).join(" ");
    text + "\n"
}

/// A value with two digits more than its interval needs.
fn digits(value: f64, half: Option<f64>) -> String {
    let Some(half) = half.filter(|it| *it > 0.0) else { return format!("{value:.6}") };
    let decimals = (2.0 - half.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}
