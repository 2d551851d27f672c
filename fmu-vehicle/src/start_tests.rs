//! Starts that are refused or that were not found, and internal steps that are too long.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::VehicleFmu;
use crate::tests::{row, set_row, unit};

/// A unit with a vehicle file of its own.
fn made(text: &str) -> TestInstance {
    use std::sync::atomic::{AtomicU32, Ordering};
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let name = format!("vehicle-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("vehicle.json"), text).unwrap();
    let unit = TestInstance::new::<VehicleFmu>(&folder).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    unit
}

/// A load aside without levelling, from where full Newton steps no longer arrived: a little more load
/// leans the car a little more, and the loads carry the weight at rest.
#[test]
fn issue_an_eccentric_load_without_levelling_starts_in_equilibrium() {
    let lean = |y: f64| {
        let mut unit = unit("two-car");
        unit.set_boolean("levelling", false).unwrap();
        unit.set_real("car_1_load_mass", 3000.0).unwrap();
        unit.set_real("car_1_load_y", y).unwrap();
        unit.initialize(0.0).unwrap();
        let (loads, gaps) = (row(&mut unit, "static_load", 64), row(&mut unit, "gap", 64));
        let weight = 9.81 * unit.real("loaded_mass").unwrap();
        assert!((loads.iter().sum::<f64>() / weight - 1.0).abs() < 1e-9);
        set_row(&mut unit, "force", &loads);
        let roll = unit.real("car_1_roll").unwrap();
        assert!(gaps.iter().all(|gap| (gap - 0.008).abs() < 1e-4), "{gaps:?}");
        roll
    };
    let [a, b, c] = [0.5, 0.6, 0.7].map(lean);
    assert!(
        a.abs() > 0.01 && (b / a - 1.2).abs() < 0.05 && (c / a - 1.4).abs() < 0.1,
        "{a} {b} {c}"
    );
}

/// Below a track that sags, as it does on girders, the search failed: springs pushed magnets down, and the guidance then
/// pushed them sideways. On a track that is lower everywhere, the same equilibrium is found, lower.
#[test]
fn issue_15_an_eccentric_load_starts_below_a_sagging_track() {
    let rest = |track: &dyn Fn(f64) -> f64| {
        let mut unit = unit("two-car");
        unit.set_boolean("levelling", false).unwrap();
        unit.set_real("car_1_load_mass", 3000.0).unwrap();
        unit.set_real("car_1_load_y", 0.6).unwrap();
        unit.enter_initialization(0.0).unwrap();
        let heights: Vec<f64> = (0..64).map(|k| track(f64::from(k / 8) / 7.0)).collect();
        set_row(&mut unit, "track_displacement", &heights);
        unit.exit_initialization().unwrap();
        let loads = row(&mut unit, "static_load", 64);
        let weight = 9.81 * unit.real("loaded_mass").unwrap();
        assert!((loads.iter().sum::<f64>() / weight - 1.0).abs() < 1e-9);
        let gaps = row(&mut unit, "gap", 64);
        assert!(gaps.iter().all(|gap| (gap - 0.008).abs() < 1e-4), "{gaps:?}");
        (unit.real("car_1_roll").unwrap(), unit.real("car_1_vertical_displacement").unwrap())
    };
    let (flat, low) = (rest(&|_| 0.0), rest(&|_| -0.003));
    assert!((low.0 - flat.0).abs() < 1e-7 && (low.1 - flat.1 + 0.003).abs() < 1e-7, "{low:?}");
    let sagging = rest(&|x| -0.003 * (1.5 + x) * (1.0 - x));
    assert!((sagging.0 / flat.0 - 1.0).abs() < 0.05, "{sagging:?} {flat:?}");
}

#[test]
fn refusal_of_a_train_that_is_not_held_in_pitch() {
    let train = r#"{"name":"x","train":{"cars":2,"bogies_per_car":1,"magnets_per_side":1}}"#;
    let error = made(train).initialize(0.0).unwrap_err().to_string();
    assert!(error.contains("pitch") && error.contains("car_"), "{error}");
    let train = r#"{"name":"x","train":{"cars":1,"bogies_per_car":2,"magnets_per_side":2,
        "air_spring":{"vertical_stiffness":1000}}}"#;
    let error = made(train).initialize(0.0).unwrap_err().to_string();
    assert!(error.contains("car_1") && error.contains("stiffness"), "{error}");
    assert!(!error.contains("pivot"), "{error}");
}

/// A stiff part would make the integration diverge in steps of 1 ms (|λ| h = 5 or so). The vehicle takes shorter ones:
/// it stays at rest, and a push moves it as in steps of a fifth.
#[test]
fn issue_21_internal_steps_are_as_short_as_a_stiff_part_needs() {
    let train = r#"{"name":"x","train":{"cars":1,"bogies_per_car":2,"magnets_per_side":2,
        "anti_roll_end":{"rotational_stiffness":1e7}}}"#;
    let gaps = |push: f64, max_step: f64| {
        let mut unit = made(train);
        unit.set_real("max_step", max_step).unwrap();
        unit.initialize(0.0).unwrap();
        let mut loads = row(&mut unit, "static_load", 8);
        loads[0] += push;
        set_row(&mut unit, "force", &loads);
        (0..20).try_for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3)).unwrap();
        row(&mut unit, "gap", 8)
    };
    assert!(gaps(0.0, 5e-3).iter().all(|gap| (gap - 0.008).abs() < 1e-6));
    let (own, fine) = (gaps(100.0, 5e-3), gaps(100.0, 5e-5));
    let apart = own.iter().zip(&fine).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    assert!((own[0] - 0.008).abs() > 1e-6 && apart < 1e-9, "{own:?} {apart}");
}

/// The last equilibrium is kept. One that is found after others, and asked for again, has the bits of a unit
/// that was asked only once.
#[test]
fn invariant_21_a_kept_equilibrium_is_that_of_the_present_values() {
    type Change = fn(&mut TestInstance);
    let changes: [Change; 6] = [
        |unit| set_row(unit, "track_displacement", &[1e-3; 8]),
        |unit| set_row(unit, "track_lateral_displacement", &[2e-4; 8]),
        |unit| unit.set_boolean("lift_loss", true).unwrap(),
        |unit| unit.set_real("pole_width", 0.04).unwrap(),
        |unit| unit.set_real("car_1_external_force_y", 500.0).unwrap(),
        |unit| unit.set_real("car_1_mass", 9000.0).unwrap(),
    ];
    let begun = || {
        let mut unit = unit("one-bogie");
        unit.enter_initialization(0.0).unwrap();
        unit
    };
    let shown = |unit: &mut TestInstance| {
        let rows = ["static_load", "gap", "lateral_offset", "acceleration"];
        rows.map(|name| row(unit, name, 8)).concat()
    };
    let mut asked_often = begun();
    let mut last = shown(&mut asked_often);
    for upto in 1..=changes.len() {
        changes[upto - 1](&mut asked_often);
        let (now, again) = (shown(&mut asked_often), shown(&mut asked_often));
        let mut asked_once = begun();
        changes[..upto].iter().for_each(|change| change(&mut asked_once));
        assert_eq!(now, shown(&mut asked_once), "after change {upto}");
        assert_eq!(now, again);
        assert_ne!(now, last, "change {upto} has no effect");
        last = now;
    }
}
