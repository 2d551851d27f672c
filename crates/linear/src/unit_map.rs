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
    pub by_state: Mat<f64>,
    /// x(h) by u⁽ᵏ⁾, up to the degree of the inputs.
    pub by_input: Vec<Mat<f64>>,
    /// y⁽ᵏ⁾ by x: C Aᵏ, up to the highest derivative that an output provides.
    pub outputs_by_state: Vec<Mat<f64>>,
    /// y⁽ᵏ⁾ by u⁽ᵏ⁻ᵈ⁾, for d = 0, 1 …: D, C B, C A B …
    pub outputs_by_input: Vec<Mat<f64>>,
}

impl UnitMap {
    /// The step of `size` of a unit whose inputs are polynomials of a `degree` up to 5 and whose outputs provide
    /// derivatives up to `order`, with all inputs or the connected ones only.
    ///
    /// # Errors
    /// The unit is too fast for the step, or its eigenvalues cannot be found.
    pub fn new(
        unit: &LinearUnit,
        [degree, order]: [usize; 2],
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
            (&phi * b.subcols(0, columns)) * faer::Scale(factor)
        });
        let by_input = by_input.collect();
        let mut outputs_by_state = vec![c];
        let mut outputs_by_input = vec![d];
        for k in 0..order {
            outputs_by_input.push(&outputs_by_state[k] * &b);
            outputs_by_state.push(times_rows(&outputs_by_state[k], &unit.a));
        }
        Ok(Self { by_state, by_input, outputs_by_state, outputs_by_input })
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
    // of the last, φₖ(z) = Σ zʲ/(j + k)!, until three terms in a row no longer change the sum
    let mut term = identity(n, INVERSE_FACTORIALS[last]);
    let mut sum = term.clone();
    let mut small = 0;
    for j in 1..MOST_TERMS {
        term = rows_times(a, &term, size / (j as f64 + last as f64));
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
        all[k] = rows_times(a, &all[k + 1], size);
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

/// factor · rows · matrix.
fn rows_times(rows: &Rows, matrix: &Mat<f64>, factor: f64) -> Mat<f64> {
    let mut product = Mat::zeros(rows.len(), matrix.ncols());
    for (into, from) in product.col_iter_mut().zip(matrix.col_iter()) {
        for (i, sum) in into.iter_mut().enumerate() {
            *sum = factor * rows.times(i, |j| from[j]);
        }
    }
    product
}

/// matrix · rows.
fn times_rows(matrix: &Mat<f64>, rows: &Rows) -> Mat<f64> {
    matrix * dense(rows, matrix.ncols())
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
