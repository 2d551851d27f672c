//! The exact integration of the linear magnet.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{distance, lively, nominal, paper, stepped, vector};
use magnet::{
    InputCourse, Magnet, MagnetInputs, MagnetParameters, PowerLimits, Range, State, Workspace,
};
use proptest::prelude::*;

/// Eqs 2, 3, 4 and 5 with table 2's numbers, written down once more, line by line, with eq. 2's
/// current in its own form: Δi' needs the gap's rate.
fn rates(z: &[f64; 6], gap: f64, gap_rate: f64, acceleration: f64) -> [f64; 6] {
    let [x1, x2, x3, x4, x5, current] = *z;
    let (u1, u2) = (250.0 * (gap - 0.008), 0.25 * acceleration);
    let voltage = 7.0 * (x2 - x3 - x4 + u2) + 40.0 * x4 + 4.0 * x5 + 40.0 * x2 + 7.0 * x1;
    let mu_0 = 4e-7 * std::f64::consts::PI;
    let inductance = mu_0 * 400.0 * 400.0 * 0.036 / (2.0 * 0.008);
    [
        100.0 * x2,
        -1e4 * x1 - 1e3 * x2 + 1e4 * u1,
        -10.0 * x2 + 10.0 * x4,
        10.0 * x2 - 10.0 * x3 - 10.0 * x4 + 10.0 * u2,
        100.0 * x4 - 10.0 * x5 + 10.0 * u1,
        24.0 / 0.008 * gap_rate - 0.6 / inductance * current + voltage / inductance,
    ]
}

fn polynomial(u: &[f64; 4], t: f64) -> f64 {
    u[0] + u[1] * t + u[2] * t * t / 2.0 + u[3] * t * t * t / 6.0
}

/// Classical Runge-Kutta on the equations above: x₁ … x₅ and Δi, from and to x₁ … x₅ and Δλ.
fn reference(state: &State, course: &InputCourse, size: f64, count: usize) -> [f64; 6] {
    let coil = *paper().electromagnet();
    let [gap, after] = [0.0, size].map(|t| polynomial(&course.gap, t));
    let mut z = vector(state);
    z[5] = coil.current_of_flux(gap, 24.0, z[5]);
    let h = size / count as f64;
    let f = |z: &[f64; 6], t: f64| {
        let c = &course.gap;
        let gap_rate = c[1] + c[2] * t + c[3] * t * t / 2.0;
        rates(z, polynomial(c, t), gap_rate, polynomial(&course.acceleration, t))
    };
    let along = |z: &[f64; 6], k: &[f64; 6], h: f64| std::array::from_fn(|j| z[j] + h * k[j]);
    for n in 0..count {
        let t = n as f64 * h;
        let k1 = f(&z, t);
        let k2 = f(&along(&z, &k1, h / 2.0), t + h / 2.0);
        let k3 = f(&along(&z, &k2, h / 2.0), t + h / 2.0);
        let k4 = f(&along(&z, &k3, h), t + h);
        for j in 0..6 {
            z[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]);
        }
    }
    z[5] = coil.flux_of_current(after, 24.0, z[5]);
    z
}

fn start(magnet: &Magnet) -> State {
    let mut state = magnet.initialise(&MagnetInputs { gap: 0.0083, ..nominal() }, 0.0).unwrap();
    state.flux_deviation += 0.2;
    state.filter[1] += 0.1;
    state
}

/// The claim of exactness for inputs of third order, for steps from 10 µs to 50 ms. The reference
/// takes steps of 1 µs at the fastest rate of 1000 1/s, so its error is 50·(1e-3)⁵/120·1e3 < 1e-12
/// of the states; 5e4 steps add rounding of the same size.
#[test]
fn analytic_step_agrees_with_an_independent_reference() {
    let magnet = paper();
    let state = start(&magnet);
    for size in [1e-5, 1e-3, 5e-3, 0.05] {
        let z = vector(&stepped(&magnet, &state, &lively(), 0.0, size));
        let expected = reference(&state, &lively(), size, (size / 1e-6).round() as usize);
        let scale = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (z, expected) in z.iter().zip(&expected) {
            assert!((z - expected).abs() < 4e-12 * scale, "{size}: {z} is not {expected}");
        }
    }
}

