//! Counting zeros in a region by the argument principle.

use std::sync::{Arc, RwLock};

use faer::prelude::c64;

use crate::branch::Point;
use crate::error::MapError;
use crate::node::Node;
use crate::region::Region;
use crate::space::Space;
use crate::system::Controllers;

/// Largest change of the argument between neighbouring points (rad) of a certified count.
const LARGEST_TURN: f64 = 1.0;
/// The same where the boundary is first divided.
const FIRST_TURN: f64 = 0.4;
/// Points of the ray and of the arc at the start.
const FIRST: (u32, u32) = (48, 8);
/// Shortest distance of two points, of the ray's length of 1.
const SHORTEST: f64 = 1e-6;
/// Most points.
const MOST: usize = 4000;
/// Responses of two measurements count as proportional up to this part.
const PROPORTIONAL: f64 = 0.01;

/// The boundary of a region with what is known of the determinant there.
pub struct Contour {
    /// The region.
    pub region: Region,
    nodes: RwLock<Arc<Vec<Arc<Node>>>>,
    /// The plant's poles inside.
    poles: Vec<c64>,
    equal: bool,
}

/// Result of a count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// Zeros in the region that are not among the known ones, a pair as two. Negative: some of those do not exist.
    Unknown(i64),
    /// The argument changes too fast between two points, however near.
    Uncertain,
}

impl Contour {
    /// Divides the boundary so that the count holds at a first point.
    ///
    /// # Errors
    /// A response has no eigenvalues.
    pub fn new(region: Region, point: Point<'_>, known: &[c64]) -> Result<Self, MapError> {
        let space = point.space;
        let poles: Vec<c64> = space.modal.poles().filter(|pole| region.contains(*pole)).collect();
        let equal = matches!(point.controllers, Controllers::Equal(..));
        let mut contour = Self { region, nodes: RwLock::new(Arc::new(Vec::new())), poles, equal };
        let (ray, arc) = FIRST;
        let times = (0..=ray).map(|k| f64::from(k) / f64::from(ray));
        let times = times.chain((1..=arc).map(|k| 1.0 + f64::from(k) / f64::from(arc)));
        let mut nodes = times.map(|t| contour.node(space, t)).collect::<Result<Vec<_>, _>>()?;
        if contour.equal && nodes.iter().any(|node| node.misfit > PROPORTIONAL) {
            // measurements that are not proportional cannot be diagonalised together
            contour.equal = false;
            let again = nodes.iter().map(|node| contour.node(space, node.t));
            nodes = again.collect::<Result<Vec<_>, _>>()?;
        }
        contour.nodes = RwLock::new(Arc::new(nodes));
        contour.count_with(point, known, FIRST_TURN)?;
        Ok(contour)
    }

    /// Whether a determinant costs divisions only, because all controllers are equal and their measurements
    /// proportional.
    #[must_use]
    pub fn is_diagonal(&self) -> bool {
        self.equal
    }

