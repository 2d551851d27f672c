//! Stepping, saving and restoring must not allocate, with the unit's own state and scratch memory.
#![allow(clippy::unwrap_used)]

use std::hint::black_box;

use allocation_counter::measure;
use fmi2_export::testing::TestInstance;

#[test]
fn issue_stepping_saving_and_restoring_do_not_allocate() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/resources/three-spans");
    let mut unit = TestInstance::new::<crate::GuidewayFmu>(folder).unwrap();
    unit.enter_initialization(0.0).unwrap();
    let references = |row: &str| -> Vec<u32> {
        (1..=64).map(|k| unit.reference(&format!("{row}_{k:02}")).unwrap()).collect()
    };
    let (forces, positions) = (references("force"), references("position"));
    let heights = references("displacement");
    let place = |t: f64| std::array::from_fn::<f64, 64, _>(|k| 12.0 + 0.2 * k as f64 + 1.4 * t);
    unit.set_reals(&forces, &[5e3; 64]).unwrap();
    unit.set_reals(&positions, &place(0.0)).unwrap();
    unit.set_real("speed", 1.4).unwrap();
    unit.exit_initialization().unwrap();
    // The first save allocates the memory, the first derivative the scratch data, the first step of
    // a size its propagator.
    unit.save().unwrap();
    unit.derivative("midspan_acceleration_01", "force_01").unwrap();
    unit.step(0.0, 1e-3).unwrap();
    let mut height = [0.0; 64];
    let counted = measure(|| {
        for n in 1..50 {
            let t = f64::from(n) * 1e-3;
            unit.set_reals(&forces, &[5e3 + 10.0 * t; 64]).unwrap();
            unit.set_reals(&positions, &place(t)).unwrap();
            unit.set_input_derivative("force_07", 1, 2e3).unwrap();
            unit.step(t, 1e-3).unwrap();
            unit.reals(&heights, &mut height).unwrap();
            unit.output_derivative("rate_07", 1).unwrap();
            unit.derivative("midspan_acceleration_01", "force_01").unwrap();
            unit.save().unwrap();
            unit.restore().unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
    assert!(height[0] != 0.0, "nothing moved");
    // The counter does count.
    assert!(measure(|| drop(black_box(height.to_vec()))).count_total > 0);
}
