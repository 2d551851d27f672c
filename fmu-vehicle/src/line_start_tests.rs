//! Starts in curves, through the C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::line_tests::{row, unit};

/// A clothoid of 60 m to a circle of 300 m, canted for about 20 km/h.
const CIRCLE: &str = r#"{ "name": "circle", "plan": [
    { "kind": "straight", "length": 20 }, { "kind": "clothoid", "length": 60, "to_radius": 300 },
    { "kind": "circle", "length": 60, "radius": 300 }, { "kind": "clothoid", "length": 60 } ],
  "cant": [ { "length": 20 }, { "length": 60, "to": -0.01 }, { "length": 60 }, { "length": 60, "to": 0 } ] }"#;

/// In equilibrium at a place and a speed, with the forces that hold it.
fn started(place: f64, speed: f64, name: &str) -> TestInstance {
    let mut unit = unit("one-car", Some(CIRCLE), name).unwrap();
    unit.set_real("initial_position", place).unwrap();
    unit.set_real("travel_speed", speed).unwrap();
    unit.set_boolean("lift_loss", true).unwrap();
    unit.enter_initialization(0.0).unwrap();
    hold(&mut unit);
    unit.exit_initialization().unwrap();
    unit
}

/// Vertical forces that hold the nominal gap, and lateral forces by the magnets' law with some damping.
fn hold(unit: &mut TestInstance) {
    let [loads, gaps, rates] = ["static_load", "gap", "gap_rate"].map(|name| row(unit, name));
    let offsets = row(unit, "lateral_offset");
    for k in 0..32 {
        let name = format!("lateral_offset_{:02}", k + 1);
        let aside = unit.output_derivative(&name, 1).unwrap_or(0.0);
        let [pull, _] = magnet::lateral_force_with_loss(loads[k], gaps[k], offsets[k], 0.028);
        let lift = loads[k] + 4e5 * (gaps[k] - 0.008) + 2e4 * rates[k];
        unit.set_real(&format!("force_{:02}", k + 1), lift).unwrap();
        unit.set_real(&format!("lateral_force_{:02}", k + 1), pull - 2e3 * aside).unwrap();
    }
}

/// In the circle the start is steady motion: the inertial accelerations are those of the circle, and nothing
/// moves relative to the track in the steps that follow.
#[test]
fn analytic_a_start_in_a_circle_is_steady() {
    let speed = 5.0;
    let mut unit = unit("one-car", Some(CIRCLE), "steady").unwrap();
    unit.set_real("initial_position", 110.0).unwrap();
    unit.set_real("travel_speed", speed).unwrap();
    unit.set_boolean("lift_loss", true).unwrap();
    unit.enter_initialization(0.0).unwrap();
    let loads = row(&mut unit, "static_load");
    let (gaps, offsets) = (row(&mut unit, "gap"), row(&mut unit, "lateral_offset"));
    for k in 0..32 {
        let [pull, _] = magnet::lateral_force_with_loss(loads[k], gaps[k], offsets[k], 0.028);
        unit.set_real(&format!("force_{:02}", k + 1), loads[k]).unwrap();
        unit.set_real(&format!("lateral_force_{:02}", k + 1), pull).unwrap();
    }
    unit.exit_initialization().unwrap();
    let weight = 9.81 * unit.real("loaded_mass").unwrap();
    // the magnets carry the weight across the cant and the centrifugal force's part
    let up = f64::cos(0.01) + speed * speed / 300.0 * f64::sin(0.01) / 9.81;
    assert!((loads.iter().sum::<f64>() / weight / up - 1.0).abs() < 1e-5);
    let lateral = speed * speed / 300.0 * f64::cos(0.01);
    assert!((unit.real("car_1_lateral_acceleration").unwrap() / lateral - 1.0).abs() < 1e-3);
    assert!((unit.real("speed").unwrap() - speed).abs() < 1e-9);
    assert!((unit.real("line_curvature").unwrap() - 1.0 / 300.0).abs() < 1e-12);
    // a chord in a circle: the car's middle is inside, the ends of the first bogie lie aside
    assert!(unit.real("car_1_lateral_displacement").unwrap() > 0.01);
    assert!(offsets.iter().any(|y| y.abs() > 5e-3));
    (0..100).for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap());
    for (name, before) in [("gap", gaps), ("lateral_offset", offsets)] {
        for (now, before) in row(&mut unit, name).iter().zip(before) {
            assert!((now - before).abs() < 1e-8, "{name}: {now} {before}");
        }
    }
}

/// In the clothoid the start is quasi-steady: after 1 s of slow motion the vehicle is where a start there
/// would have placed it, and it was not shaken on the way.
#[test]
fn analytic_a_start_in_a_clothoid_is_on_the_way_through_it() {
    let (speed, time) = (3.0, 1000);
    let mut moved = started(48.0, speed, "moved");
    let mut most: f64 = 0.0;
    for n in 0..time {
        hold(&mut moved);
        moved.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        for (gap, rate) in row(&mut moved, "gap").iter().zip(row(&mut moved, "gap_rate")) {
            most = most.max((gap - 0.008).abs() + 0.1 * rate.abs());
        }
    }
    let mut there = started(48.0 + speed * 1e-3 * f64::from(time), speed, "there");
    let change = row(&mut there, "lateral_offset");
    let mut turned: f64 = 0.0;
    for (a, b) in row(&mut moved, "lateral_offset").iter().zip(&change) {
        turned = turned.max((a - b).abs());
    }
    assert!(most < 2e-4 && turned < 6e-5, "{most} {turned}");
    assert!(change.iter().any(|y| y.abs() > 4e-3));
}

#[test]
fn refusal_of_a_start_in_a_curve_that_is_too_tight() {
    let tight = CIRCLE.replace("300", "80");
    let mut unit = unit("one-car", Some(&tight), "tight").unwrap();
    unit.set_real("initial_position", 110.0).unwrap();
    unit.set_boolean("lift_loss", true).unwrap();
    let text = unit.initialize(0.0).unwrap_err().to_string();
    assert!(text.contains("too tight"), "{text}");
}
