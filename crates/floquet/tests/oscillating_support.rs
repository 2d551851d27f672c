//! A body on two electromagnets with their controllers, under a support of which one end moves sinusoidally: the gaps
//! and currents of the forced motion are periodic, and so are the coefficients of small motions about it.
//!
//! The magnets have the nonlinear law with the flux linkage λ as state,
//!
//! ```text
//! F = λ²/(2 L₀ c₀),    dλ/dt = R i₀ + k_p (c − c₀) + k_d ċ − R λ c/(L₀ c₀),
//! ```
//!
//! and the body heaves and pitches: c̈ = g − S F − s̈. At a frequency of the support near ω₁ + ω₂ of two of its modes λ₁, λ₂ (or
//! near 2 ω₁) the amplitudes of both are coupled. With A(t) = A₀ + A₁ e^{iΩt} + Ā₁ e^{−iΩt}, of first order in the
//! support's amplitude, the exponents are the eigenvalues of
//!
//! ```text
//! [ λ₁           w₁ᴴ A₁ v̄₂ ]
//! [ w̄₂ᴴ Ā₁ v₁    λ̄₂ + iΩ   ]
//! ```
//!
//! with an error of second order (Nayfeh and Mook 1979, "Nonlinear oscillations", chapter 5).

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::f64::consts::TAU;

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use floquet::{Girders, Modal, Monodromy, Multiplier, Passage, multipliers};

/// Inductance (H), gap (m), resistance (Ω) and current (A) of the paper's magnet at its load.
const L: f64 = 0.452_39;
const GAP: f64 = 8e-3;
const R: f64 = 0.6;
const CURRENT: f64 = 14.353;
const G: f64 = 9.81;
/// m l²/J: heave and pitch differ.
const RATIO: f64 = 1.7;
/// Steps of the direct integration per period, and harmonics of the forced motion that are kept.
const STEPS: usize = 400;
const HARMONICS: usize = 16;
/// States: two gaps, their rates, two flux linkages.
const N: usize = 6;

struct Case {
    /// Amplitude (m) and angular frequency (1/s) of the support.
    amplitude: f64,
    omega: f64,
}

/// k_p and k_d for 5 Hz, so lightly damped that a gap that moves by a tenth can make motions grow.
fn gains() -> (f64, f64) {
    let rate = (TAU * 5.0).powi(2) / (2.0 * CURRENT / (GAP * mass()));
    (rate + R * CURRENT / GAP, rate)
}

/// Both magnets carry it.
fn mass() -> f64 {
    L * CURRENT * CURRENT / GAP / G
}

/// Accelerations of the gaps per force.
fn mobility(i: usize, j: usize) -> f64 {
    (1.0 + if i == j { RATIO } else { -RATIO }) / mass()
}

fn still() -> [f64; N] {
    [GAP, GAP, 0.0, 0.0, L * CURRENT, L * CURRENT]
}

fn slope(x: &[f64; N]) -> Mat<f64> {
    let (kp, kd) = gains();
    let mut a = Mat::zeros(N, N);
    for k in 0..2 {
        a[(k, 2 + k)] = 1.0;
        for j in 0..2 {
            a[(2 + k, 4 + j)] = -mobility(k, j) * x[4 + j] / (L * GAP);
        }
        a[(4 + k, k)] = kp - R * x[4 + k] / (L * GAP);
        a[(4 + k, 2 + k)] = kd;
        a[(4 + k, 4 + k)] = -R * x[k] / (L * GAP);
    }
    a
}

impl Case {
    fn rates(&self, t: f64, x: &[f64; N]) -> [f64; N] {
        let (kp, kd) = gains();
        let support = [self.amplitude * self.omega.powi(2) * (self.omega * t).cos(), 0.0];
        let force = |j: usize| x[4 + j].powi(2) / (2.0 * L * GAP);
        let gap = |k: usize| G - mobility(k, 0) * force(0) - mobility(k, 1) * force(1) + support[k];
        let flux = |k: usize| {
            R * CURRENT + kp * (x[k] - GAP) + kd * x[2 + k] - R * x[4 + k] * x[k] / (L * GAP)
        };
        [x[2], x[3], gap(0), gap(1), flux(0), flux(1)]
    }

    fn period(&self) -> f64 {
        TAU / self.omega
    }

