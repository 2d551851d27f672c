//! Trouble inside the model, and what the importer gets to hear of it.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{Everything, NONE, trouble};
use fmi2_export::ffi;
use fmi2_export::sys::fmi2Status;
use fmi2_export::testing::{CallFailure, TestInstance};

fn troubled(kind: i32) -> TestInstance {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.initialize(0.0).unwrap();
    one.step(0.0, 0.1).unwrap();
    one.set_integer("trouble", kind).unwrap();
    one
}

fn failed_step(one: &mut TestInstance, size: f64) -> CallFailure {
    one.messages();
    one.step(0.1, size).unwrap_err()
}

/// The same steps without trouble, for comparison.
fn reference() -> f64 {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.initialize(0.0).unwrap();
    one.step(0.0, 0.1).unwrap();
    one.step(0.1, 0.1).unwrap();
    one.real("y").unwrap()
}

#[test]
fn issue_a_panic_poisons_one_instance_until_reset() {
    let mut other = troubled(0);
    let mut one = troubled(trouble::PANIC_IN_STEP);
    one.save().unwrap();
    let failure = failed_step(&mut one, 0.1);
    assert_eq!(failure.status, fmi2Status::fmi2Error);
    let text = failure.to_string();
    assert!(text.contains("fmi2DoStep: the model panicked at t = 0.1 s: asked to panic"), "{text}");
    // Nothing of the half-written model is used.
    for failure in [one.real("y").map(drop), one.step(0.1, 0.1), one.restore(), one.save()] {
        assert!(failure.unwrap_err().to_string().contains("after a panic of the model"));
    }
    // The other instance does not notice.
    other.step(0.1, 0.1).unwrap();
    assert_eq!(other.real("y").unwrap(), reference());
    // Reset builds the model anew.
    one.reset().unwrap();
    one.initialize(0.0).unwrap();
    one.step(0.0, 0.1).unwrap();
    one.step(0.1, 0.1).unwrap();
    assert_eq!(one.real("y").unwrap(), reference());
}

#[test]
fn issue_a_panic_while_looking_or_initialising_is_caught_too() {
    let mut one = troubled(trouble::PANIC_IN_OUTPUTS);
    assert!(one.real("y").unwrap_err().to_string().contains("asked to panic in outputs"));
    assert!(one.real("u").is_err());
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.set_integer("trouble", trouble::PANIC_IN_INITIALISE).unwrap();
    one.messages();
    let failure = one.initialize(0.0).unwrap_err();
    let text = &failure.messages.last().unwrap().text;
    // A message is a printf format with references in #: both are doubled.
    assert!(text.contains("asked to panic 100%% in ##initialise##"), "{text}");
}

#[test]
fn issue_an_error_in_a_step_leaves_looking_restoring_and_resetting() {
    let mut one = troubled(trouble::ERROR_IN_STEP);
    one.save().unwrap();
    let before = one.real("y").unwrap();
    let failure = failed_step(&mut one, 0.1);
    assert_eq!(failure.messages.last().unwrap().category, "logStatusError");
    assert!(failure.to_string().contains("asked to fail"));
    assert_eq!(one.real("y").unwrap(), before);
    assert!(one.step(0.1, 0.1).is_err());
    assert!(one.set_real("u", 0.0).is_err());
    one.restore().unwrap();
    one.set_integer("trouble", 0).unwrap();
    one.step(0.1, 0.1).unwrap();
    assert_eq!(one.real("y").unwrap(), reference());
    one.set_integer("trouble", trouble::ERROR_IN_STEP).unwrap();
    assert!(one.step(0.2, 0.1).is_err());
    one.reset().unwrap();
    one.initialize(0.0).unwrap();
}

