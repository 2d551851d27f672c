//! Last words, when the code of a unit ends this process by a crash or by `exit`.
//!
//! Nothing can go on after that; but which unit did it, in which call and at what time, can be
//! reported, what was recorded can be written, and the exit status can be that of a failure.
//! [Isolated](crate::isolate) units end only their own process.

use std::io::Write as _;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering};

use crate::component::{IDLE, LOADING};
use crate::library::Call;
use crate::logger::{self, Badge};

/// The call going on in this process.
pub(crate) static CALL: AtomicU32 = AtomicU32::new(IDLE);
/// The instance that was called last in this process.
static LAST: AtomicPtr<Place> = AtomicPtr::new(std::ptr::null_mut());

/// What the program saves when a unit ends the process.
static RESCUE: OnceLock<fn()> = OnceLock::new();

/// Sets what is called when a unit is about to end this process, to save what has been recorded. It may
/// be called in a signal handler: it must take no lock that another thread holds, and neither allocate
/// nor free memory. Only the first call counts.
pub fn rescue_with(save: fn()) {
    let _ = RESCUE.set(save);
}

/// Saves what has been recorded.
fn rescue() {
    if let Some(save) = RESCUE.get() {
        save();
    }
}

/// What is known of an instance. It stays for as long as the process, for whoever looks after a crash.
pub(crate) struct Place {
    name: String,
    /// simulated time (s) as bits; NaN before the start
    time: AtomicU64,
    badge: Badge,
}

impl Place {
    pub(crate) fn new(name: &str, badge: Badge) -> &'static Self {
        let time = AtomicU64::new(f64::NAN.to_bits());
        Box::leak(Box::new(Self { name: name.to_owned(), time, badge }))
    }

    #[inline]
    pub(crate) fn set_time(&self, time: f64) {
        self.time.store(time.to_bits(), Ordering::Relaxed);
    }

    /// This instance is about to be called.
    #[inline]
    pub(crate) fn enter(&'static self) {
        LAST.store(std::ptr::from_ref(self).cast_mut(), Ordering::Relaxed);
        logger::calls(self.badge);
    }
}

/// The call of a unit that this process is in, in words, if it is in one.
pub fn whereabouts() -> Option<String> {
    let call = match CALL.load(Ordering::Relaxed) {
        LOADING => "dlopen",
        mark => Call::from_number(mark)?.name(),
    };
    // SAFETY: places are never freed
    let place = unsafe { LAST.load(Ordering::Relaxed).as_ref() }?;
    let time = f64::from_bits(place.time.load(Ordering::Relaxed));
    let at = if time.is_nan() { String::new() } else { format!(" at {time} s") };
    Some(format!("unit {}: {call}{at} had not returned", place.name))
}

/// Loads a unit's library by `load`, during which its initialisers run. From now on, only the
/// program itself may end this process ([`leave`], [`release`]).
pub(crate) fn while_loading<T>(unit: &str, load: impl FnOnce() -> T) -> T {
    system::guard();
    Place::new(unit, Badge::NONE).enter();
    CALL.store(LOADING, Ordering::Relaxed);
    let loaded = load();
    CALL.store(IDLE, Ordering::Relaxed);
    loaded
}

/// Lets crashes and exits in units' code say on stderr which unit it was, before they end the process
/// with a status that is not 0. For programs, once, at their beginning; such a program calls
/// [`leave`] or [`release`] before it ends.
pub fn report_crashes() {
    system::install();
}

/// Ends the process with a status if units have been loaded into it; otherwise returns the status.
/// Units may do what they have registered for this moment, such as closing their files, but a crash
/// or another end there does not change the status, and an endless loop is given up.
#[must_use]
pub fn leave(status: ExitCode) -> ExitCode {
    if system::release() {
        crate::scratch::remove_all();
        if let Some(number) = (0..=u8::MAX).find(|&number| ExitCode::from(number) == status) {
            // what cannot be printed is not waited for
            let _ = std::io::stdout().flush();
            system::leave(number);
        }
    }
    status
}

/// Ends the process at once with a status: nothing of the units is called any more, in whose calls
/// other threads may still be.
pub fn end_at_once(status: u8) -> ! {
    system::release();
    crate::scratch::remove_all();
    // who does not read is not to be kept from the end
    let _ = std::io::stdout().flush();
    system::exit_at_once(status.into())
}

/// The program ends by itself from here on, with whatever units do then.
pub fn release() {
    system::release();
}

/// What `_exit` does: ends the process at once. If that is a unit's doing, it is reported and the
/// status is 1. For programs that put this in the place of the C library's function.
pub fn exit_at_once(status: i32) -> ! {
    system::exit_at_once(status)
}

#[cfg(unix)]
mod system {
    use std::fmt::{self, Write};
    use std::sync::atomic::{AtomicI32, Ordering};
    use std::sync::mpsc;
    use std::time::Duration;

    use super::{CALL, LAST};
    use crate::component::{IDLE, LOADING};
    use crate::instance::signal_name;
    use crate::library::Call;

    /// The process whose handlers are installed, by its number; 0 if there is none.
    static OWNER: AtomicI32 = AtomicI32::new(0);
    /// The process that units must not end, by its number; 0 if there is none.
    static GUARDED: AtomicI32 = AtomicI32::new(0);
    /// The status that the process ends with, once that is certain; before, -1.
    static FINAL: AtomicI32 = AtomicI32::new(-1);
    const FAULTS: [libc::c_int; 5] =
        [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGABRT];
    /// Time that units have for what they do when the process ends.
    const PARTING: Duration = Duration::from_secs(10);

