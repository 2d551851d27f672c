//! The committed schema is the one of the types.
#![allow(clippy::unwrap_used, reason = "a test program")]

use linear_motor::MotorDescription;

#[test]
fn golden_the_schema_is_that_of_the_types() {
    let path =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../fmu-vehicle/resources/motor-schema.json");
    if std::env::var_os("WRITE_SCHEMA").is_some() {
        std::fs::write(path, MotorDescription::schema()).unwrap();
    }
    let committed = std::fs::read_to_string(path).unwrap();
    assert!(
        committed == MotorDescription::schema(),
        "stale; run: WRITE_SCHEMA=1 cargo test -p linear-motor --test schema"
    );
}
