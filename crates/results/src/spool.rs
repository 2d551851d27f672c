//! Bytes between the thread that makes them and the file. Others can write them to the file at any
//! time: the keeper while the first thread is busy, a signal handler after a crash.
//!
//! The thread that appends takes no lock unless the memory is full: it writes beyond the bytes that
//! are complete, and then says that there are more of them. Whoever holds the lock reads those that
//! are complete. The memory is used anew by the appending thread under the lock.

use std::cell::UnsafeCell;
use std::fs::File;
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use crc32fast::Hasher;

use crate::growing::Position;

/// Bytes that are gathered before they are written.
const SIZE: usize = 1 << 16;

/// Gathered bytes and their file.
pub(super) struct Spool {
    bytes: Box<[UnsafeCell<u8>]>,
    /// how many bytes are complete; only the owner of the [`Pen`] changes it
    filled: AtomicUsize,
    /// whether there is a failure that nobody knows of yet
    failed: AtomicBool,
    target: Mutex<SpoolTarget>,
}

// SAFETY: bytes from `filled` on are touched by the owner of the pen alone; those before are only read,
// under the lock, and change only after `filled` went back, which happens under the lock
unsafe impl Sync for Spool {}
// SAFETY: all fields may go to another thread
unsafe impl Send for Spool {}

/// The right to append, of which there is one for each spool.
pub(super) struct Pen(Arc<Spool>);

/// The file, and what is in it.
pub(super) struct SpoolTarget {
    /// there until the file is closed
    file: Option<File>,
    /// gathered bytes that have been written
    taken: usize,
    pub(super) position: Position,
    hasher: Hasher,
    failure: Option<io::Error>,
}

impl Spool {
    /// Writes what is gathered.
    fn drain(&self, target: &mut SpoolTarget) -> io::Result<()> {
        let filled = self.filled.load(Ordering::Acquire);
        let start = self.bytes.as_ptr().cast::<u8>();
        // SAFETY: these bytes are complete, and stay as they are while the lock is held
        let bytes =
            unsafe { std::slice::from_raw_parts(start.add(target.taken), filled - target.taken) };
        target.taken = filled;
        target.put(bytes)
    }

    /// Writes what is gathered, if nobody else is about to. An error is returned by the next call
    /// of the owner. Neither allocates nor frees memory, so that it may be called in a signal handler.
    pub(super) fn drain_aside(&self) {
        let mut target = match self.target.try_lock() {
            Ok(target) => target,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        if target.file.is_none() {
            return;
        }
        if let Err(error) = self.drain(&mut target) {
            target.failure.get_or_insert(error);
            self.failed.store(true, Ordering::Relaxed);
        }
    }
}

impl Pen {
    /// Begins with a file that ends at a position.
    pub(super) fn new(file: File, position: Position, hasher: Hasher) -> Self {
        let bytes = (0..SIZE).map(|_| UnsafeCell::new(0)).collect();
        let target = SpoolTarget { file: Some(file), taken: 0, position, hasher, failure: None };
        Self(Arc::new(Spool {
            bytes,
            filled: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
            target: Mutex::new(target),
        }))
    }

    pub(super) fn spool(&self) -> &Arc<Spool> {
        &self.0
    }

    /// The file and what is in it.
    pub(super) fn target(&self) -> MutexGuard<'_, SpoolTarget> {
        self.0.target.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a write has failed since the last call of the owner.
    pub(super) fn has_failed(&self) -> bool {
        self.0.failed.load(Ordering::Relaxed)
    }

    /// Appends bytes.
    #[inline]
    pub(super) fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Spool { bytes: gathered, filled, .. } = &*self.0;
        let before = filled.load(Ordering::Relaxed);
        if bytes.len() > SIZE - before || self.has_failed() {
            return self.append_slowly(bytes);
        }
        let place = gathered.as_ptr().cast::<u8>().cast_mut();
        // SAFETY: the bytes fit between `before` and the end, where nobody else reads or writes
        unsafe {
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), place.add(before), bytes.len());
        }
        filled.store(before + bytes.len(), Ordering::Release);
        Ok(())
    }

    #[cold]
    fn append_slowly(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.settle()?;
        if bytes.len() <= SIZE {
            return self.append(bytes);
        }
        self.target().put(bytes)
    }

    /// Writes all that is gathered, and returns also what went wrong before.
    pub(super) fn settle(&mut self) -> io::Result<()> {
        let mut target = self.target();
        let drained = self.0.drain(&mut target);
        target.taken = 0;
        self.0.filled.store(0, Ordering::Relaxed);
        self.0.failed.store(false, Ordering::Relaxed);
        target.failure.take().map_or(drained, Err)
    }

    /// Closes the file.
    pub(super) fn close(&mut self) {
        self.target().file = None;
    }
}

impl SpoolTarget {
    pub(super) fn file(&self) -> io::Result<&File> {
        self.file.as_ref().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    /// Writes bytes behind those of the file.
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let result = self.file().and_then(|mut file| file.write_all(bytes));
        let kept = match &result {
            Ok(()) => bytes,
            Err(_) => &bytes[..self.cut(bytes)],
        };
        self.hasher.update(kept);
        self.position.bytes += kept.len() as u64;
        self.position.records += lines(kept);
        self.position.checksum = self.hasher.clone().finalize();
        result
    }

    /// After a failed write: lets the file end with its last whole record, and returns how many of
    /// the bytes are in it.
    #[cold]
    fn cut(&self, bytes: &[u8]) -> usize {
        let Ok(mut file) = self.file() else { return 0 };
        let length = file.metadata().map_or(0, |data| data.len());
        let arrived = usize::try_from(length.saturating_sub(self.position.bytes)).unwrap_or(0);
        let arrived = &bytes[..arrived.min(bytes.len())];
        let whole = arrived.iter().rposition(|&byte| byte == b'\n').map_or(0, |k| k + 1);
        // shortening needs no space; if it fails, the last line is cut somewhere
        let _ = file.set_len(self.position.bytes + whole as u64);
        let _ = file.seek(SeekFrom::End(0));
        whole
    }
}

fn lines(bytes: &[u8]) -> u64 {
    bytes.iter().filter(|&&byte| byte == b'\n').count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One thread appends records of all lengths, another one drains: nothing is lost, doubled or out
    /// of order.
    #[test]
    fn invariant_two_threads_lose_nothing() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let open = File::create(file.path()).unwrap();
        let mut pen = Pen::new(open, Position::default(), Hasher::new());
        let spool = Arc::clone(pen.spool());
        let end = AtomicBool::new(false);
        let mut expected = Vec::new();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !end.load(Ordering::Relaxed) {
                    spool.drain_aside();
                }
            });
            for k in 0..20_000_usize {
                // one in a thousand does not fit
                let length = if k % 1000 == 7 { SIZE + k } else { k % 200 };
                let record = [k.to_string().as_bytes(), &vec![b'x'; length], b"\n"].concat();
                pen.append(&record).unwrap();
                expected.extend(record);
            }
            end.store(true, Ordering::Relaxed);
        });
        pen.settle().unwrap();
        let position = pen.target().position;
        assert_eq!((position.bytes, position.records), (expected.len() as u64, 20_000));
        assert_eq!(position.checksum, crc32fast::hash(&expected));
        assert!(std::fs::read(file.path()).unwrap() == expected);
    }
}
