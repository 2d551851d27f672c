//! Collects the messages that an FMU logs.

use std::collections::HashSet;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex, Once, PoisonError};

use fmi2_sys as sys;

/// Messages kept per instance.
const KEPT: usize = 1000;

/// One call of the logger.
#[derive(Debug, Clone)]
pub(crate) struct LogMessage {
    /// The instance's name as passed by the FMU.
    pub(crate) instance: Option<String>,
    pub(crate) status: c_int,
    pub(crate) category: Option<String>,
    /// The format string.
    pub(crate) format: Option<String>,
    /// The formatted message.
    pub(crate) text: String,
}

/// The messages of an instance. Its address is the `componentEnvironment`.
#[derive(Debug, Default)]
pub(crate) struct InstanceLog {
    records: Mutex<Vec<LogMessage>>,
}

/// Addresses of the existing logs. Other addresses are never dereferenced.
static LIVE: LazyLock<Mutex<HashSet<usize>>> = LazyLock::new(Mutex::default);
/// Number of messages with an unknown environment.
static STRAY: AtomicUsize = AtomicUsize::new(0);

/// Where logger.c delivers the format and the formatted text.
type Receiver = unsafe extern "C" fn(
    *mut c_void,
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const c_char,
);

unsafe extern "C" {
    /// The variadic callback in logger.c.
    fn conformance_log(
        environment: *mut c_void,
        instance: *const c_char,
        status: sys::fmi2Status,
        category: *const c_char,
        message: *const c_char,
        ...
    );
    fn conformance_log_to(sink: Receiver);
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

fn text(pointer: *const c_char) -> Option<String> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: not null; the unit passes C strings
    Some(unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}

/// Called by logger.c with the format and the formatted text.
unsafe extern "C" fn conformance_log_sink(
    environment: *mut c_void,
    instance: *const c_char,
    status: c_int,
    category: *const c_char,
    format: *const c_char,
    message: *const c_char,
) {
    let live = LIVE.lock().unwrap_or_else(PoisonError::into_inner);
    if !live.contains(&environment.addr()) {
        STRAY.fetch_add(1, Ordering::Relaxed);
        return;
    }
    // SAFETY: the address of an `InstanceLog` that is listed as alive, and cannot be unlisted meanwhile
    let log = unsafe { &*environment.cast::<InstanceLog>() };
    let mut records = log.records.lock().unwrap_or_else(PoisonError::into_inner);
    if records.len() < KEPT {
        records.push(LogMessage {
            instance: text(instance),
            status,
            category: text(category),
            format: text(format),
            text: text(message).unwrap_or_default(),
        });
    }
}

impl InstanceLog {
    /// An empty log, registered for messages.
    pub(crate) fn new() -> Box<Self> {
        let log = Box::new(Self::default());
        let address = std::ptr::from_ref(log.as_ref()).addr();
        LIVE.lock().unwrap_or_else(PoisonError::into_inner).insert(address);
        log
    }

    /// The callback functions for an instance whose messages this log receives.
    pub(crate) fn callbacks(&self) -> sys::fmi2CallbackFunctions {
        static SET: Once = Once::new();
        // SAFETY: the function has the type that logger.c expects, and nothing is logged before
        SET.call_once(|| unsafe { conformance_log_to(conformance_log_sink) });
        sys::fmi2CallbackFunctions {
            logger: Some(conformance_log),
            allocateMemory: Some(calloc),
            freeMemory: Some(free),
            stepFinished: None,
            componentEnvironment: std::ptr::from_ref(self).cast_mut().cast(),
        }
    }

    /// Takes the messages so far.
    pub(crate) fn take(&self) -> Vec<LogMessage> {
        std::mem::take(&mut *self.records.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Number of messages with an unknown environment since the last call.
    pub(crate) fn take_stray() -> usize {
        STRAY.swap(0, Ordering::Relaxed)
    }
}

impl Drop for InstanceLog {
    fn drop(&mut self) {
        let address = std::ptr::from_ref(self).addr();
        LIVE.lock().unwrap_or_else(PoisonError::into_inner).remove(&address);
    }
}
