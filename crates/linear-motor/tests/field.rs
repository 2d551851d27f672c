//! The field theory against closed forms, an independent solution of its equation, and its power balance.
#![allow(clippy::unwrap_used, reason = "a test program")]

use std::f64::consts::{PI, SQRT_2, TAU};

use linear_motor::{Circuit, Feed, Field, FieldDescription};
use nalgebra::Complex;

const MU_0: f64 = 4e-7 * PI;
const PITCH: f64 = 0.2;
const WAVE: f64 = PI / PITCH;
const GAP: f64 = 0.01;
const DATA: FieldDescription = FieldDescription {
    pole_pairs: 4,
    width: 0.22,
    overhang: 0.05,
    turns: 48.0,
    winding_factor: 0.92,
    carter_factor: 1.1,
    sheet_thickness: 0.004,
    sheet_resistivity: 3.3e-8,
};
const CURRENT: f64 = 300.0;

fn motor(pole_pairs: u32) -> Field {
    // turns in proportion, so that the current sheet is the same
    let turns = DATA.turns * f64::from(pole_pairs) / f64::from(DATA.pole_pairs);
    Field::new(&FieldDescription { pole_pairs, turns, ..DATA }, PITCH)
}

/// The feed with a slip frequency (Hz) at a speed.
fn feed(slip: f64, speed: f64) -> Feed {
    Feed { current: CURRENT, frequency: speed / (2.0 * PITCH) + slip }
}

fn circuit_thrust(circuit: Circuit, current: f64, slip: f64) -> f64 {
    let (x, r) = (TAU * slip * circuit.magnetising, circuit.secondary);
    3.0 * current * current * WAVE * circuit.magnetising * x * r / (r * r + x * x)
}

/// A motor of 2000 pole pairs, where the ends are nothing, is its equivalent circuit: thrust at any slip, largest
/// thrust at ω_s = R/L, none at synchronous speed; half the stress at the balance speed of the normal force.
#[test]
fn analytic_a_long_motor_is_its_equivalent_circuit() {
    let long = motor(2000);
    let circuit = long.circuit(GAP);
    for speed in [0.0, 3.0, 15.0] {
        for slip in [-20.0, -5.0, 0.5, 6.0, 12.0, 40.0] {
            let thrust = long.forces(feed(slip, speed), speed, GAP).thrust;
            let known = circuit_thrust(circuit, CURRENT, slip);
            // the ends take some 1/(pole pairs) of it
            assert!((thrust / known - 1.0).abs() < 2e-3, "{speed} {slip}: {thrust} {known}");
        }
        let synchronous = long.forces(feed(0.0, speed), speed, GAP).thrust;
        let peak_slip = circuit.secondary / circuit.magnetising / TAU;
        let peak = long.forces(feed(peak_slip, speed), speed, GAP).thrust;
        let known = 1.5 * CURRENT * CURRENT * WAVE * circuit.magnetising;
        assert!((peak / known - 1.0).abs() < 2e-3, "{peak} {known}");
        assert!(synchronous.abs() < 2e-3 * peak, "{synchronous}");
        for beside in [0.8, 1.25] {
            let less = long.forces(feed(beside * peak_slip, speed), speed, GAP).thrust;
            assert!(less < 0.99 * peak);
        }
    }
}

/// L and R as textbooks give them: L = 6μ₀wτ(Wk_w)²/(π²p·g), R = 6w(Wk_w)²/(pτσ), here with the exact gap's
/// tanh(kg)/k and 1/cosh²(kg).
#[test]
fn analytic_the_circuit_has_the_textbooks_inductance() {
    let circuit = motor(4).circuit(GAP);
    let g = 1.1 * (GAP + DATA.sheet_thickness);
    let linkage = (DATA.turns * DATA.winding_factor).powi(2);
    let thin = 6.0 * MU_0 * DATA.width * PITCH * linkage / (PI * PI * 4.0 * g);
    let exact = thin * WAVE * g / (WAVE * g).tanh() / (WAVE * g).cosh().powi(2);
    assert!((circuit.magnetising / exact - 1.0).abs() < 1e-12);
    // the edges' factor by hand for these data: 1 − 0.93884/(1.72788·1.61549)
    let sheet: f64 = 0.66367 * 0.004 / 3.3e-8;
    let secondary = 6.0 * DATA.width * linkage / (4.0 * PITCH * sheet) / (WAVE * g).cosh().powi(2);
    assert!(
        (circuit.secondary / secondary - 1.0).abs() < 2e-4,
        "{}",
        circuit.secondary / secondary
    );
}

