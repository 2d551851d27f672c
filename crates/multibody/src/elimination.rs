//! Symbolic and numeric elimination in the initial pose: fill, pivots, and what cannot be eliminated.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::sample::Sample;

/// Below this a joint's equations count as dependent: the pivots are squares of the Jacobian's
/// singular values (in the metric of the inverse mass matrix), so this is 1e-5 of full strength.
const DEPENDENT_PIVOT: f64 = 1e-10;

/// A state of self-stress: forces of the joints that cancel on every body.
#[derive(Debug, Clone)]
pub(crate) struct Dependency {
    /// The joint to be named.
    pub node: usize,
    /// Force of each joint that takes a share, by node.
    pub forces: BTreeMap<usize, DVector<f64>>,
}

/// One eliminated pivot.
pub(crate) struct Gone {
    pub node: usize,
    inverse: DMatrix<f64>,
    pub below: Vec<(usize, DMatrix<f64>)>,
}

pub(crate) struct Elimination {
    pub sample: Sample,
    /// Nodes that each node is coupled with at first.
    pub partners: Vec<Vec<usize>>,
    /// Full strength of each joint row: Σ J diag(M)⁻¹ Jᵀ over both bodies.
    pub strength: Vec<Vec<f64>>,
    pivot: Vec<f64>,
    fill: Vec<usize>,
    /// Length of the longest chain of eliminations that must precede each node.
    pub level: Vec<usize>,
    pub gone: Vec<Gone>,
}

impl Elimination {
    pub fn new(sample: Sample) -> Self {
        let n = sample.sizes.len();
        let mut strength = vec![Vec::new(); n];
        for (j, strength) in strength.iter_mut().enumerate().skip(sample.bodies) {
            let mut rows = vec![0.0; sample.sizes[j].get()];
            for (b, block) in &sample.coupling[j] {
                for (r, row) in rows.iter_mut().enumerate() {
                    for c in 0..block.ncols() {
                        *row += block[(r, c)].powi(2) / sample.diagonal[*b][(c, c)];
                    }
                }
            }
            *strength = rows;
        }
        let partners = sample.coupling.iter().map(|c| c.keys().copied().collect()).collect();
        let mut this = Self {
            sample,
            partners,
            strength,
            pivot: vec![0.0; n],
            fill: vec![0; n],
            level: vec![0; n],
            gone: vec![],
        };
        for node in 0..n {
            this.refresh(node);
        }
        this
    }

    /// Brings a node's fill count and pivot strength up to date.
    fn refresh(&mut self, node: usize) {
        let neighbours: Vec<usize> = self.sample.coupling[node].keys().copied().collect();
        let mut fill = 0;
        for (k, &n) in neighbours.iter().enumerate() {
            for m in &neighbours[..k] {
                if !self.sample.coupling[n].contains_key(m) {
                    fill += self.sample.sizes[n].get() * self.sample.sizes[*m].get();
                }
            }
        }
        self.fill[node] = fill;
        if node >= self.sample.bodies {
            self.pivot[node] = smallest_eigenvalue(&self.scaled_pivot(node));
        }
    }

    /// −D_jj with rows and columns scaled to full strength one.
    fn scaled_pivot(&self, node: usize) -> DMatrix<f64> {
        let d = &self.sample.diagonal[node];
        let s = &self.strength[node];
        DMatrix::from_fn(d.nrows(), d.ncols(), |r, c| -d[(r, c)] / (s[r] * s[c]).sqrt())
    }

    fn best(&self, alive: &[usize], threshold: f64) -> Option<usize> {
        alive
            .iter()
            .copied()
            .filter(|&k| k < self.sample.bodies || self.pivot[k] > threshold)
            .min_by_key(|&k| (self.fill[k], self.sample.coupling[k].len(), self.level[k], k))
    }

    fn eliminate(&mut self, node: usize) -> Option<()> {
        let d = &self.sample.diagonal[node];
        let inverse = if node < self.sample.bodies {
            d.clone().cholesky()?.inverse()
        } else {
            -(-d.clone()).cholesky()?.inverse()
        };
        let neighbours = std::mem::take(&mut self.sample.coupling[node]);
        let below: Vec<(usize, DMatrix<f64>)> = neighbours
            .keys()
            .filter_map(|n| self.sample.coupling[*n].remove(&node).map(|block| (*n, block)))
            .collect();
        for (k, (n, block_n)) in below.iter().enumerate() {
            let w = block_n * &inverse;
            let change = -(&w * block_n.transpose());
            self.sample.diagonal[*n] += change;
            for (m, block_m) in &below[..k] {
                let change = -(&w * block_m.transpose());
                self.sample.couple(*n, *m, &change);
            }
        }
        let touched: Vec<usize> = below.iter().map(|(n, _)| *n).collect();
        self.gone.push(Gone { node, inverse, below });
        for n in touched {
            self.level[n] = self.level[n].max(self.level[node] + 1);
            self.refresh(n);
        }
        Some(())
    }

