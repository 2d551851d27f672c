//! Computes a map.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use fmi2_import::description::Value;
use master::Setup;
use scenario::Scenario;

use crate::axis::Axis;
use crate::boundary::boundary;
use crate::check::Checked;
use crate::error::Error;
use crate::journal::Journal;
use crate::parts::Parts;
use crate::result::{BoundaryPoint, Known, MapAxis, MapCell, StabilityMap};
use crate::scene::{Enters, Plan, Reduced, Scene, Varied, by_eigenvalues, setup, system_at};
use crate::twin::{changed, twins};

/// Relative change of the feedthrough of controllers up to which it is due to their operating point, and left out.
const UNCHANGED: f64 = 0.01;

/// What to map.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scenario, with all `--set`.
    pub scenario: Scenario,
    /// Columns.
    pub x: Axis,
    /// Rows.
    pub y: Option<Axis>,
    /// A parameter over which the worst is taken.
    pub over: Option<Axis>,
    /// Only modes up to this frequency (Hz) are shown.
    pub below: Option<f64>,
    /// Threads of the survey.
    pub threads: usize,
    /// Random points that are compared with all eigenvalues.
    pub checks: usize,
}

/// Hears of the progress.
pub trait Watch: Sync {
    /// What is being done now.
    fn stage(&self, text: &str);
    /// So many of all points are known.
    fn progress(&self, done: usize, all: usize);
}

