//! Coupling must not allocate while stepping.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use master::coupling::{
    Algorithm, Exchange, GaussSeidel, Inputs, Jacobi, Links, Outputs, RealLink, Unit,
};

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
    real: [f64; 4],
    integer: i32,
}

impl Unit for Echo {
    type Error = ();

    fn send(&mut self, inputs: &Inputs) -> Result<(), ()> {
        self.real = inputs.reals[0];
        self.integer = inputs.integers[0];
        Ok(())
    }

    fn step(&mut self, _time: f64, _size: f64) -> Result<(), ()> {
        self.integer += 1;
        Ok(())
    }

    fn receive(&mut self, _time: f64, outputs: &mut Outputs) -> Result<(), ()> {
        outputs.reals[0] = self.real;
        outputs.integers[0] = self.integer;
        Ok(())
    }
}

fn stepped(mut algorithm: impl Algorithm<Echo>) -> u64 {
    let n = 5;
    let links = (0..n)
        .map(|k| {
            let unit = (k + 1) % n;
            Links {
                reals: vec![RealLink { unit, output: 0, factor: 1.0, offset: 0.0, limit: 3 }],
                integers: vec![(unit, 0)],
                offered: vec![1],
                integer_outputs: 1,
                ..Links::default()
            }
        })
        .collect();
    let mut exchange = Exchange::new(links, 2);
    let mut units: Vec<Echo> = (0..n).map(|_| Echo::default()).collect();
    exchange.start(0.0, &mut units).unwrap();
    let before = COUNT.load(Ordering::Relaxed);
    for n in 0..100 {
        algorithm.step(&mut exchange, &mut units, f64::from(n), 1.0).unwrap();
    }
    COUNT.load(Ordering::Relaxed) - before
}

// one test: another one's thread would be counted too
#[test]
fn invariant_steps_do_not_allocate() {
    assert_eq!(stepped(Jacobi), 0);
    assert_eq!(stepped(GaussSeidel::new((0..5).collect())), 0);
}
