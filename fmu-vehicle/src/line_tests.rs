//! A vehicle on a line, through the C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::VehicleFmu;

const CURVE: &str = r#"{ "name": "curve", "plan": [
    { "kind": "straight", "length": 27 }, { "kind": "clothoid", "length": 12, "to_radius": 150 },
    { "kind": "circle", "length": 30, "radius": 150 }, { "kind": "clothoid", "length": 20 } ],
  "elevation": [ { "kind": "straight", "length": 30 }, { "kind": "clothoid", "length": 15, "to_radius": 900 },
    { "kind": "clothoid", "length": 15 } ],
  "cant": [ { "length": 27 }, { "length": 12, "to": -0.03 }, { "length": 30 }, { "length": 20, "to": 0 } ] }"#;
const STRAIGHT: &str =
    r#"{ "name": "straight", "plan": [ { "kind": "straight", "length": 500 } ] }"#;

pub(crate) fn unit(layout: &str, line: Option<&str>, name: &str) -> Result<TestInstance, String> {
    let from = format!("{}/resources/{layout}/vehicle.json", env!("CARGO_MANIFEST_DIR"));
    let folder = std::env::temp_dir().join(format!("vehicle-line-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(from, folder.join("vehicle.json")).unwrap();
    if let Some(line) = line {
        std::fs::write(folder.join("line.json"), line).unwrap();
    }
    let unit = TestInstance::new::<VehicleFmu>(&folder).map_err(|e| e.to_string());
    std::fs::remove_dir_all(&folder).unwrap();
    unit
}

pub(crate) fn row(unit: &mut TestInstance, name: &str) -> Vec<f64> {
    (1..=32).map(|k| unit.real(&format!("{name}_{k:02}")).unwrap()).collect()
}

/// Started at 20 m/s, carried by its static loads.
fn started(line: Option<&str>, name: &str) -> TestInstance {
    let mut unit = unit("one-car", line, name).unwrap();
    unit.set_real("travel_speed", 20.0).unwrap();
    unit.initialize(0.0).unwrap();
    for (k, load) in row(&mut unit, "static_load").iter().enumerate() {
        unit.set_real(&format!("force_{:02}", k + 1), *load).unwrap();
    }
    unit.set_real("force_03", 6500.0).unwrap();
    unit.set_real("lateral_force_12", 300.0).unwrap();
    unit
}

fn steps(unit: &mut TestInstance, from: u32, to: u32) {
    (from..to).for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap());
}

/// In a canted clothoid with a sag: offered derivatives are what the next small steps do.
#[test]
fn analytic_output_derivatives_in_a_curve_agree_with_differences() {
    let mut unit = started(Some(CURVE), "derivatives");
    steps(&mut unit, 0, 1100);
    let t = 1.1;
    assert!(unit.real("line_curvature").unwrap() > 2e-3 && unit.real("line_cant").unwrap() < -0.01);
    let names =
        ["gap_03", "gap_rate_03", "acceleration_03", "lateral_offset_03", "position_03", "gap_20"];
    let offered = names.map(|name| unit.output_derivative(name, 1).unwrap());
    let bends = ["gap_03", "gap_20"].map(|name| unit.output_derivative(name, 2).unwrap());
    let h = 1e-5;
    let mut values = Vec::new();
    for n in 0..3 {
        values.push(names.map(|name| unit.real(name).unwrap()));
        unit.step(t + f64::from(n) * h, h).unwrap();
    }
    for (k, name) in names.iter().enumerate() {
        let [a, b, c] = [values[0][k], values[1][k], values[2][k]];
        let slope = (-3.0 * a + 4.0 * b - c) / (2.0 * h);
        let scale = offered[k].abs().max(0.1);
        assert!((slope - offered[k]).abs() < 1e-3 * scale, "{name}: {slope} {}", offered[k]);
    }
    // the gap's second derivative is the rate of the gap's rate, and not the inertial acceleration
    assert_eq!(bends[0], offered[1]);
    assert!((bends[0] - unit.real("acceleration_03").unwrap()).abs() > 0.05);
    assert_eq!(unit.declared_derivatives().unwrap(), 8 * 32);
    // it went straight on while the track turned away
    assert!(unit.real("lateral_offset_01").unwrap() < -0.02);
}

/// A response to a force in the curve is the difference that the force makes.
#[test]
fn analytic_directional_derivatives_in_a_curve() {
    let mut unit = started(Some(CURVE), "directions");
    steps(&mut unit, 0, 800);
    for (unknown, known, size) in [
        ("acceleration_02", "force_02", 1e3),
        ("acceleration_02", "lateral_force_06", 1e3),
        ("car_1_lateral_acceleration", "car_1_external_force_y", 1e3),
    ] {
        let offered = unit.derivative(unknown, known).unwrap();
        let (before, value) = (unit.real(unknown).unwrap(), unit.real(known).unwrap());
        unit.set_real(known, value + size).unwrap();
        let slope = (unit.real(unknown).unwrap() - before) / size;
        unit.set_real(known, value).unwrap();
        assert!(offered != 0.0 && (slope - offered).abs() < 1e-8 * offered.abs().max(1e-6));
    }
}

/// A straight line in the resources changes no bit.
#[test]
fn invariant_a_straight_line_gives_the_bits_of_no_line() {
    let all = |line: Option<&str>, name: &str| {
        let mut unit = started(line, name);
        steps(&mut unit, 0, 30);
        let mut bits = Vec::new();
        for name in ["gap", "gap_rate", "acceleration", "lateral_offset", "position"] {
            bits.extend(row(&mut unit, name).iter().map(|value| value.to_bits()));
        }
        bits
    };
    assert_eq!(all(None, "none"), all(Some(STRAIGHT), "straight"));
}

/// Before the curve and far from its start, the vehicle runs as on a straight track, but for rounding.
#[test]
fn invariant_before_the_curve_the_line_changes_nothing() {
    let far = CURVE.replacen("\"plan\"", "\"start\": 30000, \"plan\"", 1);
    let mut on_line = unit("one-car", Some(&far), "far").unwrap();
    let mut plain = unit("one-car", None, "plain").unwrap();
    for unit in [&mut on_line, &mut plain] {
        unit.set_real("initial_position", 30_000.0).unwrap();
        unit.set_real("travel_speed", 10.0).unwrap();
        unit.initialize(0.0).unwrap();
        for (k, load) in row(unit, "static_load").iter().enumerate() {
            unit.set_real(&format!("force_{:02}", k + 1), *load).unwrap();
        }
        unit.set_real("force_03", 6500.0).unwrap();
        steps(unit, 0, 200);
    }
    for name in ["gap", "lateral_offset"] {
        for (a, b) in row(&mut on_line, name).iter().zip(row(&mut plain, name)) {
            assert!((a - b).abs() < 1e-10, "{name}: {a} {b}");
        }
    }
}

#[test]
fn refusal_of_lines_and_starts() {
    let refused = |layout: &str, line: &str, name: &str| {
        unit(layout, Some(line), name).map(|_| ()).unwrap_err()
    };
    let kinked = CURVE.replace("\"radius\": 150", "\"radius\": 160");
    let text = refused("one-car", &kinked, "kinked");
    assert!(text.contains("line.json") && text.contains("the curvature jumps"), "{text}");
    let text = refused("one-magnet", CURVE, "ground");
    assert!(text.contains("line.json") && text.contains("to the ground"), "{text}");
    let mut moved = started(Some(CURVE), "report");
    moved.report("linear").unwrap();
    steps(&mut moved, 0, 700);
    let text = moved.report("linear").unwrap_err().to_string();
    assert!(text.contains("a linearisation of a vehicle in motion"), "{text}");
}
