//! Reads text and JSON files of a results folder.

use std::io;
use std::path::Path;

use serde::de::DeserializeOwned;

use crate::ReadError;

/// Reads a text file, `None` if it does not exist. Leaves out a byte order mark that an editor added.
pub(crate) fn text(path: &Path) -> Result<Option<String>, ReadError> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Some(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(ReadError::File { path: path.to_owned(), source }),
    }
}

/// Reads a JSON file, `None` if it does not exist.
pub(crate) fn json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, ReadError> {
    let parsed = text(path)?.map(|text| serde_json::from_str(&text)).transpose();
    parsed.map_err(|error| damaged(path, &error))
}

pub(crate) fn damaged(path: &Path, error: &serde_json::Error) -> ReadError {
    ReadError::Json { path: path.to_owned(), message: error.to_string() }
}
