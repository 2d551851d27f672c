//! Linear motors: the numbers of docs/linear-motors.md, from the packed units.

#![allow(clippy::unwrap_used, reason = "a test program")]

use system_tests::{FinishedRun, scenario};

/// The train speeds up with 0.7 m/s²: its motors give the mass times that, and their normal force opens the gaps.
#[test]
fn issue_20_motors_drive_the_train_and_open_the_gaps() {
    let run =
        FinishedRun::of(&scenario("traction.json"), &["--stop", "2.5", "--no-report"]).unwrap();
    let columns = run.columns().unwrap();
    // before, at rest in the travelling frame
    let before = columns["vehicle.gap_01"][100];
    assert!((before - 8e-3).abs() < 1e-6, "{before}");
    let last = columns["vehicle.speed"].len() - 1;
    let sum = |row: &str, count: usize| -> f64 {
        (1..=count).map(|k| columns[format!("vehicle.{row}_{k:02}").as_str()][last]).sum()
    };
    let thrust = sum("motor_thrust", 16);
    // the control knows the nominal gap; the motors are some 0.13 mm closer
    assert!((thrust / (38_000.0 * 0.7) - 1.006).abs() < 0.004, "{thrust}");
    let normal = sum("motor_vertical_force", 16);
    assert!((normal + 21_100.0).abs() < 300.0, "{normal}");
    let gap = sum("gap", 64) / 64.0;
    assert!((gap - 8.155e-3).abs() < 0.01e-3, "{gap}");
    let speed = columns["vehicle.speed"][last];
    assert!((speed - (5.0 / 3.6 + 0.7 * 1.5)).abs() < 0.01, "{speed}");
}
