//! JSON Merge Patch (RFC 7396), by which a file changes the one that it extends.
//!
//! The crate `json-patch` does not keep the order of members when it removes one. Here the order matters: instances
//! step in it.

use serde_json::{Map, Value};

/// Applies a patch: objects are merged member by member, null removes a member, anything else replaces it.
pub(crate) fn merge(target: &mut Value, patch: &Value) {
    let Value::Object(patch) = patch else {
        target.clone_from(patch);
        return;
    };
    if !target.is_object() {
        *target = Value::Object(Map::new());
    }
    let Value::Object(members) = target else { return };
    for (key, change) in patch {
        if change.is_null() {
            members.shift_remove(key);
        } else {
            merge(members.entry(key.as_str()).or_insert(Value::Null), change);
        }
    }
}

#[cfg(test)]
mod tests {
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
}
