//! Reports beyond FMI: answered, refused, guarded.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{Everything, NONE};
use fmi2_export::ffi;
use fmi2_export::testing::TestInstance;

fn stepped() -> TestInstance {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.initialize(0.0).unwrap();
    one.step(0.0, 0.1).unwrap();
    one
}

#[test]
fn invariant_a_report_sees_state_and_values_and_changes_nothing() {
    let mut one = stepped();
    let text = one.report("x").unwrap();
    assert!(text.ends_with("at u = 0.25"), "{text}");
    assert_eq!(one.report("x").unwrap(), text);
    one.step(0.1, 0.1).unwrap();
    let mut other = stepped();
    other.step(0.1, 0.1).unwrap();
    assert_eq!(one.serialize().unwrap(), other.serialize().unwrap());
    // before initialization there is no state to report on
    let early = TestInstance::new::<Everything>(NONE).unwrap().report("x").unwrap_err().to_string();
    assert!(early.contains("not allowed before initialization"), "{early}");
}

#[test]
fn issue_unknown_empty_and_failing_reports_say_why() {
    let mut one = stepped();
    for (request, reason) in [
        ("other", "the unit offers no report \"other\""),
        ("nothing", "the unit offers no report \"nothing\""),
        ("fail", "asked to fail"),
    ] {
        let text = one.report(request).unwrap_err().to_string();
        assert!(text.contains(reason), "{text}");
    }
    // none of that ends the run
    one.step(0.1, 0.1).unwrap();
    let text = one.report("panic").unwrap_err().to_string();
    assert!(text.contains("asked to panic in a report"), "{text}");
    assert!(one.step(0.2, 0.1).is_err());
}

/// A short buffer gets the beginning, null the length alone; null requests and components nothing.
#[test]
fn invariant_buffers_are_respected() {
    let mut one = stepped();
    let text = one.report("x").unwrap();
    let mut short = [0_u8; 6];
    let null = std::ptr::null_mut();
    // SAFETY: the buffer has the capacity stated but for its last two bytes.
    unsafe {
        let length = ffi::report(one.component(), c"x".as_ptr(), short.as_mut_ptr().cast(), 4);
        assert_eq!(length, text.len());
        assert_eq!(ffi::report(one.component(), c"x".as_ptr(), null, 0), text.len());
        assert_eq!(ffi::report(one.component(), c"x".as_ptr(), null, 4), 0);
        assert_eq!(ffi::report(one.component(), std::ptr::null(), null, 0), 0);
        assert_eq!(ffi::report(null.cast(), c"x".as_ptr(), null, 0), 0);
    }
    assert_eq!(&short, b"x is\0\0");
}
