//! The magnet without its controller, and the controller alone.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{at, lively, nominal, paper, stepped};
use magnet::{
    Controller, ControllerInputs, ControllerParameters, ControllerState, ControllerWorkspace,
    InputCourse, Law, Magnet, MagnetInputs, MagnetParameters, PowerLimits, Range, Sampling, State,
    VoltageController,
};

fn external(law: Law) -> Magnet {
    let parameters =
        MagnetParameters { law, external_controller: true, ..MagnetParameters::default() };
    Magnet::new(parameters).unwrap()
}

fn measured(inputs: &MagnetInputs) -> ControllerInputs {
    ControllerInputs {
        gap: inputs.gap,
        gap_rate: inputs.gap_rate,
        acceleration: inputs.acceleration,
    }
}

/// Δλ' = Δv − R·Δi written down once more with table 2's numbers, in Runge-Kutta steps of 1 µs: for
/// L₀/R = 0.75 s their error is far below rounding.
#[test]
fn analytic_the_coil_integrates_the_command() {
    let course = lively();
    let value =
        |u: &[f64; 4], t: f64| u[0] + u[1] * t + u[2] * t * t / 2.0 + u[3] * t.powi(3) / 6.0;
    for (law, law_current) in [(Law::Linear, 24.0), (Law::Nonlinear, 14.353)] {
        let magnet = external(law);
        let inputs = MagnetInputs { gap: 0.0083, voltage_command: 0.3, ..nominal() };
        let start = magnet.initialise(&inputs, 0.0).unwrap();
        assert!((start.operating_current - law_current).abs() < 1e-3);
        let double_k = 2e-7 * std::f64::consts::PI * 0.036 * 400.0 * 400.0;
        let rate = |t: f64, flux: f64| {
            let gap = value(&course.gap, t);
            let current = match law {
                Law::Linear => flux / (double_k / 0.008) + 24.0 / 0.008 * (gap - 0.008),
                Law::Nonlinear => {
                    let all = flux + double_k / 0.008 * start.operating_current;
                    all * gap / double_k - start.operating_current
                }
            };
            value(&course.voltage_command, t) - 0.6 * current
        };
        for size in [1e-4, 1e-3, 7e-3] {
            let count = (size / 1e-6_f64).round();
            let h = size / count;
            let mut flux = start.flux_deviation;
            for n in 0..count as u32 {
                let t = f64::from(n) * h;
                let k1 = rate(t, flux);
                let k2 = rate(t + h / 2.0, flux + h / 2.0 * k1);
                let k3 = rate(t + h / 2.0, flux + h / 2.0 * k2);
                let k4 = rate(t + h, flux + h * k3);
                flux += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
            }
            let end = stepped(&magnet, &start, &course, 0.0, size);
            // The nonlinear law takes steps of 50 µs at rates of 1/s and third-order inputs.
            assert!((end.flux_deviation - flux).abs() < 1e-12, "{law:?} {size}");
            assert_eq!(end.filter, [0.0; 5]);
            assert_eq!(magnet.outputs(&end, &at(&course, size)).unwrap().estimates, [0.0; 5]);
        }
    }
}

/// v = R·i_op + Δv; at rest the current is v/R, in both laws and within limits.
#[test]
fn analytic_rest_follows_the_command() {
    for law in [Law::Linear, Law::Nonlinear] {
        let magnet = external(law);
        for (gap, command) in [(0.008, 0.0), (0.008, 0.6), (0.0078, -0.3)] {
            let inputs = MagnetInputs {
                gap,
                voltage_command: command + 0.25,
                transient_voltage: 0.25,
                gap_rate: 0.01,
                acceleration: 3.0,
                ..nominal()
            };
            let state = magnet.initialise(&inputs, 0.0).unwrap();
            let now = magnet.outputs(&state, &inputs).unwrap();
            let operating = state.operating_current;
            assert!((now.current - operating - command / 0.6).abs() < 1e-12);
            assert!((now.voltage - 0.6 * operating - command - 0.25).abs() < 1e-12);
            if command == 0.0 {
                assert!((now.force - nominal().static_force).abs() < 1e-9);
            }
        }
        let limits = PowerLimits {
            voltage: Some(Range { min: 0.0, max: 20.0 }),
            current: Some(Range { min: 0.0, max: 30.0 }),
        };
        let limited = Magnet::new(MagnetParameters { limits, ..*magnet.parameters() }).unwrap();
        let inputs = MagnetInputs { voltage_command: 1e3, ..nominal() };
        let state = limited.initialise(&inputs, 0.0).unwrap();
        let now = limited.outputs(&state, &inputs).unwrap();
        assert_eq!(now.voltage, 20.0);
        assert!((now.current - 30.0).abs() < 1e-12, "{now:?}");
    }
}

