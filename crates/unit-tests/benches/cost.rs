//! What calls cost an importer: through function pointers out of the loaded library.
//!
//! `cargo build --release -p fmu-ems && cargo bench -p unit-tests`. docs/unit-cost.md has the numbers.

#![allow(clippy::unwrap_used, reason = "measures, and stops where it cannot")]

use std::cell::Cell;
use std::ptr::null_mut;
use std::sync::atomic::AtomicU64;

use divan::Bencher;
use fmi2_sys::*;
use unit_tests::Loaded;

fn main() {
    divan::main();
}

/// An `ems` in step mode, in the linear case, with what a master sends and reads in each step.
struct Ems {
    unit: Loaded,
    component: fmi2Component,
    inputs: Vec<u32>,
    starts: Vec<f64>,
    /// force and lateral force: what vehicle and guideway need
    forces: Vec<u32>,
    step: Cell<u32>,
}

fn ok(status: fmi2Status) {
    assert_eq!(status, fmi2Status::fmi2OK);
}

impl Ems {
    fn new() -> Self {
        let unit = Loaded::new("ems", None).unwrap();
        let component = unit.instantiate(Box::leak(Box::new(AtomicU64::new(0)))).unwrap();
        let (inputs, starts) = unit.reals("input").into_iter().unzip();
        let wanted = |name: &str| ["force", "lateral_force"].contains(&name);
        let forces = unit.reals.iter().filter(|real| wanted(&real.name));
        let forces = forces.map(|real| real.reference).collect();
        let f = &unit.functions;
        // SAFETY: the component is alive, here and below; all arrays have the lengths stated.
        unsafe {
            ok(f.setup_experiment.unwrap()(component, 0, 0.0, 0.0, 0, 0.0));
            ok(f.enter_initialization_mode.unwrap()(component));
            ok(f.exit_initialization_mode.unwrap()(component));
        }
        Self { unit, component, inputs, starts, forces, step: Cell::new(0) }
    }

    /// One step of 1 ms; time is counted.
    fn step(&self) {
        let n = self.step.get();
        self.step.set(n + 1);
        let step = self.unit.functions.do_step.unwrap();
        // SAFETY: see above.
        ok(unsafe { step(self.component, f64::from(n) * 1e-3, 1e-3, 1) });
    }

    fn set(&self) {
        let set = self.unit.functions.set_real.unwrap();
        let (vr, values) = (self.inputs.as_ptr(), self.starts.as_ptr());
        // SAFETY: see above.
        ok(unsafe { set(self.component, vr, self.inputs.len(), values) });
    }

    fn get(&self) -> [f64; 2] {
        let mut out = [0.0; 2];
        let get = self.unit.functions.get_real.unwrap();
        // SAFETY: see above.
        ok(unsafe { get(self.component, self.forces.as_ptr(), 2, out.as_mut_ptr()) });
        out
    }
}

impl Drop for Ems {
    fn drop(&mut self) {
        // SAFETY: alive until here.
        unsafe { self.unit.functions.free_instance.unwrap()(self.component) };
    }
}

#[divan::bench]
fn ems_set_step_get(bencher: Bencher) {
    let ems = Ems::new();
    bencher.bench_local(|| {
        ems.set();
        ems.step();
        ems.get()
    });
}

/// As a master does that extrapolates: every input with two derivatives, the force with as many.
#[divan::bench]
fn ems_set_step_get_with_derivatives(bencher: Bencher) {
    let ems = Ems::new();
    let inputs: Vec<u32> = ems.inputs.iter().flat_map(|&vr| [vr, vr]).collect();
    let orders: Vec<i32> = ems.inputs.iter().flat_map(|_| [1, 2]).collect();
    let (zeros, outputs) = (vec![0.0; inputs.len()], [ems.forces[0]; 2]);
    let f = &ems.unit.functions;
    let (send, read) =
        (f.set_real_input_derivatives.unwrap(), f.get_real_output_derivatives.unwrap());
    bencher.bench_local(|| {
        ems.set();
        let (vr, order) = (inputs.as_ptr(), orders.as_ptr());
        // SAFETY: see above.
        ok(unsafe { send(ems.component, vr, inputs.len(), order, zeros.as_ptr()) });
        ems.step();
        let mut out = [0.0; 2];
        let (vr, order) = (outputs.as_ptr(), [1, 2]);
        // SAFETY: see above.
        ok(unsafe { read(ems.component, vr, 2, order.as_ptr(), out.as_mut_ptr()) });
        (ems.get(), out)
    });
}

#[divan::bench]
fn ems_set(bencher: Bencher) {
    let ems = Ems::new();
    bencher.bench_local(|| ems.set());
}

#[divan::bench]
fn ems_step(bencher: Bencher) {
    let ems = Ems::new();
    bencher.bench_local(|| ems.step());
}

#[divan::bench]
fn ems_save(bencher: Bencher) {
    let ems = Ems::new();
    let mut state: fmi2FMUstate = null_mut();
    let save = ems.unit.functions.get_fmu_state.unwrap();
    // SAFETY: see above; the place holds null or the state saved before.
    bencher.bench_local(|| ok(unsafe { save(ems.component, &raw mut state) }));
    // SAFETY: see above.
    ok(unsafe { ems.unit.functions.free_fmu_state.unwrap()(ems.component, &raw mut state) });
}

#[divan::bench]
fn ems_restore(bencher: Bencher) {
    let ems = Ems::new();
    let mut state: fmi2FMUstate = null_mut();
    let f = &ems.unit.functions;
    // SAFETY: see above.
    ok(unsafe { f.get_fmu_state.unwrap()(ems.component, &raw mut state) });
    let restore = f.set_fmu_state.unwrap();
    // SAFETY: see above.
    bencher.bench_local(|| ok(unsafe { restore(ems.component, state) }));
    // SAFETY: see above.
    ok(unsafe { f.free_fmu_state.unwrap()(ems.component, &raw mut state) });
}
