//! Block-sparse LDLᵀ: the symbolic part, done once when a model is assembled.
//!
//! Nodes are bodies and joints. Greedy minimum fill: of the nodes that may be eliminated, the one
//! that creates least new coupling goes next. A body may always go (its pivot is positive definite).
//! A joint may go only when its current pivot, the Schur complement of what has gone before, is
//! safely nonsingular in the initial pose: before any of its bodies is eliminated that pivot is
//! zero, and a beam between two spherical joints can carry only one of them. A joint whose pivot
//! stays singular when everything else is gone repeats what others constrain already.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::block::{Below, Column, Factorisation, Place, Size, Update, decompose_mass};

/// Smallest eigenvalue of a joint's scaled pivot at which it may be eliminated early: safely away
/// from zero for a matrix that is to serve while the mechanism moves.
pub(crate) const SAFE_WHILE_MOVING: f64 = 1e-4;
/// The same for a matrix that only serves near the initial pose. Soft and stiff elements side by
/// side make pivots small there without making them uncertain.
pub(crate) const SAFE_AT_REST: f64 = 1e-7;
/// Below this a joint's equations count as dependent: the pivots are squares of the Jacobian's
/// singular values (in the metric of the inverse mass matrix), so this is 1e-5 of full strength.
const DEPENDENT_PIVOT: f64 = 1e-10;
/// Share of a row's full strength at which a moving mechanism counts as singular.
const VANISHING_PIVOT: f64 = 1e-12;

/// A symmetric block matrix in the initial pose, for the analysis.
pub(crate) struct Sample {
    pub sizes: Vec<Size>,
    /// Nodes below this are bodies, the rest joints.
    pub bodies: usize,
    pub diagonal: Vec<DMatrix<f64>>,
    /// Block (i, j) for every coupled pair, in both directions.
    pub coupling: Vec<BTreeMap<usize, DMatrix<f64>>>,
}

impl Sample {
    pub fn new(sizes: Vec<Size>, bodies: usize) -> Self {
        let diagonal = sizes.iter().map(|s| DMatrix::zeros(s.get(), s.get())).collect();
        let coupling = vec![BTreeMap::new(); sizes.len()];
        Self { sizes, bodies, diagonal, coupling }
    }

    /// Adds to the block (i, j), i ≠ j, and its transpose.
    pub fn couple(&mut self, i: usize, j: usize, block: &DMatrix<f64>) {
        let (rows, cols) = (self.sizes[i].get(), self.sizes[j].get());
        *self.coupling[i].entry(j).or_insert_with(|| DMatrix::zeros(rows, cols)) += block;
        *self.coupling[j].entry(i).or_insert_with(|| DMatrix::zeros(cols, rows)) +=
            block.transpose();
    }
}

/// A state of self-stress: forces of the joints that cancel on every body.
#[derive(Debug, Clone)]
pub(crate) struct Dependency {
    /// The joint to be named.
    pub node: usize,
    /// Force by node, all joints that take part.
    pub forces: BTreeMap<usize, DVector<f64>>,
}

/// Why a matrix cannot be factored.
#[derive(Debug, Clone)]
pub(crate) enum Failure {
    /// Equations that follow from others.
    Dependent(Vec<Dependency>),
    /// The numbers about this node differ too much in size, or overflow.
    Unusable(usize),
}

/// The result of the analysis.
#[derive(Debug, Clone)]
pub(crate) struct Ordering {
    pub factorisation: Factorisation,
    places: HashMap<(usize, usize), Place>,
    /// Group of each node; groups share no coupling.
    pub components: Vec<usize>,
}

impl Ordering {
    /// Where the block (i, j) of the matrix is stored.
    pub fn place(&self, i: usize, j: usize) -> Option<Place> {
        self.places.get(&(i, j)).copied()
    }
}

