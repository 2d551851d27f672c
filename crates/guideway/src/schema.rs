//! The JSON schema of layout files, for editors and for the list of keys.

use crate::GuidewayDescription;

impl GuidewayDescription {
    /// The JSON schema of a guideway layout, as text with a final line feed.
    #[must_use]
    pub fn schema() -> String {
        let schema = schemars::schema_for!(GuidewayDescription).to_value();
        // a schema is a plain JSON value, which always prints
        let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text.push('\n');
        text
    }
}
