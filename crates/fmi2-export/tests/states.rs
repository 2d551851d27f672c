//! Saved states, reset, several instances and threads: everything continues bit for bit.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{Everything, NONE};
use fmi2_export::ffi;
use fmi2_export::sys::{fmi2FMUstate, fmi2Status};
use fmi2_export::testing::TestInstance;

fn instance() -> TestInstance {
    TestInstance::new::<Everything>(NONE).unwrap()
}

/// One step with inputs of its own, and every bit that can be seen after it.
fn step(one: &mut TestInstance, k: u32) -> Vec<u64> {
    let t = f64::from(k) * 0.01;
    one.set_real("u", (3.0 * t).sin()).unwrap();
    one.set_real("v_02", t * t).unwrap();
    one.set_string("note", &format!("step {k}")).unwrap();
    if k.is_multiple_of(3) {
        one.set_input_derivative("u", 1, (3.0 * t).cos()).unwrap();
    }
    if k.is_multiple_of(5) {
        one.set_real("offset", t).unwrap();
    }
    one.step(t, 0.01).unwrap();
    seen(one)
}

fn seen(one: &mut TestInstance) -> Vec<u64> {
    let references: Vec<u32> = (0..13).collect();
    let mut values = [0.0; 13];
    one.reals(&references, &mut values).unwrap();
    let mut bits: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
    bits.push(one.integer("steps").unwrap() as u64);
    bits.push(u64::from(one.boolean("odd").unwrap()));
    bits.extend(one.string("echo").unwrap().bytes().map(u64::from));
    bits
}

fn started(steps: u32) -> TestInstance {
    let mut one = instance();
    one.set_real("gain", 3.0).unwrap();
    one.set_string("label", "grüße").unwrap();
    one.initialize(0.0).unwrap();
    for k in 0..steps {
        step(&mut one, k);
    }
    one
}

fn tail(one: &mut TestInstance, from: u32) -> Vec<Vec<u64>> {
    (from..from + 20).map(|k| step(one, k)).collect()
}

#[test]
fn issue_restored_state_continues_bit_for_bit() {
    let mut one = started(7);
    one.save().unwrap();
    let first = tail(&mut one, 7);
    one.restore().unwrap();
    assert_eq!(tail(&mut one, 7), first);
    // Into the same memory again, from elsewhere.
    one.save().unwrap();
    let later = tail(&mut one, 27);
    one.restore().unwrap();
    assert_eq!(tail(&mut one, 27), later);
}

#[test]
fn issue_a_state_saved_with_things_pending_keeps_them_pending() {
    let mut one = started(4);
    one.set_real("u", 0.7).unwrap();
    one.set_real("offset", 9.0).unwrap();
    one.set_input_derivative("u", 1, 2.0).unwrap();
    one.set_input_derivative("u", 3, -5.0).unwrap();
    let bytes = one.serialize().unwrap();
    one.step(0.04, 0.01).unwrap();
    let after = seen(&mut one);
    one.restore().unwrap();
    one.step(0.04, 0.01).unwrap();
    assert_eq!(seen(&mut one), after);
    let mut other = instance();
    other.deserialize(&bytes).unwrap();
    other.step(0.04, 0.01).unwrap();
    assert_eq!(seen(&mut other), after);
}

#[test]
fn issue_serialised_state_continues_bit_for_bit_in_another_instance() {
    let mut one = started(7);
    let bytes = one.serialize().unwrap();
    assert_eq!(bytes, one.serialize().unwrap());
    let expected = tail(&mut one, 7);
    // A fresh instance knows nothing of parameters, time or mode.
    let mut other = instance();
    other.deserialize(&bytes).unwrap();
    assert_eq!(other.string("label").unwrap(), "grüße");
    assert_eq!(tail(&mut other, 7), expected);
}

#[test]
fn issue_states_may_be_saved_in_every_mode() {
    let mut one = instance();
    one.set_real("u", 0.5).unwrap();
    one.save().unwrap();
    let fresh = one.serialize().unwrap();
    one.initialize(0.0).unwrap();
    let value = one.real("y").unwrap();
    one.restore().unwrap();
    one.enter_initialization(0.0).unwrap();
    one.save().unwrap();
    one.set_real("u", 9.0).unwrap();
    assert_ne!(one.real("y").unwrap(), value);
    one.restore().unwrap();
    assert_eq!(one.real("y").unwrap(), value);
    one.deserialize(&fresh).unwrap();
    one.initialize(0.0).unwrap();
    assert_eq!(one.real("y").unwrap(), value);
}

#[test]
fn issue_damaged_states_are_refused() {
    let mut one = started(3);
    let sound = one.serialize().unwrap();
    let before = seen(&mut one);
    let mut refuse = |bytes: &[u8]| one.deserialize(bytes).unwrap_err().to_string();
    for length in [0, 1, 7, 31, 39, sound.len() - 1] {
        refuse(&sound[..length]);
    }
    refuse(&[sound.as_slice(), &[0]].concat());
    // One flipped bit anywhere.
    for place in 0..sound.len() {
        let mut bytes = sound.clone();
        bytes[place] ^= 1 << (place % 8);
        refuse(&bytes);
    }
    let mut newer = sound.clone();
    newer[7] = b'9';
    assert!(refuse(&newer).contains("another version"));
    let mut foreign = sound.clone();
    foreign[10] ^= 1;
    assert!(refuse(&foreign).contains("belongs to another unit"));
    assert_eq!(seen(&mut one), before);
    // An array that is too small is not written.
    let mut saved: fmi2FMUstate = std::ptr::null_mut();
    let mut place = [7_i8; 16];
    // SAFETY: the component is alive, the array has the size stated.
    unsafe {
        let component = one.component();
        assert_eq!(ffi::get_fmu_state(component, &raw mut saved), fmi2Status::fmi2OK);
        let out = place.as_mut_ptr().cast();
        assert_eq!(ffi::serialize_fmu_state(component, saved, out, 16), fmi2Status::fmi2Error);
        assert_eq!(ffi::free_fmu_state(component, &raw mut saved), fmi2Status::fmi2OK);
    }
    assert!(saved.is_null());
    assert_eq!(place, [7; 16]);
}

#[test]
fn issue_reset_equals_a_fresh_instance_bit_for_bit() {
    let mut fresh = instance();
    let at_first = fresh.serialize().unwrap();
    let mut one = started(5);
    one.set_input_derivative("v_01", 2, 1.0).unwrap();
    one.reset().unwrap();
    assert_eq!(one.serialize().unwrap(), at_first);
    fresh.initialize(0.0).unwrap();
    one.initialize(0.0).unwrap();
    assert_eq!(tail(&mut one, 0), tail(&mut fresh, 0));
    assert_eq!(one.serialize().unwrap(), fresh.serialize().unwrap());
}

#[test]
fn issue_instances_share_nothing() {
    let alone = tail(&mut started(5), 5);
    let (mut one, mut two) = (started(5), started(0));
    let mut mixed = Vec::new();
    for k in 5..25 {
        step(&mut two, k - 5);
        mixed.push(step(&mut one, k));
    }
    assert_eq!(mixed, alone);
}

#[test]
fn issue_instances_in_threads_compute_the_same() {
    let alone = tail(&mut started(5), 5);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(|| tail(&mut started(5), 5))).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), alone);
        }
    });
    // An instance may move between threads.
    let mut one = started(5);
    let moved = std::thread::spawn(move || tail(&mut one, 5)).join().unwrap();
    assert_eq!(moved, alone);
}
