//! The unit through its C functions: layouts, static loads, signs, derivatives, saved states.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use fmi2_export::testing::TestInstance;
use multibody::train;

use crate::VehicleFmu;

fn resources(layout: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("resources").join(layout)
}

pub(crate) fn unit(layout: &str) -> TestInstance {
    TestInstance::new::<VehicleFmu>(resources(layout)).unwrap()
}

pub(crate) fn set_row(unit: &mut TestInstance, name: &str, values: &[f64]) {
    for (k, value) in values.iter().enumerate() {
        unit.set_real(&format!("{name}_{:02}", k + 1), *value).unwrap();
    }
}

pub(crate) fn row(unit: &mut TestInstance, name: &str, count: usize) -> Vec<f64> {
    (1..=count).map(|k| unit.real(&format!("{name}_{k:02}")).unwrap()).collect()
}

/// The directional derivative that the unit offers, and the central difference over `size` either way.
pub(crate) fn derivative_and_slope(
    unit: &mut TestInstance,
    unknown: &str,
    known: &str,
    size: f64,
) -> (f64, f64) {
    let offered = unit.derivative(unknown, known).unwrap();
    let middle = unit.real(known).unwrap();
    let mut at = |value: f64| {
        unit.set_real(known, value).unwrap();
        unit.real(unknown).unwrap()
    };
    let slope = (at(middle + size) - at(middle - size)) / (2.0 * size);
    at(middle);
    (offered, slope)
}

/// Sets forces near the static loads, so that the vehicle moves.
fn pushed(unit: &mut TestInstance, magnets: usize) {
    let loads = row(unit, "static_load", magnets);
    let forces: Vec<f64> =
        loads.iter().enumerate().map(|(k, l)| l + 200.0 * (k as f64).sin()).collect();
    set_row(unit, "force", &forces);
    let sideways: Vec<f64> = (0..magnets).map(|k| 50.0 * (k as f64).cos()).collect();
    set_row(unit, "lateral_force", &sideways);
}

/// The committed layouts are the generator's, byte for byte.
#[test]
fn golden_layouts_are_those_of_the_generator() {
    for name in train::NAMES {
        let committed = std::fs::read_to_string(resources(name).join("vehicle.json")).unwrap();
        let made = train::by_name(name).unwrap().to_json().unwrap();
        assert!(
            committed == made,
            "{name} is stale: cargo run -p multibody --example generate -- {name}"
        );
    }
}

#[test]
fn golden_inspection_shows_table_1() {
    let mut unit = unit("two-car");
    unit.initialize(0.0).unwrap();
    for (name, value) in [
        ("body_count", 105),
        ("bracket_joint_count", 25),
        ("translational_joint_count", 20),
        ("spherical_joint_count", 64),
        ("revolute_joint_count", 12),
        ("constraint_count", 502),
        ("constraint_rank", 502),
        ("degrees_of_freedom", 128),
        ("magnet_count", 64),
    ] {
        assert_eq!(unit.integer(name).unwrap(), value, "{name}");
    }
    assert_eq!(unit.real("total_mass").unwrap(), 38_000.0);
}

/// At the start every magnet hangs at the nominal gap and nothing accelerates once the loads act;
/// held there, nothing moves.
#[test]
fn invariant_all_layouts_start_in_equilibrium() {
    for (layout, magnets) in [("one-magnet", 1), ("one-bogie", 8), ("one-car", 32), ("two-car", 64)]
    {
        let mut unit = unit(layout);
        unit.enter_initialization(0.0).unwrap();
        let loads = row(&mut unit, "static_load", magnets);
        set_row(&mut unit, "force", &loads);
        unit.exit_initialization().unwrap();
        for (k, a) in row(&mut unit, "acceleration", magnets).iter().enumerate() {
            assert!(a.abs() < 1e-9, "{layout} {k}: {a}");
        }
        for n in 0..20 {
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        }
        for gap in row(&mut unit, "gap", magnets) {
            assert!((gap - 0.008).abs() < 1e-10, "{layout}: {gap}");
        }
        assert!(unit.real("joint_opening").unwrap() < 1e-11);
        let weight = loads.iter().sum::<f64>();
        assert!((weight - 9.81 * unit.real("total_mass").unwrap()).abs() < 1e-3);
    }
}

