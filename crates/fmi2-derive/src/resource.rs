//! The content of one resource after its changes.

use std::fs;
use std::io;
use std::path::{Component, Path};

use fmi2_import::archive::FmuArchive;
use serde_json::{Map, Value};
use strict_json::{FormError, PathStep};

use crate::{Change, Changes, DeriveError, UnitSource};

/// The folder in an archive.
pub(crate) const FOLDER: &str = "resources/";
/// Member of a vehicle file that stands for a whole vehicle. The other members are then a patch of it, which the unit
/// applies.
const TRAIN: &str = "train";

/// A file of a unit's resources after its changes; `None` if the unit has no such file. The library is not asked.
///
/// # Errors
/// The unit or a file that replaces the resource cannot be read, or a patch does not fit.
pub fn read(unit: &UnitSource, name: &str) -> Result<Option<Vec<u8>>, DeriveError> {
    let failed = |source| DeriveError::Archive { unit: unit.fmu.clone(), source };
    let mut archive = FmuArchive::open(&unit.fmu).map_err(failed)?;
    let original = archive.read(&format!("{FOLDER}{name}")).map_err(failed)?;
    let Some(changes) = unit.resources.get(name) else { return Ok(original) };
    let known = archive.files().filter_map(|file| file.strip_prefix(FOLDER));
    let known: Vec<String> = known.map(str::to_owned).collect();
    Ok(changed(&unit.fmu, name, original, changes, &known)?.content)
}

/// Checks that a file of this name can be in an archive.
pub(crate) fn check_name(name: &str) -> Result<(), DeriveError> {
    let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    let plain = name.chars().all(|c| (' '..='~').contains(&c) && c != '\\' && c != ':');
    if name.is_empty() || name.ends_with('/') || !inside || !plain {
        return Err(DeriveError::Name { name: name.to_owned() });
    }
    Ok(())
}

/// Largest file that can become a resource.
const MAX_BYTES: u64 = 256 << 20;

/// The content of a file that replaces or patches a resource. Only regular files have an end for certain.
pub(crate) fn content_of(name: &str, path: &Path) -> Result<Vec<u8>, DeriveError> {
    let failed =
        |source| DeriveError::Read { name: name.to_owned(), path: path.to_owned(), source };
    let unfit = |text: String| failed(io::Error::new(io::ErrorKind::InvalidInput, text));
    let found = fs::metadata(path).map_err(failed)?;
    if !found.is_file() {
        return Err(unfit("it is not a regular file".to_owned()));
    }
    if found.len() > MAX_BYTES {
        let most = MAX_BYTES >> 20;
        return Err(unfit(format!(
            "it has {} bytes, but a resource has at most {most} MiB",
            found.len()
        )));
    }
    fs::read(path).map_err(failed)
}

/// Refuses a name beside which a resource of the unit cannot be: on some systems both are one file.
fn check_neighbours(name: &str, known: &[String]) -> Result<(), DeriveError> {
    let lower = name.to_ascii_lowercase();
    let clashes = |other: &String| {
        let other = other.to_ascii_lowercase();
        let within = |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.starts_with('/'));
        other == lower || within(&lower, &other) || within(&other, &lower)
    };
    match known.iter().find(|other| clashes(other)) {
        Some(other) if !known.iter().any(|known| known == name) => {
            Err(DeriveError::Clash { name: name.to_owned(), other: other.clone() })
        }
        _ => Ok(()),
    }
}

/// A resource after its changes.
#[derive(Debug)]
pub(crate) struct Changed {
    /// Its content; `None` if there is none.
    pub(crate) content: Option<Vec<u8>>,
    /// Whether it is the text of a file that was patched.
    pub(crate) patched: bool,
    /// Places in the patches of items that they add.
    pub(crate) added: Vec<String>,
}

/// The content of a resource of `unit` after its changes. `original` is that of the unit, `known` are the names of all of
/// its resources.
pub(crate) fn changed(
    unit: &Path,
    name: &str,
    original: Option<Vec<u8>>,
    changes: &Changes,
    known: &[String],
) -> Result<Changed, DeriveError> {
    check_name(name)?;
    check_neighbours(name, known)?;
    let (mut content, mut patched, mut added) = (original, false, Vec::new());
    for change in &changes.0 {
        content = Some(match change {
            Change::File(path) => content_of(name, path)?,
            Change::Patch(patch) => {
                let content = content.ok_or_else(|| DeriveError::Unknown {
                    unit: unit.to_owned(),
                    name: name.to_owned(),
                    suggestion: nearest(name, known),
                    resources: known.to_vec(),
                })?;
                let (content, more) = apply(name, &content, &Value::Object(patch.clone()))?;
                patched = true;
                added.extend(more);
                content
            }
        });
    }
    Ok(Changed { content, patched, added })
}

/// The known name that is most like this one.
pub(crate) fn nearest(name: &str, known: &[String]) -> Option<String> {
    patterns::suggest(name, known.iter().map(String::as_str)).map(str::to_owned)
}

