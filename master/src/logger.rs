//! Messages that units send through the logger callback.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use fmi2_sys as sys;
use serde::Serialize;

use crate::description::Description;
#[cfg(target_os = "linux")]
use crate::isolate::Ring;

/// Messages kept per instance; a unit that floods the log loses the oldest.
const KEPT: usize = 100;

/// Messages that have arrived from all units.
static ARRIVED: AtomicU64 = AtomicU64::new(0);

/// Number of messages that have arrived from all units so far: one look per step tells whether there
/// are any to take.
#[inline]
pub(crate) fn arrived() -> u64 {
    ARRIVED.load(Ordering::Relaxed)
}

/// Counts news of a unit that have come by another way than the callback.
pub(crate) fn note_arrival() {
    ARRIVED.fetch_add(1, Ordering::Relaxed);
}

/// One message of a unit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Message {
    /// Status that it came with, by its name in the standard.
    pub status: String,
    /// Category, empty when the unit gave none.
    pub category: String,
    /// The text.
    pub text: String,
    /// Whether the status is worse than `fmi2OK`.
    #[serde(skip)]
    pub grave: bool,
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "[{}] {}", self.status, self.text)
    }
}

/// Where one instance's messages arrive. Its address is the `componentEnvironment`.
pub(crate) struct Sink {
    messages: Mutex<Store>,
}

/// Where messages stay until they are taken.
enum Store {
    /// For the master in this process.
    Here(Vec<Message>),
    /// For a master in another process.
    #[cfg(target_os = "linux")]
    Ring(&'static Ring),
}

unsafe extern "C" {
    /// The variadic callback in logger.c.
    fn master_log(
        environment: *mut c_void,
        instance: *const c_char,
        status: sys::fmi2Status,
        category: *const c_char,
        message: *const c_char,
        ...
    );
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// Called by logger.c with the formatted text. Units may call it from threads of their own.
#[unsafe(no_mangle)]
extern "C" fn master_log_sink(
    environment: *mut c_void,
    _instance: *const c_char,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    if environment.is_null() {
        return;
    }
    // SAFETY: the environment is the address of a Sink that outlives its instance (callbacks())
    let sink = unsafe { &*environment.cast::<Sink>() };
    let text = |pointer: *const c_char| {
        if pointer.is_null() {
            String::new()
        } else {
            // SAFETY: not null; the unit passes C strings
            unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
        }
    };
    let status = sys::fmi2Status(status.cast_unsigned());
    let message = Message {
        status: status.to_string(),
        category: text(category),
        text: text(message).trim_end().to_owned(),
        grave: status != sys::fmi2Status::fmi2OK,
    };
    ARRIVED.fetch_add(1, Ordering::Relaxed);
    match &mut *sink.messages.lock().unwrap_or_else(PoisonError::into_inner) {
        Store::Here(messages) => {
            if messages.len() == KEPT {
                messages.remove(0);
            }
            messages.push(message);
        }
        #[cfg(target_os = "linux")]
        Store::Ring(ring) => ring.push(message),
    }
}

impl Default for Sink {
    fn default() -> Self {
        Self { messages: Mutex::new(Store::Here(Vec::new())) }
    }
}

impl Sink {
    /// The callback functions for an instance whose messages arrive here.
    pub(crate) fn callbacks(&self) -> sys::fmi2CallbackFunctions {
        sys::fmi2CallbackFunctions {
            logger: Some(master_log),
            allocateMemory: Some(calloc),
            freeMemory: Some(free),
            stepFinished: None,
            componentEnvironment: std::ptr::from_ref(self).cast_mut().cast(),
        }
    }

    /// A sink whose messages another process takes from the ring.
    #[cfg(target_os = "linux")]
    pub(crate) fn into_ring(ring: &'static Ring) -> Self {
        Self { messages: Mutex::new(Store::Ring(ring)) }
    }

    /// Takes all messages, with variable references expanded.
    pub(crate) fn take(&self, description: &Description) -> Vec<Message> {
        let mut messages = match &mut *self.messages.lock().unwrap_or_else(PoisonError::into_inner)
        {
            Store::Here(messages) => std::mem::take(messages),
            #[cfg(target_os = "linux")]
            Store::Ring(ring) => ring.take(),
        };
        for message in &mut messages {
            message.text = expand(&message.text, description);
        }
        messages
    }
}

/// Replaces `#r123#` by the variable's name and `##` by `#` (FMI 2.0.5, section 2.1.5).
pub(crate) fn expand(text: &str, description: &Description) -> String {
    let mut expanded = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('#') {
        expanded.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix('#') {
            expanded.push('#');
            rest = after;
            continue;
        }
        let reference = rest.split_once('#').and_then(|(inner, after)| {
            let mut letters = inner.chars();
            let letter = letters.next()?;
            let name = description.name_of(letter, letters.as_str().parse().ok()?)?;
            Some((name, after))
        });
        match reference {
            Some((name, after)) => {
                expanded.push_str(name);
                rest = after;
            }
            None => expanded.push('#'),
        }
    }
    expanded.push_str(rest);
    expanded
}

#[cfg(test)]
mod tests {
    use super::*;

    fn description() -> Description {
        Description::parse(
            r#"<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
            <CoSimulation modelIdentifier="m"/>
            <ModelVariables><ScalarVariable name="gap" valueReference="3"><Real/></ScalarVariable>
            <ScalarVariable name="n" valueReference="3"><Integer/></ScalarVariable></ModelVariables>
            <ModelStructure/></fmiModelDescription>"#,
        )
        .unwrap()
    }

    #[test]
    fn analytic_references_are_expanded() {
        let d = description();
        assert_eq!(expand("#r3# and #i3# cost 1## #r9# #x", &d), "gap and n cost 1# #r9# #x");
        assert_eq!(expand("", &d), "");
        assert_eq!(expand("#", &d), "#");
    }

    #[test]
    fn issue_null_and_long_messages_arrive() {
        let sink = Sink::default();
        let callbacks = sink.callbacks();
        let logger = callbacks.logger.unwrap();
        let environment = callbacks.componentEnvironment;
        let long = "x".repeat(10_000) + "\0";
        // SAFETY: null and C strings are what units pass
        unsafe {
            logger(
                environment,
                std::ptr::null(),
                sys::fmi2Status(1),
                std::ptr::null(),
                std::ptr::null(),
            );
            logger(
                environment,
                c"u".as_ptr(),
                sys::fmi2Status(99),
                c"c".as_ptr(),
                c"%s %d %g %%".as_ptr(),
                c"text".as_ptr(),
                7 as c_int,
                0.5_f64,
            );
            logger(
                environment,
                c"u".as_ptr(),
                sys::fmi2Status(0),
                c"c".as_ptr(),
                c"%s".as_ptr(),
                long.as_ptr(),
            );
            logger(
                std::ptr::null_mut(),
                c"u".as_ptr(),
                sys::fmi2Status(0),
                c"c".as_ptr(),
                c"x".as_ptr(),
            );
        }
        let messages = sink.take(&description());
        assert_eq!(messages.len(), 3);
        assert_eq!(messages[0].text, "");
        assert_eq!(messages[1].text, "text 7 0.5 %");
        assert_eq!(messages[1].status, "unknown status 99");
        assert_eq!(messages[2].text.len(), 10_000);
    }
}
