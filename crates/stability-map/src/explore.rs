//! One point of a map: all zeros of the region, followed from a point nearby and counted.

use faer::prelude::c64;

use crate::branch::{Branch, Point, damping};
use crate::contour::{Contour, Count};
use crate::error::MapError;

/// Zeros are followed up to this damping ratio beyond the region's.
pub const MARGIN: f64 = 0.02;
/// Zeros up to this damping ratio beyond the region's are remembered when all eigenvalues are computed.
const REMEMBERED: f64 = 0.06;
/// Places near the boundary at which missing zeros are looked for.
const HUNTED: usize = 6;
/// Growing zeros that are followed where not all are known.
const GROWING: usize = 6;
/// Imaginary parts below this fraction are rounding errors.
const NEARLY_REAL: f64 = 1e-7;

/// How a cell is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// Zeros are followed, and the count on the boundary shows that there are no others.
    Counted,
    /// A mode grows for certain, but not all modes of the region are known: another one may be damped even less.
    Growing,
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
    /// Shares of plant, attached part and controllers in the mode ([`Branch::shares`]), here or at most a few points
    /// before.
    pub shares: [f64; 3],
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
    /// Whether zeros were left out at the last point, where one grew.
    partial: bool,
    /// Shares in a branch, and how many points ago they were computed.
    shares: Option<(usize, [f64; 3], usize)>,
}

/// Points after which shares are computed again.
const SHARES_KEPT: usize = 5;

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
        let grows = |followed: &Followed| followed.active.iter().any(|it| it.s.re > 0.0);
        let evidence = if followed.partial && grows(followed) {
            Evidence::Growing
        } else if self.complete(point, followed)? {
            Evidence::Counted
        } else {
            self.recall(point, followed, lost);
            if self.complete(point, followed)? {
                Evidence::Counted
            } else if grows(followed) || (self.hunt(point, followed) && grows(followed)) {
                Evidence::Growing
            } else if self.complete(point, followed)? {
                Evidence::Counted
            } else {
                self.all(point, followed)?;
                Evidence::Eigenvalues
            }
        };
        followed.partial = evidence == Evidence::Growing;
        if followed.partial {
            // the first of them show that the point is unstable
            followed.active.sort_by(|a, b| a.damping().total_cmp(&b.damping()));
            followed.active.truncate(GROWING);
        }
        let region = self.region;
        let (near, far): (Vec<Branch>, Vec<Branch>) = std::mem::take(&mut followed.active)
            .into_iter()
            .partition(|branch| region.near(branch.s, MARGIN));
        followed.active = near;
        let least = |all: &[Branch]| -> Option<(c64, usize)> {
            let of = all.iter().filter(|it| it.s.norm() > 0.0 && it.s.norm() <= self.below);
            of.map(|it| (it.s, it.id)).min_by(|a, b| damping(a.0).total_cmp(&damping(b.0)))
        };
        let found =
            least(&followed.active).or_else(|| least(&far)).or_else(|| least(&followed.away));
        let (_, branch) = found.unwrap_or((c64::new(0.0, 0.0), usize::MAX));
        let shares = match followed.shares {
            Some((id, shares, age)) if id == branch && age < SHARES_KEPT => (id, shares, age + 1),
            _ => {
                let all = followed.active.iter().chain(&far).chain(&followed.away);
                let mut mine = all.filter(|it| it.id == branch && !it.z.is_empty());
                (branch, mine.next().map_or([1.0, 0.0, 0.0], |it| it.shares(point)), 0)
            }
        };
        followed.shares = Some(shares);
        followed.away.extend(far);
        let (s, branch) = found.unwrap_or((c64::new(-f64::INFINITY, 0.0), usize::MAX));
        Ok(Cell {
            s,
            branch,
            growing: followed
                .active
                .iter()
                .filter(|it| it.s.re > 0.0 && it.s.norm() <= self.below)
                .count(),
            inside: region.contains(s),
            evidence,
            shares: shares.1,
        })
    }

    fn complete(&self, point: Point<'_>, followed: &Followed) -> Result<bool, MapError> {
        Ok(self.count(point, &followed.known())? == Count::Unknown(0))
    }

    /// Looks again at zeros that were far away or lost.
    fn recall(&self, point: Point<'_>, followed: &mut Followed, lost: Vec<Branch>) {
        let away = std::mem::take(&mut followed.away);
        for mut branch in lost.into_iter().chain(away) {
            let within_reach = self.region.near(branch.s, REMEMBERED);
            if within_reach && branch.refine(point) && self.region.near(branch.s, MARGIN) {
                followed.add(branch);
            } else {
                followed.away.push(branch);
            }
        }
    }

    /// Looks for zeros near the boundary. Whether there are new ones.
    fn hunt(&self, point: Point<'_>, followed: &mut Followed) -> bool {
        let mut any = false;
        for s in self.candidates(point).into_iter().take(HUNTED) {
            let Some(branch) = Branch::near(followed.next, s, point) else { continue };
            if self.region.near(branch.s, MARGIN) && followed.add(branch) {
                followed.next += 1;
                any = true;
            }
        }
        any
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
        followed
            .away
            .retain(|it| !active.contains(&it.id) && !remembered.iter().any(|r| r.id == it.id));
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
