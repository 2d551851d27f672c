//! Coupling of order 6: Hermite polynomials of degree 5 between exact units with second derivatives.

use super::*;
use coupling::signal::Signal;

const ITERATED: AlgorithmName = AlgorithmName::Iterated;
const NEWTON: AlgorithmName = AlgorithmName::Newton;

/// One of the two masses, stepped exactly: x'' = −ω² x + k_c u, where u has degree 5.
#[derive(Clone)]
struct Exact {
    /// ω², 1/s²
    square: f64,
    x: f64,
    v: f64,
    other: Taylor,
    /// highest derivative that it returns
    offered: usize,
    saved: [(f64, f64); PLACES],
}

impl Exact {
    /// The polynomial q that solves q'' + ω² q = k_c u, from its highest coefficient down.
    fn particular(&self) -> Taylor {
        let mut q = [0.0; COEFFICIENTS + 2];
        for k in (0..COEFFICIENTS).rev() {
            q[k] = (COUPLING * self.other[k] - q[k + 2]) / self.square;
        }
        Taylor(std::array::from_fn(|k| q[k]))
    }
}

impl Unit for Exact {
    type Error = ();

    fn capabilities(&self) -> Capabilities {
        Capabilities { directional: false, ..ABLE }
    }

    fn save(&mut self, place: usize) -> Result<(), ()> {
        self.saved[place] = (self.x, self.v);
        Ok(())
    }

    fn restore(&mut self, place: usize) -> Result<(), ()> {
        (self.x, self.v) = self.saved[place];
        Ok(())
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), ()> {
        self.other = inputs.reals[0];
        Ok(())
    }

    fn step(&mut self, _: f64, size: f64) -> Result<(), ()> {
        let (q, omega) = (self.particular(), self.square.sqrt());
        let (sin, cos) = (omega * size).sin_cos();
        let (x, v) = (self.x - q[0], self.v - q[1]);
        self.x = q.value(size) + x * cos + v / omega * sin;
        self.v = q.rate(size) - omega * x * sin + v * cos;
        self.other = self.other.shifted(size);
        Ok(())
    }

    fn receive(&mut self, _: f64, outputs: &mut UnitValues) -> Result<(), ()> {
        let bend = COUPLING * self.other[0] - self.square * self.x;
        let mut point = [self.x, self.v, bend, f64::NAN];
        point[self.offered + 1..].fill(f64::NAN);
        outputs.reals[0] = Taylor::cubic(point);
        Ok(())
    }
}

/// Thrown at each other, as [`thrown`].
fn exact_masses(offered: [usize; 2]) -> [Exact; 2] {
    let mass = |square, v, offered| Exact {
        square,
        x: 0.0,
        v,
        other: Taylor::ZERO,
        offered,
        saved: [(0.0, 0.0); PLACES],
    };
    [mass(110.0, 100.0, offered[0]), mass(1100.0, -100.0, offered[1])]
}

/// Error of the positions after a second, relative to the largest of the closed form, with inputs that take
/// derivatives up to `limit`.
fn error(name: AlgorithmName, offered: [usize; 2], limit: usize, h: f64) -> f64 {
    let mut units = exact_masses(offered);
    let link = |unit| RealLink { unit: UnitIndex(unit), limit, ..LINK };
    let unit = |from, offered| Links {
        reals: vec![link(from)],
        offered: vec![offered],
        bends: true,
        ..Links::default()
    };
    let links = vec![unit(1, offered[0]), unit(0, offered[1])];
    let mut exchange = Exchange::new(links, 2);
    exchange.start(0.0, &mut units).unwrap();
    let mut coupling = Coupling::new(&whole(name, [0, 1]), &exchange, &Arc::default());
    for n in 0..(1.0 / h).round() as u32 {
        coupling.step(&mut exchange, &mut units, f64::from(n) * h, h).unwrap();
        assert!(coupling.converged());
    }
    let truth = exact(1.0);
    distance([units[0].x, units[1].x], truth) / truth[0].hypot(truth[1])
}

/// The mark of a polynomial of degree 5: the error falls by 2⁶, and is near a thousandth of the cubic's at the step
/// of the prototype.
#[test]
fn order_six_with_second_derivatives() {
    for name in [ITERATED, NEWTON] {
        let fine = error(name, [2, 2], 5, 1.0 / 160.0);
        let observed = (error(name, [2, 2], 5, 1.0 / 80.0) / fine).log2();
        assert!((observed - 6.0).abs() < SLACK, "{name:?}: {observed:.3}");
    }
    let (cubic, quintic) = (error(ITERATED, [1, 1], 5, 0.0125), error(ITERATED, [2, 2], 5, 0.0125));
    println!("h = 0.0125: cubic {cubic:.1e}, quintic {quintic:.1e}");
    assert!(quintic < 2e-3 * cubic && quintic < 1e-8, "{cubic:e} {quintic:e}");
}

/// The coupling has the order of its weakest signal: a source without second derivatives, or a target that
/// takes derivatives up to the third order only.
#[test]
fn order_four_where_second_derivatives_are_missing() {
    for (offered, limit) in [([2, 1], 5), ([1, 2], 5), ([2, 2], 3)] {
        let coarse = error(ITERATED, offered, limit, 1.0 / 80.0);
        let observed = (coarse / error(ITERATED, offered, limit, 1.0 / 160.0)).log2();
        assert!((observed - 4.0).abs() < SLACK, "{offered:?} {limit}: {observed:.3}");
    }
}

/// A function of degree 5 over its step, as a target gets it that takes all of it, or a cubic.
#[test]
fn analytic_degree_five_is_interpolated_exactly() {
    let (p, h) = (Taylor([1.0, -2.0, 3.0, 6.0, -50.0, 400.0]), 0.5);
    let mut signal = Signal::new(2, 2).with_bends();
    signal.restart(p.up_to(2));
    signal.extrapolate(h);
    let end = p.shifted(h);
    signal.advance(end.up_to(2), h);
    signal.interpolate(h);
    let found = signal.polynomial(5, h);
    for (found, expected) in found.0.iter().zip(p.0) {
        assert!((found - expected).abs() < 1e-10 * expected.abs(), "{found} {expected}");
    }
    let cubic = signal.polynomial(4, h);
    assert_eq!(cubic.0[4..], [0.0; 2]);
    assert!((cubic.value(h) - end[0]).abs() < 1e-12 && (cubic.rate(h) - end[1]).abs() < 1e-12);
    // after a kink at its beginning: the cubic through the value there, without the slope
    let cube = Taylor::cubic([1.0, -2.0, 3.0, 6.0]);
    signal.restart(Taylor::cubic([1.0, f64::NAN, f64::NAN, f64::NAN]));
    signal.extrapolate(h);
    signal.set_effect(coupling::signal::Effect::Kink);
    signal.advance(cube.shifted(h).up_to(2), h);
    signal.interpolate(h);
    for (found, expected) in signal.polynomial(5, h).0.iter().zip(cube.0) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}
