//! Symbolic and numeric elimination in the initial pose: fill and pivots.

use std::cell::Cell;
use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::sample::Sample;

/// Smallest eigenvalues of a joint's scaled pivot at which it is eliminated once all safe ones are
/// gone. Up to the first the order of least fill continues; up to the last the largest pivot is
/// next. Bodies with small inertia and long arms make small pivots: I/(I + m s²) for a hinge at the
/// arm s. Below the last, cancellation has left too few digits.
const SMALL_PIVOT: f64 = 1e-10;
const SMALLEST_PIVOT: f64 = 1e-12;

/// One eliminated pivot.
pub(crate) struct Gone {
    pub node: usize,
    /// Diagonal of its LDLᵀ, by magnitude.
    pub pivots: Vec<f64>,
    pub below: Vec<(usize, DMatrix<f64>)>,
}

/// Fill, number of partners, level, node: the least is eliminated next.
type Rank = (usize, usize, usize, usize);

pub(crate) struct Elimination {
    pub sample: Sample,
    /// Nodes that each node is coupled with at first.
    pub partners: Vec<Vec<usize>>,
    /// Full strength of each joint row: Σ J diag(M)⁻¹ Jᵀ over both bodies.
    pub strength: Vec<Vec<f64>>,
    /// Smallest eigenvalue of each joint's scaled pivot, once it has been asked for.
    pivot: Vec<Cell<Option<f64>>>,
    /// Fill that each node would create now.
    fill: Vec<usize>,
    /// Nodes of the group that are left, by rank.
    left: BTreeSet<Rank>,
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
            pivot: vec![Cell::new(None); n],
            fill: vec![0; n],
            left: BTreeSet::new(),
            level: vec![0; n],
            gone: vec![],
        };
        for node in 0..n {
            this.refresh(node);
        }
        this
    }

    /// Brings a node's fill count up to date, and forgets its pivot strength.
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
        self.pivot[node].set(None);
    }

    /// Strength of a joint's pivot. Few are asked for before they change again.
    fn pivot(&self, node: usize) -> f64 {
        debug_assert!(node >= self.sample.bodies, "bodies need no strength");
        let known = self.pivot[node].get();
        let pivot = known.unwrap_or_else(|| smallest_eigenvalue(&self.scaled_pivot(node)));
        self.pivot[node].set(Some(pivot));
        pivot
    }

    /// −D_jj with rows and columns scaled to full strength one.
    fn scaled_pivot(&self, node: usize) -> DMatrix<f64> {
        let d = &self.sample.diagonal[node];
        let s = &self.strength[node];
        DMatrix::from_fn(d.nrows(), d.ncols(), |r, c| -d[(r, c)] / (s[r] * s[c]).sqrt())
    }

    fn rank(&self, node: usize) -> Rank {
        (self.fill[node], self.sample.coupling[node].len(), self.level[node], node)
    }

    fn best(&self, threshold: f64) -> Option<usize> {
        let mut nodes = self.left.iter().map(|&(.., node)| node);
        nodes.find(|&k| k < self.sample.bodies || self.pivot(k) > threshold)
    }

    /// Eliminates a node, if it has a pivot.
    fn eliminate(&mut self, node: usize) -> Option<()> {
        let d = &self.sample.diagonal[node];
        let body = node < self.sample.bodies;
        let factor = if body { d.clone() } else { -d.clone() }.cholesky()?;
        let inverse = if body { factor.inverse() } else { -factor.inverse() };
        let pivots = factor.l_dirty().diagonal().iter().map(|l| l * l).collect();
        self.left.remove(&self.rank(node));
        let neighbours = std::mem::take(&mut self.sample.coupling[node]);
        for &n in neighbours.keys() {
            self.left.remove(&self.rank(n));
        }
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
        self.gone.push(Gone { node, pivots, below });
        for n in touched {
            self.level[n] = self.level[n].max(self.level[node] + 1);
            self.refresh(n);
            self.left.insert(self.rank(n));
        }
        Some(())
    }

    fn strongest(&self) -> Option<usize> {
        let nodes = self.left.iter().map(|&(.., node)| node);
        let strong = nodes.filter(|&k| self.pivot(k) > SMALLEST_PIVOT);
        strong.max_by(|a, b| self.pivot(*a).total_cmp(&self.pivot(*b)).then(a.cmp(b)))
    }

    /// Eliminates one group and returns the nodes that cannot be eliminated.
    pub fn run(&mut self, group: &[usize], safe: f64) -> Vec<usize> {
        self.left = group.iter().map(|&node| self.rank(node)).collect();
        while !self.left.is_empty() {
            let next =
                self.best(safe).or_else(|| self.best(SMALL_PIVOT)).or_else(|| self.strongest());
            if next.and_then(|node| self.eliminate(node)).is_none() {
                break;
            }
        }
        let mut nodes: Vec<usize> = self.left.iter().map(|&(.., node)| node).collect();
        nodes.sort_unstable();
        nodes
    }
}

/// NaN where the matrix is not finite.
fn smallest_eigenvalue(matrix: &DMatrix<f64>) -> f64 {
    if !matrix.iter().all(|v| v.is_finite()) {
        return f64::NAN;
    }
    matrix.symmetric_eigenvalues().min()
}
