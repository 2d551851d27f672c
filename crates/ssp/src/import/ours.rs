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
    /// Reads the annotation, if there is one.
    pub(super) fn read(
        description: &Description,
        tree: &Tree<'_>,
        file: &str,
    ) -> Result<Self, SspError> {
        let mut ours = Self::default();
        for annotation in &description.annotations {
            let Meaning::Ours(text) = &annotation.meaning else { continue };
            let place = format!("annotation {TYPE} of {}", annotation.place);
            let at = At { file, place: &place };
            let invalid =
                |error: serde_json::Error| at.invalid(format!("it is not as expected: {error}"));
            ours.scenario = serde_json::from_str(text).map_err(invalid)?;
            for key in FORBIDDEN {
                if ours.scenario.contains_key(key) {
                    return Err(at.invalid(format!("the member \"{key}\" is not allowed there")));
                }
            }
            if let Some(instances) = ours.scenario.shift_remove("instances") {
                ours.instances = serde_json::from_value(instances).map_err(invalid)?;
            }
            if let Some(sums) = ours.scenario.shift_remove("sums") {
                ours.sums = serde_json::from_value(sums).map_err(invalid)?;
            }
            let known = |name: &String| tree.components.iter().any(|it| it.instance == *name);
            if let Some(name) = ours.instances.keys().find(|name| !known(name)) {
                return Err(at.invalid(format!("there is no component \"{name}\"")));
            }
            if ours.instances.values().any(|it| it.get("unit").is_some()) {
                return Err(at.invalid("the member \"unit\" is not allowed in instances"));
            }
        }
        Ok(ours)
    }

    /// Puts the files that values and inputs over time name into `folder`, and corrects their paths.
    pub(super) fn place_files(&mut self, files: &mut Files, folder: &Path) -> Result<(), SspError> {
        let place = format!("annotation {TYPE}");
        let mut move_file = |path: &mut Value| -> Result<(), SspError> {
            let Some(text) = path.as_str() else { return Ok(()) };
            let name = files.resolve(files.description(), text, &place)?;
            *path = files.place(&name, folder, &place)?.to_string_lossy().into_owned().into();
            Ok(())
        };
        for settings in self.instances.values_mut() {
            for list in ["parameters", "start"] {
                let values = settings.get_mut(list).and_then(Value::as_object_mut);
                for value in values.into_iter().flat_map(Map::values_mut) {
                    if let Some(path) = value.get_mut("path") {
                        move_file(path)?;
                    }
                }
            }
        }
        let inputs = self.scenario.get_mut("inputs").and_then(Value::as_array_mut);
        for input in inputs.into_iter().flatten() {
            if let Some(path) = input.get_mut("signal").and_then(|it| it.get_mut("file")) {
                move_file(path)?;
            }
        }
        Ok(())
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
