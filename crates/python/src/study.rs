//! Studies: their points, computed by processes of the command, or one in this process.

use std::cell::{Cell, RefCell};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use self_cell::self_cell;
use serde_json::json;
use study::{
    Counts, FactorValue, Order, Outcome, Row, Runner, StudyError, StudyFile, Watcher, coordinate,
};

use crate::error::Failure;
use crate::scenario::Scenario;
use crate::values::whole;
use crate::watch::Watch;

self_cell!(
    struct Computer {
        owner: study::Study,
        #[not_covariant]
        dependent: Runner,
    }
);

/// A study: many points of one scenario.
#[pyclass(frozen, module = "maglev_cosim._native")]
pub struct Study {
    study: study::Study,
    path: PathBuf,
    /// made for the first point that is computed here
    computer: Mutex<Option<Computer>>,
}

impl Study {
    fn new(file: StudyFile, path: PathBuf) -> Result<Self, StudyError> {
        let study = study::Study::new(file, &path)?;
        Ok(Self { study, path, computer: Mutex::new(None) })
    }

    /// Another copy of the study with what computes its points. Units whose reset is proven equal are reset from point to
    /// point.
    fn computer(&self) -> Result<Computer, StudyError> {
        let again = study::Study::new(self.study.file().clone(), &self.path)?;
        again.adopt(self.study.chosen().cloned());
        Computer::try_new(again, |study| {
            let mut runner = Runner::new(study)?;
            runner.prove_resets()?;
            Ok(runner)
        })
    }
}

impl From<FactorValue> for crate::values::Value {
    fn from(value: FactorValue) -> Self {
        match value {
            FactorValue::Boolean(value) => Self::Boolean(value),
            FactorValue::Integer(value) => Self::Whole(value),
            FactorValue::Number(value) => Self::Real(value),
            FactorValue::Text(text) => Self::Text(text),
        }
    }
}

#[pymethods]
impl Study {
    /// Reads a study file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let path = whole(&path);
        let read = py.detach(|| Self::new(StudyFile::load(&path)?, path));
        Ok(read.map_err(|it| Failure::of_study(&it))?)
    }

    /// Reads the text of a study whose paths are absolute. The path is for messages and the name.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, path: PathBuf) -> PyResult<Self> {
        let file = serde_json::from_str(text);
        let file = file.map_err(|error| Failure::input(format!("invalid study: {error}"), None))?;
        let made = py.detach(|| Self::new(file, path));
        Ok(made.map_err(|it| Failure::of_study(&it))?)
    }

    /// The study as JSON.
    fn json(&self) -> PyResult<String> {
        let text = serde_json::to_string(self.study.file());
        Ok(text.map_err(|error| Failure::input(error.to_string(), None))?)
    }

    /// Path of its file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    #[getter]
    fn name(&self) -> &str {
        self.study.name()
    }

    /// Number of points.
    #[getter]
    fn count(&self) -> u64 {
        self.study.count()
    }

    /// Names of the factors.
    #[getter]
    fn factors(&self) -> Vec<String> {
        self.study.file().factors.keys().cloned().collect()
    }

    /// Names of the figures.
    #[getter]
    fn metrics(&self) -> Vec<String> {
        self.study.columns().iter().map(|column| column.name.clone()).collect()
    }

    /// The values of a point, counted from 1, in the order of the factors.
    fn point(&self, number: u64) -> PyResult<Vec<crate::values::Value>> {
        let point = self.study.point(number).map_err(|it| Failure::of_study(&it))?;
        Ok(point.values.into_iter().map(Into::into).collect())
    }

    /// Chooses the step of all points, if the scenario asks for an accuracy; returns step and report as JSON.
    fn choose(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let watch = Watch::new(None);
        let (chosen, stopped) = py.detach(move || {
            let mut stopped = None;
            let chosen = self.study.choose(&mut |_| (), &mut || {
                stopped = watch.look(f64::NAN).err();
                stopped.is_some()
            });
            (chosen.map(|it| it.map(|it| json!(it).to_string())), stopped)
        });
        match stopped {
            Some(error) => Err(error),
            None => Ok(chosen.map_err(|it| Failure::of_study(&it))?),
        }
    }

    /// Takes what another copy of this study has chosen.
    fn adopt(&self, chosen: &str) -> PyResult<()> {
        let chosen = serde_json::from_str(chosen);
        let chosen = chosen.map_err(|error| Failure::input(error.to_string(), None))?;
        self.study.adopt(Some(chosen));
        Ok(())
    }

    /// The scenario of a point.
    fn scenario(&self, py: Python<'_>, number: u64) -> PyResult<Scenario> {
        self.choose(py)?;
        let made = py.detach(|| Runner::starting_with(&self.study, number)?.scenario(number));
        let name = format!("{}-{number}", self.study.name());
        Ok(Scenario::new(made.map_err(|it| Failure::of_study(&it))?, name))
    }

    /// Computes points that have no row yet, by processes of a program, which is the command. `order`: the number of
    /// processes, the first and the last point or None for all, whether to compute failed points again. Returns the number
    /// of ordered points and of those that have a row, and what the folder has if all points were ordered.
    #[pyo3(signature = (folder, program, order, progress = None))]
    fn run(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        program: PathBuf,
        order: (usize, Option<(u64, u64)>, bool),
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(u64, u64, Option<Numbers>)> {
        let (workers, points, retry) = order;
        let order = Order { folder, workers, points, retry };
        let worker = move || {
            let mut command = Command::new(&program);
            command.args(["study", "worker"]);
            Ok(command)
        };
        let mut progress = Progress::new(progress);
        let (outcome, stopped) = py.detach(move || {
            let outcome = coordinate(&self.study, &order, &worker, &mut progress);
            (outcome, progress.stop.into_inner())
        });
        if let Some(error) = stopped {
            return Err(error);
        }
        let Outcome { counts, ordered, done } = outcome.map_err(|it| {
            if it.can_try_again() { Failure::busy(&it) } else { Failure::of_study(&it) }
        })?;
        Ok((ordered, done, counts.map(numbers)))
    }

    /// Computes a point in this process; returns its row as JSON. A point that fails is a row with its status.
    fn compute(&self, py: Python<'_>, number: u64) -> PyResult<String> {
        self.choose(py)?;
        let timeout = self.study.file().timeout;
        let limit = timeout.and_then(|it| Duration::try_from_secs_f64(it).ok());
        let watch = Watch::new(None);
        let (row, stopped) = py.detach(move || {
            let mut stopped = None;
            let row = self.row(number, limit, &mut |time| {
                stopped = watch.look(time).err();
                stopped.is_some()
            });
            (row, stopped)
        });
        match stopped {
            Some(error) => Err(error),
            None => Ok(row.map_err(|it| Failure::of_study(&it))?),
        }
    }
}

