//! Lift loss: one co-energy, its textbook forces, no energy from nothing.
#![allow(clippy::unwrap_used, reason = "a test program")]

use std::f64::consts::FRAC_2_PI;

use magnet::{
    Error, InputCourse, InputRates, Law, LiftLoss, Magnet, MagnetInputs, MagnetParameters, Place,
    Workspace,
};

const WIDTH: f64 = 0.028;
const LOAD: f64 = 5824.6875;

fn law() -> (f64, LiftLoss) {
    let constant = Magnet::new(MagnetParameters::default()).unwrap().electromagnet().constant;
    (constant, LiftLoss::new(constant, WIDTH))
}

fn places() -> impl Iterator<Item = Place> {
    [0.004, 0.008, 0.012]
        .into_iter()
        .flat_map(|gap| [-0.02, -1e-3, 0.0, 5e-3, 0.0279].map(|offset| Place { gap, offset }))
}

/// Central difference of fourth order.
fn slope(f: impl Fn(f64) -> f64, at: f64, h: f64) -> f64 {
    (8.0 * (f(at + h) - f(at - h)) - f(at + 2.0 * h) + f(at - 2.0 * h)) / (12.0 * h)
}

fn near(found: f64, expected: f64, relative: f64, least: f64) {
    assert!((found - expected).abs() <= relative * expected.abs() + least, "{found} {expected}");
}

/// F, F_y and λ are the derivatives of ½·L·i², so their cross derivatives agree. Differences of fourth
/// order over 1e-5 m of functions of the scale 4 mm lose 1e-10; rounding 1e-16/1e-3.
#[test]
fn analytic_cross_derivatives_agree() {
    let (_, law) = law();
    for place @ Place { gap, offset } in places() {
        let i = 17.0;
        let (h, di) = (1e-5, 1e-2);
        let at_gap = |gap| Place { gap, offset };
        let at_offset = |offset| Place { gap, offset };
        let flux = |place, i| law.inductance(place) * i;
        let lambda_c = slope(|c| flux(at_gap(c), i), gap, h);
        let lambda_y = slope(|y| flux(at_offset(y), i), offset, h);
        near(-slope(|i| law.force_of_current(place, i), i, di), lambda_c, 1e-9, 1e-7);
        near(slope(|i| law.lateral_of_current(place, i), i, di), lambda_y, 1e-9, 1e-7);
        let f_y = slope(|y| law.force_of_current(at_offset(y), i), offset, h);
        let side_c = slope(|c| law.lateral_of_current(at_gap(c), i), gap, h);
        near(-f_y, side_c, 1e-9, 1e-3);
        let energy = |place| 0.5 * flux(place, i) * i;
        near(-slope(|c| energy(at_gap(c)), gap, h), law.force_of_current(place, i), 1e-9, 1e-6);
        near(
            slope(|y| energy(at_offset(y)), offset, h),
            law.lateral_of_current(place, i),
            1e-9,
            1e-6,
        );
    }
}

/// The textbook's formulas; a centred magnet is that of the nonlinear law.
#[test]
fn analytic_forces_are_those_of_the_textbook() {
    let (constant, law) = law();
    for place @ Place { gap, offset } in places() {
        let i = 17.0;
        let square = constant * (i / gap) * (i / gap);
        let angle = (offset / gap).atan();
        let lift = square * (1.0 - FRAC_2_PI * offset / WIDTH * angle);
        near(law.force_of_current(place, i), lift, 1e-14, 0.0);
        near(
            law.lateral_of_current(place, i),
            -square * FRAC_2_PI * gap / WIDTH * angle,
            1e-14,
            0.0,
        );
        let flux = law.inductance(place) * i;
        near(law.force_of_flux(place, flux), lift, 1e-14, 0.0);
        near(law.equilibrium_current(place, lift), i, 1e-14, 0.0);
        let [side, stiffness] = magnet::lateral_force_with_loss(lift, gap, offset, WIDTH);
        near(side, law.lateral_of_current(place, i), 1e-13, 1e-12);
        let by_offset = slope(
            |y| magnet::lateral_force_with_loss(lift, gap, y, WIDTH)[0],
            offset.min(0.027),
            1e-6,
        );
        let [_, expected] = magnet::lateral_force_with_loss(lift, gap, offset.min(0.027), WIDTH);
        near(-by_offset, expected, 1e-7, 1e-3);
        assert!(stiffness > 0.0);
    }
    let centred = Place { gap: 0.008, offset: 0.0 };
    assert_eq!(law.inductance(centred), 2.0 * constant / 0.008);
    assert!(magnet::lateral_force_with_loss(1.0, 0.008, WIDTH, WIDTH)[0].is_nan());
}