    /// The classical Runge-Kutta method over a period, of the motion and of small motions about it: all places, and the map
    /// of the small motions.
    fn integrated(&self, start: [f64; N]) -> (Vec<[f64; N]>, Mat<f64>) {
        let h = self.period() / STEPS as f64;
        let (mut x, mut m) = (start, Mat::<f64>::identity(N, N));
        let mut all = vec![x];
        for n in 0..STEPS {
            let t = n as f64 * h;
            let rate =
                |part: f64, x: &[f64; N], m: &Mat<f64>| (self.rates(t + part * h, x), slope(x) * m);
            let moved = |by: f64, k: &([f64; N], Mat<f64>)| {
                (std::array::from_fn(|i| x[i] + by * h * k.0[i]), &m + faer::Scale(by * h) * &k.1)
            };
            let one = rate(0.0, &x, &m);
            let (y, w) = moved(0.5, &one);
            let two = rate(0.5, &y, &w);
            let (y, w) = moved(0.5, &two);
            let three = rate(0.5, &y, &w);
            let (y, w) = moved(1.0, &three);
            let four = rate(1.0, &y, &w);
            x = std::array::from_fn(|i| {
                x[i] + h / 6.0 * (one.0[i] + 2.0 * (two.0[i] + three.0[i]) + four.0[i])
            });
            m += faer::Scale(h / 6.0) * (one.1 + faer::Scale(2.0) * (two.1 + three.1) + four.1);
            all.push(x);
        }
        (all, m)
    }

    /// The forced motion, which repeats, by Newton's method.
    fn forced(&self) -> (Vec<[f64; N]>, Mat<f64>) {
        let mut start = still();
        for _ in 0..7 {
            let (all, map) = self.integrated(start);
            let miss = Mat::from_fn(N, 1, |i, _| all[STEPS][i] - start[i]);
            let change = PartialPivLu::new((Mat::<f64>::identity(N, N) - map).as_ref()).solve(miss);
            (0..N).for_each(|i| start[i] += change[(i, 0)]);
        }
        self.integrated(start)
    }

    /// The multipliers by this crate: the magnets at rest as the constant part, and what the forced motion changes as
    /// the periodic one.
    fn multipliers(&self, places: &[[f64; N]]) -> Vec<Multiplier> {
        let harmonics: Vec<[c64; N]> = (0..HARMONICS)
            .map(|k| {
                std::array::from_fn(|i| {
                    let turn = |n: usize| c64::cis(-TAU * (k * n) as f64 / STEPS as f64);
                    let sum: c64 = (0..STEPS).map(|n| turn(n) * places[n][i]).sum();
                    sum * (if k == 0 { 1.0 } else { 2.0 } / STEPS as f64)
                })
            })
            .collect();
        // two forces and two voltages, of gaps and flux linkages
        let b = Mat::from_fn(N, 4, |i, j| match (i, j) {
            (2 | 3, 0 | 1) => -mobility(i - 2, j),
            (4 | 5, 2 | 3) if i - 4 == j - 2 => 1.0,
            _ => 0.0,
        });
        let magnets = Girders::alone(slope(&still()), b, vec![0, 1, 4, 5]);
        let passage = Rule {
            period: self.period(),
            rule: |t: f64, p: &mut Mat<f64>, q: &mut Mat<f64>| {
                let at = |i: usize| {
                    let wave =
                        |k: usize| (harmonics[k][i] * c64::cis(self.omega * t * k as f64)).re;
                    (0..HARMONICS).map(wave).sum::<f64>() - still()[i]
                };
                p.copy_from(Mat::<f64>::identity(4, 4));
                q.fill(0.0);
                for k in 0..2 {
                    q[(k, 2 + k)] = at(4 + k) / (L * GAP);
                    q[(2 + k, k)] = -R * at(4 + k) / (L * GAP);
                    q[(2 + k, 2 + k)] = -R * at(k) / (L * GAP);
                }
            },
        };
        let watch = Mat::from_fn(1, 4, |_, j| if j == 0 { 1.0 } else { 0.0 });
        let train = Modal::feedthrough(Mat::identity(4, 4));
        let found = Monodromy::new(&train, &magnets, &passage, &watch, 1.0, 48).unwrap();
        multipliers(&found).unwrap().all
    }
}

/// P and Q as functions of the time.
struct Rule<F> {
    period: f64,
    rule: F,
}

impl<F: Fn(f64, &mut Mat<f64>, &mut Mat<f64>) + Sync> Passage for Rule<F> {
    fn period(&self) -> f64 {
        self.period
    }

    fn at(&self, x: f64, p: &mut Mat<f64>, q: &mut Mat<f64>) {
        (self.rule)(x, p, q);
    }
}