#[test]
fn issue_a_discarded_step_can_be_tried_smaller_from_a_saved_state() {
    let mut one = troubled(trouble::DISCARD_LONG_STEPS);
    one.save().unwrap();
    let failure = failed_step(&mut one, 0.2);
    assert_eq!(failure.status, fmi2Status::fmi2Discard);
    assert_eq!(failure.messages.last().unwrap().category, "logStatusDiscard");
    let mut time = 0.0;
    let kind = fmi2_export::sys::fmi2StatusKind::fmi2LastSuccessfulTime;
    // SAFETY: the component is alive and the place is there.
    unsafe { ffi::get_real_status(one.component(), kind, &raw mut time) };
    assert_eq!(time, 0.1);
    assert!(one.step(0.1, 0.1).is_err());
    one.restore().unwrap();
    one.step(0.1, 0.1).unwrap();
    assert_eq!(one.real("y").unwrap(), reference());
}

#[test]
fn issue_16_a_model_can_end_the_simulation() {
    let mut one = troubled(trouble::END_IN_STEP);
    one.save().unwrap();
    let terminated = |one: &mut TestInstance| {
        let mut ended = 7;
        let kind = fmi2_export::sys::fmi2StatusKind::fmi2Terminated;
        // SAFETY: the component is alive and the place is there.
        let status = unsafe { ffi::get_boolean_status(one.component(), kind, &raw mut ended) };
        (status, ended)
    };
    assert_eq!(terminated(&mut one), (fmi2Status::fmi2OK, 0));
    let failure = failed_step(&mut one, 0.1);
    assert_eq!(failure.status, fmi2Status::fmi2Discard);
    assert!(failure.to_string().contains("the end is reached"), "{failure}");
    assert_eq!(terminated(&mut one), (fmi2Status::fmi2OK, 1));
    assert!(one.step(0.1, 0.1).is_err() && one.real("y").is_ok());
    // an earlier state is before the end
    one.restore().unwrap();
    assert_eq!(terminated(&mut one), (fmi2Status::fmi2OK, 0));
    one.set_integer("trouble", 0).unwrap();
    one.step(0.1, 0.1).unwrap();
    assert_eq!(one.real("y").unwrap(), reference());
}

#[test]
fn issue_outputs_that_fail_after_the_step_are_no_discard() {
    let mut one = troubled(trouble::DISCARD_IN_OUTPUTS);
    let failure = failed_step(&mut one, 0.1);
    assert_eq!(failure.status, fmi2Status::fmi2Error);
    assert!(one.step(0.2, 0.1).is_err());
}

#[test]
fn issue_an_output_that_is_not_finite_is_named_with_its_time() {
    let mut one = troubled(trouble::NAN_AFTER_STEP);
    let text = failed_step(&mut one, 0.1).to_string();
    assert!(text.contains("y is NaN at t = 0.2 s"), "{text}");
    assert!(one.step(0.2, 0.1).is_err());
    // While looking, too.
    let mut one = troubled(trouble::NAN_AFTER_STEP);
    assert!(one.real("y").unwrap_err().to_string().contains("y is NaN at t = 0.1 s"));
    one.set_integer("trouble", 0).unwrap();
    assert!(one.real("y").is_ok());
}

#[test]
fn issue_fatal_comes_through_and_ends_the_instance() {
    let mut one = troubled(trouble::FATAL_IN_STEP);
    let failure = failed_step(&mut one, 0.1);
    assert_eq!(failure.status, fmi2Status::fmi2Fatal);
    assert_eq!(failure.messages.last().unwrap().category, "logStatusFatal");
    assert!(one.real("y").is_err());
}

#[test]
fn issue_failing_to_initialise_can_be_mended_in_place() {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    one.set_integer("trouble", trouble::ERROR_IN_INITIALISE).unwrap();
    assert!(one.initialize(0.0).is_err());
    one.set_integer("trouble", 0).unwrap();
    one.exit_initialization().unwrap();
    one.step(0.0, 0.1).unwrap();
}

