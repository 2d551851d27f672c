//! Reads a vehicle file: all bodies and joints, or a train with changes.

use serde_json::{Map, Value};
use strict_json::{FormError, JsonError, PathStep, shown};

use crate::description::VehicleDescription;
use crate::error::{Error, invalid};
use crate::train::{KEY, TrainDescription};

/// Keys that every whole vehicle has.
const NEEDED: [&str; 4] = ["name", "gravity", "nominal_gap", "bodies"];
/// Path of the whole document in messages.
const WHOLE: &str = "$";

/// Reads and checks a vehicle file.
pub(crate) fn read(text: &str) -> Result<VehicleDescription, Error> {
    // a whole vehicle without a fault needs no document, which is made for messages and for trains only
    if let Ok(description) = serde_json::from_str::<VehicleDescription>(text) {
        description.check()?;
        return Ok(description);
    }
    let mut document = strict_json::parse(text).map_err(|error| {
        let JsonError { path, message, .. } = error;
        Error::Read { path: if path.is_empty() { WHOLE.to_owned() } else { path }, message }
    })?;
    let train = document.as_object_mut().and_then(|members| members.shift_remove(KEY));
    let (Some(train), Value::Object(changes)) = (train, &document) else {
        check_keys(text, &document)?;
        let description: VehicleDescription = typed(text, document, Vec::new())?;
        description.check()?;
        return Ok(description);
    };
    check_changes(changes)?;
    let train: TrainDescription = typed(text, train, vec![PathStep::Key(KEY.to_owned())])?;
    let expanded = train.expand()?;
    if changes.is_empty() {
        return Ok(expanded);
    }
    changed(text, &expanded, changes)
}

/// A train whose named items are changed, and the other keys replaced.
fn changed(
    text: &str,
    train: &VehicleDescription,
    changes: &Map<String, Value>,
) -> Result<VehicleDescription, Error> {
    let mut document = serde_json::to_value(train)
        .map_err(|e| Error::Read { path: WHOLE.to_owned(), message: e.to_string() })?;
    strict_json::merge_by_name(&mut document, &Value::Object(changes.clone())).map_err(
        |(steps, error)| Error::Read { path: path(&steps), message: error.located(text, &steps) },
    )?;
    check_nulls(text, changes)?;
    let result = strict_json::from_value(document.clone())
        .map_err(|(steps, error)| Error::Read { path: path(&steps), message: error.to_string() })
        .and_then(|description: VehicleDescription| description.check().map(|()| description));
    result.map_err(|error| named(error, &document))
}

/// The types of a whole vehicle do not know the key `train`, so its misspellings are found here.
fn check_keys(text: &str, document: &Value) -> Result<(), Error> {
    let mut keys = document.as_object().into_iter().flat_map(Map::keys);
    let Some(key) = keys.find(|key| patterns::suggest(key, [KEY]).is_some()) else { return Ok(()) };
    let steps = [PathStep::Key(key.clone())];
    let error = FormError::new(format!("unknown field `{key}`; did you mean `{KEY}`?"));
    Err(Error::Read { path: path(&steps), message: error.located(text, &steps) })
}

/// A train beside a whole vehicle: what comes of patching a whole vehicle file with a train. Its bodies would
/// silently take the places of the train's.
fn check_changes(changes: &Map<String, Value>) -> Result<(), Error> {
    if !NEEDED.iter().all(|key| changes.contains_key(*key)) {
        return Ok(());
    }
    let message = format!(
        "the file is a whole vehicle already: it has `{}`; a train cannot patch it, so write the train to a \
         file of its own that replaces this one",
        NEEDED.join("`, `")
    );
    Err(invalid(KEY, message))
}

/// A null leaves nothing behind, so the types do not see its key.
fn check_nulls(text: &str, changes: &Map<String, Value>) -> Result<(), Error> {
    for key in changes.iter().filter(|(_, change)| change.is_null()).map(|(key, _)| key) {
        let alone = serde_json::json!({ key.as_str(): null });
        let Err((steps, error)) = strict_json::from_value::<VehicleDescription>(alone) else {
            continue;
        };
        // the path of an unknown key leads to it; that of a key whose value or whose neighbours are missing does not matter
        if error.to_string().starts_with("unknown field") {
            return Err(Error::Read { path: path(&steps), message: error.located(text, &steps) });
        }
    }
    Ok(())
}

/// A path in words.
fn path(steps: &[PathStep]) -> String {
    let path = shown(steps);
    if path.is_empty() { WHOLE.to_owned() } else { path }
}

/// Makes a type of the part of the text to which `way` leads.
fn typed<T: serde::de::DeserializeOwned>(
    text: &str,
    value: Value,
    way: Vec<PathStep>,
) -> Result<T, Error> {
    strict_json::from_value(value).map_err(|(steps, error)| {
        let steps: Vec<PathStep> = way.into_iter().chain(steps).collect();
        Error::Read { path: path(&steps), message: error.located(text, &steps) }
    })
}

/// The error with the item's name in its path: numbers of items of an expanded train mean nothing to its
/// author.
fn named(error: Error, document: &Value) -> Error {
    let with_name = |path: String| {
        let (list, rest) = path.split_once('[')?;
        let (index, rest) = rest.split_once(']')?;
        let item = document.get(list)?.get(index.parse::<usize>().ok()?)?;
        let name = item.get("name").or_else(|| item.get("joint"))?.as_str()?;
        Some(format!("{list}[{name}]{rest}"))
    };
    match error {
        Error::Read { path, message } => {
            Error::Read { path: with_name(path.clone()).unwrap_or(path), message }
        }
        Error::Invalid { path, message } => {
            Error::Invalid { path: with_name(path.clone()).unwrap_or(path), message }
        }
        other => other,
    }
}
