//! Coupling must not allocate while stepping.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use std::sync::Arc;

use coupling::{
    Capabilities, Coupling, Exchange, InputIndex, IntegerLink, Links, OutputIndex, RealLink,
    Schedule, Taylor, Unit, UnitIndex, UnitValues, Whole, WholeOutput,
};
use scenario::algorithm::{AlgorithmName, IterationSettings};

static COUNT: AtomicU64 = AtomicU64::new(0);

/// The system's allocator, counting.
struct Counting;

// SAFETY: everything is the system allocator's
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Gives back what it got, with another integer.
#[derive(Default)]
struct Echo {
    real: Taylor,
    integer: i32,
}

impl Unit for Echo {
    type Error = ();

    fn capabilities(&self) -> Capabilities {
        Capabilities { restore: true, variable_step: true, directional: true }
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), ()> {
        self.real = inputs.reals[0];
        self.integer = inputs.integers[0];
        Ok(())
    }

    fn step(&mut self, _time: f64, _size: f64) -> Result<(), ()> {
        self.integer += 1;
        Ok(())
    }

    fn receive(&mut self, _time: f64, outputs: &mut UnitValues) -> Result<(), ()> {
        outputs.reals[0] = self.real;
        outputs.integers[0] = self.integer;
        Ok(())
    }
}

fn stepped(name: AlgorithmName) -> u64 {
    let n = 5;
    let link = |unit| RealLink {
        input: InputIndex(0),
        unit,
        output: OutputIndex(0),
        factor: 0.5,
        offset: 1.0,
        limit: 3,
        degree: None,
        held: false,
        kinks: false,
    };
    let links = (0..n)
        .map(|k| {
            let unit = UnitIndex((k + 1) % n);
            let from = WholeOutput { unit, output: OutputIndex(0), kind: Whole::Integer };
            Links {
                reals: vec![link(unit)],
                integers: vec![IntegerLink { from, items: None }],
                offered: vec![1],
                integer_outputs: 1,
                ..Links::default()
            }
        })
        .collect();
    let mut exchange = Exchange::new(links, 2);
    let mut units: Vec<Echo> = (0..n).map(|_| Echo::default()).collect();
    exchange.start(0.0, &mut units).unwrap();
    let order = (0..n).map(UnitIndex).collect();
    let schedule = Schedule::whole(name, IterationSettings::default(), order);
    let mut coupling = Coupling::new(&schedule, &exchange, &Arc::default());
    // algorithms that iterate lay out their unknowns in the first step
    coupling.step(&mut exchange, &mut units, 0.0, 1.0).unwrap();
    let before = COUNT.load(Ordering::Relaxed);
    for n in 1..100 {
        coupling.step(&mut exchange, &mut units, f64::from(n), 1.0).unwrap();
    }
    COUNT.load(Ordering::Relaxed) - before
}

// one test: another one's thread would be counted too
#[test]
fn invariant_steps_do_not_allocate() {
    // Newton's linear equations do, a few vectors per iteration
    for name in [AlgorithmName::Jacobi, AlgorithmName::GaussSeidel, AlgorithmName::Iterated] {
        assert_eq!(stepped(name), 0, "{name:?}");
    }
}
