//! One point of a map: all zeros of the region, followed from a point nearby and counted.

use faer::prelude::c64;

use crate::branch::{Branch, Point, damping};
use crate::contour::{Count, Line};
use crate::error::MapError;
use crate::ladder::Ladder;
use crate::region::Region;

/// Zeros are followed up to this damping ratio beyond the region's.
pub const MARGIN: f64 = 0.02;
/// Zeros up to this damping ratio beyond the region's are remembered when all eigenvalues are computed.
const REMEMBERED: f64 = 0.06;
/// Places near the boundary at which missing zeros are looked for.
const HUNTED: usize = 6;
/// Zeros that may come so near to the least damped one, by their damping ratio, are refined at every point.
const AHEAD: f64 = 0.01;
/// Points after which any other zero is refined again.
const OLDEST: usize = 4;
/// Regions that are tried for a count.
const TRIED: usize = 3;
/// Imaginary parts below this fraction are rounding errors.
pub(crate) const NEARLY_REAL: f64 = 1e-7;

/// How a cell is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// Zeros are followed, and the count on a boundary around the least damped one shows that there are no others.
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
    /// Number of known zeros with Re s > 0, a pair as one. Where the least damped one grows, there may be more.
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
    /// Number and place of zeros that were further away when last seen.
    away: Vec<(usize, c64)>,
    /// First number of a new branch.
    next: usize,
    /// Shares in a branch, and how many points ago they were computed.
    shares: Option<(usize, [f64; 3], usize)>,
    /// The boundaries with the points that this walk has added.
    lines: Vec<Option<Line>>,
}

/// Points after which shares are computed again.
const SHARES_KEPT: usize = 20;

impl Followed {
    /// The zeros in and near a region at a first point, from all eigenvalues of the reduced system.
    #[must_use]
    pub fn start(region: Region, point: Point<'_>, eigenvalues: &[c64]) -> Self {
        let mut followed = Self::default();
        followed.take(region, point, eigenvalues);
        followed
    }

    /// Eigenvalues in and near the region become branches, with the numbers of known ones where they are the same; those
    /// around it are remembered.
    fn take(&mut self, region: Region, point: Point<'_>, values: &[c64]) {
        let mut before: Vec<(usize, c64)> = self.active.drain(..).map(|it| (it.id, it.s)).collect();
        before.append(&mut self.away);
        for &value in values {
            let upper = value.im >= -NEARLY_REAL * value.norm();
            if !upper || !region.near(value, REMEMBERED) {
                continue;
            }
            let same = |it: &(usize, c64)| (it.1 - value).norm() <= 0.02 * value.norm();
            let id = match before.iter().position(same) {
                Some(k) => before.swap_remove(k).0,
                None => {
                    self.next += 1;
                    self.next - 1
                }
            };
            if !region.near(value, MARGIN) {
                self.away.push((id, value));
                continue;
            }
            self.add(match Branch::near(id, value, point) {
                Some(branch) if (branch.s - value).norm() <= 1e-5 * value.norm().max(1e-2) => {
                    branch
                }
                // a zero that no force reaches stays where it is
                _ => Branch::fixed(id, value),
            });
        }
    }

    /// Zeros, without imaginary parts that are rounding errors.
    #[must_use]
    pub fn known(&self) -> Vec<c64> {
        self.active.iter().map(Branch::place).collect()
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
            if !kept.iter().any(|it| it.age == 0 && branch.age == 0 && it.same(&branch)) {
                kept.push(branch);
            }
        }
        self.active = kept;
    }

    /// Refines the zeros that `wanted` selects and that are not of this point yet; lost ones are put away.
    fn refine(&mut self, point: Point<'_>, wanted: impl Fn(&Branch) -> bool) {
        let before = self.active.len();
        let (mut any, away) = (false, &mut self.away);
        self.active.retain_mut(|branch| {
            if branch.age == 0 || !wanted(branch) {
                return true;
            }
            // ages are counted from the last point, refinement from the one before
            branch.age -= 1;
            let kept = branch.refine(point);
            any |= kept;
            if !kept {
                away.push((branch.id, branch.s));
            }
            kept
        });
        if any && before > 1 {
            self.distinct();
        }
    }
}

