//! Which call is allowed when, and what bad arguments do: a refusal changes nothing.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use std::ptr::{null, null_mut};

use common::{Everything, NONE};
use fmi2_export::ffi;
use fmi2_export::sys::*;
use fmi2_export::testing::TestInstance;

const OK: fmi2Status = fmi2Status::fmi2OK;
const ERROR: fmi2Status = fmi2Status::fmi2Error;
const DISCARD: fmi2Status = fmi2Status::fmi2Discard;

fn instance() -> TestInstance {
    TestInstance::new::<Everything>(NONE).unwrap()
}

fn initialized() -> TestInstance {
    let mut one = instance();
    one.initialize(0.0).unwrap();
    one
}

#[test]
fn issue_the_usual_life_of_an_instance() {
    let mut one = instance();
    one.set_real("gain", 4.0).unwrap();
    one.enter_initialization(1.0).unwrap();
    one.set_real("u", 0.5).unwrap();
    // x = 1, gain·u² = 1, offset = 0.5
    assert_eq!(one.real("y").unwrap(), 2.5);
    // Set again: computed again.
    one.set_real("u", 1.0).unwrap();
    assert_eq!(one.real("y").unwrap(), 5.5);
    assert_eq!(one.real("product").unwrap(), 12.0);
    one.exit_initialization().unwrap();
    one.step(1.0, 0.1).unwrap();
    one.step(1.1, 0.2).unwrap();
    assert_eq!(one.integer("steps").unwrap(), 2);
    assert!(!one.boolean("odd").unwrap());
    one.set_string("note", "grüße").unwrap();
    one.set_boolean("switch", true).unwrap();
    one.set_integer("mode", -7).unwrap();
    assert_eq!(one.string("echo").unwrap(), "grüße|-7|true");
    // SAFETY: the component is alive, here and below.
    assert_eq!(unsafe { ffi::terminate(one.component()) }, OK);
    assert!(one.messages().iter().all(|message| message.status == OK));
}

#[test]
fn issue_inputs_between_steps_reach_the_outputs_at_once() {
    let mut one = initialized();
    let before = one.real("y").unwrap();
    one.set_real("u", 1.25).unwrap();
    // gain·(1.25² − 0.25²) = 3
    assert_eq!(one.real("y").unwrap() - before, 3.0);
}

#[test]
fn issue_tunable_parameters_are_told_once_and_before_the_step() {
    let mut one = initialized();
    one.set_real("offset", 2.0).unwrap();
    one.set_real("offset", 3.0).unwrap();
    assert_eq!(one.real("told").unwrap(), 3.0);
    one.set_real("offset", 4.0).unwrap();
    one.step(0.0, 0.1).unwrap();
    assert_eq!(one.real("told").unwrap(), 7.0);
}

#[test]
fn issue_calls_at_the_wrong_moment_are_refused_and_change_nothing() {
    let mut one = instance();
    let component = one.component();
    // SAFETY: the component is alive.
    unsafe {
        assert_eq!(ffi::do_step(component, 0.0, 0.1, 0), ERROR);
        assert_eq!(ffi::exit_initialization_mode(component), ERROR);
    }
    assert_eq!(one.real("y").unwrap_err().status, ERROR);
    one.enter_initialization(0.0).unwrap();
    // SAFETY: the component is alive.
    unsafe {
        assert_eq!(ffi::enter_initialization_mode(component), ERROR);
        assert_eq!(ffi::setup_experiment(component, 0, 0.0, 0.0, 0, 0.0), ERROR);
        assert_eq!(ffi::do_step(component, 0.0, 0.1, 0), ERROR);
    }
    one.exit_initialization().unwrap();
    assert_eq!(one.set_real("gain", 1.0).unwrap_err().status, ERROR);
    assert_eq!(one.set_integer("count", 1).unwrap_err().status, ERROR);
    let texts = one.set_real("y", 1.0).unwrap_err();
    assert!(texts.messages[0].text.contains("y cannot be set: it is an output"), "{texts}");
    one.step(0.0, 0.1).unwrap();
    // SAFETY: the component is alive.
    unsafe {
        assert_eq!(ffi::cancel_step(component), ERROR);
        assert_eq!(ffi::terminate(component), OK);
        // Importers terminate twice when they clean up.
        assert_eq!(ffi::terminate(component), OK);
        assert_eq!(ffi::do_step(component, 0.1, 0.1, 0), ERROR);
    }
    assert!(one.real("y").is_ok());
    assert_eq!(one.set_real("u", 1.0).unwrap_err().status, ERROR);
}

