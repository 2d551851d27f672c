//! Rails that lie or move sideways.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::VehicleFmu;

fn unit() -> TestInstance {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/resources/one-car");
    TestInstance::new::<VehicleFmu>(folder).unwrap()
}

fn set_all(unit: &mut TestInstance, name: &str, value: impl Fn(usize) -> f64) {
    for k in 1..=32 {
        unit.set_real(&format!("{name}_{k:02}"), value(k)).unwrap();
    }
}

fn row(unit: &mut TestInstance, name: &str) -> Vec<f64> {
    (1..=32).map(|k| unit.real(&format!("{name}_{k:02}")).unwrap()).collect()
}

/// Rails that lie 3 mm to the left take the whole vehicle with them: it starts centred below them, at
/// rest. Rails of which one half lies left and the other right turn it.
#[test]
fn issue_20_the_vehicle_starts_below_rails_that_lie_aside() {
    let mut unit = unit();
    unit.enter_initialization(0.0).unwrap();
    set_all(&mut unit, "track_lateral_displacement", |_| 3e-3);
    for offset in row(&mut unit, "lateral_offset") {
        assert!(offset.abs() < 1e-12, "{offset}");
    }
    assert!((unit.real("car_1_lateral_displacement").unwrap() - 3e-3).abs() < 1e-12);
    // the magnets of a side: front to back
    set_all(
        &mut unit,
        "track_lateral_displacement",
        |k| if (k - 1) % 4 < 2 { 1e-3 } else { -1e-3 },
    );
    let loads = row(&mut unit, "static_load");
    let gaps = row(&mut unit, "gap");
    let offsets = row(&mut unit, "lateral_offset");
    for (k, load) in loads.iter().enumerate() {
        unit.set_real(&format!("force_{:02}", k + 1), *load).unwrap();
        let pull = magnet::lateral_force(*load, gaps[k], offsets[k], 0.028);
        unit.set_real(&format!("lateral_force_{:02}", k + 1), pull).unwrap();
    }
    unit.exit_initialization().unwrap();
    assert!(offsets.iter().any(|y| y.abs() > 1e-5));
    for acceleration in row(&mut unit, "acceleration") {
        assert!(acceleration.abs() < 1e-8, "{acceleration}");
    }
    assert!(unit.real("car_1_lateral_acceleration").unwrap().abs() < 1e-8);
}

#[test]
fn analytic_offsets_follow_the_rails_at_once() {
    let mut unit = unit();
    unit.initialize(0.0).unwrap();
    let before = row(&mut unit, "lateral_offset");
    set_all(&mut unit, "track_lateral_displacement", |k| 1e-4 * k as f64);
    set_all(&mut unit, "track_lateral_rate", |k| 1e-2 * k as f64);
    for (k, offset) in row(&mut unit, "lateral_offset").iter().enumerate() {
        assert!((offset - before[k] + 1e-4 * (k as f64 + 1.0)).abs() < 1e-15);
        let rate = unit.output_derivative(&format!("lateral_offset_{:02}", k + 1), 1).unwrap();
        assert!((rate + 1e-2 * (k as f64 + 1.0)).abs() < 1e-15, "{rate}");
    }
    assert_eq!(
        unit.derivative("lateral_offset_03", "track_lateral_displacement_03").unwrap(),
        -1.0
    );
    assert_eq!(unit.derivative("lateral_offset_03", "force_03").unwrap(), 0.0);
}

#[test]
fn refusal_rails_that_are_not_numbers() {
    let mut unit = unit();
    unit.enter_initialization(0.0).unwrap();
    assert!(unit.set_real("track_lateral_displacement_02", f64::NAN).is_err());
}

/// With lift loss in the magnets' law, told to the vehicle, a vehicle that wind holds aside starts at rest.
#[test]
fn issue_20_the_start_knows_the_law_with_lift_loss() {
    let mut unit = unit();
    unit.set_boolean("lift_loss", true).unwrap();
    unit.enter_initialization(0.0).unwrap();
    unit.set_real("car_1_external_force_y", 4e3).unwrap();
    let (loads, gaps) = (row(&mut unit, "static_load"), row(&mut unit, "gap"));
    let offsets = row(&mut unit, "lateral_offset");
    for (k, load) in loads.iter().enumerate() {
        unit.set_real(&format!("force_{:02}", k + 1), *load).unwrap();
        let [pull, _] = magnet::lateral_force_with_loss(*load, gaps[k], offsets[k], 0.028);
        unit.set_real(&format!("lateral_force_{:02}", k + 1), pull).unwrap();
    }
    unit.exit_initialization().unwrap();
    let most = offsets.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    assert!(most > 5e-4, "{most}");
    for acceleration in row(&mut unit, "acceleration") {
        assert!(acceleration.abs() < 1e-8, "{acceleration}");
    }
    assert!(unit.real("car_1_lateral_acceleration").unwrap().abs() < 1e-8);
}
