//! Counting zeros in a region by the argument principle.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

use faer::prelude::c64;

use crate::branch::Point;
use crate::error::MapError;
use crate::gains::Rational;
use crate::node::{Made, Node, Placed, Product, Scratch};
use crate::region::Region;
use crate::space::Space;
use crate::system::Controllers;
use crate::turns::{Sum, turn_between};

/// Largest change of the argument between neighbouring points (rad) of a certified count.
const LARGEST_TURN: f64 = 1.0;
/// The same where the boundary is first divided.
const FIRST_TURN: f64 = 0.5;
/// Length of an interval of the ray at the start, in powers of e, and the number of intervals of the arc.
const FIRST: (f64, u32) = (0.22, 8);
/// Shortest distance of two points, of the ray's length of 1.
const SHORTEST: f64 = 1e-5;
/// Most points.
const MOST: usize = 1500;
/// Responses of two measurements count as proportional up to this part.
const PROPORTIONAL: f64 = 0.01;

/// The points of a boundary. Points that one walk over a map adds are not seen by others, so that results do not depend
/// on their order.
pub(crate) type Line = Arc<Vec<Arc<Placed>>>;

/// The boundary of a region with what is known of the determinant there.
pub struct Contour {
    /// The region.
    pub region: Region,
    line: Line,
    /// Every point computed so far, by its t: what it costs is paid once.
    cache: Mutex<HashMap<u64, Arc<Node>>>,
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
        let equal = matches!(point.controllers, Controllers::Equal(..));
        Self::with(region, equal, point, known)
    }

    /// The same, for controllers that are treated as equal or not.
    pub(crate) fn with(
        region: Region,
        equal: bool,
        point: Point<'_>,
        known: &[c64],
    ) -> Result<Self, MapError> {
        let space = point.space;
        let poles: Vec<c64> = space.modal.poles().filter(|pole| region.contains(*pole)).collect();
        let mut contour =
            Self { region, line: Arc::default(), cache: Mutex::default(), poles, equal };
        let ray = (region.reach() / FIRST.0).ceil().clamp(8.0, 200.0) as u32;
        let times = (0..=ray).map(|k| f64::from(k) / f64::from(ray));
        let arc = FIRST.1;
        let times = times.chain((1..=arc).map(|k| 1.0 + f64::from(k) / f64::from(arc)));
        let times: Vec<f64> = times.collect();
        let mut line = contour.chain(space, &times)?;
        if contour.equal && line.iter().any(|it| it.node.misfit > PROPORTIONAL) {
            // measurements that are not proportional cannot be diagonalised together
            contour.equal = false;
            contour.cache = Mutex::default();
            line = contour.chain(space, &times)?;
        }
        let mut line = Arc::new(line);
        contour.count_with(&mut line, point, known, FIRST_TURN)?;
        contour.line = line;
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
        self.line.iter().map(|it| it.node.misfit).fold(0.0, f64::max)
    }

    /// Number of points of the boundary.
    #[must_use]
    pub fn len(&self) -> usize {
        self.line.len()
    }

    /// Whether the boundary has no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The points as they were divided first.
    pub(crate) fn line(&self) -> Line {
        Arc::clone(&self.line)
    }

    fn anchor(&self) -> f64 {
        4.0 * self.region.sigma
    }

    fn node(&self, space: &Space, t: f64) -> Result<Arc<Node>, MapError> {
        let cache = || self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(node) = cache().get(&t.to_bits()) {
            return Ok(Arc::clone(node));
        }
        let at = (t, self.region.boundary(t));
        let node = Arc::new(Node::new(space, at, &self.poles, self.anchor(), self.equal)?);
        cache().insert(t.to_bits(), Arc::clone(&node));
        Ok(node)
    }

    fn chain(&self, space: &Space, times: &[f64]) -> Result<Vec<Arc<Placed>>, MapError> {
        let mut line: Vec<Arc<Placed>> = Vec::with_capacity(times.len());
        for &t in times {
            let node = self.node(space, t)?;
            line.push(Arc::new(match line.last() {
                Some(last) => Placed::beside(node, last),
                None => Placed::first(node),
            }));
        }
        Ok(line)
    }

    /// Counts the zeros of the region without the known ones (the upper one of each pair).
    ///
    /// # Errors
    /// A response has no eigenvalues.
    pub fn count(&self, point: Point<'_>, known: &[c64]) -> Result<Count, MapError> {
        self.count_on(&mut self.line(), point, known)
    }

    /// The same, with points added to a line where they are needed.
    pub(crate) fn count_on(
        &self,
        line: &mut Line,
        point: Point<'_>,
        known: &[c64],
    ) -> Result<Count, MapError> {
        self.count_with(line, point, known, LARGEST_TURN)
    }

    fn count_with(
        &self,
        line: &mut Line,
        point: Point<'_>,
        known: &[c64],
        turn: f64,
    ) -> Result<Count, MapError> {
        let rational = if self.equal { Rational::new(point.controllers) } else { None };
        let made = self.made(point, rational.as_ref());
        let mut scratch = Scratch::default();
        let mut value =
            |placed: &Arc<Placed>| (placed.node.s, placed.determinant(made, &mut scratch));
        let mut values: Vec<(c64, Product)> = line.iter().map(&mut value).collect();
        let turns = loop {
            let finite = |it: &(c64, Product)| it.1.rest.re.is_finite() && it.1.rest.norm() > 0.0;
            if !values.iter().all(finite) {
                return Ok(Count::Uncertain);
            }
            let pairs = values.windows(2).map(|it| ((it[0].0, &it[0].1), (it[1].0, &it[1].1)));
            let turns: Vec<Option<f64>> =
                pairs.map(|(left, right)| turn_between(left, right, known, turn)).collect();
            let wide: Vec<usize> = (0..turns.len()).filter(|&k| turns[k].is_none()).collect();
            if wide.is_empty() {
                break turns;
            }
            let ends = |k: usize| (line[k].node.t, line[k + 1].node.t);
            let short = |&k: &usize| ends(k).1 - ends(k).0 < SHORTEST;
            if wide.iter().any(short) || line.len() + wide.len() > MOST {
                return Ok(Count::Uncertain);
            }
            let added = wide.iter().map(|&k| {
                let (left, right) = ends(k);
                self.node(point.space, 0.5 * (left + right))
            });
            let (next, changes) = inserted(line, &wide, added.collect::<Result<Vec<_>, _>>()?);
            let mut old = values.into_iter();
            values = Vec::with_capacity(next.len());
            for (placed, change) in next.iter().zip(changes) {
                let earlier = if change == Change::New { None } else { old.next() };
                values.push(match earlier {
                    Some(same) if change == Change::None => same,
                    _ => value(placed),
                });
            }
            *line = Arc::new(next);
        };
        let sum: f64 = turns.iter().flatten().sum::<f64>() / PI;
        let whole = sum.round();
        // both ends are real, so the sum is whole but for rounding
        if (sum - whole).abs() > 1e-3 {
            return Ok(Count::Uncertain);
        }
        let own = match self.poles_by_turns(&values, point) {
            Some(own) => own,
            None => self.poles_of_controllers(point)?,
        };
        let inside = known.iter().filter(|s| self.region.contains(**s));
        let inside: i64 = inside.map(|s| if s.im == 0.0 { 1 } else { 2 }).sum();
        Ok(Count::Unknown(own - whole as i64 - inside))
    }

    fn made<'a>(&self, point: Point<'a>, rational: Option<&'a Rational>) -> Made<'a> {
        Made {
            space: point.space,
            level: point.level,
            controllers: point.controllers,
            rational,
            anchor: self.anchor(),
        }
    }

    /// Where zeros of single factors may be, inside and near the boundary, by the secant through neighbouring nodes. The
    /// least damped first.
    pub(crate) fn candidates(&self, line: &Line, point: Point<'_>) -> Vec<c64> {
        let rational = if self.equal { Rational::new(point.controllers) } else { None };
        let made = self.made(point, rational.as_ref());
        let mut scratch = Scratch::default();
        let mut before: Option<(c64, Vec<c64>)> = None;
        let mut found: Vec<c64> = Vec::new();
        for placed in line.iter() {
            let factors = placed.determinant(made, &mut scratch).factors;
            let here = placed.node.s;
            if let Some((s, earlier)) = &before {
                for (a, b) in earlier.iter().zip(&factors) {
                    let zero = s - a * (here - s) / (b - a);
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
            before = Some((here, factors));
        }
        found.sort_by(|a, b| crate::branch::damping(*a).total_cmp(&crate::branch::damping(*b)));
        found
    }

    /// Poles of all ports' controllers in the region, by the turns of their denominator. None where that is unknown.
    fn poles_by_turns(&self, values: &[(c64, Product)], point: Point<'_>) -> Option<i64> {
        let Controllers::Equal(_, ports) = point.controllers else { return None };
        let mut sum = Sum::new();
        for pair in values.windows(2) {
            let (a, b) = (pair[0].1.denominator?, pair[1].1.denominator?);
            if !sum.add(a, b, (LARGEST_TURN, LARGEST_TURN.tan())) {
                return None;
            }
        }
        let turned = sum.total() / PI;
        let whole = turned.round();
        ((turned - whole).abs() < 1e-3).then(|| whole as i64 * i64::try_from(*ports).unwrap_or(0))
    }

    /// The same, by eigenvalues.
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    None,
    Order,
    New,
}

/// The line with a node after each of these places. The order of the factors continues from node to node.
fn inserted(
    line: &[Arc<Placed>],
    places: &[usize],
    nodes: Vec<Arc<Node>>,
) -> (Vec<Arc<Placed>>, Vec<Change>) {
    let mut all: Vec<Arc<Placed>> = Vec::with_capacity(line.len() + nodes.len());
    let mut changes = Vec::with_capacity(line.len() + nodes.len());
    let mut nodes = places.iter().zip(nodes).peekable();
    for (k, placed) in line.iter().enumerate() {
        let moved = match (all.last(), changes.last()) {
            (Some(last), Some(Change::Order | Change::New)) => {
                let again = Placed::beside(Arc::clone(&placed.node), last);
                (!again.like(placed)).then_some(again)
            }
            _ => None,
        };
        changes.push(if moved.is_some() { Change::Order } else { Change::None });
        all.push(moved.map_or_else(|| Arc::clone(placed), Arc::new));
        if let Some((_, node)) = nodes.next_if(|(place, _)| **place == k)
            && let Some(last) = all.last()
        {
            let new = Placed::beside(node, last);
            all.push(Arc::new(new));
            changes.push(Change::New);
        }
    }
    (all, changes)
}
