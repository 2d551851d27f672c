//! Every gain, every filter constant and every law with numbers of its own. Table 2 and eqs 3-5 have
//! equal numbers in several places (k₂ = k₄, k₁ = k₅, ζ_c = ζ_v, ω_v = ω_p), which exchange unnoticed.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{nominal, stepped};
use magnet::{
    Controller, Electromagnet, FilterDesign, Gains, InputCourse, Law, Magnet, MagnetInputs,
    MagnetParameters, Sampling, State,
};

const GAINS: Gains =
    Gains { acceleration: 2.0, velocity: 3.0, position: 5.0, gap_velocity: 7.0, gap: 11.0 };
const DESIGN: FilterDesign = FilterDesign {
    gap_cutoff: 900.0,
    gap_damping: 0.6,
    velocity_cutoff: 12.0,
    velocity_damping: 0.7,
    position_cutoff: 9.0,
};

fn parameters() -> MagnetParameters {
    MagnetParameters {
        control: Controller { gains: GAINS, sampling: None },
        filter: DESIGN,
        ..MagnetParameters::default()
    }
}

fn close(value: f64, expected: f64) {
    assert!((value - expected).abs() <= 1e-13 * expected.abs(), "{value} is not {expected}");
}

/// K = μ₀AN²/4 of table 2, in N·m²/A².
fn constant() -> f64 {
    std::f64::consts::PI * 1e-7 * 0.036 * 400.0 * 400.0
}

/// Δv = k₁y₃ + k₂y₄ + k₃y₅ + k₄y₂ + k₅y₁ (eq. 3), with each gain alone and with all, for a filter
/// state in which all estimates differ: in the voltage of the outputs, continuous and sampled, and in
/// the linear system.
#[test]
fn issue_14_each_gain_acts_on_its_own_estimate() {
    let x = [1.0, 20.0, 300.0, 4e3, 5e4];
    let acceleration = 0.4;
    // y₃ = u₂ + (2ζ_vω_v/10)·(x₂ − x₄) − x₃ with u₂ = 0.25·q̈
    let y3 = 0.25 * acceleration + 2.0 * 0.7 * 12.0 / 10.0 * (x[1] - x[3]) - x[2];
    let zero =
        Gains { acceleration: 0.0, velocity: 0.0, position: 0.0, gap_velocity: 0.0, gap: 0.0 };
    for (gains, expected) in [
        (Gains { acceleration: 2.0, ..zero }, 2.0 * y3),
        (Gains { velocity: 3.0, ..zero }, 3.0 * 4e3),
        (Gains { position: 5.0, ..zero }, 5.0 * 5e4),
        (Gains { gap_velocity: 7.0, ..zero }, 7.0 * 20.0),
        (Gains { gap: 11.0, ..zero }, 11.0),
        (GAINS, 2.0 * y3 + 3.0 * 4e3 + 5.0 * 5e4 + 7.0 * 20.0 + 11.0),
    ] {
        for sampling in [None, Some(Sampling { period: 1e-3, delay: 0 })] {
            let control = Controller { gains, sampling };
            let magnet = Magnet::new(MagnetParameters { control, ..parameters() }).unwrap();
            let inputs = MagnetInputs { acceleration, ..nominal() };
            let start = magnet.initialise(&inputs, 0.0).unwrap();
            let state = State { filter: x, ..start };
            let outputs = magnet.outputs(&state, &inputs).unwrap();
            close(outputs.estimates[2], y3);
            let voltage = if sampling.is_none() {
                outputs.voltage
            } else {
                // the sample at the start of a step holds over it
                let course = InputCourse::constant(&inputs);
                let later = stepped(&magnet, &state, &course, 0.0, 1e-7);
                magnet.outputs(&later, &inputs).unwrap().voltage
            };
            close(voltage - 0.6 * 24.0, expected);
        }
        let magnet = Magnet::new(MagnetParameters {
            control: Controller { gains, sampling: None },
            ..parameters()
        })
        .unwrap();
        let system = magnet.linear_system();
        let by_state: f64 = system.a[5][..5].iter().zip(x).map(|(k, x)| k * x).sum();
        close(by_state + system.b[5][1] * acceleration, expected);
    }
}

/// The rate of Δλ in a short exact step is Δv − R·Δi with eq. 3's Δv.
#[test]
fn issue_14_each_gain_acts_in_an_exact_step() {
    let magnet = Magnet::new(parameters()).unwrap();
    let start = magnet.initialise(&nominal(), 0.0).unwrap();
    // a filter that rests but for its outputs moves little in a step of 0.1 µs
    let x = [0.3, 0.02, -0.1, 0.04, 0.5];
    let state = State { filter: x, ..start };
    let h = 1e-7;
    let later = stepped(&magnet, &state, &InputCourse::constant(&nominal()), 0.0, h);
    let y3 = 1.68 * (x[1] - x[3]) - x[2];
    let expected = 2.0 * y3 + 3.0 * x[3] + 5.0 * x[4] + 7.0 * x[1] + 11.0 * x[0];
    let rate = (later.flux_deviation - state.flux_deviation) / h;
    // x₂ changes at 8100/s·0.3: half of that in the mean, times k₄ and k₁·1.68, is 1.3e-3 V
    assert!((rate - expected).abs() < 2e-3, "{rate} is not {expected}");
}

