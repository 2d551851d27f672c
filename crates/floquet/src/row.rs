//! The endless row of spans, from the guideway unit of a scenario.

use faer::Mat;
use fmi2_import::description::Type;
use fmi2_import::instance::Instance;
use linear::{LinearUnit, Report};
use master::Setup;
use scenario::{AlgorithmSettings, Record, Scenario};

use crate::shapes::{ShapeTable, Sight};
use crate::{FloquetError, Girders};

/// Samples of the mode shapes over a period, at least.
const SAMPLES: usize = 2000;
/// Samples per span when looking for the period of the row.
const COARSE: usize = 8;
/// Relative difference of mode shapes and frequencies of spans that count as equal.
const EQUAL: f64 = 1e-9;

/// A row of spans that repeats without end.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Spans of a period.
    pub spans: usize,
    /// Spans of the layout.
    pub of: usize,
    /// Length of a period (m).
    pub period: f64,
    /// Largest distance from a magnet's centre at which its force acts (m).
    pub reach: f64,
    /// Largest circular frequency of a mode (rad/s), and the smallest.
    pub fastest: f64,
    /// See `fastest`.
    pub slowest: f64,
    a: Mat<f64>,
    shapes: ShapeTable,
}

impl Row {
    /// Reads the guideway `instance` of a scenario, without starting the other units.
    ///
    /// The unit is asked for its linearisation (the report `linear`) with magnets at many places. So every layout and
    /// every parameter counts as in a run. The irregularity does not matter: a smooth track is assumed.
    ///
    /// # Errors
    /// The unit does not start, or is not a row of girders with modes.
    pub fn read(scenario: &Scenario, instance: &str) -> Result<Self, FloquetError> {
        let setup = Setup::new(&alone(scenario, instance))?;
        let mut simulation = setup.start()?;
        let Some(participant) = simulation.participants_mut().first_mut() else {
            return Err(FloquetError::NoGuideway);
        };
        Sampler::new(participant.instance_mut())?.row()
    }

    /// The girders under a train of this length (m), between the outermost magnets.
    #[must_use]
    pub fn girders(&self, length: f64) -> Girders {
        let modes = self.shapes.modes;
        let b = Mat::from_fn(2 * modes, modes, |i, j| f64::from(u8::from(i == modes + j)));
        Girders::row(self.a.clone(), b, self.blocks(length), (0..modes).collect())
    }

    /// Periods that a train of this length touches while it moves by one.
    fn blocks(&self, length: f64) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few")]
        let covered = ((length + 2.0 * self.reach) / self.period).ceil().max(1.0) as usize;
        covered + 1
    }

    /// Modes of a period.
    #[must_use]
    pub fn modes(&self) -> usize {
        self.shapes.modes
    }

    /// Calls `see(mode, sight)` for the modes of one period that a magnet at this place from its beginning may feel.
    pub fn at(&self, place: f64, see: impl FnMut(usize, Sight)) {
        self.shapes.at(place, see);
    }
}

/// The scenario with only this instance.
fn alone(scenario: &Scenario, instance: &str) -> Scenario {
    let is = |name: &str| {
        name == instance
            || patterns::matches(name, instance)
            || patterns::expand(name).is_ok_and(|names| names.iter().any(|it| it == instance))
    };
    let mut alone = scenario.clone();
    alone.instances.retain(|name, _| is(name));
    alone.overrides.retain(|it| patterns::split_port(&it.target).is_some_and(|(name, _)| is(name)));
    alone.connections.clear();
    alone.inputs.clear();
    alone.events.clear();
    alone.stop_when.clear();
    alone.plots.clear();
    alone.ride_quality.clear();
    alone.objectives.clear();
    alone.limits.clear();
    alone.algorithm = AlgorithmSettings::default();
    alone.record = Record::default();
    alone.checkpoint = None;
    alone.trace = None;
    alone.experiment.stop = alone.experiment.start + alone.experiment.step;
    alone
}

/// Asks the unit for its linearisation at chosen places.
struct Sampler<'a> {
    instance: &'a mut Instance,
    name: String,
    force: Vec<u32>,
    position: Vec<u32>,
    speed: u32,
    spans: usize,
    start: f64,
    length: f64,
    reach: f64,
}

