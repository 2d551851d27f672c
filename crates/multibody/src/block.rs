//! Block-sparse LDLᵀ of symmetric saddle-point matrices: the numeric part.
//!
//! The matrix of eq. 9 is stored by blocks on the graph of bodies (6×6 pivots) and joints (3×3 or
//! 5×5 pivots). Eliminating in the order that `ordering` found, every body pivot is positive and
//! every joint pivot negative definite (Schur complements of [[M, Jᵀ], [J, 0]] keep that
//! inertia), so each has a factorisation D_p = L diag(d) Lᵀ with all d positive or all negative.
//! With X_n = A_np L⁻ᵀ, elimination is A_nm ← A_nm − X_n diag(1/d) X_mᵀ.
//!
//! A body that is eliminated before anything has changed its pivot is a leaf: its mass matrix
//! diag(m I, J) is constant in body axes, so its factor is made once with the model, and its
//! diagonal block is not stored.
//!
//! All blocks live column-major in one flat vector, column by column in elimination order, so the
//! inner loops run down contiguous columns of known length. Columns come in windows that fit the
//! first cache, windows in sections that share no coupling: a caller assembles, factors and solves
//! window by window, so that each block is used while it is in the cache, for trains of any length.

use std::ops::Range;

pub(crate) use crate::kernels::BlockSize;
use crate::kernels::{
    Dense, Factor, Leaf, decompose, load, scaled, store, update, update_diagonal, with_size,
};

/// Index into storage or lists. Half the size of a pointer, because every evaluation reads the
/// lists. Storage that it cannot index (34 GB of blocks) cannot be allocated.
pub(crate) type CompactIndex = u32;

/// Shortens an index.
pub(crate) fn compact(k: usize) -> CompactIndex {
    CompactIndex::try_from(k).unwrap_or(CompactIndex::MAX)
}

/// Kind of a column's diagonal block.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pivot {
    /// Positive definite.
    Body,
    /// Negative definite.
    Joint,
    /// Constant; an index into the leaves.
    Leaf(CompactIndex),
}

/// One pivot with the blocks below it.
#[derive(Debug, Clone)]
pub(crate) struct PivotColumn {
    pub node: CompactIndex,
    pub size: BlockSize,
    pub pivot: Pivot,
    /// Offset of the diagonal block, or of the first block below where a leaf has none.
    pub start: CompactIndex,
    /// Offset of the end of the column's last block.
    pub end: CompactIndex,
    /// Offset of the node's part of a right-hand side.
    pub rhs: CompactIndex,
    pub below: Range<CompactIndex>,
    /// First of the targets of its updates: one for each pair of blocks below, by columns.
    pub targets: CompactIndex,
}

impl PivotColumn {
    /// Offset of the first block below the diagonal.
    fn first(&self) -> usize {
        match self.pivot {
            Pivot::Leaf(_) => self.start as usize,
            Pivot::Body | Pivot::Joint => self.start as usize + self.size.get() * self.size.get(),
        }
    }
}

/// A block below a pivot. The blocks of a column are contiguous in storage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Below {
    pub size: BlockSize,
    pub rhs: CompactIndex,
}

/// Where a block of the original matrix is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BlockPlace {
    pub offset: CompactIndex,
    /// True where the storage holds the requested block (i, j), false where it holds its transpose.
    pub as_asked: bool,
}

/// A pivot that vanished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Vanished {
    pub node: usize,
    pub row: usize,
}

/// Columns that are processed together because they fit the first-level cache.
#[derive(Debug, Clone)]
pub(crate) struct ColumnWindow {
    pub columns: Range<usize>,
    /// Bodies and joints whose blocks no earlier window touches, ascending.
    pub nodes: Vec<CompactIndex>,
    /// Parts of the storage that no earlier window touches.
    pub fresh: Vec<Range<CompactIndex>>,
}

/// Elimination order, storage layout and list of updates; made once by `ordering`.
#[derive(Debug, Clone)]
pub(crate) struct Factorisation {
    pub columns: Vec<PivotColumn>,
    pub below: Vec<Below>,
    pub targets: Vec<CompactIndex>,
    pub leaves: Vec<Leaf>,
    pub windows: Vec<ColumnWindow>,
    /// Ranges of windows. The columns of a section change no column of another section.
    pub sections: Vec<Range<usize>>,
    /// Length of the block storage.
    pub storage: usize,
    /// Smallest pivot that counts as nonzero, by row of the right-hand side.
    pub smallest_pivot: Vec<f64>,
}

/// Runs an expression with the column's size as constant P and its finished factor.
macro_rules! with_factor {
    ($self:ident, $column:ident, $data:expr, $P:ident, $factor:ident, $body:expr) => {
        if let Pivot::Leaf(k) = $column.pivot {
            const $P: usize = 6;
            let $factor = &$self.leaves[k as usize];
            $body
        } else {
            with_size!($column.size, $P, {
                let $factor = &Dense::<$P>(load($data, $column.start as usize));
                $body
            })
        }
    };
}

impl Factorisation {
    /// Replaces the whole matrix in `data` by its factors.
    pub fn factor(&self, data: &mut [f64]) -> Result<(), Vanished> {
        self.windows.iter().try_for_each(|window| self.factor_window(window, data))
    }

