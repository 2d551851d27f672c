//! The exact step of a linear unit for inputs that are polynomials over the step.
//!
//! x(h) = φ₀(A h) x + Σₖ hᵏ⁺¹ φₖ₊₁(A h) B u⁽ᵏ⁾ for k = 0 to the degree d, with φ₀(z) = eᶻ and
//! φₖ₊₁(z) = (φₖ(z) − 1/k!)/z (Hochbruck and Ostermann 2010, "Exponential integrators"). φ of d + 1 is summed as a
//! series of A h/2ʲ, the others follow from it, and all are doubled j times.

use faer::Mat;

use super::error::LinearError;
use super::rows::Rows;
use super::unit::LinearUnit;

/// Largest number of parts in which a step is computed.
const MOST_PARTS: f64 = 1e4;
/// Largest |λ|h of a part. Rounding grows with its exponential.
const WHOLE: f64 = 1.0;
/// Largest number of terms of the series, to avoid endless loops.
const MOST_TERMS: usize = 200;
/// 1/k!.
const INVERSE_FACTORIALS: [f64; 7] =
    [1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0];

/// The matrices of one step, and of outputs with their derivatives. Only connected outputs. Columns of inputs
/// that are not connected follow those of the others where only values are used, if they are wanted.
#[derive(Debug, Clone)]
pub struct UnitMap {
    /// x(h) by x.
    pub by_state: Columns,
    /// x(h) by u⁽ᵏ⁾, up to the degree of the inputs.
    pub by_input: Vec<Columns>,
    /// Which outputs provide derivative k; all have a value (k = 0).
    pub providing: Vec<Vec<usize>>,
    /// y⁽ᵏ⁾ of these outputs by x: C Aᵏ, up to the highest derivative that an output provides.
    pub outputs_by_state: Vec<Columns>,
    /// y⁽ᵏ⁾ of these outputs by u⁽ᵏ⁻ᵈ⁾, for d = 0 … k: D, C B, C A B …
    pub outputs_by_input: Vec<Vec<Columns>>,
}

impl UnitMap {
    /// The step of `size` of a unit whose inputs are polynomials of a `degree` up to 5 and whose connected outputs
    /// provide derivatives up to those orders (without: values only), with all inputs or the connected ones only.
    ///
    /// # Errors
    /// The unit is too fast for the step, or its eigenvalues cannot be found.
    pub fn new(
        unit: &LinearUnit,
        degree: usize,
        offered: &[usize],
        size: f64,
        all: bool,
    ) -> Result<Self, LinearError> {
        let parts = parts(unit, size)?;
        let mut phi = doubled(functions(&unit.a, size / parts, degree + 2), parts.log2() as usize)
            .into_iter();
        let connected = unit.connected_inputs;
        let m = if all { unit.inputs.len() } else { connected };
        let p = unit.connected_outputs;
        let b = dense(&unit.b, m);
        let (c, d) = (top(&unit.c, unit.states.len(), p), top(&unit.d, m, p));
        let mut factor = 1.0;
        let by_state = phi.next().unwrap_or_else(Mat::new);
        let by_input = phi.map(|phi| {
            let columns = if factor == 1.0 { m } else { connected };
            factor *= size;
            Columns::from((&phi * b.subcols(0, columns)) * faer::Scale(factor))
        });
        let by_input: Vec<Columns> = by_input.collect();
        let order = offered.iter().copied().max().unwrap_or(0);
        let (mut by_states, mut by_inputs) = (vec![c], vec![d]);
        for k in 0..order {
            by_inputs.push(&by_states[k] * &b);
            by_states.push(&by_states[k] * dense(&unit.a, unit.states.len()));
        }
        let provides =
            |output: usize, k: usize| k == 0 || offered.get(output).is_some_and(|it| k <= *it);
        let providing: Vec<Vec<usize>> =
            (0..=order).map(|k| (0..p).filter(|&output| provides(output, k)).collect()).collect();
        let chosen = |k: usize, matrix: &Mat<f64>| {
            let rows = &providing[k];
            Columns::from(Mat::from_fn(rows.len(), matrix.ncols(), |i, j| matrix[(rows[i], j)]))
        };
        let outputs_by_state = by_states.iter().enumerate().map(|(k, it)| chosen(k, it)).collect();
        let outputs_by_input =
            (0..=order).map(|k| by_inputs[..=k].iter().map(|it| chosen(k, it)).collect()).collect();
        let by_state = Columns::from(by_state);
        Ok(Self { by_state, by_input, providing, outputs_by_state, outputs_by_input })
    }
}