/// Eigenvalues with Im > 0 of the magnets under a support at rest, with right eigenvectors and rows of the inverse.
fn modes() -> Vec<(c64, Vec<c64>, Vec<c64>)> {
    let eigen = slope(&still()).eigen().unwrap();
    let v = eigen.U().to_owned();
    let w = PartialPivLu::new(v.as_ref()).solve(Mat::<c64>::identity(N, N));
    let mut all: Vec<_> = (0..N)
        .filter(|&k| eigen.S()[k].im > 1.0)
        .map(|k| {
            let of = |i: usize| (v[(i, k)], w[(k, i)]);
            let (shape, left) = (0..N).map(of).unzip();
            (eigen.S()[k], shape, left)
        })
        .collect();
    all.sort_by(|a, b| a.0.im.total_cmp(&b.0.im));
    all
}

/// The larger growth of the two coupled amplitudes, to first order in the support's amplitude.
fn first_order(
    case: &Case,
    one: &(c64, Vec<c64>, Vec<c64>),
    other: &(c64, Vec<c64>, Vec<c64>),
) -> f64 {
    let zero = c64::new(0.0, 0.0);
    let complex = |x: f64| c64::new(x, 0.0);
    let i_omega = c64::new(0.0, case.omega);
    let a0 = slope(&still());
    let pencil = Mat::from_fn(N, N, |i, j| {
        if i == j { i_omega - complex(a0[(i, j)]) } else { complex(-a0[(i, j)]) }
    });
    let push = 0.5 * case.amplitude * case.omega.powi(2);
    let right = Mat::from_fn(N, 1, |i, _| if i == 2 { complex(push) } else { zero });
    let forced = PartialPivLu::new(pencil.as_ref()).solve(right);
    let mut a1 = Mat::<c64>::zeros(N, N);
    for k in 0..2 {
        for j in 0..2 {
            a1[(2 + k, 4 + j)] = forced[(4 + j, 0)] * (-mobility(k, j) / (L * GAP));
        }
        a1[(4 + k, k)] = forced[(4 + k, 0)] * (-R / (L * GAP));
        a1[(4 + k, 4 + k)] = forced[(k, 0)] * (-R / (L * GAP));
    }
    let form = |left: &dyn Fn(usize) -> c64,
                a: &dyn Fn(usize, usize) -> c64,
                right: &dyn Fn(usize) -> c64| {
        (0..N)
            .flat_map(|i| (0..N).map(move |j| (i, j)))
            .map(|(i, j)| left(i) * a(i, j) * right(j))
            .sum::<c64>()
    };
    let p = form(&|i| one.2[i], &|i, j| a1[(i, j)], &|j| other.1[j].conj());
    let q = form(&|i| other.2[i].conj(), &|i, j| a1[(i, j)].conj(), &|j| one.1[j]);
    let (a, d) = (one.0, other.0.conj() + i_omega);
    let (mean, half) = ((a + d) * 0.5, (a - d) * 0.5);
    let root = (half * half + p * q).sqrt();
    (mean + root).re.max((mean - root).re)
}

/// At twice a mode's frequency and at the sum of two: the multipliers are those of a direct integration of the equations
/// of small motions, and their growth is the known one, which is above that under a support at rest. If the support moves
/// enough, small motions grow although they decay under one at rest.
#[test]
fn analytic_an_electromagnet_on_an_oscillating_support_has_its_resonances() {
    let modes = modes();
    assert_eq!(modes.len(), 2);
    for (one, other) in [(0, 0), (1, 1), (0, 1)] {
        let (one, other) = (&modes[one], &modes[other]);
        let omega = one.0.im + other.0.im;
        for amplitude in [1e-4, 8e-4] {
            let case = Case { amplitude, omega };
            let (places, map) = case.forced();
            let found = case.multipliers(&places);
            let direct = map.eigenvalues().unwrap();
            for it in &found {
                let nearest =
                    direct.iter().map(|mu| (mu - it.value).norm()).fold(f64::INFINITY, f64::min);
                // Runge-Kutta with 400 steps: (ωh)⁴/120 per radian
                assert!(nearest < 1e-7, "{omega} {amplitude}: {it:?} {nearest:.1e}");
            }
            let growth = found[0].growth;
            let expected = first_order(&case, one, other);
            let at_rest = one.0.re.max(other.0.re);
            assert!(at_rest < -0.1, "{at_rest}");
            // the next order is that of the square of the gap's change, 2 % and 15 % of it
            let tolerance = if amplitude < 5e-4 { 0.005 } else { 0.03 };
            let error = (growth - expected) / (expected - at_rest);
            assert!(error.abs() < tolerance, "{omega} {amplitude}: {growth} {expected} {error}");
            assert_eq!(growth > 0.0, amplitude > 5e-4, "{omega} {amplitude}: {growth}");
            let nearest = |mode: &c64| (TAU * found[0].frequency - mode.im).abs();
            assert!(nearest(&one.0).min(nearest(&other.0)) < 1.0, "{omega}: {:?}", found[0]);
        }
    }
}
