//! Our own annotation: the parts of a scenario that SSP cannot say.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::tree::Tree;
use crate::SspError;
use crate::annotation::{Meaning, TYPE};
use crate::files::Files;
use crate::read::Description;
use crate::xml::At;

/// Keys of a scenario that an annotation must not have: the description has them, or they would touch other files.
const FORBIDDEN: [&str; 6] = ["$schema", "extends", "units", "connections", "trace", "title"];

/// The parts of a scenario in the annotation.
#[derive(Default)]
pub(super) struct Ours {
    /// Members of the scenario.
    pub(super) scenario: Map<String, Value>,
    /// Settings of instances.
    pub(super) instances: Map<String, Value>,
    /// Connections with several sources.
    sums: Vec<Sum>,
    pub(super) notes: Vec<String>,
}

/// A connection with several sources, which SSP does not have.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sum {
    /// Number of connections of the description before it.
    after: usize,
    connection: Value,
}

impl Ours {
    /// Reads the annotations: that of the description, and of those that it takes systems from. Of the latter only
    /// settings of instances and sums are used.
    pub(super) fn read(
        description: &Description,
        tree: &Tree<'_>,
        files: &mut Files,
        folder: &Path,
    ) -> Result<Self, SspError> {
        let mut ours = Self::default();
        for annotation in &description.annotations {
            let Meaning::Ours(text) = &annotation.meaning else { continue };
            let place = format!("annotation {TYPE} of {}", annotation.place);
            let at = At { file: tree.file(annotation.origin), place: &place };
            let invalid =
                |error: serde_json::Error| at.invalid(format!("it is not as expected: {error}"));
            let mut part: Map<String, Value> = serde_json::from_str(text).map_err(invalid)?;
            for key in FORBIDDEN {
                if part.contains_key(key) {
                    return Err(at.invalid(format!("the member \"{key}\" is not allowed there")));
                }
            }
            // the instance of a component of this description
            let within = |name: &str| {
                let path = format!("{}{name}", annotation.within);
                let found = tree.components.iter().find(|it| it.path == path);
                found.map_or(path, |it| it.instance.clone())
            };
            let mut instances = Map::new();
            if let Some(found) = part.shift_remove("instances") {
                let found: Map<String, Value> = serde_json::from_value(found).map_err(invalid)?;
                instances.extend(found.into_iter().map(|(name, it)| (within(&name), it)));
            }
            let mut sums: Vec<Sum> = Vec::new();
            if let Some(found) = part.shift_remove("sums") {
                sums = serde_json::from_value(found).map_err(invalid)?;
            }
            let known = |name: &String| tree.components.iter().any(|it| it.instance == *name);
            if let Some(name) = instances.keys().find(|name| !known(name)) {
                return Err(at.invalid(format!("there is no component \"{name}\"")));
            }
            if instances.values().any(|it| it.get("unit").is_some()) {
                return Err(at.invalid("the member \"unit\" is not allowed in instances"));
            }
            let base = &tree.origins[annotation.origin].file;
            let mut move_file = |path: &mut Value| -> Result<(), SspError> {
                let Some(text) = path.as_str() else { return Ok(()) };
                let name = files.resolve(base, text, &place)?;
                *path = files.place(&name, folder, &place)?.to_string_lossy().into_owned().into();
                Ok(())
            };
            place_values(&mut instances, &mut move_file)?;
            ours.instances.append(&mut instances);
            if annotation.within.is_empty() {
                place_inputs(&mut part, &mut move_file)?;
                ours.scenario = part;
                ours.sums.append(&mut sums);
                continue;
            }
            for mut sum in sums {
                rename(&mut sum.connection, &within);
                ours.sums.push(Sum { after: usize::MAX, ..sum });
            }
            part.shift_remove("experiment");
            if !part.is_empty() {
                let keys: Vec<&str> = part.keys().map(String::as_str).collect();
                ours.notes.push(format!(
                    "{}: settings of the system that is used here as a part are not used: {}",
                    at.file,
                    keys.join(", ")
                ));
            }
        }
        Ok(ours)
    }

    /// The connections of the description, with the sums at their places between them.
    pub(super) fn with_sums(&mut self, mut connections: Vec<Value>) -> Vec<Value> {
        let mut sums = std::mem::take(&mut self.sums);
        sums.sort_by_key(|sum| sum.after);
        for sum in sums.into_iter().rev() {
            let at = sum.after.min(connections.len());
            connections.insert(at, sum.connection);
        }
        connections
    }
}

/// Puts the files that values name into their folder.
fn place_values(
    instances: &mut Map<String, Value>,
    move_file: &mut impl FnMut(&mut Value) -> Result<(), SspError>,
) -> Result<(), SspError> {
    for settings in instances.values_mut() {
        for list in ["parameters", "start"] {
            let values = settings.get_mut(list).and_then(Value::as_object_mut);
            for value in values.into_iter().flat_map(Map::values_mut) {
                if let Some(path) = value.get_mut("path") {
                    move_file(path)?;
                }
            }
        }
    }
    Ok(())
}

/// Puts the files of inputs over time into their folder.
fn place_inputs(
    scenario: &mut Map<String, Value>,
    move_file: &mut impl FnMut(&mut Value) -> Result<(), SspError>,
) -> Result<(), SspError> {
    let inputs = scenario.get_mut("inputs").and_then(Value::as_array_mut);
    for input in inputs.into_iter().flatten() {
        if let Some(path) = input.get_mut("signal").and_then(|it| it.get_mut("file")) {
            move_file(path)?;
        }
    }
    Ok(())
}

/// Renames the ends of a connection with several sources.
fn rename(connection: &mut Value, within: &impl Fn(&str) -> String) {
    let change = |it: &mut Value| {
        if let Some((instance, variable)) = it.as_str().and_then(|it| it.split_once('.')) {
            *it = format!("{}.{variable}", within(instance)).into();
        }
    };
    if let Some(to) = connection.get_mut("to") {
        change(to);
    }
    let terms = connection.get_mut("from").and_then(Value::as_array_mut);
    for term in terms.into_iter().flatten() {
        match term.get_mut("signal") {
            Some(signal) => change(signal),
            None => change(term),
        }
    }
}
