//! Scales of states.

use faer::Mat;

/// Sweeps over all states, which usually converge in a few.
const SWEEPS: usize = 10;

/// Powers of two by which the states are divided so that rows and columns of A have similar sizes (Osborne 1960):
/// places and rates differ by their frequency.
pub(crate) fn scales(a: &Mat<f64>) -> Vec<f64> {
    let n = a.nrows();
    let mut scale = vec![1.0; n];
    for _ in 0..SWEEPS {
        for k in 0..n {
            let others = || (0..n).filter(move |&j| j != k);
            let row: f64 = others().map(|j| (a[(k, j)] * scale[j] / scale[k]).abs()).sum();
            let column: f64 = others().map(|j| (a[(j, k)] * scale[k] / scale[j]).abs()).sum();
            if row > 0.0 && column > 0.0 {
                scale[k] *= (0.5 * (row / column).log2()).round().exp2();
            }
        }
    }
    scale
}
