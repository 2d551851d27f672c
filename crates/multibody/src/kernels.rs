//! Small dense kernels of the block factorisation: sizes are constants, so that loops unroll and
//! vectorise. All blocks are column-major.

/// Rows of a block: a body has six, a joint three or five.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlockSize {
    Three,
    Five,
    Six,
}

impl BlockSize {
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
            $crate::kernels::BlockSize::Three => {
                const $name: usize = 3;
                $body
            }
            $crate::kernels::BlockSize::Five => {
                const $name: usize = 5;
                $body
            }
            $crate::kernels::BlockSize::Six => {
                const $name: usize = 6;
                $body
            }
        }
    };
}
pub(crate) use with_size;

#[inline(always)]
pub(crate) fn load<const R: usize, const C: usize>(data: &[f64], offset: usize) -> [[f64; R]; C] {
    let source = &data[offset..offset + R * C];
    let mut block = [[0.0; R]; C];
    for (column, values) in block.iter_mut().zip(source.chunks_exact(R)) {
        column.copy_from_slice(values);
    }
    block
}

#[inline(always)]
pub(crate) fn store<const R: usize, const C: usize>(
    data: &mut [f64],
    offset: usize,
    block: &[[f64; R]; C],
) {
    let target = &mut data[offset..offset + R * C];
    for (values, column) in target.chunks_exact_mut(R).zip(block) {
        values.copy_from_slice(column);
    }
}

/// The factor of a pivot, L diag(d) Lᵀ.
pub(crate) trait Factor<const P: usize> {
    /// 1/d.
    fn reciprocals(&self) -> [f64; P];
    /// X ← X L⁻ᵀ. With one row this is L⁻¹ x.
    fn divide<const N: usize>(&self, x: &mut [[f64; N]; P]);
    /// y ← L⁻ᵀ y.
    fn back(&self, y: &mut [f64; P]);
}

/// A factor in one block: L below the diagonal by columns, 1/d on it.
pub(crate) struct Dense<const P: usize>(pub [[f64; P]; P]);

impl<const P: usize> Factor<P> for Dense<P> {
    #[inline(always)]
    fn reciprocals(&self) -> [f64; P] {
        std::array::from_fn(|c| self.0[c][c])
    }

    #[inline(always)]
    fn divide<const N: usize>(&self, x: &mut [[f64; N]; P]) {
        let l = &self.0;
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
    }

    #[inline(always)]
    fn back(&self, y: &mut [f64; P]) {
        let l = &self.0;
        for c in (0..P).rev() {
            let mut sum = y[c];
            for r in c + 1..P {
                sum -= l[c][r] * y[r];
            }
            y[c] = sum;
        }
    }
}

/// The constant factor of a mass matrix diag(m I, J): only its rotational part is not diagonal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaf {
    /// 1/m.
    mass: f64,
    /// L of J: (1, 0), (2, 0), (2, 1).
    l: [f64; 3],
    /// 1/d of J.
    inertia: [f64; 3],
}

impl Leaf {
    /// `None` where the matrix is not positive definite.
    pub fn new(mass: &[f64; 36]) -> Option<Self> {
        let mut d: [[f64; 6]; 6] = load(mass, 0);
        decompose(&mut d, true, &[0.0; 6]).ok()?;
        Some(Self {
            mass: d[0][0],
            l: [d[3][4], d[3][5], d[4][5]],
            inertia: [d[3][3], d[4][4], d[5][5]],
        })
    }
}

impl Factor<6> for Leaf {
    #[inline(always)]
    fn reciprocals(&self) -> [f64; 6] {
        let [a, b, c] = self.inertia;
        [self.mass, self.mass, self.mass, a, b, c]
    }

    #[inline(always)]
    fn divide<const N: usize>(&self, x: &mut [[f64; N]; 6]) {
        let [.., first, second, third] = x;
        let [l10, l20, l21] = self.l;
        for r in 0..N {
            second[r] -= first[r] * l10;
        }
        for r in 0..N {
            third[r] -= first[r] * l20 + second[r] * l21;
        }
    }

    #[inline(always)]
    fn back(&self, y: &mut [f64; 6]) {
        let [l10, l20, l21] = self.l;
        y[4] -= l21 * y[5];
        y[3] -= l10 * y[4] + l20 * y[5];
    }
}

/// D = L diag(d) Lᵀ, in place: L below the diagonal by columns, 1/d on it. No square roots: their
/// latency would dominate. Entries above the diagonal are never read. The error is the row whose
/// pivot is too small.
#[inline(always)]
pub(crate) fn decompose<const P: usize>(
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

/// X diag(1/d).
#[inline(always)]
pub(crate) fn scaled<const N: usize, const P: usize>(
    data: &[f64],
    offset: usize,
    reciprocals: &[f64; P],
) -> [[f64; N]; P] {
    let mut x: [[f64; N]; P] = load(data, offset);
    for (column, reciprocal) in x.iter_mut().zip(reciprocals) {
        for value in column {
            *value *= reciprocal;
        }
    }
    x
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

/// target −= X_n X_mᵀ for n ≠ m.
#[inline(always)]
pub(crate) fn update<const N: usize, const M: usize, const P: usize>(
    data: &mut [f64],
    offset: usize,
    xn: &[[f64; N]; P],
    xm: &[[f64; M]; P],
) {
    let mut target: [[f64; N]; M] = load(data, offset);
    for m in 0..M {
        update_column::<N, M, P, 0>(&mut target, m, xn, xm);
    }
    store(data, offset, &target);
}

/// target −= X X'ᵀ for a diagonal block. Only its lower triangle counts; pairs of rows are taken
/// whole, which costs no more.
#[inline(always)]
pub(crate) fn update_diagonal<const M: usize, const P: usize>(
    data: &mut [f64],
    offset: usize,
    x: &[[f64; M]; P],
    scaled: &[[f64; M]; P],
) {
    let mut target: [[f64; M]; M] = load(data, offset);
    for m in 0..M.min(2) {
        update_column::<M, M, P, 0>(&mut target, m, x, scaled);
    }
    for m in 2..M.min(4) {
        update_column::<M, M, P, 2>(&mut target, m, x, scaled);
    }
    for m in 4..M {
        update_column::<M, M, P, 4>(&mut target, m, x, scaled);
    }
    store(data, offset, &target);
}