/// One step of 10 s is as exact as 10,000 steps of 1 ms.
#[test]
fn analytic_one_long_step_equals_many_short_ones() {
    let magnet = paper();
    let start = start(&magnet);
    let course = InputCourse { gap: [0.0083, 1e-5, 2e-7, -1e-8], ..InputCourse::default() };
    let mut many = start;
    let mut workspace = Workspace::default();
    for n in 0..10_000 {
        let rest = course.after(f64::from(n) * 1e-3);
        magnet.step(&mut many, &rest, 0.0, 1e-3, &mut workspace).unwrap();
    }
    let one = stepped(&magnet, &start, &course, 0.0, 10.0);
    // The exponential of a matrix of norm 1e5 is squared 16 times, each squaring doubling the
    // relative rounding: 2¹⁶·1.1e-16 = 7e-12.
    assert!(distance(&one, &many) < 2e-11, "{}", distance(&one, &many));
}

proptest! {
    /// A step may be cut anywhere, any number of times. Each piece rounds like a product of 18
    /// terms with a matrix whose own error is some roundings of its norm (e^{‖A‖h}, up to 1e2):
    /// 1e-12 leaves room for twelve pieces, and a wrong coefficient Γₖ shows at 1e-3 and more.
    #[test]
    fn invariant_splitting_a_step_changes_nothing(
        size in 1e-5..0.02_f64,
        cuts in prop::collection::vec(0.001..0.999_f64, 0..12),
    ) {
        let magnet = paper();
        let start = start(&magnet);
        let whole = stepped(&magnet, &start, &lively(), 0.0, size);
        let mut places: Vec<f64> = cuts.iter().map(|c| c * size).collect();
        places.push(size);
        places.sort_by(f64::total_cmp);
        let (mut at, mut pieces) = (0.0, start);
        for end in places {
            if end > at {
                pieces = stepped(&magnet, &pieces, &lively().after(at), at, end - at);
                at = end;
            }
        }
        prop_assert!(distance(&whole, &pieces) < 1e-12, "{}", distance(&whole, &pieces));
    }

    /// The map is linear in states and inputs: any combination of two runs is the run of the
    /// combination.
    #[test]
    fn invariant_superposition(a in -2.0..2.0_f64, b in -2.0..2.0_f64, size in 1e-4..0.01_f64) {
        let magnet = paper();
        let about = |c: f64, x: f64, d: f64| {
            let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
            state.filter = [x, 2.0 * x, -x, 0.5 * x, x];
            state.flux_deviation = d;
            let course = InputCourse {
                gap: [0.008 + c * 1e-3, c * 0.01, 0.0, 0.0],
                acceleration: [-c, c * 10.0, 0.0, 0.0],
                ..InputCourse::default()
            };
            vector(&stepped(&magnet, &state, &course, 0.0, size))
        };
        let (first, second) = (about(1.0, 0.3, 0.2), about(-0.5, 0.1, 1.0));
        let sum = about(a - 0.5 * b, 0.3 * a + 0.1 * b, 0.2 * a + b);
        for j in 0..6 {
            prop_assert!((sum[j] - a * first[j] - b * second[j]).abs() < 1e-12);
        }
    }
}

