//! Messages from an instance in a worker to the master: a ring of bytes in shared memory with one writer
//! and one reader. It outlives the worker, so the last messages before a crash can be read.

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use fmi2_sys::fmi2Status as Status;

use super::Message;

/// A power of two, so that positions may overflow.
const SIZE: usize = 1 << 16;
/// Longest message; a longer one is cut.
const LONGEST: usize = SIZE / 4;

/// The ring. All zero is empty.
#[repr(C, align(64))]
pub(crate) struct Ring {
    /// bytes written so far
    written: AtomicU32,
    /// bytes read so far
    read: AtomicU32,
    /// messages without room since the last read
    dropped: AtomicU64,
    bytes: UnsafeCell<[u8; SIZE]>,
}

// SAFETY: the one writer (whose sink has a lock) and the one reader touch different bytes, as
// `written` and `read` say
unsafe impl Sync for Ring {}

impl Ring {
    /// Writes a message, or counts it if there is no room. One writer at a time.
    pub(crate) fn push(&self, mut message: Message) {
        let end = message.text.floor_char_boundary(LONGEST);
        message.text.truncate(end);
        let Message { status, category, text, .. } = &message;
        let Ok(bytes) = postcard::to_stdvec(&(status.0, category, text)) else { return };
        // the first of a flood name its cause: after a dropped message no other is written
        let full = self.dropped.load(Ordering::Relaxed) > 0;
        let written = self.written.load(Ordering::Relaxed);
        let used = written.wrapping_sub(self.read.load(Ordering::Acquire)) as usize;
        let Ok(length) = u32::try_from(bytes.len()) else { return };
        if full || used > SIZE || SIZE - used < bytes.len() + 4 {
            self.dropped.fetch_add(1, Ordering::Release);
            return;
        }
        self.copy_in(written, &length.to_le_bytes());
        self.copy_in(written.wrapping_add(4), &bytes);
        self.written.store(written.wrapping_add(length + 4), Ordering::Release);
    }

    /// Whether there are messages to read.
    #[inline]
    pub(crate) fn has_some(&self) -> bool {
        self.written.load(Ordering::Relaxed) != self.read.load(Ordering::Relaxed)
            || self.dropped.load(Ordering::Relaxed) != 0
    }

    /// Reads all messages. The FMU may have overwritten the ring, so any bytes are possible.
    pub(crate) fn take(&self) -> Vec<Message> {
        let mut messages = Vec::new();
        let written = self.written.load(Ordering::Acquire);
        let mut read = self.read.load(Ordering::Relaxed);
        while read != written {
            let left = written.wrapping_sub(read) as usize;
            let mut length = [0; 4];
            self.copy_out(read, &mut length);
            let length = u32::from_le_bytes(length);
            if !(4..=SIZE).contains(&left) || length as usize > left - 4 {
                break;
            }
            let mut bytes = vec![0; length as usize];
            self.copy_out(read.wrapping_add(4), &mut bytes);
            read = read.wrapping_add(length + 4);
            if let Ok((status, category, text)) = postcard::from_bytes(&bytes) {
                messages.push(Message::new(Status(status), category, text));
            }
        }
        self.read.store(written, Ordering::Release);
        messages.extend(Message::dropped(self.dropped.swap(0, Ordering::Acquire)));
        messages
    }

    fn copy_in(&self, at: u32, bytes: &[u8]) {
        for (k, byte) in bytes.iter().enumerate() {
            let place = (at as usize + k) % SIZE;
            // SAFETY: inside of the array; the reader waits until `written` includes it
            unsafe { self.bytes.get().cast::<u8>().add(place).write_volatile(*byte) };
        }
    }

    fn copy_out(&self, at: u32, bytes: &mut [u8]) {
        for (k, byte) in bytes.iter_mut().enumerate() {
            let place = (at as usize + k) % SIZE;
            // SAFETY: inside of the array; the writer waits until `read` includes it
            *byte = unsafe { self.bytes.get().cast::<u8>().add(place).read_volatile() };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> Message {
        Message::new(Status::fmi2OK, String::new(), text.to_owned())
    }

    fn ring() -> Box<Ring> {
        Box::new(Ring {
            written: AtomicU32::new(u32::MAX - 100),
            read: AtomicU32::new(u32::MAX - 100),
            dropped: AtomicU64::new(0),
            bytes: UnsafeCell::new([0; SIZE]),
        })
    }

    #[test]
    fn invariant_messages_come_out_as_they_went_in() {
        let ring = ring();
        // many times around, and over the end of the counters
        for round in 0..2000 {
            let texts = [format!("{round}"), "ü".repeat(round % 300)];
            texts.iter().for_each(|text| ring.push(message(text)));
            let read: Vec<String> = ring.take().into_iter().map(|it| it.text).collect();
            assert_eq!(read, texts);
        }
    }

    #[test]
    fn issue_a_flood_and_long_messages_are_cut() {
        let ring = ring();
        ring.push(message(&"ä".repeat(SIZE)));
        assert!(ring.take()[0].text.len() <= LONGEST);
        (0..10_000).for_each(|k| ring.push(message(&format!("message {k}"))));
        let read = ring.take();
        assert!(read.len() > 1000 && read[0].text == "message 0");
        assert_eq!(read.iter().map(|it| it.count).sum::<u64>(), 10_000);
        assert!(read[read.len() - 1].text.contains("more messages dropped"));
        ring.push(message("after"));
        assert_eq!(ring.take()[0].text, "after");
    }

    #[test]
    fn issue_any_bytes_are_survived() {
        let ring = ring();
        for seed in 0_u32..500 {
            let noise: Vec<u8> = (0..256_u32)
                .map(|k| (seed.wrapping_mul(2_654_435_761) >> (k % 25)) as u8)
                .collect();
            let read = ring.read.load(Ordering::Relaxed);
            ring.copy_in(read, &noise);
            ring.written.store(read.wrapping_add(seed * 7919), Ordering::Relaxed);
            ring.take();
        }
    }
}
