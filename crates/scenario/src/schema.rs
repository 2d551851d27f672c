//! The JSON schema of scenario files, for editors.
//!
//! The schema of a whole scenario follows from the types. A file that extends another one is a patch: the same members
//! at the same places, none of them required, and null to remove one. A patch replaces lists as a whole, so their items
//! are those of a whole scenario.

use serde_json::{Map, Value, json};

use crate::Scenario;

/// Suffix of a definition's name for its form in a patch.
const PATCH: &str = "Patch";
const DEFINITIONS: &str = "$defs";
const WHOLE: &str = "Scenario";
/// The definition with several forms, of which one is an object that is merged.
const UNIT: &str = "Unit";

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
    strict_json::allow_comments(&mut whole);
    let mut take = |key| whole.as_object_mut().and_then(|it| it.shift_remove(key));
    let (draft, title, description) = (take("$schema"), take("title"), take("description"));
    let mut definitions = match take(DEFINITIONS) {
        Some(Value::Object(map)) => map,
        _ => Map::new(),
    };
    // comments are the same in a patch
    let comment = definitions.shift_remove("Comment");
    definitions.insert(WHOLE.to_owned(), whole);
    add_patch(&mut definitions, WHOLE);
    definitions.extend(comment.map(|it| ("Comment".to_owned(), it)));
    let extends = json!({
        "description": "Path of the scenario file that this one changes, relative to this one. Objects are merged \
                        member by member, null removes a member, anything else replaces it (RFC 7396).",
        "type": "string",
    });
    // also for a file without `extends`, so that editors offer it
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

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/{DEFINITIONS}/{name}") })
}

fn patch_name(name: &str) -> String {
    format!("{name}{PATCH}")
}

/// Adds the form of a definition in a patch, and of those that it refers to.
fn add_patch(definitions: &mut Map<String, Value>, name: &str) {
    let key = patch_name(name);
    if definitions.contains_key(&key) {
        return;
    }
    let Some(whole) = definitions.get(name).cloned() else { return };
    // a placeholder first, in case the definition refers to itself
    definitions.insert(key.clone(), Value::Null);
    let changed = patch(definitions, whole);
    definitions.insert(key, changed);
}

/// The schema of an object in a patch.
fn patch(definitions: &mut Map<String, Value>, mut schema: Value) -> Value {
    let Value::Object(map) = &mut schema else { return schema };
    map.shift_remove("required");
    if let Some(Value::Array(forms)) = map.get_mut("anyOf") {
        for form in forms {
            if let Some(name) = target(form).filter(|name| is_object(definitions.get(name))) {
                add_patch(definitions, &name);
                *form = reference(&patch_name(&name));
            }
        }
    }
    if let Some(Value::Object(members)) = map.get_mut("properties") {
        for (name, member) in members {
            if name != strict_json::COMMENT {
                *member = member_of_patch(definitions, member.take());
            }
        }
    }
    if let Some(values) = map.get_mut("additionalProperties").filter(|it| it.is_object()) {
        *values = member_of_patch(definitions, values.take());
    }
    schema
}

/// The schema of a member in a patch: an object is a patch too, and null removes the member.
fn member_of_patch(definitions: &mut Map<String, Value>, mut member: Value) -> Value {
    let Value::Object(map) = &mut member else { return member };
    // the extended file gives the value of a member that is left out
    map.shift_remove("default");
    let description = map.shift_remove("description");
    if let Some(name) = target(&member) {
        if name == UNIT || is_object(definitions.get(&name)) {
            add_patch(definitions, &name);
            member = reference(&patch_name(&name));
        }
    } else if is_object(Some(&member)) {
        member = patch(definitions, member);
    }
    let mut nullable = Map::new();
    nullable.extend(description.map(|text| ("description".to_owned(), text)));
    nullable.insert("anyOf".to_owned(), json!([member, { "type": "null" }]));
    nullable.into()
}

/// Name of the definition that a schema refers to.
fn target(schema: &Value) -> Option<String> {
    Some(schema.get("$ref")?.as_str()?.rsplit('/').next()?.to_owned())
}

fn is_object(schema: Option<&Value>) -> bool {
    schema.is_some_and(|schema| schema["type"] == "object")
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
        // a patch may change the resources of a unit without naming its file again
        let unit = schema[DEFINITIONS]["UnitPatch"].to_string();
        assert!(unit.contains("#/$defs/UnitWithResourcesPatch\""), "{unit}");
        assert!(!unit.contains("#/$defs/UnitWithResources\""), "{unit}");
        // items of lists are not patches
        let plots = members["plots"].to_string();
        assert!(plots.contains("#/$defs/Plot\""), "{plots}");
    }
}
