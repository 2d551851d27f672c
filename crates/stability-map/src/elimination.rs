//! Small systems of complex equations: too small for a library's overhead.

use faer::prelude::c64;

/// x ← M⁻¹ x for a matrix by rows, which is overwritten, by elimination with pivots.
pub(crate) fn solve(m: &mut [c64], x: &mut [c64]) {
    let n = x.len();
    for k in 0..n {
        let size = |i: usize| m[i * n + k].l1_norm();
        let pivot = (k..n).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(k);
        if pivot != k {
            (k..n).for_each(|j| m.swap(k * n + j, pivot * n + j));
            x.swap(k, pivot);
        }
        let inverse = m[k * n + k].inv();
        for i in k + 1..n {
            if m[i * n + k] == c64::new(0.0, 0.0) {
                continue;
            }
            let factor = m[i * n + k] * inverse;
            for j in k + 1..n {
                let above = m[k * n + j];
                m[i * n + j] -= factor * above;
            }
            let above = x[k];
            x[i] -= factor * above;
        }
    }
    for k in (0..n).rev() {
        let mut sum = x[k];
        for j in k + 1..n {
            sum -= m[k * n + j] * x[j];
        }
        x[k] = sum / m[k * n + k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first pivot is zero, so rows change places.
    #[test]
    fn analytic_a_solution_is_found_with_pivots() {
        let c = |re: f64, im: f64| c64::new(re, im);
        let m = [
            c(0.0, 0.0),
            c(2.0, 1.0),
            c(1.0, 0.0),
            c(3.0, -1.0),
            c(1.0, 0.0),
            c(0.0, 4.0),
            c(0.0, 1.0),
            c(-1.0, 0.0),
            c(5.0, 2.0),
        ];
        let wanted = [c(1.0, -2.0), c(0.5, 0.0), c(-3.0, 1.0)];
        let mut x: Vec<c64> =
            (0..3).map(|i| (0..3).map(|j| m[3 * i + j] * wanted[j]).sum()).collect();
        solve(&mut m.clone(), &mut x);
        assert!(x.iter().zip(wanted).all(|(x, wanted)| (x - wanted).norm() < 1e-14), "{x:?}");
    }
}
