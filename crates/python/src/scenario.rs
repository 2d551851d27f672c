//! A scenario that Python changes and runs.

use std::path::{Path, PathBuf};

use fmi2_import::package::Package;
use maglev::run::Job;
use master::Setup;
use pyo3::prelude::*;
use results::RunResults;
use scenario::{GivenTimes, Override};

use crate::error::Failure;
use crate::linearized::{self, Model};
use crate::recording::{Recorded, Values};
use crate::running::{self, Running};
use crate::simulation::Simulation;
use crate::table::Table;
use crate::values::{self, whole};
use crate::watch::Watch;

/// A scenario with the values that replace those of its file. It never changes: methods return new ones.
#[pyclass(frozen, module = "maglev_cosim._native")]
pub struct Scenario {
    pub(crate) scenario: scenario::Scenario,
    name: String,
}

impl Scenario {
    /// Makes the paths of units absolute, so that they are valid in other folders and processes.
    pub(crate) fn new(mut scenario: scenario::Scenario, name: String) -> Self {
        for unit in scenario.units.values_mut() {
            let Ok(()) = unit.map_paths(|path| Ok::<_, std::convert::Infallible>(whole(path)));
        }
        // for editors of the file
        scenario.schema = None;
        Self { scenario, name }
    }
}

#[pymethods]
impl Scenario {
    /// Reads a scenario file, or an .fmu file that runs alone.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let read = py.detach(|| {
            if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("fmu")) {
                let unit = Package::describe(&path)?;
                let alone = scenario::alone(&path, &unit, GivenTimes::default(), &[]);
                alone.map_err(maglev::Error::from)
            } else {
                scenario::Scenario::load(&path).map_err(maglev::Error::from)
            }
        });
        Ok(Self::new(read.map_err(Failure::from)?, name))
    }

    /// Reads the text of a scenario. Paths are relative to the folder.
    #[staticmethod]
    fn parse(text: &str, folder: PathBuf, name: String) -> PyResult<Self> {
        let file = folder.join(format!("{name}.json"));
        let read = scenario::Scenario::read(text, &file);
        Ok(Self::new(read.map_err(Failure::from)?, name))
    }

    /// The scenario with a change, the text of a file in the folder that extends it.
    fn changed(&self, change: &str, folder: PathBuf) -> PyResult<Self> {
        let mut changed = self.scenario.changed(change, &folder).map_err(Failure::from)?;
        let value = serde_json::from_str::<serde_json::Value>(change);
        if value.is_ok_and(|it| it.get("experiment").is_some()) {
            // notes are about times that were completed when the file was read
            changed.notes.clear();
        }
        Ok(Self::new(changed, self.name.clone()))
    }

    /// The scenario with a value for a parameter or start value.
    fn set(&self, target: String, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut scenario = self.scenario.clone();
        let value = values::text(&values::setting(value)?);
        scenario.overrides.push(Override { target, value });
        Ok(Self { scenario, name: self.name.clone() })
    }

    /// Name of the file without its extension.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// The scenario as JSON, without the values that were set.
    fn json(&self) -> PyResult<String> {
        let text = serde_json::to_string(&self.scenario);
        Ok(text.map_err(|error| Failure::input(error.to_string(), None))?)
    }

    /// The values that were set, as texts.
    fn settings(&self) -> Vec<(String, String)> {
        let overrides = self.scenario.overrides.iter();
        overrides.map(|it| (it.target.clone(), it.value.clone())).collect()
    }

    /// Checks everything that can be checked without calling a unit; returns the names of the recorded signals.
    fn check(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let setup = py.detach(|| Setup::new(&self.scenario)).map_err(Failure::from)?;
        Ok(setup.signals().collect())
    }

    /// Variables that a name with ranges and stars selects: name, unit, causality, variability, start, description.
    fn variables(&self, py: Python<'_>, pattern: &str) -> PyResult<String> {
        let found = py.detach(|| {
            let setup = Setup::new(&self.scenario)?;
            let system = setup.system();
            let ports = system.select(&format!("variables {pattern}"), pattern)?;
            let rows = ports.into_iter().map(|port| {
                let variable = system.variable(port);
                let instance = &system.instances[port.instance];
                let set = instance.parameters.get(&port.variable);
                let set = set.or_else(|| instance.inputs.get(&port.variable));
                serde_json::json!({
                    "name": system.port_name(port),
                    "unit": variable.unit,
                    "causality": variable.causality,
                    "variability": variable.variability,
                    "type": variable.kind,
                    "start": set.or(variable.start.as_ref()),
                    "description": variable.description,
                })
            });
            Ok::<_, master::Error>(serde_json::Value::from(rows.collect::<Vec<_>>()).to_string())
        });
        Ok(found.map_err(Failure::from)?)
    }

    /// Loads and initializes the units. If the scenario asks for an accuracy, step and algorithm are chosen first.
    fn start(&self, py: Python<'_>) -> PyResult<Simulation> {
        let watch = Watch::new(None);
        let running = py.detach(move || Running::start(&self.scenario, &watch))?;
        Ok(Simulation::new(running))
    }

    /// The scenario with step and algorithm chosen for its accuracy, and how they were chosen, as JSON.
    fn choose(&self, py: Python<'_>) -> PyResult<(Self, String)> {
        let watch = Watch::new(None);
        let Some(choice) = py.detach(move || running::choose(&self.scenario, &watch))? else {
            let text = "the scenario asks for no accuracy";
            let help = "give it the key \"accuracy\", such as change({\"accuracy\": 1e-4})";
            return Err(Failure::input(text, Some(help)).into());
        };
        let report = serde_json::to_string(&choice.report);
        let report = report.map_err(|error| Failure::input(error.to_string(), None))?;
        Ok((Self { scenario: choice.scenario, name: self.name.clone() }, report))
    }

    /// The modes of the coupled system, as JSON.
    fn modes(&self, py: Python<'_>) -> PyResult<String> {
        Ok(py.detach(|| linearized::modes(&self.scenario))?)
    }

    /// An instance as a linear system: A, B, C, D; states, inputs, outputs.
    fn linear_unit(&self, py: Python<'_>, instance: &str) -> PyResult<Model> {
        Ok(py.detach(|| linearized::unit(&self.scenario, instance))?)
    }

    /// The coupled system as a linear system.
    fn linear_system(
        &self,
        py: Python<'_>,
        inputs: Option<Vec<String>>,
        outputs: Option<Vec<String>>,
    ) -> PyResult<Model> {
        let model = py
            .detach(|| linearized::coupled(&self.scenario, inputs.as_deref(), outputs.as_deref()));
        Ok(model?)
    }

    /// Runs to the end and writes a results folder, also if it fails or is interrupted. Returns notes on the run.
    fn run_into(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        report: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Vec<String>> {
        let mut watch = Watch::new(progress);
        let job = Job { scenario: &self.scenario, name: &self.name, folder: &folder };
        let (done, watch) = py.detach(move || {
            let done = job.run(&mut watch);
            (done, watch)
        });
        let (stopped, mut notes) = watch.finish();
        let started = done.as_ref().map_or_else(|error| error.exit_status() == 1, |_| true);
        if report && started {
            notes.extend(py.detach(|| write_report(&folder)));
        }
        match stopped {
            Some(error) => Err(error),
            None => Ok(done.map(|_| notes).map_err(Failure::from)?),
        }
    }
}

/// Makes the report of a results folder. A run does not fail if its report does.
fn write_report(folder: &Path) -> Option<String> {
    let made = RunResults::read(folder)
        .map_err(report::ReportError::from)
        .and_then(|run| report::write(&[run], &folder.join(results::REPORT)));
    let error = made.err()?;
    Some(format!("cannot make the report: {}", error.chain().join(": ")))
}

/// Reads a results folder: the signals that are numbers, and the content of summary.json.
#[pyfunction]
pub fn read_results(py: Python<'_>, folder: PathBuf) -> PyResult<(Table, String)> {
    let read = py.detach(|| RunResults::read(&folder));
    let run = read.map_err(|error| Failure::of_results(&error))?;
    let RunResults { table, summary, signals, .. } = run;
    let columns = table.names.into_iter().zip(table.columns).map(|(name, values)| {
        let unit = signals.get(&name).and_then(|it| it.unit.clone());
        Recorded { name, unit, values: Values::Numbers(values) }
    });
    let made = Table::new(table.time, columns.collect());
    let made = made.map_err(|error| Failure::input(error.to_string(), None))?;
    Ok((made, summary.to_string()))
}
