//! What a run shows on the terminal: progress, notices, its end.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use fmi2_import::interrupt::{self, Interruption};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use maglev::Error;
use maglev::run::{Checkpoint, Observer};
use report::ReportError;
use results::RunResults;
use results::summary::{Status, Summary};
use scenario::LogLevel;

use super::closing;
use super::stdout::Reserved;

/// How long a step may take after Ctrl-C before the command explains how to end it.
const PATIENCE: Duration = Duration::from_secs(1);

/// Options of `run` and `resume` for what is printed and made at the end.
#[derive(Args)]
pub struct EndOptions {
    /// Make no report (report.html) at the end.
    #[arg(long)]
    no_report: bool,
    /// Print the content of summary.json on stdout, and nothing else there.
    #[arg(long)]
    json: bool,
    /// Print nothing unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
}

impl EndOptions {
    /// The terminal of a run with its results in a folder, which shows messages of a level.
    pub fn terminal<'a>(&self, folder: &'a Path, level: LogLevel) -> Terminal<'a> {
        Terminal { folder, quiet: self.quiet, json: self.json, report: !self.no_report, level }
    }
}

/// What a run prints, and where it leaves its results.
pub struct Terminal<'a> {
    /// The folder with the results.
    pub folder: &'a Path,
    /// Whether to print nothing unless something goes wrong.
    pub quiet: bool,
    /// Whether stdout is for summary.json only.
    pub json: bool,
    /// Whether to make a report.
    pub report: bool,
    /// Messages of units to show. `Error` also hides notes.
    pub level: LogLevel,
}

/// Runs with progress on the terminal until the end or Ctrl-C, and prints the outcome.
pub fn watch(
    terminal: &Terminal<'_>,
    run: impl FnOnce(&mut dyn Observer) -> Result<Summary, Error>,
) -> Result<ExitCode, Error> {
    let &Terminal { folder, quiet, .. } = terminal;
    let stdout = terminal.json.then(Reserved::new).transpose()?;
    let stop = Arc::new(AtomicBool::new(false));
    let handler = Handler { stop: Arc::clone(&stop), folder: folder.to_owned(), quiet };
    // without a handler the run still works, but Ctrl-C ends it at once
    let handled = ctrlc::set_handler(move || handler.heed()).is_ok();
    let mut display = Display { bar: None, stop, quiet, level: terminal.level };
    if !handled {
        display.notice("cannot catch Ctrl-C: it will end the run without results");
    }
    let outcome = super::at_home(|| run(&mut display));
    display.close();
    if outcome.as_ref().is_err_and(|error| error.exit_status() != 1) {
        // the run did not start, so there is nothing in the folder
        return outcome.map(|_| ExitCode::SUCCESS);
    }
    let report = terminal.report();
    if !quiet {
        terminal.explain_early_end(&outcome, report.as_deref());
    }
    let printed = stdout.map_or(Ok(()), |it| it.print_file(&folder.join(results::SUMMARY)));
    let summary = outcome?;
    printed?;
    if !quiet && !terminal.json {
        super::print(&closing::text(&summary, folder, report.as_deref()))?;
    }
    Ok(match summary.status {
        Status::Finished | Status::Stopped | Status::Terminated => ExitCode::SUCCESS,
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
    /// The first signal ends the run after the current step, the second one even if the step hangs.
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

impl Terminal<'_> {
    /// Says where the results of a run without a regular end are, and how to continue it.
    fn explain_early_end(&self, outcome: &Result<Summary, Error>, report: Option<&Path>) {
        match outcome {
            Ok(Summary { status: Status::Interrupted, reached, .. }) => {
                eprintln!("interrupted at {reached} s; the results until then are kept");
            }
            Ok(_) => return,
            Err(_) => eprintln!("results until then: {}", report.unwrap_or(self.folder).display()),
        }
        if Checkpoint::path(self.folder).exists() {
            let folder = self.folder.display();
            eprintln!("to continue from the last checkpoint: maglev resume {folder}");
        }
    }

    /// Makes the report. A run does not fail if its report does.
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
                eprintln!("warning: cannot make the report: {}", error.chain().join(": "));
                None
            }
        }
    }
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