/// Around a closed loop of places at constant flux, the forces do no work in all.
#[test]
fn invariant_no_energy_comes_from_a_closed_loop() {
    let (_, law) = law();
    let flux = 0.1;
    let mut work = 0.0;
    let n = 400;
    let place = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / n as f64;
        Place { gap: 0.008 + 0.003 * angle.cos(), offset: 0.006 + 0.012 * angle.sin() }
    };
    let mut size = 0.0_f64;
    // the trapezoidal rule of a periodic function converges faster than any power
    for k in 0..n {
        let angle = std::f64::consts::TAU * k as f64 / n as f64;
        let step = std::f64::consts::TAU / n as f64;
        let here = place(k);
        let power = law.force_of_flux(here, flux) * (0.003 * angle.sin())
            + law.lateral_of_flux(here, flux) * (0.012 * angle.cos());
        work += power * step;
        size = size.max(power.abs());
    }
    assert!(work.abs() < 1e-12 * size, "{work} {size}");
}

fn magnet() -> Magnet {
    Magnet::new(MagnetParameters {
        law: Law::Nonlinear,
        lift_loss: true,
        ..MagnetParameters::default()
    })
    .unwrap()
}

fn moving(t: f64) -> InputCourse {
    // cubic polynomials from t on, of one and the same motion
    let gap = [0.008 + 0.02 * t - 0.5 * t * t, 0.02 - t, -1.0, 0.0];
    let offset = [0.004 + 0.3 * t + t * t, 0.3 + 2.0 * t, 2.0, 0.0];
    InputCourse { gap, lateral_offset: offset, ..InputCourse::default() }
}

fn inputs(t: f64) -> MagnetInputs {
    let InputCourse { gap, lateral_offset, .. } = moving(t);
    MagnetInputs {
        gap: gap[0],
        gap_rate: gap[1],
        lateral_offset: lateral_offset[0],
        static_force: LOAD,
        ..MagnetInputs::default()
    }
}

/// ∮ of the terminals' power less heat is the mechanical work plus the change of the field's energy. The
/// work is summed by Simpson's rule over 50 µs: 1e-9 of it.
#[test]
fn invariant_energy_balance_while_the_magnet_moves_aside() {
    let magnet = magnet();
    let law = *magnet.lift_loss().unwrap();
    let mut state = magnet.initialise(&inputs(0.0), 0.0).unwrap();
    let mut work = Workspace::default();
    let (h, steps) = (5e-5, 800);
    let resistance = magnet.electromagnet().resistance;
    let power = |state: &magnet::State, t: f64| {
        let at = inputs(t);
        let out = magnet.outputs(state, &at).unwrap();
        let course = moving(t);
        let electrical = (out.voltage - resistance * out.current) * out.current;
        let mechanical = -out.force * course.gap[1] + out.lateral_force * course.lateral_offset[1];
        let inductance = law.inductance(Place { gap: at.gap, offset: at.lateral_offset });
        (electrical - mechanical, 0.5 * inductance * out.current * out.current, mechanical)
    };
    let (mut sum, mut size) = (0.0, 0.0);
    let (_, before, _) = power(&state, 0.0);
    for n in 0..steps {
        let t = n as f64 * h;
        let (a, _, m) = power(&state, t);
        magnet.step(&mut state, &moving(t), t, 0.5 * h, &mut work).unwrap();
        let (b, ..) = power(&state, t + 0.5 * h);
        magnet.step(&mut state, &moving(t + 0.5 * h), t + 0.5 * h, 0.5 * h, &mut work).unwrap();
        let (c, ..) = power(&state, t + h);
        sum += h / 6.0 * (a + 4.0 * b + c);
        size += h * m.abs();
    }
    let (_, after, _) = power(&state, steps as f64 * h);
    assert!(size > 5.0, "{size} J");
    assert!((after - before - sum).abs() < 1e-8 * size, "{} {sum} {size}", after - before);
}

