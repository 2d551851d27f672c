//! JSON for files that people write: duplicate and unknown keys are errors with their place.
//!
//! [`read`] is all that most callers need. A caller that changes the document before it uses it, as scenarios that
//! extend each other, takes the steps one by one: [`parse`], [`merge`], [`from_value`], and [`position`] for messages.

mod comment;
mod compose;
mod merge;
mod place;
mod strict;
mod typed;

use serde::de::DeserializeOwned;
use serde_json::Value;

pub use comment::{COMMENT, allow_comments, strip_comments};
pub use compose::compose_by_name;
pub use merge::{merge, merge_by_name};
pub use place::{PathStep, depth, position, shown};
use strict::Strict;
pub use typed::FormError;

/// Some editors begin UTF-8 with this.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Why a text cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}{message}", if path.is_empty() { String::new() } else { format!("at {path}: ") })]
pub struct JsonError {
    /// Path within the document, such as `bodies[3].mass`; empty for the whole.
    pub path: String,
    /// What is wrong, with line and column.
    pub message: String,
    /// The text is not JSON.
    pub syntax: bool,
}

/// Reads a text as a type.
///
/// # Errors
/// The text is not JSON, has a duplicate key, or does not have the form of the type.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, JsonError> {
    from_value(parse(text)?).map_err(|(steps, error)| {
        let message = error.located(text, &steps);
        JsonError { path: shown(&steps), message, syntax: false }
    })
}

/// Reads a text as a type, without its comments: members `"$comment"` of any object.
///
/// # Errors
/// As [`read`], or a comment is not text.
pub fn read_commented<T: DeserializeOwned>(text: &str) -> Result<T, JsonError> {
    let mut value = parse(text)?;
    strip_comments(&mut value).and_then(|()| from_value(value)).map_err(|(steps, error)| {
        let message = error.located(text, &steps);
        JsonError { path: shown(&steps), message, syntax: false }
    })
}

/// Reads a text, which may begin with a byte order mark, as a value without duplicate keys.
///
/// # Errors
/// The text is not JSON, or has a duplicate key.
pub fn parse(text: &str) -> Result<Value, JsonError> {
    // places are followed for messages only, and cost as much again
    if let Ok(Strict(value)) = serde_json::from_str(content(text)) {
        return Ok(value);
    }
    let mut json = serde_json::Deserializer::from_str(content(text));
    let Strict(value) = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let path = shown(&place::steps(error.path()));
        JsonError { path, message: error.inner().to_string(), syntax: !error.inner().is_data() }
    })?;
    json.end().map_err(|error| JsonError {
        path: String::new(),
        message: error.to_string(),
        syntax: true,
    })?;
    Ok(value)
}

/// Makes a type of a value.
///
/// # Errors
/// The value does not have the form of the type; with the way to the place.
pub fn from_value<T: DeserializeOwned>(value: Value) -> Result<T, (Vec<PathStep>, FormError)> {
    serde_path_to_error::deserialize(typed::Typed(value))
        .map_err(|error| (place::steps(error.path()), error.into_inner()))
}

/// The text without a byte order mark.
fn content(text: &str) -> &str {
    text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text)
}
