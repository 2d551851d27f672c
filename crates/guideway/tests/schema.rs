//! The JSON schema of layout files: published, complete, and in step with what is read.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use guideway::GuidewayDescription;
use serde_json::Value;

const PUBLISHED: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../fmu-guideway/resources/schema.json");

#[test]
fn golden_published_schema_is_current() {
    if std::env::var_os("WRITE_SCHEMA").is_some() {
        std::fs::write(PUBLISHED, GuidewayDescription::schema()).unwrap();
    }
    let current = std::fs::read_to_string(PUBLISHED).unwrap() == GuidewayDescription::schema();
    assert!(current, "stale; run: WRITE_SCHEMA=1 cargo test -p guideway --test schema");
}

/// Every key says what it is, every key that may be left out what it is then, and everything that is
/// measured has a unit.
#[test]
fn invariant_every_key_is_documented() {
    let schema: Value = serde_json::from_str(&GuidewayDescription::schema()).unwrap();
    let definitions = schema["$defs"].as_object().unwrap();
    let mut keys = 0;
    for (name, object) in definitions.iter().map(|(k, v)| (k.as_str(), v)).chain([("", &schema)]) {
        let Some(members) = object["properties"].as_object() else { continue };
        let required = object["required"].as_array().cloned().unwrap_or_default();
        assert_eq!(object["additionalProperties"], Value::Bool(false), "{name}");
        for (key, member) in members {
            let text = member["description"].as_str().unwrap_or_default();
            keys += 1;
            assert!(text.len() > 8, "{name}.{key}: {text}");
            let optional = !required.contains(&Value::String(key.clone()));
            assert!(!optional || text.contains("Default"), "{name}.{key}: {text}");
            let number = member["type"].to_string().contains("\"number\"");
            assert!(
                !number || text.contains('(') || text.contains("Factor"),
                "{name}.{key}: {text}"
            );
            assert!(!text.contains("[`"), "{name}.{key}: {text}");
        }
    }
    assert!(keys > 60, "{keys}");
}