#[test]
fn issue_events_are_logged_on_request_and_errors_always() {
    let mut one = TestInstance::new::<Everything>(NONE).unwrap();
    let component = one.component();
    one.initialize(2.5).unwrap();
    let events = one.messages();
    assert_eq!(events.len(), 2);
    assert!(events.iter().all(|event| event.category == "logEvents"));
    assert!(events[1].text.contains("initialized at t = 2.5 s"));
    // SAFETY: the component is alive and the arrays are there.
    unsafe {
        assert_eq!(ffi::set_debug_logging(component, 0, 0, std::ptr::null()), fmi2Status::fmi2OK);
        one.reset().unwrap();
        assert!(one.messages().is_empty());
        assert!(one.real("y").unwrap_err().messages.len() == 1);
        let wanted = [c"logEvents".as_ptr()];
        assert_eq!(ffi::set_debug_logging(component, 1, 1, wanted.as_ptr()), fmi2Status::fmi2OK);
        one.reset().unwrap();
        assert_eq!(one.messages().len(), 1);
        let foreign = [c"logEverything".as_ptr()];
        assert_eq!(
            ffi::set_debug_logging(component, 1, 1, foreign.as_ptr()),
            fmi2Status::fmi2Error
        );
    }
    assert!(one.messages()[0].text.contains("no log category \"logEverything\""));
}

/// FMI lets a logger do anything, even ask the unit for values.
#[test]
fn issue_a_logger_may_call_back() {
    use fmi2_export::sys::*;
    use std::sync::atomic::{AtomicPtr, AtomicU64, Ordering};
    static COMPONENT: AtomicPtr<core::ffi::c_void> = AtomicPtr::new(std::ptr::null_mut());
    static SEEN: AtomicU64 = AtomicU64::new(0);
    unsafe extern "C" fn logger(
        _: fmi2ComponentEnvironment,
        _: fmi2String,
        _: fmi2Status,
        _: fmi2String,
        _: fmi2String,
    ) {
        let component = COMPONENT.load(Ordering::Relaxed);
        if !component.is_null() {
            let (vr, mut value) = (0_u32, 0.0);
            // SAFETY: the component is alive.
            unsafe { ffi::get_real(component, &raw const vr, 1, &raw mut value) };
            SEEN.store(value.to_bits(), Ordering::Relaxed);
        }
    }
    type Fixed = unsafe extern "C" fn(
        fmi2ComponentEnvironment,
        fmi2String,
        fmi2Status,
        fmi2String,
        fmi2String,
    );
    let functions = fmi2CallbackFunctions {
        // SAFETY: named arguments of a variadic function travel like any others.
        logger: unsafe { std::mem::transmute::<Option<Fixed>, fmi2CallbackLogger>(Some(logger)) },
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: std::ptr::null_mut(),
    };
    let xml = fmi2_export::describe::<Everything>(&fmi2_export::Resources::new(NONE)).unwrap();
    let document = roxmltree::Document::parse(&xml).unwrap();
    let guid = document.root_element().attribute("guid").unwrap();
    let guid = std::ffi::CString::new(guid).unwrap();
    // SAFETY: everything lives through the calls.
    unsafe {
        let component = ffi::instantiate::<Everything>(
            c"one".as_ptr(),
            fmi2Type::fmi2CoSimulation,
            guid.as_ptr(),
            std::ptr::null(),
            &raw const functions,
            0,
            0,
        );
        assert!(!component.is_null());
        ffi::setup_experiment(component, 0, 0.0, 0.0, 0, 0.0);
        ffi::enter_initialization_mode(component);
        ffi::exit_initialization_mode(component);
        COMPONENT.store(component, Ordering::Relaxed);
        assert_eq!(ffi::do_step(component, 7.0, 0.1, 0), fmi2Status::fmi2Error);
        COMPONENT.store(std::ptr::null_mut(), Ordering::Relaxed);
        ffi::free_instance(component);
    }
    assert_eq!(f64::from_bits(SEEN.load(Ordering::Relaxed)), 2.0);
}
