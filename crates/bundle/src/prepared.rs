//! The scenario as a bundle contains it: without what only a run of the command needs, and with all files inside.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use indexmap::IndexMap;
use master::Setup;
use serde_json::{Map, Value, json};

use crate::contents::{Inner, UNITS, failed, read_folder};
use crate::error::BundleError;
use crate::names::Names;

/// Members that a bundle does not use: what is written, how fast, and in which processes.
const LEFT_OUT: [&str; 15] = [
    "$schema",
    "$comment",
    "plots",
    "ride_quality",
    "objectives",
    "limits",
    "checkpoint",
    "real_time",
    "trace",
    "isolation",
    "strict",
    "log_level",
    "record",
    "title",
    "description",
];
/// Folder of files that values and signals refer to.
const FILES: &str = "files";

/// The scenario and the files that it refers to.
pub(crate) struct Prepared {
    pub(crate) text: String,
    /// by their names in the bundle's resources
    pub(crate) files: BTreeMap<String, Vec<u8>>,
}

/// Prepares a scenario. `outputs` are the signals that the bundle exposes.
pub(crate) fn prepare(
    setup: &Setup,
    units: &IndexMap<String, Inner>,
    outputs: &[String],
) -> Result<Prepared, BundleError> {
    let json = |error: serde_json::Error| BundleError::Json(error.to_string());
    let text = in_memory::as_run::text(None, setup.scenario(), setup.system());
    let text = text.map_err(failed(Path::new("the working directory")))?;
    let mut scenario: Map<String, Value> = serde_json::from_str(&text).map_err(json)?;
    for member in LEFT_OUT {
        scenario.remove(member);
    }
    let located =
        units.iter().map(|(key, it)| (key.clone(), json!(format!("{UNITS}/{}", it.folder))));
    scenario.insert("units".to_owned(), Value::Object(located.collect()));
    scenario.insert("record".to_owned(), json!({ "signals": outputs }));
    let mut copied = Copied { names: Names::default(), known: Vec::new(), files: BTreeMap::new() };
    for instance in members(&mut scenario, "instances") {
        if let Some(instance) = instance.as_object_mut() {
            instance.remove("isolate");
            instance.remove("debug_log");
            for list in ["parameters", "start"] {
                for setting in members(instance, list) {
                    if let Some(path) = setting.get_mut("path") {
                        copied.copy(path)?;
                    }
                }
            }
        }
    }
    for input in scenario.get_mut("inputs").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(path) = input.pointer_mut("/signal/file") {
            copied.copy(path)?;
        }
    }
    let mut text = serde_json::to_string_pretty(&scenario).map_err(json)?;
    text.push('\n');
    Ok(Prepared { text, files: copied.files })
}

fn members<'a>(
    object: &'a mut Map<String, Value>,
    name: &str,
) -> impl Iterator<Item = &'a mut Value> {
    let members = object.get_mut(name).and_then(Value::as_object_mut);
    members.into_iter().flat_map(Map::values_mut)
}

/// Files that were copied into the bundle.
struct Copied {
    names: Names,
    known: Vec<(PathBuf, String)>,
    files: BTreeMap<String, Vec<u8>>,
}

impl Copied {
    /// Copies a file or folder and replaces its path.
    fn copy(&mut self, path: &mut Value) -> Result<(), BundleError> {
        let Some(source) = path.as_str().map(PathBuf::from) else { return Ok(()) };
        if let Some((_, name)) = self.known.iter().find(|(known, _)| *known == source) {
            *path = json!(name);
            return Ok(());
        }
        let stem = source.file_stem().unwrap_or_default().to_string_lossy();
        let end = source.extension().map(|it| format!(".{}", it.to_string_lossy()));
        let name = format!("{FILES}/{}{}", self.names.like(&stem), end.unwrap_or_default());
        if source.is_dir() {
            read_folder(&source, &format!("{name}/"), &mut self.files)?;
        } else {
            let content = std::fs::read(&source).map_err(failed(&source))?;
            self.files.insert(name.clone(), content);
        }
        *path = json!(name);
        self.known.push((source, name));
        Ok(())
    }
}