/// Computes a map. With a folder, finished rows are kept there until all are: an interrupted map continues.
///
/// # Errors
/// The scenario does not start, a unit does not report its linearisation or refuses a value, or a file cannot be
/// written.
pub fn map(
    request: &Request,
    folder: Option<&Path>,
    watch: &dyn Watch,
) -> Result<StabilityMap, Error> {
    let begin = Instant::now();
    watch.stage("starting the scenario");
    let mut scenario = request.scenario.clone();
    // nothing runs, so the step need not divide the scenario's time
    scenario.experiment.stop = scenario.experiment.start + scenario.experiment.step;
    scenario.record.interval = None;
    scenario.checkpoint = None;
    let base = setup(&scenario, &[])?;
    let scene = Scene::start(&base)?;
    let mut axes = Axes::new(&scenario, &base, request)?;
    axes.place(&base, &scene)?;
    let task = task(request);
    let journal = folder.map(|folder| Journal::open(folder, &task)).transpose()?;
    let scenes = axes.scenes();
    let (nx, ny) = axes.size();
    let all = nx * ny * scenes.iter().map(|it| it.over).collect::<HashSet<_>>().len();
    let state = Mutex::new(Collected { done: 0, cells: vec![vec![None; nx]; ny] });
    let mut notes = axes.notes();
    if let Some(below) = request.below {
        notes.push(format!("Only modes up to {below} Hz are shown."));
    }
    let surveyed = Instant::now();
    let mut crossings: Vec<BoundaryPoint> = Vec::new();
    for (number, it) in scenes.iter().enumerate() {
        let plan = axes.plan(it, request.threads);
        let (columns, rows) = plan.size();
        let take = |row: usize, cells: Vec<MapCell>| {
            if let Ok(mut state) = state.lock() {
                state.take(it, row, cells, axes.over_value(it));
                watch.progress(state.done, all);
            }
        };
        let mut done: HashSet<usize> = HashSet::new();
        for (of, row, cells) in journal.iter().flat_map(|journal| &journal.done) {
            if *of == number && *row < rows && cells.len() == columns && done.insert(*row) {
                take(*row, cells.clone());
            }
        }
        // the boundary is refined also if all rows are there
        if done.len() == rows && scenes.len() > 1 {
            continue;
        }
        let finished = |row: usize, cells: Vec<MapCell>| -> Result<(), Error> {
            if let Some(journal) = &journal {
                journal.add(number, row, &cells)?;
            }
            take(row, cells);
            Ok(())
        };
        let given = axes.given(it);
        let fresh;
        let other;
        let (setup_here, scene_here) = if given.is_empty() {
            (&base, &scene)
        } else {
            other = setup(&scenario, &given)?;
            fresh = Scene::start(&other)?;
            (&other, &fresh)
        };
        let reduced = if columns * rows > 1 {
            watch.stage("linearising the units");
            Reduced::new(setup_here, scene_here, plan, request.below)?
        } else {
            Err("each point needs a start of its own".to_owned())
        };
        match reduced {
            Ok(reduced) => {
                watch.stage("following and counting the modes");
                reduced.survey(&|row| done.contains(&row), &finished)?;
                if scenes.len() == 1 {
                    watch.stage("refining the boundary");
                    let cells = state.lock().map(|it| it.so_far()).unwrap_or_default();
                    crossings = axes.placed(boundary(&reduced, &cells));
                }
                if number == 0 {
                    notes.extend(reduced.notes.iter().cloned());
                }
            }
            Err(reason) => {
                watch.stage("computing all eigenvalues at every point");
                let (begin, mut computed) = (Instant::now(), 0_u32);
                let each = |computed: u32| begin.elapsed().as_secs_f64() / f64::from(computed);
                for row in (0..rows).filter(|row| !done.contains(row)) {
                    let points: Vec<(usize, usize)> = (0..columns).map(|c| (c, row)).collect();
                    let mut cells = Vec::new();
                    system_at(setup_here, scene_here, &plan, &points, false, |_, system| {
                        cells.push(by_eigenvalues(system, request.below)?.0);
                        computed += 1;
                        if computed == 1 {
                            watch.stage(&format!(
                                "computing all eigenvalues at every point, {:.2} s each",
                                each(computed)
                            ));
                        }
                        Ok(())
                    })?;
                    finished(row, cells)?;
                }
                if number == 0 {
                    let cost = match computed {
                        0 => String::new(),
                        some => format!(" That took {:.2} s a point.", each(some)),
                    };
                    notes.push(format!(
                        "All eigenvalues were computed at every point: {reason}.{cost}"
                    ));
                }
            }
        }
    }
    let survey = surveyed.elapsed().as_secs_f64();
    let cells = match state.into_inner() {
        Ok(state) => state.whole(),
        Err(poisoned) => poisoned.into_inner().whole(),
    };
    watch.stage("comparing with all eigenvalues at random points");
    let checked = Checked { axes: &axes, scenario: &scenario, base: &base, scene: &scene, request };
    let checks = checked.points(&cells)?;
    checked.boundary(&mut crossings)?;
    notes.extend(evidence(&cells));
    notes.extend(of_boundary(&crossings));
    let map = StabilityMap {
        title: scenario.title.clone(),
        x: axes.shown(&base, 0),
        y: request.y.as_ref().map(|_| axes.shown(&base, 1)),
        over: request.over.as_ref().map(|_| axes.shown(&base, 2)),
        notes,
        kinds: axes.kinds.clone(),
        checks,
        boundary: crossings,
        seconds: [survey, begin.elapsed().as_secs_f64()],
        cells,
    };
    if let Some(journal) = journal {
        journal.remove();
    }
    Ok(map)
}

/// How the points are known, in words.
fn evidence(cells: &[Vec<MapCell>]) -> Vec<String> {
    let count = |known: Known| cells.iter().flatten().filter(|it| it.evidence == known).count();
    let mut notes = Vec::new();
    let (growing, all) = (count(Known::Growing), count(Known::Eigenvalues));
    if growing > 0 {
        notes.push(format!(
            "At {growing} points a mode grows for certain, but not all growing modes were identified: another may grow faster."
        ));
    }
    let beyond = count(Known::Beyond);
    if beyond > 0 {
        notes.push(format!(
            "At {beyond} points no mode is in the region of the count: the damping shown is that of the least damped mode that is followed, and all others are damped more than the region's limit."
        ));
    }
    if all > 0 && all < cells.iter().map(Vec::len).sum() {
        notes.push(format!(
            "At {all} points the count was uncertain or a mode was missing: all eigenvalues of the reduced system were computed there."
        ));
    }
    notes
}

