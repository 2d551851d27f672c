//! Eigenvalues of systems in which many units are equal, such as the magnets of a train.
//!
//! The coordinates of m equal units are m *lanes* of one family each: the first state of every unit, the second,
//! and so on. Any orthogonal transformation U of the lanes keeps the units equal and uncoupled among themselves.
//! If the rest of the system sees only r < m combinations of the lanes, U can be chosen so that the other m − r
//! are seen by nothing: the matrix becomes block triangular, with a small block of one unit alone for each of
//! these, and its eigenvalues are those of the blocks.
//!
//! U comes from a singular value decomposition, but nothing depends on a rank: it is a change of coordinates like
//! any other. The blocks are the strongly connected components of the transformed matrix, in which entries at
//! the level of rounding count as zero (1e-13 of the largest in their row or column after balancing, about the error
//! of the eigenvalue iteration itself). If units differ, there is one block, which is the whole matrix.

use std::rc::Rc;

use faer::Mat;
use faer::prelude::c64;
use indexmap::IndexMap;
use master::graph::Graph;

use super::eigen::{Eigen, eigen, eigenvalues, scales, shares, unscale};
use super::error::LinearError;
use super::system::LinearSystem;
use super::unit::LinearUnit;

/// Entries below this fraction of the largest in their row or column (of all lanes) are rounding errors.
const NOTHING: f64 = 1e-13;
/// What is seen of a pattern counts as nothing below this fraction of the most visible one. (Only the choice of the
/// transformation depends on it.)
const FAINT: f64 = 1e-10;
/// Couplings below this fraction of the largest do not help to choose the transformation.
const WEAK: f64 = 1e-6;
/// The eigenvalue iteration balances its blocks again, so this need not converge.
const SWEEPS: usize = 3;
/// Fewer equal units are not worth a transformation.
const FEWEST: usize = 4;

/// Which coordinates of a matrix belong to equal units.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Lanes {
    /// Coordinates that are alike, all of the same length: one per lane.
    families: Vec<Vec<usize>>,
}

impl Lanes {
    /// Of lists of coordinates, those with one per lane.
    #[must_use]
    pub fn new(lanes: usize, families: impl Iterator<Item = Vec<usize>>) -> Self {
        if lanes < FEWEST {
            return Self::default();
        }
        Self { families: families.filter(|it| it.len() == lanes).collect() }
    }

    /// The states of the units of a system of which there are most.
    #[must_use]
    pub fn of(system: &LinearSystem) -> Self {
        let alike = most_alike(&system.units);
        let mut firsts = Vec::new();
        system.units.iter().fold(0, |first, unit| {
            firsts.push(first);
            first + unit.states.len()
        });
        let states = alike.first().map_or(0, |&k| system.units[k].states.len());
        let family = |state: usize| alike.iter().map(|&k| firsts[k] + state).collect();
        Self::new(alike.len(), (0..states).map(family))
    }

    /// The same for a matrix of these coordinates alone.
    #[must_use]
    pub fn within(&self, kept: &[usize]) -> Self {
        let place = |k: &usize| kept.iter().position(|it| it == k);
        let families = self.families.iter().map(|it| it.iter().map(place).collect());
        Self { families: families.collect::<Vec<Option<_>>>().into_iter().flatten().collect() }
    }

    /// All eigenvalues of a matrix.
    ///
    /// # Errors
    /// The iteration does not converge.
    pub fn eigenvalues(&self, matrix: &Mat<f64>) -> Result<Vec<c64>, LinearError> {
        if self.families.is_empty() {
            return eigenvalues(matrix);
        }
        let (scaled, _) = self.scaled(matrix);
        let Some(patterns) = self.patterns(&scaled)? else { return eigenvalues(matrix) };
        let matrix = self.transformed(&scaled, &patterns);
        let mut values = Vec::with_capacity(matrix.nrows());
        for block in blocks(&matrix) {
            if let [alone] = block.as_slice() {
                values.push(c64::new(matrix[(*alone, *alone)], 0.0));
            } else {
                values.extend(eigenvalues(&part(&matrix, &block, &block))?);
            }
        }
        Ok(values)
    }

