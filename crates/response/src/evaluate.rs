//! Values of a transfer function at many frequencies.
//!
//! A is brought to Hessenberg form H = Qᵀ A Q once, after a scaling of the states. Then every frequency
//! costs the elimination of one subdiagonal, n² operations, and a triangular solution for every input
//! (Laub 1981, "Efficient multivariable frequency response computations"). Unlike modal sums this is as
//! accurate for eigenvectors that are nearly parallel, as those of many equal magnets are.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::hessenberg::{hessenberg_in_place, hessenberg_in_place_scratch};
use faer::linalg::householder::{
    apply_block_householder_sequence_on_the_right_in_place_scratch,
    apply_block_householder_sequence_on_the_right_in_place_with_conj as apply_on_the_right,
};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::prelude::c64;
use faer::{Conj, Mat, MatMut, MatRef, Par};

use crate::model::{Domain, Model};

/// Up to this many inputs are solved without blocks.
const FEW: usize = 4;
/// Columns of a block of reflections.
const BLOCK: usize = 32;

/// A transfer function that is ready to be evaluated.
#[derive(Debug, Clone)]
pub struct Evaluator {
    states: usize,
    /// H, row by row.
    h: Vec<f64>,
    b: Mat<f64>,
    c: Mat<c64>,
    d: Mat<f64>,
    domain: Domain,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct Scratch {
    w: Vec<c64>,
    x: Vec<c64>,
}

impl Evaluator {
    /// Transforms a model.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let model = model.reduced();
        let n = model.a.nrows();
        let linear::eigen::Balanced { matrix: mut a, scale } = linear::eigen::balanced(&model.a);
        // x = scale · x', with the scaled matrix D⁻¹ A D
        let b = Mat::from_fn(n, model.b.ncols(), |i, j| model.b[(i, j)] / scale[i]);
        let c = Mat::from_fn(model.c.nrows(), n, |i, j| model.c[(i, j)] * scale[j]);
        let mut q = Mat::<f64>::identity(n, n);
        if n > 2 {
            reduce(&mut a, &mut q);
        }
        let h = (0..n * n).map(|k| (k / n, k % n));
        let h = h.map(|(i, j)| if i > j + 1 { 0.0 } else { a[(i, j)] }).collect();
        let c = c * &q;
        Self {
            states: n,
            h,
            b: q.transpose() * b,
            c: Mat::from_fn(c.nrows(), n, |i, j| c64::new(c[(i, j)], 0.0)),
            d: model.d,
            domain: model.domain,
        }
    }

    /// Continuous or sampled.
    #[must_use]
    pub fn domain(&self) -> Domain {
        self.domain
    }

    /// All entries at an angular frequency (rad/s). They are not finite at a pole.
    #[must_use]
    pub fn at(&self, omega: f64, scratch: &mut Scratch) -> Mat<c64> {
        let m = self.b.ncols();
        scratch.x.clear();
        let rows = (0..self.states).flat_map(|i| (0..m).map(move |j| (i, j)));
        scratch.x.extend(rows.map(|at| c64::new(self.b[at], 0.0)));
        self.solve(self.domain.point(omega), m, scratch);
        let x = MatRef::from_row_major_slice(&scratch.x, self.states, m);
        let mut y = &self.c * x;
        for j in 0..m {
            for i in 0..y.nrows() {
                y[(i, j)] += self.d[(i, j)];
            }
        }
        y
    }

    /// One entry at an angular frequency (rad/s).
    #[must_use]
    pub fn entry(&self, (output, input): (usize, usize), omega: f64, scratch: &mut Scratch) -> c64 {
        scratch.x.clear();
        scratch.x.extend((0..self.states).map(|i| c64::new(self.b[(i, input)], 0.0)));
        self.solve(self.domain.point(omega), 1, scratch);
        let y: c64 = (0..self.states).map(|j| self.c[(output, j)] * scratch.x[j]).sum();
        y + self.d[(output, input)]
    }

    /// x ← (σI − H)⁻¹ x, of m columns.
    fn solve(&self, sigma: c64, m: usize, Scratch { w, x }: &mut Scratch) {
        let n = self.states;
        w.clear();
        w.extend(self.h.iter().map(|&value| c64::new(-value, 0.0)));
        for i in 0..n {
            w[i * n + i] += sigma;
        }
        for k in 0..n.saturating_sub(1) {
            let (above, below) = w[k * n..(k + 2) * n].split_at_mut(n);
            let (pivot, next) = (&mut above[k..], &mut below[k..]);
            let (right, under) = x[k * m..(k + 2) * m].split_at_mut(m);
            if next[0].norm_sqr() > pivot[0].norm_sqr() {
                pivot.swap_with_slice(next);
                right.swap_with_slice(under);
            }
            if next[0] == c64::ZERO {
                continue;
            }
            let factor = next[0] / pivot[0];
            next.iter_mut().zip(&*pivot).for_each(|(low, high)| *low -= factor * high);
            under.iter_mut().zip(&*right).for_each(|(low, high)| *low -= factor * high);
        }
        if m > FEW {
            let upper = MatRef::from_row_major_slice(w.as_slice(), n, n);
            let right = MatMut::from_row_major_slice_mut(x.as_mut_slice(), n, m);
            solve_upper_triangular_in_place(upper, right, Par::Seq);
            return;
        }
        for i in (0..n).rev() {
            let row = &w[i * n..(i + 1) * n];
            for column in 0..m {
                let sum: c64 = (i + 1..n).map(|j| row[j] * x[j * m + column]).sum();
                x[i * m + column] = (x[i * m + column] - sum) / row[i];
            }
        }
    }
}

/// A ← Qᵀ A Q of Hessenberg form above its second subdiagonal, q ← q Q.
fn reduce(a: &mut Mat<f64>, q: &mut Mat<f64>) {
    let n = a.nrows();
    let block = BLOCK.min(n - 1);
    let mut reflections = Mat::<f64>::zeros(block, n - 1);
    let needed = hessenberg_in_place_scratch::<f64>(n, block, Par::Seq, Default::default()).or(
        apply_block_householder_sequence_on_the_right_in_place_scratch::<f64>(n - 1, block, n - 1),
    );
    let mut memory = MemBuffer::new(needed);
    let stack = MemStack::new(&mut memory);
    hessenberg_in_place(a.as_mut(), reflections.as_mut(), Par::Seq, stack, Default::default());
    apply_on_the_right(
        a.as_ref().submatrix(1, 0, n - 1, n - 1),
        reflections.as_ref(),
        Conj::No,
        q.as_mut().submatrix_mut(1, 1, n - 1, n - 1),
        Par::Seq,
        stack,
    );
}

/// Computes something for many items, on all cores, in their order.
pub fn for_all<I: Copy + Sync + Send, T: Send>(
    items: &[I],
    compute: impl Fn(I, &mut Scratch) -> T + Sync,
) -> Vec<T> {
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    let (compute, next) = (&compute, &AtomicUsize::new(0));
    let mut found: Vec<(usize, T)> = Vec::with_capacity(items.len());
    std::thread::scope(|scope| {
        let work = || {
            let (mut scratch, mut mine) = (Scratch::default(), Vec::new());
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some(&item) = items.get(k) else { return mine };
                mine.push((k, compute(item, &mut scratch)));
            }
        };
        let workers: Vec<_> = (0..cores.min(items.len())).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            match worker.join() {
                Ok(mine) => found.extend(mine),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
    });
    found.sort_by_key(|it| it.0);
    found.into_iter().map(|it| it.1).collect()
}
