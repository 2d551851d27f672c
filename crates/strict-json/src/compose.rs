//! One patch that does what two patches do one after the other.

use serde_json::{Map, Value};

use crate::merge::{NAME, is_named, make_object, name};
use crate::{FormError, PathStep};

/// Changes a patch so that it does what it did, and then what `next` does; both are patches for
/// [`merge_by_name`](crate::merge_by_name).
///
/// Other than with [`merge_by_name`](crate::merge_by_name), `null` stays: what it removes is not in the patch.
///
/// ```
/// let mut patch = serde_json::json!({"bodies": {"car": {"mass": 9000.0}}});
/// strict_json::compose_by_name(&mut patch, &serde_json::json!({"bodies": {"motor": null}}))?;
/// assert_eq!(patch, serde_json::json!({"bodies": {"car": {"mass": 9000.0}, "motor": null}}));
/// # Ok::<(), (Vec<strict_json::PathStep>, strict_json::FormError)>(())
/// ```
///
/// # Errors
/// No single patch does the same; with the way to the place in `next`. The patch is then partly changed.
pub fn compose_by_name(patch: &mut Value, next: &Value) -> Result<(), (Vec<PathStep>, FormError)> {
    let mut steps = Vec::new();
    compose(patch, next, &mut steps).map_err(|error| (steps, error))
}

fn compose(patch: &mut Value, next: &Value, steps: &mut Vec<PathStep>) -> Result<(), FormError> {
    let by_name = match (&*patch, next) {
        (Value::Array(items), Value::Object(_)) => is_named(items),
        (Value::Array(items), Value::Array(more)) => is_named(items) && is_list(more),
        (Value::Object(_), Value::Array(more)) => is_list(more),
        (_, Value::Object(_)) => false,
        (_, other) => {
            patch.clone_from(other);
            return Ok(());
        }
    };
    let names;
    let next = match next {
        Value::Array(items) if by_name => {
            names = by_names(items)?;
            &names
        }
        Value::Object(members) => members,
        other => {
            patch.clone_from(other);
            return Ok(());
        }
    };
    match patch {
        Value::Array(items) if by_name && items.is_empty() => {
            return Err(FormError::new(
                "the file empties this list already; write the items that you want into the file",
            ));
        }
        Value::Array(items) if by_name => *patch = Value::Object(by_names(items)?),
        _ => make_object(patch),
    }
    let Value::Object(members) = patch else { return Ok(()) };
    for (key, change) in next {
        steps.push(PathStep::Key(key.clone()));
        member(members, key, change, steps)?;
        steps.pop();
    }
    Ok(())
}

/// Composes the changes of one member.
fn member(
    members: &mut Map<String, Value>,
    key: &str,
    change: &Value,
    steps: &mut Vec<PathStep>,
) -> Result<(), FormError> {
    let later = members.keys().skip_while(|earlier| *earlier != key).skip(1);
    if let Some(other) = { later }.find(|other| overlap(key, other)) {
        return Err(FormError::new(format!(
            "the file changes \"{key}\" and then \"{other}\"; a further change of \"{key}\" cannot follow both, so \
             write it into the file"
        )));
    }
    match members.get_mut(key) {
        None => {
            members.insert(key.to_owned(), change.clone());
            Ok(())
        }
        Some(Value::Null) if change.is_object() => Err(FormError::new(format!(
            "the file removes \"{key}\" already; remove its null from the file to change it"
        ))),
        Some(member) => compose(member, change, steps),
    }
}

/// Whether both keys may stand for the same name.
fn overlap(a: &str, b: &str) -> bool {
    let patterns = [a, b].map(|key| key.contains('*'));
    patterns == [true; 2] || patterns::matches(a, b) || patterns::matches(b, a)
}

/// Whether this is a patch of a list of named items.
fn is_list(items: &[Value]) -> bool {
    is_named(items) && !items.is_empty()
}

