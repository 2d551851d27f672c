//! The motor by either law, its control, and files that are refused.
#![allow(clippy::unwrap_used, reason = "a test program")]

use linear_motor::{Error, Feed, ForceTable, Motor, MotorDescription};
use serde_json::{Value, json};

fn file() -> Value {
    json!({
        "name": "test", "nominal_gap": 0.01, "pole_pitch": 0.2, "slip_frequency": 12.0, "max_current": 400.0,
        "phase_resistance": 0.05,
        "field": {
            "pole_pairs": 4, "width": 0.22, "overhang": 0.05, "turns": 48, "winding_factor": 0.92,
            "carter_factor": 1.1, "sheet_thickness": 0.004, "sheet_resistivity": 3.3e-8
        }
    })
}

fn motor() -> Motor {
    Motor::new(&MotorDescription::from_json(&file().to_string()).unwrap()).unwrap()
}

/// Forces of the field theory on a grid, as a table.
fn table(points: usize) -> ForceTable {
    let motor = motor();
    let along = |from: f64, to: f64| -> Vec<f64> {
        (0..points).map(|k| from + (to - from) * k as f64 / (points - 1) as f64).collect()
    };
    let (slip_frequency, speed, gap) = (along(-20.0, 20.0), along(0.0, 12.0), along(0.006, 0.014));
    let rows = |normal: bool| {
        let force = |slip: f64, speed: f64, gap: f64| {
            let feed = Feed { current: 200.0, frequency: speed / 0.4 + slip };
            let forces = motor.forces(feed, speed, gap).unwrap();
            if normal { forces.normal } else { forces.thrust }
        };
        slip_frequency
            .iter()
            .map(|f| {
                speed.iter().map(|v| gap.iter().map(|g| force(*f, *v, *g)).collect()).collect()
            })
            .collect()
    };
    let (thrust, normal) = (rows(false), rows(true));
    ForceTable { current: 200.0, slip_frequency, speed, gap, thrust, normal }
}

fn by_table(points: usize) -> Motor {
    let mut description = MotorDescription::from_json(&file().to_string()).unwrap();
    description.field = None;
    description.table = Some(table(points));
    // through text and back
    let text = serde_json::to_string(&description).unwrap();
    Motor::new(&MotorDescription::from_json(&text).unwrap()).unwrap()
}

/// A table of the field's forces gives them at its points, with the square of the current, forwards and
/// backwards; between points with the second order of the distance.
#[test]
fn order_a_table_interpolates_to_second_order() {
    let exact = motor();
    let coarse = by_table(11);
    for (slip, speed, gap) in [(12.0, 4.8, 0.0092), (-20.0, 12.0, 0.014), (-8.0, -6.0, 0.006)] {
        let feed = Feed { current: 330.0, frequency: speed / 0.4 + slip };
        let (known, found) =
            (exact.forces(feed, speed, gap).unwrap(), coarse.forces(feed, speed, gap).unwrap());
        assert!((known.thrust - found.thrust).abs() < 1e-9 * known.thrust.abs(), "{slip} {speed}");
        assert!((known.normal - found.normal).abs() < 1e-9 * known.normal.abs());
    }
    let error = |motor: &Motor| {
        let mut worst = 0.0_f64;
        for k in 0..40 {
            let t = f64::from(k);
            let (speed, gap) = (6.0 + 5.0 * (1.3 * t).sin(), 0.01 + 0.0035 * (2.1 * t).cos());
            let feed =
                Feed { current: 200.0, frequency: speed / 0.4 + 13.0 + 4.0 * (0.7 * t).sin() };
            let known = exact.forces(feed, speed, gap).unwrap();
            let found = motor.forces(feed, speed, gap).unwrap();
            worst = worst.max((known.thrust - found.thrust).abs());
            worst = worst.max((known.normal - found.normal).abs());
        }
        worst
    };
    let (coarse, fine) = (error(&coarse), error(&by_table(41)));
    // a quarter of the distance, a sixteenth of the error
    assert!(coarse / fine > 9.0, "{coarse} {fine}");
}

/// The control's feed gives the thrust that is asked for, in traction and braking down to rest, up to its largest
/// current.
#[test]
fn analytic_the_control_gives_the_thrust() {
    let motor = motor();
    let limits = [motor.control_slip(), motor.max_current()];
    for thrust in [1500.0, 20.0, -900.0] {
        for speed in [0.0, 0.5, 5.5, 9.0] {
            let feed = motor.feed_for(thrust, speed, limits).unwrap();
            let slip = motor.slip_frequency(feed, speed);
            assert!((slip - 12.0 * thrust.signum()).abs() < 1e-12);
            let found = motor.forces(feed, speed, 0.01).unwrap().thrust;
            assert!((found - thrust).abs() < 1e-9 * thrust.abs(), "{thrust} {speed}: {found}");
        }
    }
    assert_eq!(motor.feed_for(0.0, 3.0, limits).unwrap().current, 0.0);
    let most = motor.feed_for(1e5, 3.0, limits).unwrap();
    assert_eq!(most.current, 400.0);
    // the end effect drives a little at synchronous speed, so nearly no slip brakes not at all
    assert_eq!(motor.feed_for(-100.0, 10.0, [1e-3, 400.0]).unwrap().current, 0.0);
}

