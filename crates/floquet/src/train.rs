//! The train on a rigid track, from a scenario: everything but the guideway.

use faer::Mat;
use linear::{Connection, LinearSystem, Linearised, Open, Port};
use master::Setup;
use scenario::Scenario;

use crate::row::number;
use crate::{FloquetError, Modal};

/// Magnets at places closer than this (m) count as beside each other.
const BESIDE: f64 = 1e-6;

/// All units but the guideway as one linear system, from the track's displacement under the magnets to what presses on
/// it. Magnets beside each other see the same track, and are one input.
#[derive(Debug, Clone)]
pub struct Train {
    /// Name of the guideway's instance.
    pub guideway: String,
    /// The train in its modes: per place the displacement of the track as input; as outputs the force, and the moment
    /// Σ F·δx of static forces whose magnet has moved along the track, first all forces, then all moments.
    pub modal: Modal,
    /// Places (m), the foremost 0, the others negative.
    pub places: Vec<f64>,
    /// Number of magnets.
    pub magnets: usize,
    /// Number of states.
    pub states: usize,
}

impl Train {
    /// Linearises a scenario at its start.
    ///
    /// # Errors
    /// The scenario does not start, a unit does not report its linearisation, or the units are not connected as a train
    /// and its guideway.
    pub fn read(scenario: &Scenario) -> Result<Self, FloquetError> {
        let mut scenario = scenario.clone();
        scenario.experiment.stop = scenario.experiment.start + scenario.experiment.step;
        scenario.record.interval = None;
        scenario.checkpoint = None;
        let setup = Setup::new(&scenario)?;
        let system = Linearised::at_start(&setup)?.system;
        let guideway = guideway(&system).ok_or(FloquetError::NoGuideway)?;
        let unit = &system.units[guideway];
        let name = unit.name.clone();
        let inputs = |prefix: &str| numbered(unit.inputs.iter().map(|it| it.name.as_str()), prefix);
        let outputs =
            |prefix: &str| numbered(unit.outputs.iter().map(|it| it.name.as_str()), prefix);
        let (force, position) = (inputs("force_"), inputs("position_"));
        let (sight, rate) = (outputs("displacement_"), outputs("rate_"));
        let magnets = force.len();
        if [&position, &sight, &rate].into_iter().any(|it| it.len() != magnets) {
            let variable = "force, position, displacement and rate of each magnet".to_owned();
            return Err(FloquetError::Lacks { instance: name, variable });
        }
        let values = values(&setup, guideway)?;
        let value = |input: usize| values.get(input).copied().unwrap_or(0.0);
        let places: Vec<f64> = position.iter().map(|&input| value(input)).collect();
        let loads: Vec<f64> = force.iter().map(|&input| value(input)).collect();
        let open = Opened::new(&system, guideway)?;
        open.check(&system, guideway, (&sight, &rate))?;
        // magnets beside each other
        let front = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut rows: Vec<(f64, Vec<usize>)> = Vec::new();
        for (k, place) in places.iter().map(|place| place - front).enumerate() {
            match rows.iter_mut().find(|(other, _)| (other - place).abs() < BESIDE) {
                Some((_, members)) => members.push(k),
                None => rows.push((place, vec![k])),
            }
        }
        let n = open.a.nrows();
        let count = rows.len();
        let sum = |members: &[usize], of: &dyn Fn(usize) -> f64| -> f64 {
            members.iter().map(|&k| of(k)).sum()
        };
        let b = Mat::from_fn(n, count, |i, g| sum(&rows[g].1, &|k| open.b[(i, sight[k])]));
        let pressing = |i: usize, of: &dyn Fn(usize) -> f64| {
            let members = &rows[i % count].1;
            if i < count {
                sum(members, &|k| of(force[k]))
            } else {
                sum(members, &|k| loads[k] * of(position[k]))
            }
        };
        let c = Mat::from_fn(2 * count, n, |i, j| pressing(i, &|input| open.c[(input, j)]));
        let d = Mat::from_fn(2 * count, count, |i, g| {
            pressing(i, &|input| sum(&rows[g].1, &|k| open.d[(input, sight[k])]))
        });
        let modal = Modal::new(&open.a, &b, &c, d)?;
        let places = rows.iter().map(|(place, _)| *place).collect();
        Ok(Self { guideway: name, modal, places, magnets, states: n })
    }

    /// Distance between the outermost magnets (m).
    #[must_use]
    pub fn length(&self) -> f64 {
        self.places.iter().map(|place| place.abs()).fold(0.0, f64::max)
    }
}

/// The unit that magnets move over.
fn guideway(system: &LinearSystem) -> Option<usize> {
    system.units.iter().position(|unit| {
        unit.inputs.iter().any(|it| number(&it.name, "position_").is_some())
            && unit.outputs.iter().any(|it| number(&it.name, "displacement_").is_some())
    })
}

