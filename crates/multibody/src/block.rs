//! Block-sparse LDLᵀ of symmetric saddle-point matrices: the numeric part.
//!
//! The matrix of eq. 9 is stored by blocks on the graph of bodies (6×6 pivots) and joints (3×3 or
//! 5×5 pivots). Eliminating in the order that `ordering` found, every body pivot is positive and
//! every joint pivot negative definite (Schur complements of [[M, Jᵀ], [J, 0]] keep that
//! inertia), so each has a factorisation D_p = L diag(d) Lᵀ with all d positive or all negative.
//! With X_n = A_np L⁻ᵀ, elimination is A_nm ← A_nm − X_n diag(1/d) X_mᵀ.
//!
//! A body that is eliminated before anything has changed its pivot is a leaf: its mass matrix
//! diag(m I, J) is constant in body axes, so its factor is made once with the model.
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
    /// True for bodies, false for joints: the sign of all pivots.
    pub positive: bool,
    /// The factor of a body that no earlier column changes and whose mass matrix is constant.
    pub leaf: Option<Box<[f64; 36]>>,
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

/// target −= rows · diag(1/d) · colsᵀ.
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

/// D = L diag(d) Lᵀ, in place: L below the diagonal by columns, 1/d on it. No square roots: their
/// latency would dominate. What stands above the diagonal is never read.
#[inline(always)]
fn decompose<const P: usize>(
    d: &mut [[f64; P]; P],
    positive: bool,
    smallest: &[f64],
) -> Result<(), usize> {
    for c in 0..P {
        let pivot = d[c][c];
        // written so that a NaN is caught as well
        let large_enough = (if positive { pivot } else { -pivot }) > smallest[c];
        if !large_enough {
            return Err(c);
        }
        let reciprocal = 1.0 / pivot;
        let column = d[c];
        let mut scaled = column;
        for value in &mut scaled[c + 1..] {
            *value *= reciprocal;
        }
        for m in c + 1..P {
            for r in m..P {
                d[m][r] -= column[m] * scaled[r];
            }
        }
        scaled[c] = reciprocal;
        d[c] = scaled;
    }
    Ok(())
}

/// X = A L⁻ᵀ.
#[inline(always)]
fn divide<const N: usize, const P: usize>(data: &mut [f64], offset: usize, l: &[[f64; P]; P]) {
    let mut x: [[f64; N]; P] = load(data, offset);
    for c in 1..P {
        let mut column = x[c];
        for j in 0..c {
            let factor = l[j][c];
            for r in 0..N {
                column[r] -= x[j][r] * factor;
            }
        }
        x[c] = column;
    }
    store(data, offset, &x);
}

/// X = A L⁻ᵀ where only the rotational part of L is not the identity.
#[inline(always)]
fn divide_leaf<const N: usize>(data: &mut [f64], offset: usize, l: &[[f64; 6]; 6]) {
    let [first, mut second, mut third]: [[f64; N]; 3] = load(data, offset + 3 * N);
    for (b, a) in second.iter_mut().zip(&first) {
        *b -= a * l[3][4];
    }
    for ((c, a), b) in third.iter_mut().zip(&first).zip(&second) {
        *c -= a * l[3][5] + b * l[4][5];
    }
    store(data, offset + 3 * N, &[first, second, third]);
}

/// Column m of target −= X_n X_mᵀ, from row F on: a constant, so that the loops unroll.
#[inline(always)]
fn update_column<const N: usize, const M: usize, const P: usize, const F: usize>(
    target: &mut [[f64; N]; M],
    m: usize,
    xn: &[[f64; N]; P],
    xm: &[[f64; M]; P],
) {
    let mut sum = target[m];
    for c in 0..P {
        let factor = xm[c][m];
        for r in F..N {
            sum[r] -= xn[c][r] * factor;
        }
    }
    target[m] = sum;
}

/// target −= X_n diag(1/d) X_mᵀ. Of a diagonal block only the lower triangle counts; pairs of rows
/// are taken whole, which costs no more.
#[inline(always)]
fn update<const N: usize, const M: usize, const P: usize>(
    done: &[f64],
    later: &mut [f64],
    task: &Update,
    reciprocals: &[f64; P],
    diagonal: bool,
) {
    let xn: [[f64; N]; P] = load(done, task.rows.offset);
    let mut xm: [[f64; M]; P] = load(done, task.cols.offset);
    for (column, reciprocal) in xm.iter_mut().zip(reciprocals) {
        for value in column {
            *value *= reciprocal;
        }
    }
    let offset = task.target - done.len();
    let mut target: [[f64; N]; M] = load(later, offset);
    if diagonal {
        for m in 0..M.min(2) {
            update_column::<N, M, P, 0>(&mut target, m, &xn, &xm);
        }
        for m in 2..M.min(4) {
            update_column::<N, M, P, 2>(&mut target, m, &xn, &xm);
        }
        for m in 4..M {
            update_column::<N, M, P, 4>(&mut target, m, &xn, &xm);
        }
    } else {
        for m in 0..M {
            update_column::<N, M, P, 0>(&mut target, m, &xn, &xm);
        }
    }
    store(later, offset, &target);
}

