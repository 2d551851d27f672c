//! The external force through the C functions.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use fmi2_export::testing::TestInstance;
use serde_json::Value;

use crate::tests::unit;

const AMPLITUDE: f64 = 1e4;
const OUTPUTS: [&str; 4] = [
    "midspan_displacement_01",
    "midspan_velocity_01",
    "midspan_acceleration_01",
    "quarter_displacement_01",
];

/// A span with the chirp on or off, which acts at a quarter.
fn begun(chirp: bool) -> TestInstance {
    let mut unit = unit("one-bogie");
    unit.set_boolean("irregularity_on", false).unwrap();
    unit.set_boolean("chirp_on", chirp).unwrap();
    unit.set_real("chirp_amplitude", AMPLITUDE).unwrap();
    unit.set_real("chirp_position", 6.25).unwrap();
    unit.enter_initialization(0.0).unwrap();
    unit
}

fn outputs(unit: &mut TestInstance) -> [f64; 4] {
    OUTPUTS.map(|name| unit.real(name).unwrap())
}

/// A sin(pi t^2) with its first three derivatives.
fn chirp(t: f64) -> [f64; 4] {
    let ((s, c), w) = ((PI * t * t).sin_cos(), 2.0 * PI * t);
    let third = -w.powi(3) * c - 6.0 * PI * w * s;
    [s, w * c, 2.0 * PI * c - w * w * s, third].map(|value| AMPLITUDE * value)
}

/// The chirp that the importer sends is the unit's own: the difference is that of a cubic within 1 ms, and of fourth order.
#[test]
fn analytic_21_a_chirp_from_outside_is_that_of_the_unit() {
    let mut own = begun(true);
    let mut sent = begun(false);
    own.exit_initialization().unwrap();
    sent.exit_initialization().unwrap();
    let (h, mut largest, mut worst) = (1e-3, [0.0_f64; 4], [0.0_f64; 4]);
    for n in 0..5000 {
        let t = f64::from(n) * h;
        let force = chirp(t);
        sent.set_real("external_force", force[0]).unwrap();
        for (order, value) in (1..).zip(&force[1..]) {
            sent.set_input_derivative("external_force", order, *value).unwrap();
        }
        own.step(t, h).unwrap();
        sent.step(t, h).unwrap();
        sent.set_real("external_force", chirp(t + h)[0]).unwrap();
        for (k, (a, b)) in outputs(&mut own).into_iter().zip(outputs(&mut sent)).enumerate() {
            largest[k] = largest[k].max(a.abs());
            worst[k] = worst[k].max((a - b).abs());
        }
    }
    for (k, name) in OUTPUTS.iter().enumerate() {
        assert!(largest[k] > 1e-4 && worst[k] < 1e-7 * largest[k], "{name}: {worst:?} {largest:?}");
    }
}

/// At rest under a held force the girder stays where the start put it, twice as deep under twice the force.
#[test]
fn analytic_21_a_held_force_bends_the_girder_at_rest() {
    let deflection = |force: f64| {
        let mut unit = begun(false);
        unit.set_real("external_force", force).unwrap();
        unit.exit_initialization().unwrap();
        let start = outputs(&mut unit);
        for n in 0..20 {
            unit.step(f64::from(n) * 0.01, 0.01).unwrap();
        }
        let now = outputs(&mut unit);
        assert!(
            (now[0] - start[0]).abs() <= 1e-12 * start[0].abs() && now[2].abs() < 1e-9,
            "{now:?}"
        );
        start[0]
    };
    let (once, twice) = (deflection(1e4), deflection(2e4));
    assert!(once < -1e-5 && (twice / once - 2.0).abs() < 1e-12, "{once} {twice}");
    assert_eq!(deflection(0.0), 0.0);
}

#[test]
fn analytic_21_the_external_force_in_derivatives_and_linearisation() {
    let mut unit = begun(false);
    unit.exit_initialization().unwrap();
    let exact = unit.derivative("midspan_acceleration_01", "external_force").unwrap();
    let at_rest = unit.real("midspan_acceleration_01").unwrap();
    unit.set_real("external_force", 1000.0).unwrap();
    let pushed = unit.real("midspan_acceleration_01").unwrap();
    assert!(exact < 0.0 && ((pushed - at_rest) / 1000.0 / exact - 1.0).abs() < 1e-9);
    let linear: Value = serde_json::from_str(&unit.report("linear").unwrap()).unwrap();
    let column = |name: &str| {
        let reference = unit.reference(name).unwrap();
        let inputs = linear["inputs"].as_array().unwrap();
        let at = inputs.iter().position(|it| *it == reference).unwrap();
        let entries = linear["b"].as_array().unwrap().iter();
        let own = entries.filter(|entry| entry[1] == at).map(|it| (it[0].clone(), it[2].clone()));
        own.collect::<Vec<_>>()
    };
    assert!(!column("external_force").is_empty());
    assert_eq!(column("external_force"), column("chirp_force"));
}

#[test]
fn refusal_21_an_external_force_that_is_not_finite() {
    let mut unit = begun(false);
    let error = unit.set_real("external_force", f64::NAN).unwrap_err().to_string();
    assert!(error.contains("external_force"), "{error}");
}
