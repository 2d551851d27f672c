//! Random sequences of calls, sensible and not, on the units' libraries: nothing crashes, every
//! status is one of the standard's, and a second instance that gets the same calls answers the same.
//!
//! `RANDOM_CALLS` says how many calls each unit gets; `cargo xtask sanitize` runs a million with the
//! address and leak sanitizers. A failure names its seed: `RANDOM_SEED` begins there.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test program that reports counts")]

use std::ffi::CString;
use std::ptr::{null, null_mut};
use std::sync::atomic::AtomicU64;

use fmi2_sys::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use unit_tests::Loaded;

/// Calls of one sequence, from instantiation to freeing.
const SEQUENCE: u64 = 300;

fn setting(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap())
}

/// What a call needs, drawn once and then done to both instances.
struct Draw {
    action: u64,
    references: Vec<u32>,
    values: Vec<f64>,
    order: Vec<i32>,
    step: f64,
    flag: bool,
    slot: usize,
    place: usize,
}

/// The variables that calls are drawn from.
struct Targets {
    inputs: Vec<(u32, f64)>,
    outputs: Vec<(u32, f64)>,
    parameters: Vec<(u32, f64)>,
    step: f64,
}

struct Dice(ChaCha8Rng);

impl Dice {
    fn below(&mut self, count: u64) -> u64 {
        self.0.next_u64() % count
    }

    fn unit(&mut self) -> f64 {
        self.below(1 << 32) as f64 / f64::from(u32::MAX)
    }

    /// Near a start value mostly, seldom wild.
    fn value(&mut self, start: f64) -> f64 {
        match self.below(40) {
            0 => f64::from_bits(self.0.next_u64()),
            1 => [f64::NAN, f64::INFINITY, 0.0, -1e300][self.below(4) as usize],
            _ => start + (start.abs() + 1e-3) * 0.02 * (self.unit() - 0.5),
        }
    }

    fn draw(&mut self, targets: &Targets) -> Draw {
        let action = self.below(40);
        let from = match action {
            0..8 => &targets.inputs,
            8..16 => &targets.outputs,
            _ => &targets.parameters,
        };
        let count = if self.below(4) == 0 { from.len() as u64 } else { self.below(5) };
        let chosen: Vec<(u32, f64)> = (0..count)
            .filter(|_| !from.is_empty())
            .map(|k| match self.below(60) {
                0 => (self.0.next_u32(), 1.0),
                1..20 => from[self.below(from.len() as u64) as usize],
                _ => from[k as usize % from.len()],
            })
            .collect();
        Draw {
            action,
            values: chosen.iter().map(|c| self.value(c.1)).collect(),
            order: chosen.iter().map(|_| self.below(6) as i32 - 1).collect(),
            references: chosen.into_iter().map(|c| c.0).collect(),
            step: targets.step * [1.0, 1.0, 0.5, 2.0, 1e-6, 0.0, -1.0][self.below(7) as usize],
            flag: self.below(2) == 0,
            slot: self.below(3) as usize,
            place: self.0.next_u32() as usize,
        }
    }
}

/// An instance with what an importer keeps of it.
struct Importer<'a> {
    unit: &'a Loaded,
    component: fmi2Component,
    saved: [fmi2FMUstate; 3],
    bytes: Vec<fmi2Byte>,
    messages: Box<AtomicU64>,
}

impl<'a> Importer<'a> {
    fn new(unit: &'a Loaded) -> Self {
        let messages = Box::new(AtomicU64::new(0));
        let component = unit.instantiate(&messages).unwrap();
        Self { unit, component, saved: [null_mut(); 3], bytes: Vec::new(), messages }
    }

    fn time(&self) -> f64 {
        let mut time = 0.0;
        let kind = fmi2StatusKind::fmi2LastSuccessfulTime;
        // SAFETY: the component is alive, here and in all methods below; arrays have their lengths.
        unsafe {
            self.unit.functions.get_real_status.unwrap()(self.component, kind, &raw mut time)
        };
        time
    }

