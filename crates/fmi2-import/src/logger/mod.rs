//! Messages that FMUs send through the logger callback.

mod message;
mod registry;
#[cfg(target_os = "linux")]
mod ring;
mod sink;

use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};

use fmi2_sys as sys;

pub use message::Message;
pub(crate) use registry::{Badge, calls};
pub use registry::{Stray, take_strays};
#[cfg(target_os = "linux")]
pub(crate) use ring::Ring;
pub(crate) use sink::Sink;

use crate::description::ModelDescription;
use crate::per_type::CType;

/// Number of messages that have arrived from all FMUs.
static ARRIVED: AtomicU64 = AtomicU64::new(0);

/// Number of messages that have arrived from all FMUs so far. A master compares it once in each step to
/// see whether there are new messages.
#[inline]
pub fn arrived() -> u64 {
    ARRIVED.load(Ordering::Acquire)
}

/// Counts news about an FMU that did not arrive by the callback.
pub fn note_arrival() {
    ARRIVED.fetch_add(1, Ordering::Relaxed);
}

/// Where logger.c delivers the formatted text.
type Receiver =
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char);

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
    fn master_log_to(sink: Receiver);
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// Called by logger.c with the formatted text. FMUs may call it from their own threads, before they are
/// instantiated and after they are freed, and with any environment.
unsafe extern "C" fn master_log_sink(
    environment: *mut c_void,
    instance: *const c_char,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    let text = |pointer: *const c_char| {
        // SAFETY: not null; the FMU passes C strings
        (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy())
    };
    let message = Message::new(
        sys::fmi2Status(status.cast_unsigned()),
        text(category).unwrap_or_default().into_owned(),
        text(message).unwrap_or_default().trim_end().to_owned(),
    );
    registry::deliver(Badge::of(environment), text(instance).as_deref(), message);
    // after the delivery, so that whoever sees the number finds the message
    ARRIVED.fetch_add(1, Ordering::Release);
}

/// The callback functions for the instance with this badge.
fn callbacks(badge: Badge) -> sys::fmi2CallbackFunctions {
    static SET: Once = Once::new();
    // SAFETY: the function has the type that logger.c expects, and nothing is logged before
    SET.call_once(|| unsafe { master_log_to(master_log_sink) });
    sys::fmi2CallbackFunctions {
        logger: Some(master_log),
        allocateMemory: Some(calloc),
        freeMemory: Some(free),
        stepFinished: None,
        componentEnvironment: badge.environment(),
    }
}

/// Replaces `#r123#` by the variable's name and `##` by `#` (FMI 2.0.5, section 2.1.5).
pub(crate) fn expand(text: &str, description: &ModelDescription) -> String {
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
            let kind = match letters.next()? {
                'r' => CType::Real,
                'i' => CType::Integer,
                'b' => CType::Boolean,
                's' => CType::String,
                _ => return None,
            };
            let name = description.name_of(kind, letters.as_str().parse().ok()?)?;
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

    fn description() -> ModelDescription {
        ModelDescription::parse(
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
        let sink = Sink::new("test null and long");
        let callbacks = sink.callbacks();
        let logger = callbacks.logger.unwrap();
        let environment = callbacks.componentEnvironment;
        let long = "x".repeat(10_000) + "\0";
        // SAFETY: null and C strings are what FMUs pass
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
            // found by its name, whatever the environment
            for environment in [0, 1, 2, usize::MAX] {
                logger(
                    std::ptr::without_provenance_mut(environment),
                    c"test null and long".as_ptr(),
                    sys::fmi2Status(0),
                    c"c".as_ptr(),
                    c"x".as_ptr(),
                );
            }
        }
        let messages = sink.take(&description());
        assert_eq!(messages.len(), 7);
        assert!(messages[3..].iter().all(|message| message.text == "x"));
        assert_eq!(messages[0].text, "");
        assert_eq!(messages[1].text, "text 7 0.5 %");
        assert_eq!(messages[1].status, sys::fmi2Status(99));
        assert_eq!(messages[2].text.len(), 10_000);
    }
}