/// Electrical power: that of thrust, sheet and winding; none but the winding's at no current.
#[test]
fn analytic_electrical_power_has_the_windings_losses() {
    let motor = motor();
    let feed = Feed { current: 300.0, frequency: 26.0 };
    let thrust = motor.forces(feed, 5.0, 0.01).unwrap().thrust;
    let power = motor.input_power(feed, 5.0, 0.01).unwrap();
    // slip loss at the least: F·(v_s − v), with the winding's 3·0.05·300²
    assert!(
        power > 13_500.0 + thrust * 26.0 * 0.4 && power < 1.3 * (13_500.0 + thrust * 26.0 * 0.4)
    );
    assert_eq!(motor.input_power(Feed { current: 0.0, frequency: 26.0 }, 5.0, 0.01), Some(0.0));
    assert_eq!(by_table(3).input_power(feed, 5.0, 0.01), None);
}

#[test]
fn refusal_a_closed_gap_and_places_outside_the_table() {
    let feed = Feed { current: 300.0, frequency: 12.0 };
    let error = motor().forces(feed, 0.0, -1e-4).unwrap_err();
    assert_eq!(error, Error::Touches { gap: -1e-4 });
    assert!(motor().forces(Feed { current: 0.0, ..feed }, 0.0, -1e-4).is_ok());
    let motor = by_table(3);
    for (frequency, speed, gap, text) in [
        (
            20.1,
            0.0,
            0.01,
            "the slip frequency of 20.1 Hz is outside the motor's table of forces, from -20 to 20 Hz",
        ),
        (31.0, 12.5, 0.01, "the speed of 12.5 m/s is outside"),
        (
            12.0,
            0.0,
            0.0141,
            "the gap of 0.0141 m is outside the motor's table of forces, from 0.006 to 0.014 m",
        ),
    ] {
        let error = motor.forces(Feed { current: 1.0, frequency }, speed, gap).unwrap_err();
        assert!(error.to_string().contains(text), "{error}");
    }
}

#[test]
fn refusal_files_with_their_place() {
    let refused = |change: &dyn Fn(&mut Value)| {
        let mut value = file();
        change(&mut value);
        MotorDescription::from_json(&value.to_string()).unwrap_err().to_string()
    };
    let field =
        |key: &'static str, value: Value| refused(&|file| file["field"][key] = value.clone());
    let own = |key: &'static str, value: Value| refused(&|file| file[key] = value.clone());
    let tabled = |change: &dyn Fn(&mut Value)| {
        refused(&|file| {
            file.as_object_mut().unwrap().remove("field");
            file["table"] = serde_json::to_value(table(3)).unwrap();
            change(&mut file["table"]);
        })
    };
    for (text, parts) in [
        (own("nominal_gap", json!(10)), ["`nominal_gap`", "10 m is not between 0.00001 and 0.2 m"]),
        (own("nominal_gap", json!(-0.01)), ["`nominal_gap`", "-0.01 m is not between"]),
        (own("pole_pitch", json!(0.0)), ["`pole_pitch`", "0 m is not between"]),
        (own("slip_frequency", json!(0.0)), ["`slip_frequency`", "0 Hz is not between"]),
        (own("bodies", json!([])), ["`bodies`", "name at least one"]),
        (own("offset", json!([0, 0, 50])), ["`offset`", "up to 10 m"]),
        (own("poles", json!(8)), ["poles", "unknown field"]),
        (field("pole_pairs", json!(0)), ["`field.pole_pairs`", "0 is not a number of pole pairs"]),
        (field("winding_factor", json!(1.2)), ["`field.winding_factor`", "1.2 is not between"]),
        (
            field("sheet_resistivity", json!(33)),
            ["`field.sheet_resistivity`", "33 Ω·m is not between"],
        ),
        (
            field("carter_factor", json!(0.9)),
            ["`field.carter_factor`", "0.9 is not between 1 and 10"],
        ),
        (
            refused(&|file| drop(file.as_object_mut().unwrap().remove("field"))),
            ["`field`", "the law is missing"],
        ),
        (own("table", serde_json::to_value(table(3)).unwrap()), ["`table`", "not both"]),
        (tabled(&|t| t["gap"] = json!([0.006, 0.01, 0.01])), ["`table.gap[2]`", "points ascend"]),
        (tabled(&|t| t["speed"] = json!([1, 2, 3])), ["`table.speed[0]`", "begin with 0"]),
        (
            tabled(&|t| t["slip_frequency"] = json!([-20, 0, 10])),
            ["`table.slip_frequency`", "12 Hz is not between"],
        ),
        (
            tabled(&|t| t["gap"] = json!([0.006, 0.007, 0.008])),
            ["`table.gap`", "nominal gap of 0.01 m"],
        ),
        (
            tabled(&|t| t["thrust"][1] = json!([])),
            ["`table.thrust[1]`", "0 entries, but `speed` has 3"],
        ),
        (
            tabled(&|t| t["normal"][2][0] = json!([1, 2])),
            ["`table.normal[2][0]`", "2 entries, but `gap` has 3"],
        ),
    ] {
        for part in parts {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
