//! Loops with margins in closed form.

use std::f64::consts::{PI, TAU};

use faer::Mat;
use faer::prelude::c64;
use results::response::{Direction, LoopsResult};

use crate::*;

/// Controllable canonical form of numerator/denominator, highest power first, the denominator monic.
fn transfer(numerator: &[f64], denominator: &[f64]) -> Model {
    let n = denominator.len() - 1;
    let mut padded = vec![0.0; n + 1 - numerator.len()];
    padded.extend(numerator);
    let d = padded[0];
    Model {
        a: Mat::from_fn(n, n, |i, j| match i {
            0 => -denominator[j + 1],
            _ => f64::from(u8::from(j + 1 == i)),
        }),
        b: Mat::from_fn(n, 1, |i, _| f64::from(u8::from(i == 0))),
        c: Mat::from_fn(1, n, |_, j| padded[j + 1] - d * denominator[j + 1]),
        d: Mat::from_fn(1, 1, |_, _| d),
        domain: Domain::Continuous,
    }
}

fn names(count: usize) -> Vec<String> {
    (1..=count).map(|k| format!("loop {k}")).collect()
}

fn analysed(open: &Model) -> LoopsResult {
    Loops::new(open, &names(open.b.ncols())).unwrap().analyse(false).unwrap()
}

fn near(value: f64, wanted: f64) {
    assert!((value - wanted).abs() <= 1e-8 * wanted.abs().max(1e-3), "{value} instead of {wanted}");
}

/// ωn²/(s(s + 2ζωn)): phase margin, crossover and delay margin in closed form; no gain makes it unstable.
#[test]
fn analytic_margins_of_a_second_order_plant() {
    for (zeta, wn) in [(0.05_f64, 3.0_f64), (0.4, 1.0), (1.5, 200.0)] {
        let found = analysed(&transfer(&[wn * wn], &[1.0, 2.0 * zeta * wn, 0.0]));
        let margins = found.single[0].margins.clone().unwrap();
        let ratio = ((1.0 + 4.0 * zeta.powi(4)).sqrt() - 2.0 * zeta * zeta).sqrt();
        let phase = (2.0 * zeta / ratio).atan();
        near(margins.phase.unwrap().degrees, phase.to_degrees());
        near(margins.phase.unwrap().frequency_hz, wn * ratio / TAU);
        assert_eq!(margins.phase.unwrap().direction, Direction::Lag);
        near(margins.delay.unwrap().seconds, phase / (wn * ratio));
        assert!(margins.gain_up.is_none() && margins.gain_down.is_none());
        assert!(found.stable && found.encirclements.is_none());
        // |1 + L|² of x = (ω/ωn)²: ((x − 1)² + 4ζ²x)/(x² + 4ζ²x), least where its derivative is 0
        let square =
            |x: f64| ((x - 1.0).powi(2) + 4.0 * zeta * zeta * x) / (x * x + 4.0 * zeta * zeta * x);
        let least = (1..4_000_000).map(|k| square(f64::from(k) * 1e-5)).fold(1.0, f64::min).sqrt();
        assert!((margins.modulus.value - least).abs() < 1e-8, "{} {least}", margins.modulus.value);
    }
}

/// k/(s + 1)³: gain margin 8/k at √3 rad/s. Beyond it two poles grow, the curve turns twice around −1, and
/// there are no margins.
#[test]
fn analytic_margins_of_three_lags_and_none_beyond_them() {
    let loop_of = |k: f64| analysed(&transfer(&[k], &[1.0, 3.0, 3.0, 1.0]));
    let found = loop_of(2.0);
    let margins = found.single[0].margins.clone().unwrap();
    near(margins.gain_up.unwrap().factor, 4.0);
    near(margins.gain_up.unwrap().frequency_hz, 3.0_f64.sqrt() / TAU);
    // |L| = 1 where 1 + ω² = 2^(2/3)
    let omega = (2.0_f64.powf(2.0 / 3.0) - 1.0).sqrt();
    near(margins.phase.unwrap().degrees, 180.0 - 3.0 * omega.atan().to_degrees());
    assert!(found.encirclements.unwrap().abs() < 1e-6);
    let unstable = loop_of(10.0);
    assert!(!unstable.stable && unstable.single[0].margins.is_none());
    assert_eq!((unstable.closed_growing, unstable.open_growing), (2, 0));
    assert!((unstable.encirclements.unwrap() - 2.0).abs() < 1e-6);
    near(unstable.single[0].critical[0].1, 0.8);
}