    #[cfg(target_os = "linux")]
    unsafe extern "C" {
        fn at_quick_exit(function: extern "C" fn()) -> libc::c_int;
    }

    pub(super) fn install() {
        FAULTS.iter().for_each(|&signal| handle(signal, on_signal));
        // SAFETY: a function without arguments that does not unwind
        unsafe { libc::atexit(on_exit) };
        #[cfg(target_os = "linux")]
        // SAFETY: likewise
        unsafe {
            at_quick_exit(on_exit)
        };
        OWNER.store(this_process(), Ordering::Relaxed);
    }

    fn handle(signal: libc::c_int, handler: extern "C" fn(libc::c_int)) {
        // SAFETY: all zero is a valid sigaction; the handlers read atomics, format into their own
        // stack and write; a second signal finds the default action (SA_RESETHAND)
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = handler as usize;
            action.sa_flags = libc::SA_ONSTACK | libc::SA_RESETHAND;
            libc::sigaction(signal, &raw const action, std::ptr::null_mut());
        }
    }

    /// This process is not to be ended by a unit, if the handlers are there.
    pub(super) fn guard() {
        GUARDED.store(OWNER.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Ends that, and returns whether it was so.
    pub(super) fn release() -> bool {
        GUARDED.swap(0, Ordering::Relaxed) != 0
    }

    /// Whether a unit is ending the process; not in a process that a unit has forked.
    fn is_guarded() -> bool {
        GUARDED.load(Ordering::Relaxed) == this_process()
    }

    fn this_process() -> libc::pid_t {
        // SAFETY: asks for a number
        unsafe { libc::getpid() }
    }

    pub(super) fn leave(status: u8) -> ! {
        print_rest();
        FINAL.store(status.into(), Ordering::Relaxed);
        FAULTS.iter().chain(&[libc::SIGALRM]).for_each(|&signal| handle(signal, on_late_signal));
        // SAFETY: sets a timer; exit ends the process
        unsafe {
            libc::alarm(PARTING.as_secs() as libc::c_uint);
            libc::exit(status.into())
        }
    }

    /// Writes what C code has printed; not for long, as a thread of a unit may hold a file.
    fn print_rest() {
        let (done, end) = mpsc::channel();
        let print = move || {
            // SAFETY: null stands for all files
            unsafe { libc::fflush(std::ptr::null_mut()) };
            // nobody listens if it took too long
            let _ = done.send(());
        };
        if std::thread::Builder::new().spawn(print).is_ok() {
            let _ = end.recv_timeout(Duration::from_secs(1));
        }
    }

    extern "C" fn on_late_signal(signal: libc::c_int) {
        let what = if signal == libc::SIGALRM { "does not come to an end" } else { "crashed" };
        let mut text = Text { bytes: [0; 1024], length: 0 };
        let _ = writeln!(
            text,
            "warning: code of a unit {what} when the process ended (signal {signal}, {}); the results \
             are not affected",
            signal_name(signal)
        );
        text.print();
        end(FINAL.load(Ordering::Relaxed))
    }

    pub(super) fn exit_at_once(status: libc::c_int) -> ! {
        if is_guarded() {
            last_words();
        }
        let certain = FINAL.load(Ordering::Relaxed);
        let ours = certain >= 0 && OWNER.load(Ordering::Relaxed) == this_process();
        end(if ours { certain } else { status })
    }

    extern "C" fn on_exit() {
        if is_guarded() {
            crate::scratch::remove_all();
            last_words();
        }
    }

    /// Reports that a unit ends the process, saves what is gathered and fails.
    fn last_words() -> ! {
        tell(None);
        super::rescue();
        end(1)
    }

    #[cfg(target_os = "linux")]
    fn end(status: libc::c_int) -> ! {
        loop {
            // SAFETY: ends the process; the library's _exit may be one that calls this
            unsafe { libc::syscall(libc::SYS_exit_group, status) };
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn end(status: libc::c_int) -> ! {
        // SAFETY: ends the process
        unsafe { libc::_exit(status) }
    }

    extern "C" fn on_signal(signal: libc::c_int) {
        tell(Some(signal));
        // a process that a unit has forked has copies of what this one writes
        if OWNER.load(Ordering::Relaxed) == this_process() {
            super::rescue();
        }
        // on return the fault happens again, now with the default action
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

    impl Text {
        fn print(&self) {
            // SAFETY: the bytes are there; write may be called in a signal handler
            unsafe { libc::write(2, self.bytes.as_ptr().cast(), self.length) };
        }
    }

    /// Names the unit, the call and the time; nothing if a crash is no unit's.
    fn tell(signal: Option<libc::c_int>) {
        let mark = CALL.load(Ordering::Relaxed);
        let last = LAST.load(Ordering::Relaxed);
        if last.is_null() || (mark == IDLE && signal.is_some()) {
            return;
        }
        // SAFETY: not null, and places are never freed
        let place = unsafe { &*last };
        let call = match mark {
            LOADING => "dlopen",
            IDLE => "no call",
            mark => Call::from_number(mark).map_or("a call", Call::name),
        };
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
        text.print();
    }
}

/// Handlers are for Unix; elsewhere the process ends as it would without.
#[cfg(not(unix))]
mod system {
    pub(super) fn install() {}

    pub(super) fn guard() {}

    pub(super) fn release() -> bool {
        false
    }

    pub(super) fn leave(status: u8) -> ! {
        std::process::exit(status.into())
    }

    pub(super) fn exit_at_once(status: i32) -> ! {
        std::process::exit(status)
    }
}
