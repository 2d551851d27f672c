//! Files that appear complete or not at all, and the lock that reserves a file for one run.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// Appended to the name of a file that is not complete yet.
const PARTIAL: &str = ".partial";

/// The name that a file has until it is complete.
#[must_use]
pub(crate) fn partial(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(PARTIAL);
    PathBuf::from(name)
}

/// Writes a whole file or nothing, even if the machine crashes meanwhile. It replaces regular files only, not devices or
/// folders, nor links to them.
///
/// # Errors
/// The file cannot be written. What had its name before is unchanged.
pub fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    replace(path, |mut file| file.write_all(content))
}

/// Lets `write` fill a temporary file, waits until its content is on the disk, and renames it to
/// `path`. The temporary name is fixed, so that the next run removes what a killed one has left.
///
/// # Errors
/// The error of `write`, or the file cannot be written. What had its name before is unchanged.
pub fn replace<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&File) -> Result<(), E>,
) -> Result<(), E> {
    replaceable(path)?;
    let temporary = partial(path);
    let written = File::create(&temporary).map_err(E::from).and_then(|file| {
        write(&file)?;
        file.sync_all()?;
        Ok(fs::rename(&temporary, path)?)
    });
    if written.is_err() {
        // half a file is of no use; if it cannot be removed, there is nothing else to do
        let _ = fs::remove_file(&temporary);
        return written;
    }
    Ok(sync_folder_of(path)?)
}

/// Refuses a path that leads to something else than a regular file, which a new file would replace.
///
/// # Errors
/// The path leads to a folder, a device or the like.
pub(crate) fn replaceable(path: &Path) -> io::Result<()> {
    let refuse = |kind, text| Err(io::Error::new(kind, text));
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => {
            refuse(io::ErrorKind::IsADirectory, "it is a folder; give the path of a file")
        }
        Ok(found) if !found.is_file() => refuse(
            io::ErrorKind::InvalidInput,
            "it is not a regular file, and a new file would replace it; give the path of a file",
        ),
        // also a path that leads nowhere: the first write says why, if that matters
        _ => Ok(()),
    }
}

/// Waits until a renamed file is on the disk under its new name. Only Unix can do that.
fn sync_folder_of(path: &Path) -> io::Result<()> {
    match path.parent() {
        Some(folder) if cfg!(unix) => {
            let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            File::open(here)?.sync_all()
        }
        _ => Ok(()),
    }
}

/// Length and CRC-32 of a file, which distinguish it from another file of the same name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Length in bytes.
    pub bytes: u64,
    /// CRC-32 of the content.
    pub crc32: u32,
}

/// Reads a file and computes its fingerprint.
///
/// # Errors
/// The file cannot be read.
pub fn fingerprint(path: &Path) -> io::Result<Fingerprint> {
    let mut file = File::open(path)?;
    let mut hasher = crc32fast::Hasher::new();
    let mut buffer = vec![0; 1 << 16];
    let mut bytes = 0;
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(Fingerprint { bytes, crc32: hasher.finalize() }),
            n => {
                hasher.update(&buffer[..n]);
                bytes += n as u64;
            }
        }
    }
}

/// The messages of an error and of its sources, outermost first.
#[must_use]
pub fn causes(error: &(dyn std::error::Error + 'static)) -> Vec<String> {
    std::iter::successors(Some(error), |error| error.source()).map(ToString::to_string).collect()
}

/// Keeps other runs from writing the file until it is closed, at the latest by the end of the process.
pub(crate) fn reserve(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another run is writing it; wait until it ends or choose another folder",
        )),
        // the file system has no locks
        Err(TryLockError::Error(_)) | Ok(()) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        write_whole(&path, b"first").unwrap();
        // a folder in the way of the temporary file
        fs::create_dir(partial(&path)).unwrap();
        write_whole(&path, b"second").unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"first");
    }

    #[cfg(unix)]
    #[test]
    fn issue_only_regular_files_are_replaced() {
        use std::os::unix::fs::{FileTypeExt as _, symlink};
        use std::os::unix::net::UnixListener;

        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        fs::create_dir(path("folder")).unwrap();
        // as a device, a socket is neither file nor folder
        let _socket = UnixListener::bind(path("socket")).unwrap();
        for name in ["folder", "socket"] {
            let link = path(&format!("to-{name}"));
            symlink(path(name), &link).unwrap();
            for path in [path(name), link] {
                let error = write_whole(&path, b"x").unwrap_err().to_string();
                assert!(error.contains("give the path of a file"), "{error}");
                assert!(!partial(&path).exists());
            }
        }
        assert!(path("folder").is_dir());
        assert!(fs::metadata(path("socket")).unwrap().file_type().is_socket());
        // a link to a file, and one to nothing, become files
        write_whole(&path("file"), b"old").unwrap();
        for target in ["file", "nothing"] {
            symlink(path(target), path("link")).unwrap();
            write_whole(&path("link"), b"new").unwrap();
            assert_eq!(fs::read(path("link")).unwrap(), b"new");
            fs::remove_file(path("link")).unwrap();
        }
    }
}
