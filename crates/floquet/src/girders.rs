//! The girders under the train: equal blocks of oscillators.

use faer::Mat;
use nalgebra::DMatrix;

use crate::balance::scales;
use crate::collocation::{NODES, derivatives, nodes};

/// ẋ = A x + B f for several equal blocks, one after the other: the periods of a row of spans that the train touches
/// during one period of its motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Girders {
    /// A of one block.
    pub a: Mat<f64>,
    /// B of one block.
    pub b: Mat<f64>,
    /// Number of blocks.
    pub blocks: usize,
    /// States of a block that the other part sees, in this order.
    pub seen: Vec<usize>,
    /// Where each state at the beginning of a period comes from, as (its place, its place at the end of the period
    /// before). All other states are at rest at the beginning, and are dropped at the end.
    pub carried: Vec<(usize, usize)>,
}

impl Girders {
    /// A row of blocks: the first is fresh, each other one is what the block before it was a period ago, and the last
    /// is left behind.
    #[must_use]
    pub fn row(a: Mat<f64>, b: Mat<f64>, blocks: usize, seen: Vec<usize>) -> Self {
        let n = a.nrows();
        let carried = (n..n * blocks).map(|state| (state, state - n)).collect();
        Self { a, b, blocks, seen, carried }
    }

    /// One block that stays.
    #[must_use]
    pub fn alone(a: Mat<f64>, b: Mat<f64>, seen: Vec<usize>) -> Self {
        let carried = (0..a.nrows()).map(|state| (state, state)).collect();
        Self { a, b, blocks: 1, seen, carried }
    }

    /// States of all blocks.
    #[must_use]
    pub fn states(&self) -> usize {
        self.blocks * self.a.nrows()
    }

    /// Forces on all blocks.
    #[must_use]
    pub fn forces(&self) -> usize {
        self.blocks * self.b.ncols()
    }

    /// Seen states of all blocks.
    #[must_use]
    pub fn seen(&self) -> usize {
        self.blocks * self.seen.len()
    }
}

/// One step of all blocks, exact for forces that are polynomials through their values at the nodes.
pub(crate) struct GirderStep {
    /// Seen states at the nodes, one node after the other, per state at the beginning.
    pub seen_by_state: Mat<f64>,
    /// Seen states at the nodes per forces at the nodes.
    pub seen_by_force: Mat<f64>,
    /// States at the end per state at the beginning.
    pub end_by_state: Mat<f64>,
    /// States at the end per forces at the nodes.
    pub end_by_force: Mat<f64>,
}

impl GirderStep {
    pub fn new(girders: &Girders, h: f64) -> Self {
        let (n, m, blocks) = (girders.a.nrows(), girders.b.ncols(), girders.blocks);
        let (states, forces, seen) = (girders.states(), girders.forces(), girders.seen());
        let mut step = Self {
            seen_by_state: Mat::zeros(NODES * seen, states),
            seen_by_force: Mat::zeros(NODES * seen, NODES * forces),
            end_by_state: Mat::zeros(states, states),
            end_by_force: Mat::zeros(states, NODES * forces),
        };
        for (k, c) in nodes().into_iter().chain([1.0]).enumerate() {
            let (free, forced) = response(girders, h, c);
            for block in 0..blocks {
                let (first, push) = (block * n, block * m);
                if k == NODES {
                    for i in 0..n {
                        (0..n)
                            .for_each(|j| step.end_by_state[(first + i, first + j)] = free[(i, j)]);
                        for (node, forced) in forced.iter().enumerate() {
                            let column = node * forces + push;
                            (0..m).for_each(|j| {
                                step.end_by_force[(first + i, column + j)] = forced[(i, j)];
                            });
                        }
                    }
                    continue;
                }
                for (place, &i) in girders.seen.iter().enumerate() {
                    let row = k * seen + block * girders.seen.len() + place;
                    (0..n).for_each(|j| step.seen_by_state[(row, first + j)] = free[(i, j)]);
                    for (node, forced) in forced.iter().enumerate() {
                        let column = node * forces + push;
                        (0..m).for_each(|j| step.seen_by_force[(row, column + j)] = forced[(i, j)]);
                    }
                }
            }
        }
        step
    }
}

/// e^{Ach} of a block, and its response at c·h to forces that are 1 at one node of the step h and 0 at the others.
///
/// With τ = t/h and the force's derivatives r carried along as states, d(x, r)/dτ is linear with constant coefficients,
/// and one matrix exponential gives everything.
fn response(girders: &Girders, h: f64, c: f64) -> (DMatrix<f64>, [DMatrix<f64>; NODES]) {
    let (n, m) = (girders.a.nrows(), girders.b.ncols());
    let scale = scales(&girders.a);
    let size = n + NODES * m;
    let mut augmented = DMatrix::<f64>::zeros(size, size);
    for i in 0..n {
        (0..n).for_each(|j| augmented[(i, j)] = c * h * girders.a[(i, j)] * scale[j] / scale[i]);
        (0..m).for_each(|j| augmented[(i, n + j)] = c * h * girders.b[(i, j)] / scale[i]);
    }
    for k in n..size - m {
        augmented[(k, k + m)] = c;
    }
    let all = augmented.exp();
    let free = DMatrix::from_fn(n, n, |i, j| all[(i, j)] * scale[i] / scale[j]);
    let d = derivatives();
    let forced = std::array::from_fn(|node| {
        DMatrix::from_fn(n, m, |i, j| {
            let by_order = |order: usize| all[(i, n + order * m + j)] * d[order][node];
            scale[i] * (0..NODES).map(by_order).sum::<f64>()
        })
    });
    (free, forced)
}