/// A matrix that is multiplied by vectors with few nonzero elements, and may itself have few.
#[derive(Debug, Clone)]
pub struct Columns {
    /// All of it.
    pub matrix: Mat<f64>,
    /// The nonzero elements of columns that have few.
    sparse: Vec<Option<Vec<(usize, f64)>>>,
}

impl From<Mat<f64>> for Columns {
    fn from(matrix: Mat<f64>) -> Self {
        let column = |j: usize| {
            let all = matrix.col(j).iter().copied().enumerate();
            let nonzero: Vec<(usize, f64)> = all.filter(|(_, x)| *x != 0.0).collect();
            (4 * nonzero.len() < matrix.nrows()).then_some(nonzero)
        };
        let sparse = (0..matrix.ncols()).map(column).collect();
        Self { matrix, sparse }
    }
}

impl Columns {
    /// Adds matrix · x to a vector.
    pub fn add(&self, x: impl Fn(usize) -> f64, sum: &mut [f64]) {
        for (j, sparse) in self.sparse.iter().enumerate() {
            let x = x(j);
            if x == 0.0 {
                continue;
            }
            if let Some(sparse) = sparse {
                sparse.iter().for_each(|&(i, value)| sum[i] += x * value);
            } else if let Some(column) = self.matrix.col(j).try_as_col_major() {
                sum.iter_mut().zip(column.as_slice()).for_each(|(sum, value)| *sum += x * value);
            }
        }
    }
}

/// Number of equal parts, a power of two, in which the step is computed.
fn parts(unit: &LinearUnit, size: f64) -> Result<f64, LinearError> {
    // the norm is an upper bound of the eigenvalues, and usually enough
    let rate = unit.norm();
    if rate * size <= WHOLE {
        return Ok(1.0);
    }
    let rate = unit.rate()?;
    let parts = (rate * size / WHOLE).max(1.0).log2().ceil().exp2();
    if parts <= MOST_PARTS {
        return Ok(parts);
    }
    Err(LinearError::Fast { instance: unit.name.clone(), rate, step: size })
}

/// The first `count` of the functions φ₀, φ₁ … of A h.
fn functions(a: &Rows, size: f64, count: usize) -> Vec<Mat<f64>> {
    let (n, last) = (a.len(), count - 1);
    let a = dense(a, n);
    // of the last, φₖ(z) = Σ zʲ/(j + k)!, until three terms in a row no longer change the sum
    let mut term = identity(n, INVERSE_FACTORIALS[last]);
    let mut sum = term.clone();
    let mut small = 0;
    for j in 1..MOST_TERMS {
        term = (&a * &term) * faer::Scale(size / (j as f64 + last as f64));
        let mut counts = false;
        for (sum, term) in sum.col_iter_mut().zip(term.col_iter()) {
            for (sum, term) in sum.iter_mut().zip(term.iter()) {
                let before = *sum;
                *sum += term;
                counts |= (*sum).to_bits() != before.to_bits();
            }
        }
        small = if counts { 0 } else { small + 1 };
        if small >= 3 {
            break;
        }
    }
    let mut all = vec![Mat::new(); count];
    all[last] = sum;
    for k in (0..last).rev() {
        all[k] = (&a * &all[k + 1]) * faer::Scale(size);
        for i in 0..n {
            all[k][(i, i)] += INVERSE_FACTORIALS[k];
        }
    }
    all
}

/// φₖ(2z) = 2⁻ᵏ (φ₀ φₖ + Σⱼ φⱼ/(k − j)!), j = 1 to k, so many times.
fn doubled(mut phi: Vec<Mat<f64>>, times: usize) -> Vec<Mat<f64>> {
    for _ in 0..times {
        let next = |k: usize| {
            let mut next = &phi[0] * &phi[k];
            for j in 1..=k {
                next += &phi[j] * faer::Scale(INVERSE_FACTORIALS[k - j]);
            }
            next * faer::Scale(0.5_f64.powi(k as i32))
        };
        phi = (0..phi.len()).map(next).collect();
    }
    phi
}

fn identity(n: usize, value: f64) -> Mat<f64> {
    Mat::from_fn(n, n, |i, j| if i == j { value } else { 0.0 })
}

/// As a dense matrix with so many columns. Entries of others are left out.
fn dense(rows: &Rows, columns: usize) -> Mat<f64> {
    top(rows, columns, rows.len())
}

/// The first `count` rows as a dense matrix with so many columns.
fn top(rows: &Rows, columns: usize, count: usize) -> Mat<f64> {
    let mut matrix = Mat::zeros(count, columns);
    for (i, j, value) in rows.iter().filter(|&(i, j, _)| i < count && j < columns) {
        matrix[(i, j)] += value;
    }
    matrix
}
