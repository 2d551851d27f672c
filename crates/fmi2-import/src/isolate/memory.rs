//! The memory that master and worker share: bells, the fields of an exchange, values of a step.

use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use memmap2::{MmapOptions, MmapRaw};
use rustix::thread::futex;

use crate::answer::{Answer, Outcome};
use crate::exchange::{DerivativeList, Received, Sent, StepLayout};
use crate::functions::Call;
use crate::logger::Ring;
use crate::per_type::{PerNumeric, PerType};

/// Parts of an exchange, in this order. None of them: a message waits in the socket.
pub(super) mod part {
    pub(in super::super) const SEND: u32 = 1;
    pub(in super::super) const SAVE: u32 = 2;
    pub(in super::super) const STEP: u32 = 4;
    pub(in super::super) const RECEIVE: u32 = 8;
}

/// How long a side that waits awake does not yield to the scheduler.
const YIELD_AFTER: Duration = Duration::from_micros(5);

/// A number that one side writes and the other waits for.
#[repr(C, align(64))]
pub(super) struct Bell {
    word: AtomicU32,
    sleeping: AtomicU32,
}

impl Bell {
    pub(super) fn ring(&self, stroke: u32) {
        // sequentially consistent with `sleep`: this sees the sleeper, or the sleeper sees this
        self.word.store(stroke, Ordering::SeqCst);
        if self.sleeping.load(Ordering::SeqCst) != 0 {
            // the address is valid, so waking cannot fail
            let _ = futex::wake(&self.word, futex::Flags::empty(), 1);
        }
    }

    pub(super) fn has_rung(&self, stroke: u32) -> bool {
        self.word.load(Ordering::Acquire) == stroke
    }

    /// Waits for the stroke, awake.
    pub(super) fn watch(&self, stroke: u32, longest: Duration) -> bool {
        if longest.is_zero() {
            return self.has_rung(stroke);
        }
        let begin = Instant::now();
        loop {
            for _ in 0..32 {
                if self.has_rung(stroke) {
                    return true;
                }
                std::hint::spin_loop();
            }
            let waited = begin.elapsed();
            if waited > longest {
                return false;
            }
            // the other side may wait for this processor
            if waited > YIELD_AFTER {
                std::thread::yield_now();
            }
        }
    }

    /// Waits for the stroke, asleep; may return early.
    pub(super) fn sleep(&self, stroke: u32, longest: Duration) -> bool {
        self.sleeping.store(1, Ordering::SeqCst);
        let seen = self.word.load(Ordering::SeqCst);
        if seen != stroke {
            let nanoseconds = i64::from(longest.subsec_nanos());
            let seconds = i64::try_from(longest.as_secs()).unwrap_or(i64::MAX);
            let limit = futex::Timespec { tv_sec: seconds, tv_nsec: nanoseconds };
            // whatever it returns, the word is checked below
            let _ = futex::wait(&self.word, futex::Flags::empty(), seen, Some(&limit));
        }
        self.sleeping.store(0, Ordering::SeqCst);
        self.has_rung(stroke)
    }
}

/// The fixed part of the shared memory. All zero is a valid initial state.
#[repr(C)]
pub(super) struct Control {
    pub(super) to_worker: Bell,
    pub(super) to_master: Bell,
    /// which [parts](part) of an exchange to do
    pub(super) parts: AtomicU32,
    /// where to save the state
    pub(super) slot: AtomicU32,
    /// how long the worker waits awake (µs)
    pub(super) watch: AtomicU32,
    /// number of the worker's [`Activity`](crate::activity::Activity)
    pub(super) mark: AtomicU32,
    call: AtomicU32,
    status: AtomicU32,
    lacks: AtomicU32,
    time: AtomicU64,
    size: AtomicU64,
    pub(super) ring: Ring,
}

impl Control {
    pub(super) fn set_step(&self, time: f64, size: f64) {
        self.time.store(time.to_bits(), Ordering::Relaxed);
        self.size.store(size.to_bits(), Ordering::Relaxed);
    }

    pub(super) fn step(&self) -> (f64, f64) {
        let number = |field: &AtomicU64| f64::from_bits(field.load(Ordering::Relaxed));
        (number(&self.time), number(&self.size))
    }

    pub(super) fn set_answer(&self, answer: Answer) {
        let (status, lacks) = match answer.outcome {
            Outcome::Status(status) => (status, 0),
            Outcome::Lacks | Outcome::Lost => (0, 1),
        };
        self.call.store(answer.call as u32, Ordering::Relaxed);
        self.status.store(status, Ordering::Relaxed);
        self.lacks.store(lacks, Ordering::Relaxed);
    }

    /// The answer of the exchange. The FMU may have overwritten it, so every number is possible.
    pub(super) fn answer(&self) -> Answer {
        let call = Call::from_number(self.call.load(Ordering::Relaxed));
        let outcome = match self.lacks.load(Ordering::Relaxed) {
            0 => Outcome::Status(self.status.load(Ordering::Relaxed)),
            _ => Outcome::Lacks,
        };
        Answer { call: call.unwrap_or(Call::fmi2DoStep), outcome }
    }
}

/// Bytes before the values of a step, whole pages.
const VALUES_AT: usize = size_of::<Control>().next_multiple_of(4096);