/// Normal force of a long motor: (|B|² − μ₀²|J₂|²)/4μ₀ on its surface with the wave of Laplace's equation in the
/// gap; attraction below the slip speed 1/(μ₀σ), none there, repulsion above.
#[test]
fn analytic_normal_force_of_a_long_motor_and_its_change_of_sign() {
    let long = motor(2000);
    let balance = long.balance_speed();
    let g = 1.1 * (GAP + DATA.sheet_thickness);
    let sheet = 3.0 * SQRT_2 * DATA.turns * DATA.winding_factor * CURRENT / (4.0 * PITCH);
    let area = DATA.width * 2.0 * 2000.0 * PITCH;
    for ratio in [0.0, 0.2, 0.7, 1.0, 1.5] {
        let slip = ratio * balance / (2.0 * PITCH);
        let normal = long.forces(feed(slip, 4.0), 4.0, GAP).normal;
        let (s, c) = ((WAVE * g).sinh(), (WAVE * g).cosh());
        let field = (MU_0 * sheet).powi(2) / (s * s + (ratio * c).powi(2));
        let known = area * field / (4.0 * MU_0) * (1.0 - ratio * ratio);
        let scale = area * field / (4.0 * MU_0);
        assert!((normal - known).abs() < 2e-3 * scale, "{ratio}: {normal} {known}");
    }
}

/// Power balance with both ends: what the primary gives is thrust times speed and the sheet's heat, all three from
/// different integrals; forwards, backwards, braking, plugging, with direct current and at rest.
#[test]
fn invariant_power_is_balanced() {
    for pairs in [1, 4] {
        let motor = motor(pairs);
        for gap in [0.004, 0.01, 0.02] {
            for speed in [-20.0, -1.0, 0.0, 0.3, 5.5, 30.0] {
                for frequency in [-30.0, -0.1, 0.0, 2.0, 12.0, 90.0] {
                    let feed = Feed { current: CURRENT, frequency };
                    let powers = motor.powers(feed, speed, gap);
                    let scale = powers.loss + powers.mechanical.abs() + 1e-3;
                    let left = powers.input - powers.mechanical - powers.loss;
                    assert!(
                        left.abs() < 1e-9 * scale,
                        "{pairs} {gap} {speed} {frequency}: {powers:?}"
                    );
                    assert!(powers.loss >= 0.0);
                }
            }
        }
    }
}

/// Driving backwards is the mirror image.
#[test]
fn invariant_backwards_is_the_mirror_image() {
    let motor = motor(4);
    for (frequency, speed) in [(20.0, 5.0), (3.0, 5.0), (-4.0, 2.0), (8.0, 0.0)] {
        let ahead = motor.forces(Feed { current: CURRENT, frequency }, speed, GAP);
        let back = motor.forces(Feed { current: CURRENT, frequency: -frequency }, -speed, GAP);
        assert!((ahead.thrust + back.thrust).abs() < 1e-9 * ahead.thrust.abs());
        assert!((ahead.normal - back.normal).abs() < 1e-9 * ahead.normal.abs());
    }
}

