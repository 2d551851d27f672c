//! Which modes count: one rule for the search, the figures that are shown, the front and the new start.
//!
//! At the start each parameter is changed on its own. Modes whose damping ratio none of them changes much are left out:
//! a sway of the car bodies that no magnet damps would hide everything else. This is decided once per condition, on the
//! system without anything left out. With other values a mode is known again by its shape, not by its eigenvalue, which
//! others may pass: if v and w are the right and left eigenvectors of the modes L that are left out at the start, then
//! P = Σ v wᴴ over L projects on their motion. For a mode x, y with other values (yᴴ x = 1) the number yᴴ P x does not
//! depend on the units or scales of the states, is 1 or 0 at the start, and the numbers of all modes add up to the number
//! of modes in L. A mode is one of those left out where it is more than one half.

use std::f64::consts::TAU;

use faer::Mat;
use faer::prelude::c64;
use linear::Eigen;
use serde::{Deserialize, Serialize};
use stability_map::damping;

use crate::closed::{Laws, matrix};
use crate::core::Core;
use crate::error::TuneError;
use crate::figures::eigenvalues;

/// Modes with more damping need not be left out.
const DAMPED: f64 = 0.9;
/// Share of modes left out from which a mode is one of them.
const HALF: f64 = 0.5;
/// Motions slower than this (1/s) are free ones: their damping ratio is a rounding error.
const FREE: f64 = 1e-3;
/// All frequencies (Hz).
pub(crate) const ALL: (f64, f64) = (0.0, f64::INFINITY);

/// A mode that the parameters hardly move.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ignored {
    /// |λ|/2π (Hz).
    pub frequency_hz: f64,
    /// Damping ratio at the start.
    pub damping: f64,
    /// λ (1/s).
    pub value: (f64, f64),
    /// How far its damping ratio moved at most when each parameter was changed on its own, as a fraction.
    pub moved: f64,
    /// Whether its frequency is in the band in which modes count.
    pub in_band: bool,
}

/// What a mode is for the objective.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Counts,
    /// Its frequency is out of the band: it must decay.
    OutOfBand,
    /// The parameters hardly move it.
    LeftOut,
}

/// An eigenvalue with Im ≥ 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mode {
    pub value: c64,
    pub role: Role,
}

/// Which modes count.
#[derive(Debug, Clone)]
pub(crate) struct Rule {
    /// What is left out, at the start: those in the band first, then by damping.
    pub left_out: Vec<Ignored>,
    /// Of each block Σ v wᴴ over the modes left out and their conjugates; none if all of its modes count.
    projections: Vec<Option<Mat<f64>>>,
    band: (f64, f64),
}

impl Rule {
    /// All modes in a band count.
    pub fn all(band: (f64, f64)) -> Self {
        Self { left_out: Vec::new(), projections: Vec::new(), band }
    }

    /// Leaves out modes whose damping ratio no change of the laws changes by this fraction.
    pub fn new(
        core: &Core,
        start: &Laws,
        changed: &[Laws],
        influence: f64,
        band: (f64, f64),
    ) -> Result<Self, TuneError> {
        let mut rule = Self::all(band);
        let mut base: Vec<(usize, Eigen)> = Vec::new();
        for (k, block) in core.blocks.iter().enumerate() {
            base.extend(linear::eigen(&matrix(block, start))?.into_iter().map(|it| (k, it)));
        }
        let values: Vec<c64> = base.iter().map(|it| it.1.value).collect();
        let mut moved = vec![0.0_f64; base.len()];
        for laws in changed {
            let changes = changes(&values, eigenvalues(core, laws)?);
            moved.iter_mut().zip(changes).for_each(|(most, it)| *most = most.max(it));
        }
        rule.projections = vec![None; core.blocks.len()];
        for ((block, mode), moved) in base.iter().zip(&moved) {
            let ratio = damping(mode.value);
            if !(ratio < DAMPED && *moved < influence * ratio.abs()) {
                continue;
            }
            let frequency_hz = mode.value.norm() / TAU;
            rule.left_out.push(Ignored {
                frequency_hz,
                damping: ratio,
                value: (mode.value.re, mode.value.im),
                moved: moved / ratio.abs(),
                in_band: rule.inside(mode.value),
            });
            let n = mode.shape.len();
            // with its conjugate
            let factor = if mode.value.im > 0.0 { 2.0 } else { 1.0 };
            let part = Mat::from_fn(n, n, |i, j| {
                let (v, w) = (mode.shape[i], mode.left[j]);
                factor * (v.re * w.re + v.im * w.im)
            });
            match &mut rule.projections[*block] {
                Some(sum) => *sum += part,
                none => *none = Some(part),
            }
        }
        rule.left_out
            .sort_by(|a, b| b.in_band.cmp(&a.in_band).then(a.damping.total_cmp(&b.damping)));
        Ok(rule)
    }

