//! Stepping, saving and restoring must not allocate, with the unit's own state and scratch memory.
#![allow(clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use fmi2_export::testing::Instance;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting per thread.
struct Counting;

// SAFETY: everything is the system allocator's.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: passed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn issue_stepping_saving_and_restoring_do_not_allocate() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/resources/two-car");
    let mut unit = Instance::new::<crate::Vehicle>(folder).unwrap();
    unit.initialize(0.0).unwrap();
    let references = |row: &str| -> Vec<u32> {
        (1..=64).map(|k| unit.reference(&format!("{row}_{k:02}")).unwrap()).collect()
    };
    let (forces, gaps, loads) = (references("force"), references("gap"), references("static_load"));
    let mut values = [0.0; 64];
    unit.reals(&loads, &mut values).unwrap();
    values[5] += 300.0;
    // The first save makes the memory, the first directional derivative the scratch.
    unit.save().unwrap();
    unit.derivative("acceleration_01", "force_01").unwrap();
    let before = COUNT.with(Cell::get);
    let mut gap = [0.0; 64];
    for n in 0..20 {
        unit.set_reals(&forces, &values).unwrap();
        unit.set_input_derivative("force_07", 1, 2e3).unwrap();
        unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        unit.reals(&gaps, &mut gap).unwrap();
        unit.output_derivative("acceleration_07", 1).unwrap();
        unit.derivative("acceleration_01", "force_01").unwrap();
        unit.save().unwrap();
        unit.restore().unwrap();
    }
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert!(gap[5] < gap[60], "nothing moved");
    // The counter does count.
    drop(gap.to_vec());
    assert!(COUNT.with(Cell::get) > before);
}
