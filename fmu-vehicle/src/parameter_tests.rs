//! Parameters that change the vehicle, external forces on car bodies, trains as layouts.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;
use multibody::VehicleDescription;

use crate::tests::{derivative_and_slope, row, set_row, unit, unit_of_text};

const G: f64 = 9.81;

/// Initializes with the forces of the magnets, and gives the static loads.
fn start(unit: &mut TestInstance, magnets: usize) -> Vec<f64> {
    unit.enter_initialization(0.0).unwrap();
    let loads = row(unit, "static_load", magnets);
    let (gaps, offsets) = (row(unit, "gap", magnets), row(unit, "lateral_offset", magnets));
    let forces: Vec<f64> =
        (0..magnets).map(|k| magnet::lateral_force(loads[k], gaps[k], offsets[k], 0.028)).collect();
    set_row(unit, "force", &loads);
    set_row(unit, "lateral_force", &forces);
    unit.exit_initialization().unwrap();
    loads
}

fn assert_at_rest(unit: &mut TestInstance, magnets: usize, cars: usize) {
    for (k, a) in row(unit, "acceleration", magnets).iter().enumerate() {
        assert!(a.abs() < 1e-9, "magnet {}: {a} m/s²", k + 1);
    }
    for car in 1..=cars {
        for way in ["vertical", "lateral", "longitudinal"] {
            let a = unit.real(&format!("car_{car}_{way}_acceleration")).unwrap();
            assert!(a.abs() < 1e-9, "car {car}: {way} {a} m/s²");
        }
    }
}

/// Runs 20 ms with forces that move the vehicle, and gives the bits of what is seen.
fn moved(unit: &mut TestInstance, loads: &[f64]) -> Vec<u64> {
    let pushed: Vec<f64> = loads.iter().enumerate().map(|(k, l)| l + 9.0 * k as f64).collect();
    set_row(unit, "force", &pushed);
    for n in 0..20 {
        unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
    }
    let mut all = row(unit, "gap", loads.len());
    all.extend(row(unit, "acceleration", loads.len()));
    all.push(unit.real("car_1_roll").unwrap());
    all.iter().map(|v| v.to_bits()).collect()
}

/// 3 t beside the middle of the second of three cars: the magnets carry the weight and its moments, the cars
/// stay level, and the unit starts at rest.
#[test]
fn analytic_three_cars_with_an_eccentric_load() {
    let three = r#"{"train": {"cars": 3}}"#;
    let mut bare = unit_of_text(three, "three-bare");
    let before = start(&mut bare, 96);
    let mut unit = unit_of_text(three, "three-loaded");
    for (name, value) in [("mass", 3000.0), ("x", 1.5), ("y", 0.5), ("z", 0.2), ("length", 3.0)] {
        unit.set_real(&format!("car_2_load_{name}"), value).unwrap();
    }
    let loads = start(&mut unit, 96);
    assert_at_rest(&mut unit, 96, 3);
    let mass = unit.real("loaded_mass").unwrap();
    assert!((mass - unit.real("total_mass").unwrap() - 3000.0).abs() < 1e-9, "{mass}");
    let sum: f64 = loads.iter().sum();
    assert!((sum - mass * G).abs() < 1e-5, "{sum} N");
    let layout = VehicleDescription::from_json(three).unwrap();
    let moment = |axis: usize| -> f64 {
        let added = loads.iter().zip(&before).map(|(a, b)| a - b);
        added.zip(&layout.magnets).map(|(load, magnet)| load * magnet.position[axis]).sum()
    };
    // the second car stands in the middle; bodies move by micrometres
    assert!((moment(1) - 3000.0 * G * 0.5).abs() < 2.0, "{} N·m", moment(1));
    assert!((moment(0) - 3000.0 * G * 1.5).abs() < 2.0, "{} N·m", moment(0));
    for name in ["car_2_roll", "car_2_pitch", "car_2_vertical_displacement"] {
        let change = unit.real(name).unwrap() - bare.real(name).unwrap();
        assert!(change.abs() < 1e-7, "{name}: {change}");
    }
    // on springs that nobody levelled, the car sinks and leans to the load
    let mut sunk = unit_of_text(three, "three-sunk");
    for (name, value) in [("mass", 3000.0), ("x", 1.5), ("y", 0.5), ("z", 0.2), ("length", 3.0)] {
        sunk.set_real(&format!("car_2_load_{name}"), value).unwrap();
    }
    sunk.set_boolean("levelling", false).unwrap();
    start(&mut sunk, 96);
    assert_at_rest(&mut sunk, 96, 3);
    let [down, roll] =
        ["car_2_vertical_displacement", "car_2_roll"].map(|name| sunk.real(name).unwrap());
    // its couplers lift it a little
    let alone = -3000.0 * G / (16.0 * 62e3);
    assert!(down > alone && down < 0.6 * alone && roll < -1e-3, "{down} {alone} {roll}");
}

