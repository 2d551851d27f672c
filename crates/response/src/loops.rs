//! Margins of loops, broken one by one and all at once.

use std::f64::consts::TAU;

use faer::linalg::solvers::{DenseSolveCore, PartialPivLu};
use faer::prelude::c64;
use faer::{Mat, MatRef};
use results::response::{Curve, LoopsResult, ModulusMargin, SingleLoop, Together};

use crate::error::ResponseError;
use crate::evaluate::{Evaluator, Scratch, for_all};
use crate::grid;
use crate::locus::{assigned, chordal, continued};
use crate::model::{Domain, Model};
use crate::scalar::{Crossings, crossings, turns};
use crate::search::minimum;

/// Frequencies per decade of a few and of many loops; resonances get more.
const PER_DECADE: [usize; 2] = [120, 40];
const FEW: usize = 8;
/// Most loops and loci whose curves are kept.
const DRAWN: usize = 8;
/// Local minima of σ(I + L) within this factor of the least are refined.
const RIVAL: f64 = 1.05;
/// Weight of the distance between eigenvalues with the same vector, where 1 is that of quite different ones.
const SAME: f64 = 0.02;
/// A turn of more than this fraction of half a turn between two samples makes the count doubtful.
const DOUBTFUL: f64 = 0.8;

/// What is kept of L at one frequency.
struct Sample {
    /// Diagonal of (I + L)⁻¹: the sensitivity of every loop while the others are closed.
    sensitivities: Vec<c64>,
    /// Eigenvalues of L, and their vectors of length one.
    eigenvalues: Vec<c64>,
    vectors: Mat<c64>,
    /// Least singular value of I + L.
    least: f64,
}

/// Loops with the system around them, ready for their analysis.
pub struct Loops {
    names: Vec<String>,
    open: Evaluator,
    closed: Evaluator,
    open_poles: Vec<c64>,
    closed_poles: Vec<c64>,
    domain: Domain,
    /// rad/s.
    grid: Vec<f64>,
}

impl Loops {
    /// Of the loop transfer functions with all loops broken, for which 1 + L is singular where a closed loop
    /// has a pole.
    ///
    /// # Errors
    /// The loops cannot be closed, or eigenvalues do not converge.
    pub fn new(open: &Model, names: &[String]) -> Result<Self, ResponseError> {
        let closed =
            open.closed().ok_or_else(|| ResponseError::Algebraic { at: names.join(", ") })?;
        let (open_poles, closed_poles) = (open.poles()?, closed.poles()?);
        let all: Vec<c64> = open_poles.iter().chain(&closed_poles).copied().collect();
        let range = grid::whole(&all, open.domain);
        let per_decade = PER_DECADE[usize::from(names.len() > FEW)];
        Ok(Self {
            names: names.to_vec(),
            open: Evaluator::new(open),
            closed: Evaluator::new(&closed),
            grid: grid::around(&all, open.domain, range, per_decade),
            open_poles,
            closed_poles,
            domain: open.domain,
        })
    }

    fn growing(&self, poles: &[c64]) -> usize {
        poles.iter().filter(|pole| self.domain.side(**pole) > 0).count()
    }

    /// Whether the closed loops are stable.
    #[must_use]
    pub fn stable(&self) -> bool {
        self.closed_poles.iter().all(|pole| self.domain.side(*pole) < 0)
    }

    /// L of one loop while the others are closed.
    #[must_use]
    pub fn single(&self, k: usize, omega: f64, scratch: &mut Scratch) -> c64 {
        if self.names.len() == 1 {
            return self.open.entry((0, 0), omega, scratch);
        }
        let complementary = self.closed.entry((k, k), omega, scratch);
        complementary / (1.0 - complementary)
    }

    /// L with all loops broken.
    #[must_use]
    pub fn all(&self, omega: f64, scratch: &mut Scratch) -> Mat<c64> {
        self.open.at(omega, scratch)
    }

