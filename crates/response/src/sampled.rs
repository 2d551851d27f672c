//! Loops whose signals are sampled and held, as a digital controller holds its output.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

use crate::error::ResponseError;
use crate::model::{Domain, Model};

/// Norm below which the Padé approximant of degree 6 is exact to rounding.
const SMALL: f64 = 0.5;
/// Coefficients of the diagonal Padé approximant of degree 6 of the exponential.
const PADE: [f64; 7] =
    [1.0, 0.5, 5.0 / 44.0, 1.0 / 66.0, 1.0 / 792.0, 1.0 / 15_840.0, 1.0 / 665_280.0];

/// exp(A) by scaling and squaring (Moler and Van Loan 2003, "Nineteen dubious ways", method 3).
#[must_use]
pub fn exponential(a: &Mat<f64>) -> Mat<f64> {
    let n = a.nrows();
    let norm = (0..n).map(|j| a.col(j).iter().map(|x| x.abs()).sum()).fold(0.0, f64::max);
    let mut squarings = 0;
    let mut scale = 1.0;
    while norm * scale > SMALL && squarings < 1000 {
        squarings += 1;
        scale *= 0.5;
    }
    let a = Mat::from_fn(n, n, |i, j| scale * a[(i, j)]);
    let mut power = Mat::<f64>::identity(n, n);
    let (mut above, mut below) = (Mat::<f64>::zeros(n, n), Mat::<f64>::zeros(n, n));
    for (k, coefficient) in PADE.into_iter().enumerate() {
        if k > 0 {
            power = &power * &a;
        }
        let sign = if k % 2 == 0 { coefficient } else { -coefficient };
        above += faer::Scale(coefficient) * &power;
        below += faer::Scale(sign) * &power;
    }
    let mut result = PartialPivLu::new(below.as_ref()).solve(&above);
    for _ in 0..squarings {
        result = &result * &result;
    }
    result
}

/// The loop at the samples: its inputs are held over `period` (s), and act `delay` samples after they were
/// taken.
///
/// # Errors
/// The period is not positive, or the loop has feed-through.
pub fn sampled(model: &Model, period: f64, delay: usize, at: &str) -> Result<Model, ResponseError> {
    if !(period.is_finite() && period > 0.0) {
        return Err(ResponseError::Period { value: period });
    }
    let Model { a, b, c, d, .. } = model;
    if d.col_iter().any(|it| it.iter().any(|x| *x != 0.0)) {
        return Err(ResponseError::FeedThrough { at: at.to_owned() });
    }
    let (n, m) = (a.nrows(), b.ncols());
    // exp of [A B; 0 0]·h is [Φ Γ; 0 I]; states scaled, so that its norm is small
    let linear::eigen::Balanced { matrix: balanced, scale } = linear::eigen::balanced(a);
    let joint = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => period * balanced[(i, j)],
        (true, false) => period * b[(i, j - n)] / scale[i],
        _ => 0.0,
    });
    // columns of B of any size would need more squarings than A does
    let most = |range: std::ops::Range<usize>| {
        let sums = range.map(|j| joint.col(j).iter().map(|x| x.abs()).sum::<f64>());
        sums.fold(0.0, f64::max)
    };
    let (own, by_inputs) = (most(0..n).max(1e-300), most(n..n + m));
    let factor = if by_inputs > own { own / by_inputs } else { 1.0 };
    let joint = Mat::from_fn(n + m, n + m, |i, j| joint[(i, j)] * if j < n { 1.0 } else { factor });
    let map = exponential(&joint);
    // states: x, then the inputs of the latest samples, the newest first
    let all = n + m * delay;
    let phi = |i: usize, j: usize| map[(i, j)] * scale[i] / scale[j];
    let gamma = |i: usize, j: usize| map[(i, n + j)] * scale[i] / factor;
    let a = Mat::from_fn(all, all, |i, j| match (i < n, j < n) {
        (true, true) => phi(i, j),
        (true, false) if j >= all - m => gamma(i, j - (all - m)),
        (false, false) => f64::from(u8::from(i >= n + m && j + m == i)),
        _ => 0.0,
    });
    let b = Mat::from_fn(all, m, |i, j| {
        if delay == 0 { gamma(i, j) } else { f64::from(u8::from(i >= n && i - n == j)) }
    });
    let c = Mat::from_fn(c.nrows(), all, |i, j| if j < n { c[(i, j)] } else { 0.0 });
    Ok(Model { a, b, c, d: d.clone(), domain: Domain::Sampled { period } })
}
