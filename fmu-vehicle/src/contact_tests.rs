//! Stops and skids through the unit's C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::VehicleFmu;
use crate::tests::derivative_and_slope;

fn unit(layout: &str) -> TestInstance {
    let folder = format!("{}/resources/{layout}", env!("CARGO_MANIFEST_DIR"));
    TestInstance::new::<VehicleFmu>(folder).unwrap()
}

fn row(unit: &mut TestInstance, name: &str, count: usize) -> Vec<f64> {
    (1..=count).map(|k| unit.real(&format!("{name}_{k:02}")).unwrap()).collect()
}

/// Stops and skids in force.
fn on(unit: &mut TestInstance) {
    unit.set_boolean("contact_stop_on", true).unwrap();
    unit.set_boolean("contact_skid_on", true).unwrap();
}

fn on_skids(layout: &str) -> TestInstance {
    let mut unit = unit(layout);
    on(&mut unit);
    unit.set_boolean("start_on_skids", true).unwrap();
    unit
}

fn fresh(layout: &str) -> TestInstance {
    unit(layout)
}

/// On the skids the contact carries the weight, nothing moves, and the static loads stay those at the
/// nominal gap.
#[test]
fn invariant_a_start_on_the_skids_is_at_rest() {
    for (layout, magnets, steps) in
        [("one-magnet", 1, 1000), ("one-bogie", 8, 1000), ("two-car", 64, 50)]
    {
        let mut levitated = unit(layout);
        levitated.enter_initialization(0.0).unwrap();
        let mut unit = on_skids(layout);
        unit.enter_initialization(0.0).unwrap();
        let loads = row(&mut unit, "static_load", magnets);
        assert_eq!(loads, row(&mut levitated, "static_load", magnets), "{layout}");
        unit.exit_initialization().unwrap();
        let carried: f64 = row(&mut unit, "contact_force", magnets).iter().sum();
        let weight = 9.81 * unit.real("total_mass").unwrap();
        assert!((carried - weight).abs() < 1e-7 * weight, "{layout}: {carried} of {weight} N");
        let gaps = row(&mut unit, "gap", magnets);
        for n in 0..steps {
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        }
        for (gap, start) in row(&mut unit, "gap", magnets).iter().zip(&gaps) {
            assert!((0.0161..0.0165).contains(start), "{layout}: {start}");
            assert!((gap - start).abs() < 1e-9, "{layout}: {start} to {gap}");
        }
    }
}

/// A magnet without force falls on its skid; one pulled up hits its stop and is held there.
#[test]
fn analytic_signs_of_the_contact_force() {
    for (force, gap, expected) in
        [(0.0, 0.016, 250.0 * 9.81), (4000.0, 0.001, 250.0 * 9.81 - 4000.0)]
    {
        let mut unit = unit("one-magnet");
        on(&mut unit);
        unit.initialize(0.0).unwrap();
        assert_eq!(unit.real("contact_force_01").unwrap(), 0.0);
        unit.set_real("force_01", force).unwrap();
        for n in 0..1000 {
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        }
        // damped out to a few parts in a million
        let found = unit.real("contact_force_01").unwrap();
        assert!((found - expected).abs() < 1e-5 * expected.abs(), "{found} {expected}");
        assert!((unit.real("gap_01").unwrap() - gap).abs() < 2e-4);
    }
}

/// A magnet falls 8 mm on its skid, over the whole range of stiffness and damping and in all usual steps:
/// it is thrown back at most to where it fell from, and elastic impacts return the energy.
#[test]
fn issue_contact_creates_no_energy_whatever_the_stiffness() {
    for stiffness in [1e6, 1e8, 1e9, 1e10, 3e10, 1e11] {
        for (damping, step, steps) in [
            (0.0, 2e-3, 150),
            (0.0, 1e-3, 300),
            (0.0, 5e-4, 600),
            (0.0, 1e-4, 1500),
            (10.0, 1e-3, 300),
            (1000.0, 1e-3, 300),
        ] {
            let mut unit = unit("one-magnet");
            unit.set_boolean("contact_skid_on", true).unwrap();
            unit.set_real("contact_skid_stiffness", stiffness).unwrap();
            unit.set_real("contact_skid_damping", damping).unwrap();
            unit.set_real("contact_skid_friction", 0.0).unwrap();
            unit.initialize(0.0).unwrap();
            let (fallen, mut last) = (250.0 * 9.81 * 0.008, 0.0);
            let what = format!("{stiffness:e} N/m, {damping} s/m, {step} s");
            for n in 0..steps {
                unit.step(f64::from(n) * step, step).unwrap();
                let depth = unit.real("gap_01").unwrap() - 0.016;
                let stored = 0.5 * stiffness * depth.max(0.0).powi(2);
                let height = 0.008 + depth;
                let energy = unit.real("kinetic_energy").unwrap() - 250.0 * 9.81 * height + stored;
                assert!(energy < 1e-5 * fallen, "{what}: {energy} J gained");
                assert!(damping > 0.0 || energy > -2e-4 * fallen, "{what}: {energy} J lost");
                last = energy;
            }
            let expected = if damping > 0.0 { -0.3 * fallen } else { 0.0 };
            assert!(last <= expected + 1e-5 * fallen, "{what}: {last}");
        }
    }
}

