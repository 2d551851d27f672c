//! Comments: `"$comment"` members, which every object of a scenario may have.

use serde_json::Value;

use strict_json::PathStep;

/// Key of a comment.
pub(crate) const COMMENT: &str = "$comment";

/// Removes all comments from a value. The error is the place of a comment that is not text.
pub(crate) fn strip(value: &mut Value) -> Result<(), Vec<PathStep>> {
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
