//! JSON Merge Patch (RFC 7396), and the variant that patches lists of named items item by item.
//!
//! The crate `json-patch` does not keep the order of members when it removes one. Here the order matters: instances
//! of a scenario step in it, and bodies of a vehicle are numbered in it.

use serde_json::{Map, Value};

use crate::{FormError, PathStep};

/// Member of an item by which lists are patched.
pub(crate) const NAME: &str = "name";

/// Applies a patch as RFC 7396 defines it: objects are merged member by member, null removes a member, anything else
/// replaces it, lists too.
pub fn merge(target: &mut Value, patch: &Value) {
    let Value::Object(patch) = patch else {
        target.clone_from(patch);
        return;
    };
    make_object(target);
    let Value::Object(members) = target else { return };
    for (key, change) in patch {
        if change.is_null() {
            members.shift_remove(key);
        } else {
            merge(members.entry(key.as_str()).or_insert(Value::Null), change);
        }
    }
}

/// Applies a patch as [`merge`] does, but changes lists of named items by name.
///
/// A list of named items is one whose items are all objects with a text under `name`. The patch for it has one of two
/// forms:
///
/// - a list of named items: each changes the item of its name, and follows as a new item if there is none;
/// - an object with names as keys: its values change the items, null removes one. A key with `*` stands for all names
///   that match.
///
/// An empty list in the patch empties the list. Lists of other things are replaced.
///
/// ```
/// let mut layout = serde_json::json!({"bodies": [{"name": "car", "mass": 7700.0}, {"name": "table", "mass": 70.0}]});
/// strict_json::merge_by_name(&mut layout, &serde_json::json!({"bodies": {"car": {"mass": 9000.0}}}))?;
/// assert_eq!(layout["bodies"][0]["mass"], 9000.0);
/// assert_eq!(layout["bodies"][1]["mass"], 70.0);
/// # Ok::<(), (Vec<strict_json::PathStep>, strict_json::FormError)>(())
/// ```
///
/// Returns the places in the patch of all items that it adds, for messages: one of them may be a mistyped name.
///
/// # Errors
/// The patch names an item that does not exist in order to remove it, or does not fit a list of named items; with the way
/// to the place in the patch. The target is then partly changed.
pub fn merge_by_name(
    target: &mut Value,
    patch: &Value,
) -> Result<Vec<String>, (Vec<PathStep>, FormError)> {
    let mut place = Place::default();
    match apply(target, patch, &mut place) {
        Ok(()) => Ok(place.added),
        Err(error) => Err((place.steps, error)),
    }
}

/// Where a patch is applied, and what it has added so far.
#[derive(Default)]
struct Place {
    steps: Vec<PathStep>,
    added: Vec<String>,
}

pub(crate) fn make_object(value: &mut Value) {
    if !value.is_object() {
        *value = Value::Object(Map::new());
    }
}

/// Applies a patch at a place; after an error the steps lead to it.
fn apply(target: &mut Value, patch: &Value, place: &mut Place) -> Result<(), FormError> {
    match (&mut *target, patch) {
        (Value::Array(items), Value::Array(changes)) if is_named(items) && !changes.is_empty() => {
            return apply_list(items, changes, place);
        }
        (Value::Array(items), Value::Object(changes)) if is_named(items) => {
            return apply_names(items, changes, place);
        }
        (_, Value::Object(_)) => make_object(target),
        (_, other) => target.clone_from(other),
    }
    let (Value::Object(members), Value::Object(changes)) = (target, patch) else { return Ok(()) };
    for (key, change) in changes {
        if change.is_null() {
            members.shift_remove(key);
        } else {
            let member = members.entry(key.as_str()).or_insert(Value::Null);
            at(PathStep::Key(key.clone()), place, |place| apply(member, change, place))?;
        }
    }
    Ok(())
}

/// Applies a list of named items to a list of named items.
fn apply_list(
    items: &mut Vec<Value>,
    changes: &[Value],
    place: &mut Place,
) -> Result<(), FormError> {
    for (k, change) in changes.iter().enumerate() {
        at(PathStep::Index(k), place, |place| {
            let Some(name) = name(change) else {
                return Err(FormError::new(format!(
                    "the item has no \"{NAME}\", by which this list is patched"
                )));
            };
            if changes[..k].iter().any(|earlier| self::name(earlier) == Some(name)) {
                return Err(FormError::new(format!("\"{name}\" occurs twice in the list")));
            }
            apply(item(items, name, place), change, place)
        })?;
    }
    Ok(())
}

