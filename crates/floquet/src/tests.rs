//! Known answers.

use std::f64::consts::{PI, TAU};

use faer::Mat;

use crate::{Girders, Modal, Monodromy, Multiplier, Passage, directions, multipliers, reduced};

/// P and Q as functions of the place.
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

fn matrix<const R: usize, const C: usize>(rows: [[f64; C]; R]) -> Mat<f64> {
    Mat::from_fn(R, C, |i, j| rows[i][j])
}

/// x'' + (a + k(t)) x = 0 without constant part.
fn hill(a: f64, period: f64, k: impl Fn(f64) -> f64 + Sync, steps: usize) -> Monodromy {
    let oscillator =
        Girders::alone(matrix([[0.0, 1.0], [-a, 0.0]]), matrix([[0.0], [1.0]]), vec![0]);
    let train = Modal::feedthrough(matrix([[1.0]]));
    let rule = |t: f64, p: &mut Mat<f64>, q: &mut Mat<f64>| {
        (p[(0, 0)], q[(0, 0)]) = (1.0, -k(t));
    };
    Monodromy::new(&train, &oscillator, &Rule { period, rule }, &Mat::identity(1, 1), 1.0, steps)
        .unwrap()
}

fn trace(monodromy: &Monodromy) -> f64 {
    (0..monodromy.matrix.nrows()).map(|k| monodromy.matrix[(k, k)]).sum()
}

/// Mathieu's equation x'' + (a − 2q cos 2t) x = 0: at its characteristic values the trace is 2 or −2, beside them it
/// is beyond or within (Abramowitz and Stegun, table 20.1, q = 1, 5).
#[test]
fn analytic_mathieu_boundaries() {
    for (q, a, expected) in [
        (1.0, -0.455_138_604_1, 2.0),
        (1.0, -0.110_248_817_0, -2.0),
        (1.0, 1.859_108_072_5, -2.0),
        (1.0, 3.917_024_773_0, 2.0),
        (1.0, 4.371_300_982_7, 2.0),
        (5.0, -5.800_046_020_9, 2.0),
        (5.0, 1.858_187_541_5, -2.0),
    ] {
        let at = |a: f64| trace(&hill(a, PI, |t| -2.0 * q * (2.0 * t).cos(), 64));
        // ten digits of the tables, and the slope of the trace with a, which is up to some hundred
        assert!((at(a) - expected).abs() < 2e-7, "{q} {a}: {}", at(a));
        let (below, above) = (at(a - 1e-3) * expected.signum(), at(a + 1e-3) * expected.signum());
        assert!((below - 2.0) * (above - 2.0) < 0.0, "{q} {a}: {below} {above}");
    }
}

/// Meissner's equation, stiffness a + e and a − e in turn: trace = 2 cos·cos − (r + 1/r) sin·sin.
#[test]
fn analytic_meissner() {
    let (a, e) = (2.0, 0.7_f64);
    for period in [0.5, 2.0, 2.4, 4.0] {
        let found = hill(a, period, |t| if t < 0.5 * period { e } else { -e }, 40);
        let (u, v) = ((a + e).sqrt(), (a - e).sqrt());
        let (p, r) = (0.5 * period * u, 0.5 * period * v);
        let exact = 2.0 * p.cos() * r.cos() - (u / v + v / u) * p.sin() * r.sin();
        assert!((trace(&found) - exact).abs() < 1e-9, "{period}: {} {exact}", trace(&found));
    }
}

/// At twice the natural frequency a small modulation e makes the motion grow by e/(4ω), at the natural frequency.
#[test]
fn analytic_principal_resonance_has_its_growth_and_frequency() {
    let (omega, e) = (3.0, 0.02);
    let found = hill(omega * omega, PI / omega, |t| e * (2.0 * omega * t).cos(), 40);
    let all = multipliers(&found).unwrap().all;
    // the next order is (e/ω²)² = 5e-6 of ω
    assert!((all[0].growth - e / (4.0 * omega)).abs() < 1e-5, "{all:?}");
    assert!((all[0].frequency - omega / TAU).abs() < 1e-2, "{all:?}");
    assert!((all[1].growth + all[0].growth).abs() < 1e-9);
}