/// The text of a JSON file after a patch, and the places in the patch of items that it adds.
fn apply(name: &str, content: &[u8], patch: &Value) -> Result<(Vec<u8>, Vec<String>), DeriveError> {
    let failed = |message: String| DeriveError::NotJson { name: name.to_owned(), message };
    let text = str::from_utf8(content).map_err(|error| failed(error.to_string()))?;
    let mut value = strict_json::parse(text).map_err(|error| failed(error.to_string()))?;
    let added = merged(&mut value, patch).map_err(|(steps, error)| DeriveError::Patch {
        name: name.to_owned(),
        place: strict_json::shown(&steps),
        message: error.to_string(),
    })?;
    let mut text = serde_json::to_vec_pretty(&value).map_err(|error| failed(error.to_string()))?;
    text.push(b'\n');
    Ok((text, added))
}

/// Applies a patch to a file. Where the file is a patch itself, one patch is made of both: a `null` must reach what only
/// the unit knows.
fn merged(value: &mut Value, patch: &Value) -> Result<Vec<String>, (Vec<PathStep>, FormError)> {
    let Some(patch) = patch.as_object().filter(|_| value.get(TRAIN).is_some()) else {
        return strict_json::merge_by_name(value, patch);
    };
    let (train, others): (Map<_, _>, Map<_, _>) =
        patch.clone().into_iter().partition(|(key, _)| key == TRAIN);
    let added = strict_json::merge_by_name(value, &train.into())?;
    strict_json::compose_by_name(value, &others.into())?;
    Ok(added)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn changes(value: Value) -> Changes {
        serde_json::from_value(value).unwrap()
    }

    #[test]
    fn analytic_changes_are_applied_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("my.json");
        fs::write(&file, r#"{"bodies": [{"name": "car", "mass": 0.1}]}"#).unwrap();
        let list = json!([{"x": 1}, file, {"bodies": {"car": {"mass": 2}}}, {"name": "mine"}]);
        let content =
            changed(Path::new("u.fmu"), "v.json", Some(b"{}".to_vec()), &changes(list), &[]);
        let value: Value = serde_json::from_slice(&content.unwrap().content.unwrap()).unwrap();
        assert_eq!(value, json!({"bodies": [{"name": "car", "mass": 2}], "name": "mine"}));
    }

    #[test]
    fn issue_null_stays_in_a_train_file() {
        let original = br#"{"name": "x", "train": {"cars": 3, "flexible_body": {}}, "bodies": {"a": {"mass": 1}}}"#;
        let patch = json!({
            "train": {"cars": 2, "flexible_body": null}, "bodies": {"a": null}, "observed": {"car_3": null}
        });
        let content =
            changed(Path::new("u.fmu"), "v.json", Some(original.to_vec()), &changes(patch), &[]);
        let value: Value = serde_json::from_slice(&content.unwrap().content.unwrap()).unwrap();
        let expected = json!({
            "name": "x", "train": {"cars": 2}, "bodies": {"a": null}, "observed": {"car_3": null}
        });
        assert_eq!(value, expected);
    }

    #[test]
    fn issue_a_resource_has_a_sane_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large");
        // without content, so it needs no space
        fs::File::create(&path).unwrap().set_len(MAX_BYTES + 1).unwrap();
        let error = content_of("v.json", &path).unwrap_err();
        let source = std::error::Error::source(&error).unwrap().to_string();
        assert_eq!(source, "it has 268435457 bytes, but a resource has at most 256 MiB");
    }

    #[test]
    fn refusal_names_files_and_patches() {
        let original = || Some(br#"{"bodies": [{"name": "car"}]}"#.to_vec());
        for (name, original, list, part) in [
            ("../v.json", original(), json!("x"), "inside of the unit's resources"),
            ("a\\b", None, json!("x"), "forward slashes"),
            ("", None, json!("x"), "inside"),
            ("v.json", original(), json!("/nowhere/x.json"), "cannot read /nowhere/x.json"),
            ("V.json", None, json!("x"), "beside the unit's v.json: the names differ only in case"),
            ("v.json/x", None, json!("x"), "beside the unit's v.json: one is a folder in the path"),
            ("v.json", original(), json!("/"), "cannot read /: it is not a regular file"),
            ("v.jsn", None, json!({"a": 1}), "did you mean v.json?; its resources: v.json, t.csv"),
            ("v.json", Some(b"x,y".to_vec()), json!({}), "resource v.json cannot be patched"),
            (
                "v.json",
                original(),
                json!({"bodies": {"cat": null}}),
                "bodies.cat: unknown name `cat`; did you mean `car`?",
            ),
        ] {
            let known = ["v.json", "t.csv"].map(str::to_owned);
            let error = changed(Path::new("u.fmu"), name, original, &changes(list), &known);
            let error = error.unwrap_err();
            let source = std::error::Error::source(&error).map(|source| format!(": {source}"));
            let message = format!("{error}{}", source.unwrap_or_default());
            assert!(message.contains(part), "{message}");
            assert!(error.help().is_some());
        }
    }
}