/// A raised track opens the gap; a magnet pulled up closes it; its acceleration is down positive.
#[test]
fn analytic_signs_of_one_magnet() {
    let mut unit = unit("one-magnet");
    unit.enter_initialization(0.0).unwrap();
    unit.set_real("travel_speed", 2.0).unwrap();
    unit.set_real("initial_position", -5.0).unwrap();
    unit.exit_initialization().unwrap();
    unit.set_real("force_01", 250.0 * (9.81 + 0.4)).unwrap();
    assert!((unit.real("acceleration_01").unwrap() + 0.4).abs() < 1e-12);
    unit.set_real("track_displacement_01", 1e-3).unwrap();
    unit.set_real("track_rate_01", 0.02).unwrap();
    assert!((unit.real("gap_01").unwrap() - 0.009).abs() < 1e-12);
    assert!((unit.real("gap_rate_01").unwrap() - 0.02).abs() < 1e-12);
    unit.step(0.0, 0.1).unwrap();
    // ½·0.4·0.1² = 2 mm up
    assert!((unit.real("gap_01").unwrap() - 0.007).abs() < 1e-12);
    assert!((unit.real("gap_rate_01").unwrap() + 0.02).abs() < 1e-12);
    assert!((unit.real("position_01").unwrap() - (-5.0 + 0.2)).abs() < 1e-12);
    assert_eq!(unit.real("speed").unwrap(), 2.0);
    // the guide holds it laterally
    unit.set_real("lateral_force_01", 1e3).unwrap();
    unit.step(0.1, 0.1).unwrap();
    assert!(unit.real("lateral_offset_01").unwrap().abs() < 1e-12);
}

/// The travelled way is the frame's: the same motion at every speed.
#[test]
fn invariant_motion_does_not_depend_on_the_speed() {
    let run = |speed: f64| {
        let mut unit = unit("one-bogie");
        unit.set_real("travel_speed", speed).unwrap();
        unit.initialize(0.0).unwrap();
        pushed(&mut unit, 8);
        for n in 0..50 {
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        }
        let mut values = row(&mut unit, "gap", 8);
        values.extend(row(&mut unit, "lateral_offset", 8));
        (values, unit.real("position_01").unwrap())
    };
    let (still, stands) = run(0.0);
    let (moving, arrives) = run(10.0);
    assert_eq!(still, moving);
    assert!((arrives - stands - 0.5).abs() < 1e-12);
}

/// What the description promises of derivatives is kept from the start on: the gap's of order 2, and
/// of order 1 its rate's, acceleration's, lateral offset's, static load's, position's and contact force's.
#[test]
fn invariant_declared_derivatives_are_given() {
    let mut unit = unit("one-bogie");
    unit.initialize(0.0).unwrap();
    assert_eq!(unit.declared_derivatives().unwrap(), 8 * 8);
    unit.step(0.0, 1e-3).unwrap();
    assert_eq!(unit.declared_derivatives().unwrap(), 8 * 8);
}

/// Offered derivatives of outputs against what the next small steps do.
#[test]
fn analytic_output_derivatives_agree_with_differences() {
    let mut unit = unit("one-bogie");
    unit.initialize(0.0).unwrap();
    pushed(&mut unit, 8);
    let mut t = 0.0;
    for n in 0..20 {
        t = f64::from(n + 1) * 1e-3;
        unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
    }
    let names = ["gap_03", "gap_rate_03", "acceleration_03", "lateral_offset_03", "position_03"];
    let mut offered = Vec::new();
    for name in names {
        offered.push(unit.output_derivative(name, 1).unwrap());
    }
    let bend = unit.output_derivative("gap_03", 2).unwrap();
    assert!((bend - unit.real("acceleration_03").unwrap()).abs() < 1e-12);
    let h = 1e-5;
    let mut values = Vec::new();
    for n in 0..3 {
        values.push(names.map(|name| unit.real(name).unwrap()));
        unit.step(t + f64::from(n) * h, h).unwrap();
    }
    for (k, name) in names.iter().enumerate() {
        let [a, b, c] = [values[0][k], values[1][k], values[2][k]];
        let slope = (-3.0 * a + 4.0 * b - c) / (2.0 * h);
        // h²/3 of a third derivative of up to 1e6 times less than one: 3e-5 of the slope's scale;
        // rounding of 1e-11 m/s² by 2 h: 1e-6
        let scale = offered[k].abs().max(0.1);
        assert!((slope - offered[k]).abs() < 1e-3 * scale, "{name}: {slope} {}", offered[k]);
    }
    assert!(offered[2].abs() > 1.0, "no jerk to speak of: {}", offered[2]);
}