#[test]
fn issue_start_values_may_come_before_the_experiment_is_set_up() {
    let mut one = instance();
    one.set_real("u", 0.75).unwrap();
    one.set_real("offset", 1.0).unwrap();
    one.initialize(0.0).unwrap();
    assert_eq!(one.real("u").unwrap(), 0.75);
    // SAFETY: the component is alive; terminating early is tolerated.
    assert_eq!(unsafe { ffi::terminate(instance().component()) }, OK);
}

#[test]
fn issue_null_components_and_arrays() {
    let one = initialized();
    let component = one.component();
    let vr = [0_u32];
    // SAFETY: null pointers are what is tested.
    unsafe {
        ffi::free_instance(null_mut());
        assert_eq!(ffi::do_step(null_mut(), 0.0, 0.1, 0), ERROR);
        assert_eq!(ffi::get_real(null_mut(), vr.as_ptr(), 1, [0.0].as_mut_ptr()), ERROR);
        // No elements need no arrays.
        assert_eq!(ffi::get_real(component, null(), 0, null_mut()), OK);
        assert_eq!(ffi::set_real(component, null(), 0, null()), OK);
        assert_eq!(ffi::get_string(component, null(), 0, null_mut()), OK);
        assert_eq!(ffi::set_string(component, null(), 0, null()), OK);
        assert_eq!(ffi::set_real_input_derivatives(component, null(), 0, null(), null()), OK);
        let nothing =
            ffi::get_directional_derivative(component, null(), 0, null(), 0, null(), null_mut());
        assert_eq!(nothing, OK);
        // Elements do.
        assert_eq!(ffi::get_real(component, null(), 1, [0.0].as_mut_ptr()), ERROR);
        assert_eq!(ffi::get_real(component, vr.as_ptr(), 1, null_mut()), ERROR);
        assert_eq!(ffi::set_real(component, vr.as_ptr(), 1, null()), ERROR);
        assert_eq!(ffi::get_real(component, vr.as_ptr(), usize::MAX, [0.0].as_mut_ptr()), ERROR);
        assert_eq!(ffi::set_string(component, [1].as_ptr(), 1, [null()].as_ptr()), ERROR);
        assert_eq!(ffi::get_fmu_state(component, null_mut()), ERROR);
        assert_eq!(ffi::set_fmu_state(component, null_mut()), ERROR);
        assert_eq!(ffi::free_fmu_state(component, null_mut()), OK);
        let mut nothing: fmi2FMUstate = null_mut();
        assert_eq!(ffi::free_fmu_state(component, &raw mut nothing), OK);
        assert_eq!(ffi::serialized_fmu_state_size(component, null_mut(), &mut 0), ERROR);
        assert_eq!(ffi::deserialize_fmu_state(component, null(), 9, &mut null_mut()), ERROR);
        let time = fmi2StatusKind::fmi2LastSuccessfulTime;
        assert_eq!(ffi::get_real_status(component, time, null_mut()), ERROR);
    }
}

#[test]
fn issue_unknown_references_and_refused_values_set_nothing() {
    let mut one = instance();
    let (u, gain) = (one.reference("u").unwrap(), one.reference("gain").unwrap());
    assert_eq!(one.set_reals(&[u, 4711], &[9.0, 1.0]).unwrap_err().status, ERROR);
    let failure = one.set_reals(&[u, gain], &[9.0, 10.5]).unwrap_err();
    let text = &failure.messages[0].text;
    assert!(text.contains("gain cannot be set to 10.5: its range is 0.0 to 10.0"), "{text}");
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let failure = one.set_reals(&[gain, u], &[1.0, bad]).unwrap_err();
        assert!(failure.messages[0].text.contains("u cannot be set"), "{failure}");
    }
    assert!(one.set_integer("count", 10).unwrap_err().to_string().contains("1 to 9"));
    one.enter_initialization(0.0).unwrap();
    assert_eq!(one.real("u").unwrap(), 0.25);
    assert_eq!(one.real("gain").unwrap(), 2.0);
    assert_eq!(one.reals(&[4711], &mut [0.0]).unwrap_err().status, ERROR);
}

#[test]
fn issue_instantiation_is_refused_with_a_reason() {
    let reason = |name: &str, guid: &str| {
        let failure = TestInstance::instantiate::<Everything>(name, guid, NONE).unwrap_err();
        assert_eq!(failure.messages[0].category, "logStatusError");
        failure.to_string()
    };
    assert!(reason("one", "{wrong}").contains("the GUID {wrong} of the description is not"));
    assert!(reason("", "{wrong}").contains("instance name is empty"));
    let (name, kind) = (c"one".as_ptr(), fmi2Type::fmi2CoSimulation);
    // SAFETY: strings end with NUL, nothing else is followed.
    let none = unsafe { ffi::instantiate::<Everything>(name, kind, name, name, null(), 0, 0) };
    assert!(none.is_null());
    // No logger at all: nothing to call.
    let functions = fmi2CallbackFunctions {
        logger: None,
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: null_mut(),
    };
    // SAFETY: as above, the struct lives through the call.
    let none = unsafe {
        ffi::instantiate::<Everything>(name, fmi2Type(0), name, null(), &raw const functions, 0, 1)
    };
    assert!(none.is_null());
}

