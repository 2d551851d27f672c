//! One point of a map: all zeros of the region, followed from a point nearby and counted.

use faer::prelude::c64;

use crate::branch::{Branch, Point, damping};
use crate::contour::{Contour, Count};
use crate::error::MapError;

/// Zeros are followed up to this damping ratio beyond the region's.
pub const MARGIN: f64 = 0.02;
/// Zeros up to this damping ratio beyond the region's are remembered when all eigenvalues are computed.
const REMEMBERED: f64 = 0.15;
/// Imaginary parts below this fraction are rounding errors.
const NEARLY_REAL: f64 = 1e-7;

/// How a cell is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// Zeros are followed, and the count on the boundary shows that there are no others.
    Counted,
    /// The count was uncertain, or zeros were missing: all eigenvalues were computed.
    Eigenvalues,
}

/// The result at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// The zero with the least damping ratio.
    pub s: c64,
    /// Number of the branch that it belongs to.
    pub branch: usize,
    /// Number of zeros with Re s > 0, a pair as one.
    pub growing: usize,
    /// Whether it is in the region. If not, no mode is: all are damped more than the region's rays.
    pub inside: bool,
    /// How the result is known.
    pub evidence: Evidence,
}

impl Cell {
    /// −Re s/|s| of the least damped mode.
    #[must_use]
    pub fn damping(&self) -> f64 {
        damping(self.s)
    }
}

/// Zeros that are followed from point to point.
#[derive(Debug, Clone, Default)]
pub struct Followed {
    /// In the region or near it.
    pub active: Vec<Branch>,
    /// Further away when last seen.
    pub away: Vec<Branch>,
    /// First number of a new branch.
    pub next: usize,
}

impl Followed {
    fn known(&self) -> Vec<c64> {
        let all = self.active.iter().map(|branch| branch.s);
        all.map(|s| if s.im.abs() <= NEARLY_REAL * s.norm() { c64::new(s.re, 0.0) } else { s })
            .collect()
    }

    /// Adds a zero unless it is known, with Im s ≥ 0.
    fn add(&mut self, mut branch: Branch) -> bool {
        branch.mirror();
        if self.active.iter().any(|it| it.same(&branch)) {
            return false;
        }
        self.active.push(branch);
        true
    }

    /// Zeros that two branches have reached are kept once.
    fn distinct(&mut self) {
        let mut kept: Vec<Branch> = Vec::with_capacity(self.active.len());
        for mut branch in std::mem::take(&mut self.active) {
            branch.mirror();
            if !kept.iter().any(|it| it.same(&branch)) {
                kept.push(branch);
            }
        }
        self.active = kept;
    }
}

impl Contour {
    /// Follows the zeros of a point nearby to this one and counts; searches for those that are missing, and computes all
    /// eigenvalues if that does not help.
    ///
    /// # Errors
    /// Eigenvalues do not converge.
    pub fn explore(&self, point: Point<'_>, followed: &mut Followed) -> Result<Cell, MapError> {
        let mut lost = Vec::new();
        followed.active.retain_mut(|branch| {
            let kept = branch.refine(point);
            if !kept {
                lost.push(branch.clone());
            }
            kept
        });
        followed.distinct();
        let mut evidence = Evidence::Counted;
        if !self.complete(point, followed)? {
            self.recall(point, followed, lost);
            if !self.complete(point, followed)? {
                self.all(point, followed)?;
                evidence = Evidence::Eigenvalues;
            }
        }
        let region = self.region;
        let (near, far): (Vec<Branch>, Vec<Branch>) = std::mem::take(&mut followed.active)
            .into_iter()
            .partition(|branch| region.near(branch.s, MARGIN));
        followed.active = near;
        let least = |all: &[Branch]| -> Option<(c64, usize)> {
            let of = all.iter().filter(|it| it.s.norm() > 0.0);
            of.map(|it| (it.s, it.id)).min_by(|a, b| damping(a.0).total_cmp(&damping(b.0)))
        };
        let found =
            least(&followed.active).or_else(|| least(&far)).or_else(|| least(&followed.away));
        followed.away.extend(far);
        let (s, branch) = found.unwrap_or((c64::new(-f64::INFINITY, 0.0), usize::MAX));
        Ok(Cell {
            s,
            branch,
            growing: followed.active.iter().filter(|it| it.s.re > 0.0).count(),
            inside: region.contains(s),
            evidence,
        })
    }

    fn complete(&self, point: Point<'_>, followed: &Followed) -> Result<bool, MapError> {
        Ok(self.count(point, &followed.known())? == Count::Unknown(0))
    }

    /// Looks again at zeros that were far away or lost.
    fn recall(&self, point: Point<'_>, followed: &mut Followed, lost: Vec<Branch>) {
        let away = std::mem::take(&mut followed.away);
        for mut branch in lost.into_iter().chain(away) {
            if branch.refine(point) && self.region.near(branch.s, MARGIN) {
                followed.add(branch);
            } else {
                followed.away.push(branch);
            }
        }
    }

    /// All eigenvalues of the reduced system; those in and near the region become branches, with the numbers of known
    /// ones where they are the same.
    fn all(&self, point: Point<'_>, followed: &mut Followed) -> Result<(), MapError> {
        let matrix = point.space.whole(point.level, point.controllers)?;
        let failed = |_| MapError::Eigenvalues { what: "the whole system" };
        let values = matrix.eigenvalues().map_err(failed)?;
        let before = std::mem::take(&mut followed.active);
        let mut remembered: Vec<Branch> = Vec::new();
        for value in values {
            let upper = value.im >= -NEARLY_REAL * value.norm();
            if !upper || !self.region.near(value, REMEMBERED) {
                continue;
            }
            let id = followed.next;
            let mut branch = match Branch::near(id, value, point) {
                Some(branch) if (branch.s - value).norm() <= 1e-5 * value.norm().max(1e-2) => {
                    branch
                }
                // a zero that no force reaches stays where it is
                _ => Branch::fixed(id, value),
            };
            let known = before.iter().chain(&followed.away).find(|it| {
                (it.s - branch.s).norm() <= 0.02 * branch.s.norm()
                    && !followed.active.iter().chain(&remembered).any(|other| other.id == it.id)
            });
            match known {
                Some(known) => branch.id = known.id,
                None => followed.next += 1,
            }
            if self.region.near(value, MARGIN) {
                followed.add(branch);
            } else {
                remembered.push(branch);
            }
        }
        let active: Vec<usize> = followed.active.iter().map(|it| it.id).collect();
        followed.away.retain(|it| !active.contains(&it.id) && !remembered.iter().any(|r| r.id == it.id));
        followed.away.retain(|it| !self.region.near(it.s, REMEMBERED));
        followed.away.extend(remembered);
        Ok(())
    }

    /// The zeros in and near the region at a first point, from all eigenvalues.
    ///
    /// # Errors
    /// Eigenvalues do not converge.
    pub fn start(&self, point: Point<'_>) -> Result<Followed, MapError> {
        let mut followed = Followed::default();
        self.all(point, &mut followed)?;
        Ok(followed)
    }
}