    /// Replaces the columns of a window by their factors.
    pub fn factor_window(&self, window: &ColumnWindow, data: &mut [f64]) -> Result<(), Vanished> {
        for column in &self.columns[window.columns.clone()] {
            if let Pivot::Leaf(k) = column.pivot {
                self.eliminate::<6>(column, &self.leaves[k as usize], data);
            } else {
                with_size!(column.size, P, self.factor_column::<P>(column, data))?;
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn factor_column<const P: usize>(
        &self,
        column: &PivotColumn,
        data: &mut [f64],
    ) -> Result<(), Vanished> {
        let (start, rhs) = (column.start as usize, column.rhs as usize);
        let mut l: [[f64; P]; P] = load(data, start);
        let positive = matches!(column.pivot, Pivot::Body);
        decompose(&mut l, positive, &self.smallest_pivot[rhs..rhs + P])
            .map_err(|row| Vanished { node: column.node as usize, row })?;
        store(data, start, &l);
        self.eliminate::<P>(column, &Dense(l), data);
        Ok(())
    }

    fn below(&self, column: &PivotColumn) -> &[Below] {
        &self.below[column.below.start as usize..column.below.end as usize]
    }

    /// X_n = A_np L⁻ᵀ for all blocks below, then A_nm −= X_n diag(1/d) X_mᵀ for all pairs of them.
    #[inline(always)]
    fn eliminate<const P: usize>(
        &self,
        column: &PivotColumn,
        factor: &impl Factor<P>,
        data: &mut [f64],
    ) {
        let below = self.below(column);
        let mut offset = column.first();
        for block in below {
            with_size!(block.size, N, {
                let mut x: [[f64; N]; P] = load(data, offset);
                factor.divide(&mut x);
                store(data, offset, &x);
            });
            offset += block.size.get() * P;
        }
        let end = column.end as usize;
        let (done, later) = data.split_at_mut(end);
        let reciprocals = factor.reciprocals();
        let mut targets = self.targets[column.targets as usize..].iter().map(|t| *t as usize - end);
        let mut at_m = column.first();
        for (k, m) in below.iter().enumerate() {
            with_size!(m.size, M, {
                let xm: [[f64; M]; P] = scaled(done, at_m, &reciprocals);
                let mut at_n = at_m;
                // every pair has its target, the diagonal first
                for (n, target) in below[k..].iter().zip(&mut targets) {
                    if at_n == at_m {
                        update_diagonal::<M, P>(later, target, &load(done, at_n), &xm);
                    } else {
                        with_size!(n.size, N, {
                            update::<N, M, P>(later, target, &load(done, at_n), &xm);
                        });
                    }
                    at_n += n.size.get() * P;
                }
            });
            at_m += m.size.get() * P;
        }
    }

    /// Solves with the factors; x holds the right-hand side and then the solution.
    pub fn solve(&self, data: &[f64], x: &mut [f64]) {
        for section in &self.sections {
            let windows = &self.windows[section.clone()];
            for window in windows {
                self.forward_window(window, data, x);
            }
            self.backward_section(windows, data, x);
        }
    }

    /// The first half of a solution, down the columns of a window.
    pub fn forward_window(&self, window: &ColumnWindow, data: &[f64], x: &mut [f64]) {
        for column in &self.columns[window.columns.clone()] {
            with_factor!(self, column, data, P, factor, {
                self.forward::<P>(column, factor, data, x);
            });
        }
    }

    /// The second half of a solution, up the columns of all windows of a section.
    pub fn backward_section(&self, windows: &[ColumnWindow], data: &[f64], x: &mut [f64]) {
        for window in windows.iter().rev() {
            for column in self.columns[window.columns.clone()].iter().rev() {
                with_factor!(self, column, data, P, factor, {
                    self.backward::<P>(column, factor, data, x);
                });
            }
        }
    }

    /// z_p = diag(1/d) L⁻¹ b_p, then b_n −= X_n z_p.
    #[inline(always)]
    fn forward<const P: usize>(
        &self,
        column: &PivotColumn,
        factor: &impl Factor<P>,
        data: &[f64],
        x: &mut [f64],
    ) {
        let rhs = column.rhs as usize;
        let mut y: [[f64; 1]; P] = load(x, rhs);
        factor.divide(&mut y);
        for ([value], reciprocal) in y.iter_mut().zip(factor.reciprocals()) {
            *value *= reciprocal;
        }
        store(x, rhs, &y);
        let mut offset = column.first();
        for block in self.below(column) {
            with_size!(block.size, N, {
                let xn: [[f64; N]; P] = load(data, offset);
                let [mut target]: [[f64; N]; 1] = load(x, block.rhs as usize);
                for c in 0..P {
                    for r in 0..N {
                        target[r] -= xn[c][r] * y[c][0];
                    }
                }
                store(x, block.rhs as usize, &[target]);
            });
            offset += block.size.get() * P;
        }
    }

    /// x_p = L⁻ᵀ (z_p − diag(1/d) Σ X_nᵀ x_n).
    #[inline(always)]
    fn backward<const P: usize>(
        &self,
        column: &PivotColumn,
        factor: &impl Factor<P>,
        data: &[f64],
        x: &mut [f64],
    ) {
        let mut sums = [0.0; P];
        let mut offset = column.first();
        for block in self.below(column) {
            with_size!(block.size, N, {
                let xn: [[f64; N]; P] = load(data, offset);
                let [known]: [[f64; N]; 1] = load(x, block.rhs as usize);
                for c in 0..P {
                    let mut sum = 0.0;
                    for r in 0..N {
                        sum += xn[c][r] * known[r];
                    }
                    sums[c] += sum;
                }
            });
            offset += block.size.get() * P;
        }
        let rhs = column.rhs as usize;
        let [mut y]: [[f64; P]; 1] = load(x, rhs);
        for ((y, sum), reciprocal) in y.iter_mut().zip(sums).zip(factor.reciprocals()) {
            *y -= sum * reciprocal;
        }
        factor.back(&mut y);
        store(x, rhs, &[y]);
    }
}