/// Applies an object with names as keys to a list of named items.
fn apply_names(
    items: &mut Vec<Value>,
    changes: &Map<String, Value>,
    place: &mut Place,
) -> Result<(), FormError> {
    for (key, change) in changes {
        at(PathStep::Key(key.clone()), place, |place| {
            let is_meant = |item: &Value| {
                name(item).is_some_and(|name| name == key || patterns::matches(key, name))
            };
            let is_new = !items.iter().any(is_meant);
            match change {
                Value::Null | Value::Object(_) if is_new && key.contains('*') => {
                    Err(FormError::new(format!("no item of the list matches \"{key}\"")))
                }
                Value::Null if is_new => {
                    let names: Vec<&str> = items.iter().filter_map(name).collect();
                    Err(FormError::unknown("name", key, &names))
                }
                Value::Null => {
                    items.retain(|item| !is_meant(item));
                    Ok(())
                }
                Value::Object(_) if is_new => apply(item(items, key, place), change, place),
                Value::Object(_) => items
                    .iter_mut()
                    .filter(|item| is_meant(item))
                    .try_for_each(|item| apply(item, change, place)),
                _ => Err(FormError::new(format!(
                    "invalid value: {change}, expected an object that changes the item \"{key}\" of the list, or null"
                ))),
            }
        })?;
    }
    Ok(())
}

/// Runs `action` one step further into the patch, and steps back if it succeeds.
fn at(
    step: PathStep,
    place: &mut Place,
    action: impl FnOnce(&mut Place) -> Result<(), FormError>,
) -> Result<(), FormError> {
    place.steps.push(step);
    action(place)?;
    place.steps.pop();
    Ok(())
}

pub(crate) fn name(item: &Value) -> Option<&str> {
    item.get(NAME)?.as_str()
}

/// Whether all items have names; an empty list may get items with names.
pub(crate) fn is_named(items: &[Value]) -> bool {
    items.iter().all(|item| name(item).is_some())
}

