//! Writes scenario-as-run.json into the results folder. It is not called scenario.json because that may be
//! the name of the scenario file.

use std::collections::HashMap;
use std::io;
use std::path::{Path, absolute};

use indexmap::IndexMap;
use serde::Serialize;

use fmi2_import::description::{Causality, Variable};
use master::system::{InstanceIndex, System};
use results::{AS_RUN, write_whole};
use scenario::{InstanceSettings, Scenario, Setting};

/// Writes the scenario as run into a results folder, with the identifier of the run in a comment.
///
/// # Errors
/// The file cannot be written.
pub fn write(run: &str, scenario: &Scenario, system: &System, folder: &Path) -> io::Result<()> {
    let text = text(Some(run), scenario, system)?;
    write_whole(&folder.join(AS_RUN), text.as_bytes())
}

/// The text of a scenario with the changes of the command line: their values are those of the instances, and paths of
/// units and of their resources are absolute. Running it again gives the same results. If there is an identifier of the
/// run, a comment contains it.
///
/// # Errors
/// There is no working directory.
pub fn text(run: Option<&str>, scenario: &Scenario, system: &System) -> io::Result<String> {
    let mut scenario = scenario.clone();
    // the path would be relative to the scenario file
    scenario.schema = None;
    // running it again must not overwrite the trace of this run
    scenario.trace = None;
    for unit in scenario.units.values_mut() {
        unit.map_paths(|path| absolute(path))?;
    }
    if !system.overridden.is_empty() {
        scenario.instances = merged(&scenario.instances, system);
    }
    let comment = run.map(|run| format!("run {run}"));
    let mut text = serde_json::to_string_pretty(&Marked { comment, scenario: &scenario })?;
    text.push('\n');
    Ok(text)
}

/// A scenario with the identifier of its run.
#[derive(Serialize)]
struct Marked<'a> {
    #[serde(rename = "$comment", skip_serializing_if = "Option::is_none")]
    comment: Option<String>,
    #[serde(flatten)]
    scenario: &'a Scenario,
}

/// Instances with the values of the command line. An array of instances is split if their values differ.
fn merged(
    entries: &IndexMap<String, InstanceSettings>,
    system: &System,
) -> IndexMap<String, InstanceSettings> {
    let changes = changes(system);
    let mut merged = IndexMap::new();
    for (pattern, entry) in entries {
        // the system was built from these names, so they are valid
        let names = patterns::expand(pattern).unwrap_or_default();
        let mut members = names.iter().map(|name| {
            let changes = system.find(name).and_then(|index| changes.get(&index));
            changed(entry, changes.map_or(&[], Vec::as_slice))
        });
        let first = members.next();
        let members: Vec<InstanceSettings> = first.into_iter().chain(members).collect();
        if members.windows(2).all(|pair| pair[0] == pair[1]) {
            merged.extend(members.into_iter().next().map(|it| (pattern.clone(), it)));
        } else {
            merged.extend(names.into_iter().zip(members));
        }
    }
    merged
}

/// Values from the command line for each instance, in their order.
fn changes(system: &System) -> HashMap<InstanceIndex, Vec<(&Variable, &Setting)>> {
    let mut changes: HashMap<InstanceIndex, Vec<_>> = HashMap::new();
    for it in &system.overridden {
        let change = (system.variable(it.port), &it.setting);
        changes.entry(it.port.instance).or_default().push(change);
    }
    changes
}

/// An instance with its values of the command line.
fn changed(entry: &InstanceSettings, changes: &[(&Variable, &Setting)]) -> InstanceSettings {
    let mut entry = entry.clone();
    for (variable, setting) in changes {
        let list = match variable.causality {
            Causality::Parameter => &mut entry.parameters,
            _ => &mut entry.start,
        };
        // the last value counts, also after a pattern
        list.shift_remove(&variable.name);
        list.insert(variable.name.clone(), (*setting).clone());
    }
    entry
}