/// Points of a study, points with a row, failed points, points beyond a limit.
type Numbers = (u64, u64, u64, u64);

fn numbers(counts: Counts) -> Numbers {
    let Counts { points, done, failed, beyond } = counts;
    (points, done, failed, beyond)
}

/// Writes the results of points that were computed apart.
#[pyfunction]
pub fn merge_study(py: Python<'_>, folder: PathBuf, others: Vec<PathBuf>) -> PyResult<Numbers> {
    let counts = py.detach(|| study::merge(&folder, &others));
    Ok(counts.map(numbers).map_err(|it| Failure::of_study(&it))?)
}

/// Looks for Ctrl-C and reports progress while processes compute points.
struct Progress {
    watch: Watch,
    /// called with the number of points that are done and of all that are to do
    callback: Option<Py<PyAny>>,
    to_do: Cell<u64>,
    stop: RefCell<Option<PyErr>>,
    asked: Cell<u32>,
}

impl Progress {
    fn new(callback: Option<Py<PyAny>>) -> Self {
        Self {
            watch: Watch::new(None),
            callback,
            to_do: Cell::new(0),
            stop: RefCell::new(None),
            asked: Cell::new(0),
        }
    }

    fn end(&self, error: PyErr) {
        self.stop.borrow_mut().get_or_insert(error);
        self.asked.set(self.asked.get() + 1);
    }
}

impl Watcher for Progress {
    fn begin(&mut self, to_do: u64, _there: u64) {
        self.to_do.set(to_do);
    }

    fn point(&mut self, done: u64, _row: &Row) {
        let Some(callback) = &self.callback else { return };
        let called = Python::attach(|py| callback.call1(py, (done, self.to_do.get())).map(drop));
        if let Err(error) = called {
            self.end(error);
        }
    }

    fn notice(&mut self, _text: &str) {}

    fn interrupted(&self) -> u32 {
        if let Err(error) = self.watch.look(f64::NAN) {
            self.end(error);
        }
        self.asked.get()
    }
}

impl Study {
    fn row(
        &self,
        number: u64,
        limit: Option<Duration>,
        stop: &mut dyn FnMut(f64) -> bool,
    ) -> Result<String, StudyError> {
        let mut place = self.computer.lock().unwrap_or_else(PoisonError::into_inner);
        let mut computer = match place.take() {
            Some(computer) => computer,
            None => self.computer()?,
        };
        let begin = Instant::now();
        let (row, worn) = computer.with_dependent_mut(|_, runner| {
            let computed = runner.compute(number, &mut |simulation| {
                let late = limit.is_some_and(|limit| begin.elapsed() > limit);
                match late || stop(simulation.time()) {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            });
            (computed.map(|it| it.row), runner.is_worn())
        });
        if !worn {
            *place = Some(computer);
        }
        Ok(json!(row?).to_string())
    }
}
