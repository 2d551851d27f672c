//! Random points of a map against all eigenvalues of the whole system.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use linear::LinearSystem;
use master::Setup;
use scenario::Scenario;

use crate::error::Error;
use crate::result::{BoundaryPoint, Check, MapCell};
use crate::run::{Axes, Request, SceneIndex};
use crate::scene::{Enters, Plan, Scene, Varied, by_eigenvalues, setup, system_at};

/// Points at which the system is also started anew.
const RESTARTS: usize = 3;
/// Points that are checked where an axis starts the system anew.
const STARTED: usize = 5;
/// Points of the boundary that are checked.
const ON_BOUNDARY: usize = 6;

/// What a map is checked against.
pub(crate) struct Checked<'a> {
    pub axes: &'a Axes,
    pub scenario: &'a Scenario,
    pub base: &'a Setup,
    pub scene: &'a Scene,
    pub request: &'a Request,
}

impl Checked<'_> {
    /// Random points with all eigenvalues of the whole system; a few of them with a new start.
    pub fn points(&self, cells: &[Vec<MapCell>]) -> Result<Vec<Check>, Error> {
        let (nx, ny) = self.axes.size();
        let mut random = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = |n: usize| {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) as usize % n.max(1)
        };
        let simple = self.axes.scenes().len() == 1;
        let count = if simple { self.request.checks } else { self.request.checks.min(STARTED) };
        let points: Vec<(usize, usize)> = (0..count).map(|_| (next(nx), next(ny))).collect();
        let mut systems: Vec<LinearSystem> = Vec::new();
        if simple {
            let plan = self.axes.plan(&SceneIndex::default(), 1);
            system_at(self.base, self.scene, &plan, &points, true, |_, system| {
                systems.push(system.clone());
                Ok(())
            })?;
        }
        let restarts = if simple { RESTARTS.min(points.len()) } else { 0 };
        let below = self.request.below;
        // the restarts first, which take longest
        let found = in_parallel(self.request.threads, restarts + points.len(), |k| {
            if k < restarts {
                let fresh = Scene::start(&setup(self.scenario, &self.given(points[k]))?)?;
                return by_eigenvalues(&fresh.system, below);
            }
            let k = k - restarts;
            match systems.get(k) {
                Some(system) => by_eigenvalues(system, below),
                None => self.started(points[k], cells),
            }
        })?;
        let mut checks = Vec::with_capacity(points.len());
        for (k, &(column, row)) in points.iter().enumerate() {
            let (least, values) = &found[restarts + k];
            let cell = &cells[row][column];
            let s = faer::prelude::c64::new(cell.real, cell.imaginary);
            let away = |v: &faer::prelude::c64| (v - s).norm();
            checks.push(Check {
                x: self.axes.x.axis.values[column],
                y: self.axes.y.as_ref().map(|it| it.axis.values[row]),
                distance: values.iter().map(away).fold(f64::INFINITY, f64::min)
                    / s.norm().max(1e-9),
                growing: least.growing,
                mapped: cell.growing,
                restarted: (k < restarts).then(|| found[k].0.damping),
            });
        }
        Ok(checks)
    }

    fn given(&self, (column, row): (usize, usize)) -> Vec<(&str, f64)> {
        let mut given = vec![(self.axes.x.axis.target.as_str(), self.axes.x.axis.values[column])];
        given.extend(self.axes.y.as_ref().map(|it| (it.axis.target.as_str(), it.axis.values[row])));
        given
    }

    /// All eigenvalues at a point of a map with several starts: its own start once more, and the other parameters
    /// changed in it.
    fn started(
        &self,
        (column, row): (usize, usize),
        cells: &[Vec<MapCell>],
    ) -> Result<(MapCell, Vec<faer::prelude::c64>), Error> {
        let anew = |it: Option<&Varied>| it.is_some_and(|it| it.enters == Enters::Plant);
        let over = cells[row][column].at;
        let of = self.axes.over.as_ref().zip(over);
        let index = SceneIndex {
            column: anew(Some(&self.axes.x)).then_some(column),
            row: anew(self.axes.y.as_ref()).then_some(row),
            over: of.and_then(|(it, at)| it.axis.values.iter().position(|v| *v == at)),
        };
        let other = setup(self.scenario, &self.axes.given(&index))?;
        let scene = Scene::start(&other)?;
        let plan = self.axes.plan(&index, 1);
        let place = (
            if index.column.is_some() { 0 } else { column },
            if index.row.is_some() { 0 } else { row },
        );
        let mut found = None;
        system_at(&other, &scene, &plan, &[place], true, |_, system| {
            found = Some(by_eigenvalues(system, self.request.below)?);
            Ok(())
        })?;
        match found {
            Some(found) => Ok(found),
            None => by_eigenvalues(&scene.system, self.request.below),
        }
    }

    /// A few points of the boundary, with the units asked again at exactly these values.
    pub fn boundary(&self, boundary: &mut [BoundaryPoint]) -> Result<(), Error> {
        let n = boundary.len();
        let count = n.min(ON_BOUNDARY).min(self.request.checks);
        let chosen: Vec<usize> = (0..count).map(|k| (2 * k + 1) * n / (2 * count)).collect();
        let along = |of: &Varied, value: &dyn Fn(&BoundaryPoint) -> f64| {
            let mut varied = of.clone();
            varied.axis.values = chosen.iter().map(|&k| value(&boundary[k])).collect();
            varied
        };
        let x = along(&self.axes.x, &|it| it.x);
        let y = self.axes.y.as_ref().map(|of| along(of, &|it| it.y.unwrap_or_default()));
        let plan = Plan { columns: Some(&x), rows: y.as_ref(), start: (0, 0), threads: 1 };
        let places: Vec<(usize, usize)> =
            (0..count).map(|k| (k, if y.is_some() { k } else { 0 })).collect();
        let mut systems: Vec<LinearSystem> = Vec::new();
        system_at(self.base, self.scene, &plan, &places, true, |_, system| {
            systems.push(system.clone());
            Ok(())
        })?;
        let found = in_parallel(self.request.threads, systems.len(), |k| {
            by_eigenvalues(&systems[k], self.request.below)
        })?;
        for (&k, (_, values)) in chosen.iter().zip(&found) {
            let omega = boundary[k].frequency_hz * std::f64::consts::TAU;
            let s = faer::prelude::c64::new(0.0, omega);
            let nearest = values.iter().map(|v| (v - s).norm()).fold(f64::INFINITY, f64::min);
            boundary[k].distance = Some(nearest / omega.max(1e-9));
        }
        Ok(())
    }
}

/// The results of so many tasks, in their order.
pub(crate) fn in_parallel<T: Send>(
    threads: usize,
    tasks: usize,
    work: impl Fn(usize) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let next = AtomicUsize::new(0);
    let found: Mutex<Vec<(usize, Result<T, Error>)>> = Mutex::new(Vec::with_capacity(tasks));
    let run = || {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= tasks {
                return;
            }
            let result = work(k);
            if let Ok(mut found) = found.lock() {
                found.push((k, result));
            }
        }
    };
    if threads <= 1 || tasks <= 1 {
        run();
    } else {
        std::thread::scope(|scope| {
            (0..threads.min(tasks)).for_each(|_| {
                scope.spawn(run);
            });
        });
    }
    let mut found = match found.into_inner() {
        Ok(found) => found,
        Err(poisoned) => poisoned.into_inner(),
    };
    found.sort_by_key(|it| it.0);
    found.into_iter().map(|it| it.1).collect()
}
