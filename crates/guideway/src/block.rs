//! Exact steps of modes that dampers of supports couple.

use nalgebra::DMatrix;

use crate::girder::DampingCoupling;
use crate::propagator::{NODES, derivatives_at_start};
use crate::{Girder, GirderMode};

/// Functions φ₀ … φ₄ of [`exponentials`].
const FUNCTIONS: usize = NODES + 1;

/// All modes of a girder over one step: z(h) = E·z(0) + Σⱼ Gⱼ·f(cⱼh), z = (q, q̇), f the modal forces.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BlockStep {
    /// E.
    free: DMatrix<f64>,
    /// Gⱼ side by side: column j·n + i is the response to the force on mode i at node j.
    forced: DMatrix<f64>,
}

impl BlockStep {
    /// For a step h. As for single modes, θ = τ/h and the rates are in units of max(ωh, 1)/h, so that
    /// the matrix stays balanced; the forces are the cubics through their values at the nodes.
    pub fn new(modes: &[GirderMode], coupling: &DampingCoupling, h: f64) -> Self {
        let n = modes.len();
        let unit = modes.iter().map(|mode| mode.omega * h).fold(1.0, f64::max);
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        let mut input = DMatrix::zeros(2 * n, n);
        for (i, mode) in modes.iter().enumerate() {
            let turn = mode.omega * h;
            a[(i, n + i)] = unit;
            a[(n + i, i)] = -turn * turn / unit;
            for (j, rate) in coupling.row(i).iter().enumerate() {
                a[(n + i, n + j)] = -rate * h;
            }
            a[(n + i, n + i)] = -2.0 * mode.zeta * turn;
            input[(n + i, i)] = h * h / (mode.mass * unit);
        }
        let functions = exponentials(&a);
        // from scaled rates to rates
        let rate = unit / h;
        let scale = |i: usize| if i < n { 1.0 } else { rate };
        let free =
            DMatrix::from_fn(2 * n, 2 * n, |i, j| functions[0][(i, j)] * scale(i) / scale(j));
        let derivatives = derivatives_at_start();
        let mut forced = DMatrix::zeros(2 * n, NODES * n);
        for (k, derivative) in derivatives.iter().enumerate() {
            let response = product(&functions[k + 1], &input);
            for j in 0..NODES {
                for i in 0..n {
                    for row in 0..2 * n {
                        forced[(row, j * n + i)] += response[(row, i)] * derivative[j] * scale(row);
                    }
                }
            }
        }
        Self { free, forced }
    }

    /// Advances q and q̇ under the modal forces (N) at the nodes. `next` is scratch memory for at least
    /// twice as many numbers as there are modes.
    pub fn advance(&self, q: &mut [f64], v: &mut [f64], forces: &[[f64; NODES]], next: &mut [f64]) {
        let n = q.len();
        let next = &mut next[..2 * n];
        next.fill(0.0);
        let mut add = |column: &[f64], by: f64| {
            for (sum, c) in next.iter_mut().zip(column) {
                *sum += c * by;
            }
        };
        let (free, forced) = (self.free.as_slice(), self.forced.as_slice());
        for (column, &by) in free.chunks_exact(2 * n).zip(q.iter().chain(v.iter())) {
            add(column, by);
        }
        for (k, column) in forced.chunks_exact(2 * n).enumerate() {
            add(column, forces[k % n][k / n]);
        }
        q.copy_from_slice(&next[..n]);
        v.copy_from_slice(&next[n..]);
    }
}

/// One block for every kind of girder whose modes are coupled; no list if none are.
pub(crate) fn blocks(girders: &[Girder], h: f64) -> Vec<Option<BlockStep>> {
    if girders.iter().all(|girder| girder.coupling().is_none()) {
        return Vec::new();
    }
    let block = |girder: &Girder| Some(BlockStep::new(girder.modes(), girder.coupling()?, h));
    girders.iter().map(block).collect()
}