/// The groups of nodes that hang together, each ascending.
fn components(sample: &Sample) -> Vec<Vec<usize>> {
    let n = sample.sizes.len();
    let mut seen = vec![false; n];
    let mut groups = Vec::new();
    for start in 0..n {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut group = vec![start];
        let mut next = 0;
        while next < group.len() {
            for &neighbour in sample.coupling[group[next]].keys() {
                if !seen[neighbour] {
                    seen[neighbour] = true;
                    group.push(neighbour);
                }
            }
            next += 1;
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// One eliminated pivot.
struct Gone {
    node: usize,
    inverse: DMatrix<f64>,
    below: Vec<(usize, DMatrix<f64>)>,
}

struct Elimination {
    sample: Sample,
    /// Full strength of each joint row: Σ J diag(M)⁻¹ Jᵀ over both bodies.
    strength: Vec<Vec<f64>>,
    pivot: Vec<f64>,
    fill: Vec<usize>,
    gone: Vec<Gone>,
}

impl Elimination {
    fn new(sample: Sample) -> Self {
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
        let mut this =
            Self { sample, strength, pivot: vec![0.0; n], fill: vec![0; n], gone: vec![] };
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
            .min_by_key(|&k| (self.fill[k], self.sample.coupling[k].len(), k))
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
            self.refresh(n);
        }
        Some(())
    }

    /// Eliminates one group; what cannot go is returned.
    fn run(&mut self, group: &[usize], safe: f64) -> Vec<usize> {
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
    fn dependencies(&self, left: &[usize]) -> Vec<Dependency> {
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

/// Finds elimination order and storage, or the dependencies among the joints. `safe` is the pivot at
/// which a joint may be eliminated before its bodies.
pub(crate) fn analyse(sample: Sample, safe: f64) -> Result<Ordering, Failure> {
    let groups = components(&sample);
    let mut elimination = Elimination::new(sample);
    let mut left = Vec::new();
    for group in &groups {
        left.extend(elimination.run(group, safe));
    }
    if let Some(&first) = left.first() {
        // only joints may be left, and only with equations that depend on each other
        if let Some(&body) = left.iter().find(|k| **k < elimination.sample.bodies) {
            return Err(Failure::Unusable(body));
        }
        let found = elimination.dependencies(&left);
        let none = found.is_empty();
        return Err(if none { Failure::Unusable(first) } else { Failure::Dependent(found) });
    }
    let mut components = vec![0; elimination.sample.sizes.len()];
    for (k, group) in groups.iter().enumerate() {
        for &node in group {
            components[node] = k;
        }
    }
    Ok(layout(&elimination, components))
}

/// Columns that are looked at together when independent ones are put side by side.
const WINDOW: usize = 32;

/// The elimination order arranged for the processor, without any other fill since every column still
/// comes after all that change it. First what changes a column is brought close before it (a
/// postorder of the elimination tree), so that little is read from far away. Then, window by window,
/// columns that do not wait for each other come side by side, so that several are under way while
/// the divisions of a pivot take their time.
fn sequence(gone: &[Gone]) -> Vec<&Gone> {
    let mut rank = HashMap::new();
    for (k, column) in gone.iter().enumerate() {
        rank.insert(column.node, k);
    }
    let mut level = vec![0_usize; gone.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); gone.len()];
    let mut pending = Vec::new();
    for (k, column) in gone.iter().enumerate() {
        let later = || column.below.iter().filter_map(|(node, _)| rank.get(node).copied());
        for n in later() {
            level[n] = level[n].max(level[k] + 1);
        }
        match later().min() {
            Some(parent) => children[parent].push(k),
            None => pending.push(k),
        }
    }
    // from the roots down, each before its children, then turned round
    let mut order = Vec::with_capacity(gone.len());
    while let Some(k) = pending.pop() {
        order.push(k);
        pending.append(&mut children[k]);
    }
    order.reverse();
    for window in order.chunks_mut(WINDOW) {
        window.sort_by_key(|k| level[*k]);
    }
    order.into_iter().map(|k| &gone[k]).collect()
}

/// Lays out the storage in elimination order and lists the updates.
fn layout(elimination: &Elimination, components: Vec<usize>) -> Ordering {
    let sizes = &elimination.sample.sizes;
    let bodies = elimination.sample.bodies;
    let mut rhs = vec![0; sizes.len()];
    let mut rows = 0;
    for (k, size) in sizes.iter().enumerate() {
        rhs[k] = rows;
        rows += size.get();
    }
    let sequence = sequence(&elimination.gone);
    let mut rank = vec![0; sizes.len()];
    for (k, gone) in sequence.iter().enumerate() {
        rank[gone.node] = k;
    }
    let mut storage = 0;
    let mut columns = Vec::new();
    let mut below: Vec<Below> = Vec::new();
    let mut places = HashMap::new();
    let mut orders = Vec::new();
    for gone in sequence {
        let size = sizes[gone.node];
        let diagonal = storage;
        places.insert((gone.node, gone.node), Place { offset: diagonal, as_asked: true });
        storage += size.get() * size.get();
        let mut later: Vec<usize> = gone.below.iter().map(|(n, _)| *n).collect();
        later.sort_unstable_by_key(|n| rank[*n]);
        let first = below.len();
        for &n in &later {
            places.insert((n, gone.node), Place { offset: storage, as_asked: true });
            places.insert((gone.node, n), Place { offset: storage, as_asked: false });
            below.push(Below { size: sizes[n], offset: storage, rhs: rhs[n] });
            storage += sizes[n].get() * size.get();
        }
        columns.push(Column {
            node: gone.node,
            size,
            positive: gone.node < bodies,
            leaf: None,
            diagonal,
            end: storage,
            rhs: rhs[gone.node],
            below: first..below.len(),
            updates: 0..0,
        });
        orders.push(later);
    }
    factor_leaves(&mut columns, &orders, &elimination.sample.diagonal);
    let updates = list_updates(&mut columns, &below, &orders, &places);
    let mut smallest_pivot = vec![0.0; rows];
    for node in bodies..sizes.len() {
        for (r, s) in elimination.strength[node].iter().enumerate() {
            smallest_pivot[rhs[node] + r] = VANISHING_PIVOT * s;
        }
    }
    Ordering {
        factorisation: Factorisation { columns, below, updates, storage, smallest_pivot },
        places,
        components,
    }
}

/// Factors the bodies that nothing eliminated before them changes.
fn factor_leaves(columns: &mut [Column], orders: &[Vec<usize>], diagonal: &[DMatrix<f64>]) {
    let changed: HashSet<usize> = orders.iter().flatten().copied().collect();
    for column in columns.iter_mut().filter(|c| c.positive && !changed.contains(&c.node)) {
        column.leaf = diagonal[column.node].as_slice().try_into().ok().and_then(decompose_mass);
    }
}

fn list_updates(
    columns: &mut [Column],
    below: &[Below],
    orders: &[Vec<usize>],
    places: &HashMap<(usize, usize), Place>,
) -> Vec<Update> {
    let mut updates = Vec::new();
    for (column, later) in columns.iter_mut().zip(orders) {
        let first = updates.len();
        let blocks = &below[column.below.clone()];
        for (k, &m) in later.iter().enumerate() {
            for (i, &n) in later.iter().enumerate().skip(k) {
                // elimination coupled every pair of later neighbours, so the place exists
                if let Some(place) = places.get(&(n, m)) {
                    updates.push(Update { rows: blocks[i], cols: blocks[k], target: place.offset });
                }
            }
        }
        column.updates = first..updates.len();
    }
    updates
}