    /// Eigenvalues of a matrix, one per conjugate pair, with what moves.
    ///
    /// # Errors
    /// The iteration does not converge.
    pub fn eigen(&self, matrix: &Mat<f64>) -> Result<Vec<Motion>, LinearError> {
        let (scaled, scale) = self.scaled(matrix);
        let Some(patterns) = self.patterns(&scaled)? else {
            let motion = |Eigen { value, shares, shape, .. }| Motion { value, shares, shape };
            return Ok(eigen(matrix)?.into_iter().map(motion).collect());
        };
        let matrix = self.transformed(&scaled, &patterns);
        let blocks = blocks(&matrix);
        let sources: Vec<Vec<usize>> = blocks.iter().map(|it| sources(&matrix, it)).collect();
        let mut found = Vec::new();
        for (k, block) in blocks.iter().enumerate() {
            let modes = eigen(&part(&matrix, block, block))?;
            let values: Vec<c64> = modes.iter().map(|it| it.value).collect();
            let mut motions = Pairs::new(matrix.nrows(), modes.len());
            let mut by = motions.clone();
            for (mode, Eigen { shape, left, .. }) in modes.iter().enumerate() {
                block.iter().zip(shape).for_each(|(&i, v)| motions.set(i, mode, *v));
                block.iter().zip(left).for_each(|(&i, w)| by.set(i, mode, *w));
            }
            let all: Vec<usize> = (0..2 * values.len()).collect();
            let rows: Vec<usize> = (0..matrix.nrows()).collect();
            let drive = part(&matrix, &rows, block) * part(&motions.0, block, &all);
            let (mut first, mut moving) =
                (vec![false; matrix.nrows()], vec![false; matrix.nrows()]);
            block.iter().for_each(|&i| first[i] = true);
            for (later, sources) in blocks.iter().zip(&sources).skip(k + 1) {
                if sources.iter().any(|&j| moving[j] || first[j]) {
                    let more: Vec<usize> = sources.iter().copied().filter(|&j| moving[j]).collect();
                    let drive = part(&drive, later, &all)
                        + part(&matrix, later, &more) * part(&motions.0, &more, &all);
                    follow(&matrix, later, &drive, &values, &mut motions);
                    later.iter().for_each(|&i| moving[i] = true);
                }
            }
            self.back(&patterns, &mut motions);
            self.back(&patterns, &mut by);
            for (mode, value) in values.into_iter().enumerate() {
                let mut shape = motions.column(mode);
                let shares = shares(&by.column(mode), &shape);
                unscale(&mut shape, &scale);
                found.push(Motion { value, shares, shape });
            }
        }
        Ok(found)
    }

    /// Vectors in the coordinates before the transformation.
    fn back(&self, patterns: &[Rc<Patterns>], vectors: &mut Pairs) {
        for (family, patterns) in self.families.iter().zip(patterns) {
            let all: Vec<usize> = (0..vectors.0.ncols()).collect();
            let lanes = &patterns.columns * part(&vectors.0, family, &all);
            write(&lanes, |i, j| (family[i], j), &mut vectors.0);
        }
    }

    /// Orthogonal combinations of the lanes of each family, as columns: first those that other coordinates see. Families of
    /// which the same is seen have the same.
    fn patterns(&self, matrix: &Mat<f64>) -> Result<Option<Vec<Rc<Patterns>>>, LinearError> {
        let rest = self.rest(matrix.nrows());
        let mut different: Vec<Rc<Patterns>> = Vec::new();
        let mut of: Vec<Option<Rc<Patterns>>> = Vec::new();
        for family in &self.families {
            let lanes = family.len();
            let size = |i: usize| family.iter().map(|&j| matrix[(i, j)].abs()).fold(0.0, f64::max);
            let rows: Vec<(usize, f64)> =
                rest.iter().map(|&i| (i, size(i))).filter(|(_, size)| *size > 0.0).collect();
            let largest = rows.iter().fold(0.0_f64, |most, (_, size)| most.max(*size));
            if rows.is_empty() {
                of.push(None);
                continue;
            }
            // rows have different units of measure
            let seen = Mat::from_fn(rows.len().max(lanes), lanes, |k, lane| {
                let row = rows.get(k);
                row.map_or(0.0, |&(i, size)| matrix[(i, family[lane])] / size.max(WEAK * largest))
            });
            let known = different.iter().find(|it| it.shows(&seen)).cloned();
            let found = match known {
                Some(known) => known,
                None => {
                    let new = Rc::new(Patterns::of(&seen)?);
                    different.push(Rc::clone(&new));
                    new
                }
            };
            of.push(Some(found));
        }
        let Some(first) = different.first() else { return Ok(None) };
        Ok(Some(of.into_iter().map(|it| it.unwrap_or_else(|| Rc::clone(first))).collect()))
    }