    /// All margins. Without `curves` no curve is kept.
    ///
    /// # Errors
    /// Eigenvalues or singular values do not converge.
    pub fn analyse(&self, curves: bool) -> Result<LoopsResult, ResponseError> {
        let samples = for_all(&self.grid, |omega, scratch| sample(&self.all(omega, scratch)));
        let samples: Vec<Sample> = samples.into_iter().collect::<Result<_, _>>()?;
        let stable = self.stable();
        let places: Vec<usize> = (0..self.names.len()).collect();
        let mut single = for_all(&places, |k, scratch| {
            let curve: Vec<(f64, c64)> = self
                .grid
                .iter()
                .zip(&samples)
                .map(|(omega, it)| (*omega, 1.0 / it.sensitivities[k] - 1.0))
                .collect();
            let resting = finite(self.single(k, 0.0, scratch));
            let found = crossings(&curve, resting, |omega| self.single(k, omega, scratch));
            SingleLoop {
                at: self.names[k].clone(),
                margins: stable.then(|| found.margins()),
                critical: critical(&found),
                curve: curves.then(|| self.curve(curve.iter().map(|it| it.1))),
            }
        });
        keep_nearest(&mut single);
        let loci = characteristic_loci(&samples);
        let together =
            if self.names.len() > 1 { Some(self.together(&samples, &loci, curves)?) } else { None };
        Ok(LoopsResult {
            at: self.names.clone(),
            sampled: None,
            stable,
            closed_growing: self.growing(&self.closed_poles),
            open_growing: self.growing(&self.open_poles),
            encirclements: self.encirclements(&loci),
            single,
            together,
        })
    }

    fn curve(&self, values: impl Iterator<Item = c64>) -> Curve {
        let mut curve = Curve::default();
        for (omega, value) in self.grid.iter().zip(values) {
            curve.frequency_hz.push(omega / TAU);
            curve.real.push(value.re);
            curve.imaginary.push(value.im);
        }
        curve
    }

    /// Clockwise turns of det(I + L) around 0 along the whole border of stability: the sum of those of
    /// 1 + λ over the characteristic loci, which turn less between samples than their product.
    fn encirclements(&self, loci: &[Vec<c64>]) -> Option<f64> {
        let poles = self.open_poles.iter().chain(&self.closed_poles);
        if poles.clone().any(|pole| self.domain.side(*pole) == 0) {
            return None;
        }
        let mut scratch = Scratch::default();
        let mut at = |omega: f64| eigenvalues(self.all(omega, &mut scratch).as_ref()).ok();
        let start = at(0.0)?;
        let end = match self.domain {
            // far above the fastest pole L is its feed-through
            Domain::Continuous => Some(at(1e6 * self.grid.last()?)?),
            Domain::Sampled { .. } => None,
        };
        let list = |k: usize| loci.iter().map(|locus| locus[k]).collect::<Vec<c64>>();
        let (first, last) = (list(0), list(self.grid.len() - 1));
        let start = continued(&first, &start, chordal);
        let end = end.map(|end| continued(&last, &end, chordal));
        let mut half = 0.0;
        for (k, locus) in loci.iter().enumerate() {
            let inside = locus.iter().copied();
            let all = std::iter::once(start[k]).chain(inside).chain(end.iter().map(|it| it[k]));
            let (turn, largest) = turns(all.map(|it| 1.0 + it));
            if !turn.is_finite() || largest > DOUBTFUL {
                return None;
            }
            half += turn;
        }
        Some(-2.0 * half)
    }

    fn together(
        &self,
        samples: &[Sample],
        loci: &[Vec<c64>],
        curves: bool,
    ) -> Result<Together, ResponseError> {
        let stable = self.stable();
        let mut scratch = Scratch::default();
        let resting = eigenvalues(self.all(0.0, &mut scratch).as_ref()).unwrap_or_default();
        let nearby: Vec<Crossings> = loci
            .iter()
            .map(|locus| {
                let start = nearest(&resting, locus[0]).and_then(finite);
                crossings(&self.samples(locus), start, |omega| self.between(locus, omega))
            })
            .collect();
        let refined: Vec<Crossings> = binding(&nearby)
            .into_iter()
            .map(|k| {
                let locus = &loci[k];
                let start = nearest(&resting, locus[0]).and_then(finite);
                crossings(&self.samples(locus), start, |omega| {
                    let about = self.between(locus, omega);
                    let values = eigenvalues(self.all(omega, &mut scratch).as_ref());
                    values.ok().and_then(|values| nearest(&values, about)).unwrap_or(about)
                })
            })
            .collect();
        let refined = Crossings::join(refined);
        let least_singular: Vec<(f64, f64)> =
            self.grid.iter().zip(samples).map(|(omega, it)| (omega / TAU, it.least)).collect();
        let independent = self.independent(samples, &mut scratch)?;
        let mut order: Vec<usize> = (0..loci.len()).collect();
        let distance =
            |k: &usize| nearby[*k].nearest.map_or(f64::INFINITY, |it| (1.0 + it.value).norm());
        order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let drawn = order.into_iter().take(if curves { DRAWN } else { 0 });
        Ok(Together {
            equal: stable.then(|| refined.margins()),
            independent: stable.then_some(independent),
            critical: critical(&Crossings::join(nearby.clone())),
            loci: drawn.map(|k| self.curve(loci[k].iter().copied())).collect(),
            least_singular: if curves { least_singular } else { Vec::new() },
        })
    }