impl Ladder {
    /// Follows the zeros of a point nearby to this one and counts; searches for those that are missing, and computes all
    /// eigenvalues if that does not help.
    ///
    /// # Errors
    /// Eigenvalues do not converge.
    pub fn explore(&self, point: Point<'_>, followed: &mut Followed) -> Result<Cell, MapError> {
        followed.active.iter_mut().for_each(|branch| branch.age += 1);
        followed.lines.resize(self.len(), None);
        let evidence = self.settle(point, followed)?;
        let region = self.top().region;
        let (near, far): (Vec<Branch>, Vec<Branch>) = std::mem::take(&mut followed.active)
            .into_iter()
            .partition(|branch| region.near(branch.s, MARGIN));
        followed.active = near;
        let least = |all: &[Branch]| -> Option<(c64, usize)> {
            let of = all.iter().filter(|it| it.age == 0 && self.shown(it.s));
            of.map(|it| (it.s, it.id)).min_by(|a, b| damping(a.0).total_cmp(&damping(b.0)))
        };
        let seen = followed.away.iter().filter(|it| self.shown(it.1)).map(|it| (it.1, it.0));
        let seen = seen.min_by(|a, b| damping(a.0).total_cmp(&damping(b.0)));
        let found = least(&followed.active).or_else(|| least(&far)).or(seen);
        let (_, branch) = found.unwrap_or((c64::new(0.0, 0.0), usize::MAX));
        let shares = match followed.shares {
            Some((id, shares, age)) if id == branch && age < SHARES_KEPT => (id, shares, age + 1),
            _ => {
                let mut all = followed.active.iter().chain(&far);
                let mine = all.find(|it| it.id == branch && !it.z.is_empty());
                (branch, mine.map_or([1.0, 0.0, 0.0], |it| it.shares(point)), 0)
            }
        };
        followed.shares = Some(shares);
        followed.away.extend(far.iter().map(|it| (it.id, it.s)));
        followed.away.retain(|it| region.near(it.1, 2.0 * REMEMBERED));
        let (s, branch) = found.unwrap_or((c64::new(-f64::INFINITY, 0.0), usize::MAX));
        let growing = |it: &&Branch| it.age == 0 && it.s.re > 0.0 && self.shown(it.s);
        Ok(Cell {
            s,
            branch,
            growing: followed.active.iter().filter(growing).count(),
            inside: region.contains(s),
            evidence,
            shares: shares.1,
        })
    }

    fn shown(&self, s: c64) -> bool {
        s.norm() > 0.0 && s.norm() <= self.below
    }

    /// The least damping ratio of the zeros that are shown, as far as refined.
    fn least(&self, followed: &Followed) -> f64 {
        let all = followed.active.iter().filter(|it| it.age == 0 && self.shown(it.s));
        all.map(Branch::damping).fold(f64::INFINITY, f64::min)
    }

    /// Refines what may be the least damped zero, and what may be in a region with that damping ratio.
    fn advance(&self, point: Point<'_>, followed: &mut Followed) {
        let region = self.top().region;
        followed.refine(point, |it| it.age > OLDEST);
        // the least of those refined may turn out to be damped more than another one
        loop {
            let guess = |it: &Branch| damping(it.ahead());
            let mut least = self.least(followed);
            if !least.is_finite() {
                let all = followed.active.iter().filter(|it| self.shown(it.s));
                least = all.map(guess).fold(f64::INFINITY, f64::min);
            }
            // up to the second of the regions that contain it
            let limit = self
                .around(least, &[])
                .into_iter()
                .nth(1)
                .map_or(region.damping, |k| self.damping(k));
            let wanted = |it: &Branch| guess(it) < limit + AHEAD;
            if !followed.active.iter().any(|it| it.age > 0 && wanted(it)) {
                return;
            }
            followed.refine(point, wanted);
        }
    }