    /// The matrix balanced, with one scale for each family.
    fn scaled(&self, matrix: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
        let mut scale = scales(matrix, SWEEPS);
        for family in &self.families {
            let exponents: f64 = family.iter().map(|&k| scale[k].log2()).sum();
            let mean = (exponents / family.len() as f64).round().exp2();
            family.iter().for_each(|&k| scale[k] = mean);
        }
        let value = |i, j| matrix[(i, j)] * scale[j] / scale[i];
        (Mat::from_fn(matrix.nrows(), matrix.ncols(), value), scale)
    }

    /// The matrix in coordinates whose lanes are the patterns, without rounding errors.
    fn transformed(&self, matrix: &Mat<f64>, patterns: &[Rc<Patterns>]) -> Mat<f64> {
        let mut result = matrix.clone();
        for (family, patterns) in self.families.iter().zip(patterns) {
            let columns = Mat::from_fn(result.nrows(), family.len(), |i, j| result[(i, family[j])]);
            write(&(columns * &patterns.columns), |i, j| (i, family[j]), &mut result);
        }
        for (family, patterns) in self.families.iter().zip(patterns) {
            let rows = Mat::from_fn(family.len(), result.ncols(), |i, j| result[(family[i], j)]);
            let rows = patterns.columns.transpose() * rows;
            write(&rows, |i, j| (family[i], j), &mut result);
        }
        self.clean(&mut result);
        result
    }

    /// Sets entries at the level of rounding to zero.
    fn clean(&self, matrix: &mut Mat<f64>) {
        let n = matrix.nrows();
        let (mut rows, mut columns) = (vec![0.0_f64; n], vec![0.0_f64; n]);
        for (j, column) in matrix.col_iter().enumerate() {
            for (i, value) in column.iter().enumerate() {
                rows[i] = rows[i].max(value.abs());
                columns[j] = columns[j].max(value.abs());
            }
        }
        // rounding errors are those of the largest of a family
        for largest in [&mut rows, &mut columns] {
            for family in &self.families {
                let most = family.iter().map(|&k| largest[k]).fold(0.0, f64::max);
                family.iter().for_each(|&k| largest[k] = most);
            }
        }
        for (j, column) in matrix.col_iter_mut().enumerate() {
            for (value, row) in column.iter_mut().zip(&rows) {
                if value.abs() <= NOTHING * row.max(columns[j]) {
                    *value = 0.0;
                }
            }
        }
    }

    /// The coordinates of no family.
    fn rest(&self, count: usize) -> Vec<usize> {
        let mut rest = vec![true; count];
        self.families.iter().flatten().for_each(|&k| rest[k] = false);
        (0..count).filter(|&k| rest[k]).collect()
    }
}

/// A mode and what moves in it.
pub struct Motion {
    /// 1/s.
    pub value: c64,
    /// |wⱼ vⱼ| with left and right eigenvectors w and v, of sum 1. (For units in combinations that nothing
    /// else sees, w is that of the units alone.)
    pub shares: Vec<f64>,
    /// Right eigenvector v. Its largest element is 1.
    pub shape: Vec<c64>,
}

fn part(matrix: &Mat<f64>, rows: &[usize], columns: &[usize]) -> Mat<f64> {
    Mat::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])])
}

/// Complex vectors as columns, real parts first.
#[derive(Clone)]
struct Pairs(Mat<f64>);

impl Pairs {
    fn new(size: usize, count: usize) -> Self {
        Self(Mat::zeros(size, 2 * count))
    }

    fn set(&mut self, i: usize, k: usize, value: c64) {
        let imaginary = self.0.ncols() / 2 + k;
        (self.0[(i, k)], self.0[(i, imaginary)]) = (value.re, value.im);
    }

    fn column(&self, k: usize) -> Vec<c64> {
        let (re, im) = (self.0.col(k), self.0.col(self.0.ncols() / 2 + k));
        re.iter().zip(im.iter()).map(|(re, im)| c64::new(*re, *im)).collect()
    }
}

/// Strongly connected coordinates of a matrix, each list before those that it influences.
fn blocks(matrix: &Mat<f64>) -> Vec<Vec<usize>> {
    let mut graph = Graph::new(matrix.nrows());
    for (j, column) in matrix.col_iter().enumerate() {
        let entries = column.iter().enumerate().filter(|(_, value)| **value != 0.0);
        entries.for_each(|(i, _)| graph.edge(j, i));
    }
    graph.components()
}

/// The coordinates outside a block that influence it directly.
fn sources(matrix: &Mat<f64>, block: &[usize]) -> Vec<usize> {
    let influences = |&j: &usize| block.iter().any(|&i| matrix[(i, j)] != 0.0);
    (0..matrix.ncols()).filter(|j| !block.contains(j)).filter(influences).collect()
}

