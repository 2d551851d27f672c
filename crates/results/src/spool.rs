//! A buffer between the thread that produces bytes and a file. Others may write its content to the file
//! at any time: the keeper while the first thread is busy, a signal handler after a crash.
//!
//! The appending thread takes no lock unless the buffer is full: it writes behind the complete bytes and
//! then increases their number. Whoever holds the lock may read the complete bytes. The appending thread
//! empties the buffer under the lock.

use std::cell::UnsafeCell;
use std::fs::File;
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use crc32fast::Hasher;

use crate::growing::Position;

/// Size of the buffer in bytes.
const SIZE: usize = 1 << 16;

/// The buffer and its file.
pub(super) struct Spool {
    bytes: Box<[UnsafeCell<u8>]>,
    /// number of complete bytes; only the owner of the [`Pen`] changes it
    filled: AtomicUsize,
    /// whether a failure has not been reported yet
    failed: AtomicBool,
    target: Mutex<SpoolTarget>,
}

// SAFETY: only the owner of the pen accesses bytes from `filled` on. The bytes before are only read, under
// the lock; they change only after `filled` was reset, which happens under the lock
unsafe impl Sync for Spool {}
// SAFETY: all fields may be sent to another thread
unsafe impl Send for Spool {}

/// The right to append. Each spool has exactly one.
pub(super) struct Pen(Arc<Spool>);

/// The file and its content so far.
pub(super) struct SpoolTarget {
    /// `None` once the file is closed
    file: Option<File>,
    /// bytes of the buffer that have been written
    taken: usize,
    pub(super) position: Position,
    hasher: Hasher,
    failure: Option<io::Error>,
}

impl Spool {
    /// Writes the buffer.
    fn drain(&self, target: &mut SpoolTarget) -> io::Result<()> {
        let filled = self.filled.load(Ordering::Acquire);
        let start = self.bytes.as_ptr().cast::<u8>();
        // SAFETY: these bytes are complete, and do not change while the lock is held
        let bytes =
            unsafe { std::slice::from_raw_parts(start.add(target.taken), filled - target.taken) };
        target.taken = filled;
        target.put(bytes)
    }

    /// Writes the buffer unless another thread is doing so. The next call of the owner returns the error, if
    /// any. Neither allocates nor frees memory, so that a signal handler may call it.
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
    /// Starts with a file that ends at a position.
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

    /// Writes the buffer, and returns also an error of an earlier write.
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

    /// Appends bytes to the file.
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

    /// After a failed write: truncates the file after its last complete record, and returns how many of the
    /// bytes are in it.
    #[cold]
    fn cut(&self, bytes: &[u8]) -> usize {
        let Ok(mut file) = self.file() else { return 0 };
        let length = file.metadata().map_or(0, |data| data.len());
        let arrived = usize::try_from(length.saturating_sub(self.position.bytes)).unwrap_or(0);
        let arrived = &bytes[..arrived.min(bytes.len())];
        let whole = arrived.iter().rposition(|&byte| byte == b'\n').map_or(0, |k| k + 1);
        // truncating needs no space; if it fails, the last line is incomplete
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

    /// One thread appends records of all lengths, another one drains: nothing is lost, duplicated or out
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