/// Maps the fixed part.
pub(super) fn control(memory: &File) -> io::Result<MmapRaw> {
    memory.set_len(VALUES_AT as u64)?;
    MmapOptions::new().len(VALUES_AT).map_raw(memory)
}

/// The fixed part in its mapping.
pub(super) fn control_in(map: &MmapRaw) -> *const Control {
    map.as_ptr().cast()
}

/// The values of a step, in the order of the fields.
pub(super) struct Area {
    map: MmapRaw,
    counts: Counts,
}

/// Numbers of values.
#[derive(Debug, Clone, Copy)]
struct Counts {
    sent: [usize; 4],
    received: [usize; 4],
}

/// Bytes for each value. Reals and derivatives are f64, Integers and Booleans i32.
const WIDTH: usize = 8;

impl Counts {
    fn of(layout: &StepLayout) -> Self {
        let StepLayout { set, set_derivatives, get, get_derivatives, .. } = layout;
        let of = |list: &PerNumeric<Vec<u32>>, derivatives: &DerivativeList| {
            let (reals, derivatives) = (list.reals.len(), derivatives.references.len());
            [reals, derivatives, list.integers.len(), list.booleans.len()]
        };
        Self { sent: of(set, set_derivatives), received: of(get, get_derivatives) }
    }

    fn bytes(&self) -> usize {
        WIDTH * (self.sent.iter().sum::<usize>() + self.received.iter().sum::<usize>())
    }
}

impl Area {
    /// Maps the values of a step. The master comes first and allocates the memory.
    pub(super) fn map(memory: &File, layout: &StepLayout) -> io::Result<Self> {
        let counts = Counts::of(layout);
        let bytes = counts.bytes().max(WIDTH);
        memory.set_len((VALUES_AT + bytes) as u64)?;
        let map = MmapOptions::new().offset(VALUES_AT as u64).len(bytes).map_raw(memory)?;
        Ok(Self { map, counts })
    }

    /// Addresses of the four lists that begin after this number of values.
    fn lists(&self, before: usize, counts: [usize; 4]) -> [*mut u8; 4] {
        let mut at = before * WIDTH;
        counts.map(|count| {
            let list = self.map.as_mut_ptr().wrapping_add(at);
            at += count * WIDTH;
            list
        })
    }

    fn sent_lists(&self) -> [*mut u8; 4] {
        self.lists(0, self.counts.sent)
    }

    fn received_lists(&self) -> [*mut u8; 4] {
        self.lists(self.counts.sent.iter().sum(), self.counts.received)
    }

    /// Master: writes what is sent.
    pub(super) fn put(&self, sent: &Sent) {
        let [reals, derivatives, integers, booleans] = self.sent_lists();
        let count = self.counts.sent;
        write(reals.cast(), sent.values.reals, count[0]);
        write(derivatives.cast(), sent.derivatives, count[1]);
        write(integers.cast(), sent.values.integers, count[2]);
        write(booleans.cast(), sent.values.booleans, count[3]);
    }

    /// Master: reads what is received.
    pub(super) fn take(&self, received: &mut Received) {
        let [reals, derivatives, integers, booleans] = self.received_lists();
        let count = self.counts.received;
        read(reals.cast(), received.values.reals, count[0]);
        read(derivatives.cast(), received.derivatives, count[1]);
        read(integers.cast(), received.values.integers, count[2]);
        read(booleans.cast(), received.values.booleans, count[3]);
    }

    /// Worker: what was sent.
    pub(super) fn sent(&self) -> Sent<'_> {
        let [reals, derivatives, integers, booleans] = self.sent_lists();
        let count = self.counts.sent;
        // SAFETY: inside of the mapping, aligned, and any bits are values; the master does not write
        // between the two strokes of the bells, while this is used
        unsafe {
            Sent {
                values: PerType {
                    reals: std::slice::from_raw_parts(reals.cast(), count[0]),
                    integers: std::slice::from_raw_parts(integers.cast(), count[2]),
                    booleans: std::slice::from_raw_parts(booleans.cast(), count[3]),
                    strings: (),
                },
                derivatives: std::slice::from_raw_parts(derivatives.cast(), count[1]),
            }
        }
    }

    /// Worker: places for what is received.
    pub(super) fn received(&mut self) -> Received<'_> {
        let [reals, derivatives, integers, booleans] = self.received_lists();
        let count = self.counts.received;
        // SAFETY: as in `sent`; the lists do not overlap, and `&mut self` is exclusive
        unsafe {
            Received {
                values: PerType {
                    reals: std::slice::from_raw_parts_mut(reals.cast(), count[0]),
                    integers: std::slice::from_raw_parts_mut(integers.cast(), count[2]),
                    booleans: std::slice::from_raw_parts_mut(booleans.cast(), count[3]),
                    strings: (),
                },
                derivatives: std::slice::from_raw_parts_mut(derivatives.cast(), count[1]),
            }
        }
    }
}

fn write<T: Copy>(to: *mut T, values: &[T], count: usize) {
    // SAFETY: a list of `count` places inside of the mapping, which does not overlap `values`
    unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), to, count.min(values.len())) };
}

fn read<T: Copy>(from: *const T, values: &mut [T], count: usize) {
    // SAFETY: as in `write`; any bits are values of T, which is f64 or i32
    unsafe { std::ptr::copy_nonoverlapping(from, values.as_mut_ptr(), count.min(values.len())) };
}
