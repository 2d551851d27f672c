//! The JSON schema of vehicle files: published, complete, and in step with what is read.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use multibody::{VehicleDescription, train};
use serde_json::Value;

const PUBLISHED: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../fmu-vehicle/resources/schema.json");

#[test]
fn golden_published_schema_is_current() {
    if std::env::var_os("WRITE_SCHEMA").is_some() {
        std::fs::write(PUBLISHED, VehicleDescription::schema()).unwrap();
    }
    let current = std::fs::read_to_string(PUBLISHED).unwrap() == VehicleDescription::schema();
    assert!(current, "stale; run: WRITE_SCHEMA=1 cargo test -p multibody --test schema");
}

/// Every key says what it is, every key that may be left out what it is then, and every number has a unit.
#[test]
fn invariant_every_key_is_documented() {
    let schema: Value = serde_json::from_str(&VehicleDescription::schema()).unwrap();
    let mut keys = 0;
    for (name, object) in schema["$defs"].as_object().unwrap() {
        // the forms of changes repeat those of whole items
        let Some(members) = object["properties"].as_object() else { continue };
        if name == "TrainWithChanges" {
            continue;
        }
        let required = object["required"].as_array().cloned().unwrap_or_default();
        assert_eq!(object["additionalProperties"], Value::Bool(false), "{name}");
        for (key, member) in members {
            let text = member["description"].as_str().unwrap_or_default();
            keys += 1;
            assert!(text.len() > 8, "{name}.{key}: {text}");
            let optional = !required.contains(&Value::String(key.clone()));
            assert!(!optional || text.contains("Default"), "{name}.{key}: {text}");
            let number = member["type"].to_string().contains("\"number\"");
            assert!(!number || text.contains('('), "{name}.{key}: {text}");
            assert!(!text.contains("[`"), "{name}.{key}: {text}");
        }
    }
    assert!(keys > 100, "{keys}");
}

/// What is written has the schema's keys, and a file may name its schema.
#[test]
fn invariant_layouts_have_the_keys_of_the_schema() {
    let schema: Value = serde_json::from_str(&VehicleDescription::schema()).unwrap();
    let keys = |name: &str| schema["$defs"][name]["properties"].as_object().unwrap().clone();
    let (whole, changes) = (keys("Vehicle"), keys("TrainWithChanges"));
    let layout: Value = serde_json::from_str(&train::two_car().to_json().unwrap()).unwrap();
    for key in layout.as_object().unwrap().keys() {
        assert!(whole.contains_key(key) && changes.contains_key(key), "{key}");
    }
    assert!(changes.contains_key("train"));
    let spelled = serde_json::to_value(train::TrainDescription::default()).unwrap();
    for key in spelled.as_object().unwrap().keys() {
        assert!(keys("Train").contains_key(key), "{key}");
    }
    let file = r#"{"$schema": "../schema.json", "train": {"cars": 1}}"#;
    let description = VehicleDescription::from_json(file).unwrap();
    assert_eq!(description.schema.as_deref(), Some("../schema.json"));
    let again = VehicleDescription::from_json(&description.to_json().unwrap()).unwrap();
    assert_eq!(again, description);
}
