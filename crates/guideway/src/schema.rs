//! The JSON schema of layout files, for editors and for the list of keys.

use serde_json::{Map, Value};

use crate::GuidewayDescription;

impl GuidewayDescription {
    /// The JSON schema of a guideway layout, as text with a final line feed.
    #[must_use]
    pub fn schema() -> String {
        let mut schema = schemars::schema_for!(GuidewayDescription).to_value();
        // what it is comes first
        let mut ordered = Map::new();
        if let Value::Object(members) = &mut schema {
            for key in ["$schema", "title", "description"] {
                ordered.extend(members.shift_remove(key).map(|value| (key.to_owned(), value)));
            }
            ordered.append(members);
        }
        // a schema is a plain JSON value, which always prints
        let mut text = serde_json::to_string_pretty(&ordered).unwrap_or_default();
        text.push('\n');
        text
    }
}
