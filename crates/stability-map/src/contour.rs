//! Counting zeros in a region by the argument principle.

use std::f64::consts::PI;
use std::sync::{Arc, RwLock};

use faer::prelude::c64;

use crate::branch::Point;
use crate::error::MapError;
use crate::gains::Rational;
use crate::node::{Node, nearest_pairs};
use crate::region::Region;
use crate::space::Space;
use crate::system::Controllers;

/// Largest change of the argument between neighbouring points (rad) of a certified count.
const LARGEST_TURN: f64 = 1.0;
/// The same where the boundary is first divided.
const FIRST_TURN: f64 = 0.5;
/// Points of the ray and of the arc at the start.
const FIRST: (u32, u32) = (64, 8);
/// Shortest distance of two points, of the ray's length of 1.
const SHORTEST: f64 = 1e-5;
/// Most points.
const MOST: usize = 1500;
/// Responses of two measurements count as proportional up to this part.
const PROPORTIONAL: f64 = 0.01;

/// The boundary of a region with what is known of the determinant there.
pub struct Contour {
    /// The region.
    pub region: Region,
    /// Modes above this frequency |s| (rad/s) are counted and followed, but not looked at for the least damping.
    pub below: f64,
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
        let mut contour = Self {
            region,
            below: f64::INFINITY,
            nodes: RwLock::new(Arc::new(Vec::new())),
            poles,
            equal,
        };
        let (ray, arc) = FIRST;
        let times = (0..=ray).map(|k| f64::from(k) / f64::from(ray));
        let times = times.chain((1..=arc).map(|k| 1.0 + f64::from(k) / f64::from(arc)));
        let times: Vec<f64> = times.collect();
        let mut nodes = contour.chain(space, &times)?;
        if contour.equal && nodes.iter().any(|node| node.misfit > PROPORTIONAL) {
            // measurements that are not proportional cannot be diagonalised together
            contour.equal = false;
            nodes = contour.chain(space, &times)?;
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

    fn node(
        &self,
        space: &Space,
        t: f64,
        neighbour: Option<&Arc<Node>>,
    ) -> Result<Arc<Node>, MapError> {
        let at = (t, self.region.boundary(t));
        let mut node = Node::new(space, at, &self.poles, self.anchor(), self.equal)?;
        if let Some(neighbour) = neighbour {
            node.follow(neighbour);
        }
        Ok(Arc::new(node))
    }

    fn chain(&self, space: &Space, times: &[f64]) -> Result<Vec<Arc<Node>>, MapError> {
        let mut nodes: Vec<Arc<Node>> = Vec::with_capacity(times.len());
        for &t in times {
            nodes.push(self.node(space, t, nodes.last())?);
        }
        Ok(nodes)
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
        let rational = if self.equal { Rational::new(point.controllers) } else { None };
        let mut values: Vec<Value> = Vec::new();
        loop {
            let nodes = self.snapshot();
            let mut before = std::mem::take(&mut values).into_iter().peekable();
            for node in nodes.iter() {
                // what earlier rounds have computed is kept
                while before.peek().is_some_and(|it| it.node.t < node.t) {
                    before.next();
                }
                match before.next_if(|it| Arc::ptr_eq(&it.node, node)) {
                    Some(value) => values.push(value),
                    None => {
                        let mut factors = Vec::with_capacity(node.factors());
                        let both = (point.controllers, rational.as_ref());
                        let (space, level) = (point.space, point.level);
                        let rest =
                            node.determinant(space, level, both, self.anchor(), &mut factors);
                        values.push(Value { node: Arc::clone(node), factors, rest });
                    }
                }
            }
            let finite = |it: &Value| it.rest.re.is_finite() && it.rest.norm() > 0.0;
            if !values.iter().all(finite) {
                return Ok(Count::Uncertain);
            }
            let turns: Vec<Option<f64>> = values
                .windows(2)
                .map(|pair| turn_between(&pair[0], &pair[1], known, turn))
                .collect();
            let wide: Vec<usize> = (0..turns.len()).filter(|&k| turns[k].is_none()).collect();
            if wide.is_empty() {
                let sum: f64 = turns.iter().flatten().sum::<f64>() / PI;
                let whole = sum.round();
                // both ends are real, so the sum is whole but for rounding
                if (sum - whole).abs() > 1e-3 {
                    return Ok(Count::Uncertain);
                }
                let inside = known.iter().filter(|s| self.region.contains(**s));
                let inside: i64 = inside.map(|s| if s.im == 0.0 { 1 } else { 2 }).sum();
                return Ok(Count::Unknown(own - whole as i64 - inside));
            }
            let ends = |k: usize| (&values[k].node, &values[k + 1].node);
            let short = |&k: &usize| ends(k).1.t - ends(k).0.t < SHORTEST;
            if wide.iter().any(short) || nodes.len() + wide.len() > MOST {
                return Ok(Count::Uncertain);
            }
            let added = wide.iter().map(|&k| {
                let (left, right) = ends(k);
                self.node(point.space, 0.5 * (left.t + right.t), Some(left))
            });
            self.add(added.collect::<Result<Vec<_>, _>>()?);
        }
    }

    /// Where zeros of single factors may be, inside and near the boundary, by the secant through neighbouring nodes. The
    /// least damped first.
    pub(crate) fn candidates(&self, point: Point<'_>) -> Vec<c64> {
        let rational = if self.equal { Rational::new(point.controllers) } else { None };
        let nodes = self.snapshot();
        let both = (point.controllers, rational.as_ref());
        let mut before: Option<(c64, Vec<c64>)> = None;
        let mut found: Vec<c64> = Vec::new();
        for node in nodes.iter() {
            let mut factors = Vec::with_capacity(node.factors());
            node.determinant(point.space, point.level, both, self.anchor(), &mut factors);
            if let Some((s, earlier)) = &before {
                for (a, b) in earlier.iter().zip(&factors) {
                    let zero = s - a * (node.s - s) / (b - a);
                    let reach = 0.3 * s.norm().max(8.0 * self.region.sigma);
                    let upper = if zero.im < 0.0 { zero.conj() } else { zero };
                    let fresh = |it: &c64| (it - upper).norm() > 1e-2 * upper.norm();
                    if (zero - s).norm() < reach
                        && self.region.contains(upper)
                        && found.iter().all(fresh)
                    {
                        found.push(upper);
                    }
                }
            }
            before = Some((node.s, factors));
        }
        found.sort_by(|a, b| crate::branch::damping(*a).total_cmp(&crate::branch::damping(*b)));
        found
    }

    fn add(&self, added: Vec<Arc<Node>>) {
        let mut guard = match self.nodes.write() {
            Ok(guard) => guard,
            Err(poisoned) => poisoned.into_inner(),
        };
        let mut nodes = guard.as_ref().clone();
        let new: Vec<f64> = added.iter().map(|node| node.t).collect();
        nodes.extend(added);
        nodes.sort_by(|a, b| a.t.total_cmp(&b.t));
        nodes.dedup_by(|a, b| a.t == b.t);
        // the order of the factors continues from node to node
        let mut changed = false;
        for k in 1..nodes.len() {
            if !changed && !new.contains(&nodes[k].t) && !new.contains(&nodes[k - 1].t) {
                continue;
            }
            let mut node = nodes[k].as_ref().clone();
            changed = node.follow(&nodes[k - 1]);
            if changed {
                nodes[k] = Arc::new(node);
            }
        }
        *guard = Arc::new(nodes);
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

/// The determinant at a node, as a product.
struct Value {
    node: Arc<Node>,
    factors: Vec<c64>,
    rest: c64,
}

/// Distance of two points, as a fraction, below which a factor's turn may be due to a known zero alone.
const NEAR: f64 = 0.005;
/// What such a factor may turn besides (rad).
const REST: f64 = 0.4;
/// Factors whose arguments are added at once: together below π.
const GROUP: usize = 5;

/// Change of the determinant's argument between neighbouring nodes: the sum over its factors, each of which must turn by
/// less than `limit`, or by less than that beside a known zero. None if one turns further.
fn turn_between(left: &Value, right: &Value, known: &[c64], limit: f64) -> Option<f64> {
    let (steep, mut sum) = (0.54_f64.min(limit).tan(), 0.0);
    let (mut product, mut grouped) = (c64::new(1.0, 0.0), 0);
    let mut wide: Vec<(c64, c64)> = Vec::new();
    for (a, b) in left.factors.iter().zip(&right.factors) {
        let ratio = b * a.conj();
        if ratio.re > 0.0 && ratio.im.abs() < steep * ratio.re {
            product *= ratio / ratio.re;
            grouped += 1;
            if grouped == GROUP {
                sum += product.arg();
                (product, grouped) = (c64::new(1.0, 0.0), 0);
            }
        } else {
            wide.push((*a, *b));
        }
    }
    sum += product.arg();
    let wide = matched(wide);
    let rest = right.rest * left.rest.conj();
    if rest.arg().abs() < limit && wide.is_empty() {
        return Some(sum + rest.arg());
    }
    // turns about known zeros, which have no ambiguity; only between points so near that nothing else turns far there
    let (s, next) = (left.node.s, right.node.s);
    if (next - s).norm() > NEAR * s.norm() {
        return None;
    }
    let about = |zero: c64| (next - zero) / (s - zero);
    let all = known.iter().flat_map(|&zero| {
        let pair = zero.im != 0.0;
        [Some(zero), pair.then(|| zero.conj())].into_iter().flatten()
    });
    let mut near: Vec<c64> = all.map(about).filter(|ratio| ratio.arg().abs() > 0.2).collect();
    for ratio in wide {
        if ratio.arg().abs() < limit {
            sum += ratio.arg();
            continue;
        }
        let turn = |k: usize| (ratio / near[k]).arg();
        let best = (0..near.len()).min_by(|&i, &j| turn(i).abs().total_cmp(&turn(j).abs()));
        match best {
            Some(k) if turn(k).abs() < REST => {
                sum += turn(k) + near[k].arg();
                near.swap_remove(k);
            }
            _ => return None,
        }
    }
    if rest.arg().abs() < limit {
        return Some(sum + rest.arg());
    }
    let zeros: c64 = near.iter().map(|ratio| ratio / ratio.norm()).product();
    let turn = (rest / zeros).arg();
    (turn.abs() < REST).then(|| sum + turn + near.iter().map(|ratio| ratio.arg()).sum::<f64>())
}

/// Ratios of factors whose order is unclear, as eigenvalues have crossed: each with the nearest.
fn matched(wide: Vec<(c64, c64)>) -> Vec<c64> {
    let (left, right): (Vec<c64>, Vec<c64>) = wide.into_iter().unzip();
    nearest_pairs(&left, &right).into_iter().map(|(i, k)| right[k] * left[i].conj()).collect()
}
