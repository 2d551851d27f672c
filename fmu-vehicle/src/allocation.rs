//! Stepping, saving and restoring must not allocate, with the unit's own state and scratch memory.
#![allow(clippy::unwrap_used)]

use std::hint::black_box;

use allocation_counter::measure;
use fmi2_export::testing::TestInstance;

#[test]
fn issue_stepping_saving_and_restoring_do_not_allocate() {
    stepping_does_not_allocate(false);
}

#[test]
fn issue_15_stepping_on_the_skids_does_not_allocate() {
    stepping_does_not_allocate(true);
}

fn stepping_does_not_allocate(on_skids: bool) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/resources/two-car");
    let mut unit = TestInstance::new::<crate::VehicleFmu>(folder).unwrap();
    unit.set_boolean("contact_skid_on", on_skids).unwrap();
    unit.set_boolean("start_on_skids", on_skids).unwrap();
    unit.initialize(0.0).unwrap();
    let references = |row: &str| -> Vec<u32> {
        (1..=64).map(|k| unit.reference(&format!("{row}_{k:02}")).unwrap()).collect()
    };
    let (forces, gaps, loads) = (references("force"), references("gap"), references("static_load"));
    let mut values = [0.0; 64];
    unit.reals(&loads, &mut values).unwrap();
    values[5] += 300.0;
    // The first save allocates the memory, the first directional derivative the scratch data.
    unit.save().unwrap();
    unit.derivative("acceleration_01", "force_01").unwrap();
    unit.output_derivative("acceleration_07", 1).unwrap();
    let mut gap = [0.0; 64];
    let counted = measure(|| {
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
    });
    assert_eq!(counted.count_total, 0);
    assert!(gap[5] < gap[60], "nothing moved");
    // The counter does count.
    assert!(measure(|| drop(black_box(gap.to_vec()))).count_total > 0);
}
