//! run-files.json: which files of a results folder a run has written.
//!
//! The list contains length and checksum of each finished file, because tables and pictures contain
//! no mark of their run. Files that are not listed are the user's.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Component, Path};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::file::{Fingerprint, fingerprint, partial, write_whole};
use crate::{
    AS_RUN, CHECKPOINT, EVENTS, FILES, MODE_SHAPES, MODES, PARQUET, REPORT, RESPONSE, SUMMARY,
    TABLE,
};

/// Files that every run writes, or that are made from its results. A run that is asked for Parquet only
/// has a table as text until it ends.
pub(crate) const ALWAYS: [&str; 6] = [SUMMARY, TABLE, EVENTS, AS_RUN, CHECKPOINT, REPORT];
/// Files that a resumed run continues, or that are still valid for it.
pub(crate) const CONTINUED: [&str; 7] =
    [TABLE, EVENTS, AS_RUN, CHECKPOINT, MODES, MODE_SHAPES, RESPONSE];
/// Files that versions without a list wrote, in addition to those that summary.json or the scenario
/// names.
const UNLISTED: [&str; 3] = [PARQUET, MODES, FILES];
/// Files without a checksum in the list: they name their run themselves, or may still change.
const UNSTAMPED: [&str; 4] = [SUMMARY, AS_RUN, CHECKPOINT, REPORT];

/// The content of run-files.json.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct FileList {
    /// Identifier of the run; none before the first run, when there is only modes.json.
    pub(crate) run: Option<String>,
    /// Files by name; no fingerprint for one that is not complete.
    pub(crate) files: BTreeMap<String, Option<Fingerprint>>,
}

impl FileList {
    pub(crate) fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&fs::read(folder.join(FILES)).ok()?).ok()
    }

    /// The files that an earlier version without a list has written; empty if there was no run.
    pub(crate) fn guess(folder: &Path) -> Self {
        let json = |name: &str| -> Option<Value> {
            serde_json::from_slice(&fs::read(folder.join(name)).ok()?).ok()
        };
        let summary = json(SUMMARY).filter(|it| it.get("master_version").is_some());
        let scenario = json(AS_RUN).filter(|it| it.get("instances").is_some());
        if summary.is_none() && scenario.is_none() {
            return Self::default();
        }
        let texts = |value: Option<&Value>| -> Vec<String> {
            let items = value.and_then(Value::as_array).into_iter().flatten();
            items.filter_map(|item| item.as_str().map(str::to_owned)).collect()
        };
        let mut names: Vec<String> =
            ALWAYS.iter().chain(&UNLISTED).map(|&name| name.to_owned()).collect();
        for key in ["tables", "pictures"] {
            names.extend(texts(summary.as_ref().and_then(|it| it.get(key))));
        }
        let plots = scenario.as_ref().and_then(|it| it.get("plots")?.as_array());
        names.extend(
            plots
                .into_iter()
                .flatten()
                .filter_map(|plot| plot.get("file").and_then(Value::as_str).map(str::to_owned)),
        );
        Self { run: None, files: names.into_iter().map(|name| (name, None)).collect() }
    }

    pub(crate) fn text(&self) -> io::Result<Vec<u8>> {
        let mut text = serde_json::to_vec_pretty(self)?;
        text.push(b'\n');
        Ok(text)
    }

    pub(crate) fn write(&self, folder: &Path) -> io::Result<()> {
        write_whole(&folder.join(FILES), &self.text()?)
    }

    /// Removes the listed files, complete or not, except those in `keep`. The summary goes first: a folder
    /// without it does not look like a finished run.
    pub(crate) fn remove(&self, folder: &Path, keep: &[&str]) -> io::Result<()> {
        let names = self.files.keys().map(String::as_str);
        let rest = names.filter(|name| *name != FILES && *name != ALWAYS[0]);
        for name in ALWAYS[..1].iter().copied().chain(rest) {
            // a list may be forged: only files below the folder
            let below = Path::new(name).components().all(|it| matches!(it, Component::Normal(_)));
            if !below || keep.contains(&name) || !self.files.contains_key(name) {
                continue;
            }
            let path = folder.join(name);
            remove(&partial(&path))?;
            remove(&path)?;
            if let Some(parent) = path.parent().filter(|parent| *parent != folder) {
                // fails if it contains anything else
                let _ = fs::remove_dir(parent);
            }
        }
        Ok(())
    }
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        // a folder of that name is not of a run
        Err(_) if path.is_dir() => Ok(()),
        removed => removed,
    }
}

/// The fingerprint of a file; none if there is no such file, or if the list has none for it.
pub(crate) fn stamp(folder: &Path, name: &str) -> io::Result<Option<Fingerprint>> {
    if UNSTAMPED.contains(&name) {
        return Ok(None);
    }
    match fingerprint(&folder.join(name)) {
        Ok(stamp) => Ok(Some(stamp)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}
