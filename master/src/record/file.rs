//! Files that appear complete or not at all, and files that grow record by record.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};

/// Bytes that are gathered before they are written.
const FULL: usize = 1 << 16;
/// Appended to the name of a file that is not complete yet.
const PARTIAL: &str = ".partial";

/// The name that a file has until it is complete.
#[must_use]
pub(super) fn partial(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(PARTIAL);
    PathBuf::from(name)
}

/// Writes a file that is there as a whole or not at all, also after a crash of the machine: a
/// temporary file takes its name when its content is on the disk.
///
/// # Errors
/// The file cannot be written; what was there under its name before is untouched.
pub fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let temporary = partial(path);
    let written = File::create(&temporary)
        .and_then(|mut file| {
            file.write_all(content)?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // half a file is of no use; if it cannot be removed, there is nothing else to do
        let _ = fs::remove_file(&temporary);
        return written;
    }
    sync_folder_of(path)
}

/// Puts a new name on the disk; only Unix knows the notion.
fn sync_folder_of(path: &Path) -> io::Result<()> {
    match path.parent() {
        Some(folder) if cfg!(unix) => {
            let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            File::open(here)?.sync_all()
        }
        _ => Ok(()),
    }
}

/// How far a growing file has got.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Position {
    /// Its length.
    pub bytes: u64,
    /// Whole records in it, the header not counted.
    pub records: u64,
    /// CRC-32 of its content.
    pub checksum: u32,
}

/// A text file that grows line by line under the name `….partial` until it is complete. A failed
/// write leaves it with whole lines only.
pub(super) struct Growing {
    file: File,
    path: PathBuf,
    buffer: Vec<u8>,
    /// records in the buffer
    pending: u64,
    position: Position,
    hasher: Hasher,
}

impl Growing {
    /// Begins the file with a header.
    pub(super) fn create(path: PathBuf, header: &[u8]) -> io::Result<Self> {
        let file =
            OpenOptions::new().write(true).create(true).truncate(false).open(partial(&path))?;
        reserve(&file)?;
        // what is no plain file cannot be shortened, and need not
        if file.metadata()?.len() > 0 {
            file.set_len(0)?;
        }
        let mut growing = Self {
            file,
            path,
            buffer: Vec::with_capacity(FULL + FULL / 4),
            pending: 0,
            position: Position::default(),
            hasher: Hasher::new(),
        };
        growing.buffer.extend_from_slice(header);
        growing.flush()?;
        growing.position.records = 0;
        Ok(growing)
    }

    /// Goes on with a file from an earlier position; what came after it is cut off.
    pub(super) fn resume(path: PathBuf, position: Position) -> io::Result<Self> {
        let unfinished = partial(&path);
        let found = if unfinished.exists() { &unfinished } else { &path };
        let mut file = OpenOptions::new().read(true).write(true).open(found)?;
        reserve(&file)?;
        let refuse = |text: String| Err(io::Error::new(io::ErrorKind::InvalidData, text));
        let length = file.metadata()?.len();
        if length < position.bytes {
            let wanted = position.bytes;
            return refuse(format!("it has {length} bytes, the checkpoint knows {wanted}"));
        }
        let hasher = checksum(&mut file, position.bytes)?;
        if hasher.clone().finalize() != position.checksum {
            return refuse("its content is not what the checkpoint knows".to_owned());
        }
        if found != &unfinished {
            fs::rename(found, &unfinished)?;
        }
        file.set_len(position.bytes)?;
        file.seek(SeekFrom::End(0))?;
        let buffer = Vec::with_capacity(FULL + FULL / 4);
        Ok(Self { file, path, buffer, pending: 0, position, hasher })
    }

    /// Where the next record is to be appended.
    #[inline]
    pub(super) fn buffer(&mut self) -> &mut Vec<u8> {
        &mut self.buffer
    }

    /// Ends a record.
    #[inline]
    pub(super) fn end_record(&mut self) -> io::Result<()> {
        self.pending += 1;
        if self.buffer.len() >= FULL { self.flush() } else { Ok(()) }
    }

    /// Number of records.
    pub(super) fn records(&self) -> u64 {
        self.position.records + self.pending
    }