    fn samples(&self, locus: &[c64]) -> Vec<(f64, c64)> {
        self.grid.iter().copied().zip(locus.iter().copied()).collect()
    }

    /// A locus between its samples, by straight lines.
    fn between(&self, locus: &[c64], omega: f64) -> c64 {
        let next = self.grid.partition_point(|it| *it < omega).clamp(1, self.grid.len() - 1);
        let (a, b) = (self.grid[next - 1].ln(), self.grid[next].ln());
        let share = ((omega.ln() - a) / (b - a)).clamp(0.0, 1.0);
        locus[next - 1] + (locus[next] - locus[next - 1]) * share
    }

    /// The least singular value of I + L over all frequencies.
    fn independent(
        &self,
        samples: &[Sample],
        scratch: &mut Scratch,
    ) -> Result<ModulusMargin, ResponseError> {
        let least = samples.iter().map(|it| it.least).fold(f64::INFINITY, f64::min);
        let resting = least_singular(self.all(0.0, scratch).as_ref()).unwrap_or(f64::INFINITY);
        let mut best = (0.0, if resting.is_finite() { resting } else { f64::INFINITY });
        let last = samples.len() - 1;
        for (k, it) in samples.iter().enumerate() {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            let local = it.least <= samples[before].least && it.least <= samples[after].least;
            if !local || it.least > RIVAL * least {
                continue;
            }
            let mut failed = None;
            let (x, value) = minimum(
                |x| {
                    least_singular(self.all(x.exp(), scratch).as_ref()).unwrap_or_else(|error| {
                        failed = Some(error);
                        f64::INFINITY
                    })
                },
                (self.grid[before].ln(), self.grid[after].ln()),
                (self.grid[k].ln(), it.least),
                1e-6,
            );
            if let Some(error) = failed {
                return Err(error);
            }
            if value < best.1 {
                best = (x.exp(), value);
            }
        }
        if best.1 >= 1.0 {
            return Ok(ModulusMargin { value: 1.0, frequency_hz: None });
        }
        Ok(ModulusMargin { value: best.1, frequency_hz: Some(best.0 / TAU) })
    }
}

fn finite(value: c64) -> Option<c64> {
    value.is_finite().then_some(value)
}

fn nearest(values: &[c64], to: c64) -> Option<c64> {
    values.iter().copied().min_by(|a, b| chordal(*a, to).total_cmp(&chordal(*b, to)))
}

