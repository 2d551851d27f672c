//! Last words, when the code of a unit ends this process by a crash or by `exit`.
//!
//! Nothing can go on after that, and nothing can be saved; but which unit did it, in which call and
//! at what time, can be said. [Isolated](crate::isolate) units end only their own process.

use std::sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering};

use crate::component::IDLE;
use crate::library::Call;

/// The call going on in this process.
pub(crate) static CALL: AtomicU32 = AtomicU32::new(IDLE);
/// The instance that was called last in this process.
static LAST: AtomicPtr<Place> = AtomicPtr::new(std::ptr::null_mut());

/// What is known of an instance. It stays for as long as the process, for whoever looks after a crash.
pub(crate) struct Place {
    name: String,
    /// simulated time (s) as bits; NaN before the start
    time: AtomicU64,
}

impl Place {
    pub(crate) fn new(name: &str) -> &'static Self {
        let time = AtomicU64::new(f64::NAN.to_bits());
        Box::leak(Box::new(Self { name: name.to_owned(), time }))
    }

    #[inline]
    pub(crate) fn set_time(&self, time: f64) {
        self.time.store(time.to_bits(), Ordering::Relaxed);
    }

    /// This instance is about to be called.
    #[inline]
    pub(crate) fn enter(&'static self) {
        LAST.store(std::ptr::from_ref(self).cast_mut(), Ordering::Relaxed);
    }
}

/// The call of a unit that this process is in, in words, if it is in one.
pub(crate) fn whereabouts() -> Option<String> {
    let call = Call::from_number(CALL.load(Ordering::Relaxed))?.name();
    // SAFETY: places are never freed
    let place = unsafe { LAST.load(Ordering::Relaxed).as_ref() }?;
    let time = f64::from_bits(place.time.load(Ordering::Relaxed));
    let at = if time.is_nan() { String::new() } else { format!(" at {time} s") };
    Some(format!("unit {}: {call}{at} had not returned", place.name))
}

/// Lets crashes and exits in units' code say on stderr which unit it was, before they end the process
/// as they would have done without. For programs, once, at their beginning.
#[cfg(unix)]
pub fn report_crashes() {
    unix::install();
}

/// Does nothing on this system.
#[cfg(not(unix))]
pub fn report_crashes() {}

#[cfg(unix)]
mod unix {
    use std::fmt::{self, Write};
    use std::sync::atomic::Ordering;

    use super::{CALL, LAST};
    use crate::component::IDLE;
    use crate::instance::signal_name;
    use crate::library::Call;

    pub(super) fn install() {
        for signal in [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGABRT] {
            // SAFETY: all zero is a valid sigaction; the handler only reads atomics, formats into
            // its own stack and writes; a second signal finds the default action (SA_RESETHAND)
            unsafe {
                let mut action: libc::sigaction = std::mem::zeroed();
                action.sa_sigaction = on_signal as extern "C" fn(libc::c_int) as usize;
                action.sa_flags = libc::SA_ONSTACK | libc::SA_RESETHAND;
                libc::sigaction(signal, &raw const action, std::ptr::null_mut());
            }
        }
        // SAFETY: a function without arguments that does not unwind
        unsafe { libc::atexit(on_exit) };
    }

    extern "C" fn on_signal(signal: libc::c_int) {
        tell(Some(signal));
        // on return the fault happens again, now with the default action
    }

    extern "C" fn on_exit() {
        if CALL.load(Ordering::Relaxed) != IDLE {
            tell(None);
            // SAFETY: ends the process
            unsafe { libc::_exit(1) };
        }
    }

    /// Text without allocation.
    struct Text {
        bytes: [u8; 1024],
        length: usize,
    }

    impl Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            let room = &mut self.bytes[self.length..];
            let count = text.len().min(room.len());
            room[..count].copy_from_slice(&text.as_bytes()[..count]);
            self.length += count;
            Ok(())
        }
    }

    fn tell(signal: Option<libc::c_int>) {
        let mark = CALL.load(Ordering::Relaxed);
        let last = LAST.load(Ordering::Relaxed);
        if mark == IDLE || last.is_null() {
            return;
        }
        // SAFETY: not null, and places are never freed
        let place = unsafe { &*last };
        let call = Call::from_number(mark).map_or("a call", Call::name);
        let time = f64::from_bits(place.time.load(Ordering::Relaxed));
        let mut text = Text { bytes: [0; 1024], length: 0 };
        let _ = match signal {
            Some(signal) => write!(
                text,
                "error: unit {} crashed: signal {signal} ({}) in {call}",
                place.name,
                signal_name(signal)
            ),
            None => write!(text, "error: unit {} ended the process in {call}", place.name),
        };
        if !time.is_nan() {
            let _ = write!(text, " at {time} s");
        }
        let _ = text.write_str(
            "\nhelp: in a process of its own (--isolate) this would end the unit only, and the \
             results until then would be complete\n",
        );
        // SAFETY: the bytes are there; write may be called in a signal handler
        unsafe { libc::write(2, text.bytes.as_ptr().cast(), text.length) };
    }
}