/// φ₀ = exp(A) and φₖ(A) = Σᵢ Aⁱ/(i+k)!, the responses to forces that grow as θᵏ⁻¹/(k−1)!.
///
/// Taylor's series of the scaled matrix, then φₖ(2A) = 2⁻ᵏ(φ₀φₖ + Σⱼ φⱼ/(k−j)!), j = 1 … k. Source:
/// Skaflestad & Wright, *Applied Numerical Mathematics* 59 (2009) 783. Scaled to a norm of at most ½,
/// 18 terms leave ½¹⁹/19! = 2e-23.
fn exponentials(a: &DMatrix<f64>) -> [DMatrix<f64>; FUNCTIONS] {
    let size = a.nrows();
    let unit = DMatrix::<f64>::identity(size, size);
    let norm = a.row_iter().map(|row| row.iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    let (mut scaled, mut squarings, mut length) = (a.clone(), 0u32, norm);
    while length > 0.5 && squarings < 1100 {
        (length, squarings) = (0.5 * length, squarings + 1);
        scaled *= 0.5;
    }
    let mut functions: [DMatrix<f64>; FUNCTIONS] = std::array::from_fn(|_| unit.clone());
    // φ₄ by Horner's rule, its lowest term 1/4!
    let last = FUNCTIONS - 1;
    let mut sum = unit.clone();
    for i in (1..=18).rev() {
        sum = &unit + product(&scaled, &sum) / f64::from(i + last as u32);
    }
    functions[last] = sum / factorial(last);
    for k in (0..last).rev() {
        functions[k] = product(&scaled, &functions[k + 1]) + &unit / factorial(k);
    }
    for _ in 0..squarings {
        let twice = |k: usize| {
            let mut sum = product(&functions[0], &functions[k]);
            for (j, function) in functions.iter().enumerate().take(k + 1).skip(1) {
                sum += function / factorial(k - j);
            }
            sum / f64::from(1u32 << k)
        };
        functions = std::array::from_fn(twice);
    }
    functions
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|i| i as f64).product()
}

/// a·b, column by column: the library's product for large matrices would choose other instructions on
/// other processors.
fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut result = DMatrix::zeros(a.nrows(), b.ncols());
    for (mut column, by) in result.column_iter_mut().zip(b.column_iter()) {
        for (k, &value) in by.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            column.axpy(value, &a.column(k), 1.0);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagator::ModeStep;

    fn modes() -> [GirderMode; 2] {
        [
            GirderMode { mass: 2.0, omega: 7.0, zeta: 0.05 },
            GirderMode { mass: 3.0, omega: 20.0, zeta: 0.1 },
        ]
    }

    fn coupling(rates: [f64; 4]) -> DampingCoupling {
        DampingCoupling::new(rates.to_vec(), 2)
    }

    #[test]
    fn invariant_without_coupling_it_is_the_step_of_single_modes() {
        for h in [1e-4, 0.05, 2.0] {
            let block = BlockStep::new(&modes(), &coupling([0.0; 4]), h);
            let (mut q, mut v) = ([0.3, -0.2], [1.0, 2.0]);
            let forces = [[5.0, 6.0, -7.0, 8.0], [1.0, 0.0, 3.0, 2.0]];
            let alone: Vec<(f64, f64)> = (0..2)
                .map(|i| ModeStep::new(&modes()[i], h).advance(q[i], v[i], forces[i]))
                .collect();
            block.advance(&mut q, &mut v, &forces, &mut [0.0; 4]);
            for i in 0..2 {
                // rounding is amplified by squaring: ωh ≤ 40
                assert!((q[i] - alone[i].0).abs() < 1e-13, "{h}: {} {}", q[i], alone[i].0);
                assert!((v[i] - alone[i].1).abs() < 1e-12, "{h}: {} {}", v[i], alone[i].1);
            }
        }
    }

    /// q₁ = 1 + 2t − 3t² + 4t³, q₂ = t² − t³ with the forces that this motion needs.
    #[test]
    fn analytic_cubic_forces_on_coupled_modes_are_answered_exactly() {
        let (modes, rates) = (modes(), [0.0, 0.6, 0.4, 0.0]);
        let q = |t: f64| [1.0 + t * (2.0 + t * (-3.0 + 4.0 * t)), t * t * (1.0 - t)];
        let v = |t: f64| [2.0 + t * (-6.0 + 12.0 * t), t * (2.0 - 3.0 * t)];
        let a = |t: f64| [-6.0 + 24.0 * t, 2.0 - 6.0 * t];
        let force = |i: usize, t: f64| {
            let coupled = rates[2 * i] * v(t)[0] + rates[2 * i + 1] * v(t)[1];
            let m = &modes[i];
            m.mass * (a(t)[i] + coupled) + m.damping() * v(t)[i] + m.stiffness() * q(t)[i]
        };
        for h in [1e-3, 0.1, 1.0] {
            let block = BlockStep::new(&modes, &coupling(rates), h);
            let (mut z, mut rate) = (q(0.0), v(0.0));
            let forces = [0, 1].map(|i| crate::propagator::nodes().map(|node| force(i, node * h)));
            block.advance(&mut z, &mut rate, &forces, &mut [0.0; 4]);
            for i in 0..2 {
                assert!((z[i] - q(h)[i]).abs() < 1e-12, "{h} {i}: {} {}", z[i], q(h)[i]);
                assert!((rate[i] - v(h)[i]).abs() < 1e-11, "{h} {i}: {} {}", rate[i], v(h)[i]);
            }
        }
    }
}