/// Two modes coupled by e cos Ωt: at Ω = ω₁ + ω₂ + Δ the growth is √(g² − Δ²/4) with g = e/(4√(ω₁ω₂)), and none where
/// |Δ| > 2g.
#[test]
fn analytic_combination_resonance_of_two_modes() {
    let (first, second, e) = (2.0_f64, 3.3_f64, 0.04);
    let g = e / (4.0 * (first * second).sqrt());
    let growth = |detuning: f64| {
        let excitation = first + second + detuning;
        let a = matrix([
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-first * first, 0.0, 0.0, 0.0],
            [0.0, -second * second, 0.0, 0.0],
        ]);
        let b = matrix([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        let modes = Girders::alone(a, b, vec![0, 1]);
        let train = Modal::feedthrough(Mat::identity(2, 2));
        let rule = |t: f64, p: &mut Mat<f64>, q: &mut Mat<f64>| {
            p.copy_from(Mat::<f64>::identity(2, 2));
            let k = -e * (excitation * t).cos();
            q.copy_from(matrix([[0.0, k], [k, 0.0]]));
        };
        let passage = Rule { period: TAU / excitation, rule };
        let found =
            Monodromy::new(&train, &modes, &passage, &Mat::identity(2, 2), 1.0, 40).unwrap();
        multipliers(&found).unwrap().all[0].growth
    };
    for part in [0.0, 0.5, 0.9] {
        let detuning = 2.0 * g * part;
        let expected = g * (1.0 - part * part).sqrt();
        // the next order, e²/(16 ω³), is 1e-5
        assert!((growth(detuning) - expected).abs() < 2e-2 * g, "{part}: {}", growth(detuning));
        assert!((growth(-detuning) - expected).abs() < 2e-2 * g, "{part}: {}", growth(-detuning));
    }
    assert!(growth(2.2 * g).abs() < 1e-8 && growth(-2.2 * g).abs() < 1e-8);
}

/// A sprung mass with two wheels on a row of spans with two modes each.
struct Case {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
    girders: Girders,
    speed: f64,
}

const SPAN: f64 = 10.0;
/// Places of the wheels behind the front.
const WHEELS: [f64; 2] = [-0.5, -6.0];

/// Shapes of a span at a place from its beginning: smooth at its ends.
fn shapes(x: f64) -> [f64; 2] {
    if !(0.0..SPAN).contains(&x) {
        return [0.0; 2];
    }
    let s = (PI * x / SPAN).sin();
    [s.powi(8), s.powi(8) * (PI * x / SPAN).cos()]
}

impl Case {
    fn new(speed: f64) -> Self {
        let (mass, inertia, k, c) = (900.0, 4000.0, 5e4, 1.5e3);
        let arms = [2.75, -2.75];
        // states: heave, pitch, their rates; forces on the girders push down: −(k(w − z) + …)
        let mut case = Self {
            a: Mat::zeros(4, 4),
            b: Mat::zeros(4, 2),
            c: Mat::zeros(2, 4),
            d: Mat::zeros(2, 2),
            girders: Self::girders(),
            speed,
        };
        (case.a[(0, 2)], case.a[(1, 3)]) = (1.0, 1.0);
        for (wheel, arm) in arms.into_iter().enumerate() {
            for (row, lever) in [(2, 1.0 / mass), (3, arm / inertia)] {
                case.a[(row, 0)] -= k * lever;
                case.a[(row, 1)] -= k * arm * lever;
                case.a[(row, 2)] -= c * lever;
                case.a[(row, 3)] -= c * arm * lever;
                case.b[(row, wheel)] += k * lever;
            }
            // the force that presses on the girder
            case.c[(wheel, 0)] = k;
            case.c[(wheel, 1)] = k * arm;
            case.c[(wheel, 2)] = c;
            case.c[(wheel, 3)] = c * arm;
            case.d[(wheel, wheel)] = -k;
        }
        case
    }

    fn girders() -> Girders {
        let a = matrix([
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-1600.0, 0.0, -0.8, 0.1],
            [0.0, -12000.0, 0.1, -2.2],
        ]);
        let b = matrix([[0.0, 0.0], [0.0, 0.0], [1.0 / 4000.0, 0.0], [0.0, 1.0 / 4000.0]]);
        // the second wheel is at most one span behind the front: two spans at a time
        Girders::row(a, b, 2, vec![0, 1])
    }

    fn connection(&self, x: f64, p: &mut Mat<f64>, q: &mut Mat<f64>) {
        for (wheel, place) in WHEELS.into_iter().enumerate() {
            for span in 0..2 {
                for (n, shape) in shapes(x + place + SPAN * span as f64).into_iter().enumerate() {
                    p[(wheel, 2 * span + n)] = shape;
                    q[(2 * span + n, wheel)] = shape;
                }
            }
        }
    }

    fn monodromy(&self, steps: usize) -> Monodromy {
        let train = Modal::new(&self.a, &self.b, &self.c, self.d.clone()).unwrap();
        let rule = |x: f64, p: &mut Mat<f64>, q: &mut Mat<f64>| self.connection(x, p, q);
        Monodromy::new(
            &train,
            &self.girders,
            &Rule { period: SPAN, rule },
            &Mat::identity(2, 2),
            self.speed,
            steps,
        )
        .unwrap()
    }

    /// All states: z, both spans. The coupled matrix at a place.
    fn coupled(&self, x: f64) -> Mat<f64> {
        let (mut p, mut q) = (Mat::zeros(2, 4), Mat::zeros(4, 2));
        self.connection(x, &mut p, &mut q);
        let Girders { a, b, .. } = &self.girders;
        Mat::from_fn(12, 12, |i, j| {
            let seen =
                |j: usize| (j >= 4 && (j - 4) % 4 < 2).then(|| (j - 4) / 4 * 2 + (j - 4) % 4);
            match (i < 4, j < 4) {
                (true, true) => self.a[(i, j)],
                (true, false) => {
                    seen(j).map_or(0.0, |s| (0..2).map(|w| self.b[(i, w)] * p[(w, s)]).sum::<f64>())
                }
                (false, _) => {
                    let (span, row) = ((i - 4) / 4, (i - 4) % 4);
                    let force = |m: usize| {
                        (0..2)
                            .map(|w| {
                                let y = if j < 4 {
                                    self.c[(w, j)]
                                } else {
                                    seen(j).map_or(0.0, |s| {
                                        (0..2).map(|v| self.d[(w, v)] * p[(v, s)]).sum()
                                    })
                                };
                                q[(2 * span + m, w)] * y
                            })
                            .sum::<f64>()
                    };
                    let own =
                        if j >= 4 && (j - 4) / 4 == span { a[(row, (j - 4) % 4)] } else { 0.0 };
                    own + (0..2).map(|m| b[(row, m)] * force(m)).sum::<f64>()
                }
            }
        })
    }

    /// The sorted sizes of the eigenvalues of the map by the classical Runge-Kutta method.
    fn by_runge_kutta(&self, steps: usize) -> Vec<f64> {
        let h = SPAN / self.speed / steps as f64;
        let mut x = Mat::<f64>::zeros(12, 8);
        // z and the second span; the first one is fresh
        for k in 0..8 {
            x[(if k < 4 { k } else { k + 4 }, k)] = 1.0;
        }
        for step in 0..steps {
            let at = |part: f64| self.coupled((step as f64 + part) * h * self.speed);
            let (start, middle, end) = (at(0.0), at(0.5), at(1.0));
            let k1 = &start * &x;
            let k2 = &middle * (&x + faer::Scale(0.5 * h) * &k1);
            let k3 = &middle * (&x + faer::Scale(0.5 * h) * &k2);
            let k4 = &end * (&x + faer::Scale(h) * &k3);
            x += faer::Scale(h / 6.0) * (k1 + faer::Scale(2.0) * (k2 + k3) + k4);
        }
        // the first span becomes the second
        sizes(&Mat::from_fn(8, 8, |i, j| x[(i, j)]))
    }
}

