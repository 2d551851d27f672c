//! The JSON schema of scenario files, for editors.
//!
//! The types give the schema of a whole scenario. A file that extends another is a patch upon it: the
//! same members at the same places, none of them required, and null where one is to be removed. Lists
//! are replaced as a whole, so their items are those of a whole scenario.

use serde_json::{Map, Value, json};

use crate::Scenario;
use crate::comment::COMMENT;

/// Added to the name of a definition for its form in a patch.
const PATCH: &str = "Patch";
const DEFINITIONS: &str = "$defs";
const WHOLE: &str = "Scenario";

impl Scenario {
    /// The JSON schema of a scenario file, as text with a final line feed.
    #[must_use]
    pub fn schema() -> String {
        // a schema is a plain JSON value, which always prints
        let mut text = serde_json::to_string_pretty(&schema()).unwrap_or_default();
        text.push('\n');
        text
    }
}

fn schema() -> Value {
    let mut whole = schemars::schema_for!(Scenario).to_value();
    allow_comments(&mut whole);
    let mut take = |key| whole.as_object_mut().and_then(|it| it.shift_remove(key));
    let (draft, title, description) = (take("$schema"), take("title"), take("description"));
    let mut definitions = match take(DEFINITIONS) {
        Some(Value::Object(map)) => map,
        _ => Map::new(),
    };
    definitions.insert(WHOLE.to_owned(), whole);
    add_patch(&mut definitions, WHOLE);
    definitions.insert("Comment".to_owned(), comment());
    let extends = json!({
        "description": "The scenario file that this one changes, relative to this one: objects are \
                        merged member by member, null removes a member, all else replaces.",
        "type": "string",
    });
    // here for a file that does not say yet what it extends, too
    for place in [WHOLE, &patch_name(WHOLE)] {
        if let Some(members) = definitions[place]["properties"].as_object_mut() {
            members.insert("extends".to_owned(), extends.clone());
        }
    }
    json!({
        "$schema": draft, "title": title, "description": description, "type": "object",
        "if": { "required": ["extends"] },
        "then": reference(&patch_name(WHOLE)),
        "else": reference(WHOLE),
        DEFINITIONS: definitions,
    })
}

fn comment() -> Value {
    json!({
        "description": "A remark, not used: a text, or its lines.",
        "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }],
    })
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/{DEFINITIONS}/{name}") })
}

fn patch_name(name: &str) -> String {
    format!("{name}{PATCH}")
}

/// Lets every object have a comment: those with members and those that are maps.
fn allow_comments(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(allow_comments),
        Value::Object(map) => {
            map.values_mut().for_each(allow_comments);
            if map.get("type").is_some_and(|it| it == "object") {
                let members = map.entry("properties").or_insert_with(|| json!({}));
                members[COMMENT] = reference("Comment");
            }
        }
        _ => {}
    }
}

/// Adds the definition `name` in the form that it has in a patch, and those that it needs.
fn add_patch(definitions: &mut Map<String, Value>, name: &str) {
    let key = patch_name(name);
    if definitions.contains_key(&key) {
        return;
    }
    let Some(whole) = definitions.get(name).cloned() else { return };
    // a place for it first, in case it comes up in itself
    definitions.insert(key.clone(), Value::Null);
    let changed = patch(definitions, whole);
    definitions.insert(key, changed);
}

/// An object's schema in the form that it has in a patch.
fn patch(definitions: &mut Map<String, Value>, mut schema: Value) -> Value {
    let Value::Object(map) = &mut schema else { return schema };
    map.shift_remove("required");
    if let Some(Value::Object(members)) = map.get_mut("properties") {
        for (name, member) in members {
            if name != COMMENT {
                *member = member_of_patch(definitions, member.take());
            }
        }
    }
    if let Some(values) = map.get_mut("additionalProperties").filter(|it| it.is_object()) {
        *values = member_of_patch(definitions, values.take());
    }
    schema
}

/// A member's schema in a patch: objects are patches in turn, and null removes.
fn member_of_patch(definitions: &mut Map<String, Value>, mut member: Value) -> Value {
    let Value::Object(map) = &mut member else { return member };
    // what a member is when it is left out is for the file below to say
    map.shift_remove("default");
    let description = map.shift_remove("description");
    let is_object = |schema: &Value| schema["type"] == "object";
    let target = map.get("$ref").and_then(Value::as_str).and_then(|it| it.rsplit('/').next());
    if let Some(name) = target.map(str::to_owned) {
        if definitions.get(&name).is_some_and(is_object) {
            add_patch(definitions, &name);
            member = reference(&patch_name(&name));
        }
    } else if is_object(&member) {
        member = patch(definitions, member);
    }
    let mut nullable = Map::new();
    nullable.extend(description.map(|text| ("description".to_owned(), text)));
    nullable.insert("anyOf".to_owned(), json!([member, { "type": "null" }]));
    nullable.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_published_schema_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/schema.json");
        let published = std::fs::read_to_string(path).unwrap();
        let current = published == Scenario::schema();
        assert!(current, "stale; run: maglev schema > scenarios/schema.json");
    }

    #[test]
    fn invariant_a_patch_requires_nothing_outside_of_lists() {
        let schema = schema();
        for (name, definition) in schema[DEFINITIONS].as_object().unwrap() {
            assert!(!definition.is_null(), "{name}");
            if name.ends_with(PATCH) {
                assert!(definition.get("required").is_none(), "{name}");
            }
        }
        let members = &schema[DEFINITIONS]["ScenarioPatch"]["properties"];
        let instances = members["instances"].to_string();
        assert!(instances.contains("InstancePatch"), "{instances}");
        // a list is whole, and what is in it
        let plots = members["plots"].to_string();
        assert!(plots.contains("#/$defs/Plot\""), "{plots}");
    }
}
