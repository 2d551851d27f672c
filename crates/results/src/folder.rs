//! The results folder of a run. It contains the files of one run: a new run removes what the earlier one
//! has written, and nothing else, before it writes its first file.

use std::fs::{self, File};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::file::{partial, reserve};
use crate::file_list::{ALWAYS, CONTINUED, FileList, stamp};
use crate::{EVENTS, FILES, REPORT, TABLE};

/// Why a run cannot continue in a folder.
#[derive(Debug, Error)]
pub enum FolderError {
    /// The folder cannot be used.
    #[error("cannot continue the results in {path}")]
    Unusable {
        /// The folder.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// The folder holds the files of another run.
    #[error(
        "the files in {folder} belong to two runs: checkpoint.bin to run {run}, run-files.json to \
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

/// The folder of a run in progress. Other runs cannot use it until it is dropped.
pub struct Folder {
    path: PathBuf,
    list: FileList,
    _lock: Option<File>,
}

impl Folder {
    /// Prepares the folder for a new run, which writes `also` besides the files of every run. Removes
    /// what an earlier run has written. At any moment, the files in it belong to one run.
    ///
    /// # Errors
    /// Another run is using the folder, or it cannot be written.
    pub fn claim(path: &Path, also: impl IntoIterator<Item = String>) -> io::Result<Self> {
        let lock = lock(path)?;
        let earlier = FileList::read(path).unwrap_or_else(|| FileList::guess(path));
        let names = ALWAYS.into_iter().map(str::to_owned).chain(also);
        let list =
            FileList { run: Some(new_id()), files: names.map(|name| (name, None)).collect() };
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

    /// Prepares the folder for a run that continues from its checkpoint.
    ///
    /// # Errors
    /// The folder belongs to another run, another run is using it, or it cannot be written.
    pub fn reclaim(
        path: &Path,
        run: &str,
        also: impl IntoIterator<Item = String>,
    ) -> Result<Self, FolderError> {
        let lock =
            lock(path).map_err(|source| FolderError::Unusable { path: path.to_owned(), source })?;
        let mut list = FileList::read(path).unwrap_or_default();
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

    /// Removes the files that the run wrote when it was stopped and will write again.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn reopen(&mut self) -> io::Result<()> {
        self.list.files.values_mut().for_each(|stamp| *stamp = None);
        self.list.write(&self.path)?;
        self.list.remove(&self.path, &CONTINUED)
    }

    /// Identifier of the run.
    #[must_use]
    pub fn run(&self) -> &str {
        self.list.run.as_deref().unwrap_or_default()
    }

    /// Lists the existing files as complete, except those in `still_changing`. Call it again when these
    /// are complete.
    ///
    /// # Errors
    /// A file cannot be read, or the list cannot be written.
    pub fn complete(&mut self, still_changing: &[&str]) -> io::Result<()> {
        let Self { path, list, .. } = self;
        // a report may have been written meanwhile
        let now = FileList::read(path).filter(|now| now.run == list.run).unwrap_or_default();
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

/// Adds files that were made from a run's results to its list, so that the next run in the folder
/// removes them. Names are relative to the folder.
///
/// # Errors
/// A file cannot be read, or the list cannot be written.
pub fn add_files<'a>(folder: &Path, names: impl IntoIterator<Item = &'a str>) -> io::Result<()> {
    let mut names = names.into_iter().peekable();
    if names.peek().is_none() {
        // the folder may be read-only
        return Ok(());
    }
    let mut list = FileList::read(folder).unwrap_or_else(|| FileList::guess(folder));
    for name in names {
        list.files.insert(name.to_owned(), stamp(folder, name)?);
    }
    list.write(folder)
}

/// Reserves the folder for this run.
fn lock(path: &Path) -> io::Result<Option<File>> {
    // where folders cannot be locked, and by earlier versions, tables are locked
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

/// A random UUID (version 4) as the identifier of a run.
fn new_id() -> String {
    // each state has random keys from the operating system
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

    /// The next run removes what the earlier one has listed, and nothing else.
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
        let list = FileList::read(path).unwrap();
        assert_eq!((list.run.as_ref(), id.len()), (Some(&id), 36));
        assert_eq!(list.files["p.svg"].unwrap().crc32, crc32fast::hash(b"p.svg"));
        assert!(!list.files.contains_key("figure.svg") && list.files["summary.json"].is_none());
        let second = Folder::claim(path, []).unwrap();
        assert_ne!(second.run(), id);
        let left = ["checkpoint.bin.partial", "figure.svg", "mine.csv", "results.parquet", FILES];
        assert_eq!(names(path), left);
    }

    /// Without a list, summary and scenario name the files.
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