/// A cached map gives the bits of a fresh one, in whatever order step sizes come, how many there
/// are, and which magnets share the workspace.
#[test]
fn invariant_workspace_does_not_change_a_bit() {
    let magnet = paper();
    let mut parameters = MagnetParameters::default();
    parameters.control.gains.velocity = 55.0;
    let other = Magnet::new(parameters).unwrap();
    let sizes: Vec<f64> = (1..=11).map(|n| f64::from(n) * 1.7e-4).collect();
    let mut shared = Workspace::default();
    let (mut warm, mut cold) = ([start(&magnet); 2], [start(&magnet); 2]);
    for n in 0..200_usize {
        let size = sizes[(n * n + n / 3) % sizes.len()];
        let course = lively().after(1e-4 * (n % 7) as f64);
        for (k, magnet) in [&magnet, &other].into_iter().enumerate() {
            magnet.step(&mut warm[k], &course, 0.0, size, &mut shared).unwrap();
            magnet.step(&mut cold[k], &course, 0.0, size, &mut Workspace::default()).unwrap();
        }
    }
    for (warm, cold) in warm.iter().zip(&cold) {
        assert_eq!(vector(warm).map(f64::to_bits), vector(cold).map(f64::to_bits));
    }
    assert_ne!(vector(&warm[0]), vector(&warm[1]));
}

/// Limits that never act lead through the Runge-Kutta path; it must find the same course.
#[test]
fn invariant_limits_out_of_reach_change_nothing() {
    let far = Some(Range { min: -1e6, max: 1e6 });
    let limits = PowerLimits { voltage: far, current: far };
    let limited = Magnet::new(MagnetParameters { limits, ..MagnetParameters::default() }).unwrap();
    assert!(!limited.is_exact());
    let magnet = paper();
    let state = start(&magnet);
    let exact = stepped(&magnet, &state, &lively(), 0.0, 0.01);
    let other = stepped(&limited, &state, &lively(), 0.0, 0.01);
    // 50 µs at 1000 1/s: 200 steps of an error of 0.05⁵/120 = 2.6e-9 each, the fast ones damped
    // within 40 steps: 1e-7.
    assert!(distance(&exact, &other) < 1e-7, "{}", distance(&exact, &other));
}

#[test]
fn analytic_bad_steps_are_refused_and_leave_the_state() {
    let magnet = paper();
    let start = start(&magnet);
    let mut workspace = Workspace::default();
    let mut closing = lively();
    closing.gap[0] = 0.0;
    let mut undefined = lively();
    undefined.acceleration[2] = f64::NAN;
    for (course, size) in [(closing, 1e-3), (undefined, 1e-3), (lively(), 0.0), (lively(), -1.0)] {
        let mut state = start;
        assert!(magnet.step(&mut state, &course, 0.0, size, &mut workspace).is_err());
        assert_eq!(state, start);
    }
}

/// Inputs of fifth order: one step is what many small steps along the same polynomials are, in each of which
/// they are cubic to rounding.
#[test]
fn analytic_inputs_of_fifth_order_are_exact() {
    use magnet::FurtherCourse;
    let course = InputCourse {
        gap: [0.0083, 0.02, -3.0, 400.0],
        acceleration: [1.0, 300.0, -4e4, 3e6],
        further: FurtherCourse {
            gap: [-6e4, 8e6],
            acceleration: [-5e8, 6e10],
            ..FurtherCourse::default()
        },
        ..InputCourse::default()
    };
    let magnet = Magnet::new(MagnetParameters::default()).unwrap();
    let begin = magnet.initialise(&nominal(), 0.0).unwrap();
    let size = 0.01;
    let whole = stepped(&magnet, &begin, &course, 0.0, size);
    let mut parts = begin;
    for n in 0..1000 {
        let time = f64::from(n) * size / 1000.0;
        let mut part = course.after(time);
        part.further = FurtherCourse::default();
        parts = stepped(&magnet, &parts, &part, time, size / 1000.0);
    }
    let cubic = InputCourse { further: FurtherCourse::default(), ..course };
    let cubic = stepped(&magnet, &begin, &cubic, 0.0, size);
    let (whole, parts, cubic) = (vector(&whole), vector(&parts), vector(&cubic));
    for j in 0..6 {
        let effect = (parts[j] - cubic[j]).abs();
        assert!((whole[j] - parts[j]).abs() < 1e-6 * effect, "{j}: {whole:?} {parts:?} {cubic:?}");
    }
}