/// How a block moves that earlier ones drive, at eigenvalues of theirs: (λ − A) v = drive.
fn follow(
    matrix: &Mat<f64>,
    block: &[usize],
    drive: &Mat<f64>,
    values: &[c64],
    motions: &mut Pairs,
) {
    let n = block.len();
    let (mut shifted, mut right) = (vec![c64::ZERO; n * n], vec![c64::ZERO; n]);
    for (mode, value) in values.iter().enumerate() {
        for i in 0..n {
            right[i] = c64::new(drive[(i, mode)], drive[(i, values.len() + mode)]);
            for j in 0..n {
                let diagonal = if i == j { *value } else { c64::ZERO };
                shifted[i * n + j] = diagonal - matrix[(block[i], block[j])];
            }
        }
        solve(&mut shifted, &mut right);
        // at an eigenvalue that both have, the block has a mode of its own
        if right.iter().all(|v| v.is_finite()) {
            block.iter().zip(&right).for_each(|(&i, v)| motions.set(i, mode, *v));
        }
    }
}

/// x ← M⁻¹ x for a matrix by rows, by elimination with pivots: blocks of one unit are too small for a library.
fn solve(m: &mut [c64], x: &mut [c64]) {
    let n = x.len();
    let size = |z: c64| z.re.abs() + z.im.abs();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| size(m[i * n + k]).total_cmp(&size(m[j * n + k])));
        let pivot = pivot.unwrap_or(k);
        if pivot != k {
            (k..n).for_each(|j| m.swap(k * n + j, pivot * n + j));
            x.swap(k, pivot);
        }
        let inverse = m[k * n + k].inv();
        for i in k + 1..n {
            let factor = m[i * n + k] * inverse;
            if factor != c64::ZERO {
                (k + 1..n).for_each(|j| m[i * n + j] -= factor * m[k * n + j]);
                x[i] -= factor * x[k];
            }
        }
    }
    for k in (0..n).rev() {
        let sum: c64 = (k + 1..n).map(|j| m[k * n + j] * x[j]).sum();
        x[k] = (x[k] - sum) * m[k * n + k].inv();
    }
}

/// Orthogonal combinations of lanes, as columns.
struct Patterns {
    columns: Mat<f64>,
    /// So many of them are seen.
    seen: usize,
}

impl Patterns {
    /// The right singular vectors of what is seen.
    fn of(seen: &Mat<f64>) -> Result<Self, LinearError> {
        let triangle = seen.qr().thin_R().to_owned();
        let svd = triangle.svd().map_err(|_| LinearError::Eigenvalues)?;
        let sizes = svd.S().column_vector();
        let count = sizes.iter().filter(|size| **size > FAINT * sizes[0]).count();
        Ok(Self { columns: svd.V().to_owned(), seen: count })
    }

    /// Whether these are the patterns of something else that is seen.
    fn shows(&self, seen: &Mat<f64>) -> bool {
        let lanes = self.columns.nrows();
        let all = seen * self.columns.subcols(0, self.seen);
        let none = seen * self.columns.subcols(self.seen, lanes - self.seen);
        let Ok(sizes) = all.qr().thin_R().singular_values() else { return false };
        let (most, least) = (sizes.first().copied(), sizes.last().copied());
        let (most, least) = (most.unwrap_or(0.0), least.unwrap_or(0.0));
        none.norm_max() <= FAINT * most && least > FAINT * most
    }
}

fn write(from: &Mat<f64>, place: impl Fn(usize, usize) -> (usize, usize), to: &mut Mat<f64>) {
    for (j, column) in from.col_iter().enumerate() {
        for (i, value) in column.iter().enumerate() {
            to[place(i, j)] = *value;
        }
    }
}

