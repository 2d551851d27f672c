//! The guard at the C border: what a call of an instance may do, and what becomes of its failure.

use core::ffi::CStr;
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};

use fmi2_sys::{fmi2Component, fmi2Status, fmi2String};

use crate::instance::Instance;
use crate::logger::{Category, Logger};
use crate::state::{Call, Mode};
use crate::{Error, Kind};

pub(crate) const OK: fmi2Status = fmi2Status::fmi2OK;
pub(crate) const ERROR: fmi2Status = fmi2Status::fmi2Error;

type Outcome = std::thread::Result<Result<(), Error>>;

/// Runs the body of a call on an instance, guarded.
#[inline]
pub(crate) unsafe fn enter(
    component: fmi2Component,
    call: &'static Call,
    body: impl FnOnce(&mut Instance) -> Result<(), Error>,
) -> fmi2Status {
    let pointer = component.cast::<Instance>();
    // SAFETY: the importer hands over a live instance and lets no two calls run at a time.
    let Some(instance) = (unsafe { pointer.as_mut() }) else { return ERROR };
    let mode = instance.progress.mode;
    let outcome = if call.allows(mode) {
        catch_unwind(AssertUnwindSafe(|| body(&mut *instance)))
    } else {
        Ok(Err(Error::invalid(call.refusal(mode))))
    };
    if matches!(outcome, Ok(Ok(()))) && instance.events.is_empty() {
        return OK;
    }
    conclude(instance, call, outcome).send()
}

/// What a call has to say once the instance is no longer borrowed: a logger may call back.
struct Report {
    logger: Logger,
    events: Vec<String>,
    failure: Option<(fmi2Status, Category, String)>,
}

impl Report {
    fn send(self) -> fmi2Status {
        for event in &self.events {
            self.logger.send(OK, Category::Events, event);
        }
        let Some((status, category, message)) = self.failure else { return OK };
        self.logger.send(status, category, &message);
        status
    }
}

#[cold]
fn conclude(instance: &mut Instance, call: &Call, outcome: Outcome) -> Report {
    let failure = match outcome {
        Ok(Ok(())) => None,
        Ok(Err(error)) => {
            if error.kind() == Kind::Fatal {
                instance.progress.mode = Mode::Poisoned;
            }
            let (status, category) = classify(error.kind());
            Some((status, category, format!("{}: {error}", call.name)))
        }
        Err(panic) => {
            instance.progress.mode = Mode::Poisoned;
            let text = format!(
                "{}: the model panicked at t = {} s: {}. Only fmi2Reset and fmi2FreeInstance are \
                 possible now. This is a fault of the unit",
                call.name,
                instance.progress.time,
                panic_text(panic)
            );
            Some((ERROR, Category::Error, text))
        }
    };
    let events = std::mem::take(&mut instance.events);
    Report { logger: instance.logger.clone(), events, failure }
}

fn classify(kind: Kind) -> (fmi2Status, Category) {
    match kind {
        Kind::Invalid => (ERROR, Category::Error),
        Kind::Discard => (fmi2Status::fmi2Discard, Category::Discard),
        Kind::Fatal => (fmi2Status::fmi2Fatal, Category::Fatal),
    }
}

/// Drops what a panic may have left half-written, as unwinding would: that is sound, but its
/// destructor may panic again, and what that leaves is leaked.
pub(crate) fn dropped<T>(value: T) {
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| drop(value))) {
        drop(panic_text(panic));
    }
}

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

/// A C array to read; null is as good as empty when `length` is 0.
#[inline]
pub(crate) unsafe fn slice<'a, T>(
    pointer: *const T,
    length: usize,
    what: &str,
) -> Result<&'a [T], Error> {
    if length == 0 {
        return Ok(&[]);
    }
    check_array(pointer, length, what)?;
    // SAFETY: not null, aligned and not too long; the importer vouches for the length.
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// A C array to write, perhaps not initialised yet.
#[inline]
pub(crate) unsafe fn slice_out<'a, T>(
    pointer: *mut T,
    length: usize,
    what: &str,
) -> Result<&'a mut [MaybeUninit<T>], Error> {
    if length == 0 {
        return Ok(&mut []);
    }
    check_array(pointer, length, what)?;
    // SAFETY: as above; MaybeUninit asks nothing of the content.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer.cast(), length) })
}

#[inline]
fn check_array<T>(pointer: *const T, length: usize, what: &str) -> Result<(), Error> {
    let fits = length <= isize::MAX as usize / size_of::<T>().max(1);
    if pointer.is_null() || !pointer.is_aligned() || !fits {
        return Err(Error::invalid(format!("the array {what} of {length} elements is no array")));
    }
    Ok(())
}

pub(crate) fn null(what: &str) -> Error {
    Error::invalid(format!("{what} is a null pointer"))
}

pub(crate) unsafe fn string<'a>(pointer: fmi2String, what: &str) -> Result<&'a CStr, Error> {
    if pointer.is_null() {
        return Err(null(what));
    }
    // SAFETY: not null; the importer vouches for the NUL at the end.
    Ok(unsafe { CStr::from_ptr(pointer) })
}

pub(crate) unsafe fn text<'a>(pointer: fmi2String, what: &str) -> Result<&'a str, Error> {
    // SAFETY: passed on to the caller.
    let string = unsafe { string(pointer, what) }?;
    string.to_str().map_err(|_| Error::invalid(format!("{what} is not UTF-8")))
}
