//! Orders of the algorithms on the two-mass oscillator, split between the masses: each unit gets
//! the other mass's position and velocity and integrates its own equation exactly enough.

#![allow(clippy::unwrap_used, reason = "a test program")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]

mod acceleration;
mod control;
mod implicit;
mod kinks;
mod order_six;
mod signal;
mod taylor;

use std::sync::Arc;

use coupling::*;
use scenario::algorithm::{AlgorithmName, IterationSettings};

/// One mass on its own spring, tied by the coupling spring to the other mass, whose position
/// arrives as a polynomial: m x'' = −k x + k_c (x_other − x) + f(t).
#[derive(Clone)]
struct Mass {
    able: Capabilities,
    saved: [Option<(f64, f64)>; PLACES],
    force: fn(f64) -> f64,
    time: f64,
    stiffness: f64,
    x: f64,
    v: f64,
    other: Taylor,
    offered: usize,
}

const COUPLING: f64 = 100.0;

impl Mass {
    fn acceleration(&self, x: f64, tau: f64) -> f64 {
        COUPLING * (self.other.value(tau) - x) - self.stiffness * x + (self.force)(self.time + tau)
    }
}

/// A unit with every capability.
const ABLE: Capabilities = Capabilities { restore: true, variable_step: true, directional: true };

impl Unit for Mass {
    type Error = ();

    fn capabilities(&self) -> Capabilities {
        self.able
    }

    fn save(&mut self, place: usize) -> Result<(), ()> {
        assert!(self.able.restore);
        self.saved[place] = Some((self.x, self.v));
        Ok(())
    }

    fn restore(&mut self, place: usize) -> Result<(), ()> {
        (self.x, self.v) = self.saved[place].ok_or(())?;
        Ok(())
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), ()> {
        self.other = inputs.reals[0];
        Ok(())
    }

