//! One instance per thread over one loaded library: each computes what it computes alone.
//!
//! The kit and the units have no statics that change and no thread-locals, so there is no interleaving
//! to explore (which `loom` would do): instances share code and nothing else.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::sync::atomic::AtomicU64;

use fmi2_sys::*;
use unit_tests::Loaded;

/// The outputs' bits after some steps with inputs that differ by `k`; a saved state and a reset on the way.
fn run(unit: &Loaded, k: u32) -> Vec<u64> {
    let f = &unit.functions;
    let messages = AtomicU64::new(0);
    let c = unit.instantiate(&messages).unwrap();
    let (inputs, starts): (Vec<u32>, Vec<f64>) = unit.reals("input").into_iter().unzip();
    // A tenth of a millimetre where it is a length; little, but not nothing, where it is a force.
    let values: Vec<f64> = starts.iter().map(|start| start + 1e-4 * f64::from(k + 1)).collect();
    let outputs: Vec<u32> = unit.reals("output").into_iter().map(|o| o.0).collect();
    let (mut out, mut saved) = (vec![0.0; outputs.len()], std::ptr::null_mut());
    let ok = |status: fmi2Status| assert_eq!(status, fmi2Status::fmi2OK);
    // SAFETY: the component is alive and the arrays have the lengths stated.
    unsafe {
        for round in 0..2 {
            ok(f.setup_experiment.unwrap()(c, 0, 0.0, 0.0, 0, 0.0));
            ok(f.enter_initialization_mode.unwrap()(c));
            ok(f.exit_initialization_mode.unwrap()(c));
            for n in 0..20 {
                ok(f.set_real.unwrap()(c, inputs.as_ptr(), inputs.len(), values.as_ptr()));
                ok(f.do_step.unwrap()(c, f64::from(n) * 1e-3, 1e-3, 1));
                if n == 10 {
                    ok(f.get_fmu_state.unwrap()(c, &raw mut saved));
                }
            }
            ok(f.get_real.unwrap()(c, outputs.as_ptr(), outputs.len(), out.as_mut_ptr()));
            if round == 0 {
                ok(f.set_fmu_state.unwrap()(c, saved));
                ok(f.reset.unwrap()(c));
            }
        }
        ok(f.free_fmu_state.unwrap()(c, &raw mut saved));
        f.free_instance.unwrap()(c);
    }
    out.into_iter().map(f64::to_bits).collect()
}

fn threads_do_not_meet(name: &str, layout: Option<&str>) {
    let unit = Loaded::new(name, layout).unwrap();
    let alone: Vec<_> = (0..4).map(|k| run(&unit, k)).collect();
    assert_ne!(alone[0], alone[1]);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8)
            .map(|k| (&unit, k % 4))
            .map(|(unit, k)| scope.spawn(move || run(unit, k)))
            .collect();
        for (k, thread) in threads.into_iter().enumerate() {
            assert_eq!(thread.join().unwrap(), alone[k % 4], "thread {k}");
        }
    });
}

#[test]
fn invariant_controller_in_threads() {
    threads_do_not_meet("controller", None);
}

#[test]
fn invariant_ems_in_threads() {
    threads_do_not_meet("ems", None);
}

#[test]
fn invariant_guideway_in_threads() {
    threads_do_not_meet("guideway", Some("one-bogie"));
}

#[test]
fn invariant_vehicle_in_threads() {
    threads_do_not_meet("vehicle", Some("one-bogie"));
}
