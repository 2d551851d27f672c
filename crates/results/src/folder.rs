//! Which files of a results folder belong to a run, and to which: `run-files.json`.
//!
//! A folder holds the files of one run. A new run removes those of the earlier one before it writes
//! its first file, and nothing else: what a run has written is listed, and other files in the folder
//! are the user's. Bytes and checksum of each finished file are in the list, so that a file of
//! another run is recognised although tables and pictures of equal runs are equal to the byte and
//! carry no mark.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io;
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::file::{Fingerprint, fingerprint, partial, reserve, write_whole};
use crate::{AS_RUN, CHECKPOINT, EVENTS, FILES, MODES, PARQUET, REPORT, SUMMARY, TABLE};

/// Files that every run writes, or that are made of its results. The table of a run that asks for
/// Parquet only is there until the run ends.
const ALWAYS: [&str; 6] = [SUMMARY, TABLE, EVENTS, AS_RUN, CHECKPOINT, REPORT];
/// Files that a resumed run continues, or that hold for it as well.
const CONTINUED: [&str; 5] = [TABLE, EVENTS, AS_RUN, CHECKPOINT, MODES];
/// Files that versions without a list wrote, besides those that summary.json or the scenario names.
const UNLISTED: [&str; 3] = [PARQUET, MODES, FILES];
/// Files that have no checksum in the list: they say themselves whose they are, or still change.
const UNSTAMPED: [&str; 4] = [SUMMARY, AS_RUN, CHECKPOINT, REPORT];

/// The content of the list.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
struct List {
    /// Of the run; nothing before the first run, when there are only modes.
    run: Option<String>,
    /// By name; nothing of a file that is not complete.
    files: BTreeMap<String, Option<Fingerprint>>,
}

/// Why a folder cannot be taken for a run that continues.
#[derive(Debug, Error)]
pub enum FolderError {
    /// The folder cannot be used.
    #[error("the results {path} cannot be continued")]
    Unusable {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        #[source]
        source: io::Error,
    },
    /// The folder holds the files of another run.
    #[error(
        "the files in {folder} are of two runs: checkpoint.bin is of run {run}, run-files.json of \
         run {other}"
    )]
    OtherRun {
        /// The results folder.
        folder: PathBuf,
        /// The checkpoint's run.
        run: String,
        /// The run that the folder belongs to.
        other: String,
    },
}

/// The folder of a run that is going on. Others are kept out until it is dropped.
pub struct Folder {
    path: PathBuf,
    list: List,
    _lock: Option<File>,
}

impl Folder {
    /// Makes the folder one of a new run, which writes `also` beside the files of every run: takes
    /// away what an earlier run has written. At any moment, the files in it are of one run.
    pub fn claim(path: &Path, also: impl IntoIterator<Item = String>) -> io::Result<Self> {
        let lock = lock(path)?;
        let earlier = List::read(path).unwrap_or_else(|| List::guess(path));
        let names = ALWAYS.into_iter().map(str::to_owned).chain(also);
        let list = List { run: Some(new_id()), files: names.map(|name| (name, None)).collect() };
        // a disk that is full or read-only is noticed before anything is removed
        let prepared = partial(&path.join(FILES));
        let written = fs::write(&prepared, list.text()?).and_then(|()| earlier.remove(path, &[]));
        if let Err(error) = written {
            let _ = fs::remove_file(&prepared);
            return Err(error);
        }
        list.write(path)?;
        Ok(Self { path: path.to_owned(), list, _lock: lock })
    }

