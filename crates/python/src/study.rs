//! Studies: their points, and the computation of one point in this process.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use self_cell::self_cell;
use serde_json::json;
use study::{FactorValue, Runner, StudyError, StudyFile};

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
        self.study.columns().into_iter().map(|column| column.name).collect()
    }

    /// The values of a point, counted from 1, in the order of the factors.
    fn point(&self, number: u64) -> PyResult<Vec<crate::values::Value>> {
        let point = self.study.point(number).map_err(|it| Failure::of_study(&it))?;
        Ok(point.values.into_iter().map(Into::into).collect())
    }

    /// The scenario of a point.
    fn scenario(&self, py: Python<'_>, number: u64) -> PyResult<Scenario> {
        let made = py.detach(|| Runner::starting_with(&self.study, number)?.scenario(number));
        let name = format!("{}-{number}", self.study.name());
        Ok(Scenario::new(made.map_err(|it| Failure::of_study(&it))?, name))
    }

    /// Computes a point in this process; returns its row as JSON. A point that fails is a row with its status.
    fn compute(&self, py: Python<'_>, number: u64) -> PyResult<String> {
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