/// Controller and magnet apart, on the course of a gap: the filter has the states that it has inside
/// the magnet, and the voltages differ by the operating point's.
#[test]
fn analytic_the_controller_alone_is_the_magnets() {
    let mut parameters = MagnetParameters::default();
    parameters.control.gains.velocity = 45.0;
    parameters.filter.velocity_cutoff = 13.0;
    let magnet = Magnet::new(parameters).unwrap();
    let MagnetParameters { nominal_gap, control, filter, .. } = parameters;
    let alone =
        VoltageController::new(ControllerParameters { nominal_gap, control, filter }).unwrap();
    let begin = MagnetInputs { gap: 0.0083, gap_rate: 0.02, acceleration: 0.7, ..nominal() };
    let mut whole = magnet.initialise(&begin, 0.0).unwrap();
    let mut own = alone.initialise(&measured(&begin), 0.0).unwrap();
    assert_eq!(whole.filter, own.filter);
    let mut workspace = ControllerWorkspace::default();
    for n in 0..10 {
        let time = f64::from(n) * 1e-3;
        let course = lively().after(time);
        whole = stepped(&magnet, &whole, &course, time, 1e-3);
        alone.step(&mut own, &course, time, 1e-3, &mut workspace).unwrap();
        let inputs = at(&lively(), time + 1e-3);
        let (a, b) =
            (magnet.outputs(&whole, &inputs).unwrap(), alone.outputs(&own, &measured(&inputs)));
        // The exponentials of 14 and of 13 columns round differently.
        assert!((a.voltage - 0.6 * 24.0 - b.voltage).abs() < 1e-11, "{a:?} {b:?}");
        for (a, b) in a.estimates.iter().zip(&b.estimates) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        let rates = magnet::InputRates { jerk: 300.0, ..Default::default() };
        let a = magnet.rates(&whole, &inputs, &rates).unwrap();
        let b = alone.rates(&own, &measured(&inputs), 300.0);
        assert!((a.voltage - b.voltage).abs() < 1e-9 * a.voltage.abs(), "{a:?} {b:?}");
    }
    // It starts at rest where the magnet does: the gap's rate moves the filter, not the current.
    let left_out = MagnetParameters { external_controller: true, ..parameters };
    let left_out = Magnet::new(left_out).unwrap();
    let started = alone.initialise(&measured(&begin), 0.0).unwrap();
    let commanded = MagnetInputs {
        voltage_command: alone.outputs(&started, &measured(&begin)).voltage,
        transient_voltage: started.transient_voltage,
        ..begin
    };
    assert!(started.transient_voltage > 1.0);
    let apart = left_out.initialise(&commanded, 0.0).unwrap();
    let whole = magnet.initialise(&begin, 0.0).unwrap();
    assert!((apart.flux_deviation - whole.flux_deviation).abs() < 1e-12);
}

/// Samples fall on the same instants as in the magnet and hold the same voltages; the magnet's filter
/// is integrated by Runge-Kutta there, in steps of 50 µs: 1e-7 of its fast states.
#[test]
fn analytic_a_sampled_controller_alone_is_the_magnets() {
    for delay in [0, 1, 3] {
        let sampling = Some(Sampling { period: 7e-4, delay });
        let control = Controller { sampling, ..MagnetParameters::default().control };
        let magnet =
            Magnet::new(MagnetParameters { control, ..MagnetParameters::default() }).unwrap();
        let alone =
            VoltageController::new(ControllerParameters { control, ..Default::default() }).unwrap();
        let mut whole = magnet.initialise(&nominal(), 0.0).unwrap();
        let mut own = alone.initialise(&measured(&nominal()), 0.0).unwrap();
        let mut workspace = ControllerWorkspace::default();
        let mut seen = 0.0_f64;
        for n in 0..20 {
            let time = f64::from(n) * 1e-3;
            let mut course = lively().after(5e-4 * f64::from(n % 5));
            course.gap[0] = 0.008 + 1e-4 * f64::from(n % 3);
            whole = stepped(&magnet, &whole, &course, time, 1e-3);
            alone.step(&mut own, &course, time, 1e-3, &mut workspace).unwrap();
            assert_eq!(whole.hold.next, own.hold.next);
            let difference = whole.hold.applied - 0.6 * 24.0 - own.hold.applied;
            assert!(difference.abs() < 1e-5, "{difference}");
            seen = seen.max(own.hold.applied.abs());
            // 0.7 ms and 1 ms meet every 7 ms: there the next sample's voltage shows already
            let inputs = ControllerInputs { gap: 0.008, gap_rate: 0.0, acceleration: 1.0 };
            let shown = alone.outputs(&own, &inputs).voltage;
            assert_eq!(own.due, n % 7 == 6, "step {n}");
            let mut after = own;
            let hold = InputCourse {
                gap: [0.008, 0.0, 0.0, 0.0],
                acceleration: [1.0, 0.0, 0.0, 0.0],
                ..InputCourse::default()
            };
            alone.step(&mut after, &hold, time + 1e-3, 1e-5, &mut workspace).unwrap();
            assert_eq!(shown, after.hold.applied, "step {n}");
            assert!(own.due || shown == own.hold.applied);
            let through = alone.voltage_by_acceleration(&own);
            assert_eq!(through != 0.0, own.due && delay == 0);
        }
        assert!(seen > 1.0);
    }
}

