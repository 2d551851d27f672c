//! Storage layout and processing order of a factorisation's blocks.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use crate::block::{
    Below, BlockPlace, BlockSize, ColumnWindow, CompactIndex, Factorisation, Pivot, PivotColumn,
    compact,
};
use crate::elimination::{Elimination, Gone};
use crate::kernels::Leaf;

/// Largest number of columns of a window: about 25 kB, half of a first-level cache of 48 kB, and
/// enough independent columns to overlap.
const WINDOW: usize = 56;

/// Fraction of a row's full strength at which a moving mechanism counts as singular.
const VANISHING_PIVOT: f64 = 1e-12;
/// The same as a fraction of the pivot in the initial pose, for bodies of very small inertia, whose
/// pivots are small from the beginning.
const VANISHING_FRACTION: f64 = 1e-3;

/// The result of the analysis.
#[derive(Debug, Clone)]
pub(crate) struct Analysis {
    pub factorisation: Factorisation,
    pub places: HashMap<(usize, usize), BlockPlace>,
    /// Group of each node; groups share no coupling.
    pub components: Vec<usize>,
}

impl Analysis {
    /// Where the block (i, j) of the matrix is stored.
    pub fn place(&self, i: usize, j: usize) -> Option<BlockPlace> {
        self.places.get(&(i, j)).copied()
    }
}

/// Columns in processing order.
struct Sequence<'a> {
    columns: Vec<&'a Gone>,
    /// Ranges of columns.
    windows: Vec<Range<usize>>,
    /// Ranges of windows.
    sections: Vec<Range<usize>>,
}

/// Rearranges the elimination order for the processor. The fill stays the same, since every column
/// still comes after all columns that change it. First the columns that change a column are placed
/// close before it (a postorder of the elimination tree), so that data is reused from the cache.
/// Then, window by window, independent columns are placed next to each other, so that several are
/// in progress while the divisions of a pivot complete.
fn sequence(gone: &[Gone]) -> Sequence<'_> {
    let rank: HashMap<usize, usize> = gone.iter().enumerate().map(|(k, g)| (g.node, k)).collect();
    let mut level = vec![0_usize; gone.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); gone.len()];
    let mut roots = Vec::new();
    for (k, column) in gone.iter().enumerate() {
        let later = || column.below.iter().filter_map(|(node, _)| rank.get(node).copied());
        for n in later() {
            level[n] = level[n].max(level[k] + 1);
        }
        match later().min() {
            Some(parent) => children[parent].push(k),
            None => roots.push(k),
        }
    }
    let mut order = Vec::with_capacity(gone.len());
    let (mut windows, mut sections) = (Vec::new(), Vec::new());
    for root in roots {
        let first = order.len();
        let mut pending = vec![root];
        // from the root down, each before its children, then reversed
        while let Some(k) = pending.pop() {
            order.push(k);
            pending.append(&mut children[k]);
        }
        order[first..].reverse();
        add_tree(first..order.len(), &mut windows, &mut sections);
    }
    for window in &windows {
        order[Range::clone(window)].sort_by_key(|k| level[*k]);
    }
    Sequence { columns: order.into_iter().map(|k| &gone[k]).collect(), windows, sections }
}

/// Splits a tree of columns into windows that form a section, or adds a small tree to the last
/// section if that is one window with room left.
fn add_tree(tree: Range<usize>, windows: &mut Vec<Range<usize>>, sections: &mut Vec<Range<usize>>) {
    if let (Some(window), Some(section)) = (windows.last_mut(), sections.last())
        && section.len() == 1
        && window.len() + tree.len() <= WINDOW
    {
        window.end = tree.end;
        return;
    }
    let first = windows.len();
    let mut start = tree.start;
    while start < tree.end {
        let end = tree.end.min(start + WINDOW);
        windows.push(start..end);
        start = end;
    }
    sections.push(first..windows.len());
}

