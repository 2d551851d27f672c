//! A vehicle with linear motors, through the C functions.
#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use fmi2_export::testing::TestInstance;

use crate::VehicleFmu;
use crate::tests::{row, set_row};

const MOTOR: &str = include_str!("../../scenarios/motors/aluminium-4-mm.json");
/// 18,800 kg of the car.
const MASS: f64 = 18_800.0;

fn unit_with(motor: Option<&str>, name: &str) -> Result<TestInstance, String> {
    let from = format!("{}/resources/one-car/vehicle.json", env!("CARGO_MANIFEST_DIR"));
    let folder = std::env::temp_dir().join(format!("vehicle-motor-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(from, folder.join("vehicle.json")).unwrap();
    if let Some(motor) = motor {
        std::fs::write(folder.join("motor.json"), motor).unwrap();
    }
    let unit = TestInstance::new::<VehicleFmu>(&folder).map_err(|e| e.to_string());
    std::fs::remove_dir_all(&folder).unwrap();
    unit
}

/// At 5 m/s, carried by its static loads.
fn started(motor: Option<&str>, name: &str, set: impl Fn(&mut TestInstance)) -> TestInstance {
    let mut unit = unit_with(motor, name).unwrap();
    unit.set_real("travel_speed", 5.0).unwrap();
    set(&mut unit);
    unit.initialize(0.0).unwrap();
    let loads = row(&mut unit, "static_load", 32);
    set_row(&mut unit, "force", &loads);
    unit
}

/// A step with a linear change of an input.
fn step(unit: &mut TestInstance, input: &str, [value, rate]: [f64; 2], n: u32, size: f64) {
    unit.set_real(input, value).unwrap();
    unit.set_input_derivative(input, 1, rate).unwrap();
    unit.step(f64::from(n) * size, size).unwrap();
}

fn sum(unit: &mut TestInstance, name: &str) -> f64 {
    row(unit, name, 8).iter().sum()
}

/// Without current a vehicle with motors is the one without them, to the last bit.
#[test]
fn invariant_without_current_nothing_changes_by_a_bit() {
    let run = |motor: Option<&str>| {
        let mut unit = started(motor, "still", |_| ());
        unit.set_real("force_03", 6500.0).unwrap();
        (0..30).for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap());
        let mut all = row(&mut unit, "gap", 32);
        all.extend(row(&mut unit, "acceleration", 32));
        all.push(unit.real("speed").unwrap());
        all.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(run(None), run(Some(MOTOR)));
}

/// A car that speeds up and brakes by its motors: their thrust is the mass times the acceleration, and the magnets carry the normal force, which pulls down and pulls the girder up.
#[test]
fn analytic_traction_and_braking_act_through_the_motors() {
    for a in [0.6, -0.6] {
        let mut unit = started(Some(MOTOR), "traction", |_| ());
        for n in 0..40 {
            step(&mut unit, "speed_change", [a * f64::from(n) * 1e-3, a], n, 1e-3);
        }
        let thrust = sum(&mut unit, "motor_thrust");
        // the control knows the nominal gap; without controllers of the magnets the bogies fall by some 0.9 mm
        let gap = sum(&mut unit, "motor_gap") / 8.0;
        assert!((0.0088..0.0095).contains(&gap), "{gap}");
        assert!((thrust / (MASS * a) - 1.0).abs() < 0.05, "{a}: {thrust}");
        // the car hangs on its rods and follows
        let follows = unit.real("car_1_longitudinal_acceleration").unwrap() / a;
        assert!(follows > 0.1, "{follows}");
        let frequency = unit.real("motor_feed_frequency").unwrap();
        assert!((frequency - (5.0 + 0.04 * a) / 0.4 - 12.0 * a.signum()).abs() < 1e-9);
        let down = sum(&mut unit, "motor_vertical_force");
        assert!(down < -3000.0, "{down}");
        // what the magnets carry is the weight, so that the car falls with the normal force
        let falls: f64 = row(&mut unit, "acceleration", 32).iter().sum::<f64>() / 32.0;
        assert!(falls > 0.3, "{falls}");
        // electrical power less that of the windings is thrust times the speed of the wave: braked with nearly no
        // frequency, the plate takes what the motion gives
        let current = unit.real("motor_feed_current").unwrap();
        let power = unit.real("motor_power").unwrap() - 8.0 * 3.0 * 0.03 * current * current;
        let known = thrust * 0.4 * frequency;
        assert!((power - known).abs() < 0.1 * (thrust * 5.0).abs(), "{power} {known}");
    }
}

/// Fed directly, the motors give what the library gives at their own gap and speed; above the track's height the gap is
/// smaller.
#[test]
fn analytic_direct_feed_and_the_height_of_the_track() {
    let description = linear_motor::MotorDescription::from_json(MOTOR).unwrap();
    let law = linear_motor::Motor::new(&description).unwrap();
    let mut unit = started(Some(MOTOR), "direct", |unit| {
        unit.set_boolean("motor_fed_directly", true).unwrap();
    });
    unit.set_real("motor_current", 250.0).unwrap();
    unit.set_real("motor_frequency", 22.0).unwrap();
    unit.set_real("motor_track_displacement_03", 1.5e-3).unwrap();
    let feed = linear_motor::Feed { current: 250.0, frequency: 22.0 };
    for (k, gap) in [(2, 0.01), (3, 0.0085)] {
        let known = law.forces(feed, 5.0, gap).unwrap();
        let mut read = |name: &str| unit.real(&format!("{name}_{k:02}")).unwrap();
        assert!((read("motor_gap") - gap).abs() < 1e-9);
        assert!((read("motor_thrust") - known.thrust).abs() < 1e-3, "{known:?}");
        assert!((read("motor_vertical_force") + known.normal).abs() < 1e-3);
    }
    // bogie 2 of the car stands 3 m before bogie 3
    let place = unit.real("motor_position_03").unwrap() - unit.real("motor_position_05").unwrap();
    assert!((place - 3.0).abs() < 1e-6, "{place}");
}

/// From an importer that sends no derivatives a profile is a staircase: each jump is spread over its step, so the
/// motors give the same, a step later.
#[test]
fn invariant_a_staircase_is_driven_as_the_ramp_that_it_stands_for() {
    let run = |ahead: f64, rate: f64| {
        let mut unit = started(Some(MOTOR), "staircase", |_| ());
        for n in 0..20 {
            let value = 0.5 * (f64::from(n) + ahead) * 1e-3;
            step(&mut unit, "speed_change", [value, rate], n, 1e-3);
        }
        let mut all = row(&mut unit, "gap", 32);
        all.push(sum(&mut unit, "motor_thrust") * 1e-6);
        all
    };
    // the value at a step's end, and none of its rate, is the ramp
    for (a, b) in run(0.0, 0.5).into_iter().zip(run(1.0, 0.0)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// Beyond the largest current the train falls behind its profile.
#[test]
fn analytic_the_current_is_limited() {
    let mut unit = started(Some(MOTOR), "limit", |unit| {
        unit.set_real("motor_max_current", 200.0).unwrap();
    });
    unit.set_real("motor_thrust_demand", 5e4).unwrap();
    assert_eq!(unit.real("motor_feed_current").unwrap(), 200.0);
    let thrust = sum(&mut unit, "motor_thrust");
    assert!(thrust > 2000.0 && thrust < 2e4, "{thrust}");
}

/// Offered derivatives of accelerations and of the motors' places are what the next small steps do, while demand and
/// track change.
#[test]
fn analytic_output_derivatives_with_motors_agree_with_differences() {
    let mut unit = started(Some(MOTOR), "derivatives", |_| ());
    for n in 0..20 {
        let t = f64::from(n) * 1e-3;
        unit.set_real("motor_track_displacement_01", 0.05 * t).unwrap();
        unit.set_input_derivative("motor_track_displacement_01", 1, 0.05).unwrap();
        unit.set_real("speed_change", 0.5 * t).unwrap();
        unit.set_input_derivative("speed_change", 1, 0.5).unwrap();
        step(&mut unit, "motor_thrust_demand", [3e3 + 1e5 * t, 1e5], n, 1e-3);
    }
    let names = ["acceleration_01", "acceleration_08", "motor_position_01"];
    let offered = names.map(|name| unit.output_derivative(name, 1).unwrap());
    let h = 1e-5;
    let mut values = Vec::new();
    for n in 0..3 {
        let t = 0.02 + f64::from(n) * h;
        values.push(names.map(|name| unit.real(name).unwrap()));
        for (input, value, rate) in [
            ("motor_track_displacement_01", 0.05 * t, 0.05),
            ("speed_change", 0.5 * t, 0.5),
            ("motor_thrust_demand", 3e3 + 1e5 * t, 1e5),
        ] {
            unit.set_real(input, value).unwrap();
            unit.set_input_derivative(input, 1, rate).unwrap();
        }
        unit.step(t, h).unwrap();
        // at the end of the step
        let end = t + h;
        unit.set_real("motor_track_displacement_01", 0.05 * end).unwrap();
        unit.set_real("motor_thrust_demand", 3e3 + 1e5 * end).unwrap();
    }
    for (k, name) in names.iter().enumerate() {
        let [a, b, c] = [values[0][k], values[1][k], values[2][k]];
        let slope = (-3.0 * a + 4.0 * b - c) / (2.0 * h);
        assert!(
            (slope - offered[k]).abs() < 2e-3 * offered[k].abs().max(0.1),
            "{name}: {slope} {}",
            offered[k]
        );
    }
    assert!(offered[1].abs() > 0.5, "no jerk to speak of: {offered:?}");
}

/// Going back, and moving to another instance, gives the same bits; stepping does not allocate.
#[test]
fn invariant_saved_states_with_motors_give_the_same_bits() {
    let mut unit = started(Some(MOTOR), "saved", |_| ());
    let run = |unit: &mut TestInstance, from: u32| {
        (from..from + 5)
            .for_each(|n| step(unit, "speed_change", [4e-4 * f64::from(n), 0.4], n, 1e-3));
        let mut all = row(unit, "acceleration", 32);
        all.extend(row(unit, "motor_thrust", 8));
        all.push(unit.output_derivative("acceleration_02", 1).unwrap());
        all.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    run(&mut unit, 0);
    unit.save().unwrap();
    let bytes = unit.serialize().unwrap();
    let known = run(&mut unit, 5);
    unit.restore().unwrap();
    assert_eq!(run(&mut unit, 5), known);
    let mut other = started(Some(MOTOR), "other", |_| ());
    other.deserialize(&bytes).unwrap();
    assert_eq!(run(&mut other, 5), known);
    let counted = measure(|| {
        for n in 10..15 {
            unit.set_input_derivative("speed_change", 1, 0.4).unwrap();
            unit.set_real("speed_change", 4e-4 * f64::from(n)).unwrap();
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
            unit.real("motor_thrust_01").unwrap();
            unit.save().unwrap();
        }
    });
    // the names that this test asks for
    assert!(counted.count_total < 20, "{}", counted.count_total);
}

#[test]
fn refusal_motor_files_and_uses_with_their_reason() {
    let with = |from: &str, to: &str| MOTOR.replace(from, to);
    for (text, reason) in [
        (
            with("*_motor_*", "*_rotor_*"),
            "resource motor.json: motors: `bodies[0]`: no body of the vehicle matches",
        ),
        (
            with("\"pole_pairs\": 4", "\"pole_pairs\": 0"),
            "`field.pole_pairs`: 0 is not a number of pole pairs",
        ),
        (with("\"offset\"", "\"ofset\""), "unknown field"),
    ] {
        let error = unit_with(Some(&text), "refused").unwrap_err();
        assert!(error.contains("motor.json") && error.contains(reason), "{error}");
    }
    let mut unit = started(Some(MOTOR), "uses", |_| ());
    let report = unit.report("linear").unwrap_err().to_string();
    assert!(report.contains("take motor.json out of the resources"), "{report}");
    let modes = unit.report("modes").unwrap_err().to_string();
    assert!(modes.contains("of a vehicle with motors"), "{modes}");
    // a closed gap ends the run
    let mut unit = started(Some(MOTOR), "closed", |_| ());
    unit.set_real("motor_thrust_demand", 1e4).unwrap();
    unit.set_real("motor_track_displacement_02", 0.011).unwrap();
    let closed = unit.step(0.0, 1e-3).unwrap_err().to_string();
    assert!(
        closed.contains("motor 2 at t = 0 s: the motor touches the reaction plate"),
        "{closed}"
    );
}

/// A unit that has run, been reset and started again is a fresh one.
#[test]
fn invariant_a_reset_unit_with_motors_is_a_fresh_one() {
    let run = |unit: &mut TestInstance| {
        unit.initialize(0.0).unwrap();
        step(unit, "speed_change", [0.01, 0.0], 0, 1e-3);
        row(unit, "gap", 32).iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    let mut unit = unit_with(Some(MOTOR), "reset").unwrap();
    let fresh = run(&mut unit);
    unit.reset().unwrap();
    assert_eq!(run(&mut unit), fresh);
}