    /// RK4 in twenty substeps: at h = 10 ms its error per unit of time, (33/s · 0.5 ms)^4 · 33/s /
    /// 120 ≈ 2e-8, stays far below that of the coupling.
    fn step(&mut self, time: f64, size: f64) -> Result<(), ()> {
        self.time = time;
        let n = 20;
        let d = size / f64::from(n);
        for k in 0..n {
            let tau = f64::from(k) * d;
            let (x, v) = (self.x, self.v);
            let a1 = self.acceleration(x, tau);
            let a2 = self.acceleration(x + d / 2.0 * v, tau + d / 2.0);
            let a3 = self.acceleration(x + d / 2.0 * v + d * d / 4.0 * a1, tau + d / 2.0);
            let a4 = self.acceleration(x + d * v + d * d / 2.0 * a2, tau + d);
            self.x += d * v + d * d / 6.0 * (a1 + a2 + a3);
            self.v += d / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
        Ok(())
    }

    fn receive(&mut self, _time: f64, outputs: &mut UnitValues) -> Result<(), ()> {
        let mut point = [self.x, self.v, f64::NAN, f64::NAN];
        point[self.offered + 1..].fill(f64::NAN);
        outputs.reals[0] = Taylor::cubic(point);
        Ok(())
    }
}

/// The benchmark: no force, thrown at each other.
fn thrown(offered: usize) -> [Mass; 2] {
    let mass = |stiffness, v| Mass {
        able: ABLE,
        saved: [None; PLACES],
        force: |_| 0.0,
        time: 0.0,
        stiffness,
        x: 0.0,
        v,
        other: Taylor::ZERO,
        offered,
    };
    [mass(10.0, 100.0), mass(1000.0, -100.0)]
}

/// At rest, then pushed so gently that what history lacks at the start is zero anyway.
fn pushed(offered: usize) -> [Mass; 2] {
    let mut masses = thrown(offered);
    for (mass, force) in masses.iter_mut().zip([|t: f64| 1e5 * t.powi(4), |_| 0.0]) {
        mass.v = 0.0;
        mass.force = force;
    }
    masses
}

/// The first output of the first unit feeds the first input.
const LINK: RealLink = RealLink {
    input: InputIndex(0),
    unit: UnitIndex(0),
    output: OutputIndex(0),
    factor: 1.0,
    offset: 0.0,
    limit: 3,
    degree: None,
    held: false,
    kinks: false,
};

fn links(offered: usize) -> Vec<Links> {
    let link = |unit| RealLink { unit: UnitIndex(unit), ..LINK };
    let unit = |from| Links { reals: vec![link(from)], offered: vec![offered], ..Links::default() };
    vec![unit(1), unit(0)]
}

/// An algorithm for both masses.
fn whole(name: AlgorithmName, order: [usize; 2]) -> Schedule {
    // far below the errors of the coupling, above rounding
    let iteration = IterationSettings { tolerance: 1e-13, ..IterationSettings::default() };
    Schedule::whole(name, iteration, order.map(UnitIndex).to_vec())
}

const JACOBI: AlgorithmName = AlgorithmName::Jacobi;
const SEIDEL: AlgorithmName = AlgorithmName::GaussSeidel;

/// Positions at t = 1 s.
fn positions(schedule: &Schedule, mut units: [Mass; 2], degree: usize, h: f64) -> [f64; 2] {
    let mut exchange = Exchange::new(links(units[0].offered), degree);
    exchange.start(0.0, &mut units).unwrap();
    let mut coupling = Coupling::new(schedule, &exchange, &Arc::default());
    let steps = (1.0 / h).round() as u32;
    for n in 0..steps {
        coupling.step(&mut exchange, &mut units, f64::from(n) * h, h).unwrap();
    }
    [units[0].x, units[1].x]
}

/// x(t) by the two natural modes of the undamped oscillator: the closed form.
fn exact(t: f64) -> [f64; 2] {
    // K = [[110, -100], [-100, 1100]], M = 1
    let (a, b, c) = (110.0_f64, -100.0, 1100.0);
    let mean = (a + c) / 2.0;
    let root = ((a - c) / 2.0).hypot(b);
    let mut x = [0.0; 2];
    for lambda in [mean - root, mean + root] {
        let shape = [b, lambda - a];
        let norm = shape[0].hypot(shape[1]);
        let (s0, s1) = (shape[0] / norm, shape[1] / norm);
        let velocity = 100.0 * s0 - 100.0 * s1;
        let q = velocity / lambda.sqrt() * (lambda.sqrt() * t).sin();
        x[0] += s0 * q;
        x[1] += s1 * q;
    }
    x
}

fn distance(x: [f64; 2], y: [f64; 2]) -> f64 {
    (x[0] - y[0]).hypot(x[1] - y[1])
}

/// Observed order between steps of 2 and 1 ms.
fn order(schedule: &Schedule, units: &[Mass; 2], degree: usize, truth: [f64; 2]) -> f64 {
    let error = |h| distance(positions(schedule, units.clone(), degree, h), truth);
    (error(2e-3) / error(1e-3)).log2()
}

/// The pushed masses with the best coupling and a tenth of the step: its error is 1e-4 of those
/// that are compared with it.
fn pushed_truth() -> [f64; 2] {
    positions(&whole(SEIDEL, [0, 1]), pushed(1), 3, 1e-4)
}

#[test]
fn golden_closed_form_is_the_published_solution() {
    // Schweizer, Li & Lu's two-mass benchmark; the digits given there
    let x = exact(10.0);
    assert!((x[0] + 4.460_797_49).abs() < 5e-9 && (x[1] + 0.964_932_84).abs() < 5e-9, "{x:?}");
}

// The global error of an explicit coupling with inputs of error O(h^(N+1)) is of order N + 1. The
// leading error term dominates within h·ω = 2e-3·33 = 0.07, so the observed order deviates from
// the true one by about that times a constant of a few: 0.3 is allowed.
const SLACK: f64 = 0.3;

#[test]
fn order_jacobi_is_one_more_than_the_extrapolation() {
    let truth = pushed_truth();
    for offered in [0, 1] {
        for degree in 0..=3 {
            let observed = order(&whole(JACOBI, [0, 1]), &pushed(offered), degree, truth);
            let expected = degree as f64 + 1.0;
            assert!((observed - expected).abs() < SLACK, "d={offered} N={degree}: {observed:.3}");
        }
    }
}

/// One of the two signals stays extrapolated, so the order is that of Jacobi, or better.
#[test]
fn order_gauss_seidel_is_at_least_that_of_jacobi() {
    let truth = pushed_truth();
    for offered in [0, 1] {
        for degree in 0..=3 {
            let observed = order(&whole(SEIDEL, [0, 1]), &pushed(offered), degree, truth);
            let expected = degree as f64 + 1.0;
            assert!(observed > expected - SLACK, "d={offered} N={degree}: {observed:.3}");
        }
    }
}

/// At a start with motion, history is missing: the first step's inputs are of degree d (the
/// derivatives on offer) at best, which leaves an error of h^(d+2) once and for all. With d = 1 it
/// does not show here: the masses start at rest positions, so their acceleration is zero anyway.
#[test]
fn order_is_limited_by_a_start_with_motion() {
    for offered in [0, 1] {
        for degree in 0..=3 {
            let observed = order(&whole(JACOBI, [0, 1]), &thrown(offered), degree, exact(1.0));
            let limit = if offered == 0 { 2 } else { 4 };
            let expected = (degree + 1).min(limit) as f64;
            assert!((observed - expected).abs() < SLACK, "d={offered} N={degree}: {observed:.3}");
        }
    }
}

/// Interpolating one side must pay: the error is smaller than Jacobi's at the same step.
#[test]
fn invariant_gauss_seidel_beats_jacobi() {
    for degree in [0, 1, 2] {
        let error = |x| distance(x, exact(1.0));
        let jacobi = error(positions(&whole(JACOBI, [0, 1]), thrown(1), degree, 1e-3));
        let seidel = error(positions(&whole(SEIDEL, [1, 0]), thrown(1), degree, 1e-3));
        assert!(seidel < jacobi, "N={degree}: {seidel:e} {jacobi:e}");
    }
}

#[test]
fn analytic_units_are_converted_with_factor_and_offset() {
    struct Probe(Taylor);
    impl Unit for Probe {
        type Error = ();
        fn send(&mut self, inputs: &UnitValues) -> Result<(), ()> {
            if let Some(input) = inputs.reals.first() {
                self.0 = *input;
            }
            Ok(())
        }
        fn step(&mut self, _: f64, _: f64) -> Result<(), ()> {
            Ok(())
        }
        fn receive(&mut self, time: f64, outputs: &mut UnitValues) -> Result<(), ()> {
            if let Some(output) = outputs.reals.first_mut() {
                *output = Taylor::cubic([3.0 + time, 1.0, 0.0, 0.0]);
            }
            Ok(())
        }
    }
    let link = RealLink { factor: 2.0, offset: 10.0, ..LINK };
    let links = vec![
        Links { offered: vec![1], ..Links::default() },
        Links { reals: vec![link], ..Links::default() },
    ];
    let mut units = [Probe(Taylor::ZERO), Probe(Taylor::ZERO)];
    let mut exchange = Exchange::new(links, 1);
    exchange.start(0.0, &mut units).unwrap();
    let whole =
        Schedule::whole(JACOBI, IterationSettings::default(), vec![UnitIndex(0), UnitIndex(1)]);
    let mut coupling = Coupling::new(&whole, &exchange, &Arc::default());
    coupling.step(&mut exchange, &mut units, 0.0, 1.0).unwrap();
    assert_eq!(units[1].0, Taylor::cubic([16.0, 2.0, 0.0, 0.0]));
}

/// A run that continues from the bytes of a state in a fresh exchange gives the same bits.
#[test]
fn invariant_states_of_the_exchange_continue_exactly() {
    let h = 1e-3;
    for name in AlgorithmName::ALL {
        let run = |stop_over: bool| {
            let schedule = whole(name, [0, 1]);
            let mut units = thrown(1);
            let mut exchange = Exchange::new(links(1), 3);
            let mut coupling = Coupling::new(&schedule, &exchange, &Arc::default());
            exchange.start(0.0, &mut units).unwrap();
            for n in 0..20 {
                if stop_over && n == 7 {
                    let kept = (exchange.state(), coupling.state());
                    let bytes = postcard::to_stdvec(&kept).unwrap();
                    let (signals, memory): (ExchangeState, Vec<Vec<u8>>) =
                        postcard::from_bytes(&bytes).unwrap();
                    exchange = Exchange::new(links(1), 3);
                    assert!(exchange.restore(&signals));
                    coupling = Coupling::new(&schedule, &exchange, &Arc::default());
                    assert!(coupling.restore(&memory));
                }
                coupling.step(&mut exchange, &mut units, f64::from(n) * h, h).unwrap();
            }
            [units[0].x.to_bits(), units[1].x.to_bits()]
        };
        assert_eq!(run(false), run(true), "{name:?}");
    }
    let other = Exchange::new(links(0), 3);
    let restored = Exchange::new(links(1), 3).restore(other.state());
    assert!(!restored, "the units provide other derivatives");
}

/// A connection may have a degree of its own: with the general degree of one signal lowered, the
/// other's stays.
#[test]
fn order_follows_the_degree_of_the_connection() {
    let mut links = links(0);
    links[0].reals[0].degree = Some(0);
    let mut exchange = Exchange::new(links, 2);
    exchange.start(0.0, &mut pushed(0)).unwrap();
    let of = |k| exchange.sources(UnitIndex(k)).map(|source| source.1);
    let ids: Vec<SignalIndex> = of(0).chain(of(1)).collect();
    for n in 1..=4 {
        let mut units = pushed(0);
        units.iter_mut().for_each(|unit| unit.x = f64::from(n));
        exchange.read_outputs(f64::from(n), &mut units, 1.0).unwrap();
    }
    exchange.extrapolate(1.0);
    let end = |id: SignalIndex| exchange.signal(id).predicted()[0];
    assert_eq!([end(ids[0]), end(ids[1])], [4.0, 5.0]);
}

/// Threads share units out, not results: the same bits.
#[test]
fn invariant_threads_do_not_change_a_bit() {
    let run = |threads| {
        let n = 9;
        // a ring of masses, each tied to the one before
        let link = |k: usize| RealLink { unit: UnitIndex((k + n - 1) % n), ..LINK };
        let links =
            (0..n).map(|k| Links { reals: vec![link(k)], offered: vec![1], ..Links::default() });
        let mut units: Vec<Mass> = (0..n).map(|k| thrown(1)[k % 2].clone()).collect();
        let mut exchange = Exchange::new(links.collect(), 2);
        exchange.start(0.0, &mut units).unwrap();
        let workers = Arc::new(Workers::new(threads));
        let iteration = IterationSettings::default();
        let mut bits = Vec::new();
        for name in AlgorithmName::ALL {
            // every second unit first: two phases of independent units
            let order = (0..n).step_by(2).chain((1..n).step_by(2)).map(UnitIndex).collect();
            let schedule = Schedule::whole(name, iteration, order);
            let mut coupling = Coupling::new(&schedule, &exchange, &workers);
            for step in 0..20 {
                let time = f64::from(step) * 1e-3;
                coupling.step(&mut exchange, &mut units, time, 1e-3).unwrap();
            }
            bits.extend(units.iter().map(|unit| unit.x.to_bits()));
        }
        bits
    };
    assert_eq!(run(1), run(3));
}