    /// Does it; returns the status and a digest of what came out.
    fn act(&mut self, draw: &Draw) -> (u32, u64) {
        let (c, f) = (self.component, &self.unit.functions);
        let (vr, count) = (draw.references.as_ptr(), draw.references.len());
        let given = draw.values.as_ptr();
        let mut out = vec![0.0; count];
        // SAFETY: see above.
        let status = unsafe {
            match draw.action {
                0..6 => f.set_real.unwrap()(c, vr, count, given),
                6..8 => {
                    f.set_real_input_derivatives.unwrap()(c, vr, count, draw.order.as_ptr(), given)
                }
                8..13 => f.get_real.unwrap()(c, vr, count, out.as_mut_ptr()),
                13..15 => {
                    let order = draw.order.as_ptr();
                    f.get_real_output_derivatives.unwrap()(c, vr, count, order, out.as_mut_ptr())
                }
                15 => {
                    let known = draw.place as u32 % 80;
                    let seed = draw.step;
                    let of = f.get_directional_derivative.unwrap();
                    of(c, vr, count, &raw const known, 1, &raw const seed, out.as_mut_ptr())
                }
                16 => f.set_real.unwrap()(c, vr, count, given),
                17 => f.get_real.unwrap()(c, vr, count, out.as_mut_ptr()),
                18..26 => f.do_step.unwrap()(c, self.time(), draw.step, i32::from(draw.flag)),
                26 => f.do_step.unwrap()(c, *draw.values.first().unwrap_or(&1.0), draw.step, 1),
                27 | 28 => f.get_fmu_state.unwrap()(c, &raw mut self.saved[draw.slot]),
                29 | 30 => f.set_fmu_state.unwrap()(c, self.saved[draw.slot]),
                31 => f.free_fmu_state.unwrap()(c, &raw mut self.saved[draw.slot]),
                32 => return self.serialize(draw),
                33 => return self.deserialize(draw),
                _ => return self.rarely(draw),
            }
        };
        let digest = out.iter().fold(0, |sum: u64, value| sum.rotate_left(7) ^ value.to_bits());
        (status.0, digest)
    }

    /// Calls that change the mode, and those on the other types.
    fn rarely(&mut self, draw: &Draw) -> (u32, u64) {
        let (c, f) = (self.component, &self.unit.functions);
        let reference = draw.place as u32 % 8;
        let vr = &raw const reference;
        let (mut real, mut integer, mut text) = (0.0, 0, null());
        // SAFETY: see above.
        let status = unsafe {
            match draw.place % 28 {
                0 => f.setup_experiment.unwrap()(c, 0, 0.0, draw.step, i32::from(draw.flag), 9.0),
                1..4 => f.enter_initialization_mode.unwrap()(c),
                4..7 => f.exit_initialization_mode.unwrap()(c),
                7 => f.terminate.unwrap()(c),
                8 => f.reset.unwrap()(c),
                9 => f.cancel_step.unwrap()(c),
                10 => f.set_debug_logging.unwrap()(c, i32::from(draw.flag), 0, null()),
                11 => f.get_real_status.unwrap()(c, fmi2StatusKind(reference), &raw mut real),
                12 => f.get_integer_status.unwrap()(c, fmi2StatusKind(reference), &raw mut integer),
                13 => f.get_boolean_status.unwrap()(c, fmi2StatusKind(reference), &raw mut integer),
                14 => f.get_string_status.unwrap()(c, fmi2StatusKind(reference), &raw mut text),
                15 => f.get_integer.unwrap()(c, vr, 1, &raw mut integer),
                16 => f.get_boolean.unwrap()(c, vr, 1, &raw mut integer),
                17 => f.get_string.unwrap()(c, vr, 1, &raw mut text),
                18 => f.set_integer.unwrap()(c, vr, 1, &(draw.slot as i32)),
                19 => f.set_boolean.unwrap()(c, vr, 1, &i32::from(draw.flag)),
                20 => {
                    let text = CString::new("größer % #").unwrap();
                    f.set_string.unwrap()(c, vr, 1, &text.as_ptr())
                }
                // what no importer should do
                21 => f.get_real.unwrap()(c, null(), 3, &raw mut real),
                22 => f.set_real.unwrap()(c, vr, 1, null()),
                23 => f.get_real.unwrap()(null_mut(), vr, 1, &raw mut real),
                // back to life, after a step that failed
                _ => {
                    let status = f.reset.unwrap()(c);
                    begin(self);
                    status
                }
            }
        };
        if status == fmi2Status::fmi2OK && !text.is_null() {
            // SAFETY: a C string that lives until the next call.
            integer += unsafe { core::ffi::CStr::from_ptr(text) }.to_bytes().len() as i32;
        }
        (status.0, real.to_bits() ^ u64::from(integer.cast_unsigned()))
    }

