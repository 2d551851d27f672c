//! The JSON schema of motor files, for editors.

use crate::MotorDescription;

impl MotorDescription {
    /// The JSON schema of a motor file, as text with a final line feed.
    #[must_use]
    pub fn schema() -> String {
        // a schema is a plain JSON value, which always prints
        let schema = schemars::schema_for!(MotorDescription).to_value();
        let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text.push('\n');
        text
    }
}
