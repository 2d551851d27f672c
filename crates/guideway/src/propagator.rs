//! Exact solution of the modal equations over a step.

use std::ops::Range;

use nalgebra::SMatrix;

use crate::block::{BlockStep, blocks};
use crate::{Girder, GirderMode, Guideway, State};

/// Times within a step at which modal forces are sampled.
pub const NODES: usize = 4;

/// Gauss-Legendre nodes on [0, 1].
///
/// The modal force over a step is the cubic through its values at these nodes, and the response
/// to that cubic is exact. A force that is itself a cubic (loads standing still, forces given as
/// polynomials up to order 3) therefore costs no accuracy at any step size. Otherwise, because
/// the nodes are those of Gauss quadrature, the error of one step falls with h⁹ and that of a run
/// with h⁸ (as long as ωh ≲ 1; with h⁴ beyond).
pub fn nodes() -> [f64; NODES] {
    // ±√(3/7 ∓ (2/7)√(6/5)) mapped from [−1, 1].
    let root = (6.0f64 / 5.0).sqrt();
    let inner = (3.0 / 7.0 - 2.0 / 7.0 * root).sqrt();
    let outer = (3.0 / 7.0 + 2.0 / 7.0 * root).sqrt();
    [0.5 * (1.0 - outer), 0.5 * (1.0 - inner), 0.5 * (1.0 + inner), 0.5 * (1.0 + outer)]
}

/// One mode over one step: z(h) = E·z(0) + Σⱼ gⱼ·f(cⱼh), z = (q, q̇), f the modal force (N).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ModeStep {
    pub free: [[f64; 2]; 2],
    pub forced: [[f64; 2]; NODES],
}

/// All modes over a step of one size.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModalPropagator {
    size: f64,
    modes: Vec<ModeStep>,
    /// By kind of girder: steps of modes that dampers couple. Empty if there are none.
    blocks: Vec<Option<BlockStep>>,
}

impl ModalPropagator {
    /// Advances all modes under their forces (N) at the nodes. `scratch` has room for twice the modes
    /// of a span.
    pub fn advance(
        &self,
        guideway: &Guideway,
        state: &mut State,
        forces: &[[f64; NODES]],
        scratch: &mut [f64],
    ) {
        let alone = |range: Range<usize>, state: &mut State| {
            for i in range {
                let (q, v) = (state.q[i], state.v[i]);
                (state.q[i], state.v[i]) = self.modes[i].advance(q, v, forces[i]);
            }
        };
        if self.blocks.is_empty() {
            return alone(0..self.modes.len(), state);
        }
        for span in guideway.spans() {
            let modes = guideway.girders()[span.girder].modes().len();
            let range = span.first_mode..span.first_mode + modes;
            match &self.blocks[span.girder] {
                None => alone(range, state),
                Some(block) => {
                    let (q, v) = (&mut state.q[range.clone()], &mut state.v[range.clone()]);
                    block.advance(q, v, &forces[range], scratch);
                }
            }
        }
    }
}

impl ModeStep {
    /// For a step h of a mode with mass M, circular frequency ω and damping ratio ζ.
    ///
    /// With θ = τ/h, y = (q, h·q̇) and the force p(θ) carried along as its own derivatives
    /// r = (p, p′, p″, p‴) the equation is linear with constant coefficients,
    /// d(y, r)/dθ = A·(y, r), so one matrix exponential gives response to state and to force.
    /// It holds for under-, critically and overdamped modes and for ω = 0 alike.
    pub fn new(mode: &GirderMode, h: f64) -> Self {
        let turn = mode.omega * h;
        // Rates in units of max(ωh, 1) so that A stays balanced for fast modes.
        let unit = turn.max(1.0);
        let mut a = SMatrix::<f64, 6, 6>::zeros();
        a[(0, 1)] = unit;
        a[(1, 0)] = -turn * turn / unit;
        a[(1, 1)] = -2.0 * mode.zeta * turn;
        // The response is linear in the force: compute it for h²p/(M·unit) = 1 and scale.
        let force = h * h / (mode.mass * unit);
        a[(1, 2)] = 1.0;
        for k in 2..5 {
            a[(k, k + 1)] = 1.0;
        }
        let e = exponential(&a);
        let rate = unit / h;
        let free = [[e[(0, 0)], e[(0, 1)] / rate], [e[(1, 0)] * rate, e[(1, 1)]]];
        let derivatives = derivatives_at_start();
        let forced = std::array::from_fn(|j| {
            let mut g = [0.0; 2];
            for k in 0..NODES {
                g[0] += e[(0, 2 + k)] * derivatives[k][j];
                g[1] += e[(1, 2 + k)] * derivatives[k][j];
            }
            [g[0] * force, g[1] * force * rate]
        });
        Self { free, forced }
    }

