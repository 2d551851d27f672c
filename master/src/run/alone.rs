//! A unit that runs without a scenario: the scenario that does nothing but step it.

use std::path::Path;

use serde_json::json;

use crate::description::{Causality, Description};
use crate::error::Error;
use crate::package::Package;
use crate::pattern;
use crate::scenario::{Given, Scenario, ScenarioError, suggestions};
use crate::system::Override;

/// One unit as a scenario: an instance named after the file, with its outputs and those inputs
/// recorded that are set. What it suggests (`DefaultExperiment`) says from when to when and in which
/// steps it runs.
#[derive(Debug, Clone)]
pub struct Alone {
    /// The scenario.
    pub scenario: Scenario,
    /// The values to set, by names that a scenario knows.
    pub overrides: Vec<Override>,
}

impl Alone {
    /// Reads the unit's description. In `set`, variables may be named without the instance.
    ///
    /// # Errors
    /// The file is no unit.
    pub fn new(path: &Path, given: Given, set: &[Override]) -> Result<Self, Error> {
        let unit = Package::describe(path)?;
        let name = instance_name(path);
        let overrides: Vec<Override> = set.iter().map(|it| named(it, &name, &unit)).collect();
        let (experiment, notes) = suggestions::alone(path, &unit, given);
        let text = json!({
            "title": format!("{} alone", unit.model_name),
            "units": { &name: path },
            "instances": { &name: { "unit": &name } },
            "experiment": experiment,
            "record": { "signals": recorded(&unit, &name, &overrides) },
        });
        let mut scenario: Scenario = serde_json::from_value(text).map_err(|error| {
            let (path, at) = (path.to_owned(), "the scenario made of it".to_owned());
            ScenarioError::Json { path, at, message: error.to_string() }
        })?;
        scenario.notes = notes;
        Ok(Self { scenario, overrides })
    }
}

/// The file's name, as far as names of instances allow it.
fn instance_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String =
        stem.chars().map(|c| if c.is_control() || ".*[]".contains(c) { '_' } else { c }).collect();
    if name.is_empty() { "unit".to_owned() } else { name }
}

/// The value for a variable of the instance, whether or not the instance is named.
fn named(it: &Override, instance: &str, unit: &Description) -> Override {
    let own = it.target.strip_prefix(instance).and_then(|rest| rest.strip_prefix('.'));
    let target = match own {
        // a structured name may begin like the instance's
        Some(_) if unit.find(&it.target).is_none() => it.target.clone(),
        _ => format!("{instance}.{}", it.target),
    };
    Override { target, value: it.value.clone() }
}

/// The signals of interest.
fn recorded(unit: &Description, instance: &str, overrides: &[Override]) -> Vec<String> {
    let name = |&index: &usize| format!("{instance}.{}", unit.variables[index].name);
    let is_set = |input: &String| {
        let fits = |name: &String| name == input || pattern::matches(name, input);
        overrides
            .iter()
            .any(|it| pattern::expand(&it.target).is_ok_and(|names| names.iter().any(fits)))
    };
    let outputs = unit.with_causality(Causality::Output).collect::<Vec<_>>();
    let inputs = unit.with_causality(Causality::Input).collect::<Vec<_>>();
    outputs.iter().map(name).chain(inputs.iter().map(name).filter(is_set)).collect()
}
