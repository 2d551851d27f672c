//! Rates and partial derivatives of the outputs against differences.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{lively, nominal, stepped};
use magnet::{
    InputCourse, InputRates, Law, Magnet, MagnetInputs, MagnetOutputs, MagnetParameters,
    PowerLimits, Range, State,
};

fn magnets() -> Vec<Magnet> {
    let tight = PowerLimits {
        voltage: Some(Range { min: -5.0, max: 15.0 }),
        current: Some(Range { min: 0.0, max: 16.0 }),
    };
    [
        (Law::Linear, PowerLimits::default(), false),
        (Law::Nonlinear, PowerLimits::default(), false),
        (Law::Linear, PowerLimits { current: None, ..tight }, false),
        (Law::Nonlinear, PowerLimits { voltage: None, ..tight }, false),
        (Law::Linear, PowerLimits::default(), true),
        (Law::Nonlinear, PowerLimits::default(), true),
        (Law::Linear, PowerLimits { current: None, ..tight }, true),
        (Law::Nonlinear, PowerLimits { voltage: None, ..tight }, true),
    ]
    .into_iter()
    .map(|(law, limits, external_controller)| {
        let parameters = MagnetParameters {
            law,
            limits,
            external_controller,
            operating_current: 15.9,
            ..MagnetParameters::default()
        };
        Magnet::new(parameters).unwrap()
    })
    .collect()
}

fn at(course: &InputCourse, time: f64) -> MagnetInputs {
    let static_force = common::LOAD + 300.0 * time + 4e4 * time * time;
    let lateral_offset = 0.002 + 0.3 * time + 5.0 * time * time;
    MagnetInputs { lateral_offset, static_force, ..common::at(course, time) }
}

fn rates_at(course: &InputCourse, time: f64) -> InputRates {
    let later = course.after(time);
    InputRates {
        gap_acceleration: later.gap[2],
        jerk: later.acceleration[1],
        static_force_rate: 300.0 + 8e4 * time,
        static_force_acceleration: 8e4,
        voltage_command_rate: later.voltage_command[1],
        offset_rate: 0.3 + 10.0 * time,
        offset_acceleration: 10.0,
    }
}

/// F', F'', i', v', y' are the derivatives of what a step shows. Central differences over ±10 µs of
/// signals with rates of 1e3 1/s err by (1e-2)²/6 of the third derivative's share: 1e-4 relative to
/// the largest term is asked; second differences add rounding of 1e-12·F/(1e-5)² = 60 N/s² to
/// rates of 1e6.
#[test]
fn analytic_rates_are_the_derivatives_of_the_course() {
    let d = 1e-5;
    for magnet in magnets() {
        let start = magnet.initialise(&MagnetInputs { gap: 0.0083, ..nominal() }, 0.0).unwrap();
        let show = |time: f64| -> (State, MagnetOutputs) {
            let state = stepped(&magnet, &start, &lively(), 0.0, time);
            (state, magnet.outputs(&state, &at(&lively(), time)).unwrap())
        };
        let time = 2e-3;
        let ((_, before), (state, now), (_, after)) = (show(time - d), show(time), show(time + d));
        let (inputs, input_rates) = (at(&lively(), time), rates_at(&lively(), time));
        let rates = magnet.rates(&state, &inputs, &input_rates).unwrap();
        let [aside, aside_second] =
            magnet.lateral_rates(&state, &inputs, &input_rates, &rates).unwrap();
        let check = |name: &str, rate: f64, a: f64, b: f64, floor: f64| {
            let difference = (b - a) / (2.0 * d);
            assert!(
                (rate - difference).abs() < 1e-4 * difference.abs().max(floor),
                "{name}: {rate} is not {difference} in {:?} {:?}",
                magnet.parameters().law,
                magnet.limits_at_work(&state, &at(&lively(), time)),
            );
        };
        check("force", rates.force, before.force, after.force, 1e3);
        check("lateral force", aside, before.lateral_force, after.lateral_force, 1e2);
        check("current", rates.current, before.current, after.current, 1.0);
        check("voltage", rates.voltage, before.voltage, after.voltage, 100.0);
        for k in 0..5 {
            check("estimate", rates.estimates[k], before.estimates[k], after.estimates[k], 1.0);
        }
        let second = (after.force - 2.0 * now.force + before.force) / (d * d);
        assert!(
            (rates.force_second - second).abs() < 1e-3 * second.abs().max(1e6),
            "{} is not {second} in {:?}",
            rates.force_second,
            magnet.parameters()
        );
        let second =
            (after.lateral_force - 2.0 * now.lateral_force + before.lateral_force) / (d * d);
        assert!(
            (aside_second - second).abs() < 1e-3 * second.abs().max(1e5),
            "{aside_second} is not {second} in {:?}",
            magnet.parameters()
        );
    }
}

/// Partial derivatives of all outputs against central differences; those not listed are zero.
#[test]
fn analytic_partials_are_the_derivatives_by_the_inputs() {
    for magnet in magnets() {
        let start = magnet.initialise(&MagnetInputs { gap: 0.0083, ..nominal() }, 0.0).unwrap();
        let state = stepped(&magnet, &start, &lively(), 0.0, 1e-4);
        let inputs = at(&lively(), 1e-4);
        let partials = magnet.partials(&state, &inputs).unwrap();
        let by = |width: f64, field: &dyn Fn(&mut MagnetInputs, f64)| {
            let show = |sign: f64| {
                let mut inputs = inputs;
                field(&mut inputs, sign * width);
                let o = magnet.outputs(&state, &inputs).unwrap();
                let y = o.estimates;
                [o.force, o.lateral_force, o.current, o.voltage, y[0], y[1], y[2], y[3], y[4]]
            };
            let (a, b) = (show(-1.0), show(1.0));
            std::array::from_fn::<f64, 9, _>(|k| (b[k] - a[k]) / (2.0 * width))
        };
        let rows = [
            by(1e-7, &|inputs, d| inputs.gap += d),
            by(1e-3, &|inputs, d| inputs.gap_rate += d),
            by(1e-3, &|inputs, d| inputs.acceleration += d),
            by(1e-7, &|inputs, d| inputs.lateral_offset += d),
            by(1.0, &|inputs, d| inputs.static_force += d),
            by(1e-3, &|inputs, d| inputs.voltage_command += d),
            by(1e-3, &|inputs, d| inputs.transient_voltage += d),
        ];
        let mut expected = [[0.0; 9]; 7];
        expected[0][0] = partials.force_by_gap;
        expected[0][1] = partials.lateral_force_by_gap;
        expected[0][2] = partials.current_by_gap;
        expected[2][3] = partials.voltage_by_acceleration;
        expected[2][6] = partials.estimate_by_acceleration;
        expected[3][1] = partials.lateral_force_by_offset;
        expected[4][0] = partials.force_by_static_force;
        expected[4][1] = partials.lateral_force_by_static_force;
        expected[5][3] = partials.voltage_by_command;
        for (row, expected) in rows.iter().zip(&expected) {
            for (value, expected) in row.iter().zip(expected) {
                // Width 1e-7 of 8e-3 m: 1e-9 of truncation; rounding 1e-12/1e-7·1e4 N.
                let tolerance = 1e-7 * expected.abs() + 1e-5;
                assert!((value - expected).abs() < tolerance, "{rows:?} is not {expected:?}");
            }
        }
    }
}
