//! The scenario for a unit that runs alone.

use std::path::Path;

use serde_json::json;

use crate::{GivenTimes, Override, Scenario, ScenarioError, suggestions};
use fmi2_import::description::{Causality, ModelDescription};

/// Makes a scenario of one unit: an instance named after the file. Its outputs are recorded, and the inputs that `set`
/// changes. Start, stop and step come from its `DefaultExperiment`. Names in `set` may omit the instance.
///
/// # Errors
/// The scenario is invalid.
pub fn alone(
    path: &Path,
    unit: &ModelDescription,
    given: GivenTimes,
    set: &[Override],
) -> Result<Scenario, ScenarioError> {
    let name = instance_name(path);
    let overrides: Vec<Override> = set.iter().map(|it| named(it, &name, unit)).collect();
    let (experiment, notes) = suggestions::alone(path, unit, given);
    let text = json!({
        "title": format!("{} alone", unit.model_name),
        "units": { &name: path },
        "instances": { &name: { "unit": &name } },
        "experiment": experiment,
        "record": { "signals": recorded(unit, &name, &overrides) },
    });
    let mut scenario: Scenario = serde_json::from_value(text).map_err(|error| {
        let (path, at) = (path.to_owned(), "the scenario of this unit alone".to_owned());
        ScenarioError::Json { path, at, message: error.to_string() }
    })?;
    scenario.notes = notes;
    scenario.overrides = overrides;
    Ok(scenario)
}

/// The file name without the characters that instance names cannot have.
fn instance_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String =
        stem.chars().map(|c| if c.is_control() || ".*[]".contains(c) { '_' } else { c }).collect();
    if name.is_empty() { "unit".to_owned() } else { name }
}

/// The override with the instance's name in front, if it is not there yet.
fn named(it: &Override, instance: &str, unit: &ModelDescription) -> Override {
    let own = it.target.strip_prefix(instance).and_then(|rest| rest.strip_prefix('.'));
    let target = match own {
        // the unit may have a variable whose structured name starts like the instance
        Some(_) if unit.find(&it.target).is_none() => it.target.clone(),
        _ => format!("{instance}.{}", it.target),
    };
    Override { target, value: it.value.clone() }
}

/// The signals to record: all outputs, and the inputs that are set.
fn recorded(unit: &ModelDescription, instance: &str, overrides: &[Override]) -> Vec<String> {
    let name = |&index: &usize| format!("{instance}.{}", unit.variables[index].name);
    let is_set = |input: &String| {
        let fits = |name: &String| name == input || patterns::matches(name, input);
        overrides
            .iter()
            .any(|it| patterns::expand(&it.target).is_ok_and(|names| names.iter().any(fits)))
    };
    let outputs = unit.with_causality(Causality::Output).collect::<Vec<_>>();
    let inputs = unit.with_causality(Causality::Input).collect::<Vec<_>>();
    outputs.iter().map(name).chain(inputs.iter().map(name).filter(is_set)).collect()
}
