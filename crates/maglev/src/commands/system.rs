//! Whole systems in SSP archives: what `inspect` and `validate` say about them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use fmi2_import::description::Severity;
use fmi2_import::scratch::Scratch;
use maglev::Error;
use master::system::System;
use scenario::{GivenTimes, Scenario, ScenarioError};

use super::table::table;
use super::validate::{lines, status, totals};

/// Times for a system that is not run.
const NONE: GivenTimes = GivenTimes { stop: Some(0.0), step: Some(0.0) };

/// A temporary folder.
pub fn scratch() -> Result<Scratch, Error> {
    Scratch::new().map_err(Error::Temporary)
}

/// A scenario file: one that was given, or that of a system.
pub struct Opened {
    pub path: PathBuf,
    notes: Vec<String>,
    /// Where the units of the system are.
    _scratch: Option<Scratch>,
}

impl Opened {
    /// Of a system (.ssp, .ssd), the scenario and the units are written into the folder `system` of the results, or a
    /// temporary one that lives as long as this.
    pub fn new(path: &Path, results: Option<&Path>) -> Result<Self, Error> {
        if !ssp::is_system(path) {
            return Ok(Self { path: path.to_owned(), notes: Vec::new(), _scratch: None });
        }
        let scratch = if results.is_none() { Some(scratch()?) } else { None };
        let folder = match (&scratch, results) {
            (Some(scratch), _) => scratch.path().to_owned(),
            (None, results) => results.unwrap_or(Path::new("")).join("system"),
        };
        let imported = ssp::import(path, &folder)?;
        Ok(Self { path: imported.scenario, notes: imported.notes, _scratch: scratch })
    }

    /// The scenario, with notes on what was read of a system.
    pub fn load(&self, given: GivenTimes) -> Result<Scenario, Error> {
        let mut scenario = Scenario::load_with(&self.path, given)?;
        scenario.notes.splice(0..0, self.notes.iter().cloned());
        Ok(scenario)
    }
}

/// Prints what a system consists of, or the scenario that it becomes.
pub fn inspect(path: &Path, as_json: bool) -> Result<ExitCode, Error> {
    let folder = scratch()?;
    let imported = ssp::import(path, folder.path())?;
    if as_json {
        let text = std::fs::read_to_string(&imported.scenario);
        let path = imported.scenario.clone();
        return super::print(&text.map_err(|source| Error::Write { path, source })?);
    }
    // times that are missing come from the units, if these have any
    let scenario = match Scenario::load_with(&imported.scenario, GivenTimes::default()) {
        Err(ScenarioError::NotSuggested { .. }) => Scenario::load_with(&imported.scenario, NONE)?,
        other => other?,
    };
    let mut page = format!("{}\n", scenario.title);
    // writing to a String cannot fail, also below
    if !scenario.description.is_empty() {
        let _ = writeln!(page, "{}", scenario.description);
    }
    let rows = scenario.instances.iter().map(|(name, instance)| {
        let values = instance.parameters.len() + instance.start.len();
        vec![name.clone(), instance.unit.clone(), format!("{values} values")]
    });
    let _ = write!(page, "\nComponents\n{}", table(rows, &[]));
    let experiment = scenario.experiment;
    let _ = writeln!(page, "\n{} connections", scenario.connections.len());
    if experiment.step > 0.0 {
        let (start, stop, step) = (experiment.start, experiment.stop, experiment.step);
        let _ = writeln!(page, "from {start} s to {stop} s, step {step} s");
    } else {
        page += "neither the system nor its units give all of stop time and step; use --stop and --step\n";
    }
    for note in imported.notes.iter().chain(&scenario.notes) {
        let _ = writeln!(page, "note: {note}");
    }
    super::print(&page)
}

/// Checks a system: that it makes a scenario whose connections and values fit, and each of its units by the rules.
pub fn validate(path: &Path, as_json: bool) -> Result<ExitCode, Error> {
    let folder = scratch()?;
    let imported = ssp::import(path, folder.path())?;
    let scenario = Scenario::load_with(&imported.scenario, NONE)?;
    System::new(&scenario).map_err(master::Error::from)?;
    let mut all = Vec::new();
    let mut text = String::new();
    let mut found = serde_json::Map::new();
    for (name, unit) in &scenario.units {
        let findings = fmi2_conformance::check(&unit.fmu)?;
        for line in lines(&findings).lines() {
            let _ = writeln!(text, "{name}: {line}");
        }
        found.insert(name.clone(), serde_json::to_value(&findings).unwrap_or_default());
        all.extend(findings);
    }
    for note in &imported.notes {
        let _ = writeln!(text, "note: {note}");
    }
    let count = |severity| all.iter().filter(|it| it.severity == severity).count();
    if as_json {
        let report = serde_json::json!({ "notes": imported.notes, "units": found });
        text = serde_json::to_string_pretty(&report).unwrap_or_default() + "\n";
    } else {
        let (shown, total) = (path.display(), totals(count));
        let _ = writeln!(text, "{shown}: {total} in {} units", scenario.units.len());
    }
    super::print(&text)?;
    Ok(status(count(Severity::Error)))
}
