//! Starts in curves, through the C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::line_tests::{row, unit};

/// A clothoid of 60 m to a circle of 300 m, canted for about 20 km/h.
pub(crate) const CIRCLE: &str = r#"{ "name": "circle", "plan": [
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
pub(crate) fn hold(unit: &mut TestInstance) {
    let [loads, gaps, rates] = ["static_load", "gap", "gap_rate"].map(|name| row(unit, name));
    let offsets = row(unit, "lateral_offset");
    // read before anything is set: each value set makes the outputs be computed anew
    let aside: Vec<f64> = (1..=32)
        .map(|k| unit.output_derivative(&format!("lateral_offset_{k:02}"), 1).unwrap_or(0.0))
        .collect();
    for k in 0..32 {
        let [pull, _] = magnet::lateral_force_with_loss(loads[k], gaps[k], offsets[k], 0.028);
        let lift = loads[k] + 4e5 * (gaps[k] - 0.008) + 2e4 * rates[k];
        unit.set_real(&format!("force_{:02}", k + 1), lift).unwrap();
        unit.set_real(&format!("lateral_force_{:02}", k + 1), pull - 2e3 * aside[k]).unwrap();
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

/// Values of a row of magnets, and what they are called in the report.
const SEEN: [&str; 5] = ["gap", "gap_rate", "acceleration", "lateral_offset", "position"];

/// In steady curving in the canted circle, the report `linear` says what the unit's own steps do: central
/// differences of runs with one force a little larger and smaller, against x' = A x + B u, y = C x + D u.
#[test]
fn analytic_the_linear_report_in_a_curve_agrees_with_steps() {
    let speed = 12.0;
    let mut unit = unit("one-car", Some(CIRCLE), "linear").unwrap();
    unit.set_real("initial_position", 110.0).unwrap();
    unit.set_real("travel_speed", speed).unwrap();
    unit.enter_initialization(0.0).unwrap();
    let loads = row(&mut unit, "static_load");
    let (gaps, offsets) = (row(&mut unit, "gap"), row(&mut unit, "lateral_offset"));
    for k in 0..32 {
        let pull = magnet::lateral_force(loads[k], gaps[k], offsets[k], 0.028);
        unit.set_real(&format!("force_{:02}", k + 1), loads[k]).unwrap();
        unit.set_real(&format!("lateral_force_{:02}", k + 1), pull).unwrap();
    }
    unit.exit_initialization().unwrap();
    let report: serde_json::Value = serde_json::from_str(&unit.report("linear").unwrap()).unwrap();
    let states = report["states"].as_array().unwrap().len();
    let index = |list: &str, name: &str, unit: &TestInstance| {
        let reference = unit.reference(name).unwrap();
        report[list].as_array().unwrap().iter().position(|v| *v == reference).unwrap()
    };
    let entries = |matrix: &str| -> Vec<(usize, usize, f64)> {
        let entries = report[matrix].as_array().unwrap().iter();
        let whole = |value: &serde_json::Value| usize::try_from(value.as_u64().unwrap()).unwrap();
        entries.map(|e| (whole(&e[0]), whole(&e[1]), e[2].as_f64().unwrap())).collect()
    };
    let [a, b, c, d] = ["a", "b", "c", "d"].map(entries);
    for (input, size) in
        [("force_03", 40.0), ("lateral_force_20", 40.0), ("car_1_external_force_y", 200.0)]
    {
        let u = index("inputs", input, &unit);
        let (h, steps) = (1e-3, 60);
        let rates = |x: &[f64]| {
            let mut rates = vec![0.0; states];
            a.iter().for_each(|(i, j, value)| rates[*i] += value * x[*j]);
            b.iter().filter(|(_, j, _)| *j == u).for_each(|(i, _, value)| rates[*i] += value);
            rates
        };
        let mut x = vec![0.0; states];
        for _ in 0..steps {
            let mut sum = vec![0.0; states];
            let mut stage = x.clone();
            for (ahead, weight) in [(0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)] {
                let rate = rates(&stage);
                for i in 0..states {
                    sum[i] += weight / 6.0 * h * rate[i];
                    stage[i] = x[i] + ahead * h * rate[i];
                }
            }
            x.iter_mut().zip(sum).for_each(|(x, sum)| *x += sum);
        }
        unit.save().unwrap();
        let value = unit.real(input).unwrap();
        let run = |change: f64, unit: &mut TestInstance| -> Vec<Vec<f64>> {
            unit.restore().unwrap();
            unit.set_real(input, value + change).unwrap();
            (0..steps).for_each(|n| unit.step(f64::from(n) * h, h).unwrap());
            SEEN.map(|name| row(unit, name)).to_vec()
        };
        let (more, less) = (run(size, &mut unit), run(-size, &mut unit));
        unit.restore().unwrap();
        for (n, name) in SEEN.iter().enumerate() {
            let y: Vec<f64> = (0..32)
                .map(|k| {
                    let output = index("outputs", &format!("{name}_{:02}", k + 1), &unit);
                    let state = c.iter().filter(|e| e.0 == output).map(|e| e.2 * x[e.1]);
                    let direct = d.iter().filter(|e| e.0 == output && e.1 == u).map(|e| e.2);
                    state.sum::<f64>() + direct.sum::<f64>()
                })
                .collect();
            let most = y.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
            for k in 0..32 {
                let slope = (more[n][k] - less[n][k]) / (2.0 * size);
                assert!(
                    (slope - y[k]).abs() < 1e-4 * most,
                    "{name}_{} by {input}: {slope} {} of {most}",
                    k + 1,
                    y[k]
                );
            }
        }
    }
}

#[test]
fn refusal_of_a_linearisation_in_motion_through_a_clothoid() {
    let mut moving = started(50.0, 3.0, "refused");
    let text = moving.report("linear").unwrap_err().to_string();
    assert!(text.contains("change between") && text.contains("speed 0"), "{text}");
    assert!(moving.report(r#"modes {"at": "state"}"#).is_err());
    let mut still = started(50.0, 0.0, "standing");
    still.report("linear").unwrap();
    still.report("motions").unwrap();
    still.report("modes").unwrap();
}
