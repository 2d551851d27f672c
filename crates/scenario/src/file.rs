//! One scenario file, and the files that it extends.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use strict_json::{FormError, PathStep, shown};

use crate::ScenarioError;

/// Key of the file that is extended.
const EXTENDS: &str = "extends";

/// One file on its own.
pub(crate) struct ScenarioFile {
    pub(crate) path: PathBuf,
    text: String,
    /// Its content without comments and without `extends`.
    pub(crate) value: Value,
    /// The file that it extends, as written.
    pub(crate) extends: Option<String>,
}

/// A file and those that it extends, in this order.
pub(crate) fn chain(path: &Path) -> Result<Vec<ScenarioFile>, ScenarioError> {
    let text = fs::read_to_string(path)
        .map_err(|source| ScenarioError::Read { path: path.to_owned(), source })?;
    chain_of(text, path)
}

/// The text of a file, and the files that it extends, in this order.
pub(crate) fn chain_of(text: String, path: &Path) -> Result<Vec<ScenarioFile>, ScenarioError> {
    let mut chain = vec![ScenarioFile::new(text, path)?];
    // canonical paths, since a file has many paths
    let mut seen = HashSet::from([canonical(path)]);
    while let Some((source, extends)) =
        chain.last().and_then(|source| Some((source, source.extends.as_ref()?)))
    {
        let base = source.path.parent().unwrap_or(Path::new("")).join(extends);
        if !seen.insert(canonical(&base)) {
            let mut files: Vec<_> = chain.iter().map(|source| source.path.clone()).collect();
            files.push(base);
            return Err(ScenarioError::Cycle { files });
        }
        let text = fs::read_to_string(&base).map_err(|error| ScenarioError::Base {
            path: source.path.clone(),
            base: base.clone(),
            source: error,
        })?;
        chain.push(ScenarioFile::new(text, &base)?);
    }
    Ok(chain)
}

/// The canonical path. A missing file keeps its path; reading it fails later.
fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

impl ScenarioFile {
    pub(crate) fn new(text: String, path: &Path) -> Result<Self, ScenarioError> {
        let value = strict_json::parse(&text).map_err(|error| {
            let (path, message) = (path.to_owned(), error.message);
            if error.syntax {
                ScenarioError::NotJson { path, message }
            } else {
                ScenarioError::Json { path, at: place(error.path), message }
            }
        })?;
        let mut file = Self { path: path.to_owned(), text, value, extends: None };
        if let Err((steps, error)) = strict_json::strip_comments(&mut file.value) {
            return Err(file.error(&steps, &error));
        }
        let extends = file.value.as_object_mut().and_then(|it| it.shift_remove(EXTENDS));
        file.extends = match extends {
            None => None,
            Some(Value::String(file)) => Some(file),
            Some(other) => {
                let error = FormError::new(format!("{other} is not the path of a scenario file"));
                return Err(file.error(&[PathStep::Key(EXTENDS.to_owned())], &error));
            }
        };
        Ok(file)
    }

    /// An error at a place of this file.
    pub(crate) fn error(&self, steps: &[PathStep], error: &FormError) -> ScenarioError {
        let message = error.located(&self.text, steps);
        ScenarioError::Json { path: self.path.clone(), at: place(shown(steps)), message }
    }
}

fn place(path: String) -> String {
    if path.is_empty() { "the top level".to_owned() } else { path }
}