    fn serialize(&mut self, draw: &Draw) -> (u32, u64) {
        let (c, f, state) = (self.component, &self.unit.functions, self.saved[draw.slot]);
        let mut size = 0;
        // SAFETY: see above.
        let status = unsafe { f.serialized_fmu_state_size.unwrap()(c, state, &raw mut size) };
        if status != fmi2Status::fmi2OK {
            return (status.0, 0);
        }
        self.bytes = vec![0; size];
        // SAFETY: see above.
        let status =
            unsafe { f.serialize_fmu_state.unwrap()(c, state, self.bytes.as_mut_ptr(), size) };
        (status.0, self.bytes.iter().fold(0, |sum: u64, &b| sum.rotate_left(5) ^ b as u64))
    }

    /// What was serialised, seldom with a byte changed or the end cut off.
    fn deserialize(&mut self, draw: &Draw) -> (u32, u64) {
        let mut bytes = self.bytes.clone();
        if draw.flag && !bytes.is_empty() {
            let place = draw.place % bytes.len();
            bytes[place] = bytes[place].wrapping_add(draw.slot as fmi2Byte);
            if draw.slot == 2 {
                bytes.truncate(place);
            }
        }
        let read = self.unit.functions.deserialize_fmu_state.unwrap();
        let into = &raw mut self.saved[draw.slot];
        // SAFETY: see above.
        let status = unsafe { read(self.component, bytes.as_ptr(), bytes.len(), into) };
        (status.0, 0)
    }
}

impl Drop for Importer<'_> {
    fn drop(&mut self) {
        for saved in &mut self.saved {
            // SAFETY: null or this instance's.
            unsafe { self.unit.functions.free_fmu_state.unwrap()(self.component, saved) };
        }
        // SAFETY: alive until here.
        unsafe { self.unit.functions.free_instance.unwrap()(self.component) };
    }
}

/// Into step mode, which purely random calls seldom reach; all refusals come before and after.
fn begin(importer: &Importer) {
    let (c, f) = (importer.component, &importer.unit.functions);
    // SAFETY: the component is alive.
    unsafe {
        f.setup_experiment.unwrap()(c, 0, 0.0, 0.0, 0, 0.0);
        f.enter_initialization_mode.unwrap()(c);
        f.exit_initialization_mode.unwrap()(c);
    }
}

fn survive(name: &str, layout: Option<&str>, share: u64) {
    let unit = Loaded::new(name, layout).unwrap();
    assert!(unit.reals.len() > 20, "the description was not understood");
    let targets = Targets {
        inputs: unit.reals("input"),
        outputs: unit.reals("output"),
        parameters: unit.reals("parameter"),
        step: 1e-3,
    };
    let wanted = setting("RANDOM_CALLS", 10_000) / share;
    let first = setting("RANDOM_SEED", 0);
    let (mut calls, mut accepted, mut steps, mut seed) = (0, 0, 0, first);
    while calls < wanted {
        let mut dice = Dice(ChaCha8Rng::seed_from_u64(seed));
        let (mut one, mut two) = (Importer::new(&unit), Importer::new(&unit));
        if dice.below(4) > 0 {
            begin(&one);
            begin(&two);
        }
        for n in 0..SEQUENCE {
            let draw = dice.draw(&targets);
            let (status, digest) = one.act(&draw);
            assert!(status <= fmi2Status::fmi2Fatal.0, "seed {seed}, call {n}: status {status}");
            let again = two.act(&draw);
            assert_eq!((status, digest), again, "seed {seed}, call {n}: action {}", draw.action);
            let ok = u64::from(status == fmi2Status::fmi2OK.0);
            accepted += 2 * ok;
            steps += if (18..27).contains(&draw.action) { 2 * ok } else { 0 };
        }
        let logged = [&one, &two].map(|i| i.messages.load(std::sync::atomic::Ordering::Relaxed));
        assert_eq!(logged[0], logged[1], "seed {seed}: messages");
        calls += 2 * SEQUENCE;
        seed += 1;
    }
    println!("{name} {layout:?}: {calls} calls, {accepted} accepted, {steps} of them steps");
    // Both sides of the border were seen; the few calls of a large unit prove no shares.
    let seen = accepted > calls / 4 && accepted < calls && steps > calls / 40;
    assert!(seen || share > 1, "{accepted} accepted, {steps} steps");
}

#[test]
fn invariant_controller_survives_random_calls() {
    survive("controller", None, 1);
}

#[test]
fn invariant_ems_survives_random_calls() {
    survive("ems", None, 1);
}

#[test]
fn invariant_guideway_survives_random_calls() {
    survive("guideway", Some("one-bogie"), 1);
}

#[test]
fn invariant_vehicle_survives_random_calls() {
    survive("vehicle", Some("one-bogie"), 1);
    // 105 bodies take their time
    survive("vehicle", Some("two-car"), 20);
}