impl<'a> Sampler<'a> {
    fn new(instance: &'a mut Instance) -> Result<Self, FloquetError> {
        let name = instance.name().to_owned();
        let description = instance.package().description();
        let numbered = |prefix: &str| -> Vec<u32> {
            let all = description.variables.iter();
            all.filter(|it| it.kind == Type::Real && number(&it.name, prefix).is_some())
                .map(|it| it.value_reference)
                .collect()
        };
        let reference =
            |name: &str| description.find(name).map(|k| description.variables[k].value_reference);
        let lacks = |variable: &str| FloquetError::Lacks {
            instance: name.clone(),
            variable: variable.to_owned(),
        };
        let needed = |variable: &str| reference(variable).ok_or_else(|| lacks(variable));
        let (force, position) = (numbered("force_"), numbered("position_"));
        if force.is_empty() || force.len() != position.len() {
            return Err(lacks("position_NN for each force_NN"));
        }
        let speed = needed("speed")?;
        let (count, start, length) =
            (needed("span_count")?, needed("track_start")?, needed("track_length")?);
        let pole = reference("pole_length");
        let failed = |source| FloquetError::Unit { instance: name.clone(), source };
        let (mut spans, mut values) = ([0], [0.0; 3]);
        instance.get_integer(&[count], &mut spans).map_err(failed)?;
        let references = [start, length, pole.unwrap_or(start)];
        instance.get_real(&references, &mut values).map_err(failed)?;
        let reach = if pole.is_some() { 0.5 * values[2] } else { 0.0 };
        let spans = usize::try_from(spans[0]).unwrap_or(0).max(1);
        let [start, length, _] = values;
        Ok(Self { instance, name, force, position, speed, spans, start, length, reach })
    }

    /// The linearisation with unit forces at these places and a speed of 1 m/s, at most one for each magnet.
    fn report(&mut self, places: &[f64]) -> Result<LinearUnit, FloquetError> {
        let name = self.name.clone();
        let failed = |source| FloquetError::Unit { instance: name.clone(), source };
        let last = places.last().copied().unwrap_or(self.start);
        let all: Vec<f64> =
            (0..self.position.len()).map(|k| places.get(k).copied().unwrap_or(last)).collect();
        self.instance.set_real(&self.position, &all).map_err(failed)?;
        self.instance.set_real(&self.force, &vec![1.0; self.force.len()]).map_err(failed)?;
        self.instance.set_real(&[self.speed], &[1.0]).map_err(failed)?;
        let text = self.instance.report("linear").map_err(failed)?;
        let report = Report::read(&self.name, &text)?;
        Ok(report.into_unit(&self.name, self.instance.package().description(), &[], &[])?)
    }

    /// All modes at all places.
    fn sample(&mut self, places: &[f64]) -> Result<Vec<Vec<Sight>>, FloquetError> {
        let mut all = Vec::with_capacity(places.len());
        for some in places.chunks(self.position.len()) {
            let unit = self.report(some)?;
            let modes = unit.states.len() / 2;
            let named = |list: &[linear::Quantity], prefix: &str| -> Vec<usize> {
                let mut found: Vec<(u32, usize)> = list
                    .iter()
                    .enumerate()
                    .filter_map(|(k, it)| Some((number(&it.name, prefix)?, k)))
                    .collect();
                found.sort_unstable();
                found.into_iter().map(|(_, k)| k).collect()
            };
            let (force, position) =
                (named(&unit.inputs, "force_"), named(&unit.inputs, "position_"));
            let (sight, rate) =
                (named(&unit.outputs, "displacement_"), named(&unit.outputs, "rate_"));
            let mut part = vec![vec![Sight::default(); modes]; some.len()];
            let complete = |list: &[usize]| list.len() >= some.len();
            if ![&force, &position, &sight, &rate].into_iter().all(|list| complete(list)) {
                return Err(FloquetError::Lacks {
                    instance: self.name.clone(),
                    variable: "force, position, displacement and rate of each magnet in the report"
                        .into(),
                });
            }
            #[expect(clippy::needless_range_loop, reason = "the first index of part varies within")]
            for i in 0..modes {
                for &(column, value) in unit.b.row(modes + i) {
                    if let Some(k) = force[..some.len()].iter().position(|&it| it == column) {
                        part[k][i].push += value;
                    } else if let Some(k) =
                        position[..some.len()].iter().position(|&it| it == column)
                    {
                        part[k][i].push_slope += value;
                    }
                }
            }
            for (k, sights) in part.iter_mut().enumerate() {
                for &(column, value) in unit.c.row(sight[k]) {
                    if column < modes {
                        sights[column].sight += value;
                    }
                }
                for &(column, value) in unit.c.row(rate[k]) {
                    if column < modes {
                        sights[column].sight_slope += value;
                    }
                }
            }
            all.extend(part);
        }
        Ok(all)
    }