/// Eqs 4 and 5 for a design in which no two constants are equal, entry by entry from the equations.
#[test]
fn issue_14_each_filter_constant_has_its_place() {
    let filter = *Magnet::new(parameters()).unwrap().filter();
    let a = [
        [0.0, 100.0, 0.0, 0.0, 0.0],
        [-900.0 * 900.0 / 100.0, -2.0 * 0.6 * 900.0, 0.0, 0.0, 0.0],
        [0.0, -14.4, 0.0, 14.4, 0.0],
        [0.0, 16.8, -10.0, -16.8, 0.0],
        [0.0, 0.0, 0.0, 100.0, -9.0],
    ];
    let b = [[0.0, 0.0], [8100.0, 0.0], [0.0, 0.0], [0.0, 10.0], [9.0, 0.0]];
    let c = [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 1.68, -1.0, -1.68, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0],
    ];
    for (found, expected) in filter.a.iter().zip(&a).chain(filter.c.iter().zip(&c)) {
        found.iter().zip(expected).for_each(|(f, e)| close(*f, *e));
    }
    for (found, expected) in filter.b.iter().zip(&b) {
        found.iter().zip(expected).for_each(|(f, e)| close(*f, *e));
    }
    // at rest on a gap that opens steadily, x₅ = x₁ + 100/ω_p·x₄
    let x = filter.rest(4e-4, 0.02, 0.8);
    for (found, expected) in x.iter().zip([0.1, 0.05, 0.2, 0.05, 0.1 + 100.0 / 9.0 * 0.05]) {
        close(*found, expected);
    }
    assert_eq!(DESIGN.fastest_rate(), 900.0);
    // the faster of two real poles, ω(ζ + √(ζ² − 1)), of each pair
    close((FilterDesign { gap_damping: 1.25, ..DESIGN }).fastest_rate(), 1800.0);
    close(
        (FilterDesign { velocity_cutoff: 1e3, velocity_damping: 1.25, ..DESIGN }).fastest_rate(),
        2e3,
    );
    close((FilterDesign { velocity_cutoff: 1e3, ..DESIGN }).fastest_rate(), 1e3);
    close((FilterDesign { position_cutoff: 3e3, ..DESIGN }).fastest_rate(), 3e3);
}

fn coil(law: Law) -> Electromagnet {
    Electromagnet::new(&MagnetParameters { law, ..MagnetParameters::default() })
}

/// Eq. 1 and F = K(i/c)², with their slopes, at a point off the operating point.
#[test]
fn analytic_force_and_its_slopes_in_both_laws() {
    let (gap, operating, deviation, load) = (0.0076, 20.0, -1.5, 5000.0);
    let (k, i0, c0) = (constant(), 24.0, 0.008);
    let (by_current, by_gap) = (2.0 * k * i0 / (c0 * c0), 2.0 * k * i0 * i0 / (c0 * c0 * c0));
    let linear = coil(Law::Linear);
    close(linear.force(gap, operating, deviation, load), load - 1.5 * by_current + 4e-4 * by_gap);
    let (dc, di) = linear.force_gradient(gap, 18.5);
    close(dc, -by_gap);
    close(di, by_current);

    let nonlinear = coil(Law::Nonlinear);
    let force = k * (18.5 / gap) * (18.5 / gap);
    close(nonlinear.force(gap, operating, deviation, load), force);
    let (dc, di) = nonlinear.force_gradient(gap, 18.5);
    close(dc, -2.0 * force / gap);
    close(di, 2.0 * force / 18.5);
}

/// Flux, current and force belong together in both laws: λ = L(c)·i, F = λ²/(4K); in the linear one
/// Δλ = L₀(Δi − (k_c/kᵢ)Δc).
#[test]
fn analytic_flux_and_current_in_both_laws() {
    let (gap, operating, deviation, load) = (0.0076, 20.0, -1.5, 5000.0);
    let (k, c0) = (constant(), 0.008);
    for law in [Law::Linear, Law::Nonlinear] {
        let magnet = coil(law);
        let flux = magnet.flux_of_current(gap, operating, deviation);
        let expected = match law {
            Law::Linear => 2.0 * k / c0 * (deviation - 24.0 / c0 * (gap - c0)),
            Law::Nonlinear => 2.0 * k * ((operating + deviation) / gap - operating / c0),
        };
        close(flux, expected);
        close(magnet.current_of_flux(gap, operating, flux), deviation);
        let force = magnet.force(gap, operating, deviation, load);
        close(magnet.force_of_flux(operating, flux, load), force);
        let gap_of = if law == Law::Linear { c0 } else { gap };
        close(magnet.inductance_at(gap), 2.0 * k / gap_of);
    }
}

/// v = R·i + d(L·i)/dt solved for di/dt: (v − R·i)/L + (i/c)·ċ, in eq. 2 with i₀/c₀ and L₀.
#[test]
fn analytic_current_rate_in_both_laws() {
    let (gap, gap_rate, current, voltage) = (0.0074, 0.03, 18.5, 40.0);
    let k = constant();
    let linear = (voltage - 0.6 * current) / (2.0 * k / 0.008) + 24.0 / 0.008 * gap_rate;
    close(coil(Law::Linear).current_rate(gap, gap_rate, current, voltage), linear);
    let nonlinear = (voltage - 0.6 * current) / (2.0 * k / gap) + current / gap * gap_rate;
    close(coil(Law::Nonlinear).current_rate(gap, gap_rate, current, voltage), nonlinear);
    close(coil(Law::Linear).current_by_gap(gap, current), 24.0 / 0.008);
    close(coil(Law::Nonlinear).current_by_gap(gap, current), current / gap);
}

/// The lateral force restores with the stiffness 2F/(πw)·c²/(c² + y²), on either side of the rail.
#[test]
fn analytic_lateral_stiffness_off_the_centre() {
    let (force, gap, width) = (5000.0, 0.0076, 0.028);
    for offset in [0.0, 0.004, -0.011] {
        let expected = 2.0 * force / (std::f64::consts::PI * width) * gap * gap
            / (gap * gap + offset * offset);
        close(magnet::lateral_stiffness(force, gap, offset, width), expected);
    }
}