/// 1/d of a factor.
#[inline(always)]
fn reciprocals<const P: usize>(l: &[[f64; P]; P]) -> [f64; P] {
    std::array::from_fn(|c| l[c][c])
}

/// Factor of a constant mass matrix diag(m I, J).
pub(crate) fn decompose_mass(mass: &[f64; 36]) -> Option<Box<[f64; 36]>> {
    let mut d: [[f64; 6]; 6] = load(mass, 0);
    decompose(&mut d, true, &[0.0; 6]).ok()?;
    let mut factor = Box::new([0.0; 36]);
    store(factor.as_mut_slice(), 0, &d);
    Some(factor)
}

impl Factorisation {
    /// For a matrix whose diagonal blocks change from one factorisation to the next.
    pub fn without_leaves(mut self) -> Self {
        for column in &mut self.columns {
            column.leaf = None;
        }
        self
    }

    /// Replaces the matrix in `data` by its factors.
    pub fn factor(&self, data: &mut [f64]) -> Result<(), Vanished> {
        for column in &self.columns {
            if let Some(leaf) = &column.leaf {
                self.factor_leaf(column, leaf, data);
            } else {
                with_size!(column.size, P, self.factor_column::<P>(column, data))?;
            }
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
        decompose(&mut l, column.positive, &self.smallest_pivot[column.rhs..column.rhs + P])
            .map_err(|row| Vanished { node: column.node, row })?;
        store(data, column.diagonal, &l);
        for block in &self.below[column.below.clone()] {
            with_size!(block.size, N, divide::<N, P>(data, block.offset, &l));
        }
        self.update_later(column, data, &reciprocals(&l));
        Ok(())
    }

    /// As `factor_column` for a body whose factor is known.
    #[inline(always)]
    fn factor_leaf(&self, column: &Column, leaf: &[f64; 36], data: &mut [f64]) {
        let l: [[f64; 6]; 6] = load(leaf, 0);
        store(data, column.diagonal, &l);
        for block in &self.below[column.below.clone()] {
            with_size!(block.size, N, divide_leaf::<N>(data, block.offset, &l));
        }
        self.update_later(column, data, &reciprocals(&l));
    }

    #[inline(always)]
    fn update_later<const P: usize>(
        &self,
        column: &Column,
        data: &mut [f64],
        reciprocals: &[f64; P],
    ) {
        let (done, later) = data.split_at_mut(column.end);
        for task in &self.updates[column.updates.clone()] {
            if task.rows.offset == task.cols.offset {
                with_size!(
                    task.rows.size,
                    N,
                    update::<N, N, P>(done, later, task, reciprocals, true)
                );
            } else {
                with_size!(
                    task.rows.size,
                    N,
                    with_size!(
                        task.cols.size,
                        M,
                        update::<N, M, P>(done, later, task, reciprocals, false)
                    )
                );
            }
        }
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

    /// z_p = diag(1/d) L⁻¹ b_p, then b_n −= X_n z_p.
    #[inline(always)]
    fn forward<const P: usize>(&self, column: &Column, data: &[f64], x: &mut [f64]) {
        let l: [[f64; P]; P] = load(data, column.diagonal);
        let mut y = [0.0; P];
        y.copy_from_slice(&x[column.rhs..column.rhs + P]);
        for c in 0..P {
            for r in c + 1..P {
                y[r] -= l[c][r] * y[c];
            }
        }
        for c in 0..P {
            y[c] *= l[c][c];
        }
        x[column.rhs..column.rhs + P].copy_from_slice(&y);
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

    /// x_p = L⁻ᵀ (z_p − diag(1/d) Σ X_nᵀ x_n).
    #[inline(always)]
    fn backward<const P: usize>(&self, column: &Column, data: &[f64], x: &mut [f64]) {
        let l: [[f64; P]; P] = load(data, column.diagonal);
        let mut sums = [0.0; P];
        for block in &self.below[column.below.clone()] {
            with_size!(block.size, N, {
                let xn: [[f64; N]; P] = load(data, block.offset);
                let known = &x[block.rhs..block.rhs + N];
                for c in 0..P {
                    let mut sum = 0.0;
                    for r in 0..N {
                        sum += xn[c][r] * known[r];
                    }
                    sums[c] += sum;
                }
            });
        }
        let mut y = [0.0; P];
        y.copy_from_slice(&x[column.rhs..column.rhs + P]);
        for c in 0..P {
            y[c] -= sums[c] * l[c][c];
        }
        for c in (0..P).rev() {
            let mut sum = y[c];
            for r in c + 1..P {
                sum -= l[c][r] * y[r];
            }
            y[c] = sum;
        }
        x[column.rhs..column.rhs + P].copy_from_slice(&y);
    }
}
