//! Curves and crosswind: the numbers of docs/curves.md and docs/scenarios.md, from the packed units.

#![allow(clippy::unwrap_used, reason = "a test program")]

use system_tests::{FinishedRun, scenario};

/// The largest value of a row of recorded signals.
fn largest(run: &FinishedRun, row: &str, statistic: &str) -> f64 {
    let each = (1..=64).map(|k| run.statistic(&format!("{row}_{k:02}"), statistic).unwrap());
    each.fold(f64::NEG_INFINITY, f64::max)
}

/// The train stands still in the mean wind, from a start at rest, until the gust moves it.
#[test]
fn issue_20_a_gust_at_rest_moves_the_train_aside() {
    let run =
        FinishedRun::of(&scenario("crosswind.json"), &["--stop", "4.5", "--no-report"]).unwrap();
    let columns = run.columns().unwrap();
    let first = &columns["vehicle.lateral_offset_05"];
    // 1 s of wind that grows by 1 % of the gust
    assert!((first[100] - first[0]).abs() < 0.03e-3 && first[0] > 1e-3, "{}", first[0]);
    let offset = largest(&run, "vehicle.lateral_offset", "max");
    assert!((offset - 5.34e-3).abs() < 0.02e-3, "{offset}");
    let gap = largest(&run, "vehicle.gap", "max");
    assert!((gap - 8.81e-3).abs() < 0.02e-3, "{gap}");
    assert!(run.statistic("vehicle.joint_opening", "max").unwrap() < 1e-11);
}