fn sizes(matrix: &Mat<f64>) -> Vec<f64> {
    let mut all: Vec<f64> = matrix.eigenvalues().unwrap().iter().map(|it| it.norm()).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    all
}

fn largest(all: &[Multiplier]) -> f64 {
    all[0].growth
}

/// The same multipliers as an integration of all states with the classical Runge-Kutta method.
#[test]
fn analytic_a_sprung_mass_on_spans_agrees_with_runge_kutta() {
    for speed in [8.0, 25.0, 60.0] {
        let case = Case::new(speed);
        let (found, wanted) = (sizes(&case.monodromy(256).matrix), case.by_runge_kutta(8000));
        for (a, b) in found.iter().zip(&wanted).take(4) {
            // Runge-Kutta at this step: (ωh)⁴/120 per unit of phase, a few 1e-8
            assert!((a - b).abs() < 1e-6 * wanted[0], "{speed}: {found:?} {wanted:?}");
        }
    }
}

/// The error falls with the sixth power of the step.
#[test]
fn order_six_of_the_integration() {
    let case = Case::new(25.0);
    let at = |steps: usize| largest(&multipliers(&case.monodromy(steps)).unwrap().all);
    let exact = at(1024);
    let errors: Vec<f64> = [10, 20, 40].map(|steps| (at(steps) - exact).abs()).to_vec();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((5.5..6.8).contains(&order), "{errors:?}");
    }
}

