//! The whole system, started anew with the values found.

use std::f64::consts::TAU;

use faer::prelude::c64;
use linear::{LinearSystem, Linearised};
use response::{BreakPoint, Loops, breaking};
use scenario::Scenario;
use stability_map::damping;

use crate::condition::{Prepared, setup};
use crate::counting::{Mode, Role, order};
use crate::error::TuneError;
use crate::result::Verified;

/// Modes that the varied units do not reach are the same at both starts if they are as near as this, relative.
const SAME: f64 = 3e-3;
/// Modes that are compared: the least damped.
const COMPARED: usize = 6;
/// Untouched modes that are listed.
const LISTED: usize = 6;
/// Loops up to which margins are computed again from the whole system: it takes minutes for a train.
const FEW: usize = 8;

/// Eigenvalues of a whole system with Im ≥ 0, but for free motions; least damped first.
pub(crate) fn whole_system(system: &LinearSystem) -> Result<Vec<c64>, TuneError> {
    let mut values: Vec<c64> = linear::eigenvalues(&system.matrix()?)?;
    values.retain(|it| it.im >= -1e-6 * it.norm() && it.norm() > 1e-6);
    values.sort_by(|a, b| order(*a, *b));
    Ok(values)
}

/// Eigenvalues of a whole system by the modes that are known.
pub(crate) struct Named {
    /// Those of the modes that count: the mode and the eigenvalue.
    pub counting: Vec<(c64, c64)>,
    /// Those that belong to no mode.
    pub unreached: Vec<c64>,
}

/// Each mode takes the nearest eigenvalue that is left, the nearest pair first.
pub(crate) fn named(values: &[c64], modes: &[Mode]) -> Named {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (m, mode) in modes.iter().enumerate() {
        let distance = |s: &c64| (mode.value - s).norm() / s.norm();
        pairs.extend(values.iter().enumerate().map(|(k, s)| (distance(s), m, k)));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut done, mut taken) = (vec![false; modes.len()], vec![false; values.len()]);
    let mut counting = Vec::new();
    for (_, m, k) in pairs {
        if done[m] || taken[k] {
            continue;
        }
        (done[m], taken[k]) = (true, true);
        if modes[m].role == Role::Counts {
            counting.push((modes[m].value, values[k]));
        }
    }
    counting.sort_by(|a, b| order(a.1, b.1));
    let unreached = values.iter().zip(&taken).filter(|it| !it.1).map(|it| *it.0).collect();
    Named { counting, unreached }
}

/// Starts the scenario with `set`, and names all its eigenvalues by the modes of the table: those that count there count
/// here.
pub(crate) fn verify(
    scenario: &Scenario,
    set: &[(String, String)],
    prepared: &Prepared<'_>,
    modes: &[Mode],
) -> Result<Verified, TuneError> {
    let system = Linearised::at_start(&setup(scenario, set)?)?.system;
    let Named { counting, unreached } = named(&whole_system(&system)?, modes);
    let distance = |(mode, s): &(c64, c64)| (mode - s).norm() / s.norm();
    let worst = counting.iter().take(COMPARED).map(distance).fold(0.0, f64::max);
    let least = counting.first().map_or(1.0, |it| damping(it.1));
    let shown = |s: &c64| (s.norm() / TAU, damping(*s));
    let before =
        |s: &&c64| prepared.unreached.iter().any(|it| (*it - **s).norm() <= SAME * s.norm());
    let untouched = unreached.iter().filter(before).take(LISTED).map(shown).collect();
    let unknown = unreached.iter().filter(|it| !before(it)).take(LISTED).map(shown).collect();
    let names = prepared.broken();
    let margins = if (1..=FEW).contains(&names.len()) && counting.iter().all(|it| it.1.re < 0.0) {
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
    Ok(Verified { damping: least, distance: worst, margins, untouched, unknown })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A new start's eigenvalue counts if its mode counts in the table, however little it is damped; what belongs to no
    /// mode is left over.
    #[test]
    fn invariant_a_new_start_counts_what_the_table_counts() {
        let mode = |re, im, role| Mode { value: c64::new(re, im), role };
        let modes = [
            mode(-0.2, 10.0, Role::LeftOut),
            mode(-0.5, 10.0, Role::Counts),
            mode(-0.3, 60.0, Role::OutOfBand),
        ];
        let values = [(-0.1, 31.0), (-0.21, 10.01), (-0.29, 60.0), (-0.51, 10.01)];
        let values: Vec<c64> = values.iter().map(|it| c64::new(it.0, it.1)).collect();
        let Named { counting, unreached } = named(&values, &modes);
        assert_eq!(counting, [(c64::new(-0.5, 10.0), c64::new(-0.51, 10.01))]);
        assert_eq!(unreached, [c64::new(-0.1, 31.0)]);
    }
}
