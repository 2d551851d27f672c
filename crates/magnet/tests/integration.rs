//! Nonlinear law, limits and sampling: what the Runge-Kutta path must show.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{at, distance, lively, nominal, paper, stepped};
use magnet::{
    InputCourse, Law, Magnet, MagnetInputs, MagnetParameters, PowerLimits, Range, Sampling, State,
    Workspace,
};

fn nonlinear(integration_step: f64, limits: PowerLimits) -> Magnet {
    let law = Law::Nonlinear;
    Magnet::new(MagnetParameters { law, limits, integration_step, ..MagnetParameters::default() })
        .unwrap()
}

fn start(magnet: &Magnet) -> State {
    magnet.initialise(&MagnetInputs { gap: 0.0083, ..nominal() }, 0.0).unwrap()
}

/// Order observed over a run when its steps shrink from 0.2 ms to a sixteenth, against one with
/// steps of 1 µs. The steps do not divide the events' instants.
fn observed_order(course: &InputCourse, duration: f64, make: impl Fn(f64) -> Magnet) -> f64 {
    let run = |step: f64| {
        let magnet = make(step);
        stepped(&magnet, &start(&magnet), course, 0.0, duration)
    };
    let fine = run(1e-6);
    let error = |step| distance(&fine, &run(step));
    let (coarse, small) = (error(2e-4), error(2e-4 / 16.0));
    assert!(small > 1e-13, "the error is too small to show an order: {small}");
    (coarse / small).log2() / 4.0
}

/// Steps of up to 0.2 radian of the filter's rate still carry terms of the next order, so 4 ± 0.3.
#[test]
fn order_of_the_nonlinear_law_is_four() {
    let order = observed_order(&lively(), 4e-3, |step| nonlinear(step, PowerLimits::default()));
    assert!((order - 4.0).abs() < 0.3, "{order}");
}

/// With the switches located the order holds across them; stepping over them shows none at all.
/// Where in its step a switch falls changes the error's constant by some factor, which over four
/// halvings is worth half an order at most.
///
/// The gap opens, closes and opens again: voltage and current meet their limits and leave them, and
/// at the end both are free, so that the current remembers every switch.
#[test]
fn order_is_kept_across_the_limits() {
    let course = InputCourse {
        gap: [0.0083, 0.02, -30.0, 16_000.0],
        acceleration: [0.0, 2000.0, -1.25e6, 0.0],
        ..InputCourse::default()
    };
    let limits = PowerLimits {
        voltage: Some(Range { min: 8.0, max: 12.2 }),
        current: Some(Range { min: 15.73, max: 15.738 }),
    };
    let (magnet, duration) = (nonlinear(5e-5, limits), 3.2e-3);
    let mut state = start(&magnet);
    let mut modes = Vec::new();
    for n in 0..=320 {
        let time = f64::from(n) * 1e-5;
        let mode = magnet.limits_at_work(&state, &at(&course, time));
        if modes.last() != Some(&mode) {
            modes.push(mode);
        }
        state = stepped(&magnet, &state, &course.after(time), 0.0, 1e-5);
    }
    assert!(modes.iter().any(|m| m.voltage_is_limited()), "{modes:?}");
    assert!(modes.iter().filter(|m| m.current_is_limited()).count() > 1, "{modes:?}");
    let end = modes.pop().unwrap();
    assert!(!end.voltage_is_limited() && !end.current_is_limited(), "{modes:?}");
    let order = observed_order(&course, duration, |step| nonlinear(step, limits));
    assert!(order > 3.5, "{order} {modes:?}");
}