/// Other stiffness and damping: the same rest, another motion. And a parameter that is set to the value that it
/// has changes no bit.
#[test]
fn invariant_parameters_act_from_their_first_change_on() {
    let run = |changes: &[(&str, f64)]| {
        let mut unit = unit("one-bogie");
        for (name, value) in changes {
            unit.set_real(name, *value).unwrap();
        }
        let loads = start(&mut unit, 8);
        (moved(&mut unit, &loads), loads)
    };
    let (as_in_file, loads) = run(&[]);
    assert_eq!(
        run(&[("air_spring_vertical_stiffness", 62e3), ("car_1_load_x", 0.0)]).0,
        as_in_file
    );
    for (name, value) in [
        ("car_1_mass", 2400.0),
        ("air_spring_vertical_stiffness", 80e3),
        ("air_spring_lateral_damping", 2e3),
        ("traction_rod_longitudinal_stiffness", 3e5),
        ("anti_roll_end_rotational_stiffness", 1e4),
        ("anti_roll_end_rotational_damping", 90.0),
        ("table_centring_damping", 1e3),
    ] {
        let (motion, rest) = run(&[(name, value)]);
        assert_ne!(motion, as_in_file, "{name}");
        if name != "car_1_mass" {
            for (a, b) in rest.iter().zip(&loads) {
                assert!((a - b).abs() < 1e-4, "{name}: {a} {b}");
            }
        }
    }
}

/// A state carries its parameters: in an instance with others it continues with the same bits.
#[test]
fn invariant_a_state_moves_to_an_instance_with_other_parameters() {
    let mut loaded = unit("one-bogie");
    loaded.set_real("car_1_load_mass", 400.0).unwrap();
    loaded.set_real("air_spring_vertical_stiffness", 80e3).unwrap();
    let loads = start(&mut loaded, 8);
    let bytes = loaded.serialize().unwrap();
    let expected = moved(&mut loaded, &loads);
    let mut other = unit("one-bogie");
    other.deserialize(&bytes).unwrap();
    assert_eq!(moved(&mut other, &loads), expected);
    let mut started = unit("one-bogie");
    start(&mut started, 8);
    started.deserialize(&bytes).unwrap();
    assert_eq!(moved(&mut started, &loads), expected);
    // and a reset goes back to the file
    started.reset().unwrap();
    let own = start(&mut started, 8);
    let mut fresh = unit("one-bogie");
    assert_eq!(own, start(&mut fresh, 8));
    assert_eq!(moved(&mut started, &own), moved(&mut fresh, &own));
}

#[test]
fn refusal_of_bad_parameters_names_them() {
    for (name, value) in [
        ("car_1_mass", 0.0),
        ("car_1_mass", -1.0),
        ("car_1_load_mass", -5.0),
        ("car_1_load_length", 0.0),
        ("air_spring_vertical_stiffness", -1.0),
        ("air_spring_vertical_damping", f64::NAN),
        ("car_1_load_y", f64::INFINITY),
    ] {
        let mut unit = unit("one-bogie");
        let refusal =
            unit.set_real(name, value).and_then(|()| unit.initialize(0.0)).unwrap_err().to_string();
        assert!(refusal.contains(name), "{name} = {value}: {refusal}");
    }
    // springs that carry nothing
    let mut soft = unit("one-bogie");
    soft.set_real("air_spring_vertical_stiffness", 0.0).unwrap();
    let started = soft.initialize(0.0);
    assert!(started.is_ok() || started.unwrap_err().to_string().contains("equilibrium"));
    let mut late = unit("one-bogie");
    late.initialize(0.0).unwrap();
    let refusal = late.set_real("car_1_load_mass", 5.0).unwrap_err().to_string();
    assert!(refusal.contains("car_1_load_mass"), "{refusal}");
}

/// Wind from the side: the unit starts leaning in equilibrium; derivatives agree with differences.
#[test]
fn analytic_wind_on_the_first_car() {
    let mut unit = unit("two-car");
    unit.set_real("car_1_external_force_y", 2000.0).unwrap();
    unit.set_real("car_1_external_moment_x", -300.0).unwrap();
    let loads = start(&mut unit, 64);
    assert_at_rest(&mut unit, 64, 2);
    assert!((loads.iter().sum::<f64>() - 38_000.0 * G).abs() < 1e-5);
    let sideways: f64 = row(&mut unit, "lateral_force", 64).iter().sum();
    assert!((sideways + 2000.0).abs() < 1e-5, "{sideways} N");
    assert!(unit.real("car_1_roll").unwrap().abs() > 1e-5);

    for (unknown, known, size) in [
        ("car_1_lateral_acceleration", "car_1_external_force_y", 500.0),
        ("car_1_vertical_acceleration_01", "car_1_external_moment_y", 500.0),
        ("car_2_lateral_acceleration", "car_2_external_force_y", 500.0),
        ("car_1_longitudinal_acceleration", "car_1_external_force_x", 500.0),
    ] {
        let (offered, slope) = derivative_and_slope(&mut unit, unknown, known, size);
        assert!(offered != 0.0, "{unknown} by {known}");
        assert!(
            (slope - offered).abs() < 1e-8 * offered.abs().max(1e-6),
            "{unknown} by {known}: {slope}"
        );
    }
    // bogies feel it through their springs only
    assert_eq!(unit.derivative("acceleration_01", "car_1_external_force_y").unwrap(), 0.0);
}

