//! What holds the optimum back: multipliers of the limits and bounds that are active there.
//!
//! At the optimum Σ μⱼ ∇pⱼ + Σ λⱼ ∇gⱼ + Σ νⱼ ∇bⱼ = 0 with Σ μⱼ = 1, over the parts p of the objective that are least,
//! the constraints g and the bounds b that are active, and multipliers of at least 0. Gradients are differences; the
//! multipliers are the least squares.

use crate::error::TuneError;
use crate::figures::Figures;
use crate::file::{Constraints, Objective};
use crate::goal::{Goal, Limit};
use crate::search::{Evaluate, Point};

/// Places are changed by this.
const CHANGE: f64 = 2e-4;
/// A part or constraint this near to its limit is active.
const NEAR: f64 = 0.006;
/// A place this near to a bound is on it.
pub(crate) const ON_BOUND: f64 = 2e-3;
/// Sweeps of the least squares.
const SWEEPS: usize = 20_000;

/// Something that is active: a constraint of a condition, or a bound of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cause {
    Limit(usize, Limit),
    /// Of a parameter, the upper one.
    Bound(usize, bool),
}

/// What is active, with what the objective gains if it is relaxed by 1 %.
pub(crate) fn active(
    evaluate: &Evaluate<'_>,
    goal: &Goal,
    best: &Point,
) -> Result<Vec<(Cause, f64)>, TuneError> {
    let dimension = best.places.len();
    let numbers = |figures: &[Figures]| {
        let mut all = goal.parts(figures);
        all.extend(figures.iter().flat_map(|it| goal.constraints(it)).map(|it| it.1));
        all
    };
    let here = numbers(&best.figures);
    let parts = goal.parts(&best.figures).len();
    let least = here[..parts].iter().copied().fold(f64::INFINITY, f64::min);
    let mut gradient = vec![vec![0.0; dimension]; here.len()];
    for k in 0..dimension {
        let mut places = best.places.clone();
        let change = if places[k] > 0.5 { -CHANGE } else { CHANGE };
        places[k] += change;
        let there = numbers(&evaluate(&places)?);
        for (row, (a, b)) in gradient.iter_mut().zip(here.iter().zip(&there)) {
            row[k] = (b - a) / change;
        }
    }
    let limits: Vec<(usize, Limit)> = best
        .figures
        .iter()
        .enumerate()
        .flat_map(|(k, it)| goal.constraints(it).into_iter().map(move |it| (k, it.0)))
        .collect();
    let mut columns: Vec<(Option<Cause>, Vec<f64>)> = Vec::new();
    for k in (0..parts).filter(|&k| here[k] - least <= NEAR) {
        let mut column = gradient[k].clone();
        column.push(1.0);
        columns.push((None, column));
    }
    for (k, &(condition, limit)) in limits.iter().enumerate() {
        if here[parts + k].abs() <= NEAR {
            let mut column = gradient[parts + k].clone();
            column.push(0.0);
            columns.push((Some(Cause::Limit(condition, limit)), column));
        }
    }
    for (k, place) in best.places.iter().enumerate() {
        for upper in [false, true] {
            if (if upper { 1.0 - place } else { *place }) <= ON_BOUND {
                let mut column = vec![0.0; dimension + 1];
                column[k] = if upper { -1.0 } else { 1.0 };
                columns.push((Some(Cause::Bound(k, upper)), column));
            }
        }
    }
    let mut right = vec![0.0; dimension + 1];
    right[dimension] = 1.0;
    // the sum of the parts' multipliers must be met, whatever the size of the gradients
    let weight =
        1.0 + columns.iter().flat_map(|it| &it.1).fold(0.0, |size: f64, x| size.max(x.abs()));
    for (_, column) in &mut columns {
        column[dimension] *= weight;
    }
    right[dimension] *= weight;
    let list: Vec<&[f64]> = columns.iter().map(|it| it.1.as_slice()).collect();
    let multipliers = not_negative(&list, &right);
    let own = scaled(goal, least);
    let found = columns.iter().zip(multipliers).filter_map(|((cause, _), multiplier)| {
        let cause = (*cause)?;
        let percent = match cause {
            Cause::Limit(_, limit) => one_percent(limit, &goal.limits),
            Cause::Bound(..) => 0.01,
        };
        Some((cause, multiplier * percent * own))
    });
    Ok(found.collect())
}

