//! Handling of a panic: its message, and values that it may have left inconsistent.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Drops a value that a panic may have left inconsistent, as unwinding would. That is sound, but
/// the destructor may panic again; the rest of the value is then leaked.
pub(crate) fn dropped<T>(value: T) {
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        drop(panic_text(panic));
    }
}

/// The message of a panic.
pub(crate) fn panic_text(panic: Box<dyn std::any::Any + Send>) -> String {
    match panic.downcast::<String>() {
        Ok(text) => *text,
        Err(other) => match other.downcast::<&'static str>() {
            Ok(text) => (*text).to_owned(),
            Err(other) => {
                // The destructor of an unknown payload may itself panic.
                std::mem::forget(other);
                "(no message)".to_owned()
            }
        },
    }
}
