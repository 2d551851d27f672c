//! Messages of a unit under test, and the callbacks that collect them.

use core::ffi::{CStr, c_void};
use std::sync::{Mutex, PoisonError};

use fmi2_sys::{
    fmi2CallbackFunctions, fmi2CallbackLogger, fmi2ComponentEnvironment, fmi2Status, fmi2String,
};

use crate::Error;

/// A message that the unit logged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoggedMessage {
    /// Status passed with the message.
    pub status: fmi2Status,
    /// The log category.
    pub category: String,
    /// The text as passed to the logger: a printf format with `%` and `#` doubled.
    pub text: String,
}

/// A call that did not return `fmi2OK`, with the messages of the unit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{call} returned {status}: {}", .messages.iter().map(|m| m.text.as_str()).collect::<Vec<_>>().join("; "))]
pub struct CallFailure {
    /// The function.
    pub call: &'static str,
    /// What it returned.
    pub status: fmi2Status,
    /// Messages since the last failure or [`TestInstance::messages`](super::TestInstance::messages).
    pub messages: Vec<LoggedMessage>,
}

impl CallFailure {
    pub(super) fn new(call: &'static str, error: &Error) -> Self {
        let text = error.to_string();
        let (status, category) = (fmi2Status::fmi2Error, String::new());
        Self { call, status, messages: vec![LoggedMessage { status, category, text }] }
    }
}

/// Messages that the logger has collected.
pub(crate) type MessageLog = Mutex<Vec<LoggedMessage>>;

/// Callbacks as an importer passes them. The kit only uses the logger.
pub(crate) fn callbacks(log: &MessageLog) -> fmi2CallbackFunctions {
    type Fixed = unsafe extern "C" fn(
        fmi2ComponentEnvironment,
        fmi2String,
        fmi2Status,
        fmi2String,
        fmi2String,
    );
    // SAFETY: stable Rust cannot define a variadic function. In the C calling conventions of the
    // platforms that FMI knows (System V, Windows x64, AAPCS64 and Apple's) the named arguments of
    // a variadic function are passed like those of any other, and the kit passes no others.
    let logger =
        unsafe { std::mem::transmute::<Option<Fixed>, fmi2CallbackLogger>(Some(write_log)) };
    fmi2CallbackFunctions {
        logger,
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: std::ptr::from_ref(log).cast_mut().cast::<c_void>(),
    }
}

unsafe extern "C" fn write_log(
    environment: fmi2ComponentEnvironment,
    _instance: fmi2String,
    status: fmi2Status,
    category: fmi2String,
    text: fmi2String,
) {
    let read = |pointer: fmi2String| {
        if pointer.is_null() {
            return "(null)".to_owned();
        }
        // SAFETY: not null, so a C string.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    let message = LoggedMessage { status, category: read(category), text: read(text) };
    // SAFETY: the environment is the log of a live instance.
    if let Some(log) = unsafe { environment.cast::<MessageLog>().as_ref() } {
        log.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}
