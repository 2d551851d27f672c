//! What remains of a panic: its message, and values that it may have left half-written.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Drops what a panic may have left half-written, as unwinding would: that is sound, but its
/// destructor may panic again, and what that leaves is leaked.
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
                // The destructor of an unknown payload may panic itself.
                std::mem::forget(other);
                "(no message)".to_owned()
            }
        },
    }
}