fn of_boundary(boundary: &[BoundaryPoint]) -> Option<String> {
    let checked: Vec<f64> = boundary.iter().filter_map(|it| it.distance).collect();
    let worst = checked.iter().copied().fold(0.0, f64::max);
    let places = boundary.len();
    let refined = format!(
        "The stability boundary was refined at {places} places between points (a mode with Re λ = 0)"
    );
    match (places, checked.len()) {
        (0, _) => None,
        (_, 0) => Some(format!("{refined}.")),
        (_, count) => Some(format!(
            "{refined}; {count} of them lie within {worst:.1e} of an eigenvalue of the whole system."
        )),
    }
}

/// The map's inputs in one line, by which its journal is recognised.
fn task(request: &Request) -> String {
    let text = serde_json::to_string(&request.scenario).unwrap_or_default();
    let overrides: Vec<String> =
        request.scenario.overrides.iter().map(ToString::to_string).collect();
    let axis = |it: &Axis| (it.target.clone(), it.values.clone());
    let axes: Vec<(String, Vec<f64>)> =
        [Some(&request.x), request.y.as_ref(), request.over.as_ref()]
            .into_iter()
            .flatten()
            .map(axis)
            .collect();
    serde_json::to_string(&(text, overrides, axes, request.below)).unwrap_or_default()
}

struct Collected {
    done: usize,
    cells: Vec<Vec<Option<MapCell>>>,
}

impl Collected {
    /// Takes a row of a scene; of several scenes the worst.
    fn take(&mut self, scene: &SceneIndex, row: usize, cells: Vec<MapCell>, over: Option<f64>) {
        self.done += cells.len();
        for (column, mut cell) in cells.into_iter().enumerate() {
            cell.at = over;
            let place = &mut self.cells[scene.row.unwrap_or(row)][scene.column.unwrap_or(column)];
            if place.as_ref().is_none_or(|other| cell.damping < other.damping) {
                *place = Some(cell);
            }
        }
    }

    fn so_far(&self) -> Vec<Vec<MapCell>> {
        self.cells.iter().map(|row| row.iter().flatten().cloned().collect()).collect()
    }

    fn whole(self) -> Vec<Vec<MapCell>> {
        self.cells.into_iter().map(|row| row.into_iter().flatten().collect()).collect()
    }
}

/// One start: fixed column, row and value of `over`, where these need one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SceneIndex {
    pub column: Option<usize>,
    pub row: Option<usize>,
    pub over: Option<usize>,
}

pub(crate) struct Axes {
    pub x: Varied,
    pub y: Option<Varied>,
    pub over: Option<Varied>,
    /// Names of the three parts.
    kinds: [String; 3],
    start: (usize, usize),
}

