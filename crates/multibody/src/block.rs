//! Block-sparse LDLᵀ of symmetric saddle-point matrices: the numeric part.
//!
//! The matrix of eq. 9 is stored by blocks on the graph of bodies (6×6 pivots) and joints (3×3 or
//! 5×5 pivots). Eliminating in the order that `ordering` found, every body pivot is positive and
//! every joint pivot negative definite (Schur complements of [[M, Jᵀ], [J, 0]] keep that
//! inertia), so each pivot has a Cholesky factor: D_p = s_p L Lᵀ with s = +1 (body) or −1 (joint).
//! With X_n = A_np L⁻ᵀ, elimination is A_nm ← A_nm − s X_n X_mᵀ.
//!
//! All blocks live column-major in one flat vector, column by column in elimination order, so the
//! inner loops run down contiguous columns of known length.

use std::ops::Range;

/// Rows of a block: a body has six, a joint three or five.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Size {
    Three,
    Five,
    Six,
}

impl Size {
    pub const fn get(self) -> usize {
        match self {
            Self::Three => 3,
            Self::Five => 5,
            Self::Six => 6,
        }
    }
}

/// Runs an expression with a constant that holds the size.
macro_rules! with_size {
    ($size:expr, $name:ident, $body:expr) => {
        match $size {
            Size::Three => {
                const $name: usize = 3;
                $body
            }
            Size::Five => {
                const $name: usize = 5;
                $body
            }
            Size::Six => {
                const $name: usize = 6;
                $body
            }
        }
    };
}

/// One pivot with everything that is below it.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    pub node: usize,
    pub size: Size,
    /// s: true for bodies.
    pub positive: bool,
    /// Offset of the diagonal block.
    pub diagonal: usize,
    /// Offset just behind the column's last block.
    pub end: usize,
    /// Offset of the node's part of a right-hand side.
    pub rhs: usize,
    pub below: Range<usize>,
    pub updates: Range<usize>,
}

/// A block below a pivot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Below {
    pub size: Size,
    pub offset: usize,
    pub rhs: usize,
}

/// target −= s · rows · colsᵀ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Update {
    pub rows: Below,
    pub cols: Below,
    pub target: usize,
}

/// A place for a block of the original matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    pub offset: usize,
    /// True where the storage holds the block (i, j) as asked, false where its transpose.
    pub as_asked: bool,
}

/// A pivot that vanished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Vanished {
    pub node: usize,
    pub row: usize,
}

/// Elimination order, storage layout and list of updates; made once by `ordering`.
#[derive(Debug, Clone)]
pub(crate) struct Factorisation {
    pub columns: Vec<Column>,
    pub below: Vec<Below>,
    pub updates: Vec<Update>,
    /// Length of the block storage.
    pub storage: usize,
    /// Smallest pivot that counts as not zero, by row of the right-hand side.
    pub smallest_pivot: Vec<f64>,
}

#[inline(always)]
fn load<const R: usize, const C: usize>(data: &[f64], offset: usize) -> [[f64; R]; C] {
    let source = &data[offset..offset + R * C];
    let mut block = [[0.0; R]; C];
    for (column, values) in block.iter_mut().zip(source.chunks_exact(R)) {
        column.copy_from_slice(values);
    }
    block
}

#[inline(always)]
fn store<const R: usize, const C: usize>(data: &mut [f64], offset: usize, block: &[[f64; R]; C]) {
    let target = &mut data[offset..offset + R * C];
    for (values, column) in target.chunks_exact_mut(R).zip(block) {
        values.copy_from_slice(column);
    }
}

/// Cholesky factor of s·D, lower triangle by columns, with reciprocals on the diagonal.
#[inline(always)]
fn cholesky<const P: usize>(
    d: &mut [[f64; P]; P],
    positive: bool,
    smallest: &[f64],
) -> Result<(), usize> {
    if !positive {
        for value in d.as_flattened_mut() {
            *value = -*value;
        }
    }
    for c in 0..P {
        let mut column = d[c];
        for earlier in &d[..c] {
            let factor = earlier[c];
            for r in c..P {
                column[r] -= earlier[r] * factor;
            }
        }
        // written so that a NaN is caught as well
        let large_enough = column[c] > smallest[c];
        if !large_enough {
            return Err(c);
        }
        let reciprocal = 1.0 / column[c].sqrt();
        for value in &mut column[c..] {
            *value *= reciprocal;
        }
        column[c] = reciprocal;
        d[c] = column;
    }
    Ok(())
}

/// X = A L⁻ᵀ.
#[inline(always)]
fn divide<const N: usize, const P: usize>(data: &mut [f64], offset: usize, l: &[[f64; P]; P]) {
    let mut x: [[f64; N]; P] = load(data, offset);
    for c in 0..P {
        let mut column = x[c];
        for j in 0..c {
            let factor = l[j][c];
            for r in 0..N {
                column[r] -= x[j][r] * factor;
            }
        }
        for value in &mut column {
            *value *= l[c][c];
        }
        x[c] = column;
    }
    store(data, offset, &x);
}

