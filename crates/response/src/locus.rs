//! Eigenvalues followed by continuity, over a gain or over frequency.

use faer::prelude::c64;
use results::response::RootLocus;

use crate::error::ResponseError;
use crate::model::Model;

/// For each of `count` places the position that costs least there, no position twice: the cheapest pairs
/// first.
pub fn assigned(count: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<usize> {
    let places = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    let mut pairs: Vec<(f64, usize, usize)> = places.map(|(i, j)| (cost(i, j), i, j)).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<Option<usize>> = vec![None; count];
    let mut taken = vec![false; count];
    for (_, i, j) in pairs {
        if found[i].is_none() && !taken[j] {
            found[i] = Some(j);
            taken[j] = true;
        }
    }
    found.into_iter().enumerate().map(|(i, j)| j.unwrap_or(i)).collect()
}

/// Orders `next` so that each value continues the one at its place before. `expected` are the values where
/// the branches would be, as many; `distance` measures how far two values are apart.
pub fn continued(expected: &[c64], next: &[c64], distance: impl Fn(c64, c64) -> f64) -> Vec<c64> {
    let order = assigned(expected.len(), |i, j| distance(expected[i], next[j]));
    order.into_iter().map(|j| next[j]).collect()
}

/// Distance on Riemann's sphere, so that large values count by their inverses.
#[must_use]
pub fn chordal(a: c64, b: c64) -> f64 {
    (a - b).norm() / ((1.0 + a.norm_sqr()) * (1.0 + b.norm_sqr())).sqrt()
}

/// Curves from lists of values over `places`, each list in any order.
#[must_use]
pub fn branches(
    places: &[f64],
    lists: &[Vec<c64>],
    distance: impl Fn(c64, c64) -> f64,
) -> Vec<Vec<c64>> {
    let Some(first) = lists.first() else { return Vec::new() };
    let mut branches: Vec<Vec<c64>> = first.iter().map(|value| vec![*value]).collect();
    for (k, list) in lists.iter().enumerate().skip(1) {
        // where a straight line would lead
        let expected: Vec<c64> = branches
            .iter()
            .map(|branch| match (k >= 2).then(|| &branch[k - 2..]) {
                Some(&[before, last]) => {
                    let share = (places[k] - places[k - 1]) / (places[k - 1] - places[k - 2]);
                    last + (last - before) * share.clamp(0.0, 2.0)
                }
                _ => branch[k - 1],
            })
            .collect();
        let next = continued(&expected, list, &distance);
        branches.iter_mut().zip(next).for_each(|(branch, value)| branch.push(value));
    }
    branches
}

/// The root locus of eigenvalues (1/s) over the values of a parameter.
#[must_use]
pub fn root_locus(parameter: &str, values: &[f64], eigenvalues: &[Vec<c64>]) -> RootLocus {
    let nearness = |a: c64, b: c64| (a - b).norm() / (1.0 + a.norm().max(b.norm()));
    let all = branches(values, eigenvalues, nearness);
    let mut crossings = Vec::new();
    for branch in &all {
        for (k, pair) in branch.windows(2).enumerate() {
            let (a, b) = (pair[0], pair[1]);
            if a.re.signum() == b.re.signum() || a.im.max(b.im) < 0.0 {
                continue;
            }
            let share = a.re / (a.re - b.re);
            let value = values[k] + share * (values[k + 1] - values[k]);
            let omega = a.im + share * (b.im - a.im);
            crossings.push((value, omega.abs() / std::f64::consts::TAU));
        }
    }
    crossings.sort_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0));
    // of a pair the one above the real axis
    let upper = all.into_iter().filter(|branch| branch.iter().any(|it| it.im >= 0.0));
    RootLocus {
        parameter: parameter.to_owned(),
        values: values.to_vec(),
        branches: upper.map(|it| it.iter().map(|x| (x.re, x.im)).collect()).collect(),
        crossings,
    }
}

/// Eigenvalues (1/s) of the closed loops with all loop gains multiplied by `gain`.
///
/// # Errors
/// An algebraic loop has no solution, or the eigenvalues do not converge.
pub fn with_gain(open: &Model, gain: f64) -> Result<Vec<c64>, ResponseError> {
    let scaled =
        Model { c: faer::Scale(gain) * &open.c, d: faer::Scale(gain) * &open.d, ..open.clone() };
    let closed = scaled
        .closed()
        .ok_or_else(|| ResponseError::Algebraic { at: format!("a gain of {gain}") })?;
    Ok(closed.poles()?.into_iter().map(|pole| open.domain.rate(pole)).collect())
}