/// A step may be cut anywhere, a sampled one too.
#[test]
fn invariant_splitting_a_step_of_the_controller_changes_nothing() {
    for sampling in [None, Some(Sampling { period: 1.1e-3, delay: 1 })] {
        let control = Controller { sampling, ..MagnetParameters::default().control };
        let alone =
            VoltageController::new(ControllerParameters { control, ..Default::default() }).unwrap();
        let start = alone.initialise(&measured(&nominal()), 0.0).unwrap();
        let mut workspace = ControllerWorkspace::default();
        let mut run = |cuts: &[f64]| -> ControllerState {
            let (mut state, mut from) = (start, 0.0);
            for &to in cuts {
                let course = lively().after(from);
                alone.step(&mut state, &course, from, to - from, &mut workspace).unwrap();
                from = to;
            }
            state
        };
        let (whole, cut) = (run(&[5e-3]), run(&[3e-4, 1.1e-3, 2.9e-3, 5e-3]));
        for (a, b) in whole.filter.iter().zip(&cut.filter) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
        assert!((whole.hold.applied - cut.hold.applied).abs() < 1e-9);
    }
}

/// With the controller inside, the command counts for nothing, to the last bit.
#[test]
fn invariant_the_command_is_ignored_with_the_controller_inside() {
    let run = |command: f64| -> State {
        let inputs = MagnetInputs {
            gap: 0.0083,
            voltage_command: command,
            transient_voltage: -command,
            ..nominal()
        };
        let magnet = paper();
        let start = magnet.initialise(&inputs, 0.0).unwrap();
        let course = InputCourse { voltage_command: [command; 4], ..lively() };
        stepped(&magnet, &start, &course, 0.0, 1e-3)
    };
    assert_eq!(run(0.0), run(17.0));
}

#[test]
fn issue_15_bad_values_of_an_external_controller_are_refused() {
    let base = MagnetParameters { external_controller: true, ..MagnetParameters::default() };
    let refused = |parameters: MagnetParameters| Magnet::new(parameters).unwrap_err().to_string();
    let mut sampled = base;
    sampled.control.sampling = Some(Sampling { period: 1e-3, delay: 0 });
    let message = refused(sampled);
    assert!(message.contains("sample time (s) is 0.001, but must be zero"), "{message}");
    let slow = MagnetParameters { law: Law::Nonlinear, integration_step: 0.5, ..base };
    let message = refused(slow);
    assert!(message.contains("time constant L/R"), "{message}");
    // Half a radian of the filter does not count without it.
    Magnet::new(MagnetParameters { integration_step: 1e-2, ..slow }).unwrap();

    let magnet = Magnet::new(base).unwrap();
    let undefined = MagnetInputs { voltage_command: f64::NAN, ..nominal() };
    assert!(magnet.initialise(&undefined, 0.0).is_err());
    let undefined = MagnetInputs { transient_voltage: f64::INFINITY, ..nominal() };
    assert!(magnet.initialise(&undefined, 0.0).is_err());
    let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
    let course = InputCourse { voltage_command: [0.0, f64::NAN, 0.0, 0.0], ..lively() };
    let mut workspace = magnet::Workspace::default();
    assert!(magnet.step(&mut state, &course, 0.0, 1e-3, &mut workspace).is_err());

    let wrong: [fn(&mut ControllerParameters); 4] = [
        |p| p.nominal_gap = 0.0,
        |p| p.control.gains.gap = f64::NAN,
        |p| p.filter.position_cutoff = -1.0,
        |p| p.control.sampling = Some(Sampling { period: 1e-12, delay: 0 }),
    ];
    for change in wrong {
        let mut parameters = ControllerParameters::default();
        change(&mut parameters);
        assert!(VoltageController::new(parameters).is_err());
    }
    let alone = VoltageController::new(ControllerParameters::default()).unwrap();
    let undefined = ControllerInputs { gap: f64::NAN, ..measured(&nominal()) };
    assert!(alone.initialise(&undefined, 0.0).is_err());
}