/// target −= s · X_n · X_mᵀ.
#[inline(always)]
fn update<const N: usize, const M: usize, const P: usize>(
    done: &[f64],
    later: &mut [f64],
    task: &Update,
    positive: bool,
) {
    let xn: [[f64; N]; P] = load(done, task.rows.offset);
    let xm: [[f64; M]; P] = load(done, task.cols.offset);
    let offset = task.target - done.len();
    let mut target: [[f64; N]; M] = load(later, offset);
    for m in 0..M {
        let mut sum = [0.0; N];
        for c in 0..P {
            let factor = xm[c][m];
            for r in 0..N {
                sum[r] += xn[c][r] * factor;
            }
        }
        for r in 0..N {
            if positive {
                target[m][r] -= sum[r];
            } else {
                target[m][r] += sum[r];
            }
        }
    }
    store(later, offset, &target);
}

impl Factorisation {
    /// Replaces the matrix in `data` by its factors.
    pub fn factor(&self, data: &mut [f64]) -> Result<(), Vanished> {
        for column in &self.columns {
            with_size!(column.size, P, self.factor_column::<P>(column, data))?;
        }
        Ok(())
    }

    #[inline(always)]
    fn factor_column<const P: usize>(
        &self,
        column: &Column,
        data: &mut [f64],
    ) -> Result<(), Vanished> {
        let mut l: [[f64; P]; P] = load(data, column.diagonal);
        cholesky(&mut l, column.positive, &self.smallest_pivot[column.rhs..column.rhs + P])
            .map_err(|row| Vanished { node: column.node, row })?;
        store(data, column.diagonal, &l);
        for block in &self.below[column.below.clone()] {
            with_size!(block.size, N, divide::<N, P>(data, block.offset, &l));
        }
        let (done, later) = data.split_at_mut(column.end);
        for task in &self.updates[column.updates.clone()] {
            with_size!(
                task.rows.size,
                N,
                with_size!(
                    task.cols.size,
                    M,
                    update::<N, M, P>(done, later, task, column.positive)
                )
            );
        }
        Ok(())
    }

    /// Solves with the factors; x holds the right-hand side and then the solution.
    pub fn solve(&self, data: &[f64], x: &mut [f64]) {
        for column in &self.columns {
            with_size!(column.size, P, self.forward::<P>(column, data, x));
        }
        for column in self.columns.iter().rev() {
            with_size!(column.size, P, self.backward::<P>(column, data, x));
        }
    }

    /// y_p = L⁻¹ b_p, then b_n −= s X_n y_p.
    #[inline(always)]
    fn forward<const P: usize>(&self, column: &Column, data: &[f64], x: &mut [f64]) {
        let l: [[f64; P]; P] = load(data, column.diagonal);
        let mut y = [0.0; P];
        y.copy_from_slice(&x[column.rhs..column.rhs + P]);
        for c in 0..P {
            y[c] *= l[c][c];
            for r in c + 1..P {
                y[r] -= l[c][r] * y[c];
            }
        }
        x[column.rhs..column.rhs + P].copy_from_slice(&y);
        let sign = if column.positive { 1.0 } else { -1.0 };
        for value in &mut y {
            *value *= sign;
        }
        for block in &self.below[column.below.clone()] {
            with_size!(block.size, N, {
                let xn: [[f64; N]; P] = load(data, block.offset);
                let target = &mut x[block.rhs..block.rhs + N];
                for c in 0..P {
                    for r in 0..N {
                        target[r] -= xn[c][r] * y[c];
                    }
                }
            });
        }
    }

    /// x_p = L⁻ᵀ (s y_p − s Σ X_nᵀ x_n).
    #[inline(always)]
    fn backward<const P: usize>(&self, column: &Column, data: &[f64], x: &mut [f64]) {
        let l: [[f64; P]; P] = load(data, column.diagonal);
        let mut y = [0.0; P];
        y.copy_from_slice(&x[column.rhs..column.rhs + P]);
        for block in &self.below[column.below.clone()] {
            with_size!(block.size, N, {
                let xn: [[f64; N]; P] = load(data, block.offset);
                let known = &x[block.rhs..block.rhs + N];
                for c in 0..P {
                    let mut sum = 0.0;
                    for r in 0..N {
                        sum += xn[c][r] * known[r];
                    }
                    y[c] -= sum;
                }
            });
        }
        let sign = if column.positive { 1.0 } else { -1.0 };
        for c in (0..P).rev() {
            let mut sum = sign * y[c];
            for r in c + 1..P {
                sum -= l[c][r] * y[r];
            }
            y[c] = sum * l[c][c];
        }
        x[column.rhs..column.rhs + P].copy_from_slice(&y);
    }
}
