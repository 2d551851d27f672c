//! One start of a scenario and the grid of the parameters that need no other start.

use std::sync::Mutex;

use faer::Mat;
use faer::prelude::c64;
use linear::{Lanes, LinearSystem, LinearUnit, Linearised};
use master::Setup;
use master::graph::Graph;
use master::system::VariableIndex;
use scenario::{Override, Scenario};
use stability_map::{
    Attached, Cell, Controller, Controllers, Count, Evidence, Followed, Grid, Ladder, Level, Plant,
    Point, Region, Space, damping, survey,
};

use crate::axis::Axis;
use crate::error::Error;
use crate::model::Model;
use crate::parts::Parts;
use crate::result::{Known, MapCell, ModeKind};
use crate::twin::{Given, Twin, twins};

/// What a parameter enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Enters {
    Controllers,
    Attached,
    /// Another start is needed.
    Plant,
}

/// An axis with what it changes.
#[derive(Debug, Clone)]
pub(crate) struct Varied {
    pub axis: Axis,
    pub changes: Vec<(usize, VariableIndex)>,
    pub enters: Enters,
}

impl Varied {
    pub fn given(&self, unit: usize, value: f64) -> Vec<Given> {
        let mine = self.changes.iter().filter(|(k, _)| *k == unit);
        mine.map(|(_, variable)| (*variable, value)).collect()
    }
}

/// A scenario started with certain values.
pub(crate) struct Scene {
    pub system: LinearSystem,
    pub kinds: Vec<String>,
}

/// The scenario with other values, ready to start.
pub(crate) fn setup(scenario: &Scenario, given: &[(&str, f64)]) -> Result<Setup, Error> {
    let mut scenario = scenario.clone();
    for (target, value) in given {
        scenario
            .overrides
            .push(Override { target: (*target).to_owned(), value: value.to_string() });
    }
    Ok(Setup::new(&scenario)?)
}

impl Scene {
    pub fn start(setup: &Setup) -> Result<Self, Error> {
        let Linearised { system, .. } = Linearised::at_start(setup)?;
        let kinds = setup.system().instances.iter().map(|it| it.unit.clone()).collect();
        Ok(Self { system, kinds })
    }
}

/// Columns and rows of a scene: axes that need no other start, each absent or varied.
#[derive(Clone, Copy)]
pub(crate) struct Plan<'a> {
    pub columns: Option<&'a Varied>,
    pub rows: Option<&'a Varied>,
    /// Column and row nearest to the scenario's own values.
    pub start: (usize, usize),
    pub threads: usize,
}

impl Plan<'_> {
    pub fn size(&self) -> (usize, usize) {
        let count = |it: Option<&Varied>| it.map_or(1, |it| it.axis.values.len());
        (count(self.columns), count(self.rows))
    }

    /// The parameters of a unit at a column and row.
    pub fn given(&self, unit: usize, column: usize, row: usize) -> Vec<Given> {
        let of = |it: Option<&Varied>, k: usize| {
            it.map(|it| it.given(unit, it.axis.values[k])).unwrap_or_default()
        };
        let mut all = of(self.columns, column);
        all.extend(of(self.rows, row));
        all
    }

    fn enters(&self, what: Enters) -> (bool, bool) {
        let is = |it: Option<&Varied>| it.is_some_and(|it| it.enters == what);
        (is(self.columns), is(self.rows))
    }
}

/// Why the reduced computation is not possible, in words; then all eigenvalues are computed at every point.
pub(crate) type Reason = String;

/// A scene in reduced form.
pub(crate) struct Reduced<'a> {
    pub plan: Plan<'a>,
    parts: Parts,
    pub space: Space,
    levels: Vec<Level>,
    controllers: Model,
    shape: Controller,
    ladder: Ladder,
    followed: Followed,
    pub notes: Vec<String>,
}