/// The curves that have one of the margins, of all curves together.
fn binding(all: &[Crossings]) -> Vec<usize> {
    let least = |of: &dyn Fn(&Crossings) -> Option<f64>| {
        let values = all.iter().enumerate().filter_map(|(k, it)| Some((k, of(it)?)));
        values.min_by(|a, b| a.1.total_cmp(&b.1)).map(|it| it.0)
    };
    let margins = |it: &Crossings| it.margins();
    let mut found: Vec<usize> = [
        least(&|it| Some(margins(it).gain_up?.factor)),
        least(&|it| Some(-margins(it).gain_down?.factor)),
        least(&|it| Some(margins(it).phase?.degrees)),
        least(&|it| Some(margins(it).delay?.seconds)),
        least(&|it| Some(margins(it).modulus.value)),
    ]
    .into_iter()
    .flatten()
    .collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Frequencies (Hz) and factors on the gain at which L would be −1.
fn critical(found: &Crossings) -> Vec<(f64, f64)> {
    let pairs = found.negative.iter().map(|it| (it.omega / TAU, 1.0 / it.value.norm()));
    let mut all: Vec<(f64, f64)> = pairs.collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// Keeps the curves of the loops that come nearest to −1.
fn keep_nearest(loops: &mut [SingleLoop]) {
    let distance = |it: &SingleLoop| it.margins.as_ref().map_or(1.0, |it| it.modulus.value);
    let mut order: Vec<usize> = (0..loops.len()).collect();
    order.sort_by(|a, b| distance(&loops[*a]).total_cmp(&distance(&loops[*b])));
    order.into_iter().skip(DRAWN).for_each(|k| loops[k].curve = None);
}

fn sample(l: &Mat<c64>) -> Result<Sample, ResponseError> {
    let sum = plus_identity(l.as_ref());
    let lu = PartialPivLu::new(sum.as_ref());
    let inverse = lu.inverse();
    let n = l.nrows();
    let (eigenvalues, vectors) = eigenvectors(l)?;
    Ok(Sample {
        sensitivities: (0..n).map(|k| inverse[(k, k)]).collect(),
        eigenvalues,
        vectors,
        least: least_singular(l.as_ref())?,
    })
}

fn plus_identity(l: MatRef<'_, c64>) -> Mat<c64> {
    Mat::from_fn(l.nrows(), l.ncols(), |i, j| if i == j { l[(i, j)] + 1.0 } else { l[(i, j)] })
}

fn eigenvalues(l: MatRef<'_, c64>) -> Result<Vec<c64>, ResponseError> {
    if l.nrows() == 1 {
        return Ok(vec![l[(0, 0)]]);
    }
    l.eigenvalues().map_err(|_| ResponseError::Convergence { of: "the eigenvalues of L" })
}

/// Eigenvalues, and eigenvectors of length one.
fn eigenvectors(l: &Mat<c64>) -> Result<(Vec<c64>, Mat<c64>), ResponseError> {
    let n = l.nrows();
    if n == 1 {
        return Ok((vec![l[(0, 0)]], Mat::identity(1, 1)));
    }
    let failed = |_| ResponseError::Convergence { of: "the eigenvalues of L" };
    let found = l.eigen().map_err(failed)?;
    let mut vectors = found.U().to_owned();
    for column in vectors.col_iter_mut() {
        let length = column.norm_l2();
        column.iter_mut().for_each(|x| *x /= length);
    }
    Ok(((0..n).map(|k| found.S()[k]).collect(), vectors))
}

/// The eigenvalues of L over frequency, each followed by continuity: of its vector, where several pass near
/// to each other, and of its value.
fn characteristic_loci(samples: &[Sample]) -> Vec<Vec<c64>> {
    let Some(first) = samples.first() else { return Vec::new() };
    let mut loci: Vec<Vec<c64>> = first.eigenvalues.iter().map(|value| vec![*value]).collect();
    // which eigenvalue of the sample before continues each locus
    let mut order: Vec<usize> = (0..loci.len()).collect();
    for pair in samples.windows(2) {
        let (before, next) = (&pair[0], &pair[1]);
        let overlap = before.vectors.adjoint() * &next.vectors;
        let step = assigned(loci.len(), |i, j| {
            let unlike = 1.0 - overlap[(i, j)].norm_sqr().min(1.0);
            chordal(before.eigenvalues[i], next.eigenvalues[j]) * (unlike + SAME)
        });
        order.iter_mut().for_each(|k| *k = step[*k]);
        loci.iter_mut().zip(&order).for_each(|(locus, &k)| locus.push(next.eigenvalues[k]));
    }
    loci
}

/// The least singular value of I + L.
fn least_singular(l: MatRef<'_, c64>) -> Result<f64, ResponseError> {
    let sum = plus_identity(l);
    if l.nrows() == 1 {
        return Ok(sum[(0, 0)].norm());
    }
    let failed = |_| ResponseError::Convergence { of: "the singular values of I + L" };
    let values = sum.singular_values().map_err(failed)?;
    Ok(values.into_iter().fold(f64::INFINITY, f64::min))
}