    /// A of the modes, if it has the form of modes: places, then their rates.
    fn matrix(&mut self) -> Result<Mat<f64>, FloquetError> {
        let unit = self.report(&[])?;
        let states = unit.states.len();
        let mut a = Mat::zeros(states, states);
        unit.a.iter().for_each(|(i, j, value)| a[(i, j)] += value);
        let modes = states / 2;
        let regular = states == 2 * modes
            && modes % self.spans == 0
            && (0..modes)
                .all(|i| (0..states).all(|j| a[(i, j)] == f64::from(u8::from(j == modes + i))));
        if regular { Ok(a) } else { Err(FloquetError::NoModes { instance: self.name.clone() }) }
    }

    fn row(&mut self) -> Result<Row, FloquetError> {
        let a = self.matrix()?;
        let all = a.nrows() / 2;
        let spans = self.repeating(&a)?;
        let modes = all * spans / self.spans;
        let period = self.length * spans as f64 / self.spans as f64;
        let cells = SAMPLES * spans;
        let cell = period / cells as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 1e6")]
        let beyond = (self.reach / cell).ceil() as usize + 1;
        let from = -(beyond as f64) * cell;
        let places: Vec<f64> = (0..=cells + 2 * beyond)
            .map(|k| self.start + (k as f64 - beyond as f64) * cell)
            .collect();
        let samples = self.sample(&places)?.into_iter().flat_map(|mut it| {
            it.truncate(modes);
            it
        });
        let shapes = ShapeTable { from, cell, modes, samples: samples.collect() };
        let block = Mat::from_fn(2 * modes, 2 * modes, |i, j| {
            let place = |k: usize| if k < modes { k } else { all + k - modes };
            a[(place(i), place(j))]
        });
        let frequencies = (0..modes).map(|i| (-a[(all + i, i)]).max(0.0).sqrt());
        let fastest = frequencies.clone().fold(0.0, f64::max);
        let slowest = frequencies.fold(fastest, f64::min);
        let (of, reach) = (self.spans, self.reach);
        Ok(Row { spans, of, period, reach, fastest, slowest, a: block, shapes })
    }

    /// The smallest number of spans after which the row repeats itself.
    fn repeating(&mut self, a: &Mat<f64>) -> Result<usize, FloquetError> {
        let all = a.nrows() / 2;
        let count = COARSE * self.spans;
        let places: Vec<f64> = (0..count)
            .map(|k| self.start + self.length * (k as f64 + 0.37) / count as f64)
            .collect();
        let samples = self.sample(&places)?;
        let largest = samples.iter().flatten().fold(0.0_f64, |m, it| m.max(it.sight.abs()));
        let heaviest = samples.iter().flatten().fold(0.0_f64, |m, it| m.max(it.push.abs()));
        let stiffest = a.norm_max();
        let repeats = |spans: usize| {
            let (shift, modes) = (COARSE * spans, all * spans / self.spans);
            let shapes = (0..count - shift).all(|k| {
                (0..all - modes).all(|n| {
                    let (here, there) = (samples[k][n], samples[k + shift][n + modes]);
                    (here.sight - there.sight).abs() <= EQUAL * largest
                        && (here.push - there.push).abs() <= EQUAL * heaviest
                })
            });
            let rates = (all..2 * all - modes).all(|i| {
                let shifted = |j: usize| (a[(i, j)] - a[(i + modes, j + modes)]).abs();
                let inside = (0..all - modes).chain(all..2 * all - modes);
                inside.into_iter().all(|j| shifted(j) <= EQUAL * stiffest)
            });
            shapes && rates
        };
        let divides = |spans: &usize| {
            self.spans.is_multiple_of(*spans) && (all * spans).is_multiple_of(self.spans)
        };
        Ok((1..self.spans).filter(divides).find(|&spans| repeats(spans)).unwrap_or(self.spans))
    }
}

/// The number at the end of a name that consists of the prefix and digits.
pub(crate) fn number(name: &str, prefix: &str) -> Option<u32> {
    name.strip_prefix(prefix)?.parse().ok()
}