impl<'a> Reduced<'a> {
    /// Splits a scene and prepares its grid.
    pub fn new(
        setup: &Setup,
        scene: &Scene,
        plan: Plan<'a>,
        below: Option<f64>,
    ) -> Result<Result<Self, Reason>, Error> {
        let below = rate(below);
        let named: Vec<usize> = [plan.columns, plan.rows]
            .into_iter()
            .flatten()
            .flat_map(|it| it.changes.iter().map(|(k, _)| *k))
            .collect();
        let Some(mut parts) = Parts::find(&scene.system, &scene.kinds, &named) else {
            return Ok(Err("no kind of units acts as controllers with one force each".to_owned()));
        };
        let partly = [plan.columns, plan.rows].into_iter().flatten().any(|it| {
            let mine = it.changes.iter().filter(|(k, _)| parts.controllers.contains(k)).count();
            mine > 0 && mine < parts.controllers.len()
        });
        parts.equal &= !partly;
        let plant: Plant = parts.plant(&scene.system)?;
        let mut wanted = parts.controllers.clone();
        if parts.equal {
            wanted.truncate(1);
        }
        let first = wanted.len();
        wanted.extend(parts.attached.iter().map(|(k, _)| *k));
        let twins = twins(setup, &wanted)?;
        let base = parts.attached(&scene.system.units);
        let space = Space::new(&plant, &base, parts.equal)?;
        let (columns, rows) = plan.size();
        let mut notes = Vec::new();
        let Some(levels) = levels(
            &plan,
            &parts,
            &scene.system.units,
            (&twins[first..], &wanted[first..]),
            &space,
        )?
        else {
            return Ok(Err("a parameter changes where the attached unit is loaded".to_owned()));
        };
        let shape = parts.controller(&scene.system.units[parts.controllers[0]]);
        let varies = plan.enters(Enters::Controllers);
        let controllers = Model::new((columns, rows), varies, |column, row| {
            let mut all = Vec::new();
            for (twin, &k) in twins[..first].iter().zip(&wanted) {
                let given = plan.given(k, column, row);
                let unit = if given.is_empty() {
                    scene.system.units[k].clone()
                } else {
                    twin.linear(&given)?
                };
                flatten(&parts.controller(&unit), &mut all);
            }
            Ok(all)
        })?;
        if controllers.is_whole() {
            notes.push("The controllers depend on both parameters in a way that is neither a sum nor a product: they were asked at every point.".to_owned());
        }
        let start = controllers_at(&controllers, &shape, &parts, &space, plan.start);
        let level = &levels[level_index(&plan, plan.start)];
        let point = Point { space: &space, level, controllers: &start };
        let values = space
            .whole(level, &start)?
            .eigenvalues()
            .map_err(|_| stability_map::MapError::Eigenvalues { what: "the whole system" })?;
        let region = region(&values, below);
        let followed = Followed::start(region, point, &values);
        let known = followed.known();
        let ladder = Ladder::new(region, below, point, &known)?;
        let contour = ladder.top();
        let grows = known.iter().any(|s| s.re > 0.0);
        if contour.count(point, &known)? != Count::Unknown(0) && !grows {
            return Ok(Err(
                "the count of modes by the argument principle does not agree with all eigenvalues at the first point"
                    .to_owned(),
            ));
        }
        if !contour.is_diagonal() {
            notes.push(format!(
                "The {} controllers are not equal, or their measurements not proportional: every determinant was factorised.",
                parts.controllers.len()
            ));
        } else if contour.misfit() > 1e-9 {
            notes.push(format!(
                "The count takes the measurements of a controller as proportional to each other; {:.1e} of them is not, of which the larger part is taken into account. Modes are computed without this assumption.",
                contour.misfit()
            ));
        }
        notes.push(format!(
            "Modes up to the least damped one are counted, if its damping ratio is below {:.3}{}, on a boundary of {} points.",
            region.damping,
            if below.is_finite() { " and its frequency below the limit" } else { "" },
            contour.len()
        ));
        Ok(Ok(Self { plan, parts, space, levels, controllers, shape, ladder, followed, notes }))
    }

