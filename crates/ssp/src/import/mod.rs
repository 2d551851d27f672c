//! From SSP to a scenario.

mod connections;
mod ours;
mod ports;
mod tables;
mod tree;
mod values;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use fmi2_import::description::{Causality, Type};
use serde_json::{Map, Value, json};

use crate::SspError;
use crate::annotation::Meaning;
use crate::files::{Files, write};
use crate::read::{Description, Kind};
use connections::Links;
use ours::Ours;
use ports::{Port, Ports};
use tree::Tree;
pub(crate) use tree::unique;
use values::Assigned;

/// Name of the scenario file that an import writes.
const SCENARIO: &str = "scenario.json";

/// A system that has become a scenario.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The scenario file.
    pub scenario: PathBuf,
    /// What the user should know: what was left out, what is free, what names have changed.
    pub notes: Vec<String>,
}

/// Makes a scenario of a system: an archive (.ssp), or the description of an unpacked one (.ssd).
///
/// Writes `scenario.json` into `folder`, and the units of an archive beside it. Nested systems become one. The units of
/// an unpacked system stay where they are.
///
/// # Errors
/// The files cannot be read, break the standard, or contain something that is not supported; or `folder` cannot be
/// written.
pub fn import(path: &Path, folder: &Path) -> Result<Imported, SspError> {
    let (mut files, file) = Files::open(path)?;
    let description = Description::load(&mut files, file)?;
    let tree = Tree::new(&description, &mut files, folder)?;
    let ports = Ports::new(&tree)?;
    let mut ours = Ours::read(&description, &tree, &mut files, folder)?;
    let links = Links::new(&ports)?;
    let mut notes: Vec<String> = files.warnings().cloned().collect();
    let variants = files.variants();
    if !variants.is_empty() {
        notes.push(format!(
            "variants are not used: {}; unpack the archive and give the path of one to use it",
            variants.join(", ")
        ));
    }
    let assigned = Assigned::new(&ports, &mut files)?;

    let mut scenario = Map::new();
    scenario.insert("title".to_owned(), description.name.clone().into());
    scenario.insert("description".to_owned(), description.system.description.clone().into());
    let units = tree.units.iter().map(|unit| {
        // both parts come from text
        (unit.key.clone(), Value::from(unit.path.to_string_lossy().into_owned()))
    });
    scenario.insert("units".to_owned(), units.collect::<Map<_, _>>().into());
    scenario.insert("instances".to_owned(), instances(&tree, &assigned, &mut ours).into());
    scenario.insert("connections".to_owned(), ours.with_sums(links.connections).into());
    scenario.insert("experiment".to_owned(), experiment(&description, &mut ours, &mut notes));
    let record = links.outputs.or_else(|| every_output(&tree));
    if !ours.scenario.contains_key("record")
        && let Some(signals) = record
    {
        scenario.insert("record".to_owned(), json!({ "signals": signals }));
    }
    scenario.append(&mut ours.scenario);

    let path = folder.join(SCENARIO);
    let mut text = serde_json::to_string_pretty(&scenario).unwrap_or_default();
    text.push('\n');
    write(&path, text.as_bytes())?;
    notes.append(&mut ours.notes);
    notes.extend(tree.notes.iter().cloned());
    notes.extend(assigned.notes);
    notes.extend(links.notes);
    let undefined: BTreeSet<String> =
        description.origins.iter().flat_map(|it| it.definitions.undefined.take()).collect();
    if !undefined.is_empty() {
        let names: Vec<String> = undefined.into_iter().collect();
        notes.push(format!(
            "values in {} are not converted: no Units define these units of measurement",
            names.join(", ")
        ));
    }
    notes.extend(unused(&description));
    Ok(Imported { scenario: path, notes })
}

/// The instances with their values.
fn instances(
    tree: &Tree<'_>,
    assigned: &Assigned<'_, '_, '_>,
    ours: &mut Ours,
) -> Map<String, Value> {
    let mut instances = Map::new();
    for (component, node) in tree.components.iter().enumerate() {
        let (mut parameters, mut start) = (Map::new(), Map::new());
        for (name, value) in &assigned.values[component] {
            let is_parameter = assigned.is_parameter(component, name);
            let list = if is_parameter { &mut parameters } else { &mut start };
            list.insert(name.clone(), value.clone());
        }
        let mut settings = Map::new();
        settings.insert("unit".to_owned(), tree.units[node.unit].key.clone().into());
        for (list, values) in [("parameters", parameters), ("start", start)] {
            if !values.is_empty() {
                settings.insert(list.to_owned(), values.into());
            }
        }
        let mut settings = Value::from(settings);
        if let Some(more) = ours.instances.shift_remove(&node.instance) {
            merge(&mut settings, more);
        }
        instances.insert(node.instance.clone(), settings);
    }
    instances
}

/// Puts the members of an object into another, at any depth.
fn merge(into: &mut Value, from: Value) {
    match (into, from) {
        (Value::Object(into), Value::Object(from)) => {
            for (key, value) in from {
                match into.get_mut(&key) {
                    Some(inside) => merge(inside, value),
                    None => {
                        into.insert(key, value);
                    }
                }
            }
        }
        (into, from) => *into = from,
    }
}

/// Start and stop of the description; the step of ours, otherwise of other annotations.
fn experiment(description: &Description, ours: &mut Ours, notes: &mut Vec<String>) -> Value {
    let mut experiment = match ours.scenario.shift_remove("experiment") {
        Some(Value::Object(experiment)) => experiment,
        _ => Map::new(),
    };
    for (key, value) in [("start", description.start), ("stop", description.stop)] {
        if let Some(value) = value.filter(|it| it.is_finite()) {
            experiment.insert(key.to_owned(), value.into());
        }
    }
    if !experiment.contains_key("step") {
        let step = description.annotations.iter().find_map(|it| match it.meaning {
            Meaning::Step(step) if it.within.is_empty() => Some((step, it)),
            _ => None,
        });
        if let Some((step, annotation)) = step {
            experiment.insert("step".to_owned(), step.into());
            notes.push(format!(
                "the step of {step} s is that of the annotation {} of {}",
                annotation.kind, annotation.place
            ));
        }
    }
    experiment.into()
}

/// All outputs of all components but Strings.
fn every_output(tree: &Tree<'_>) -> Option<Vec<String>> {
    let mut signals = Vec::new();
    for (component, node) in tree.components.iter().enumerate() {
        let description = tree.description(component);
        for output in description.with_causality(Causality::Output) {
            let variable = &description.variables[output];
            if variable.kind != Type::String {
                signals.push(format!("{}.{}", node.instance, variable.name));
            }
        }
    }
    (!signals.is_empty()).then_some(signals)
}

/// Annotations that are not used, by their types.
fn unused(description: &Description) -> Vec<String> {
    let mut types: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for it in &description.annotations {
        if it.meaning == Meaning::Unused {
            types.entry(&it.kind).or_default().push(&it.place);
        }
    }
    let note = |(kind, places): (&str, Vec<&str>)| match places.as_slice() {
        [place] => format!("the annotation {kind} of {place} is not used"),
        places => format!("annotations {kind} of {} elements are not used", places.len()),
    };
    types.into_iter().map(note).collect()
}

/// Whether a connector of the outermost system has this kind.
fn outer_connectors<'a>(tree: &'a Tree<'_>, kind: Kind) -> impl Iterator<Item = (Port, &'a str)> {
    let connectors = tree.systems.first().into_iter().flat_map(|it| &it.element.connectors);
    connectors
        .filter(move |it| it.kind == kind)
        .map(|it| (Port::System(0, it.name.clone()), it.name.as_str()))
}
