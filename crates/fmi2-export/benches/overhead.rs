//! What the kit costs per call, measured through function pointers as an importer calls.
//!
//! `cargo bench -p fmi2-export`. The model does next to nothing, so the times are the kit's. Each
//! number is the least of several rounds.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "prints what it measures")]

use std::hint::black_box;
use std::time::Instant;

use fmi2_export::sys::*;
use fmi2_export::testing;
use fmi2_export::*;

/// ẋ = u_1, five inputs and ten outputs.
struct Small {
    u: RealVars,
    x: RealVars,
}

impl Model for Small {
    type State = [f64; 6];

    fn declare(_: &Resources, t: &mut Interface) -> Result<Self, Error> {
        t.describe(Info::new("small", "Small"));
        t.reals("p", 40).parameter(1.0).done();
        let u = t.reals("u", 5).input(0.0).done();
        let x = t.reals("x", 10).output().done();
        Ok(Self { u, x })
    }

    fn initialise(&mut self, _: &mut Values, _: f64) -> Result<[f64; 6], Error> {
        Ok([0.0; 6])
    }

    fn outputs(&mut self, x: &[f64; 6], values: &mut Values, _: f64) -> Result<(), Error> {
        values.reals_mut(self.x)[..6].copy_from_slice(x);
        Ok(())
    }

    fn step(&mut self, x: &mut [f64; 6], values: &mut Values, step: Step) -> Result<(), Error> {
        x[0] += step.size * values.taylors(self.u)[0][0];
        Ok(())
    }
}

fn measure(what: &str, mut body: impl FnMut(u32)) {
    const CALLS: u32 = 200_000;
    let mut counter = 0;
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        for _ in 0..CALLS {
            body(counter);
            counter += 1;
        }
        best = best.min(start.elapsed().as_secs_f64() / f64::from(CALLS));
    }
    println!("{what:45} {:7.1} ns", best * 1e9);
}

fn main() {
    let mut unit = testing::TestInstance::new::<Small>("none").unwrap();
    unit.initialize(0.0).unwrap();
    let c = unit.component();
    let (inputs, outputs): (Vec<u32>, Vec<u32>) = ((40..45).collect(), (45..55).collect());
    let (given, mut taken) = ([1.0; 5], [0.0; 10]);
    let set = black_box(ffi::set_real as unsafe extern "C" fn(_, _, usize, _) -> _);
    let get = black_box(ffi::get_real as unsafe extern "C" fn(_, _, usize, _) -> _);
    let step = black_box(ffi::do_step as unsafe extern "C" fn(_, _, _, _) -> _);
    let save = black_box(ffi::get_fmu_state as unsafe extern "C" fn(_, _) -> _);
    let load = black_box(ffi::set_fmu_state as unsafe extern "C" fn(_, _) -> _);
    let mut saved: fmi2FMUstate = std::ptr::null_mut();
    let ok = |status: fmi2Status| assert!(status == fmi2Status::fmi2OK);
    let mut time = 0.0;
    // SAFETY: the component is alive and the arrays have the lengths stated.
    unsafe {
        measure("fmi2SetReal, 5 inputs", |_| ok(set(c, inputs.as_ptr(), 5, given.as_ptr())));
        measure("fmi2GetReal, 10 outputs", |_| {
            ok(get(c, outputs.as_ptr(), 10, taken.as_mut_ptr()))
        });
        measure("fmi2DoStep", |_| {
            ok(step(c, time, 1e-3, 1));
            time += 1e-3;
        });
        measure("set 5 inputs, step, get 10 outputs", |_| {
            ok(set(c, inputs.as_ptr(), 5, given.as_ptr()));
            ok(step(c, time, 1e-3, 1));
            ok(get(c, outputs.as_ptr(), 10, taken.as_mut_ptr()));
            time += 1e-3;
        });
        measure("fmi2GetFMUstate into an older state", |_| ok(save(c, &raw mut saved)));
        measure("fmi2SetFMUstate", |_| ok(load(c, saved)));
        ok(ffi::free_fmu_state(c, &raw mut saved));
    }
    let start = Instant::now();
    let many: Vec<_> =
        (0..1000).map(|_| testing::TestInstance::new::<Small>("none").unwrap()).collect();
    // The driver declares once more than fmi2Instantiate, to know the names.
    let each = start.elapsed().as_secs_f64() / many.len() as f64;
    println!("{:45} {:7.1} µs", "instantiating 55 variables, twice", each * 1e6);
}