    /// The attached part and the controllers at a point of the grid, or between two neighbours of a row (or column):
    /// their numbers are interpolated.
    pub fn between(
        &self,
        (column, row): (usize, usize),
        along_x: bool,
        part: f64,
    ) -> (Level, Controllers) {
        let axis = if along_x { self.plan.columns } else { self.plan.rows };
        let values: &[f64] = axis.map_or(&[], |it| &it.axis.values);
        let weights = weights(values, if along_x { column } else { row }, part);
        let place = |k: usize| if along_x { (k, row) } else { (column, k) };
        let sum = |of: &dyn Fn(&Level) -> &Mat<f64>| {
            let level = |k: usize| of(&self.levels[level_index(&self.plan, place(k))]);
            let shape = level(weights[0].0);
            let mut sum = Mat::zeros(shape.nrows(), shape.ncols());
            weights.iter().for_each(|&(k, weight)| sum += weight * level(k));
            sum
        };
        let level =
            Level { a: sum(&|it| &it.a), beta: sum(&|it| &it.beta), gamma: sum(&|it| &it.gamma) };
        let mut numbers: Vec<f64> = Vec::new();
        for &(k, weight) in &weights {
            let (c, r) = place(k);
            let there = self.controllers.at(c, r);
            numbers.resize(there.len(), 0.0);
            numbers.iter_mut().zip(there).for_each(|(sum, x)| *sum += weight * x);
        }
        (level, controllers_of(&numbers, &self.shape, &self.parts, &self.space))
    }

    /// Computes all rows that are not done.
    pub fn survey(
        &self,
        is_done: &(dyn Fn(usize) -> bool + Sync),
        done: &(dyn Fn(usize, Vec<MapCell>) -> Result<(), Error> + Sync),
    ) -> Result<(), Error> {
        let rows = Rows { reduced: self, is_done, done, failure: Mutex::new(None) };
        survey(
            &self.space,
            &self.ladder,
            &rows,
            self.plan.start,
            &self.followed,
            self.plan.threads,
        )?;
        match rows.failure.into_inner() {
            Ok(Some(error)) => Err(error),
            _ => Ok(()),
        }
    }
}

struct Rows<'a> {
    reduced: &'a Reduced<'a>,
    is_done: &'a (dyn Fn(usize) -> bool + Sync),
    done: &'a (dyn Fn(usize, Vec<MapCell>) -> Result<(), Error> + Sync),
    failure: Mutex<Option<Error>>,
}

impl Grid for Rows<'_> {
    fn columns(&self) -> usize {
        self.reduced.plan.size().0
    }

    fn rows(&self) -> usize {
        self.reduced.plan.size().1
    }

    fn level(&self, column: usize, row: usize) -> &Level {
        &self.reduced.levels[level_index(&self.reduced.plan, (column, row))]
    }

    fn controllers(&self, column: usize, row: usize) -> Controllers {
        let Reduced { controllers, shape, parts, space, .. } = self.reduced;
        controllers_at(controllers, shape, parts, space, (column, row))
    }

    fn is_done(&self, row: usize) -> bool {
        (self.is_done)(row)
    }

    fn done(&self, row: usize, cells: Vec<Cell>) -> bool {
        let result = (self.done)(row, cells.iter().map(map_cell).collect());
        let kept = result.is_ok();
        if let (Err(error), Ok(mut failure)) = (result, self.failure.lock()) {
            failure.get_or_insert(error);
        }
        kept
    }
}

fn map_cell(cell: &Cell) -> MapCell {
    let [plant, attached, controllers] = cell.shares;
    let mode = if plant >= attached && plant >= controllers {
        ModeKind::Plant
    } else if attached >= controllers {
        ModeKind::Attached
    } else {
        ModeKind::Controllers
    };
    let evidence = match cell.evidence {
        Evidence::Counted if !cell.inside => Known::Beyond,
        Evidence::Counted => Known::Counted,
        Evidence::Growing => Known::Growing,
        Evidence::Eigenvalues => Known::Eigenvalues,
    };
    of_value(cell.s, cell.growing, mode, evidence)
}

pub(crate) fn of_value(s: c64, growing: usize, mode: ModeKind, evidence: Known) -> MapCell {
    MapCell {
        damping: damping(s),
        frequency_hz: s.norm() / std::f64::consts::TAU,
        real: s.re,
        imaginary: s.im,
        growing,
        mode,
        evidence,
        at: None,
    }
}

fn level_index(plan: &Plan<'_>, (column, row): (usize, usize)) -> usize {
    let (by_column, by_row) = plan.enters(Enters::Attached);
    let width = if by_column { plan.size().0 } else { 1 };
    let c = if by_column { column } else { 0 };
    if by_row { row * width + c } else { c }
}