/// Analytic directional derivatives against differences of outputs, which are linear in the inputs.
#[test]
fn analytic_directional_derivatives_agree_with_differences() {
    let mut unit = unit("one-car");
    unit.initialize(0.0).unwrap();
    pushed(&mut unit, 32);
    for n in 0..10 {
        unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
    }
    for (unknown, known, size) in [
        ("acceleration_02", "force_02", 1e3),
        ("acceleration_02", "force_07", 1e3),
        ("acceleration_02", "lateral_force_06", 1e3),
        ("gap_05", "track_displacement_05", 1e-3),
        ("gap_rate_05", "track_rate_05", 1e-2),
        ("acceleration_09", "force_09", 1e3),
    ] {
        let (offered, slope) = derivative_and_slope(&mut unit, unknown, known, size);
        assert!(offered != 0.0, "{unknown} by {known}");
        assert!(
            (slope - offered).abs() < 1e-8 * offered.abs().max(1e-6),
            "{unknown} by {known}: {slope}"
        );
    }
    // another bogie's force is not felt at once
    let before = unit.real("acceleration_02").unwrap();
    unit.set_real("force_09", 9e3).unwrap();
    assert_eq!(unit.real("acceleration_02").unwrap(), before);
}

/// Going back, and moving to another instance, gives the same bits as never having left.
#[test]
fn invariant_saved_states_give_the_same_bits() {
    let mut unit = unit("one-car");
    unit.initialize(0.0).unwrap();
    pushed(&mut unit, 32);
    let outputs = |unit: &mut TestInstance| {
        let mut all = Vec::new();
        for name in ["gap", "gap_rate", "acceleration", "lateral_offset", "position"] {
            all.extend(row(unit, name, 32));
        }
        all.push(unit.real("car_1_vertical_acceleration_02").unwrap());
        all.push(unit.real("kinetic_energy").unwrap());
        all.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    let step = |unit: &mut TestInstance, n: i32| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
    (0..10).for_each(|n| step(&mut unit, n));
    unit.save().unwrap();
    let bytes = unit.serialize().unwrap();
    (10..20).for_each(|n| step(&mut unit, n));
    let straight = outputs(&mut unit);
    unit.restore().unwrap();
    (10..20).for_each(|n| step(&mut unit, n));
    assert_eq!(outputs(&mut unit), straight);
    let mut other = self::unit("one-car");
    other.deserialize(&bytes).unwrap();
    (10..20).for_each(|n| step(&mut other, n));
    assert_eq!(outputs(&mut other), straight);
    // and a reset unit is a fresh one
    unit.reset().unwrap();
    unit.initialize(0.0).unwrap();
    pushed(&mut unit, 32);
    (0..20).for_each(|n| step(&mut unit, n));
    assert_eq!(outputs(&mut unit), straight);
}

/// Derivatives asked for at every step, again and between other questions have the bits of those
/// that an instance gives which was never asked before: nothing is remembered for another moment.
#[test]
fn invariant_derivatives_have_the_same_bits_from_a_cold_cache() {
    let mut warm = unit("one-car");
    warm.initialize(0.0).unwrap();
    pushed(&mut warm, 32);
    let ask = |unit: &mut TestInstance| -> Vec<u64> {
        let orders = [("gap", 2), ("gap_rate", 1), ("acceleration", 1), ("lateral_offset", 1)];
        let names = orders
            .iter()
            .flat_map(|&(row, order)| (1..=32).map(move |k| (format!("{row}_{k:02}"), order)));
        names.map(|(name, n)| unit.output_derivative(&name, n).unwrap().to_bits()).collect()
    };
    let cold = |bytes: &[u8]| {
        let mut other = unit("one-car");
        other.deserialize(bytes).unwrap();
        ask(&mut other)
    };
    let mut seen = Vec::new();
    for n in 0..10 {
        warm.set_input_derivative("force_03", 1, 1e4 * f64::from(n)).unwrap();
        warm.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        seen.push(ask(&mut warm));
        assert_eq!(seen[n as usize], cold(&warm.serialize().unwrap()), "step {n}");
    }
    assert_ne!(seen[8], seen[9]);
    // other questions and another force in between
    warm.save().unwrap();
    warm.derivative("acceleration_02", "force_02").unwrap();
    assert_eq!(ask(&mut warm), seen[9]);
    let force = warm.real("force_05").unwrap();
    warm.set_real("force_05", force + 100.0).unwrap();
    assert_ne!(ask(&mut warm), seen[9]);
    warm.set_real("force_05", force).unwrap();
    assert_eq!(ask(&mut warm), seen[9]);
    warm.step(0.01, 1e-3).unwrap();
    assert_ne!(ask(&mut warm), seen[9]);
    warm.restore().unwrap();
    assert_eq!(ask(&mut warm), seen[9]);
}

/// A force that is no number is refused with its magnet, and not passed on.
#[test]
fn invariant_a_force_that_is_no_number_is_refused() {
    let mut unit = unit("one-bogie");
    unit.initialize(0.0).unwrap();
    let refusal = unit
        .set_real("force_03", f64::NAN)
        .and_then(|()| unit.step(0.0, 1e-3))
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("force_03") || refusal.contains("magnet 3"), "{refusal}");
}

