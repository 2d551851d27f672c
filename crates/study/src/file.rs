//! The study file.

use std::path::{Path, PathBuf};

use criteria::Metric;
use indexmap::IndexMap;
use scenario::Setting;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::{Design, Factor, StudyError};

/// A study: a base scenario, factors that vary, and which combinations of their values are computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Study of variants of a scenario", rename = "Study")]
pub struct StudyFile {
    /// Path or URL of the schema, for editors.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Title of the study, one line.
    #[serde(default)]
    pub title: String,
    /// Description of the study for its readers.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Path of the scenario that varies, relative to the study file.
    pub scenario: PathBuf,
    /// Values that all points share, as of `maglev run --set`: `instance.variable`, patterns allowed.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub set: IndexMap<String, Setting>,
    /// What varies, by names that become columns of the results.
    pub factors: IndexMap<String, Factor>,
    /// Which combinations are computed. Default: all of them.
    #[serde(default)]
    pub design: Design,
    /// Master seed, of samples and of `seeds`.
    #[serde(default)]
    pub seed: u64,
    /// Figures of each point, as in a scenario. They are added to those of the scenario; one of the same name replaces it.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub objectives: IndexMap<String, Metric>,
    /// Figures with bounds, as in a scenario. They are added to those of the scenario; one of the same name replaces it.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub limits: IndexMap<String, Metric>,
    /// What is kept of each point besides its figures.
    #[serde(default)]
    pub keep: Keep,
    /// Longest wall time of a point (s). A point that takes longer gets the status `timed-out`. Default: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub timeout: Option<f64>,
    /// How often a point is tried whose process crashes. After that its status is `crashed`.
    #[serde(default = "three")]
    #[schemars(range(min = 1))]
    pub tries: u32,
    /// What `maglev study` adds when it writes this file into a results folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(skip)]
    pub as_run: Option<Value>,
}

const fn three() -> u32 {
    3
}

/// What is kept of each point besides its figures.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Keep {
    /// Signals over time, `instance.variable`, patterns and `*` allowed. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub signals: Vec<String>,
    /// Of which points a results folder with a report is kept. It takes a second run of these points.
    pub runs: KeepRuns,
}

/// Of which points a results folder is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum KeepRuns {
    /// Of no point.
    #[default]
    None,
    /// Of points that fail, or that exceed a limit.
    Failures,
    /// Of all points.
    All,
}

impl StudyFile {
    /// Reads a study file and the files that it extends. Paths become relative to the working directory.
    ///
    /// # Errors
    /// A file cannot be read, or has a form that is not allowed.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        // the first file by a name of its own, since errors of the others call it a scenario
        std::fs::read(path).map_err(|source| StudyError::Read { path: path.to_owned(), source })?;
        scenario::read_chain(path, locate).map_err(StudyError::File)
    }

    /// The JSON schema of study files, as text with a final line feed.
    #[must_use]
    pub fn json_schema() -> String {
        let mut schema = schemars::schema_for!(Self).to_value();
        let extends = json!({
            "description": "Path of the study file that this one changes, relative to this one. Objects are merged \
                            member by member, null removes a member, anything else replaces it (RFC 7396).",
            "type": "string",
        });
        if let Some(members) = schema["properties"].as_object_mut() {
            members.insert("extends".to_owned(), extends);
        }
        // a file that extends another one need not repeat it
        let required = schema.as_object_mut().and_then(|it| it.shift_remove("required"));
        if let (Some(required), Some(map)) = (required, schema.as_object_mut()) {
            map.insert("if".to_owned(), json!({ "not": { "required": ["extends"] } }));
            map.insert("then".to_owned(), json!({ "required": required }));
        }
        allow_comments(&mut schema);
        schema["$defs"]["Comment"] = json!({
            "description": "A comment, ignored: a text, or a list of lines.",
            "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }],
        });
        // a schema is a plain JSON value, which always prints
        serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
    }
}

/// Allows a comment in every object.
fn allow_comments(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(allow_comments),
        Value::Object(map) => {
            map.values_mut().for_each(allow_comments);
            if map.get("type").is_some_and(|it| it == "object") {
                let members = map.entry("properties").or_insert_with(|| json!({}));
                members["$comment"] = json!({ "$ref": "#/$defs/Comment" });
            }
        }
        _ => {}
    }
}

/// Puts the folder of a file in front of the paths in it.
fn locate(value: &mut Value, folder: &Path) {
    let join = |path: &mut Value| {
        if let Value::String(text) = path {
            // both parts come from JSON or from a path that is printed as JSON
            *text = folder.join(&*text).to_string_lossy().into_owned();
        }
    };
    if let Some(path) = value.get_mut("scenario") {
        join(path);
    }
    if let Some(path) = value.get_mut("design").and_then(|it| it.get_mut("file")) {
        join(path);
    }
    let set = value.get_mut("set").and_then(Value::as_object_mut);
    for path in set.into_iter().flatten().filter_map(|(_, it)| it.get_mut("path")) {
        join(path);
        // workers and readers of the results have other working directories
        if let Value::String(text) = path
            && let Ok(absolute) = std::path::absolute(&*text)
        {
            *text = absolute.to_string_lossy().into_owned();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_19_files_in_set_are_beside_the_study() {
        let mut value =
            json!({ "scenario": "a.json", "set": { "b.file": { "path": "c.csv" }, "b.gain": 1 } });
        locate(&mut value, Path::new("/folder"));
        assert_eq!(value["set"]["b.file"]["path"], "/folder/c.csv");
        assert_eq!(value["scenario"], "/folder/a.json");
    }

    #[test]
    fn golden_published_schema_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/studies/schema.json");
        let published = std::fs::read_to_string(path).unwrap_or_default();
        let current = published == StudyFile::json_schema();
        assert!(current, "stale; run: maglev schema study > examples/studies/schema.json");
    }
}