impl Axes {
    fn new(scenario: &Scenario, base: &Setup, request: &Request) -> Result<Self, Error> {
        let varied = |axis: &Axis| -> Result<Varied, Error> {
            let value = axis.values.first().copied().unwrap_or_default();
            // a value that is not the scenario's, so that the change shows
            let value = if axis.values.len() > 1 && current(base, axis) == Some(value) {
                axis.values[1]
            } else {
                value
            };
            let other = setup(scenario, &[(&axis.target, value)])?;
            let changes = changed(base, &other, &axis.target)?;
            let enters = if changes.is_some() { Enters::Attached } else { Enters::Plant };
            Ok(Varied { axis: axis.clone(), changes: changes.unwrap_or_default(), enters })
        };
        let x = varied(&request.x)?;
        let y = request.y.as_ref().map(varied).transpose()?;
        let mut over = request.over.as_ref().map(varied).transpose()?;
        if let Some(over) = &mut over {
            over.enters = Enters::Plant;
        }
        let all = [Some(&x), y.as_ref(), over.as_ref()];
        let mut seen = HashSet::new();
        for it in all.into_iter().flatten() {
            if it.changes.iter().any(|change| !seen.insert(*change)) {
                return Err(Error::Twice { target: it.axis.target.clone() });
            }
        }
        let nearest = |it: Option<&Varied>| {
            let Some(it) = it else { return 0 };
            let values = &it.axis.values;
            let now = current(base, &it.axis).unwrap_or(values[values.len() / 2]);
            let distance = |k: &usize| (values[*k] - now).abs();
            (0..values.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
        };
        let start = (nearest(Some(&x)), nearest(y.as_ref()));
        let kinds = ["plant", "attached", "controllers"].map(str::to_owned);
        Ok(Self { x, y, over, kinds, start })
    }

    /// Finds out what each parameter enters.
    fn place(&mut self, base: &Setup, scene: &Scene) -> Result<(), Error> {
        let named: Vec<usize> = [Some(&self.x), self.y.as_ref()]
            .into_iter()
            .flatten()
            .flat_map(|it| it.changes.iter().map(|(k, _)| *k))
            .collect();
        let Some(parts) = Parts::find(&scene.system, &scene.kinds, &named) else { return Ok(()) };
        let kind = |k: usize| scene.kinds[k].clone();
        let attached: Vec<usize> = parts.attached.iter().map(|(k, _)| *k).collect();
        let rest = (0..scene.kinds.len())
            .find(|k| !parts.controllers.contains(k) && !attached.contains(k));
        self.kinds = [
            rest.map_or_else(|| "plant".to_owned(), kind),
            attached.first().map_or_else(|| "none".to_owned(), |k| kind(*k)),
            kind(parts.controllers[0]),
        ];
        let first = parts.controllers[0];
        for it in [Some(&mut self.x), self.y.as_mut()].into_iter().flatten() {
            if it.enters == Enters::Plant {
                continue;
            }
            let only = |list: &[usize]| it.changes.iter().all(|(k, _)| list.contains(k));
            it.enters = if it.changes.is_empty() || only(&attached) {
                Enters::Attached
            } else if only(&parts.controllers) {
                // what controllers pass on without states belongs to the plant
                let of = it.changes.first().map_or(first, |(k, _)| *k);
                let twins = twins(base, &[of])?;
                let before = &scene.system.units[of];
                let mut unchanged = true;
                for value in [it.axis.values.first(), it.axis.values.last()].into_iter().flatten() {
                    let after = twins[0].linear(&it.given(of, *value))?;
                    let difference = |a: &linear::Rows, b: &linear::Rows, size: usize| {
                        (0..size).all(|i| {
                            let x: f64 = a.row(i).iter().map(|(j, v)| v * (1.0 + *j as f64)).sum();
                            let y: f64 = b.row(i).iter().map(|(j, v)| v * (1.0 + *j as f64)).sum();
                            (x - y).abs() <= UNCHANGED * x.abs().max(1.0)
                        })
                    };
                    unchanged &= before.states == after.states
                        && difference(&before.d, &after.d, before.outputs.len());
                }
                if unchanged { Enters::Controllers } else { Enters::Plant }
            } else {
                Enters::Plant
            };
        }
        Ok(())
    }

    pub fn size(&self) -> (usize, usize) {
        (self.x.axis.values.len(), self.y.as_ref().map_or(1, |it| it.axis.values.len()))
    }

    pub fn scenes(&self) -> Vec<SceneIndex> {
        let list = |it: Option<&Varied>| -> Vec<Option<usize>> {
            match it {
                Some(it) if it.enters == Enters::Plant => {
                    (0..it.axis.values.len()).map(Some).collect()
                }
                _ => vec![None],
            }
        };
        let mut all = Vec::new();
        for over in list(self.over.as_ref()) {
            for row in list(self.y.as_ref()) {
                all.extend(list(Some(&self.x)).into_iter().map(|column| SceneIndex {
                    column,
                    row,
                    over,
                }));
            }
        }
        all
    }

    pub fn plan(&self, scene: &SceneIndex, threads: usize) -> Plan<'_> {
        let columns = scene.column.is_none().then_some(&self.x);
        let rows = if scene.row.is_none() { self.y.as_ref() } else { None };
        let start = (columns.map_or(0, |_| self.start.0), rows.map_or(0, |_| self.start.1));
        Plan { columns, rows, start, threads }
    }