/// The units of the kind with most members: those with the same states. (They need not be equal. If they are
/// not, no combination of lanes is found that nothing else sees.)
pub(crate) fn most_alike(units: &[LinearUnit]) -> Vec<usize> {
    let mut kinds: IndexMap<&[String], Vec<usize>> = IndexMap::new();
    for (k, unit) in units.iter().enumerate().filter(|(_, unit)| !unit.states.is_empty()) {
        kinds.entry(&unit.states).or_default().push(k);
    }
    kinds.into_values().max_by_key(Vec::len).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Units: so many, of three states, which hang on a chain of five masses. Force of a unit and what it measures
    /// are linear over the masses, so that the chain sees few combinations of them.
    fn system(units: usize, difference: f64) -> (Mat<f64>, Lanes) {
        let (masses, states) = (5, 3);
        let n = 2 * masses + units * states;
        let mut a = Mat::<f64>::zeros(n, n);
        for k in 0..masses {
            let (place, rate) = (2 * k, 2 * k + 1);
            a[(place, rate)] = 1.0;
            a[(rate, place)] = -2e4;
            a[(rate, rate)] = -1.5;
            if k > 0 {
                a[(rate, place - 2)] = 9e3;
                a[(rate - 2, place)] = 9e3;
            }
        }
        for unit in 0..units {
            let first = 2 * masses + unit * states;
            let along = (masses - 1) as f64 * unit as f64 / (units - 1) as f64;
            let (left, part) = (along.floor().min(3.0) as usize, along - along.floor().min(3.0));
            a[(first, first + 1)] = 1.0;
            a[(first + 1, first)] = -400.0;
            a[(first + 1, first + 1)] = -30.0 - difference * unit as f64;
            a[(first + 2, first)] = 50.0;
            a[(first + 2, first + 2)] = -10.0;
            for (mass, weight) in [(left, 1.0 - part), (left + 1, part)] {
                a[(first + 1, 2 * mass)] = 300.0 * weight;
                a[(2 * mass + 1, first + 2)] = -40.0 * weight;
            }
        }
        let family = |state| (0..units).map(|unit| 2 * masses + unit * states + state).collect();
        (a, Lanes::new(units, (0..states).map(family)))
    }

    /// Farthest from an eigenvalue of the other list, each taken once.
    fn distance(ours: &[c64], others: &[c64]) -> f64 {
        assert_eq!(ours.len(), others.len());
        let mut free = others.to_vec();
        let mut worst = 0.0_f64;
        for value in ours {
            let far = |other: &c64| (other - value).norm();
            let near = (0..free.len()).min_by(|&i, &j| far(&free[i]).total_cmp(&far(&free[j])));
            worst = worst.max(far(&free.swap_remove(near.unwrap())) / (1.0 + value.norm()));
        }
        worst
    }

    /// Largest |A v − λ v| of all modes, by the size of A's terms and v.
    fn residual(a: &Mat<f64>, modes: &[Motion]) -> f64 {
        let mut worst = 0.0_f64;
        for Motion { value, shape, .. } in modes {
            for i in 0..a.nrows() {
                let terms = (0..a.ncols()).map(|j| shape[j] * a[(i, j)]);
                let size: f64 = (0..a.ncols()).map(|j| a[(i, j)].abs()).sum();
                let rest = terms.sum::<c64>() - shape[i] * value;
                worst = worst.max(rest.norm() / (size + value.norm()));
            }
        }
        worst
    }

    /// 64 equal units: 59 combinations of them are seen by nothing, and have the eigenvalues of one unit alone, 59 times.
    /// Modes, and eigenvectors in the coordinates of the matrix, are those of the whole.
    #[test]
    fn analytic_modes_of_equal_units_are_those_of_the_whole_matrix() {
        let (a, lanes) = system(64, 0.0);
        let patterns = lanes.patterns(&lanes.scaled(&a).0).unwrap().unwrap();
        let blocks = blocks(&lanes.transformed(&lanes.scaled(&a).0, &patterns));
        assert_eq!(blocks.iter().map(Vec::len).max(), Some(10 + 5 * 3));
        let values = lanes.eigenvalues(&a).unwrap();
        assert!(distance(&values, &eigenvalues(&a).unwrap()) < 1e-9);
        let alone = values.iter().filter(|z| (*z + 10.0).norm() < 1e-6).count();
        assert_eq!(alone, 59);
        let modes = lanes.eigen(&a).unwrap();
        assert!(residual(&a, &modes) < 1e-9, "{:e}", residual(&a, &modes));
        let whole = eigen(&a).unwrap();
        // single modes participate as in the decomposition of the whole
        for mode in modes.iter().filter(|it| (it.value + 10.0).norm() > 1e-3) {
            assert!((mode.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let same: Vec<&Eigen> =
                whole.iter().filter(|it| (it.value - mode.value).norm() < 1e-6).collect();
            if let [same] = same.as_slice() {
                let pairs = mode.shares.iter().zip(&same.shares);
                assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-7);
            }
        }
    }

    /// Units that differ are not taken for equal.
    #[test]
    fn analytic_units_that_differ_keep_their_own_eigenvalues() {
        for difference in [1e-9, 1e-3, 0.3] {
            let (a, lanes) = system(16, difference);
            let values = lanes.eigenvalues(&a).unwrap();
            assert!(distance(&values, &eigenvalues(&a).unwrap()) < 1e-8, "{difference}");
        }
        let (a, lanes) = system(16, 0.3);
        assert!(residual(&a, &lanes.eigen(&a).unwrap()) < 1e-9);
    }
}