    /// Brings what is known to this point until the least damped zero is certain.
    fn settle(&self, point: Point<'_>, followed: &mut Followed) -> Result<Evidence, MapError> {
        self.advance(point, followed);
        let steps = |it: &Followed| self.around(self.least(it), &it.known());
        for k in steps(followed).into_iter().take(TRIED) {
            match self.count(k, point, followed)? {
                Count::Unknown(0) => return Ok(Evidence::Counted),
                Count::Unknown(missing) if missing > 0 => break,
                _ => {}
            }
        }
        followed.refine(point, |_| true);
        let last = self.len() - 1;
        let mut k = steps(followed).first().copied().unwrap_or(last);
        if self.count(k, point, followed)? == Count::Unknown(0) {
            return Ok(Evidence::Counted);
        }
        self.recall(point, followed, k);
        k = steps(followed).first().copied().unwrap_or(last);
        if self.count(k, point, followed)? == Count::Unknown(0) {
            return Ok(Evidence::Counted);
        }
        if self.hunt(k, point, followed)? {
            k = steps(followed).first().copied().unwrap_or(last);
            if self.count(k, point, followed)? == Count::Unknown(0) {
                return Ok(Evidence::Counted);
            }
        }
        if followed.active.iter().any(|it| it.s.re > 0.0 && self.shown(it.s)) {
            return Ok(Evidence::Growing);
        }
        self.all(point, followed)?;
        Ok(Evidence::Eigenvalues)
    }

    fn count(
        &self,
        step: usize,
        point: Point<'_>,
        followed: &mut Followed,
    ) -> Result<Count, MapError> {
        let contour = self.contour(step, point.space)?;
        let region = contour.region;
        followed.refine(point, |it| region.near(it.ahead(), AHEAD) || region.contains(it.s));
        // a zero of an earlier point is not one of this point
        let known: Vec<c64> =
            followed.active.iter().filter(|it| it.age == 0).map(Branch::place).collect();
        let line = followed.lines[step].get_or_insert_with(|| contour.line());
        contour.count_on(line, point, &known)
    }

    /// Looks again at zeros that were far away or lost and may be in a region.
    fn recall(&self, point: Point<'_>, followed: &mut Followed, step: usize) {
        let region = Region { damping: self.damping(step), ..self.top().region };
        let (tried, rest) = std::mem::take(&mut followed.away)
            .into_iter()
            .partition::<Vec<_>, _>(|it| region.near(it.1, REMEMBERED));
        followed.away = rest;
        for (id, s) in tried {
            match Branch::near(id, s, point) {
                Some(branch) if self.top().region.near(branch.s, MARGIN) => {
                    followed.add(branch);
                }
                Some(branch) => followed.away.push((id, branch.s)),
                None => followed.away.push((id, s)),
            }
        }
    }

    /// Looks for zeros near a boundary. Whether there are new ones.
    fn hunt(
        &self,
        step: usize,
        point: Point<'_>,
        followed: &mut Followed,
    ) -> Result<bool, MapError> {
        let contour = self.contour(step, point.space)?;
        let line = followed.lines[step].clone().unwrap_or_else(|| contour.line());
        let mut any = false;
        for s in contour.candidates(&line, point).into_iter().take(HUNTED) {
            let Some(branch) = Branch::near(followed.next, s, point) else { continue };
            if self.top().region.near(branch.s, MARGIN) && followed.add(branch) {
                followed.next += 1;
                any = true;
            }
        }
        Ok(any)
    }

    /// All eigenvalues of the reduced system.
    fn all(&self, point: Point<'_>, followed: &mut Followed) -> Result<(), MapError> {
        let matrix = point.space.whole(point.level, point.controllers)?;
        let failed = |_| MapError::Eigenvalues { what: "the whole system" };
        let values = matrix.eigenvalues().map_err(failed)?;
        followed.take(self.top().region, point, &values);
        Ok(())
    }
}
