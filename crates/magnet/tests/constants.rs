//! The numbers that follow from table 2 and eqs 3-5 by hand.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{LOAD, nominal, paper};
use magnet::{
    Electromagnet, Filter, Magnet, MagnetInputs, MagnetParameters, filter_design_of_eq_4,
};

fn close(value: f64, expected: f64, relative: f64) {
    assert!((value - expected).abs() <= relative * expected.abs(), "{value} is not {expected}");
}

/// Printed numbers carry five to six digits: half a unit of the last is the tolerance.
#[test]
fn analytic_constants_of_table_2() {
    let magnet = Electromagnet::new(&MagnetParameters::default());
    close(magnet.inductance, 0.452389, 1.2e-6);
    close(magnet.current_stiffness, 1357.17, 4e-6);
    close(magnet.gap_stiffness, 4.0715e6, 1.3e-5);
    close(magnet.nominal_force, 16_286.0, 3.1e-5);
    close(magnet.equilibrium_current(LOAD, 0.008), 14.353, 3.5e-5);
    // F = kᵢ·i₀/2 = k_c·c₀/2 for a force that goes with (i/c)².
    close(magnet.nominal_force, magnet.current_stiffness * 24.0 / 2.0, 1e-14);
    close(magnet.nominal_force, magnet.gap_stiffness * 0.008 / 2.0, 1e-14);
}

