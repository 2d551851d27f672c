//! Journeys with a changing speed, through the C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::tests::{row, set_row, unit};

/// A step with a polynomial of the speed.
fn step(unit: &mut TestInstance, [v, a, j, s]: [f64; 4], time: f64, size: f64) {
    unit.set_real("speed_change", v).unwrap();
    for (order, value) in [(1, a), (2, j), (3, s)] {
        unit.set_input_derivative("speed_change", order, value).unwrap();
    }
    unit.step(time, size).unwrap();
}

fn loaded(layout: &str, magnets: usize, speed: f64) -> TestInstance {
    let mut unit = unit(layout);
    unit.set_real("travel_speed", speed).unwrap();
    unit.enter_initialization(0.0).unwrap();
    let loads = row(&mut unit, "static_load", magnets);
    set_row(&mut unit, "force", &loads);
    unit.exit_initialization().unwrap();
    unit
}

/// Braking with a constant deceleration, in steps of any size: x = x₀ + v₀ t − ½ b t², until it stands, and stays.
#[test]
fn analytic_constant_deceleration_to_a_stop() {
    let (v, b) = (10.0, 1.25);
    for count in [8, 100, 801] {
        let mut unit = loaded("one-magnet", 1, v);
        let size = 8.0 / f64::from(count);
        for n in 0..count {
            let t = f64::from(n) * size;
            step(&mut unit, [-b * t, -b, 0.0, 0.0], t, size);
            let end = t + size;
            let place = 12.5 + v * end - 0.5 * b * end * end;
            assert!((unit.real("position_01").unwrap() - place).abs() < 1e-11, "{count}, {end}");
            assert!((unit.real("speed").unwrap() - (v - b * end)).abs() < 1e-12);
            let slope = unit.output_derivative("position_01", 1).unwrap();
            assert!((slope - (v - b * end)).abs() < 1e-12);
        }
        step(&mut unit, [-v, 0.0, 0.0, 0.0], 8.0, 5.0);
        assert!((unit.real("position_01").unwrap() - 52.5).abs() < 1e-11);
    }
}

/// The place is exact for speeds that are polynomials of the third degree over a step.
#[test]
fn analytic_the_place_is_the_integral_of_a_cubic_speed() {
    let mut unit = loaded("one-magnet", 1, 3.0);
    let [c, d, e] = [0.4, -0.9, 2.5];
    let speed = |t: f64| {
        [t * (c + t * (d + t * e)), c + t * (2.0 * d + 3.0 * t * e), 2.0 * d + 6.0 * e * t, 6.0 * e]
    };
    for n in 0..5 {
        let t = f64::from(n) * 0.3;
        step(&mut unit, speed(t), t, 0.3);
    }
    let t: f64 = 1.5;
    let place = 12.5 + 3.0 * t + t * t * (c / 2.0 + t * (d / 3.0 + t * e / 4.0));
    assert!((unit.real("position_01").unwrap() - place).abs() < 1e-12);
}

/// Without a change of speed nothing differs from a unit that never heard of it, to the last bit: also after the input
/// was set to zero in each step.
#[test]
fn invariant_a_constant_speed_gives_the_same_bits() {
    let run = |sets: bool| {
        let mut unit = loaded("one-bogie", 8, 1.3888888888888888);
        set_row(&mut unit, "lateral_force", &[30.0; 8]);
        for n in 0..40 {
            let t = f64::from(n) * 1e-3;
            if sets {
                step(&mut unit, [0.0; 4], t, 1e-3);
            } else {
                unit.step(t, 1e-3).unwrap();
            }
        }
        let mut all = row(&mut unit, "position", 8);
        all.extend(row(&mut unit, "gap", 8));
        all.extend(row(&mut unit, "acceleration", 8));
        all
    };
    assert_eq!(run(false), run(true));
}

/// Values without derivatives, as from an importer that cannot send them: each is an impulse, and the results approach
/// those of the profile with the size of the step.
#[test]
fn order_a_staircase_of_speeds_approaches_the_profile() {
    let end = 0.4;
    let run = |steps: u32, slopes: bool| {
        let mut unit = loaded("one-car", 32, 5.0);
        let size = end / f64::from(steps);
        for n in 0..steps {
            let t = f64::from(n) * size;
            // the middle of the step, so that the place is exact
            let held = -(t + size / 2.0);
            let profile = [-t, -1.0, 0.0, 0.0];
            step(&mut unit, if slopes { profile } else { [held, 0.0, 0.0, 0.0] }, t, size);
        }
        [unit.real("position_01").unwrap(), unit.real("car_1_pitch").unwrap()]
    };
    let exact = run(400, true);
    let errors = [100, 200, 400].map(|steps| {
        let [place, pitch] = run(steps, false);
        assert!((place - exact[0]).abs() < 1e-3, "{place} {}", exact[0]);
        (pitch - exact[1]).abs()
    });
    assert!(exact[1].abs() > 1e-5, "it does not pitch: {}", exact[1]);
    assert!(
        errors[2] < 0.05 * exact[1].abs() && errors[2] < 0.7 * errors[0],
        "{errors:?} {exact:?}"
    );
}

/// The car's longitudinal acceleration is what its passengers feel: on average that of the profile.
#[test]
fn analytic_passengers_feel_the_braking() {
    let mut unit = loaded("two-car", 64, 20.0);
    let (mut sum, mut count) = (0.0, 0);
    for n in 0..400 {
        let t = f64::from(n) * 5e-3;
        step(&mut unit, [-0.8 * t, -0.8, 0.0, 0.0], t, 5e-3);
        if n >= 200 {
            sum += unit.real("car_1_longitudinal_acceleration").unwrap();
            count += 1;
        }
    }
    let mean = sum / f64::from(count);
    assert!((mean + 0.8).abs() < 0.05, "{mean}");
}

/// Saved, serialized and restored in the middle of braking, it continues with the same bits.
#[test]
fn invariant_a_restored_unit_continues_braking() {
    let mut unit = loaded("one-bogie", 8, 5.0);
    let brake = |unit: &mut TestInstance, from: i32, to: i32| {
        for n in from..to {
            let t = f64::from(n) * 1e-3;
            step(unit, [-t, -1.0, 0.0, 0.0], t, 1e-3);
        }
        (row(unit, "position", 8), row(unit, "gap", 8))
    };
    brake(&mut unit, 0, 20);
    unit.save().unwrap();
    let first = brake(&mut unit, 20, 40);
    unit.restore().unwrap();
    assert_eq!(brake(&mut unit, 20, 40), first);
}

/// A unit that has changed its speed, been reset and started again is a fresh one: its equilibrium knows nothing of the
/// acceleration before.
#[test]
fn issue_20_a_reset_unit_starts_as_a_fresh_one_after_an_acceleration() {
    let run = |unit: &mut TestInstance| {
        unit.initialize(0.0).unwrap();
        step(unit, [0.0, 10.0, 0.0, 0.0], 0.0, 1e-3);
        row(unit, "gap", 32).iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    let mut unit = unit("one-car");
    let fresh = run(&mut unit);
    unit.reset().unwrap();
    assert_eq!(run(&mut unit), fresh);
}