    /// Takes the folder for a run that continues from its checkpoint.
    pub fn reclaim(
        path: &Path,
        run: &str,
        also: impl IntoIterator<Item = String>,
    ) -> Result<Self, FolderError> {
        let lock =
            lock(path).map_err(|source| FolderError::Unusable { path: path.to_owned(), source })?;
        let mut list = List::read(path).unwrap_or_default();
        match &list.run {
            Some(other) if other != run => {
                return Err(FolderError::OtherRun {
                    folder: path.to_owned(),
                    run: run.to_owned(),
                    other: other.clone(),
                });
            }
            _ => list.run = Some(run.to_owned()),
        }
        for name in ALWAYS.into_iter().map(str::to_owned).chain(also) {
            list.files.entry(name).or_default();
        }
        Ok(Self { path: path.to_owned(), list, _lock: lock })
    }

    /// Removes what the run wrote when it was stopped and will write again.
    pub fn reopen(&mut self) -> io::Result<()> {
        self.list.files.values_mut().for_each(|stamp| *stamp = None);
        self.list.write(&self.path)?;
        self.list.remove(&self.path, &CONTINUED)
    }

    /// The run's identifier.
    pub fn run(&self) -> &str {
        self.list.run.as_deref().unwrap_or_default()
    }

    /// Lists the files that are there now as complete, but for those that may still change. To be
    /// called again when these have ended.
    pub fn complete(&mut self, still_changing: &[&str]) -> io::Result<()> {
        let Self { path, list, .. } = self;
        // a report may have been made meanwhile
        let now = List::read(path).filter(|now| now.run == list.run).unwrap_or_default();
        for (name, stamp) in now.files {
            list.files.entry(name).or_insert(stamp);
        }
        list.files.retain(|name, _| name == REPORT || path.join(name).exists());
        for (name, entry) in &mut list.files {
            let open = still_changing.contains(&name.as_str());
            if !open && entry.is_none() {
                *entry = stamp(path, name)?;
            }
        }
        list.write(path)
    }
}

/// Adds files that were made of a run's results to its list, so that they go when another run takes
/// the folder. Names are relative to the folder.
///
/// # Errors
/// A file cannot be read, or the list not be written.
pub fn add_files<'a>(folder: &Path, names: impl IntoIterator<Item = &'a str>) -> io::Result<()> {
    let mut list = List::read(folder).unwrap_or_else(|| List::guess(folder));
    for name in names {
        list.files.insert(name.to_owned(), stamp(folder, name)?);
    }
    list.write(folder)
}

impl List {
    fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&fs::read(folder.join(FILES)).ok()?).ok()
    }

    /// What an earlier version, which had no list, has written; nothing where no run has been.
    fn guess(folder: &Path) -> Self {
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

    fn text(&self) -> io::Result<Vec<u8>> {
        let mut text = serde_json::to_vec_pretty(self)?;
        text.push(b'\n');
        Ok(text)
    }

    fn write(&self, folder: &Path) -> io::Result<()> {
        write_whole(&folder.join(FILES), &self.text()?)
    }

    /// Removes the listed files, complete or not, but for some. The summary goes first: without it
    /// the rest is no finished run.
    fn remove(&self, folder: &Path, keep: &[&str]) -> io::Result<()> {
        let names = self.files.keys().map(String::as_str);
        let rest = names.filter(|name| *name != FILES && *name != ALWAYS[0]);
        for name in ALWAYS[..1].iter().copied().chain(rest) {
            // nobody but a run's own list may name files, and only files below the folder
            let below = Path::new(name).components().all(|it| matches!(it, Component::Normal(_)));
            if !below || keep.contains(&name) || !self.files.contains_key(name) {
                continue;
            }
            let path = folder.join(name);
            remove(&partial(&path))?;
            remove(&path)?;
            if let Some(parent) = path.parent().filter(|parent| *parent != folder) {
                // goes if nothing else is in it
                let _ = fs::remove_dir(parent);
            }
        }
        Ok(())
    }
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        // a folder of that name is somebody else's
        Err(_) if path.is_dir() => Ok(()),
        removed => removed,
    }
}

