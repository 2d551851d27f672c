//! Text files to which a run appends records.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::PathBuf;

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};

use crate::file::{partial, replaceable, reserve};
use crate::spool::Pen;

/// Length and checksum of a growing file at a moment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Position {
    /// Length of the file in bytes.
    pub bytes: u64,
    /// Number of complete records, without the header.
    pub records: u64,
    /// CRC-32 of its content.
    pub checksum: u32,
}

/// A text file that grows line by line, with the name `….partial` until it is published. After a failed
/// write it ends with a complete line. Lines are buffered in memory and written when the buffer is full,
/// at intervals by the [keeper](super::keeper), and when the process is about to die.
pub(super) struct Growing {
    path: PathBuf,
    published: bool,
    pen: Pen,
    /// the record being written
    record: Vec<u8>,
    records: u64,
}

impl Growing {
    /// Starts the file with a header.
    pub(super) fn create(path: PathBuf, header: &[u8]) -> io::Result<Self> {
        replaceable(&path)?;
        let file =
            OpenOptions::new().write(true).create(true).truncate(false).open(partial(&path))?;
        reserve(&file)?;
        // a device cannot be truncated, and need not be
        if file.metadata()?.len() > 0 {
            file.set_len(0)?;
        }
        let mut pen = Pen::new(file, Position::default(), Hasher::new());
        pen.append(header)?;
        pen.settle()?;
        pen.target().position.records = 0;
        Ok(Self::with(path, pen, 0))
    }

    /// Continues a file from an earlier position and removes what follows it.
    pub(super) fn resume(path: PathBuf, position: Position) -> io::Result<Self> {
        let unfinished = partial(&path);
        let found = if unfinished.exists() { &unfinished } else { &path };
        let mut file = OpenOptions::new().read(true).write(true).open(found)?;
        reserve(&file)?;
        let refuse = |text: String| Err(io::Error::new(io::ErrorKind::InvalidData, text));
        let length = file.metadata()?.len();
        if length < position.bytes {
            let wanted = position.bytes;
            return refuse(format!(
                "it has {length} bytes, but {wanted} when the checkpoint was written"
            ));
        }
        let hasher = checksum(&mut file, position.bytes)?;
        if hasher.clone().finalize() != position.checksum {
            return refuse("its content has changed since the checkpoint was written".to_owned());
        }
        if found != &unfinished {
            fs::rename(found, &unfinished)?;
        }
        file.set_len(position.bytes)?;
        file.seek(SeekFrom::End(0))?;
        Ok(Self::with(path, Pen::new(file, position, hasher), position.records))
    }

    fn with(path: PathBuf, pen: Pen, records: u64) -> Self {
        super::keeper::watch(pen.spool());
        Self { path, published: false, pen, record: Vec::new(), records }
    }

    /// Appends the record that `write` produces: one line.
    #[inline]
    pub(super) fn record(&mut self, write: impl FnOnce(&mut Vec<u8>)) -> io::Result<()> {
        self.record.clear();
        write(&mut self.record);
        let appended = self.pen.append(&self.record);
        match &appended {
            Ok(()) => self.records += 1,
            Err(_) => self.records = self.pen.target().position.records,
        }
        appended
    }

    /// Number of complete records.
    pub(super) fn records(&self) -> u64 {
        if self.pen.has_failed() { self.pen.target().position.records } else { self.records }
    }

    /// Writes the buffer. After a failure, only the records in the file count.
    fn settle(&mut self) -> io::Result<()> {
        let settled = self.pen.settle();
        if settled.is_err() {
            self.records = self.pen.target().position.records;
        }
        settled
    }

    /// Waits until everything is on the disk, and returns the position.
    pub(super) fn position(&mut self) -> io::Result<Position> {
        self.settle()?;
        let target = self.pen.target();
        target.file()?.sync_data()?;
        Ok(target.position)
    }

    /// Waits until everything is on the disk, and gives the file its final name. Records may follow.
    pub(super) fn publish(&mut self) -> io::Result<()> {
        let settled = self.settle();
        self.pen.target().file()?.sync_all()?;
        if !self.published {
            fs::rename(partial(&self.path), &self.path)?;
            self.published = true;
        }
        settled
    }

    /// Completes the file and returns its path.
    pub(super) fn finish(mut self) -> io::Result<PathBuf> {
        self.publish()?;
        Ok(std::mem::take(&mut self.path))
    }
}

impl Drop for Growing {
    /// Closes the file, and so unlocks it, even while the keeper holds the spool.
    fn drop(&mut self) {
        self.pen.close();
    }
}

/// CRC-32 of the first bytes of a file.
fn checksum(file: &mut File, bytes: u64) -> io::Result<Hasher> {
    let mut hasher = Hasher::new();
    let mut head = file.take(bytes);
    let mut buffer = vec![0; 1 << 16];
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
    fn invariant_a_file_continues_from_any_position() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let add = |file: &mut Growing, n: u64| {
            let line = format!("{n}\n");
            file.record(|buffer| buffer.extend_from_slice(line.as_bytes())).unwrap();
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

    /// Buffered records are on the disk within a second, even if no more follow.
    #[test]
    fn issue_records_do_not_wait_for_more() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let mut file = Growing::create(path.clone(), b"head\n").unwrap();
        let begin = std::time::Instant::now();
        file.record(|buffer| buffer.extend_from_slice(b"1\n")).unwrap();
        assert_eq!(fs::read_to_string(partial(&path)).unwrap(), "head\n");
        while fs::read_to_string(partial(&path)).unwrap() != "head\n1\n" {
            assert!(begin.elapsed().as_secs_f64() < 1.0);
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        // a published file still takes records, and is closed when it is dropped
        file.publish().unwrap();
        file.record(|buffer| buffer.extend_from_slice(b"2\n")).unwrap();
        assert_eq!(file.finish().unwrap(), path);
        assert_eq!(fs::read_to_string(&path).unwrap(), "head\n1\n2\n");
    }
}