/// Indices of the names that consist of the prefix and a number, in the order of the numbers.
fn numbered<'a>(names: impl Iterator<Item = &'a str>, prefix: &str) -> Vec<usize> {
    let mut found: Vec<(u32, usize)> =
        names.enumerate().filter_map(|(k, name)| Some((number(name, prefix)?, k))).collect();
    found.sort_unstable();
    found.into_iter().map(|(_, k)| k).collect()
}

/// The values of the connected inputs of one unit at the start, in the order of its linearisation.
fn values(setup: &Setup, unit: usize) -> Result<Vec<f64>, FloquetError> {
    let mut simulation = setup.start()?;
    let Some(participant) = simulation.participants_mut().get_mut(unit) else {
        return Ok(Vec::new());
    };
    let inputs = participant.variables().inputs.reals.clone();
    let instance = participant.instance_mut();
    let description = instance.package().description();
    let references: Vec<u32> =
        inputs.iter().map(|&(k, _)| description.variables[k].value_reference).collect();
    let mut values = vec![0.0; references.len()];
    let name = instance.name().to_owned();
    instance
        .get_real(&references, &mut values)
        .map_err(|source| FloquetError::Unit { instance: name, source })?;
    Ok(values)
}

/// All other units between the guideway's outputs (columns of B and D) and its inputs (rows of C and D).
struct Opened {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
}

impl Opened {
    fn new(system: &LinearSystem, guideway: usize) -> Result<Self, FloquetError> {
        let place = |unit: usize| if unit > guideway { unit - 1 } else { unit };
        let moved = |port: Port| Port { unit: place(port.unit), index: port.index };
        let mut train = system.clone();
        train.units.remove(guideway);
        let inside = |it: &Connection| it.from.unit != guideway && it.to.unit != guideway;
        train.connections.retain(inside);
        for it in &mut train.connections {
            (it.from, it.to) = (moved(it.from), moved(it.to));
        }
        let all = &system.connections;
        let felt = || all.iter().filter(|it| it.from.unit == guideway && it.to.unit != guideway);
        let given = || all.iter().filter(|it| it.to.unit == guideway && it.from.unit != guideway);
        let mut open = Open {
            inputs: felt().map(|it| moved(it.to)).collect(),
            outputs: given().map(|it| moved(it.from)).collect(),
            ..Open::default()
        };
        for list in [&mut open.inputs, &mut open.outputs] {
            list.sort_unstable();
            list.dedup();
        }
        let space = train.open(&open)?;
        let unit = &system.units[guideway];
        let (n, inputs, outputs) = (space.a.nrows(), unit.outputs.len(), unit.inputs.len());
        let column = |port: Port| open.inputs.iter().position(|it| *it == moved(port));
        let row = |port: Port| open.outputs.iter().position(|it| *it == moved(port));
        let mut b = Mat::<f64>::zeros(n, inputs);
        let mut direct = Mat::<f64>::zeros(open.outputs.len(), inputs);
        for it in felt() {
            let Some(from) = column(it.to) else { continue };
            (0..n).for_each(|i| b[(i, it.from.index)] += it.factor * space.b[(i, from)]);
            (0..open.outputs.len())
                .for_each(|i| direct[(i, it.from.index)] += it.factor * space.d[(i, from)]);
        }
        let mut c = Mat::<f64>::zeros(outputs, n);
        let mut d = Mat::<f64>::zeros(outputs, inputs);
        for it in given() {
            let Some(from) = row(it.from) else { continue };
            (0..n).for_each(|j| c[(it.to.index, j)] += it.factor * space.c[(from, j)]);
            (0..inputs).for_each(|j| d[(it.to.index, j)] += it.factor * direct[(from, j)]);
        }
        Ok(Self { a: space.a, b, c, d })
    }

    /// Only the displacement under the magnets may act on the train.
    fn check(
        &self,
        system: &LinearSystem,
        guideway: usize,
        (sight, rate): (&[usize], &[usize]),
    ) -> Result<(), FloquetError> {
        let unit = &system.units[guideway];
        for (k, output) in unit.outputs.iter().enumerate() {
            let acts = |m: &Mat<f64>| (0..m.nrows()).any(|i| m[(i, k)] != 0.0);
            if sight.contains(&k) || !(acts(&self.b) || acts(&self.d)) {
                continue;
            }
            let output = format!("{}.{}", unit.name, output.name);
            return Err(if rate.contains(&k) {
                FloquetError::Rate { output }
            } else {
                FloquetError::Feeds { output }
            });
        }
        Ok(())
    }
}