/// k/(s − 1), unstable alone: stable for k > 1, so the gain may fall to 1/k, at standstill. The curve turns
/// once counterclockwise.
#[test]
fn analytic_an_unstable_plant_may_lose_gain_only_so_far() {
    let found = analysed(&transfer(&[2.0], &[1.0, -1.0]));
    let margins = found.single[0].margins.clone().unwrap();
    near(margins.gain_down.unwrap().factor, 0.5);
    assert_eq!(margins.gain_down.unwrap().frequency_hz, 0.0);
    assert!(margins.gain_up.is_none());
    near(margins.phase.unwrap().degrees, 60.0);
    near(margins.delay.unwrap().seconds, PI / 3.0 / 3.0_f64.sqrt());
    assert!((found.encirclements.unwrap() + 1.0).abs() < 1e-6);
    let unstable = analysed(&transfer(&[0.5], &[1.0, -1.0]));
    assert_eq!((unstable.closed_growing, unstable.open_growing), (1, 1));
    assert!(unstable.single[0].margins.is_none());
}

/// A PI controller, (2 s + 1)/s, on an integrator: |L| = 1 where ω⁴ = 4 ω² + 1, and the phase there is that
/// of the zero. The delay margin is the delay of the exponential: with it, L is −1.
#[test]
fn analytic_the_delay_margin_of_a_pi_controller() {
    let found = analysed(&transfer(&[2.0, 1.0], &[1.0, 0.0, 0.0]));
    let margins = found.single[0].margins.clone().unwrap();
    let omega = (2.0 + 5.0_f64.sqrt()).sqrt();
    near(margins.delay.unwrap().frequency_hz, omega / TAU);
    near(margins.delay.unwrap().seconds, (2.0 * omega).atan() / omega);
    let s = c64::new(0.0, omega);
    let lag = (-s * margins.delay.unwrap().seconds).exp();
    assert!(((2.0 * s + 1.0) / (s * s) * lag + 1.0).norm() < 1e-9);
}

/// An integrator that is sampled and held, kh/(z − 1): gain margin 2/kh at half a period per sample. One
/// sample of delay: 1/kh at a sixth. Further whole samples of delay make it unstable exactly where the delay
/// margin says.
#[test]
fn analytic_margins_of_a_sampled_loop() {
    let (k, h) = (2.0, 0.05);
    let plant = transfer(&[k], &[1.0, 0.0]);
    let with = |delay| sampled::sampled(&plant, h, delay, "u").unwrap();
    let margins = |delay| analysed(&with(delay)).single[0].margins.clone().unwrap();
    near(margins(0).gain_up.unwrap().factor, 20.0);
    near(margins(0).gain_up.unwrap().frequency_hz, 0.5 / h);
    near(margins(1).gain_up.unwrap().factor, 10.0);
    near(margins(1).gain_up.unwrap().frequency_hz, 1.0 / (6.0 * h));
    let tolerated = margins(0).delay.unwrap().seconds / h;
    for more in 1..30 {
        let loops = Loops::new(&with(more), &names(1)).unwrap();
        assert_eq!(loops.stable(), (more as f64) < tolerated, "{more} of {tolerated}");
    }
    let proper = transfer(&[1.0, 0.0], &[1.0, 1.0]);
    assert!(
        sampled::sampled(&proper, h, 0, "u").unwrap_err().to_string().contains("without delay")
    );
    assert!(sampled::sampled(&plant, 0.0, 0, "u").unwrap_err().to_string().contains("sample time"));
}