/// The first item of this name, which is added if there is none.
fn item<'a>(items: &'a mut Vec<Value>, name: &str, place: &mut Place) -> &'a mut Value {
    let found = items.iter().position(|item| self::name(item) == Some(name));
    let index = found.unwrap_or_else(|| {
        place.added.push(crate::shown(&place.steps));
        items.push(serde_json::json!({ NAME: name }));
        items.len() - 1
    });
    &mut items[index]
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// The test cases of RFC 7396, appendix A: original, patch, result.
    const CASES: [[&str; 3]; 15] = [
        [r#"{"a":"b"}"#, r#"{"a":"c"}"#, r#"{"a":"c"}"#],
        [r#"{"a":"b"}"#, r#"{"b":"c"}"#, r#"{"a":"b","b":"c"}"#],
        [r#"{"a":"b"}"#, r#"{"a":null}"#, r"{}"],
        [r#"{"a":"b","b":"c"}"#, r#"{"a":null}"#, r#"{"b":"c"}"#],
        [r#"{"a":["b"]}"#, r#"{"a":"c"}"#, r#"{"a":"c"}"#],
        [r#"{"a":"c"}"#, r#"{"a":["b"]}"#, r#"{"a":["b"]}"#],
        [r#"{"a":{"b":"c"}}"#, r#"{"a":{"b":"d","c":null}}"#, r#"{"a":{"b":"d"}}"#],
        [r#"{"a":[{"b":"c"}]}"#, r#"{"a":[1]}"#, r#"{"a":[1]}"#],
        [r#"["a","b"]"#, r#"["c","d"]"#, r#"["c","d"]"#],
        [r#"{"a":"b"}"#, r#"["c"]"#, r#"["c"]"#],
        [r#"{"a":"foo"}"#, "null", "null"],
        [r#"{"a":"foo"}"#, r#""bar""#, r#""bar""#],
        [r#"{"e":null}"#, r#"{"a":1}"#, r#"{"e":null,"a":1}"#],
        ["[1,2]", r#"{"a":"b","c":null}"#, r#"{"a":"b"}"#],
        ["{}", r#"{"a":{"bb":{"ccc":null}}}"#, r#"{"a":{"bb":{}}}"#],
    ];

    #[test]
    fn golden_the_cases_of_the_rfc() {
        for [original, patch, result] in CASES {
            let mut value: Value = serde_json::from_str(original).unwrap();
            merge(&mut value, &serde_json::from_str(patch).unwrap());
            assert_eq!(value.to_string(), result, "{original} with {patch}");
        }
    }

    #[test]
    fn issue_remaining_members_keep_their_order() {
        let mut value: Value = serde_json::from_str(r#"{"c":1,"a":{"x":1},"b":3,"d":4}"#).unwrap();
        merge(&mut value, &serde_json::from_str(r#"{"a":{"y":2},"c":null,"e":5}"#).unwrap());
        assert_eq!(value.to_string(), r#"{"a":{"x":1,"y":2},"b":3,"d":4,"e":5}"#);
    }

    fn patched(target: Value, patch: Value) -> Result<String, String> {
        let mut value = target;
        match merge_by_name(&mut value, &patch) {
            Ok(_) => Ok(value.to_string()),
            Err((steps, error)) => Err(format!("{}: {error}", crate::shown(&steps))),
        }
    }

    /// Lists of named items have a rule of their own; the other cases of the RFC hold for both.
    #[test]
    fn golden_by_name_the_cases_of_the_rfc_hold() {
        for [original, patch, result] in CASES {
            let value = |text: &str| serde_json::from_str::<Value>(text).unwrap();
            assert_eq!(patched(value(original), value(patch)).unwrap(), result, "{patch}");
        }
    }

    fn bodies() -> Value {
        json!({"bodies": [{"name": "car", "m": 1, "at": [0, 1]}, {"name": "table", "m": 2}, {"name": "motor", "m": 3}]})
    }

    #[test]
    fn analytic_named_items_are_changed_added_and_removed_in_place() {
        for (patch, result) in [
            (
                json!([{"name": "table", "m": 5}]),
                r#"{"name":"car","m":1,"at":[0,1]},{"name":"table","m":5},{"name":"motor","m":3}"#,
            ),
            (
                json!([{"name": "car", "at": [7]}, {"name": "table", "m": null}]),
                r#"{"name":"car","m":1,"at":[7]},{"name":"table"},{"name":"motor","m":3}"#,
            ),
            (
                json!([{"name": "new", "m": 9, "x": null}]),
                r#"{"name":"car","m":1,"at":[0,1]},{"name":"table","m":2},{"name":"motor","m":3},{"name":"new","m":9}"#,
            ),
            (
                json!({"table": null, "new": {"m": 4}}),
                r#"{"name":"car","m":1,"at":[0,1]},{"name":"motor","m":3},{"name":"new","m":4}"#,
            ),
            (
                json!({"*a*": {"m": 6}}),
                r#"{"name":"car","m":6,"at":[0,1]},{"name":"table","m":6},{"name":"motor","m":3}"#,
            ),
            (json!({"*": null}), ""),
            (json!([]), ""),
        ] {
            let expected = format!("{{\"bodies\":[{result}]}}");
            assert_eq!(patched(bodies(), json!({"bodies": patch})).unwrap(), expected, "{patch}");
        }
        let added = patched(json!({"bodies": []}), json!({"bodies": {"a": {"m": 1}}})).unwrap();
        assert_eq!(added, r#"{"bodies":[{"name":"a","m":1}]}"#);
    }

    #[test]
    fn analytic_added_items_are_reported() {
        let patch = json!({"bodies": {"tabel": {"m": 1}, "car": {"m": 2}}});
        assert_eq!(merge_by_name(&mut bodies(), &patch).unwrap(), ["bodies.tabel"]);
        let patch = json!({"bodies": [{"name": "car"}, {"name": "x", "l": [{"name": "y"}]}]});
        assert_eq!(merge_by_name(&mut bodies(), &patch).unwrap(), ["bodies[1]"]);
    }

    #[test]
    fn analytic_lists_of_other_things_are_replaced() {
        let target = json!({"l": [1, 2], "m": [{"name": "a"}, {"b": 1}], "n": [{"girder": "g"}]});
        let patch =
            json!({"l": [3], "m": [{"name": "a"}], "n": [{"girder": "h"}, {"girder": "g"}]});
        assert_eq!(patched(target, patch.clone()).unwrap(), patch.to_string());
    }

    #[test]
    fn refusal_a_patch_that_does_not_fit_its_list() {
        for (patch, message) in [
            (json!({"tabel": null}), "bodies.tabel: unknown name `tabel`; did you mean `table`?"),
            (json!({"x*": {"m": 1}}), "bodies.x*: no item of the list matches \"x*\""),
            (json!({"x*": null}), "bodies.x*: no item of the list matches \"x*\""),
            (
                json!({"car": 3}),
                "bodies.car: invalid value: 3, expected an object that changes the item \"car\" of the list, or null",
            ),
            (
                json!([{"name": "car"}, {"m": 1}]),
                "bodies[1]: the item has no \"name\", by which this list is patched",
            ),
            (
                json!([{"name": "car"}, {"name": "car"}]),
                "bodies[1]: \"car\" occurs twice in the list",
            ),
        ] {
            assert_eq!(patched(bodies(), json!({"bodies": patch})).unwrap_err(), message);
        }
        let nested = json!({"a": {"b": [{"name": "x", "l": [{"name": "y"}]}]}});
        let patch = json!({"a": {"b": {"x": {"l": {"z": null}}}}});
        assert!(patched(nested, patch).unwrap_err().starts_with("a.b.x.l.z: unknown name `z`"));
    }
}