    /// Largest relative part of a measurement's response that is not proportional to the first one's. The count leaves
    /// it out; zeros are refined with it.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        self.snapshot().iter().map(|node| node.misfit).fold(0.0, f64::max)
    }

    /// Number of points of the boundary.
    #[must_use]
    pub fn len(&self) -> usize {
        self.snapshot().len()
    }

    /// Whether the boundary has no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn anchor(&self) -> f64 {
        4.0 * self.region.sigma
    }

    fn node(&self, space: &Space, t: f64) -> Result<Arc<Node>, MapError> {
        let at = (t, self.region.boundary(t));
        Ok(Arc::new(Node::new(space, at, &self.poles, self.anchor(), self.equal)?))
    }

    fn snapshot(&self) -> Arc<Vec<Arc<Node>>> {
        match self.nodes.read() {
            Ok(nodes) => Arc::clone(&nodes),
            Err(poisoned) => Arc::clone(&poisoned.into_inner()),
        }
    }

    /// Counts the zeros of the region without the known ones (the upper one of each pair).
    ///
    /// # Errors
    /// A response has no eigenvalues.
    pub fn count(&self, point: Point<'_>, known: &[c64]) -> Result<Count, MapError> {
        self.count_with(point, known, LARGEST_TURN)
    }

    fn count_with(&self, point: Point<'_>, known: &[c64], turn: f64) -> Result<Count, MapError> {
        let own = self.poles_of_controllers(point)?;
        // values at the points of the snapshot before
        let mut values: Vec<(f64, c64)> = Vec::new();
        loop {
            let nodes = self.snapshot();
            let mut next = values.into_iter().peekable();
            values = nodes
                .iter()
                .map(|node| {
                    while next.peek().is_some_and(|it| it.0 < node.t) {
                        next.next();
                    }
                    match next.peek() {
                        Some(&(t, value)) if t == node.t => (t, value),
                        _ => (node.t, self.value(node, point, known)),
                    }
                })
                .collect();
            if values.iter().any(|(_, value)| !value.re.is_finite() || value.norm() == 0.0) {
                return Ok(Count::Uncertain);
            }
            let turns: Vec<f64> =
                values.windows(2).map(|pair| (pair[1].1 * pair[0].1.conj()).arg()).collect();
            let wide: Vec<usize> = (0..turns.len()).filter(|&k| turns[k].abs() > turn).collect();
            if wide.is_empty() {
                let sum: f64 = turns.iter().sum::<f64>() / std::f64::consts::PI;
                let whole = sum.round();
                // both ends are real, so the sum is whole but for rounding
                if (sum - whole).abs() > 1e-3 {
                    return Ok(Count::Uncertain);
                }
                return Ok(Count::Unknown(own - whole as i64));
            }
            let between = |k: usize| 0.5 * (values[k].0 + values[k + 1].0);
            let short = |&k: &usize| values[k + 1].0 - values[k].0 < SHORTEST;
            if wide.iter().any(short) || nodes.len() + wide.len() > MOST {
                return Ok(Count::Uncertain);
            }
            let added = wide.iter().map(|&k| self.node(point.space, between(k)));
            self.add(added.collect::<Result<Vec<_>, _>>()?);
        }
    }

    fn add(&self, added: Vec<Arc<Node>>) {
        let mut guard = match self.nodes.write() {
            Ok(guard) => guard,
            Err(poisoned) => poisoned.into_inner(),
        };
        let mut nodes = guard.as_ref().clone();
        nodes.extend(added);
        nodes.sort_by(|a, b| a.t.total_cmp(&b.t));
        nodes.dedup_by(|a, b| a.t == b.t);
        *guard = Arc::new(nodes);
    }

    /// The determinant without the known zeros.
    fn value(&self, node: &Node, point: Point<'_>, known: &[c64]) -> c64 {
        let anchor = self.anchor();
        let mut value = node.determinant(point.space, point.level, point.controllers, anchor);
        let s = node.s;
        for &zero in known {
            let by = s + zero.norm().max(anchor);
            value *= by / (s - zero);
            if zero.im != 0.0 {
                value *= by / (s - zero.conj());
            }
        }
        value / value.l1_norm()
    }

    /// Poles of all ports' controllers in the region.
    fn poles_of_controllers(&self, point: Point<'_>) -> Result<i64, MapError> {
        let count = |k: usize| -> Result<i64, MapError> {
            let a = &point.controllers.get(k).a;
            if a.nrows() == 0 {
                return Ok(0);
            }
            let failed = |_| MapError::Eigenvalues { what: "a controller" };
            let values = a.eigenvalues().map_err(failed)?;
            let inside = values.iter().filter(|it| self.region.contains(**it)).count();
            Ok(i64::try_from(inside).unwrap_or(i64::MAX))
        };
        match point.controllers {
            Controllers::Equal(_, 0) => Ok(0),
            Controllers::Equal(_, ports) => Ok(count(0)? * i64::try_from(*ports).unwrap_or(0)),
            Controllers::Each(all) => (0..all.len()).map(count).sum(),
        }
    }
}