/// The equation of the field by finite differences on a line that reaches far beyond the motor.
#[test]
fn analytic_forces_agree_with_finite_differences_of_the_field_equation() {
    let (length, before, behind, n) = (1.6, 0.8, 2.4, 24_000);
    let h = (before + length + behind) / n as f64;
    let g = 1.1 * (GAP + DATA.sheet_thickness);
    let (gap, sheet) = ((WAVE * g).tanh() / WAVE, 1.0 / (MU_0 * motor(4).balance_speed()));
    let j1 = 3.0 * SQRT_2 * DATA.turns * DATA.winding_factor * CURRENT
        / (4.0 * PITCH)
        / (WAVE * g).cosh();
    for (slip, speed) in [(12.0, 5.5), (0.0, 20.0), (-12.0, 5.5), (12.0, 0.0)] {
        let feed = feed(slip, speed);
        let omega = TAU * feed.frequency;
        // g/μ₀ A'' − σvA' − jωσA = −J₁ with A = 0 far away, by Thomas's algorithm
        let (c, s) = (gap / MU_0 / (h * h), sheet * speed / (2.0 * h));
        let (lower, upper) = (Complex::from(c + s), Complex::from(c - s));
        let diagonal = Complex::new(-2.0 * c, -omega * sheet);
        let source = |i: usize| {
            let x = i as f64 * h - before;
            // half at the winding's edges
            let weight =
                ((x + 0.5 * h) / h).clamp(0.0, 1.0) * ((length + 0.5 * h - x) / h).clamp(0.0, 1.0);
            Complex::new(0.0, -WAVE * x).exp() * (j1 * weight)
        };
        let (mut up, mut right) = (vec![Complex::from(0.0); n], vec![Complex::from(0.0); n]);
        for i in 1..n {
            let pivot = diagonal - lower * up[i - 1];
            up[i] = upper / pivot;
            right[i] = (-source(i) - lower * right[i - 1]) / pivot;
        }
        let mut a = vec![Complex::from(0.0); n + 1];
        for i in (1..n).rev() {
            a[i] = right[i] - up[i] * a[i + 1];
        }
        let (mut thrust, mut normal) = (0.0, 0.0);
        for i in 1..n {
            let b = -(a[i + 1] - a[i - 1]) / (2.0 * h);
            let j2 = (Complex::new(0.0, -omega) * a[i] + b * speed) * sheet;
            thrust += 0.5 * DATA.width * h * (source(i) * b.conj()).re;
            let x = i as f64 * h - before;
            if (0.0..=length).contains(&x) {
                let stress = (b.norm_sqr() - MU_0 * MU_0 * j2.norm_sqr()) / (4.0 * MU_0);
                normal += DATA.width * h * stress;
            }
        }
        let known = motor(4).forces(feed, speed, GAP);
        // 5,000 points a pole pair: (γh)² of a few 1e-5, and a point of the ends' normal force
        assert!(
            (thrust - known.thrust).abs() < 1e-3 * known.thrust.abs().max(300.0),
            "{slip} {speed}: {thrust} {known:?}"
        );
        assert!(
            (normal - known.normal).abs() < 1e-3 * known.normal.abs(),
            "{slip} {speed}: {normal} {known:?}"
        );
    }
}

/// At synchronous speed the sheet that enters holds the field back: it builds up as 1 − e^{−x/(vT)} with T = L/R of
/// the equivalent circuit, and its mean is 1 − (1 − e^{−Q})/Q of a long motor's, Q = length/(vT). That is the factor
/// of J. Duncan, *Linear induction motor: equivalent-circuit model*, Proc. IEE 130B (1983). Here the mean of its
/// square is compared, which is the attraction.
#[test]
fn analytic_the_end_effect_grows_with_speed_as_in_duncans_circuit() {
    let (short, long) = (motor(4), motor(2000));
    let circuit = short.circuit(GAP);
    let time = circuit.magnetising / circuit.secondary;
    let mut before = 1.0;
    for speed in [2.0, 5.0, 10.0, 20.0, 40.0] {
        // attraction at synchronous speed, ∫|B|² dx, with |B| = 1 − e^{−x/(v T)} along the motor
        let q = 1.6 / (speed * time);
        let known = 1.0 - 2.0 * (1.0 - (-q).exp()) / q + (1.0 - (-2.0 * q).exp()) / (2.0 * q);
        let ratio = short.forces(feed(0.0, speed), speed, GAP).normal
            / long.forces(feed(0.0, speed), speed, GAP).normal
            * 500.0;
        // Duncan's build-up leaves out the entry wave of γ₁, of length g/(μ₀σv), and the sheet's repulsion
        assert!((ratio - known).abs() < 0.02, "{speed}: {ratio} {known}");
        assert!(ratio < before);
        before = ratio;
    }
}
