//! Looks for Ctrl-C and reports progress while units step without the interpreter's lock.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use maglev::run::Observer;
use pyo3::prelude::*;

/// Wall time between two looks.
const INTERVAL: Duration = Duration::from_millis(50);

/// What Python wants to know of a run, and why it wants to end it.
pub struct Watch {
    /// called with the time that is reached (s)
    progress: Option<Py<PyAny>>,
    looked: Cell<Instant>,
    time: Cell<f64>,
    stop: RefCell<Option<PyErr>>,
    notes: Vec<String>,
}

impl Watch {
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Self {
            progress,
            looked: Cell::new(Instant::now()),
            time: Cell::new(f64::NAN),
            stop: RefCell::new(None),
            notes: Vec::new(),
        }
    }

    /// Looks for Ctrl-C and reports progress, at most every 50 ms. NaN: there is no progress yet.
    ///
    /// # Errors
    /// Ctrl-C was pressed, or the callback raised an exception.
    #[inline]
    pub fn look(&self, time: f64) -> PyResult<()> {
        let now = Instant::now();
        if now - self.looked.get() < INTERVAL {
            return Ok(());
        }
        self.looked.set(now);
        Python::attach(|py| {
            py.check_signals()?;
            let progress = self.progress.as_ref().filter(|_| !time.is_nan());
            progress.map_or(Ok(()), |it| it.call1(py, (time,)).map(drop))
        })
    }

    /// Why the run was ended, if Python ended it, and the notes on the run.
    pub fn finish(self) -> (Option<PyErr>, Vec<String>) {
        (self.stop.into_inner(), self.notes)
    }
}

/// For a run with a results folder.
impl Observer for Watch {
    fn progress(&mut self, _done: u64, time: f64, _factor: f64) {
        self.time.set(time);
    }

    fn notice(&mut self, text: &str) {
        self.notes.push(text.to_owned());
    }

    fn interrupted(&self) -> bool {
        if let Err(error) = self.look(self.time.get()) {
            *self.stop.borrow_mut() = Some(error);
        }
        self.stop.borrow().is_some()
    }
}
