//! A simulation that Python steps.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{self, ThreadId};

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use results::summary::Status;
use serde_json::json;

use crate::error::Failure;
use crate::running::{Halt, Running};
use crate::table::Table;
use crate::values::{self, Value};
use crate::watch::Watch;

/// Communication points closer together than this fraction of the step are one.
const SAME: f64 = 1e-6;

/// A running co-simulation.
#[pyclass(frozen, module = "maglev_cosim._native")]
pub struct Simulation {
    running: Mutex<Running>,
    /// the thread that works on it
    holder: Mutex<Option<ThreadId>>,
}

impl Simulation {
    pub fn new(running: Running) -> Self {
        Self { running: Mutex::new(running), holder: Mutex::new(None) }
    }

    /// Works on the simulation without the interpreter's lock. Other threads wait.
    fn work<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Running) -> T + Send,
    ) -> Result<T, Failure> {
        py.detach(|| {
            let me = thread::current().id();
            if *lock(&self.holder) == Some(me) {
                let text =
                    "the simulation cannot be used by a function that it calls while it steps";
                return Err(Failure::input(text, Some("use the time that the function gets")));
            }
            let mut running = lock(&self.running);
            *lock(&self.holder) = Some(me);
            let done = work(&mut running);
            *lock(&self.holder) = None;
            Ok(done)
        })
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[pymethods]
impl Simulation {
    /// The time that has been reached (s).
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.work(py, |running| running.setup().time_after(running.done()))?)
    }

    /// Finished communication steps, and those until the stop time.
    fn steps(&self, py: Python<'_>) -> PyResult<(u64, u64)> {
        Ok(self.work(py, |running| running.with(|_, it| (it.done(), it.remaining())))?)
    }

    /// Makes so many steps, fewer if the run ends; all that remain by default.
    #[pyo3(signature = (count = None, progress = None))]
    fn step(
        &self,
        py: Python<'_>,
        count: Option<u64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<()> {
        let watch = Watch::new(progress);
        let stepped = self.work(py, move |running| {
            let done = count.map_or(u64::MAX, |it| running.done().saturating_add(it));
            running.advance(done, &watch)
        })?;
        Ok(stepped?)
    }

    /// Goes to the first communication point at or after a time (s), also back in time.
    fn go_to(&self, py: Python<'_>, time: f64) -> PyResult<()> {
        let watch = Watch::new(None);
        let gone = self.work(py, move |running| {
            let experiment = running.setup().scenario().experiment;
            let point = ((time - experiment.start) / experiment.step - SAME).ceil().max(0.0);
            let (first, last) = (experiment.start, experiment.stop);
            let slack = SAME * experiment.step;
            if !(first - slack..=last + slack).contains(&time) {
                let text = format!(
                    "{time} s is not between the start and the stop, {first} s and {last} s"
                );
                return Err(Halt::Failed(Failure::input(text, None)));
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to 2^53"
            )]
            let point = (point as u64).min(running.setup().steps());
            if point < running.done() {
                running.rewind(point)?;
            }
            running.advance(point, &watch)
        })?;
        Ok(gone?)
    }

    /// Present values by name, in the variables' own units of measure. The name may have ranges and stars.
    fn get(&self, py: Python<'_>, name: &str) -> PyResult<Vec<(String, Value)>> {
        let values = self.work(py, |running| {
            running.with(|setup, simulation| {
                let system = setup.system();
                let ports =
                    system.select(&format!("get {name}"), name).map_err(master::Error::from)?;
                let time = simulation.time();
                let value = |port| {
                    let value = values::read(simulation, system, port);
                    let value = value.map_err(|source| master::Error::Step { time, source })?;
                    Ok((system.port_name(port), value))
                };
                ports.into_iter().map(value).collect::<Result<_, master::Error>>()
            })
        })?;
        Ok(values.map_err(Failure::from)?)
    }

    /// Sets tunable parameters or unconnected inputs, from the next step on.
    fn set(&self, py: Python<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let setting = values::setting(value)?;
        let set = self.work(py, |running| running.with(|_, it| it.set(name, &setting)))?;
        Ok(set.map_err(Failure::from)?)
    }

    /// The present state of units and couplings.
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let state = self.work(py, Running::save)??;
        let bytes = postcard::to_stdvec(&state);
        let bytes = bytes.map_err(|error| Failure::input(error.to_string(), None))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Continues from a state that a simulation of the same scenario has saved.
    fn restore(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        let state = postcard::from_bytes(state)
            .map_err(|_| Failure::input("these bytes are not the state of a simulation", None))?;
        Ok(self.work(py, |running| running.restore(&state))??)
    }

    /// Terminates the units.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        Ok(self.work(py, Running::close)??)
    }

    /// What has been recorded so far, as a copy; `take`: without one, and the recording is empty after that.
    #[pyo3(signature = (take = false))]
    fn table(&self, py: Python<'_>, take: bool) -> PyResult<Table> {
        let made = self.work(py, |running| {
            let recording = &mut running.recording;
            let (time, columns) = if take { recording.take_columns() } else { recording.columns() };
            Table::new(time, columns)
        })?;
        Ok(made.map_err(|error| Failure::input(error.to_string(), None))?)
    }

    /// How the run went so far, as JSON.
    fn outcome(&self, py: Python<'_>) -> PyResult<String> {
        let outcome = self.work(py, |running| {
            let (done, setup) = (running.done(), running.setup());
            let (status, why) = match &running.end {
                Some((status, why)) => (json!(status), why.clone()),
                None if done == 0 => (json!("started"), None),
                None => (json!("running"), None),
            };
            let failed = matches!(running.end, Some((Status::Failed, _)));
            json!({
                "title": setup.scenario().title,
                "status": status,
                "ended_by": if failed { None } else { why.clone() },
                "error": if failed { why } else { None },
                "steps": done,
                "reached": setup.time_after(done),
                "stop": setup.scenario().experiment.stop,
                "step": setup.scenario().experiment.step,
                "algorithm": {
                    "name": setup.scenario().algorithm.name.as_str(),
                    "accuracy": running.accuracy,
                },
                "events": running.events,
                "notes": running.notes,
                "messages": running.messages,
                "metrics": running.verdicts,
                "ride_quality": running.ride,
            })
            .to_string()
        });
        Ok(outcome?)
    }
}
