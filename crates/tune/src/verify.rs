//! The whole system, started anew with the values found.

use std::f64::consts::TAU;

use faer::prelude::c64;
use linear::Linearised;
use response::{BreakPoint, Loops, breaking};
use scenario::Scenario;
use stability_map::damping;

use crate::condition::{Prepared, setup};
use crate::error::TuneError;
use crate::result::Verified;

/// An eigenvalue of the whole system is one of the parts' if it is as near as this, relative.
const SAME: f64 = 3e-3;
/// Untouched modes that are listed.
const LISTED: usize = 6;
/// Modes that are compared.
const COMPARED: usize = 6;
/// Loops up to which margins are computed again from the whole system: it takes minutes for a train.
const FEW: usize = 8;

/// Starts the scenario with `set`, and compares all eigenvalues with those of the parts: those that count, and all.
pub(crate) fn verify(
    scenario: &Scenario,
    set: &[(String, String)],
    prepared: &Prepared<'_>,
    [counted, all]: &[Vec<c64>; 2],
) -> Result<Verified, TuneError> {
    let system = Linearised::at_start(&setup(scenario, set)?)?.system;
    let mut values: Vec<c64> = linear::eigenvalues(&system.matrix()?)?;
    values.retain(|it| it.im >= -1e-6 * it.norm() && it.norm() > 1e-6);
    values.sort_by(|a, b| damping(*a).total_cmp(&damping(*b)).then(a.im.total_cmp(&b.im)));
    let distance = |list: &[c64], s: c64| {
        list.iter().map(|it| (it - s).norm() / s.norm().max(1e-3)).fold(f64::INFINITY, f64::min)
    };
    let compared = counted.iter().take(COMPARED);
    let worst = compared.clone().map(|s| distance(&values, *s)).fold(0.0, f64::max);
    let nearest = |s: &c64| {
        values
            .iter()
            .copied()
            .min_by(|a, b| (a - s).norm().total_cmp(&(b - s).norm()))
            .unwrap_or(*s)
    };
    let least = compared.map(|s| damping(nearest(s))).fold(f64::INFINITY, f64::min);
    let untouched = values
        .iter()
        .filter(|s| distance(all, **s) > SAME)
        .take(LISTED)
        .map(|s| (s.norm() / TAU, damping(*s)))
        .collect();
    let names = prepared.broken();
    let margins = if (1..=FEW).contains(&names.len()) && counted.iter().all(|s| s.re < 0.0) {
        let points = names
            .iter()
            .map(|name| BreakPoint::new(&system, name))
            .collect::<Result<Vec<_>, _>>()?;
        let loops = Loops::new(&breaking::loops(&system, &points)?, &names)?.analyse(false)?;
        let mut found = [1.0_f64, 10.0, 1.0, 10.0];
        for margins in loops.single.iter().filter_map(|it| it.margins.as_ref()) {
            found[0] = found[0].min(margins.modulus.value);
            found[1] = found[1].min(margins.delay.map_or(10.0, |it| it.seconds));
        }
        (found[2], found[3]) = (found[0], found[1]);
        if let Some(equal) = loops.together.as_ref().and_then(|it| it.equal.as_ref()) {
            (found[2], found[3]) = (equal.modulus.value, equal.delay.map_or(10.0, |it| it.seconds));
        }
        loops.stable.then_some(found)
    } else {
        None
    };
    Ok(Verified { damping: least, distance: worst, margins, untouched })
}
