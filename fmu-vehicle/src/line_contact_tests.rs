//! Stops and skids in a curve, through the C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::line_start_tests::{CIRCLE, hold};
use crate::line_tests::{row, unit};
use crate::tests::derivative_and_slope;

/// In the canted circle in motion, in equilibrium.
fn curving(contact: bool, name: &str) -> TestInstance {
    let mut unit = unit("one-car", Some(CIRCLE), name).unwrap();
    unit.set_real("initial_position", 110.0).unwrap();
    unit.set_real("travel_speed", 5.0).unwrap();
    unit.set_boolean("lift_loss", true).unwrap();
    for side in ["stop", "skid"] {
        unit.set_boolean(&format!("contact_{side}_on"), contact).unwrap();
    }
    unit.enter_initialization(0.0).unwrap();
    hold(&mut unit);
    unit.exit_initialization().unwrap();
    unit
}

/// Where nothing touches, stops and skids change no bit in a curve either.
#[test]
fn invariant_stops_and_skids_that_do_not_touch_change_nothing_in_a_curve() {
    let run = |contact: bool, name: &str| {
        let mut unit = curving(contact, name);
        unit.set_real("force_05", 6400.0).unwrap();
        (0..20).for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap());
        let mut bits = Vec::new();
        for name in ["gap", "gap_rate", "acceleration", "lateral_offset", "position"] {
            bits.extend(row(&mut unit, name).iter().map(|value| value.to_bits()));
        }
        bits
    };
    assert_eq!(run(false, "off"), run(true, "on"));
}

/// In the curve the magnets' lift ends: the car comes down on its skids, which carry it across the cant, and friction
/// slows it. Derivatives of the contact force and of accelerations agree with differences there, also by the rail's
/// lateral rate.
#[test]
fn analytic_a_car_lands_on_its_skids_in_a_curve() {
    let mut unit = curving(true, "lands");
    for k in 1..=32 {
        unit.set_real(&format!("force_{k:02}"), 0.0).unwrap();
        unit.set_real(&format!("lateral_force_{k:02}"), 0.0).unwrap();
    }
    (0..400).for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap());
    let weight = 9.81 * unit.real("loaded_mass").unwrap();
    let carried: f64 = row(&mut unit, "contact_force").iter().sum();
    assert!((carried / weight - 1.0).abs() < 0.05, "{carried} {weight}");
    let gaps = row(&mut unit, "gap");
    assert!(gaps.iter().all(|gap| *gap > 0.0158 && *gap < 0.0165), "{gaps:?}");
    // friction brakes against the drive
    assert!(unit.real("speed").unwrap() < 4.9);
    for (unknown, known, size) in [
        ("contact_force_03", "track_displacement_03", 1e-8),
        ("contact_force_03", "track_rate_03", 1e-5),
        ("acceleration_03", "track_displacement_03", 1e-8),
        ("acceleration_03", "track_lateral_rate_03", 1e-3),
        ("acceleration_03", "track_lateral_rate_02", 1e-3),
        ("acceleration_03", "lateral_force_02", 1.0),
    ] {
        let (offered, slope) = derivative_and_slope(&mut unit, unknown, known, size);
        assert!(offered != 0.0, "{unknown} by {known}");
        assert!(
            (slope - offered).abs() < 1e-4 * offered.abs(),
            "{unknown} by {known}: {slope} {offered}"
        );
    }
    let names = ["contact_force_03", "acceleration_03"];
    let offered = names.map(|name| unit.output_derivative(name, 1).unwrap());
    let (h, mut values) = (1e-6, Vec::new());
    for n in 0..3 {
        values.push(names.map(|name| unit.real(name).unwrap()));
        unit.step(0.4 + f64::from(n) * h, h).unwrap();
    }
    for (k, name) in names.iter().enumerate() {
        let slope = (-3.0 * values[0][k] + 4.0 * values[1][k] - values[2][k]) / (2.0 * h);
        let scale = offered[k].abs().max([100.0, 1.0][k]);
        assert!((slope - offered[k]).abs() < 2e-3 * scale, "{name}: {slope} {}", offered[k]);
    }
}

#[test]
fn refusal_of_a_start_on_skids_in_a_curve() {
    let mut unit = unit("one-car", Some(CIRCLE), "skids").unwrap();
    unit.set_real("initial_position", 110.0).unwrap();
    unit.set_boolean("contact_skid_on", true).unwrap();
    unit.set_boolean("start_on_skids", true).unwrap();
    let text = unit.initialize(0.0).unwrap_err().to_string();
    assert!(text.contains("start_on_skids") && text.contains("sideways"), "{text}");
    unit.reset().unwrap();
    // before the curve it can
    unit.set_real("initial_position", -20.0).unwrap();
    unit.set_boolean("contact_skid_on", true).unwrap();
    unit.set_boolean("start_on_skids", true).unwrap();
    unit.initialize(0.0).unwrap();
}
