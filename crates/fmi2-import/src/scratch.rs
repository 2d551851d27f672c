//! Folders for temporary files, such as unpacked FMUs.
//!
//! A folder is removed when its owner is dropped or the program ends. A process that is killed cannot do
//! that, so the next process does: a process locks its folders as long as it lives, and a folder with such
//! a name that is not locked has no owner any more.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once, PoisonError};

use tempfile::TempDir;

/// Prefix of the names of the folders.
const PREFIX: &str = "maglev-unit-";

/// Folders of this process.
static OURS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A folder for temporary files, removed when dropped.
#[derive(Debug)]
pub struct Scratch {
    folder: TempDir,
    /// released after the folder is removed
    _lock: Option<File>,
}

impl Scratch {
    /// Creates a folder. The first call in a process removes folders that dead processes left behind.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub fn new() -> io::Result<Self> {
        static TIDIED: Once = Once::new();
        // TMPDIR may be relative to the working directory, which FMUs may change
        let place = std::path::absolute(std::env::temp_dir())?;
        TIDIED.call_once(|| system::tidy(&place));
        loop {
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(&place)?;
            // another process may have removed it before it was locked
            if let Some(lock) = system::claim(folder.path())? {
                list(|ours| ours.push(folder.path().to_owned()));
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        list(|ours| ours.retain(|path| path != self.folder.path()));
    }
}

/// Removes all folders of this process, for an exit that drops nothing.
pub(crate) fn remove_all() {
    // if another thread holds the list, the next process removes the folders
    let Ok(mut ours) = OURS.try_lock() else { return };
    for path in ours.drain(..) {
        // if it cannot be removed now, the next process tries again
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

    /// Locks a folder of this process. `None` if it has been removed; `Some(None)` if the file system has
    /// no locks.
    #[expect(clippy::option_option, reason = "the outer one is about the folder")]
    pub(super) fn claim(path: &Path) -> io::Result<Option<Option<File>>> {
        let lock = match File::open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            opened => opened?,
        };
        match lock.try_lock() {
            // another process is about to remove it
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
                // if it cannot be removed, it stays
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

    /// Without locks it is not known which folders are in use.
    pub(super) fn tidy(_: &Path) {}
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn issue_only_unlocked_folders_are_removed() {
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
        // a folder that another process removes or has removed is not claimed
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