/// The stamp of a file; nothing where there is no file, or one that has none.
fn stamp(folder: &Path, name: &str) -> io::Result<Option<Fingerprint>> {
    if UNSTAMPED.contains(&name) {
        return Ok(None);
    }
    match fingerprint(&folder.join(name)) {
        Ok(stamp) => Ok(Some(stamp)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Keeps other runs out of the folder, and is kept out by them.
fn lock(path: &Path) -> io::Result<Option<File>> {
    // where a folder cannot be locked, and of earlier versions, tables are
    for name in [EVENTS, TABLE] {
        if let Ok(table) = File::open(partial(&path.join(name))) {
            reserve(&table)?;
        }
    }
    if !cfg!(unix) {
        return Ok(None);
    }
    let folder = File::open(path)?;
    reserve(&folder)?;
    Ok(Some(folder))
}

/// An identifier that no other run has: 128 random bits in the form of a UUID (version 4).
fn new_id() -> String {
    // each state has random keys of the operating system
    let word = || RandomState::new().build_hasher().finish();
    let (high, low) = (word(), word());
    let (version, variant) = (0x4000 | high & 0xfff, 0x8000 | low >> 48 & 0x3fff);
    format!(
        "{:08x}-{:04x}-{version:04x}-{variant:04x}-{:012x}",
        high >> 32,
        high >> 16 & 0xffff,
        low & 0xffff_ffff_ffff
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|it| it.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// All that a run lists goes with the next one, and nothing that it does not list.
    #[test]
    fn issue_a_folder_belongs_to_one_run() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path();
        let write = |name: &str| fs::write(path.join(name), name).unwrap();
        write("mine.csv");
        write("results.parquet");
        let mut first = Folder::claim(path, ["p.svg".to_owned()]).unwrap();
        let error = Folder::claim(path, []).err().unwrap().to_string();
        assert!(error.contains("another run"), "{error}");
        for name in ["results.csv", "p.svg", "summary.json", "events.csv", "figure.svg"] {
            write(name);
        }
        write("checkpoint.bin.partial");
        fs::create_dir(path.join("figures")).unwrap();
        write("figures/a.svg");
        first.complete(&[]).unwrap();
        add_files(path, ["figures/a.svg"]).unwrap();
        let id = first.run().to_owned();
        drop(first);
        let list = List::read(path).unwrap();
        assert_eq!((list.run.as_ref(), id.len()), (Some(&id), 36));
        assert_eq!(list.files["p.svg"].unwrap().crc32, crc32fast::hash(b"p.svg"));
        assert!(!list.files.contains_key("figure.svg") && list.files["summary.json"].is_none());
        let second = Folder::claim(path, []).unwrap();
        assert_ne!(second.run(), id);
        let left = ["checkpoint.bin.partial", "figure.svg", "mine.csv", "results.parquet", FILES];
        assert_eq!(names(path), left);
    }

    /// What was written before there was a list is found by what the summary and the scenario name.
    #[test]
    fn issue_folders_of_earlier_versions_are_cleared_too() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path();
        let write = |name: &str, text: &str| fs::write(path.join(name), text).unwrap();
        write("results.parquet", "somebody's");
        drop(Folder::claim(path, []).unwrap());
        assert_eq!(names(path), ["results.parquet", FILES]);
        fs::remove_file(path.join(FILES)).unwrap();
        write("scenario-as-run.json", r#"{"instances": {}, "plots": [{"file": "p.svg"}]}"#);
        write("p.svg", "");
        write("q.svg", "");
        write("results.csv.partial", "time\n");
        drop(Folder::claim(path, []).unwrap());
        assert_eq!(names(path), ["q.svg", FILES]);
    }

    #[test]
    fn invariant_a_list_cannot_name_files_elsewhere() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out");
        fs::create_dir(&path).unwrap();
        fs::write(place.path().join("precious"), "").unwrap();
        let list = r#"{"run": "x", "files": {"../precious": null, "/etc/none": null}}"#;
        fs::write(path.join(FILES), list).unwrap();
        drop(Folder::claim(&path, []).unwrap());
        assert!(place.path().join("precious").exists());
    }
}
