//! Derivatives of the outputs of one magnet on a moving track, against its equation of motion.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::VehicleFmu;

const MASS: f64 = 250.0;
/// Polynomials of the inputs over a step: value, then three derivatives.
const RATE: [f64; 4] = [0.02, 3.0, 40.0, 500.0];
const FORCE: [f64; 4] = [MASS * (9.81 + 0.4), 50.0, 600.0, 7e3];
const STEP: f64 = 0.01;

/// Derivative of a polynomial at the end of the step.
fn slope(u: [f64; 4]) -> f64 {
    u[1] + u[2] * STEP + u[3] * STEP * STEP / 2.0
}

fn unit(rate: [f64; 4], force: [f64; 4]) -> TestInstance {
    let resources = concat!(env!("CARGO_MANIFEST_DIR"), "/resources/one-magnet");
    let mut unit = TestInstance::new::<VehicleFmu>(resources).unwrap();
    unit.initialize(0.0).unwrap();
    for (name, course) in [("track_rate_01", rate), ("force_01", force)] {
        unit.set_real(name, course[0]).unwrap();
        for order in 1..=3 {
            unit.set_input_derivative(name, order, course[order as usize]).unwrap();
        }
    }
    unit.step(0.0, STEP).unwrap();
    unit
}

/// ċ = ṙ − ż with the track's rate ṙ: its derivative is r̈ − z̈, and −z̈ is the acceleration, down
/// positive. The track's share is checked alone, and together with the magnet's.
#[test]
fn issue_14_the_gap_rate_changes_with_the_track_and_against_the_magnet() {
    let track = slope(RATE);
    for (rate, expected) in [(RATE, track), (RATE.map(|u| -u), -track), ([0.0; 4], 0.0)] {
        for pull in [0.0, 0.4, -0.3] {
            let force = [MASS * (9.81 + pull), 0.0, 0.0, 0.0];
            let mut unit = unit(rate, force);
            let acceleration = unit.real("acceleration_01").unwrap();
            assert!((acceleration + pull).abs() < 1e-12, "{acceleration}");
            for (name, order) in [("gap_rate_01", 1), ("gap_01", 2)] {
                let derivative = unit.output_derivative(name, order).unwrap();
                // rounding of 9.81 m/s²
                let error = derivative - (expected - pull);
                assert!(error.abs() < 1e-12, "{name}: {derivative} for {rate:?}, {pull}");
            }
        }
    }
}

/// The gap's derivative is the gap rate, and the acceleration's is −Ḟ/m: of the force's course at the
/// end of the step.
#[test]
fn analytic_derivatives_of_gap_and_acceleration() {
    let mut unit = unit(RATE, FORCE);
    let rate = unit.real("gap_rate_01").unwrap();
    assert_eq!(unit.output_derivative("gap_01", 1).unwrap(), rate);
    let jerk = unit.output_derivative("acceleration_01", 1).unwrap();
    let expected = -slope(FORCE) / MASS;
    // the jerk is a central difference over ±3 µs, with rounding of 1e-15 m/s²
    assert!((jerk - expected).abs() < 1e-8, "{jerk} is not {expected}");
    assert_eq!(unit.output_derivative("static_load_01", 1).unwrap(), 0.0);
}
