//! What a study shows on the terminal.

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use study::{Row, Watcher};

/// Time between two lines where there is no terminal.
const PAUSE: Duration = Duration::from_secs(60);

/// Progress on a terminal as a bar, elsewhere as a line now and then.
pub struct Progress {
    bar: Option<ProgressBar>,
    quiet: bool,
    /// number of Ctrl-C
    stop: Arc<AtomicU32>,
    begin: Instant,
    told: Instant,
    to_do: u64,
    failed: u64,
}

impl Progress {
    /// Catches Ctrl-C and SIGTERM.
    pub fn new(quiet: bool) -> Self {
        let stop = Arc::new(AtomicU32::new(0));
        let asked = Arc::clone(&stop);
        // without a handler Ctrl-C ends the study at once, and it can continue all the same
        let _ = ctrlc::set_handler(move || {
            asked.fetch_add(1, Ordering::Relaxed);
        });
        let now = Instant::now();
        Self { bar: None, quiet, stop, begin: now, told: now, to_do: 0, failed: 0 }
    }

    /// Removes the bar.
    pub fn close(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Watcher for Progress {
    fn begin(&mut self, to_do: u64, there: u64) {
        (self.to_do, self.begin, self.told) = (to_do, Instant::now(), Instant::now());
        if there > 0 {
            self.notice(&format!("{there} points are there already; {to_do} are computed now"));
        }
        if self.quiet || !std::io::stderr().is_terminal() || to_do == 0 {
            return;
        }
        let bar = ProgressBar::with_draw_target(Some(to_do), ProgressDrawTarget::stderr_with_hz(5));
        let style = "{percent:>3} % {bar:40} {pos}/{len} points{msg} (left: {eta})";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        self.bar = Some(bar);
    }

    fn point(&mut self, done: u64, row: &Row) {
        self.failed += u64::from(!row.status.is_regular());
        let failed = match self.failed {
            0 => String::new(),
            count => format!(", {count} failed"),
        };
        if let Some(bar) = &self.bar {
            bar.set_position(done);
            bar.set_message(failed);
        } else if !self.quiet && self.told.elapsed() > PAUSE {
            self.told = Instant::now();
            let each = self.begin.elapsed().as_secs_f64() / done as f64;
            let left = Duration::from_secs_f64(each * self.to_do.saturating_sub(done) as f64);
            eprintln!("{done} of {} points{failed} (left: {})", self.to_do, HumanDuration(left));
        }
    }

    fn notice(&mut self, text: &str) {
        match &self.bar {
            _ if self.quiet => {}
            Some(bar) => bar.suspend(|| eprintln!("note: {text}")),
            None => eprintln!("note: {text}"),
        }
    }

    fn interrupted(&self) -> u32 {
        self.stop.load(Ordering::Relaxed)
    }
}