/// A layout that is missing or broken ends the instantiation with the file and the place in it.
#[test]
fn invariant_bad_layouts_are_refused_with_file_and_place() {
    let folder = std::env::temp_dir().join(format!("vehicle-layout-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let missing = TestInstance::new::<VehicleFmu>(folder.join("none")).unwrap_err().to_string();
    assert!(missing.contains("vehicle.json"), "{missing}");
    let text = train::one_magnet().to_json().unwrap().replace("250.0", "-250.0");
    std::fs::write(folder.join("vehicle.json"), text).unwrap();
    let broken = TestInstance::new::<VehicleFmu>(&folder).unwrap_err().to_string();
    assert!(broken.contains("vehicle.json") && broken.contains("bodies[0].mass"), "{broken}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The report `modes`: the held magnet is a damped oscillator, the train shows its 128 degrees of
/// freedom and the fastest pair of the independent prototype; asking changes no result.
#[test]
fn analytic_report_of_modes() {
    let read = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let held = r#"modes {"magnet_stiffness": 7e5, "magnet_damping": 8e3}"#;
    let mut magnet = unit("one-magnet");
    magnet.initialize(0.0).unwrap();
    let report = read(&magnet.report(held).unwrap());
    let mode = &report["modes"][0];
    let number = |key: &str| mode[key].as_f64().unwrap();
    // 250 kg: λ² + 32 λ + 2800 = 0; the differences know it to 1e-9
    assert!((number("real") + 16.0).abs() < 1e-6, "{mode}");
    assert!((number("imaginary") - 2544.0f64.sqrt()).abs() < 1e-6, "{mode}");
    let omega = 2800.0f64.sqrt();
    assert!((number("frequency_hz") - omega / std::f64::consts::TAU).abs() < 1e-6, "{mode}");
    assert!((number("damping_ratio") - 16.0 / omega).abs() < 1e-6, "{mode}");
    assert_eq!(mode["participation"][0]["body"], "mass");

    let mut train = unit("two-car");
    train.initialize(0.0).unwrap();
    let report = read(&train.report(held).unwrap());
    assert_eq!(report["degrees_of_freedom"], 128);
    assert_eq!(report["constraint_rank"], 502);
    let modes = report["modes"].as_array().unwrap();
    let fastest = modes.last().unwrap();
    assert!((fastest["real"].as_f64().unwrap() + 209.48).abs() < 0.005, "{fastest}");
    // pairs count twice: 256 states
    let states = modes.iter().map(|m| if m["imaginary"] == 0.0 { 1 } else { 2 }).sum::<u32>();
    assert_eq!(states, 256);

    let mut other = unit("one-bogie");
    let mut asked = unit("one-bogie");
    for unit in [&mut other, &mut asked] {
        unit.initialize(0.0).unwrap();
        pushed(unit, 8);
        unit.step(0.0, 1e-2).unwrap();
    }
    asked.report(held).unwrap();
    let moving = read(&asked.report(r#"modes {"at": "state"}"#).unwrap());
    assert_eq!(moving["time"], 0.01);
    for unit in [&mut other, &mut asked] {
        unit.step(1e-2, 1e-2).unwrap();
    }
    assert_eq!(row(&mut other, "acceleration", 8), row(&mut asked, "acceleration", 8));
    assert_eq!(other.serialize().unwrap(), asked.serialize().unwrap());
}

#[test]
fn invariant_wrong_requests_are_refused_with_their_reason() {
    let mut unit = unit("one-magnet");
    unit.initialize(0.0).unwrap();
    for (request, reason) in [
        ("mode", "offers no report"),
        ("modes {", "options of the report modes"),
        (r#"modes {"stiffness": 1}"#, "unknown field `stiffness`"),
        (r#"modes {"at": "rest"}"#, "unknown variant `rest`"),
        (r#"modes {"magnet_stiffness": 1e999}"#, "number out of range"),
        (r#"modes {"magnet_stiffness": 1e300}"#, "modes"),
    ] {
        let text = unit.report(request).unwrap_err().to_string();
        assert!(text.contains(reason), "{request}: {text}");
    }
    unit.step(0.0, 1e-3).unwrap();
}

/// A unit of a layout that differs from a shipped one.
fn unit_of(description: &multibody::VehicleDescription, name: &str) -> TestInstance {
    unit_of_text(&description.to_json().unwrap(), name)
}

/// A unit of a layout in words.
pub(crate) fn unit_of_text(text: &str, name: &str) -> TestInstance {
    let folder = std::env::temp_dir().join(format!("vehicle-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("vehicle.json"), text).unwrap();
    let unit = TestInstance::new::<VehicleFmu>(&folder).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    unit
}

/// An equipment box 0.1 m aside: the magnets' guidance forces at the offsets that the unit starts with
/// leave nothing unbalanced, whatever their poles' width, as long as the unit is told of it. The law
/// without guidance is another equilibrium.
#[test]
fn issue_12_an_unequally_loaded_train_starts_where_its_magnets_hold_it() {
    let mut description = train::two_car();
    let index = description.bodies.iter().position(|b| b.name == "car_1_equipment_2").unwrap();
    description.bodies[index].position[1] = 0.1;
    for width in [0.028, 0.05] {
        let mut unit = unit_of(&description, "unequal");
        unit.set_real("pole_width", width).unwrap();
        unit.enter_initialization(0.0).unwrap();
        let loads = row(&mut unit, "static_load", 64);
        let (gaps, offsets) = (row(&mut unit, "gap", 64), row(&mut unit, "lateral_offset", 64));
        let forces: Vec<f64> =
            (0..64).map(|k| magnet::lateral_force(loads[k], gaps[k], offsets[k], width)).collect();
        set_row(&mut unit, "force", &loads);
        set_row(&mut unit, "lateral_force", &forces);
        unit.exit_initialization().unwrap();
        let largest = offsets.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        assert!((1e-6..1e-4).contains(&largest), "{largest} m");
        assert!(forces.iter().any(|f| f.abs() > 1.0), "no magnet pulls sideways");
        for a in row(&mut unit, "acceleration", 64) {
            assert!(a.abs() < 1e-9, "{width}: {a} m/s²");
        }
        for name in ["vertical", "lateral", "longitudinal"] {
            let a = unit.real(&format!("car_1_{name}_acceleration")).unwrap();
            assert!(a.abs() < 1e-9, "{width}: {name} {a} m/s²");
        }
    }
    let mut unheld = unit_of(&description, "unheld");
    unheld.set_boolean("lateral_guidance", false).unwrap();
    let refusal = unheld.initialize(0.0).unwrap_err().to_string();
    assert!(refusal.contains("nothing holds the vehicle sideways"), "{refusal}");
}