/// A factorisation under construction.
struct LayoutBuilder<'a> {
    elimination: &'a Elimination,
    /// Position of each node in the elimination order.
    rank: Vec<usize>,
    /// Offset of each node's part of a right-hand side.
    rhs: Vec<CompactIndex>,
    rows: usize,
    storage: usize,
    columns: Vec<PivotColumn>,
    below: Vec<Below>,
    leaves: Vec<Leaf>,
    places: HashMap<(usize, usize), BlockPlace>,
    /// Nodes below each column, in elimination order.
    orders: Vec<Vec<usize>>,
}

impl LayoutBuilder<'_> {
    /// Reserves storage for a block.
    fn place(&mut self, i: usize, j: usize) -> CompactIndex {
        let offset = compact(self.storage);
        self.places.insert((j, i), BlockPlace { offset, as_asked: false });
        self.places.insert((i, j), BlockPlace { offset, as_asked: true });
        let sizes = &self.elimination.sample.sizes;
        self.storage += sizes[i].get() * sizes[j].get();
        offset
    }

    fn add_column(&mut self, gone: &Gone, leaf: Option<Leaf>) {
        let sizes = &self.elimination.sample.sizes;
        let node = gone.node;
        let start = compact(self.storage);
        let pivot = if let Some(leaf) = leaf {
            self.leaves.push(leaf);
            Pivot::Leaf(compact(self.leaves.len() - 1))
        } else {
            self.place(node, node);
            if node < self.elimination.sample.bodies { Pivot::Body } else { Pivot::Joint }
        };
        let mut later: Vec<usize> = gone.below.iter().map(|(n, _)| *n).collect();
        later.sort_unstable_by_key(|n| self.rank[*n]);
        let first = compact(self.below.len());
        for &n in &later {
            self.place(n, node);
            self.below.push(Below { size: sizes[n], rhs: self.rhs[n] });
        }
        self.columns.push(PivotColumn {
            node: compact(node),
            size: sizes[node],
            pivot,
            start,
            end: compact(self.storage),
            rhs: self.rhs[node],
            below: first..compact(self.below.len()),
            targets: 0,
        });
        self.orders.push(later);
    }

    /// One target for each pair of blocks below a column.
    fn list_targets(&mut self) -> Vec<CompactIndex> {
        let mut targets = Vec::new();
        for (column, later) in self.columns.iter_mut().zip(&self.orders) {
            column.targets = compact(targets.len());
            for (k, &m) in later.iter().enumerate() {
                // elimination coupled every pair of later neighbours, so each place exists
                targets.extend(later[k..].iter().map(|&n| self.places[&(n, m)].offset));
            }
        }
        targets
    }

    /// What each window has to assemble before its columns are eliminated.
    fn windows(&self, ranges: &[Range<usize>], targets: &[CompactIndex]) -> Vec<ColumnWindow> {
        // first window that touches a block, by offset
        let mut first: HashMap<CompactIndex, usize> = HashMap::new();
        let mut windows: Vec<ColumnWindow> = Vec::new();
        for (w, columns) in ranges.iter().enumerate() {
            for (column, later) in
                self.columns[columns.clone()].iter().zip(&self.orders[columns.clone()])
            {
                let pairs = later.len() * (later.len() + 1) / 2;
                let node = column.node as usize;
                let from = column.targets as usize;
                let own = later.iter().chain(std::iter::once(&node));
                for offset in own
                    .filter_map(|&n| self.places.get(&(n, node)).map(|place| place.offset))
                    .chain(targets[from..from + pairs].iter().copied())
                {
                    first.entry(offset).or_insert(w);
                }
            }
            windows.push(ColumnWindow {
                columns: columns.clone(),
                nodes: Vec::new(),
                fresh: Vec::new(),
            });
        }
        self.assign_nodes(&mut first, &mut windows);
        self.assign_storage(&first, &mut windows);
        windows
    }

    /// Assigns each node to the first window that touches one of its blocks; that window assembles
    /// all of them.
    fn assign_nodes(&self, first: &mut HashMap<CompactIndex, usize>, windows: &mut [ColumnWindow]) {
        let bodies = self.elimination.sample.bodies;
        for (node, partners) in self.elimination.partners.iter().enumerate() {
            let own = std::slice::from_ref(&node);
            let offsets = || {
                let partners = if node < bodies { own } else { partners };
                partners.iter().filter_map(|&n| self.places.get(&(node, n))).map(|p| p.offset)
            };
            // a leaf has nothing to assemble
            let Some(w) = offsets().filter_map(|offset| first.get(&offset).copied()).min() else {
                continue;
            };
            windows[w].nodes.push(compact(node));
            first.extend(offsets().map(|offset| (offset, w)));
        }
    }

    fn assign_storage(&self, first: &HashMap<CompactIndex, usize>, windows: &mut [ColumnWindow]) {
        let mut blocks: Vec<(CompactIndex, usize)> = first.iter().map(|(k, w)| (*k, *w)).collect();
        blocks.sort_unstable();
        let ends = blocks.iter().skip(1).map(|(offset, _)| *offset);
        for (&(start, w), end) in blocks.iter().zip(ends.chain([compact(self.storage)])) {
            match windows[w].fresh.last_mut() {
                Some(range) if range.end == start => range.end = end,
                _ => windows[w].fresh.push(start..end),
            }
        }
    }
}

