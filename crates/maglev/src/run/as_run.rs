//! scenario-as-run.json in the folder of results. It is not called scenario.json because that may be the
//! file that is run.

use std::collections::HashMap;
use std::io;
use std::path::{Path, absolute};

use indexmap::IndexMap;
use serde::Serialize;

use fmi2_import::description::{Causality, Variable};
use master::system::System;
use results::{AS_RUN, write_whole};
use scenario::{Instance, Scenario, Setting};

/// Writes the scenario with everything in it that came from outside: values given on the command
/// line stand with the instances, paths of units are absolute. To run it again gives the same
/// results. A comment holds the run's identifier.
///
/// # Errors
/// The file cannot be written.
pub(super) fn write(
    run: &str,
    scenario: &Scenario,
    system: &System,
    folder: &Path,
) -> io::Result<()> {
    let mut scenario = scenario.clone();
    // where the schema is from here is not known
    scenario.schema = None;
    // to run it again shall not overwrite the trace of this run
    scenario.trace = None;
    for path in scenario.units.values_mut() {
        *path = absolute(&*path)?;
    }
    if !system.overridden.is_empty() {
        scenario.instances = merged(&scenario.instances, system);
    }
    let marked = Marked { comment: format!("run {run}"), scenario: &scenario };
    let mut text = serde_json::to_string_pretty(&marked)?;
    text.push('\n');
    write_whole(&folder.join(AS_RUN), text.as_bytes())
}

/// A scenario with a mark.
#[derive(Serialize)]
struct Marked<'a> {
    #[serde(rename = "$comment")]
    comment: String,
    #[serde(flatten)]
    scenario: &'a Scenario,
}

/// Instances with the values of the command line. An entry that stands for several stays one where
/// all got the same.
fn merged(entries: &IndexMap<String, Instance>, system: &System) -> IndexMap<String, Instance> {
    let changes = changes(system);
    let mut merged = IndexMap::new();
    for (pattern, entry) in entries {
        // a system was made of these names, so they expand
        let names = patterns::expand(pattern).unwrap_or_default();
        let mut members = names.iter().map(|name| {
            let changes = system.find(name).and_then(|index| changes.get(&index));
            changed(entry, changes.map_or(&[], Vec::as_slice))
        });
        let first = members.next();
        let members: Vec<Instance> = first.into_iter().chain(members).collect();
        if members.windows(2).all(|pair| pair[0] == pair[1]) {
            merged.extend(members.into_iter().next().map(|it| (pattern.clone(), it)));
        } else {
            merged.extend(names.into_iter().zip(members));
        }
    }
    merged
}

/// What the command line gives each instance, in its order: variable and value.
fn changes(system: &System) -> HashMap<usize, Vec<(&Variable, &Setting)>> {
    let mut changes: HashMap<usize, Vec<_>> = HashMap::new();
    for it in &system.overridden {
        let change = (system.variable(it.port), &it.setting);
        changes.entry(it.port.instance).or_default().push(change);
    }
    changes
}

/// An instance with its values of the command line.
fn changed(entry: &Instance, changes: &[(&Variable, &Setting)]) -> Instance {
    let mut entry = entry.clone();
    for (variable, setting) in changes {
        let list = match variable.causality {
            Causality::Parameter => &mut entry.parameters,
            _ => &mut entry.start,
        };
        // the last one counts, also after a pattern
        list.shift_remove(&variable.name);
        list.insert(variable.name.clone(), (*setting).clone());
    }
    entry
}
