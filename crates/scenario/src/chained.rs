//! Other files that extend each other by the rules of scenarios.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde_json::Value;
use strict_json::merge;

use crate::ScenarioError;
use crate::file::chain;
use crate::read::blame;

/// Reads a file of another format and those that it extends, merged, without comments. `locate` gets the content of each
/// file and its folder, to make the paths in it relative to the working directory.
///
/// # Errors
/// A file cannot be read or is invalid. The error names the file, the JSON path and the line.
pub fn read_chain<T: DeserializeOwned>(
    path: &Path,
    locate: impl Fn(&mut Value, &Path),
) -> Result<T, ScenarioError> {
    let chain = chain(path)?;
    let mut whole = Value::Null;
    for source in chain.iter().rev() {
        let mut value = source.value.clone();
        locate(&mut value, source.path.parent().unwrap_or(Path::new("")));
        if whole.is_null() {
            whole = value;
        } else {
            merge(&mut whole, &value);
        }
    }
    strict_json::from_value(whole).map_err(|(steps, error)| blame(&chain, &steps, &error))
}
