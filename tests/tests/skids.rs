//! Stops and skids with the real magnets and girder: lift-off, set-down, an instability that they limit,
//! and the coupling error of an impact.

// A helper of a test fails as the test does.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use system_tests::{FinishedRun, scenario};

type Columns = BTreeMap<String, Vec<f64>>;

fn gaps() -> impl Iterator<Item = String> {
    (1..=8).map(|k| format!("vehicle.gap_{k:02}"))
}

/// Rows of a time interval (s), its end included.
fn rows(columns: &Columns, from: f64, to: f64) -> std::ops::Range<usize> {
    let before = |limit: f64| columns["time"].iter().take_while(|t| **t < limit).count();
    before(from - 1e-9)..before(to + 1e-9)
}

/// Nothing moves on the skids; the magnets carry the bogie at 8 mm; it stands on its skids again. Skids and
/// magnets together carry the weight whenever nothing moves.
#[test]
fn issue_15_a_bogie_lifts_off_and_sets_down() {
    let run = FinishedRun::of(&scenario("levitation.json"), &[]).unwrap();
    let columns = run.columns().unwrap();
    let all = |name: &str, row: usize| -> f64 {
        (1..=8).map(|k| columns[&name.replace('#', &format!("{k:02}"))][row]).sum()
    };
    let weight = 4750.0 * 9.81;
    for gap in gaps() {
        let c = &columns[&gap];
        for row in rows(&columns, 0.0, 1.0) {
            assert!((c[row] - c[0]).abs() < 1e-9, "{gap} moves by {} m", c[row] - c[0]);
        }
        // the girder rings on by a few micrometres
        for row in rows(&columns, 5.0, 6.0) {
            assert!((c[row] - 8e-3).abs() < 2e-5, "{gap} = {} m while levitating", c[row]);
        }
        let last = c.last().unwrap();
        assert!((last - c[0]).abs() < 1e-6, "{gap}: {} m at first, {last} m at last", c[0]);
        assert!((0.0161..0.0165).contains(&c[0]));
    }
    for (t, skids) in [(0.5, weight), (5.0, 0.0), (10.0, weight)] {
        let row = rows(&columns, 0.0, t).end - 1;
        let (carried, pulled) = (all("vehicle.contact_force_#", row), all("ems_#.force", row));
        assert!(
            (carried + pulled - weight).abs() < 2e-3 * weight,
            "{carried} + {pulled} N at {t} s"
        );
        assert!((carried - skids).abs() < 2e-3 * weight, "skids carry {carried} N at {t} s");
    }
    for k in 1..=8 {
        let current = &columns[&format!("ems_{k:02}.current")];
        assert!(current.iter().all(|i| *i >= 0.0) && *current.last().unwrap() < 1e-6);
    }
}

/// The oscillation grows as the coupled mode says, by 0.507 1/s, until stops and skids limit it, and the run
/// goes on to its end; without them the run ends at the rail, as a result.
#[test]
fn issue_15_stops_and_skids_limit_an_instability() {
    let file = scenario("unstable-limited.json");
    let run = FinishedRun::of(&file, &[]).unwrap();
    let columns = run.columns().unwrap();
    let c = &columns["vehicle.gap_01"];
    let swing = |from: f64| {
        let window = &c[rows(&columns, from, from + 0.5)];
        let (low, high) =
            window.iter().fold((f64::MAX, 0.0_f64), |(l, h), c| (l.min(*c), h.max(*c)));
        high - low
    };
    let rate = (swing(10.5) / swing(8.5)).ln() / 2.0;
    assert!((rate - 0.507).abs() < 0.05, "grows by {rate} 1/s");
    let (low, high) = c.iter().fold((f64::MAX, 0.0_f64), |(l, h), c| (l.min(*c), h.max(*c)));
    assert!(low > 0.5e-3 && low < 1e-3, "smallest gap {low} m");
    assert!(high > 16e-3 && high < 17e-3, "largest gap {high} m");
    // it does not die away
    assert!((17..29).all(|t| swing(f64::from(t)) > 2e-3));
    let without =
        ["--set", "vehicle.contact_stop_on=false", "--set", "vehicle.contact_skid_on=false"];
    let summary = FinishedRun::of(&file, &without).unwrap().summary;
    assert_eq!(summary["status"], "terminated");
    let reason = summary["ended_by"].as_str().unwrap();
    assert!(reason.contains("has reached the rail"), "{reason}");
    let reached = summary["reached"].as_f64().unwrap();
    assert!((16.0..17.5).contains(&reached), "{reached}");
}

/// A bogie whose magnets are off falls by 8 mm on its skids, with 0.4 m/s and 50 kN at each. Steps of 1 ms
/// give the gap to 2 µm and the girder's deflection to 1 % of its swing; the error falls with the square of
/// the step at least.
#[test]
fn order_of_the_coupling_across_an_impact() {
    let fall = |step: &str| {
        let options = [
            "--set",
            "vehicle.start_on_skids=false",
            "--set",
            "ems_*.start_without_current=false",
            "--set",
            "ems_*.lift_off_time=0",
            "--set",
            "ems_*.set_down_time=0",
            "--set",
            "ems_*.supply_failed=true",
            "--stop",
            "0.3",
            "--record-interval",
            "0.001",
            "--step",
            step,
        ];
        FinishedRun::of(&scenario("levitation.json"), &options).unwrap().columns().unwrap()
    };
    let exact = fall("6.25e-5");
    assert!(exact["vehicle.contact_force_01"].iter().any(|f| *f > 2e4));
    let off = |columns: &Columns, name: &str| {
        let pairs = columns[name].iter().zip(&exact[name]);
        pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
    };
    let errors = ["1e-3", "5e-4", "2.5e-4"].map(|step| {
        let found = fall(step);
        [off(&found, "vehicle.gap_01"), off(&found, "guideway.midspan_displacement_01")]
    });
    println!("gap, deflection: {errors:?} m");
    assert!(errors[0][0] < 4e-6 && errors[0][1] < 2e-5, "{errors:?}");
    for pair in errors.windows(2) {
        let smaller = pair[0].iter().zip(&pair[1]).all(|(before, after)| *after < before / 3.0);
        assert!(smaller, "{errors:?}");
    }
}