    /// Eliminates one group and returns the nodes that cannot be eliminated.
    pub fn run(&mut self, group: &[usize], safe: f64) -> Vec<usize> {
        let mut alive = group.to_vec();
        while !alive.is_empty() {
            let next = self
                .best(&alive, safe)
                .or_else(|| self.best(&alive, DEPENDENT_PIVOT))
                .filter(|&k| self.eliminate(k).is_some());
            let Some(node) = next else { break };
            alive.retain(|k| *k != node);
        }
        alive
    }

    /// The self-stresses among joints that could not be eliminated.
    pub fn dependencies(&self, left: &[usize]) -> Vec<Dependency> {
        let mut starts = Vec::new();
        let mut size = 0;
        for &node in left {
            starts.push(size);
            size += self.sample.sizes[node].get();
        }
        let mut g = DMatrix::zeros(size, size);
        let scale: Vec<f64> =
            left.iter().flat_map(|&k| self.strength[k].iter().map(|s| s.sqrt())).collect();
        for (i, &node) in left.iter().enumerate() {
            let n = self.sample.sizes[node].get();
            g.view_mut((starts[i], starts[i]), (n, n)).copy_from(&self.sample.diagonal[node]);
            for (k, &other) in left.iter().enumerate() {
                if let Some(block) = self.sample.coupling[node].get(&other) {
                    g.view_mut((starts[i], starts[k]), block.shape()).copy_from(block);
                }
            }
        }
        let g = DMatrix::from_fn(size, size, |r, c| -g[(r, c)] / (scale[r] * scale[c]));
        if !g.iter().all(|v| v.is_finite()) {
            return Vec::new();
        }
        let eigen = SymmetricEigen::new(g);
        let mut null: Vec<DVector<f64>> = (0..size)
            .filter(|&k| eigen.eigenvalues[k] <= DEPENDENT_PIVOT)
            .map(|k| eigen.eigenvectors.column(k).into_owned())
            .collect();
        let pivots = reduce(&mut null);
        null.iter()
            .zip(pivots)
            .map(|(vector, pivot)| {
                let k = starts.iter().rposition(|s| *s <= pivot).unwrap_or(0);
                let mut forces = BTreeMap::new();
                for (i, &node) in left.iter().enumerate() {
                    let n = self.sample.sizes[node].get();
                    let part =
                        DVector::from_fn(n, |r, _| vector[starts[i] + r] / scale[starts[i] + r]);
                    forces.insert(node, part);
                }
                self.spread(&mut forces);
                Dependency { node: left[k], forces }
            })
            .collect()
    }

    /// Completes a null vector by back-substitution over the eliminated nodes; keeps joints only.
    fn spread(&self, forces: &mut BTreeMap<usize, DVector<f64>>) {
        for gone in self.gone.iter().rev() {
            let mut sum = DVector::zeros(gone.inverse.nrows());
            let mut any = false;
            for (n, block) in &gone.below {
                if let Some(x) = forces.get(n) {
                    sum += block.transpose() * x;
                    any = true;
                }
            }
            if any {
                forces.insert(gone.node, -(&gone.inverse * sum));
            }
        }
        let bodies = self.sample.bodies;
        let largest =
            forces.iter().filter(|(n, _)| **n >= bodies).map(|(_, x)| x.amax()).fold(0.0, f64::max);
        forces.retain(|n, x| *n >= bodies && x.amax() > 1e-6 * largest);
    }
}

/// NaN where the matrix is not finite.
fn smallest_eigenvalue(matrix: &DMatrix<f64>) -> f64 {
    if !matrix.iter().all(|v| v.is_finite()) {
        return f64::NAN;
    }
    matrix.symmetric_eigenvalues().min()
}

/// Gauss-Jordan over the vectors: each gets a component of its own, whose index is returned.
fn reduce(vectors: &mut [DVector<f64>]) -> Vec<usize> {
    let mut pivots = Vec::new();
    for k in 0..vectors.len() {
        let pivot = vectors[k].iamax();
        let unit = &vectors[k] / vectors[k][pivot];
        for (i, vector) in vectors.iter_mut().enumerate() {
            if i == k {
                vector.copy_from(&unit);
            } else {
                let factor = vector[pivot];
                vector.axpy(-factor, &unit, 1.0);
            }
        }
        pivots.push(pivot);
    }
    pivots
}