/// 1 % of a limit, in the scale of the constraint.
fn one_percent(limit: Limit, limits: &Constraints) -> f64 {
    let of = |value: Option<f64>| 0.01 * value.unwrap_or(0.0);
    match limit {
        Limit::Damping => of(limits.damping),
        Limit::Outside => 0.0,
        Limit::ModulusOne | Limit::ModulusAll => of(limits.modulus),
        Limit::DelayOne | Limit::DelayAll | Limit::Voltage => 0.01,
    }
}

/// The objective over its scaled parts.
fn scaled(goal: &Goal, least: f64) -> f64 {
    match goal.objective {
        Objective::Damping | Objective::Modulus => 1.0,
        Objective::Decay => 10.0,
        Objective::Voltage => (-least / 0.3).exp() / 0.3,
    }
}

/// z ≥ 0 with the least |Σ zⱼ aⱼ − b|², by changing one after the other.
fn not_negative(columns: &[&[f64]], right: &[f64]) -> Vec<f64> {
    let mut z = vec![0.0; columns.len()];
    let mut rest = right.to_vec();
    for _ in 0..SWEEPS {
        let mut largest = 0.0_f64;
        for (z, column) in z.iter_mut().zip(columns) {
            let square: f64 = column.iter().map(|x| x * x).sum();
            if square == 0.0 {
                continue;
            }
            let along: f64 = column.iter().zip(&rest).map(|(a, r)| a * r).sum();
            let next = (*z + along / square).max(0.0);
            let change = next - *z;
            rest.iter_mut().zip(*column).for_each(|(r, a)| *r -= change * a);
            largest = largest.max(change.abs());
            *z = next;
        }
        if largest < 1e-10 {
            break;
        }
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_least_squares_without_negative_multipliers() {
        // 2 a + 3 b exactly; −1 of c is not allowed
        let (a, b, c) = ([1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, -1.0]);
        let z = not_negative(&[&a, &b, &c], &[2.0, 3.0, 5.0]);
        assert!((z[0] - 2.0).abs() < 1e-6 && (z[1] - 3.0).abs() < 1e-6 && z[2] < 1e-6, "{z:?}");
    }

    /// Maximise x under y ≤ 0.4 as a modulus of 1 − y ≥ 0.6, with x = y/2: the multiplier is ½, and 1 % of the limit
    /// is 0.006.
    #[test]
    fn analytic_the_multiplier_of_an_active_limit() {
        let limits = Constraints { damping: None, modulus: Some(0.6), delay: None, voltage: None };
        let goal = Goal { objective: Objective::Damping, limits, reserved: false };
        let evaluate = |x: &[f64]| {
            Ok(vec![Figures {
                damping: 0.5 * x[0],
                outside: 1.0,
                least: vec![0.5 * x[0]],
                modulus_one: 1.0 - x[0],
                modulus_all: 1.0,
                ..Figures::default()
            }])
        };
        let best = Point { places: vec![0.4], figures: evaluate(&[0.4]).unwrap() };
        let found = active(&evaluate, &goal, &best).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].0, Cause::Limit(0, Limit::ModulusOne));
        assert!((found[0].1 - 0.003).abs() < 1e-8, "{found:?}");
        // on its bound instead
        let best = Point { places: vec![1.0], figures: evaluate(&[1.0]).unwrap() };
        let goal = Goal { limits: Constraints { modulus: None, ..goal.limits }, ..goal };
        let found = active(&evaluate, &goal, &best).unwrap();
        assert!(
            found[0].0 == Cause::Bound(0, true) && (found[0].1 - 0.005).abs() < 1e-8,
            "{found:?}"
        );
    }
}