/// A gust that grows over the step moves the car as the cubic says, and its rate is in the acceleration's
/// rate. The mass on its guide is the car body of the bogie alone.
#[test]
fn analytic_a_gust_over_a_step() {
    let text = r#"{"name": "sled", "gravity": [0, 0, -9.81], "nominal_gap": 0.008,
        "bodies": [{"name": "mass", "mass": 250, "inertia": [9, 9, 9], "position": [0, 0, 0]}],
        "joints": [{"name": "guide", "kind": "translational", "body_a": "ground", "body_b": "mass",
                    "position": [0, 0, 0], "axis": [0, 0, 1]}],
        "magnets": [{"body": "mass", "position": [0, 0, 0]}],
        "observed": [{"name": "mass", "body": "mass"}]}"#;
    let mut unit = unit_of_text(text, "sled");
    unit.enter_initialization(0.0).unwrap();
    unit.set_real("mass_external_force_z", 50.0).unwrap();
    let load = unit.real("static_load_01").unwrap();
    assert!((load - (250.0 * G - 50.0)).abs() < 1e-9, "{load}");
    unit.set_real("force_01", load).unwrap();
    unit.exit_initialization().unwrap();
    unit.set_input_derivative("mass_external_force_z", 1, 1000.0).unwrap();
    unit.step(0.0, 0.1).unwrap();
    // 1000 N/s on 250 kg: z = 4 t³/6
    let up = unit.real("mass_vertical_displacement").unwrap();
    assert!((up - 4.0 * 1e-3 / 6.0).abs() < 1e-12, "{up}");
    // the jerk of the magnet, down positive
    let jerk = unit.output_derivative("acceleration_01", 1).unwrap();
    assert!((jerk + 4.0).abs() < 1e-6, "{jerk}");
    // the report has the same answer to a force
    let report: serde_json::Value = serde_json::from_str(&unit.report("linear").unwrap()).unwrap();
    let place = |list: &str, reference: u32| {
        let all = report[list].as_array().unwrap();
        all.iter().position(|v| v.as_u64() == Some(u64::from(reference))).unwrap() as u64
    };
    let input = place("inputs", unit.reference("mass_external_force_z").unwrap());
    let output = place("outputs", unit.reference("acceleration_01").unwrap());
    let entry = report["d"]
        .as_array()
        .unwrap()
        .iter()
        .find(|e| e[0].as_u64() == Some(output) && e[1].as_u64() == Some(input));
    let slope = entry.unwrap()[2].as_f64().unwrap();
    assert!((slope + 1.0 / 250.0).abs() < 1e-12, "{slope}");
    // one body, which only heaves: the gap falls as it rises
    let motions: serde_json::Value =
        serde_json::from_str(&unit.report("motions").unwrap()).unwrap();
    let gap = place("outputs", unit.reference("gap_01").unwrap());
    let c = report["c"].as_array().unwrap().iter().find(|e| e[0].as_u64() == Some(gap)).unwrap();
    let rows = motions["rows"].as_array().unwrap();
    let rows: Vec<_> = rows.iter().filter(|row| row[2].as_f64().unwrap().abs() > 1e-12).collect();
    let [row] = rows.as_slice() else { panic!("{motions}") };
    let moved = &motions["parts"][row[0].as_u64().unwrap() as usize];
    assert_eq!((&moved["part"], &moved["direction"]), (&"mass".into(), &"z".into()), "{motions}");
    assert!((row[2].as_f64().unwrap() + c[2].as_f64().unwrap()).abs() < 1e-12, "{motions}");
    unit.set_real("mass_external_force_z", f64::NAN)
        .and_then(|()| unit.step(0.1, 0.1))
        .map(|()| panic!("NaN is accepted"))
        .unwrap_or_else(|e| {
            let text = e.to_string();
            assert!(text.contains("mass_external_force_z") || text.contains("`mass`"), "{text}");
        });
}

/// A train whose cars bend starts at rest, loaded or not, and shows the same variables as a rigid one.
#[test]
fn invariant_a_train_with_bending_cars_starts_at_rest() {
    let text = r#"{"train": {"cars": 1, "flexible_body": {"bending_frequency": 9, "torsion_frequency": 12}}}"#;
    let mut unit = unit_of_text(text, "bending");
    unit.set_real("car_1_load_mass", 1500.0).unwrap();
    unit.set_real("car_1_load_x", -4.0).unwrap();
    unit.set_real("car_1_load_y", 0.4).unwrap();
    let loads = start(&mut unit, 32);
    assert_at_rest(&mut unit, 32, 1);
    assert!((loads.iter().sum::<f64>() - 20_300.0 * G).abs() < 1e-5);
    for point in 1..=4 {
        let a = unit.real(&format!("car_1_vertical_acceleration_{point:02}")).unwrap();
        assert!(a.abs() < 1e-9, "point {point}: {a} m/s²");
    }
    assert!(unit.real("car_1_vertical_acceleration_05").is_err());
}