/// Rates of force and current are those of the course, with and without a limit that holds the current.
#[test]
fn analytic_rates_with_lift_loss() {
    for limit in [None, Some(magnet::Range { min: 0.0, max: 14.0 })] {
        let mut parameters = *magnet().parameters();
        parameters.limits.current = limit;
        let magnet = Magnet::new(parameters).unwrap();
        let start = magnet.initialise(&inputs(0.0), 0.0).unwrap();
        let (t, d) = (0.02, 1e-5);
        let at = |time: f64| {
            let (mut state, mut work) = (start, Workspace::default());
            magnet.step(&mut state, &moving(0.0), 0.0, time, &mut work).unwrap();
            (state, magnet.outputs(&state, &inputs(time)).unwrap())
        };
        let (state, now) = at(t);
        let ((_, before), (_, after)) = (at(t - d), at(t + d));
        let rates = InputRates {
            gap_acceleration: -1.0,
            offset_rate: moving(t).lateral_offset[1],
            offset_acceleration: 2.0,
            ..InputRates::default()
        };
        let input_rates = rates;
        let rates = magnet.rates(&state, &inputs(t), &input_rates).unwrap();
        let [aside, second] =
            magnet.lateral_rates(&state, &inputs(t), &input_rates, &rates).unwrap();
        near((after.lateral_force - before.lateral_force) / (2.0 * d), aside, 1e-5, 1e-2);
        let sideways = |it: &magnet::MagnetOutputs| it.lateral_force;
        let bend = (sideways(&after) - 2.0 * sideways(&now) + sideways(&before)) / (d * d);
        near(bend, second, 1e-3, 1e3);
        near((after.force - before.force) / (2.0 * d), rates.force, 1e-5, 1e-2);
        near((after.current - before.current) / (2.0 * d), rates.current, 1e-5, 1e-6);
        let bend = (after.force - 2.0 * now.force + before.force) / (d * d);
        near(bend, rates.force_second, 1e-3, 1e3);
        assert_eq!(limit.is_some(), rates.current == 0.0);
    }
}

/// At rest aside the magnet carries its load; beyond a pole's width there is no law.
#[test]
fn issue_20_start_and_limit() {
    let magnet = magnet();
    let aside = MagnetInputs {
        gap: 0.008,
        lateral_offset: 0.012,
        static_force: LOAD,
        ..MagnetInputs::default()
    };
    let state = magnet.initialise(&aside, 0.0).unwrap();
    let now = magnet.outputs(&state, &aside).unwrap();
    near(now.force, LOAD, 1e-13, 0.0);
    near(
        now.lateral_force,
        magnet::lateral_force_with_loss(LOAD, 0.008, 0.012, WIDTH)[0],
        1e-12,
        0.0,
    );
    let lost = MagnetInputs { lateral_offset: -WIDTH, ..aside };
    assert!(matches!(magnet.initialise(&lost, 0.0), Err(Error::GuidanceLost { .. })));
    let mut moved = state;
    let course = InputCourse::constant(&lost);
    let error = magnet.step(&mut moved, &course, 0.5, 1e-3, &mut Workspace::default()).unwrap_err();
    assert_eq!(moved, state);
    assert!(error.to_string().contains("at t = 0.5 s the magnet is -0.028 m aside"), "{error}");
}