    /// (q, q̇) after the step, with the modal forces (N) at the nodes.
    pub fn advance(&self, q: f64, v: f64, forces: [f64; NODES]) -> (f64, f64) {
        let mut next = self.free.map(|row| row[0] * q + row[1] * v);
        for (g, f) in self.forced.iter().zip(forces) {
            next[0] += g[0] * f;
            next[1] += g[1] * f;
        }
        (next[0], next[1])
    }
}

/// Matrix exponential by Taylor's series of the scaled matrix and repeated squaring.
///
/// Scaled to a norm of at most ½, 18 terms leave ½¹⁹/19! = 2e-23. Written out here rather than
/// taken from a library so that the result does not depend on the platform's logarithm and power.
fn exponential(a: &SMatrix<f64, 6, 6>) -> SMatrix<f64, 6, 6> {
    let norm = a.row_iter().map(|row| row.lp_norm(1)).fold(0.0, f64::max);
    let (mut scaled, mut squarings) = (*a, 0u32);
    let mut size = norm;
    // The norm is finite: at most some 1100 halvings.
    while size > 0.5 && squarings < 1100 {
        (size, squarings) = (0.5 * size, squarings + 1);
        scaled *= 0.5;
    }
    let mut sum = SMatrix::<f64, 6, 6>::identity();
    for k in (1..=18).rev() {
        sum = SMatrix::identity() + scaled * sum / f64::from(k);
    }
    for _ in 0..squarings {
        sum = sum * sum;
    }
    sum
}

/// `d[k][j]`: k-th derivative at θ = 0 of the cubic that is 1 at node j and 0 at the others.
pub(crate) fn derivatives_at_start() -> [[f64; NODES]; NODES] {
    let c = nodes();
    let mut d = [[0.0; NODES]; NODES];
    for j in 0..NODES {
        let others: [f64; 3] = std::array::from_fn(|i| c[if i < j { i } else { i + 1 }]);
        let [a, b, e] = others;
        let scale = (c[j] - a) * (c[j] - b) * (c[j] - e);
        d[0][j] = -a * b * e / scale;
        d[1][j] = (a * b + a * e + b * e) / scale;
        d[2][j] = -2.0 * (a + b + e) / scale;
        d[3][j] = 6.0 / scale;
    }
    d
}

/// Propagators of the step sizes used last; not part of the state and without influence on it.
#[derive(Debug, Clone)]
pub(crate) struct PropagatorCache {
    entries: Vec<ModalPropagator>,
    next: usize,
}

impl PropagatorCache {
    const SIZE: usize = 4;

    pub fn new(modes: usize) -> Self {
        let still = ModeStep { free: [[0.0; 2]; 2], forced: [[0.0; 2]; NODES] };
        let empty =
            ModalPropagator { size: f64::NAN, modes: vec![still; modes], blocks: Vec::new() };
        Self { entries: vec![empty; Self::SIZE], next: 0 }
    }

    /// Index of the propagator for `h`, computed if it is not in the cache.
    pub fn get(&mut self, h: f64, modes: &[GirderMode], girders: &[Girder]) -> usize {
        if let Some(found) = self.entries.iter().position(|p| p.size.to_bits() == h.to_bits()) {
            return found;
        }
        let slot = self.next;
        self.next = (self.next + 1) % Self::SIZE;
        let entry = &mut self.entries[slot];
        entry.size = h;
        for i in 0..modes.len() {
            // Most spans are alike: reuse the propagator of an equal mode nearby.
            let twin = (0..i).rev().take(64).find(|&k| modes[k] == modes[i]);
            entry.modes[i] = match twin {
                Some(k) => entry.modes[k],
                None => ModeStep::new(&modes[i], h),
            };
        }
        entry.blocks = blocks(girders, h);
        slot
    }

    pub fn entry(&self, index: usize) -> &ModalPropagator {
        &self.entries[index]
    }
}

/// Largest phase in rad that the motion over the mode shapes, or the chirp, may change within one
/// sub-step.
///
/// At 0.25 rad the cubic through the nodes is off by at most 0.25⁴/(4!·70) = 2.3e-6 of the modal
/// force within the sub-step. The response of modes with ωh ≲ 1 is much more accurate, because
/// quadrature errors cancel at the end of the step.
pub const SUBSTEP_PHASE: f64 = 0.25;

#[cfg(test)]
mod tests {
    use super::*;

