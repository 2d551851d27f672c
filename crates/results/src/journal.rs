//! Finished parts of long work, so that interrupted work continues.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

/// A journal cannot be used.
#[derive(Debug, Error)]
pub enum JournalError {
    /// The file.
    #[error("cannot write {path}")]
    Write {
        /// Its path.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: io::Error,
    },
    /// The file has parts of other work.
    #[error("{path} belongs to another {work}")]
    Other {
        /// Its path.
        path: PathBuf,
        /// What kind of work.
        work: &'static str,
    },
}

impl JournalError {
    /// What to do.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Write { .. } => None,
            Self::Other { .. } => Some("choose another --out, or delete that file"),
        }
    }
}

/// A file with one line of JSON for each finished part. Its first line describes the work.
///
/// A part is written at once and as a whole line. What a killed process has left of a line is removed.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: Mutex<File>,
}

impl Journal {
    /// Opens or begins a file of a folder. `work` names the kind of work, and `task` describes it in one line. Returns the
    /// parts that an earlier run of the same task has finished; a line that is not a part is left out.
    ///
    /// # Errors
    /// The file cannot be written, or belongs to another task.
    pub fn open<T: DeserializeOwned>(
        folder: &Path,
        name: &str,
        work: &'static str,
        task: &str,
    ) -> Result<(Self, Vec<T>), JournalError> {
        let path = folder.join(name);
        let failed = |source| JournalError::Write { path: path.clone(), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut parts = Vec::new();
        let mut whole = 0;
        if let Ok(file) = File::open(&path) {
            let mut reader = BufReader::new(file);
            let mut line = String::new();
            while reader.read_line(&mut line).map_err(failed)? > 0 {
                // the last line of a killed process may be incomplete
                let Some(text) = line.strip_suffix('\n') else { break };
                if whole > 0 {
                    parts.extend(serde_json::from_str::<T>(text));
                } else if text != task {
                    return Err(JournalError::Other { path, work });
                }
                whole += line.len() as u64;
                line.clear();
            }
        }
        let file = OpenOptions::new().create(true).append(true).open(&path).map_err(failed)?;
        file.set_len(whole).map_err(failed)?;
        let journal = Self { path, file: Mutex::new(file) };
        if whole == 0 {
            journal.write(task)?;
        }
        Ok((journal, parts))
    }

    /// Adds a finished part.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add<T: Serialize>(&self, part: &T) -> Result<(), JournalError> {
        let failed = |source: serde_json::Error| self.failed(source.into());
        self.write(&serde_json::to_string(part).map_err(failed)?)
    }

    fn write(&self, line: &str) -> Result<(), JournalError> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(format!("{line}\n").as_bytes()).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> JournalError {
        JournalError::Write { path: self.path.clone(), source }
    }

    /// Removes the file when the work is complete.
    pub fn remove(self) {
        // a file that stays does no harm: the next run finds its parts
        let _ = std::fs::remove_file(self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(folder: &Path, task: &str) -> Result<(Journal, Vec<(usize, f64)>), JournalError> {
        Journal::open(folder, "parts.jsonl", "map", task)
    }

    #[test]
    fn invariant_parts_come_back_with_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let part = (3, 0.1 + 0.2);
        let (journal, parts) = open(folder.path(), "task").unwrap();
        assert!(parts.is_empty());
        journal.add(&part).unwrap();
        drop(journal);
        let path = folder.path().join("parts.jsonl");
        let whole = std::fs::read(&path).unwrap();
        // a killed process leaves half a line, which is removed
        std::fs::write(&path, [&whole[..], b"[4,0."].concat()).unwrap();
        let (journal, parts) = open(folder.path(), "task").unwrap();
        assert_eq!(parts, [part]);
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        journal.remove();
        assert!(!path.exists());
    }

    /// A number that JSON does not have, such as NaN, makes its part unreadable, but not those after it.
    #[test]
    fn invariant_a_part_that_is_unreadable_is_missing_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (journal, _) = open(folder.path(), "task").unwrap();
        journal.add(&(1, f64::NAN)).unwrap();
        journal.add(&(2, 0.5)).unwrap();
        assert_eq!(open(folder.path(), "task").unwrap().1, [(2, 0.5)]);
    }

    #[test]
    fn refusal_a_journal_of_another_task_is_not_touched() {
        let folder = tempfile::tempdir().unwrap();
        open(folder.path(), "task").unwrap().0.add(&(1, 0.5)).unwrap();
        let error = open(folder.path(), "other").unwrap_err();
        assert!(error.to_string().ends_with("parts.jsonl belongs to another map"), "{error}");
        assert_eq!(open(folder.path(), "task").unwrap().1.len(), 1);
    }
}