/// A train that stands: over any time T the multipliers are e^{λT} of the coupled modes.
#[test]
fn analytic_at_standstill_multipliers_are_those_of_the_coupled_modes() {
    let case = Case::new(1.0);
    let train = Modal::new(&case.a, &case.b, &case.c, case.d.clone()).unwrap();
    let girders = Girders { carried: (0..8).map(|k| (k, k)).collect(), ..Case::girders() };
    let (place, time) = (4.0, 0.3);
    let rule = |_: f64, p: &mut Mat<f64>, q: &mut Mat<f64>| case.connection(place, p, q);
    let found = Monodromy::new(
        &train,
        &girders,
        &Rule { period: time, rule },
        &Mat::identity(2, 2),
        1.0,
        400,
    )
    .unwrap();
    let mut found: Vec<_> = found.matrix.eigenvalues().unwrap();
    for lambda in case.coupled(place).eigenvalues().unwrap() {
        let wanted = (lambda * time).exp();
        let nearest = (0..found.len())
            .min_by(|&a, &b| (found[a] - wanted).norm().total_cmp(&(found[b] - wanted).norm()))
            .unwrap();
        assert!((found.swap_remove(nearest) - wanted).norm() < 1e-9, "{wanted}");
    }
}

/// A chain of 30 masses between two ends that are shaken and felt: fewer states, nearly the same response.
#[test]
fn analytic_reduction_keeps_the_response() {
    let n = 30;
    let mut a = Mat::<f64>::zeros(2 * n, 2 * n);
    for k in 0..n {
        a[(k, n + k)] = 1.0;
        for (j, factor) in [(k, -2.0), (k.wrapping_sub(1), 1.0), (k + 1, 1.0)] {
            if j < n {
                a[(n + k, j)] += 400.0 * factor;
                a[(n + k, n + j)] += 3.0 * factor;
            }
        }
    }
    let ends = [n, 2 * n - 1];
    let b = Mat::from_fn(2 * n, 2, |i, j| if i == ends[j] { 400.0 } else { 0.0 });
    let c = Mat::from_fn(2, 2 * n, |i, j| if j == ends[i] - n { 400.0 } else { 0.0 });
    let full = Modal::new(&a, &b, &c, Mat::zeros(2, 2)).unwrap();
    let all = directions(&Mat::identity(2, 2)).unwrap();
    let loose = reduced(&full, &all, &all, 1e-3, (0.5, 40.0)).unwrap();
    let tight = reduced(&full, &all, &all, 1e-7, (0.5, 40.0)).unwrap();
    assert!(loose.states.1 < tight.states.1 && tight.states.1 <= 60, "{loose:?}");
    assert!(loose.error < 1e-2 && tight.error < 1e-5, "{} {}", loose.error, tight.error);
    let decays = |it: &Modal| it.slowest(0.0).is_some_and(|value| value.re < 0.0);
    assert!(decays(&loose.modal) && decays(&tight.modal));
}

/// Eight equal controllers under one body: their own modes have eightfold eigenvalues, and are separated.
#[test]
fn issue_equal_magnets_are_separated() {
    let (n, count) = (2 + 8 * 3, 8);
    let mut a = Mat::<f64>::zeros(n, n);
    (a[(0, 1)], a[(1, 0)], a[(1, 1)]) = (1.0, -300.0, -2.0);
    let (mut b, mut c) = (Mat::<f64>::zeros(n, count), Mat::<f64>::zeros(count, n));
    for k in 0..count {
        let i = 2 + 3 * k;
        for (row, column, value) in
            [(0, 1, 100.0), (1, 0, -1e4), (1, 1, -1e3), (2, 0, 5.0), (2, 2, -10.0)]
        {
            a[(i + row, i + column)] = value;
        }
        a[(i + 1, 0)] = -1e4;
        a[(1, i + 2)] = 40.0;
        b[(i + 1, k)] = 1e4;
        c[(k, i + 2)] = 1e3;
    }
    let modal = Modal::new(&a, &b, &c, Mat::zeros(count, count)).unwrap();
    // the force follows the third state of each controller, and all others act on it
    let states: usize = modal.values.iter().map(|it| if it.im > 0.0 { 2 } else { 1 }).sum();
    assert_eq!(states, n);
}