    /// Free response of M = 1: (E00, E01, E11) in closed form.
    fn closed_form(omega: f64, zeta: f64, h: f64) -> (f64, f64, f64) {
        let a = zeta * omega;
        if zeta > 1.0 && omega > 0.0 {
            let d = omega * (zeta * zeta - 1.0).sqrt();
            if d * h < 1.0 {
                let (c, s, decay) = ((d * h).cosh(), (d * h).sinh() / d, (-a * h).exp());
                return (decay * (c + a * s), decay * s, decay * (c - a * s));
            }
            // Beyond that hyperbolic functions would overflow.
            let (r, s) = (a - d, a + d);
            let (er, es) = ((-r * h).exp(), (-s * h).exp());
            return (
                (s * er - r * es) / (2.0 * d),
                (er - es) / (2.0 * d),
                (s * es - r * er) / (2.0 * d),
            );
        }
        let (c, s) = if zeta < 1.0 {
            let d = omega * (1.0 - zeta * zeta).sqrt();
            ((d * h).cos(), if d > 0.0 { (d * h).sin() / d } else { h })
        } else {
            (1.0, h)
        };
        let decay = (-a * h).exp();
        (decay * (c + a * s), decay * s, decay * (c - a * s))
    }

    #[test]
    fn analytic_free_response_of_all_kinds_of_damping() {
        for omega in [0.0, 1e-6, 44.6, 156.0, 1e4] {
            for zeta in [0.0, 0.0108, 0.999, 1.0, 1.001, 3.0] {
                for h in [1e-6, 1e-3, 0.1] {
                    let m = ModeStep::new(&GirderMode { mass: 1.0, omega, zeta }, h).free;
                    let (a, b, d) = closed_form(omega, zeta, h);
                    // Squaring of the exponential multiplies rounding by about ‖A‖ ≈ max(1, ωh)
                    // times the damping; hyperbolic closed forms lose as much themselves.
                    let tol = 1e-14 * (1.0 + omega * h) * (1.0 + zeta) * 4.0;
                    assert!((m[0][0] - a).abs() < tol, "{omega} {zeta} {h}: {} {a}", m[0][0]);
                    let scale = h.min(if omega > 0.0 { 1.0 / omega } else { h });
                    assert!((m[0][1] - b).abs() < tol * scale * 2.0, "{omega} {zeta} {h}");
                    assert!((m[1][1] - d).abs() < tol, "{omega} {zeta} {h}: {} {d}", m[1][1]);
                }
            }
        }
    }

    #[test]
    fn analytic_cubic_force_is_answered_exactly() {
        // Choose q(t) = 1 + 2t − 3t² + 4t³ and push with the force that this motion needs.
        let mode = GirderMode { mass: 2.5, omega: 7.0, zeta: 0.3 };
        let q = |t: f64| 1.0 + 2.0 * t - 3.0 * t * t + 4.0 * t * t * t;
        let v = |t: f64| 2.0 - 6.0 * t + 12.0 * t * t;
        let force = |t: f64| {
            mode.mass * (-6.0 + 24.0 * t) + mode.damping() * v(t) + mode.stiffness() * q(t)
        };
        for h in [1e-4, 0.1, 3.0] {
            let step = ModeStep::new(&mode, h);
            let z = [q(0.0), v(0.0)];
            for (row, expected) in [(0, q(h)), (1, v(h))] {
                let mut sum = step.free[row][0] * z[0] + step.free[row][1] * z[1];
                let mut size = sum.abs();
                for (j, c) in nodes().iter().enumerate() {
                    sum += step.forced[j][row] * force(c * h);
                    size += (step.forced[j][row] * force(c * h)).abs();
                }
                // Rounding relative to the largest term, amplified by the exponential (ωh ≤ 21).
                assert!((sum - expected).abs() < 1e-13 * (size + expected.abs()), "{h} {row}");
            }
        }
    }

    #[test]
    fn analytic_zero_frequency_is_a_free_mass() {
        let h = 0.3;
        let step = ModeStep::new(&GirderMode { mass: 4.0, omega: 0.0, zeta: 0.5 }, h);
        let [gq, gv] = step.forced.iter().fold([0.0; 2], |s, g| [s[0] + g[0], s[1] + g[1]]);
        assert_eq!(step.free, [[1.0, h], [0.0, 1.0]]);
        // Constant force of 1 N: h²/2M, h/M. The Lagrange weights add terms up to some 50 times
        // their sum.
        assert!((gq - h * h / 8.0).abs() < 1e-14 * gq && (gv - h / 4.0).abs() < 1e-14 * gv);
    }

    #[test]
    fn invariant_cache_gives_what_a_fresh_computation_gives() {
        let modes = [
            GirderMode { mass: 1.0, omega: 44.6, zeta: 0.01 },
            GirderMode { mass: 1.0, omega: 156.0, zeta: 0.02 },
            GirderMode { mass: 1.0, omega: 44.6, zeta: 0.01 },
        ];
        let mut cache = PropagatorCache::new(modes.len());
        for h in [1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 1e-3, 5e-3] {
            let at = cache.get(h, &modes, &[]);
            for (step, mode) in cache.entry(at).modes.iter().zip(&modes) {
                assert_eq!(*step, ModeStep::new(mode, h));
            }
        }
    }
}