/// For small motions the nonlinear magnet is the linear one with its coefficients at the current
/// that carries the load: the difference falls with the square of the amplitude.
#[test]
fn order_nonlinear_magnet_tends_to_the_linear_one() {
    let nonlinear = nonlinear(5e-5, PowerLimits::default());
    let current = nonlinear.electromagnet().equilibrium_current(common::LOAD, 0.008);
    let linear = MagnetParameters { operating_current: current, ..MagnetParameters::default() };
    let linear = Magnet::new(linear).unwrap();
    let difference = |amplitude: f64| {
        let course = InputCourse {
            gap: [0.008 + 1e-4 * amplitude, 0.02 * amplitude, -3.0 * amplitude, 0.0],
            acceleration: [amplitude, 50.0 * amplitude, 0.0, 0.0],
            ..InputCourse::default()
        };
        let inputs = nominal();
        let [a, b] = [&nonlinear, &linear].map(|magnet| {
            let state = magnet.initialise(&inputs, 0.0).unwrap();
            let end = stepped(magnet, &state, &course, 0.0, 5e-3);
            magnet.outputs(&end, &at(&course, 5e-3)).unwrap().force
        });
        (a - b).abs()
    };
    let order = (difference(0.2) / difference(0.1)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

fn sampled(period: f64, delay: usize) -> Magnet {
    let mut parameters = MagnetParameters::default();
    parameters.control.sampling = Some(Sampling { period, delay });
    Magnet::new(parameters).unwrap()
}

/// Holding the voltage delays it by half a sample on average, one sample of delay by one and a half:
/// the current's error against the continuous controller is of first order, and three times as large
/// with the delay.
#[test]
fn order_sampled_controller_tends_to_the_continuous_one() {
    let continuous = paper();
    // From rest, so that the voltage before the first sample continues that after it.
    let begin = continuous.initialise(&at(&lively(), 0.0), 0.0).unwrap();
    let exact = stepped(&continuous, &begin, &lively(), 0.0, 5e-3);
    let error = |period: f64, delay: usize| {
        let magnet = sampled(period, delay);
        let state = magnet.initialise(&at(&lively(), 0.0), 0.0).unwrap();
        let end = stepped(&magnet, &state, &lively(), 0.0, 5e-3);
        (end.flux_deviation - exact.flux_deviation).abs()
    };
    let order = (error(1e-4, 0) / error(5e-5, 0)).log2();
    assert!((order - 1.0).abs() < 0.05, "{order}");
    let ratio = error(5e-5, 1) / error(5e-5, 0);
    assert!((ratio - 3.0).abs() < 0.1, "{ratio}");
}

/// Sampling instants belong to the controller, not to the caller's steps: any cutting of the time
/// into steps gives the same course, on, off and across the instants.
#[test]
fn invariant_sampling_instants_do_not_depend_on_the_steps() {
    for delay in [0, 1] {
        let magnet = sampled(3e-4, delay);
        let begin = magnet.initialise(&nominal(), 2.0).unwrap();
        let run = |count: u32| {
            let size = 6e-3 / f64::from(count);
            let mut state = begin;
            for n in 0..count {
                let at = f64::from(n) * size;
                state = stepped(&magnet, &state, &lively().after(at), 2.0 + at, size);
            }
            state
        };
        let whole = run(1);
        for count in [7, 20, 40, 47, 600] {
            // The pieces of the Runge-Kutta method are cut differently: its error of 1e-7.
            let other = run(count);
            assert!(distance(&whole, &other) < 1e-7, "{count}: {}", distance(&whole, &other));
            assert_eq!(whole.hold.next, other.hold.next);
        }
        assert_eq!(whole.hold.next, 20);
    }
}

/// A sampled voltage acts as a constant: over one sample without motion the current follows its
/// closed form, Δi(t) = Δi∞ + (Δi₀ − Δi∞)·e^{−Rt/L}.
#[test]
fn analytic_current_under_a_held_voltage() {
    let magnet = sampled(1e-3, 0);
    let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
    state.filter[0] = 2.0;
    let end = stepped(&magnet, &state, &InputCourse::constant(&nominal()), 0.0, 1e-3);
    let coil = magnet.electromagnet();
    let limit = 7.0 * 2.0 / coil.resistance;
    let expected = -limit * (-coil.resistance / coil.inductance * 1e-3).exp_m1();
    // Runge-Kutta at 50 µs and 1.3 1/s: far below rounding, which is 20 additions of 1e-2.
    assert!((magnet.current(&end, 0.008) - 24.0 - expected).abs() < 1e-13);
    assert_eq!(magnet.outputs(&end, &nominal()).unwrap().voltage, 0.6 * 24.0 + 14.0);
}

/// What goes into the coil's terminals and is not lost as heat is stored in the field or does work
/// on the gap: ∫(v·i − R·i²)dt = Δ(L·i²/2) − ∫F·ċ dt. Over a motion of 0.3 mm.
#[test]
fn invariant_energy_balance_of_the_nonlinear_coil() {
    let magnet = nonlinear(5e-5, PowerLimits::default());
    let mut state = start(&magnet);
    let begin = magnet.current(&state, 0.0083);
    let (mut supplied, mut work) = (0.0, 0.0);
    let course = lively();
    let count = 4000;
    let h = 4e-3 / f64::from(count);
    // Simpson's rule over pairs of steps.
    for n in 0..=count {
        let inputs = at(&course, f64::from(n) * h);
        let outputs = magnet.outputs(&state, &inputs).unwrap();
        let weight = match n {
            0 => 1.0,
            n if n == count => 1.0,
            n if n % 2 == 1 => 4.0,
            _ => 2.0,
        } * h
            / 3.0;
        let current = outputs.current;
        supplied += weight * (outputs.voltage - 0.6 * current) * current;
        work -= weight * outputs.force * inputs.gap_rate;
        if n < count {
            state = stepped(&magnet, &state, &course.after(f64::from(n) * h), 0.0, h);
        }
    }
    let coil = magnet.electromagnet();
    let field = |gap: f64, current: f64| 0.5 * coil.inductance_at(gap) * current * current;
    let after = at(&course, 4e-3).gap;
    let stored = field(after, magnet.current(&state, after)) - field(0.0083, begin);
    // Simpson and Runge-Kutta at 1 µs are far below rounding: 8000 terms of 0.1 J at most.
    let scale = stored.abs().max(work.abs());
    assert!(scale > 0.05, "{scale}");
    assert!((supplied - stored - work).abs() < 1e-9 * scale, "{supplied} {stored} {work}");
}

/// Voltage and current never leave their ranges, whatever the gap does, and reach all four bounds.
#[test]
fn invariant_limits_are_respected() {
    for (law, operating) in [(Law::Linear, 24.0), (Law::Nonlinear, 14.353)] {
        let (low, high) = (operating - 3.0, operating + 3.0);
        let limits = PowerLimits {
            voltage: Some(Range { min: 0.0, max: 40.0 }),
            current: Some(Range { min: low, max: high }),
        };
        let magnet =
            Magnet::new(MagnetParameters { law, limits, ..MagnetParameters::default() }).unwrap();
        let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
        let mut seen = [false; 4];
        for n in 0..400 {
            let (sin, cos) = (f64::from(n) * 0.05).sin_cos();
            let inputs = MagnetInputs {
                gap: 0.008 + 3e-3 * sin,
                gap_rate: 0.15 * cos,
                acceleration: -7.5 * sin,
                ..nominal()
            };
            state = stepped(&magnet, &state, &InputCourse::constant(&inputs), 0.0, 1e-3);
            let outputs = magnet.outputs(&state, &inputs).unwrap();
            // The current's last bits come from adding operating current and deviation.
            let near = 1e-12;
            assert!((0.0..=40.0).contains(&outputs.voltage), "{outputs:?}");
            assert!((low - near..=high + near).contains(&outputs.current), "{outputs:?}");
            seen[0] |= outputs.voltage == 0.0;
            seen[1] |= outputs.voltage == 40.0;
            seen[2] |= outputs.current < low + near;
            seen[3] |= outputs.current > high - near;
        }
        assert_eq!(seen, [true; 4], "{law:?}");
    }
}

#[test]
fn analytic_a_closing_gap_is_reported_with_its_time() {
    let magnet = nonlinear(5e-5, PowerLimits::default());
    let mut state = start(&magnet);
    let course = InputCourse { gap: [0.008, -1.0, 0.0, 0.0], ..InputCourse::default() };
    let error = magnet.step(&mut state, &course, 3.0, 0.01, &mut Workspace::default());
    match error {
        Err(magnet::Error::GapClosed { time, gap }) => {
            assert!((3.008 - 1e-9..3.0081).contains(&time) && gap <= 0.0, "{time} {gap}");
        }
        other => panic!("{other:?}"),
    }
}

/// The exact step has no look at the gap on its way, but refuses to end on a closed one.
#[test]
fn analytic_a_closing_gap_ends_the_exact_step_too() {
    let magnet = paper();
    let mut state = start(&magnet);
    let course = InputCourse { gap: [0.008, -1.0, 0.0, 0.0], ..InputCourse::default() };
    let error = magnet.step(&mut state, &course, 3.0, 0.01, &mut Workspace::default());
    assert!(matches!(error, Err(magnet::Error::GapClosed { time, .. }) if time == 3.01));
    assert_eq!(state, start(&magnet));
}
