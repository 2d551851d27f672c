//! A unit that runs without a scenario: the scenario that does nothing but step it.

use std::path::Path;

use serde_json::json;

use crate::{GivenTimes, Override, Scenario, ScenarioError, suggestions};
use fmi2_import::description::{Causality, ModelDescription};

/// Makes a scenario of one unit: an instance named after the file, with its outputs recorded, and those
/// inputs that are set. Its `DefaultExperiment` says from when to when and in which steps it runs. In `set`,
/// variables may be named without the instance.
///
/// # Errors
/// The parts do not make a valid scenario.
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
        let (path, at) = (path.to_owned(), "the scenario made of it".to_owned());
        ScenarioError::Json { path, at, message: error.to_string() }
    })?;
    scenario.notes = notes;
    scenario.overrides = overrides;
    Ok(scenario)
}

/// The file's name, as far as names of instances allow it.
fn instance_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String =
        stem.chars().map(|c| if c.is_control() || ".*[]".contains(c) { '_' } else { c }).collect();
    if name.is_empty() { "unit".to_owned() } else { name }
}

/// The value for a variable of the instance, whether or not the instance is named.
fn named(it: &Override, instance: &str, unit: &ModelDescription) -> Override {
    let own = it.target.strip_prefix(instance).and_then(|rest| rest.strip_prefix('.'));
    let target = match own {
        // a structured name may begin like the instance's
        Some(_) if unit.find(&it.target).is_none() => it.target.clone(),
        _ => format!("{instance}.{}", it.target),
    };
    Override { target, value: it.value.clone() }
}

/// The signals of interest.
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