/// Eight magnets that hit together, default damping and friction.
#[test]
fn issue_a_bogie_falls_on_stiff_skids() {
    for stiffness in [1e9, 1e10, 1e11] {
        let mut unit = unit("one-bogie");
        on(&mut unit);
        unit.set_real("contact_skid_stiffness", stiffness).unwrap();
        unit.initialize(0.0).unwrap();
        let fallen = 9.81 * 0.008 * unit.real("total_mass").unwrap();
        for n in 0..60 {
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
            let energy = unit.real("kinetic_energy").unwrap();
            assert!(energy < 1.01 * fallen, "{stiffness:e} at {n} ms: {energy} of {fallen} J");
            let gaps = row(&mut unit, "gap", 8);
            assert!(gaps.iter().all(|gap| (0.0079..0.0165).contains(gap)), "{gaps:?}");
        }
    }
}

/// Derivatives of the contact force and of the accelerations in contact against what small steps and
/// small changes of the track do; the report `linear` has the same.
#[test]
fn analytic_derivatives_in_contact_agree_with_differences() {
    let mut unit = on_skids("one-bogie");
    unit.initialize(0.0).unwrap();
    for k in 1..=8 {
        unit.set_real(&format!("track_rate_{k:02}"), 0.002).unwrap();
    }
    unit.step(0.0, 1e-3).unwrap();
    for (unknown, known, size) in [
        ("contact_force_03", "track_displacement_03", 1e-7),
        ("contact_force_03", "track_rate_03", 1e-4),
        ("acceleration_03", "track_displacement_03", 1e-7),
        ("acceleration_03", "track_rate_02", 1e-4),
        ("acceleration_03", "force_02", 1.0),
    ] {
        let (offered, slope) = derivative_and_slope(&mut unit, unknown, known, size);
        assert!(offered != 0.0, "{unknown} by {known}");
        assert!((slope - offered).abs() < 1e-5 * offered.abs(), "{unknown} by {known}: {slope}");
    }
    let names = ["contact_force_03", "acceleration_03"];
    let offered = names.map(|name| unit.output_derivative(name, 1).unwrap());
    let mut values = Vec::new();
    let h = 1e-6;
    for n in 0..3 {
        values.push(names.map(|name| unit.real(name).unwrap()));
        unit.step(1e-3 + f64::from(n) * h, h).unwrap();
        // the height follows its rate
        for k in 1..=8 {
            let name = format!("track_displacement_{k:02}");
            let height = unit.real(&name).unwrap();
            unit.set_real(&name, height + 0.002 * h).unwrap();
        }
    }
    for (k, name) in names.iter().enumerate() {
        let slope = (-3.0 * values[0][k] + 4.0 * values[1][k] - values[2][k]) / (2.0 * h);
        let close = (slope - offered[k]).abs() < 1e-3 * offered[k].abs();
        assert!(close && offered[k] != 0.0, "{name}: {slope} {}", offered[k]);
    }
}

