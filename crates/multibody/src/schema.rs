//! The JSON schema of vehicle files, for editors.
//!
//! The schema of a whole vehicle follows from the types. Beside `train` a file has changes: the same keys, none of
//! them required, and lists of named items by name.

use serde_json::{Map, Value, json};

use crate::description::VehicleDescription;
use crate::train::{KEY, TrainDescription};

const DEFINITIONS: &str = "$defs";
const WHOLE: &str = "Vehicle";
const CHANGES: &str = "TrainWithChanges";

impl VehicleDescription {
    /// The JSON schema of a vehicle file, as text with a final line feed.
    #[must_use]
    pub fn schema() -> String {
        // a schema is a plain JSON value, which always prints
        let mut text = serde_json::to_string_pretty(&schema()).unwrap_or_default();
        text.push('\n');
        text
    }
}

fn schema() -> Value {
    let mut definitions = Map::new();
    let mut take = |mut schema: Value, name: &str| {
        let Some(members) = schema.as_object_mut() else { return Value::Null };
        if let Some(Value::Object(own)) = members.shift_remove(DEFINITIONS) {
            definitions.extend(own);
        }
        let draft = members.shift_remove("$schema").unwrap_or_default();
        members.shift_remove("title");
        definitions.insert(name.to_owned(), schema);
        draft
    };
    let draft = take(schemars::schema_for!(VehicleDescription).to_value(), WHOLE);
    take(schemars::schema_for!(TrainDescription).to_value(), "Train");
    let changes = changes(&definitions);
    definitions.insert(CHANGES.to_owned(), changes);
    json!({
        "$schema": draft,
        "title": "Maglev vehicle",
        "description": "All bodies, joints and elements of a vehicle; or a train in a few numbers, with changes by name.",
        "type": "object",
        "if": { "required": [KEY] },
        "then": reference(CHANGES),
        "else": reference(WHOLE),
        // also for a file without `train`, so that editors offer it
        "properties": { KEY: reference("Train") },
        DEFINITIONS: definitions,
    })
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/{DEFINITIONS}/{name}") })
}

/// The form of a file with `train`.
fn changes(definitions: &Map<String, Value>) -> Value {
    let mut changes = definitions.get(WHOLE).cloned().unwrap_or_default();
    let Some(members) = changes.as_object_mut() else { return changes };
    members.shift_remove("required");
    members.insert("description".into(), json!("A train, and changes of what it expands to."));
    let Some(Value::Object(keys)) = members.get_mut("properties") else { return changes };
    for key in keys.values_mut() {
        let item = key.get("items").and_then(|items| items.get("$ref")).and_then(Value::as_str);
        let Some(item) = item.and_then(|way| way.rsplit('/').next()) else { continue };
        let Some(item) = definitions.get(item) else { continue };
        if item["properties"].get("name").is_some() {
            *key = by_name(item, key.get("description"));
        }
    }
    keys.insert(KEY.to_owned(), reference("Train"));
    changes
}

/// Changes of a list of named items: a list of items with their names, or an object with names as keys.
fn by_name(item: &Value, description: Option<&Value>) -> Value {
    let mut listed = item.clone();
    listed["required"] = json!(["name"]);
    let mut keyed = item.clone();
    if let Some(members) = keyed.as_object_mut() {
        members.shift_remove("required");
    }
    json!({
        "description": description,
        "anyOf": [
            { "type": "array", "items": listed },
            {
                "description": "Items by name; `*` in a name stands for any letters, null removes an item.",
                "type": "object",
                "additionalProperties": { "anyOf": [keyed, { "type": "null" }] },
            },
        ],
    })
}