    pub fn given(&self, scene: &SceneIndex) -> Vec<(&str, f64)> {
        let of = |it: Option<&'_ Varied>, k: Option<usize>| {
            it.zip(k).map(|(it, k)| (it.axis.target.clone(), it.axis.values[k]))
        };
        let all = [
            of(Some(&self.x), scene.column),
            of(self.y.as_ref(), scene.row),
            of(self.over.as_ref(), scene.over),
        ];
        let targets = [Some(&self.x), self.y.as_ref(), self.over.as_ref()];
        all.into_iter()
            .zip(targets)
            .filter_map(|(given, it)| Some((it?.axis.target.as_str(), given?.1)))
            .collect()
    }

    /// The values of the parameters at points of the boundary.
    fn placed(&self, mut boundary: Vec<BoundaryPoint>) -> Vec<BoundaryPoint> {
        let value = |it: &Varied, k: usize, part: f64| {
            let values = &it.axis.values;
            let step = if part > 0.0 { values[k + 1] - values[k] } else { 0.0 };
            values[k] + part * step
        };
        for it in &mut boundary {
            let parts = if it.along_x { (it.part, 0.0) } else { (0.0, it.part) };
            it.x = value(&self.x, it.column, parts.0);
            it.y = self.y.as_ref().map(|of| value(of, it.row, parts.1));
        }
        boundary
    }

    fn over_value(&self, scene: &SceneIndex) -> Option<f64> {
        self.over.as_ref().zip(scene.over).map(|(it, k)| it.axis.values[k])
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for it in [Some(&self.x), self.y.as_ref(), self.over.as_ref()].into_iter().flatten() {
            let target = &it.axis.target;
            notes.push(match it.enters {
                Enters::Controllers => format!(
                    "{target} enters the controllers ({}) only. What they pass on without states, such as a lateral stiffness, is that of the scenario's own start.",
                    self.kinds[2]
                ),
                Enters::Attached => format!(
                    "{target} enters {} only. All other units are linearised at the scenario's own start, so the change of their operating point with it is left out; the points started anew show how much that is.",
                    self.kinds[1]
                ),
                Enters::Plant => format!("{target}: the system is started anew for each value."),
            });
        }
        notes
    }

    fn shown(&self, base: &Setup, which: usize) -> MapAxis {
        let it = match which {
            0 => &self.x,
            1 => self.y.as_ref().unwrap_or(&self.x),
            _ => self.over.as_ref().unwrap_or(&self.x),
        };
        let unit = it.changes.first().and_then(|(k, variable)| {
            base.system().instances[*k].description().variables[variable.0].unit.clone()
        });
        let enters = match it.enters {
            Enters::Controllers => self.kinds[2].clone(),
            Enters::Attached => self.kinds[1].clone(),
            Enters::Plant => "a new start".to_owned(),
        };
        MapAxis {
            target: it.axis.target.clone(),
            unit: unit.filter(|it| it != "1"),
            values: it.axis.values.clone(),
            scenario: current(base, &it.axis),
            enters,
        }
    }
}

/// The scenario's own value of a parameter, if all instances have the same.
fn current(base: &Setup, axis: &Axis) -> Option<f64> {
    let (instances, variable) = axis.target.rsplit_once('.')?;
    let mut all = base
        .system()
        .instances
        .iter()
        .filter(|it| it.name == instances || instances_match(instances, &it.name));
    let of = |it: &master::system::InstanceSetup| -> Option<f64> {
        let k = it.find(variable)?;
        let number = |value: &Value| match value {
            Value::Real(x) => Some(*x),
            _ => None,
        };
        match it.parameters.get(&k) {
            Some(value) => number(value),
            None => it.description().variables[k.0].start.as_ref().and_then(number),
        }
    };
    let first = of(all.next()?)?;
    all.all(|it| of(it) == Some(first)).then_some(first)
}

fn instances_match(pattern: &str, name: &str) -> bool {
    patterns::matches(pattern, name)
        || patterns::expand(pattern).is_ok_and(|names| names.iter().any(|it| it == name))
}