    fn inside(&self, value: c64) -> bool {
        (self.band.0..=self.band.1).contains(&(value.norm() / TAU))
    }

    /// All modes of a core, least damped first. It must be the one that the rule was made with.
    pub fn modes(&self, core: &Core, laws: &Laws) -> Result<Vec<Mode>, TuneError> {
        let role = |value: c64| if self.inside(value) { Role::Counts } else { Role::OutOfBand };
        let mut all: Vec<Mode> = Vec::new();
        if self.left_out.is_empty() {
            let values = eigenvalues(core, laws)?;
            all.extend(values.into_iter().map(|value| Mode { value, role: role(value) }));
        } else {
            for (block, projection) in core.blocks.iter().zip(&self.projections) {
                let found = linear::eigen(&matrix(block, laws))?;
                let shares = match projection {
                    Some(it) => shares(it, &found),
                    None => vec![0.0; found.len()],
                };
                all.extend(found.iter().zip(shares).map(|(it, share)| Mode {
                    value: it.value,
                    role: if share > HALF { Role::LeftOut } else { role(it.value) },
                }));
            }
        }
        all.sort_by(|a, b| order(a.value, b.value));
        Ok(all)
    }

    /// Least damping ratio of what does not count otherwise: modes out of the band, and those left out if they all
    /// decayed at the start, as a change that makes one of them grow must not be taken.
    pub fn outside(&self, modes: &[Mode]) -> f64 {
        let decayed = self.left_out.iter().all(|it| it.damping > 0.0);
        let must = |it: &&Mode| match it.role {
            Role::Counts => false,
            Role::OutOfBand => true,
            Role::LeftOut => decayed && it.value.norm() > FREE,
        };
        modes.iter().filter(must).map(|it| damping(it.value)).fold(1.0, f64::min)
    }
}

/// Least damped first.
pub(crate) fn order(a: c64, b: c64) -> std::cmp::Ordering {
    damping(a).total_cmp(&damping(b)).then(a.im.total_cmp(&b.im))
}

/// Re yᴴ P x of each mode.
fn shares(projection: &Mat<f64>, modes: &[Eigen]) -> Vec<f64> {
    let (n, m) = (projection.nrows(), modes.len());
    let shapes = Mat::from_fn(n, 2 * m, |i, j| {
        let v = modes[j / 2].shape[i];
        if j % 2 == 0 { v.re } else { v.im }
    });
    let seen = projection * shapes;
    let share = |(k, mode): (usize, &Eigen)| {
        let of = |(i, w): (usize, &c64)| w.re * seen[(i, 2 * k)] + w.im * seen[(i, 2 * k + 1)];
        mode.left.iter().enumerate().map(of).sum()
    };
    modes.iter().enumerate().map(share).collect()
}

/// Changes of the damping ratios. Each mode takes the nearest of the others that is left, the least moved first.
fn changes(base: &[c64], mut others: Vec<c64>) -> Vec<f64> {
    let mut changes = vec![f64::INFINITY; base.len()];
    let mut pairs: Vec<(usize, f64)> = base
        .iter()
        .map(|s| others.iter().map(|it| (it - s).norm()).fold(f64::INFINITY, f64::min))
        .enumerate()
        .collect();
    pairs.sort_by(|a, b| a.1.total_cmp(&b.1));
    for (mode, _) in pairs {
        let distance = |it: &c64| (it - base[mode]).norm();
        let nearest = (0..others.len())
            .min_by(|&a, &b| distance(&others[a]).total_cmp(&distance(&others[b])));
        if let Some(nearest) = nearest {
            changes[mode] = (damping(others[nearest]) - damping(base[mode])).abs();
            others.swap_remove(nearest);
        }
    }
    changes
}