/// The attached part at every point where it differs. None if it needs another space.
fn levels(
    plan: &Plan<'_>,
    parts: &Parts,
    units: &[LinearUnit],
    (twins, of): (&[Twin<'_>], &[usize]),
    space: &Space,
) -> Result<Option<Vec<Level>>, Error> {
    let (by_column, by_row) = plan.enters(Enters::Attached);
    let size = plan.size();
    let mut units = units.to_vec();
    let mut at = |column: usize, row: usize| -> Result<Attached, Error> {
        for (twin, &k) in twins.iter().zip(of) {
            let given = plan.given(k, column, row);
            if !given.is_empty() {
                units[k] = twin.linear(&given)?;
            }
        }
        Ok(parts.attached(&units))
    };
    let shape = at(0, 0)?;
    let model = Model::new(size, (by_column, by_row), |column, row| {
        let part = at(column, row)?;
        let all = [&part.a, &part.b, &part.c];
        Ok(all.into_iter().flat_map(entries).collect())
    })?;
    let width = if by_column { size.0 } else { 1 };
    let height = if by_row { size.1 } else { 1 };
    let mut levels = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let numbers = model.at(column, row);
            let mut rest = numbers.as_slice();
            let mut next = |like: &Mat<f64>| {
                let (mine, others) = rest.split_at(like.nrows() * like.ncols());
                rest = others;
                Mat::from_fn(like.nrows(), like.ncols(), |i, j| mine[j * like.nrows() + i])
            };
            let part = Attached { a: next(&shape.a), b: next(&shape.b), c: next(&shape.c) };
            let Some(level) = space.level(&part) else { return Ok(None) };
            levels.push(level);
        }
    }
    Ok(Some(levels))
}

fn entries(m: &Mat<f64>) -> Vec<f64> {
    (0..m.ncols()).flat_map(|j| (0..m.nrows()).map(move |i| m[(i, j)])).collect()
}

fn flatten(controller: &Controller, all: &mut Vec<f64>) {
    all.extend(entries(&controller.a));
    all.extend(entries(&controller.b));
    all.extend(&controller.c);
}

fn controllers_at(
    model: &Model,
    shape: &Controller,
    parts: &Parts,
    space: &Space,
    (column, row): (usize, usize),
) -> Controllers {
    controllers_of(&model.at(column, row), shape, parts, space)
}

fn controllers_of(
    numbers: &[f64],
    shape: &Controller,
    parts: &Parts,
    space: &Space,
) -> Controllers {
    let (n, channels) = (shape.a.nrows(), shape.b.ncols());
    let of = |numbers: &[f64]| Controller {
        a: Mat::from_fn(n, n, |i, j| numbers[j * n + i]),
        b: Mat::from_fn(n, channels, |i, j| numbers[n * n + j * n + i]),
        c: numbers[n * n + n * channels..].to_vec(),
        d: shape.d.clone(),
    };
    if parts.equal {
        return space.controllers(&Controllers::Equal(of(numbers), parts.controllers.len()));
    }
    Controllers::Each(numbers.chunks(n * n + n * channels + n).map(of).collect())
}

/// Weights of the nearest values, up to five, for a place between value k and the next one (Lagrange).
fn weights(values: &[f64], k: usize, part: f64) -> Vec<(usize, f64)> {
    let n = values.len();
    if n < 2 || k + 1 >= n {
        return vec![(k, 1.0)];
    }
    let first = k.saturating_sub(2).min(n.saturating_sub(5));
    let nodes: Vec<usize> = (first..n.min(first + 5)).collect();
    let x = values[k] + part * (values[k + 1] - values[k]);
    let weight = |i: usize| -> f64 {
        let others = nodes.iter().filter(|&&j| j != i);
        others.map(|&j| (x - values[j]) / (values[i] - values[j])).product()
    };
    nodes.iter().map(|&i| (i, weight(i))).collect()
}

/// A frequency limit (Hz) in rad/s.
fn rate(below: Option<f64>) -> f64 {
    below.map_or(f64::INFINITY, |hz| hz * std::f64::consts::TAU)
}

