//! Reports that code of an FMU ends this process, by a crash or by `exit`.
//!
//! The run cannot continue after that. But the instance, the call and the time can be reported, recorded
//! results can be written, and the exit status can be that of a failure. [Isolated](crate::isolate)
//! FMUs end only their own process.

use std::io::Write as _;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering};

use crate::activity::Activity;
use crate::logger::{self, Badge};

/// Number of the current [`Activity`] in this process.
pub(crate) static CALL: AtomicU32 = AtomicU32::new(Activity::IDLE);
/// The instance that was called last in this process.
static LAST: AtomicPtr<Place> = AtomicPtr::new(std::ptr::null_mut());

/// Saves results when an FMU ends the process.
static RESCUE: OnceLock<fn()> = OnceLock::new();

/// Sets the function that saves recorded results when an FMU is about to end this process. It may be
/// called in a signal handler, so it must not take a lock that another thread can hold, and must neither
/// allocate nor free memory. Only the first call has an effect.
pub fn rescue_with(save: fn()) {
    let _ = RESCUE.set(save);
}

/// Saves recorded results.
fn rescue() {
    if let Some(save) = RESCUE.get() {
        save();
    }
}

/// What a crash report says about an instance. It is never freed.
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

/// The current call to an FMU in this process in words, if there is one.
pub fn whereabouts() -> Option<String> {
    let call = match Activity::from_number(CALL.load(Ordering::Relaxed)) {
        Activity::None => return None,
        activity => activity.name(),
    };
    // SAFETY: places are never freed
    let place = unsafe { LAST.load(Ordering::Relaxed).as_ref() }?;
    let time = f64::from_bits(place.time.load(Ordering::Relaxed));
    let at = if time.is_nan() { String::new() } else { format!(" at {time} s") };
    Some(format!("unit {}: {call}{at} had not returned", place.name))
}

/// Loads a library with `load`, while its initialisers run. From now on only the program itself may end
/// this process ([`leave`], [`release`]).
pub(crate) fn while_loading<T>(unit: &str, load: impl FnOnce() -> T) -> T {
    system::guard();
    Place::new(unit, Badge::NONE).enter();
    CALL.store(Activity::LOADING, Ordering::Relaxed);
    let loaded = load();
    CALL.store(Activity::IDLE, Ordering::Relaxed);
    loaded
}

/// Reports crashes and exits in code of FMUs on stderr. The process then ends with a status other than 0.
/// A program calls this once, at its beginning, and [`leave`] or [`release`] before it ends.
pub fn report_crashes() {
    system::install();
}

/// Ends the process with a status if FMUs have been loaded into it; otherwise returns the status. Exit
/// handlers of FMUs run, for instance to close files, but a crash or an exit in them does not change the
/// status, and an endless loop is aborted.
#[must_use]
pub fn leave(status: ExitCode) -> ExitCode {
    if system::release() {
        crate::scratch::remove_all();
        if let Some(number) = (0..=u8::MAX).find(|&number| ExitCode::from(number) == status) {
            // an error in printing does not matter any more
            let _ = std::io::stdout().flush();
            system::leave(number);
        }
    }
    status
}

/// Ends the process at once with a status, without calls to FMUs. Other threads may still be in such
/// calls.
pub fn end_at_once(status: u8) -> ! {
    system::release();
    crate::scratch::remove_all();
    // an error in printing does not matter any more
    let _ = std::io::stdout().flush();
    system::exit_at_once(status.into())
}

/// From now on the program may end, whatever FMUs do then.
pub fn release() {
    system::release();
}

/// Replaces the C library's `_exit`: ends the process at once. If an FMU calls it, that is reported and
/// the status is 1.
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
    use crate::activity::Activity;
    use crate::signal::signal_name;

    /// Number of the process whose handlers are installed; 0 if there is none.
    static OWNER: AtomicI32 = AtomicI32::new(0);
    /// Number of the process that FMUs must not end; 0 if there is none.
    static GUARDED: AtomicI32 = AtomicI32::new(0);
    /// The status that the process ends with; -1 before it is certain.
    static FINAL: AtomicI32 = AtomicI32::new(-1);
    const FAULTS: [libc::c_int; 5] =
        [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGABRT];
    /// Longest time for the exit handlers of FMUs.
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

    /// FMUs must not end this process, if the handlers are installed.
    pub(super) fn guard() {
        GUARDED.store(OWNER.load(Ordering::Relaxed), Ordering::Relaxed);
    }

    /// Undoes [`guard`], and returns whether it was in effect.
    pub(super) fn release() -> bool {
        GUARDED.swap(0, Ordering::Relaxed) != 0
    }

    /// Whether an exit of this process is caused by an FMU. A process that an FMU forked may end.
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

    /// Flushes the output of C code. Does not wait long, since a thread of an FMU may hold a lock on a file.
    fn print_rest() {
        let (done, end) = mpsc::channel();
        let print = move || {
            // SAFETY: null stands for all files
            unsafe { libc::fflush(std::ptr::null_mut()) };
            // the receiver is gone if it took too long
            let _ = done.send(());
        };
        if std::thread::Builder::new().spawn(print).is_ok() {
            let _ = end.recv_timeout(Duration::from_secs(1));
        }
    }

    extern "C" fn on_late_signal(signal: libc::c_int) {
        let what = if signal == libc::SIGALRM { "did not return" } else { "crashed" };
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
            report_exit();
        }
        let certain = FINAL.load(Ordering::Relaxed);
        let ours = certain >= 0 && OWNER.load(Ordering::Relaxed) == this_process();
        end(if ours { certain } else { status })
    }

    extern "C" fn on_exit() {
        if is_guarded() {
            crate::scratch::remove_all();
            report_exit();
        }
    }

    /// Reports that an FMU ends the process, saves recorded results and ends the process with status 1.
    fn report_exit() -> ! {
        print_cause(None);
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
        print_cause(Some(signal));
        // a process that an FMU forked has copies of the results of this one
        if OWNER.load(Ordering::Relaxed) == this_process() {
            super::rescue();
        }
        // on return the fault occurs again, now with the default action
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

    /// Prints the instance, the call and the time; nothing if no FMU caused the crash.
    fn print_cause(signal: Option<libc::c_int>) {
        let activity = Activity::from_number(CALL.load(Ordering::Relaxed));
        let last = LAST.load(Ordering::Relaxed);
        if last.is_null() || (activity == Activity::None && signal.is_some()) {
            return;
        }
        // SAFETY: not null, and places are never freed
        let place = unsafe { &*last };
        let call = activity.name();
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
            "\nhelp: in a process of its own (--isolate) the unit would end only itself, and the results \
             up to then would be complete\n",
        );
        text.print();
    }
}

/// Handlers are available on Unix only.
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