/// Lays out the storage in elimination order and lists the updates. Bodies that nothing eliminated
/// before them changes are leaves if `constant` is set, which means that their diagonal blocks
/// never change.
pub(crate) fn layout(
    elimination: &Elimination,
    components: Vec<usize>,
    constant: bool,
) -> Analysis {
    let sizes = &elimination.sample.sizes;
    let (rhs, rows) = offsets(sizes);
    let sequence = sequence(&elimination.gone);
    let mut rank = vec![0; sizes.len()];
    for (k, gone) in sequence.columns.iter().enumerate() {
        rank[gone.node] = k;
    }
    let mut layout = LayoutBuilder {
        elimination,
        rank,
        rhs,
        rows,
        storage: 0,
        columns: Vec::new(),
        below: Vec::new(),
        leaves: Vec::new(),
        places: HashMap::new(),
        orders: Vec::new(),
    };
    let changed: HashSet<usize> =
        elimination.gone.iter().flat_map(|gone| gone.below.iter().map(|(n, _)| *n)).collect();
    for gone in sequence.columns {
        let node = gone.node;
        let leaf = constant && node < elimination.sample.bodies && !changed.contains(&node);
        let leaf = leaf
            .then(|| elimination.sample.diagonal[node].as_slice().try_into().ok())
            .flatten()
            .and_then(Leaf::new);
        layout.add_column(gone, leaf);
    }
    let targets = layout.list_targets();
    let windows = layout.windows(&sequence.windows, &targets);
    let smallest_pivot = layout.smallest_pivots();
    let LayoutBuilder { storage, columns, below, leaves, places, .. } = layout;
    let sections = sequence.sections;
    Analysis {
        factorisation: Factorisation {
            columns,
            below,
            targets,
            leaves,
            windows,
            sections,
            storage,
            smallest_pivot,
        },
        places,
        components,
    }
}

/// Offset of each node's part of a right-hand side, and their sum.
fn offsets(sizes: &[BlockSize]) -> (Vec<CompactIndex>, usize) {
    let mut rows = 0;
    let offsets = sizes
        .iter()
        .map(|size| {
            rows += size.get();
            compact(rows - size.get())
        })
        .collect();
    (offsets, rows)
}

impl LayoutBuilder<'_> {
    fn smallest_pivots(&self) -> Vec<f64> {
        let mut smallest = vec![0.0; self.rows];
        for gone in &self.elimination.gone {
            let strength = &self.elimination.strength[gone.node];
            for (r, (strength, pivot)) in strength.iter().zip(&gone.pivots).enumerate() {
                smallest[self.rhs[gone.node] as usize + r] =
                    (VANISHING_PIVOT * strength).min(VANISHING_FRACTION * pivot);
            }
        }
        smallest
    }
}
