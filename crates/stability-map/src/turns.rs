//! How far a determinant's argument turns from one point of the boundary to the next.

use faer::prelude::c64;

use crate::node::{Product, nearest_pairs};

/// Distance of two points, as a fraction, below which a factor's turn may be due to a known zero alone.
const NEAR: f64 = 0.005;
/// What such a factor may turn besides (rad).
const REST: f64 = 0.4;
/// Largest turn of a factor (rad).
const LARGEST: f64 = 0.54;
/// Largest sum of turns (rad) that are taken as one: below π.
const TOGETHER: f64 = 2.5;
/// Numbers beyond this are scaled.
const LARGE: f64 = 1e100;

/// Sum of small turns.
pub(crate) struct Sum {
    turned: f64,
    product: c64,
    bound: f64,
}

impl Sum {
    pub fn new() -> Self {
        Self { turned: 0.0, product: c64::new(1.0, 0.0), bound: 0.0 }
    }

    /// Adds the turn from `a` to `b`, if it is below `limit` with tangent `steep`.
    #[inline]
    pub fn add(&mut self, a: c64, b: c64, (limit, steep): (f64, f64)) -> bool {
        let ratio = b * a.conj();
        let (x, y) = (ratio.re, ratio.im.abs());
        if !(x > 0.0 && y < steep * x) {
            return false;
        }
        self.product *= ratio;
        // the tangent is larger than the angle
        self.bound += if y < 0.02 * x { 0.02 } else { limit };
        if self.bound > TOGETHER {
            self.flush();
        } else {
            let size = self.product.l1_norm();
            if !(1.0 / LARGE..LARGE).contains(&size) {
                self.product *= 1.0 / size;
            }
        }
        true
    }

    fn flush(&mut self) {
        self.turned += self.product.arg();
        (self.product, self.bound) = (c64::new(1.0, 0.0), 0.0);
    }

    pub fn total(mut self) -> f64 {
        self.flush();
        self.turned
    }
}

/// Change of the determinant's argument between neighbouring points: the sum over its factors, each of which must turn by
/// less than `limit`, or by less than that beside a known zero. None if one turns further.
pub(crate) fn turn_between(
    (s, left): (c64, &Product),
    (next, right): (c64, &Product),
    known: &[c64],
    limit: f64,
) -> Option<f64> {
    let least = LARGEST.min(limit);
    let narrow = (least, least.tan());
    let mut small = Sum::new();
    let mut wide: Vec<(c64, c64)> = Vec::new();
    for (a, b) in left.factors.iter().zip(&right.factors) {
        if !small.add(*a, *b, narrow) {
            wide.push((*a, *b));
        }
    }
    let mut sum = small.total();
    let rest = right.rest * left.rest.conj();
    let fits = rest.arg().abs() < limit;
    if fits && wide.is_empty() {
        return Some(sum + rest.arg());
    }
    let wide = matched(wide);
    // turns about known zeros, which have no ambiguity; only between points so near that nothing else turns far there
    if (next - s).norm() > NEAR * s.norm() {
        return None;
    }
    let about = |zero: c64| (next - zero) / (s - zero);
    let all = known.iter().flat_map(|&zero| {
        let pair = zero.im != 0.0;
        [Some(zero), pair.then(|| zero.conj())].into_iter().flatten()
    });
    let mut near: Vec<c64> = all.map(about).filter(|ratio| ratio.arg().abs() > 0.2).collect();
    for ratio in wide {
        if ratio.arg().abs() < limit {
            sum += ratio.arg();
            continue;
        }
        let turn = |k: usize| (ratio / near[k]).arg();
        let best = (0..near.len()).min_by(|&i, &j| turn(i).abs().total_cmp(&turn(j).abs()));
        match best {
            Some(k) if turn(k).abs() < REST => {
                sum += turn(k) + near[k].arg();
                near.swap_remove(k);
            }
            _ => return None,
        }
    }
    if fits {
        return Some(sum + rest.arg());
    }
    let zeros: c64 = near.iter().map(|ratio| ratio / ratio.norm()).product();
    let turn = (rest / zeros).arg();
    (turn.abs() < REST).then(|| sum + turn + near.iter().map(|ratio| ratio.arg()).sum::<f64>())
}

/// Ratios of factors whose order is unclear, as eigenvalues have crossed: each with the nearest.
fn matched(wide: Vec<(c64, c64)>) -> Vec<c64> {
    let (left, right): (Vec<c64>, Vec<c64>) = wide.into_iter().unzip();
    nearest_pairs(&left, &right).into_iter().map(|(i, k)| right[k] * left[i].conj()).collect()
}