    /// Writes what is gathered.
    fn flush(&mut self) -> io::Result<()> {
        let result = self.file.write_all(&self.buffer);
        let kept = match &result {
            Ok(()) => self.buffer.len(),
            Err(_) => self.cut(),
        };
        let kept = &self.buffer[..kept];
        self.hasher.update(kept);
        self.position.bytes += kept.len() as u64;
        self.position.records += if result.is_ok() { self.pending } else { lines(kept) };
        self.position.checksum = self.hasher.clone().finalize();
        self.buffer.clear();
        self.pending = 0;
        result
    }

    /// After a failed write: lets the file end with its last whole record, and returns how much of
    /// the buffer is in it.
    #[cold]
    fn cut(&mut self) -> usize {
        let length = self.file.metadata().map_or(0, |data| data.len());
        let arrived = usize::try_from(length.saturating_sub(self.position.bytes)).unwrap_or(0);
        let arrived = &self.buffer[..arrived.min(self.buffer.len())];
        let whole = arrived.iter().rposition(|&byte| byte == b'\n').map_or(0, |k| k + 1);
        // shortening needs no space; if it fails, the last line is cut somewhere
        let _ = self.file.set_len(self.position.bytes + whole as u64);
        let _ = self.file.seek(SeekFrom::End(0));
        whole
    }

    /// Puts everything on the disk and tells how far it got.
    pub(super) fn position(&mut self) -> io::Result<Position> {
        self.flush()?;
        self.file.sync_data()?;
        Ok(self.position)
    }

    /// Completes the file and gives it its name.
    pub(super) fn finish(mut self) -> io::Result<PathBuf> {
        let flushed = self.flush();
        self.file.sync_all()?;
        fs::rename(partial(&self.path), &self.path)?;
        flushed.map(|()| self.path)
    }
}

/// Keeps others from writing the file until it is closed, be it by the end of the process.
fn reserve(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another run is writing it; wait for its end or choose another folder",
        )),
        // a file system without locks
        Err(TryLockError::Error(_)) | Ok(()) => Ok(()),
    }
}

fn lines(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|&&byte| byte == b'\n').count() as u64
}

/// CRC-32 of the first bytes of a file.
fn checksum(file: &mut File, bytes: u64) -> io::Result<Hasher> {
    let mut hasher = Hasher::new();
    let mut head = file.take(bytes);
    let mut buffer = vec![0; FULL];
    loop {
        match head.read(&mut buffer)? {
            0 => return Ok(hasher),
            n => hasher.update(&buffer[..n]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_a_file_goes_on_from_any_position() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let add = |file: &mut Growing, n: u64| {
            file.buffer().extend_from_slice(format!("{n}\n").as_bytes());
            file.end_record().unwrap();
        };
        let mut file = Growing::create(path.clone(), b"head\n").unwrap();
        (0..5).for_each(|n| add(&mut file, n));
        let position = file.position().unwrap();
        (5..9).for_each(|n| add(&mut file, n));
        assert_eq!((position.records, file.records()), (5, 9));
        // a crash: nothing is finished; then a finished file
        drop(file);
        for _ in 0..2 {
            let mut file = Growing::resume(path.clone(), position).unwrap();
            (5..7).for_each(|n| add(&mut file, n));
            assert_eq!(file.records(), 7);
            file.finish().unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), "head\n0\n1\n2\n3\n4\n5\n6\n");
        }
        fs::write(&path, "head\n0\n1\n2\n3\n5\n5\n6\n").unwrap();
        let error = Growing::resume(path.clone(), position).err().unwrap().to_string();
        assert!(error.contains("content"), "{error}");
        fs::write(&path, "head\n0\n").unwrap();
        let error = Growing::resume(path, position).err().unwrap().to_string();
        assert!(error.contains("7 bytes"), "{error}");
    }

    #[test]
    fn issue_a_file_that_another_run_writes_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut first = Growing::create(path.clone(), b"head\n").unwrap();
        let position = first.position().unwrap();
        for second in
            [Growing::create(path.clone(), b"other\n"), Growing::resume(path.clone(), position)]
        {
            let error = second.err().unwrap().to_string();
            assert!(error.contains("another run"), "{error}");
        }
        first.finish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "head\n");
        Growing::create(path, b"next\n").unwrap();
    }

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
}