#[test]
fn issue_steps_must_follow_each_other() {
    let mut one = initialized();
    one.step(0.0, 0.1).unwrap();
    for (time, size) in [(0.1, 0.0), (0.1, -0.1), (0.1, f64::NAN), (0.1, f64::INFINITY)] {
        let failure = one.step(time, size).unwrap_err();
        assert!(failure.to_string().contains("is not greater than 0"), "{failure}");
    }
    for time in [0.0, 0.2, f64::NAN] {
        let failure = one.step(time, 0.1).unwrap_err();
        assert!(failure.to_string().contains("is not the time of the instance"), "{failure}");
    }
    assert!(one.step(0.1, 1e-18).unwrap_err().to_string().contains("vanishes"));
    // An importer that adds up 0.1: 0.1 + 0.1 + 0.1 is not 0.3.
    one.step(0.1, 0.1).unwrap();
    one.step(0.30000000000000004 - 0.1, 0.1).unwrap();
    one.step(0.3, 0.7).unwrap();
    assert_eq!(one.integer("steps").unwrap(), 4);
}

#[test]
fn issue_the_stop_time_is_the_end_but_for_rounding() {
    let mut one = instance();
    let component = one.component();
    // SAFETY: the component is alive.
    unsafe {
        assert_eq!(ffi::setup_experiment(component, 1, -1.0, 0.0, 1, 1.0), ERROR);
        assert_eq!(ffi::setup_experiment(component, 1, 1e-6, 0.0, 1, -1.0), ERROR);
        assert_eq!(ffi::setup_experiment(component, 1, 1e-6, f64::NAN, 0, 0.0), ERROR);
        assert_eq!(ffi::setup_experiment(component, 1, 1e-6, 0.0, 1, 1.0), OK);
        assert_eq!(ffi::enter_initialization_mode(component), OK);
    }
    one.exit_initialization().unwrap();
    let mut time = 0.0;
    for _ in 0..10 {
        one.step(time, 0.1).unwrap();
        time += 0.1;
    }
    let failure = one.step(time, 0.1).unwrap_err();
    assert!(failure.to_string().contains("after the stop time 1 s"), "{failure}");
}

#[test]
fn issue_status_questions() {
    let mut one = initialized();
    one.step(0.0, 0.5).unwrap();
    let component = one.component();
    let (mut time, mut ended) = (0.0, 7);
    // SAFETY: the component is alive and the places are there.
    unsafe {
        let last = fmi2StatusKind::fmi2LastSuccessfulTime;
        assert_eq!(ffi::get_real_status(component, last, &raw mut time), OK);
        let kind = fmi2StatusKind::fmi2Terminated;
        assert_eq!(ffi::get_boolean_status(component, kind, &raw mut ended), OK);
        assert_eq!(ffi::get_status(component, fmi2StatusKind(0), null_mut()), DISCARD);
        assert_eq!(ffi::get_string_status(component, fmi2StatusKind(1), null_mut()), DISCARD);
        assert_eq!(ffi::get_integer_status(component, fmi2StatusKind(99), null_mut()), DISCARD);
        assert_eq!(ffi::get_real_status(component, fmi2StatusKind(99), null_mut()), DISCARD);
    }
    assert_eq!((time, ended), (0.5, 0));
}

#[test]
fn issue_a_string_of_the_instance_may_be_set_on_itself() {
    let mut one = initialized();
    one.set_string("note", "first").unwrap();
    let (note, component) = ([1_u32], one.component());
    let mut text: fmi2String = null();
    // SAFETY: the pointer that is handed back lives until the next call has read it.
    unsafe {
        assert_eq!(ffi::get_string(component, note.as_ptr(), 1, &raw mut text), OK);
        assert_eq!(ffi::set_string(component, note.as_ptr(), 1, &raw const text), OK);
    }
    assert_eq!(one.string("note").unwrap(), "first");
}

#[test]
fn golden_version_and_platform() {
    // SAFETY: both are static C strings.
    let texts = unsafe {
        [ffi::get_version(), ffi::get_types_platform()]
            .map(|pointer| core::ffi::CStr::from_ptr(pointer).to_str().unwrap())
    };
    assert_eq!(texts, ["2.0", "default"]);
}