/// A mass on its skid: ẍ = −k/m x − c/m ẋ, the contact force falls with the height by k, and the track
/// acts by the same.
#[test]
fn analytic_linear_report_of_a_mass_on_its_skid() {
    let mut unit = on_skids("one-magnet");
    unit.initialize(0.0).unwrap();
    let report: serde_json::Value = serde_json::from_str(&unit.report("linear").unwrap()).unwrap();
    let entry = |matrix: &str, i: u64, j: u64| {
        let entries = report[matrix].as_array().unwrap();
        let found = entries.iter().filter(|e| e[0] == i && e[1] == j);
        found.map(|e| e[2].as_f64().unwrap()).sum::<f64>()
    };
    let index = |list: &str, name: &str, unit: &TestInstance| {
        let reference = unit.reference(name).unwrap();
        let list = report[list].as_array().unwrap();
        list.iter().position(|v| *v == reference).unwrap() as u64
    };
    let (k, depth) = (2e7, 250.0 * 9.81 / 2e7);
    let c = k * 10.0 * depth;
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-5 * expected.abs(), "{found} {expected}");
    };
    // the guide's coordinate is the height, up to its sign
    close(entry("a", 1, 0), -k / 250.0);
    close(entry("a", 1, 1), -c / 250.0);
    let force = index("outputs", "contact_force_01", &unit);
    let down = index("outputs", "acceleration_01", &unit);
    let height = index("inputs", "track_displacement_01", &unit);
    let rate = index("inputs", "track_rate_01", &unit);
    close(entry("c", force, 0).abs(), k);
    close(entry("d", force, height), k);
    close(entry("d", force, rate), c);
    close(entry("d", down, height), -k / 250.0);
    close(entry("b", 1, rate).abs(), c / 250.0);
    assert_eq!(entry("c", force, 0).signum(), -entry("b", 1, height).signum());

    let modes: serde_json::Value =
        serde_json::from_str(&unit.report(r#"modes {"at": "state"}"#).unwrap()).unwrap();
    close(modes["modes"][0]["real"].as_f64().unwrap(), -0.5 * c / 250.0);
    let mut near = on_skids("one-magnet");
    near.set_real("contact_skid_stiffness", 1e10).unwrap();
    near.initialize(0.0).unwrap();
    for request in ["linear", r#"modes {"at": "state"}"#] {
        let refusal = near.report(request).unwrap_err().to_string();
        assert!(refusal.contains("not linear"), "{refusal}");
    }
}

/// A bouncing bogie continues with the same bits after saving, restoring and moving to another
/// instance, and the derivatives are those of an instance that was never asked.
#[test]
fn invariant_saved_states_in_contact_give_the_same_bits() {
    let mut unit = unit("one-bogie");
    on(&mut unit);
    unit.initialize(0.0).unwrap();
    let step = |unit: &mut TestInstance, n: i32| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
    let outputs = |unit: &mut TestInstance| -> Vec<u64> {
        let mut all = row(unit, "gap", 8);
        all.extend(row(unit, "contact_force", 8));
        all.extend(
            (1..=8).map(|k| unit.output_derivative(&format!("acceleration_{k:02}"), 1).unwrap()),
        );
        all.iter().map(|v| v.to_bits()).collect()
    };
    (0..41).for_each(|n| step(&mut unit, n));
    unit.save().unwrap();
    let bytes = unit.serialize().unwrap();
    (41..60).for_each(|n| step(&mut unit, n));
    let straight = outputs(&mut unit);
    assert!(row(&mut unit, "contact_force", 8).iter().any(|f| *f > 0.0));
    unit.restore().unwrap();
    (41..60).for_each(|n| step(&mut unit, n));
    assert_eq!(outputs(&mut unit), straight);
    let mut other = fresh("one-bogie");
    other.deserialize(&bytes).unwrap();
    (41..60).for_each(|n| step(&mut other, n));
    assert_eq!(outputs(&mut other), straight);
}

#[test]
fn refusal_of_inconsistent_contact_parameters() {
    type Set = fn(&mut TestInstance);
    let cases: [(Set, &str); 6] = [
        (|unit| unit.set_boolean("start_on_skids", true).unwrap(), "set contact_skid_on"),
        (
            |unit| {
                on(unit);
                unit.set_boolean("start_on_skids", true).unwrap();
                unit.set_real("travel_speed", 2.0).unwrap();
            },
            "set travel_speed to 0",
        ),
        (
            |unit| {
                on(unit);
                unit.set_real("contact_stop_gap", 0.008).unwrap();
            },
            "contact_stop_gap",
        ),
        (
            |unit| {
                on(unit);
                unit.set_real("contact_skid_gap", 0.008).unwrap();
            },
            "contact_skid_gap",
        ),
        (
            |unit| {
                on(unit);
                unit.set_real("contact_skid_gap", 0.0081).unwrap();
                unit.set_real("track_displacement_02", 0.002).unwrap();
            },
            "magnet 2 touches the rail at the start",
        ),
        (
            |unit| {
                on(unit);
                unit.set_boolean("start_on_skids", true).unwrap();
                unit.set_real("track_displacement_02", 0.003).unwrap();
            },
            "",
        ),
    ];
    for (set, words) in cases {
        let mut unit = unit("one-bogie");
        set(&mut unit);
        let outcome = unit.initialize(0.0);
        if words.is_empty() {
            // uneven, yet there is a place to stand
            outcome.unwrap();
        } else {
            let error = outcome.unwrap_err().to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }
    let mut unit = unit("one-magnet");
    for (name, value) in [
        ("contact_skid_stiffness", 0.0),
        ("contact_stop_stiffness", 1e12),
        ("contact_skid_damping", -1.0),
        ("contact_stop_friction", -0.1),
        ("contact_slip_speed", 0.0),
        ("contact_stop_gap", -1e-3),
    ] {
        let error = unit.set_real(name, value).unwrap_err().to_string();
        assert!(error.contains(name), "{name}: {error}");
    }
}
