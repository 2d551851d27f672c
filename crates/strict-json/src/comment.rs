//! Comments: `"$comment"` members, which every object of a file may have.

use serde_json::{Value, json};

use crate::{FormError, PathStep};

/// Key of a comment.
pub const COMMENT: &str = "$comment";
/// Name of its definition in a schema.
const DEFINITION: &str = "Comment";

/// Removes all comments from a value.
///
/// # Errors
/// A comment is neither a text nor a list of texts; with the way to it.
pub fn strip_comments(value: &mut Value) -> Result<(), (Vec<PathStep>, FormError)> {
    let wrong = || FormError::new("a comment must be a text or a list of texts");
    strip(value).map_err(|steps| (steps, wrong()))
}

/// Allows a comment in every object of a JSON schema.
pub fn allow_comments(schema: &mut Value) {
    allow(schema);
    if let Some(map) = schema.as_object_mut() {
        let definitions = map.entry("$defs").or_insert_with(|| json!({}));
        definitions[DEFINITION] = json!({
            "description": "A comment, ignored: a text, or a list of lines.",
            "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }],
        });
    }
}

fn allow(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(allow),
        Value::Object(map) => {
            map.values_mut().for_each(allow);
            if map.get("type").is_some_and(|it| it == "object") {
                let members = map.entry("properties").or_insert_with(|| json!({}));
                members[COMMENT] = json!({ "$ref": format!("#/$defs/{DEFINITION}") });
            }
        }
        _ => {}
    }
}

fn strip(value: &mut Value) -> Result<(), Vec<PathStep>> {
    let mut here = Vec::new();
    strip_at(value, &mut here)
}

fn strip_at(value: &mut Value, here: &mut Vec<PathStep>) -> Result<(), Vec<PathStep>> {
    match value {
        Value::Array(items) => {
            for (k, item) in items.iter_mut().enumerate() {
                here.push(PathStep::Index(k));
                strip_at(item, here)?;
                here.pop();
            }
        }
        Value::Object(map) => {
            // shift_remove: the other members stay in their order
            if map.shift_remove(COMMENT).is_some_and(|comment| !is_text(&comment)) {
                here.push(PathStep::Key(COMMENT.to_owned()));
                return Err(std::mem::take(here));
            }
            for (key, member) in map {
                here.push(PathStep::Key(key.clone()));
                strip_at(member, here)?;
                here.pop();
            }
        }
        _ => {}
    }
    Ok(())
}

/// Whether a comment is a text, or a list of texts as its lines.
fn is_text(comment: &Value) -> bool {
    match comment {
        Value::String(_) => true,
        Value::Array(lines) => lines.iter().all(Value::is_string),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn analytic_comments_go_and_the_order_stays() {
        let mut value = json!({ "z": 1, "$comment": "a", "b": [{ "$comment": ["x", "y"], "c": 2 }],
                                "a": { "$comment": "" } });
        strip(&mut value).unwrap();
        assert_eq!(value.to_string(), r#"{"z":1,"b":[{"c":2}],"a":{}}"#);
    }

    #[test]
    fn issue_a_comment_that_is_no_text_is_named_by_its_place() {
        let mut value = json!({ "b": [{}, { "$comment": { "hidden": 1 } }] });
        let key = |name: &str| PathStep::Key(name.to_owned());
        assert_eq!(strip(&mut value), Err(vec![key("b"), PathStep::Index(1), key(COMMENT)]));
    }
}