/// The region to count in: its rays in the widest gap between the modes, with at least one mode inside.
fn region(values: &[c64], below: f64) -> Region {
    let sizes = || values.iter().map(|s| s.norm()).filter(|it| *it > 1e-3);
    let slowest = sizes().fold(f64::INFINITY, f64::min);
    let fastest = sizes().fold(1.0, f64::max);
    let sigma = if slowest.is_finite() { (0.05 * slowest).min(0.2) } else { 0.1 };
    // the rays start at −σ
    let slope = |s: &c64| (-s.re - sigma) / s.im;
    let mut slopes: Vec<f64> =
        values.iter().filter(|s| s.im > 1e-6 * s.norm() && s.norm() <= below).map(slope).collect();
    slopes.sort_by(f64::total_cmp);
    let least = slopes.first().copied().unwrap_or(0.1).max(0.02);
    let (low, high) = (1.1 * least, (3.0 * least).clamp(0.08, 0.5));
    let mut ends = vec![low.min(high)];
    ends.extend(slopes.iter().copied().filter(|it| *it > low && *it < high));
    ends.push(high.max(low));
    let gap = |pair: &&[f64]| pair[1] / pair[0];
    let widest = ends.windows(2).max_by(|a, b| gap(a).total_cmp(&gap(b)));
    let slope = widest.map_or(0.05, |pair| (pair[0] * pair[1]).sqrt());
    // modes above the limit are not shown, so they need not be counted; a gap above it for the arc
    let mut above = vec![1.1 * below];
    above.extend(sizes().filter(|it| *it > 1.1 * below && *it < 1.6 * below));
    above.push(1.6 * below);
    above.sort_by(f64::total_cmp);
    let widest = above.windows(2).max_by(|a, b| gap(a).total_cmp(&gap(b)));
    let limit = widest.map_or(f64::INFINITY, |pair| (pair[0] * pair[1]).sqrt());
    let radius = if below.is_finite() { limit.min(100.0 * fastest) } else { 100.0 * fastest };
    Region { sigma, damping: slope / slope.hypot(1.0), radius }
}

/// All eigenvalues of the states that are in a loop with another unit, as a cell.
pub(crate) fn by_eigenvalues(
    system: &LinearSystem,
    below: Option<f64>,
) -> Result<(MapCell, Vec<c64>), Error> {
    let below = rate(below);
    let matrix = system.matrix()?;
    let owners: Vec<usize> =
        system.units.iter().enumerate().flat_map(|(k, unit)| vec![k; unit.states.len()]).collect();
    let n = owners.len();
    let mut graph = Graph::new(n);
    for i in 0..n {
        for j in 0..n {
            if matrix[(i, j)] != 0.0 {
                graph.edge(j, i);
            }
        }
    }
    let shared =
        |component: &Vec<usize>| component.iter().any(|&k| owners[k] != owners[component[0]]);
    let mut kept: Vec<usize> = graph.components().into_iter().filter(shared).flatten().collect();
    if kept.is_empty() {
        kept = (0..n).collect();
    }
    let small = Mat::from_fn(kept.len(), kept.len(), |i, j| matrix[(kept[i], kept[j])]);
    let values = Lanes::of(system).within(&kept).eigenvalues(&small)?;
    let upper = || values.iter().filter(|s| s.im >= 0.0 && s.norm() > 0.0 && s.norm() <= below);
    let least = upper().min_by(|a, b| damping(**a).total_cmp(&damping(**b))).copied();
    let s = least.unwrap_or(c64::new(-1.0, 0.0));
    let growing = upper().filter(|s| s.re > 0.0).count();
    Ok((of_value(s, growing, ModeKind::Unknown, Known::Eigenvalues), values))
}

/// The system at each point, with units replaced by their twins'. `frozen`: what units pass on without states is that of
/// the start, as in the reduced computation.
pub(crate) fn system_at(
    setup: &Setup,
    scene: &Scene,
    plan: &Plan<'_>,
    points: &[(usize, usize)],
    frozen: bool,
    mut each: impl FnMut((usize, usize), &LinearSystem) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut changed: Vec<usize> = [plan.columns, plan.rows]
        .into_iter()
        .flatten()
        .flat_map(|it| it.changes.iter().map(|(k, _)| *k))
        .collect();
    changed.sort_unstable();
    changed.dedup();
    let twins = twins(setup, &changed)?;
    let mut system = scene.system.clone();
    for &(column, row) in points {
        for (twin, &k) in twins.iter().zip(&changed) {
            let mut unit = twin.linear(&plan.given(k, column, row))?;
            if frozen {
                unit.d.clone_from(&scene.system.units[k].d);
            }
            system.units[k] = unit;
        }
        each((column, row), &system)?;
    }
    Ok(())
}
