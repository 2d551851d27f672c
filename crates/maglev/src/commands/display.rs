//! What a run shows on the terminal: progress, notices, its end.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use fmi2_import::interrupt::{self, Interruption};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use maglev::Error;
use maglev::run::{Checkpoint, Observer};
use report::ReportError;
use results::RunResults;
use results::summary::{Status, Summary};
use scenario::LogLevel;

/// How long a step may go on after Ctrl-C before the user is told how to end it.
const PATIENCE: Duration = Duration::from_secs(1);

/// What happens at the end of a run.
pub struct End<'a> {
    /// The folder with the results.
    pub folder: &'a Path,
    /// Whether nothing is said unless something goes wrong.
    pub quiet: bool,
    /// Whether a report is made.
    pub report: bool,
    /// Which messages are shown; notes are none of `Error`.
    pub level: LogLevel,
}

/// Runs with progress on the terminal until the end or Ctrl-C, and tells how it went.
pub fn watch(
    end: &End<'_>,
    run: impl FnOnce(&mut dyn Observer) -> Result<Summary, Error>,
) -> Result<ExitCode, Error> {
    let &End { folder, quiet, .. } = end;
    let stop = Arc::new(AtomicBool::new(false));
    let handler = Handler { stop: Arc::clone(&stop), folder: folder.to_owned(), quiet };
    // without a handler the run still works, only Ctrl-C ends it at once
    let handled = ctrlc::set_handler(move || handler.heed()).is_ok();
    let mut display = Display { bar: None, stop, quiet, level: end.level };
    if !handled {
        display.notice("Ctrl-C will lose the results of this run");
    }
    let outcome = super::at_home(|| run(&mut display));
    display.close();
    let again = || {
        if Checkpoint::path(folder).exists() {
            eprintln!("to go on from the last checkpoint: maglev resume {}", folder.display());
        }
    };
    let summary = outcome.inspect_err(|error| {
        if error.exit_status() == 1 {
            let report = end.report();
            if !quiet {
                eprintln!("results until then: {}", report.as_deref().unwrap_or(folder).display());
                again();
            }
        }
    })?;
    if summary.status == Status::Interrupted && !quiet {
        eprintln!("interrupted at {} s; what was recorded is kept", summary.reached);
        again();
    }
    let report = end.report();
    if !quiet {
        print_end(&summary, folder, report.as_deref())?;
    }
    Ok(match summary.status {
        Status::Finished | Status::Terminated => ExitCode::SUCCESS,
        Status::Interrupted | Status::Failed => ExitCode::FAILURE,
    })
}

/// What Ctrl-C and SIGTERM do.
struct Handler {
    stop: Arc<AtomicBool>,
    folder: PathBuf,
    quiet: bool,
}

impl Handler {
    /// The first signal ends the run after its step, the second one also if the step hangs.
    fn heed(&self) {
        self.stop.store(true, Ordering::Relaxed);
        let tell = |text: &str| {
            if !self.quiet {
                eprintln!("{text}");
            }
        };
        match interrupt::ask() {
            Interruption::Asked if interrupt::still_running(PATIENCE) => {
                tell("the run ends after this step; another Ctrl-C ends a step that hangs");
            }
            Interruption::Asked | Interruption::Ended => {}
            Interruption::GivenUp => {
                let folder = self.folder.display();
                tell(&format!("interrupted in a step that hangs; results until then: {folder}"));
                fmi2_import::witness::end_at_once(1);
            }
        }
    }
}

impl End<'_> {
    /// Makes the report; what hinders it does not make the run a failed one.
    fn report(&self) -> Option<PathBuf> {
        if !self.report {
            return None;
        }
        let path = self.folder.join(results::REPORT);
        let made = RunResults::read(self.folder)
            .map_err(ReportError::from)
            .and_then(|run| report::write(&[run], &path));
        match made {
            Ok(()) => Some(path),
            Err(error) => {
                eprintln!("warning: there is no report: {}", error.chain().join(": "));
                None
            }
        }
    }
}

fn print_end(summary: &Summary, folder: &Path, report: Option<&Path>) -> Result<(), Error> {
    let wall = summary.wall_time;
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
    if let Some(real_time) = &summary.real_time {
        text += &format!(
            "{} of {} steps were late for {} times real time, by {:.3} ms at worst\n",
            real_time.overruns,
            real_time.steps,
            real_time.factor,
            1e3 * real_time.worst_seconds
        );
    }
    let files = summary.tables.iter().chain(&summary.pictures).map(String::as_str);
    for name in files.chain(["events.csv", "summary.json"]) {
        text += &format!("{}\n", folder.join(name).display());
    }
    if let Some(report) = report {
        text += &format!("{}\n", report.display());
    }
    super::print(&text).map(|_| ())
}

/// Progress on a terminal, notices as lines.
struct Display {
    bar: Option<ProgressBar>,
    stop: Arc<AtomicBool>,
    quiet: bool,
    level: LogLevel,
}

impl Display {
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
        if self.level > LogLevel::Error {
            self.message(text);
        }
    }

    fn message(&mut self, text: &str) {
        match &self.bar {
            _ if self.quiet => {}
            Some(bar) => bar.suspend(|| eprintln!("note: {text}")),
            None => eprintln!("note: {text}"),
        }
    }

    fn warning(&mut self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("warning: {text}")),
            None => eprintln!("warning: {text}"),
        }
    }

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