/// Eqs 4 and 5 as printed, entry by entry. The design's arithmetic is exact in these numbers.
#[test]
fn analytic_filter_design_gives_eq_4_and_eq_5() {
    let filter = Filter::new(&filter_design_of_eq_4());
    let expected = Filter {
        a: [
            [0.0, 100.0, 0.0, 0.0, 0.0],
            [-1e4, -1e3, 0.0, 0.0, 0.0],
            [0.0, -10.0, 0.0, 10.0, 0.0],
            [0.0, 10.0, -10.0, -10.0, 0.0],
            [0.0, 0.0, 0.0, 100.0, -10.0],
        ],
        b: [[0.0, 0.0], [1e4, 0.0], [0.0, 0.0], [0.0, 10.0], [10.0, 0.0]],
        c: [
            [1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, -1.0, -1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
        ],
        d: [[0.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]],
    };
    assert_eq!(filter, expected);
}

/// Each gain acts on the estimate that eq. 3 names: y₃, y₄, y₅, y₂, y₁ in this order. A control
/// law in eq. 5's order would put 7 on the gap and 7 on the position the other way round and fails.
#[test]
fn analytic_gains_act_in_the_order_of_eq_3() {
    let magnet = paper();
    let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
    let rest = magnet.outputs(&state, &nominal()).unwrap().voltage;
    state.filter = [1.0, 20.0, 300.0, 4e3, 5e4];
    let outputs = magnet.outputs(&state, &nominal()).unwrap();
    let [y1, y2, y3, y4, y5] = outputs.estimates;
    assert_eq!([y1, y2, y4, y5], [1.0, 20.0, 4e3, 5e4]);
    assert_eq!(y3, 20.0 - 300.0 - 4e3);
    let expected = 7.0 * y3 + 40.0 * y4 + 4.0 * y5 + 40.0 * y2 + 7.0 * y1;
    // Sums of six terms of up to 2e5: a few roundings of 3e-11.
    assert!((outputs.voltage - rest - expected).abs() < 1e-9);
}

#[test]
fn analytic_nominal_gap_carries_the_static_force_at_rest() {
    let magnet = paper();
    let state = magnet.initialise(&nominal(), 0.0).unwrap();
    let outputs = magnet.outputs(&state, &nominal()).unwrap();
    assert_eq!(outputs.force, LOAD);
    assert_eq!(outputs.current, 24.0);
    assert_eq!(outputs.lateral_force, 0.0);
    close(outputs.voltage, 0.6 * 24.0, 1e-15);
}

/// A start off the nominal gap rests: nothing moves as long as the inputs stay, and the force has
/// grown by the static stiffness kᵢ·(k₃+k₅)·250/R − k_c.
#[test]
fn analytic_start_off_the_nominal_gap_is_an_equilibrium() {
    let magnet = paper();
    let deviation = 3e-4;
    let inputs = MagnetInputs { gap: 0.008 + deviation, acceleration: 0.7, ..nominal() };
    let state = magnet.initialise(&inputs, 0.0).unwrap();
    let coil = magnet.electromagnet();
    let stiffness = coil.current_stiffness * 11.0 * 250.0 / 0.6 - coil.gap_stiffness;
    let force = magnet.outputs(&state, &inputs).unwrap().force;
    close(force - LOAD, stiffness * deviation, 1e-11);

    let later =
        common::stepped(&magnet, &state, &magnet::InputCourse::constant(&inputs), 0.0, 0.01);
    // Rounding of Φ + Γ against the identity: some tens of roundings.
    assert!(common::distance(&state, &later) < 1e-13);
}

/// Whatever moves the magnet, its filter starts on the motion: y₁ = 250·Δc, y₂ = 2.5·ċ and its
/// derivative x₁' = 250·ċ.
#[test]
fn analytic_start_with_a_moving_gap_follows_the_motion() {
    let magnet = paper();
    let inputs = MagnetInputs { gap: 0.0081, gap_rate: 0.004, acceleration: 0.5, ..nominal() };
    let state = magnet.initialise(&inputs, 0.0).unwrap();
    let y = magnet.outputs(&state, &inputs).unwrap().estimates;
    close(y[0], 250.0 * 1e-4, 1e-11);
    close(y[1], 2.5 * 0.004, 1e-15);
    // Sum of four terms of up to 0.125.
    assert!(y[2].abs() < 1e-16);
    close(y[3], 2.5 * 0.004, 1e-15);
    let rates = magnet.filter().rates(&state.filter, inputs.gap - 0.008, inputs.acceleration);
    close(rates[0], 250.0 * 0.004, 1e-15);
    for rate in &rates[2..] {
        assert!(rate.abs() < 1e-13, "{rates:?}");
    }
}

/// The coil starts with the current of the gap alone, however the gap moves: the load is carried. A
/// current of Δv/R with the rates' part of Δv would be off by 300·ċ/R = 2 A, or 2.7 kN, here.
#[test]
fn analytic_start_with_a_moving_gap_carries_the_load() {
    let magnet = paper();
    let still = MagnetInputs { gap: 0.0081, ..nominal() };
    let moving = MagnetInputs { gap_rate: 0.004, acceleration: 0.5, ..still };
    let force = |inputs: &MagnetInputs| {
        magnet.outputs(&magnet.initialise(inputs, 0.0).unwrap(), inputs).unwrap().force
    };
    assert_eq!(force(&moving), force(&still));
}

/// Small offsets: stiffness 2F/(πw), the first term of atan; the next is (y/c)²/3 of it.
#[test]
fn analytic_lateral_stiffness() {
    let (force, gap, width, offset) = (LOAD, 0.008, 0.028, 8e-6);
    let expected = -2.0 * force / (std::f64::consts::PI * width) * offset;
    let relative: f64 = (offset / gap) * (offset / gap) / 3.0;
    close(magnet::lateral_force(force, gap, offset, width), expected, 1.01 * relative);
    assert_eq!(
        magnet::lateral_force(force, gap, -offset, width),
        -magnet::lateral_force(force, gap, offset, width)
    );
}

/// Far off, c ≪ y ≪ w: the virtual work of the lost overlap, F·c/w. atan falls short of π/2 by c/y.
#[test]
fn analytic_lateral_force_far_off_is_the_virtual_work_of_the_overlap() {
    let (force, gap, width, offset) = (LOAD, 1e-5, 0.1, 0.01);
    let relative = 2.0 / std::f64::consts::PI * gap / offset;
    close(magnet::lateral_force(force, gap, offset, width), -force * gap / width, 1.01 * relative);
}

#[test]
fn analytic_lateral_force_can_be_switched_off() {
    let inputs = MagnetInputs { lateral_offset: 0.003, ..nominal() };
    let with = paper();
    let without =
        Magnet::new(MagnetParameters { pole_width: None, ..MagnetParameters::default() }).unwrap();
    let state = with.initialise(&inputs, 0.0).unwrap();
    assert!(with.outputs(&state, &inputs).unwrap().lateral_force < 0.0);
    assert_eq!(without.outputs(&state, &inputs).unwrap().lateral_force, 0.0);
}

/// A filter too fast for the integration step is refused where that step is used, and only there.
#[test]
fn analytic_integration_step_is_held_against_the_fastest_rate() {
    let mut parameters = MagnetParameters::default();
    parameters.filter.gap_cutoff = 2e4;
    assert!(Magnet::new(parameters).is_ok());
    parameters.law = magnet::Law::Nonlinear;
    let Err(magnet::Error::CoarseIntegration { rate, longest, .. }) = Magnet::new(parameters)
    else {
        panic!("accepted");
    };
    assert_eq!((rate, longest), (2e4, 2.5e-5));
    parameters.integration_step = longest;
    assert!(Magnet::new(parameters).is_ok());
}

/// Every number that leaves its range is named in the message.
#[test]
fn analytic_impossible_parameters_are_refused() {
    let refused = |change: fn(&mut MagnetParameters)| {
        let mut parameters = MagnetParameters::default();
        change(&mut parameters);
        Magnet::new(parameters).unwrap_err().to_string()
    };
    for (name, message) in [
        ("turns", refused(|p| p.turns = 0.0)),
        ("pole area", refused(|p| p.pole_area = -1.0)),
        ("resistance", refused(|p| p.resistance = f64::NAN)),
        ("nominal gap", refused(|p| p.nominal_gap = f64::INFINITY)),
        ("integration step", refused(|p| p.integration_step = 1e-300)),
        ("pole width", refused(|p| p.pole_width = Some(0.0))),
        ("gain on the gap velocity", refused(|p| p.control.gains.gap_velocity = f64::NAN)),
        ("damping ratio of the gap filter", refused(|p| p.filter.gap_damping = 0.0)),
        (
            "upper current limit",
            refused(|p| p.limits.current = Some(magnet::Range { min: 2.0, max: 1.0 })),
        ),
        (
            "sample time",
            refused(|p| {
                p.control.sampling = Some(magnet::Sampling { period: -1e-3, delay: 0 });
            }),
        ),
    ] {
        assert!(message.starts_with(name), "{message}");
    }
}
