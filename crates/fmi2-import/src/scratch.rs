//! Folders for temporary files: unpacked units.
//!
//! A folder is removed when its owner is dropped or the program ends. A process that is killed cannot
//! do that, so the next one does: as long as a process lives, its folders are locked, and a folder
//! with a name of this kind that is not locked belongs to nobody any more.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once, PoisonError};

use tempfile::TempDir;

/// What the names of the folders begin with.
const PREFIX: &str = "maglev-unit-";

/// Folders of this process.
static OURS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A folder for temporary files, removed when dropped.
#[derive(Debug)]
pub struct Scratch {
    folder: TempDir,
    /// held as long as the folder is in use; closed after the folder is removed
    _lock: Option<File>,
}

impl Scratch {
    /// Makes a folder, and once in each process removes those that others have left behind.
    pub fn new() -> io::Result<Self> {
        static TIDIED: Once = Once::new();
        // units may change the working directory, to which TMPDIR may be relative
        let place = std::path::absolute(std::env::temp_dir())?;
        TIDIED.call_once(|| system::tidy(&place));
        loop {
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(&place)?;
            // one that is not locked yet may be taken for a forgotten one and be gone
            if let Some(lock) = system::claim(folder.path())? {
                list(|ours| ours.push(folder.path().to_owned()));
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        list(|ours| ours.retain(|path| path != self.folder.path()));
    }
}

/// Removes all folders of this process, for an end that drops nothing.
pub fn remove_all() {
    // who is killed while it holds the list leaves the folders to the next process
    let Ok(mut ours) = OURS.try_lock() else { return };
    for path in ours.drain(..) {
        // what cannot be removed now is tried again by the next process
        let _ = fs::remove_dir_all(path);
    }
}

fn list(change: impl FnOnce(&mut Vec<PathBuf>)) {
    change(&mut OURS.lock().unwrap_or_else(PoisonError::into_inner));
}

#[cfg(unix)]
mod system {
    use std::fs::{self, DirEntry, File, TryLockError};
    use std::io;
    use std::os::unix::fs::MetadataExt as _;
    use std::path::Path;

    use super::PREFIX;

    /// Locks a folder of this process. `None` if it has been removed, without a lock where the file
    /// system knows none.
    #[expect(clippy::option_option, reason = "the outer one is about the folder")]
    pub(super) fn claim(path: &Path) -> io::Result<Option<Option<File>>> {
        let lock = match File::open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        match lock.try_lock() {
            // somebody is about to remove it
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(_)) => return Ok(Some(None)),
            Ok(()) => {}
        }
        Ok(path.exists().then_some(Some(lock)))
    }

    /// Removes the folders that dead processes of this user have left.
    pub(super) fn tidy(place: &Path) {
        let Ok(entries) = fs::read_dir(place) else { return };
        for entry in entries.flatten() {
            if entry.file_name().to_string_lossy().starts_with(PREFIX) {
                // what cannot be removed stays
                let _ = remove_forgotten(&entry);
            }
        }
    }

    fn remove_forgotten(entry: &DirEntry) -> io::Result<()> {
        let about = entry.metadata()?;
        // SAFETY: asks for a number
        if !about.is_dir() || about.uid() != unsafe { libc::geteuid() } {
            return Ok(());
        }
        let lock = File::open(entry.path())?;
        match lock.try_lock() {
            Ok(()) => fs::remove_dir_all(entry.path()),
            Err(_) => Ok(()),
        }
    }
}

#[cfg(not(unix))]
mod system {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    /// Folders cannot be locked here.
    #[expect(clippy::option_option, clippy::unnecessary_wraps, reason = "as on Unix")]
    pub(super) fn claim(_: &Path) -> io::Result<Option<Option<File>>> {
        Ok(Some(None))
    }

    /// Without locks it is not known who still lives.
    pub(super) fn tidy(_: &Path) {}
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn issue_only_folders_that_nobody_holds_are_removed() {
        let place = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let path = place.path().join(name);
            fs::create_dir_all(path.join("binaries")).unwrap();
            fs::write(path.join("binaries/x"), "x").unwrap();
            path
        };
        let (live, dead) = (make("maglev-unit-live"), make("maglev-unit-dead"));
        let (other, file) = (make("somebody"), place.path().join("maglev-unit-file"));
        fs::write(&file, "").unwrap();
        let lock = system::claim(&live).unwrap().unwrap();
        assert!(lock.is_some());
        system::tidy(place.path());
        assert!(live.exists() && !dead.exists() && other.exists() && file.exists());
        // what another is about to remove, or has removed, is not taken
        assert!(system::claim(&live).unwrap().is_none() && system::claim(&dead).unwrap().is_none());
        drop(lock);
        system::tidy(place.path());
        assert!(!live.exists());
    }

    #[test]
    fn issue_folders_are_removed_with_their_owner() {
        let scratch = Scratch::new().unwrap();
        let path = scratch.path().to_owned();
        assert!(path.is_absolute() && path.is_dir());
        drop(scratch);
        assert!(!path.exists());
    }
}