/// The satellite of Doyle (Skogestad and Postlethwaite, *Multivariable Feedback Control*, section 3.7.1):
/// each loop alone has infinite gain margin and a phase margin of 90°, but small independent changes of
/// both make it unstable: the largest sensitivity is √(1 + a²).
#[test]
fn analytic_two_loops_that_are_robust_only_one_by_one() {
    let a = 10.0;
    let entry = |list: [[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| list[i][j]);
    let open = Model {
        a: entry([[0.0, a], [-a, 0.0]]),
        b: entry([[1.0, 0.0], [0.0, 1.0]]),
        c: entry([[1.0, a], [-a, 1.0]]),
        d: Mat::zeros(2, 2),
        domain: Domain::Continuous,
    };
    let found = analysed(&open);
    for it in &found.single {
        let margins = it.margins.clone().unwrap();
        assert!(margins.gain_up.is_none() && margins.gain_down.is_none(), "{margins:?}");
        near(margins.phase.unwrap().degrees, 90.0);
        assert!(margins.modulus.value > 0.999, "{margins:?}");
    }
    let together = found.together.unwrap();
    let least = 1.0 / (1.0 + a * a).sqrt();
    let independent = together.independent.unwrap();
    near(independent.value, least);
    assert!((independent.frequency_hz.unwrap() * TAU - 1.0 / a).abs() < 1e-4);
    let equal = together.equal.unwrap();
    near(equal.modulus.value, least);
    // the loci are (1 ± ja)/(s ∓ ja): equal gains k give s = ja − k(1 + ja), stable for every k > 0
    assert!(equal.gain_up.is_none(), "{equal:?}");
}

/// A third-order loop in each of six equal channels that feed each other: values from solving directly.
#[test]
fn analytic_the_evaluator_solves_the_equations() {
    let (n, m) = (30, 6);
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    // states of very different scales
    let scale: Vec<f64> = (0..n).map(|k| 10.0_f64.powi(k % 7 - 3)).collect();
    let model = Model {
        a: Mat::from_fn(n as usize, n as usize, |i, j| random() * scale[i] / scale[j]),
        b: Mat::from_fn(n as usize, m, |i, _| random() * scale[i]),
        c: Mat::from_fn(4, n as usize, |_, j| random() / scale[j]),
        d: Mat::from_fn(4, m, |_, _| random()),
        domain: Domain::Continuous,
    };
    let evaluator = Evaluator::new(&model);
    let mut scratch = Scratch::default();
    for omega in [0.0, 0.3, 2.0, 50.0] {
        use faer::linalg::solvers::{PartialPivLu, Solve};
        let shifted = Mat::from_fn(n as usize, n as usize, |i, j| {
            let diagonal = if i == j { c64::new(0.0, omega) } else { c64::ZERO };
            diagonal - model.a[(i, j)]
        });
        let complex =
            |it: &Mat<f64>| Mat::from_fn(it.nrows(), it.ncols(), |i, j| c64::new(it[(i, j)], 0.0));
        let solved = PartialPivLu::new(shifted.as_ref()).solve(&complex(&model.b));
        let wanted = complex(&model.c) * solved + complex(&model.d);
        let found = evaluator.at(omega, &mut scratch);
        for j in 0..m {
            for i in 0..4 {
                let error = (found[(i, j)] - wanted[(i, j)]).norm();
                assert!(error < 1e-10 * wanted[(i, j)].norm().max(1.0), "{omega}: {error:e}");
                let alone = evaluator.entry((i, j), omega, &mut scratch);
                assert!((alone - found[(i, j)]).norm() < 1e-10 * alone.norm().max(1.0));
            }
        }
    }
}

/// Opening what was closed gives the loop back, also with feed-through.
#[test]
fn invariant_opening_undoes_closing() {
    let open = transfer(&[0.5, 2.0, 1.0], &[1.0, 1.0, 4.0]);
    // from what adds to the signal to the signal: v = −L (v + d)
    let closed = open.closed().unwrap();
    let back = Model { c: -&closed.c, d: -&closed.d, ..closed }.opened().unwrap();
    let (one, two) = (Evaluator::new(&open), Evaluator::new(&back));
    let mut scratch = Scratch::default();
    for omega in [0.1, 1.0, 2.0, 30.0] {
        let (a, b) =
            (one.entry((0, 0), omega, &mut scratch), two.entry((0, 0), omega, &mut scratch));
        assert!((a - b).norm() < 1e-12, "{omega}: {a} {b}");
    }
}

/// 1/(s(s + 2)) over its gain k: double pole at k = 1, −1 ± j√(k − 1) beyond. (s + 1)³ crosses at k = 8.
#[test]
fn analytic_root_loci() {
    let plant = transfer(&[1.0], &[1.0, 2.0, 0.0]);
    for k in [0.5, 2.0, 5.0] {
        let poles = locus::with_gain(&plant, k).unwrap();
        for pole in poles {
            assert!((pole * pole + 2.0 * pole + k).norm() < 1e-9, "{k}: {pole}");
        }
    }
    let lags = transfer(&[1.0], &[1.0, 3.0, 3.0, 1.0]);
    let gains: Vec<f64> = (0..41).map(|k| f64::from(k) * 0.3).collect();
    let lists: Vec<Vec<c64>> = gains.iter().map(|k| locus::with_gain(&lags, *k).unwrap()).collect();
    let found = locus::root_locus("gain", &gains, &lists);
    assert_eq!(found.crossings.len(), 1, "{:?}", found.crossings);
    let (gain, frequency) = found.crossings[0];
    assert!((gain - 8.0).abs() < 0.01 && (frequency * TAU - 3.0_f64.sqrt()).abs() < 0.01);
    for branch in &found.branches {
        for pair in branch.windows(2).skip(1) {
            assert!((pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1) < 0.2);
        }
    }
}