/// The patch of a list as an object with names as keys.
fn by_names(items: &[Value]) -> Result<Map<String, Value>, FormError> {
    let mut members = Map::new();
    for item in items {
        let (Some(name), Value::Object(item)) = (name(item), item) else { continue };
        if name.contains('*') || members.contains_key(name) {
            return Err(FormError::new(format!(
                "\"{name}\" cannot be the name of one item of the list; each item needs one name without `*`"
            )));
        }
        let changes = item.iter().filter(|(key, _)| *key != NAME);
        let changes: Map<_, _> = changes.map(|(key, value)| (key.clone(), value.clone())).collect();
        members.insert(name.to_owned(), Value::Object(changes));
    }
    Ok(members)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn composed(patch: &Value, next: &Value) -> Result<Value, String> {
        let mut patch = patch.clone();
        compose_by_name(&mut patch, next)
            .map(|()| patch)
            .map_err(|(steps, error)| format!("{}: {error}", crate::shown(&steps)))
    }

    #[test]
    fn invariant_one_patch_does_what_two_do() {
        let target = json!({"gravity": 1, "bodies": [{"name": "a", "m": 1, "at": [0]}, {"name": "b", "m": 2},
            {"name": "ab", "m": 3}], "o": {"x": 1}});
        for (first, next) in [
            (json!({}), json!({"bodies": {"a": null}})),
            (json!({"bodies": {"a": {"m": 5}}}), json!({"bodies": {"a": null, "b": {"m": 7}}})),
            (json!({"bodies": {"a": {"m": 5}}}), json!({"bodies": {"*": {"m": 7}}})),
            (json!({"bodies": {"b*": {"m": 5}}}), json!({"bodies": {"b*": {"at": [1]}}})),
            (json!({"bodies": [{"name": "a", "m": 5}]}), json!({"bodies": {"b": null}})),
            (json!({"bodies": {"a": {"m": 5}}}), json!({"bodies": [{"name": "a", "at": [2]}]})),
            (json!({"bodies": [{"name": "a"}]}), json!({"bodies": [{"name": "c", "m": 1}]})),
            (json!({"bodies": {"a": {"at": null}}}), json!({"bodies": {"a": {"at": [3]}}})),
            (json!({"bodies": {"a": {"at": [9]}}}), json!({"bodies": {"a": {"at": null}}})),
            (json!({"bodies": {"a": null}}), json!({"bodies": []})),
            (json!({"gravity": 2, "o": {"y": 1}}), json!({"gravity": null, "o": {"x": null}})),
        ] {
            let mut one_by_one = target.clone();
            for patch in [&first, &next] {
                crate::merge_by_name(&mut one_by_one, patch).unwrap();
            }
            let mut at_once = target.clone();
            crate::merge_by_name(&mut at_once, &composed(&first, &next).unwrap()).unwrap();
            assert_eq!(at_once.to_string(), one_by_one.to_string(), "{first} then {next}");
        }
    }

    #[test]
    fn refusal_what_one_patch_cannot_do() {
        for (first, next, part) in [
            (
                json!({"l": {"a*": {"m": 1}, "ab": {"m": 2}}}),
                json!({"l": {"a*": {"m": 3}}}),
                "l.a*: the file changes \"a*\" and then \"ab\"",
            ),
            (
                json!({"l": {"a": {"m": 1}, "*": {"m": 2}}}),
                json!({"l": {"a": null}}),
                "l.a: the file changes \"a\" and then \"*\"",
            ),
            (json!({"l": {"a": null}}), json!({"l": {"a": {"m": 1}}}), "l.a: the file removes"),
            (json!({"l": []}), json!({"l": {"a": {"m": 1}}}), "l: the file empties this list"),
            (json!({"l": {}}), json!({"l": [{"name": "a"}, {"name": "a"}]}), "l: \"a\" cannot be"),
        ] {
            let message = composed(&first, &next).unwrap_err();
            assert!(message.starts_with(part), "{message}");
        }
    }
}
