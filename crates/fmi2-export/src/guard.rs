//! The guard at the C interface: checks whether a call is allowed, catches panics, and reports
//! failures.

use core::ffi::CStr;
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};

use fmi2_sys::{fmi2Component, fmi2Status, fmi2String};

use crate::instance::ExportedInstance;
use crate::logger::{Category, Logger};
use crate::panics::panic_text;
use crate::state::{FmiCall, InstanceMode};
use crate::{Error, ErrorKind};

pub(crate) const OK: fmi2Status = fmi2Status::fmi2OK;
pub(crate) const ERROR: fmi2Status = fmi2Status::fmi2Error;

type CallOutcome = std::thread::Result<Result<(), Error>>;

/// Runs the body of a call on an instance, guarded.
#[inline]
pub(crate) unsafe fn enter(
    component: fmi2Component,
    call: &'static FmiCall,
    body: impl FnOnce(&mut ExportedInstance) -> Result<(), Error>,
) -> fmi2Status {
    let pointer = component.cast::<ExportedInstance>();
    // SAFETY: the importer passes a live instance and makes no two calls at the same time.
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

/// Messages of a call, sent when the instance is no longer borrowed, because a logger may call
/// back.
struct CallReport {
    logger: Logger,
    events: Vec<String>,
    failure: Option<(fmi2Status, Category, String)>,
}

impl CallReport {
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
fn conclude(instance: &mut ExportedInstance, call: &FmiCall, outcome: CallOutcome) -> CallReport {
    let failure = match outcome {
        Ok(Ok(())) => None,
        Ok(Err(error)) => {
            if error.kind() == ErrorKind::Fatal {
                instance.progress.mode = InstanceMode::Poisoned;
            }
            let (status, category) = classify(error.kind());
            Some((status, category, format!("{}: {error}", call.name)))
        }
        Err(panic) => {
            instance.progress.mode = InstanceMode::Poisoned;
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
    CallReport { logger: instance.logger.clone(), events, failure }
}

fn classify(kind: ErrorKind) -> (fmi2Status, Category) {
    match kind {
        ErrorKind::Invalid => (ERROR, Category::Error),
        ErrorKind::Discard | ErrorKind::Terminated => (fmi2Status::fmi2Discard, Category::Discard),
        ErrorKind::Fatal => (fmi2Status::fmi2Fatal, Category::Fatal),
    }
}

/// A C array to read; null is accepted when `length` is 0.
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
    // SAFETY: not null, aligned and not too long; the importer guarantees the length.
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// A C array to write, possibly uninitialised.
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
    // SAFETY: as above; MaybeUninit requires nothing of the content.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer.cast(), length) })
}

#[inline]
fn check_array<T>(pointer: *const T, length: usize, what: &str) -> Result<(), Error> {
    let fits = length <= isize::MAX as usize / size_of::<T>().max(1);
    if pointer.is_null() || !pointer.is_aligned() || !fits {
        return Err(Error::invalid(format!("{what} is not a valid array of {length} elements")));
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
    // SAFETY: not null; the importer guarantees the NUL at the end.
    Ok(unsafe { CStr::from_ptr(pointer) })
}

pub(crate) unsafe fn text<'a>(pointer: fmi2String, what: &str) -> Result<&'a str, Error> {
    // SAFETY: the caller guarantees it.
    let string = unsafe { string(pointer, what) }?;
    string.to_str().map_err(|_| Error::invalid(format!("{what} is not UTF-8")))
}
