//! The coupled system as the master steps it: the map from one communication point to the next.
//!
//! Linear units replace the real ones, and the real algorithm steps them once from every unit vector of
//! its memory: the units' states, and the signals' latest points and history. Latest points that follow
//! from the states alone are left out, and so is memory that the map does not use. This changes no
//! eigenvalue except zero.

use std::sync::Arc;

use faer::Mat;
use faer::prelude::c64;
use indexmap::IndexMap;

use super::coupled::StateSpace;
use super::error::LinearError;
use super::lanes::{self, Lanes};
use super::stepped_unit::SteppedUnit;
use super::system::{LinearSystem, Port, Stepping};
use super::unit::LinearUnit;
use super::unit_map::UnitMap;
use coupling::{COEFFICIENTS, Coupling, Exchange, Links, Schedule, Taylor, UnitIndex};

/// Number of points that a signal remembers, including the latest.
const POINTS: usize = 4;
/// A feed-through below this share of the largest counts as none.
const NOTHING: f64 = 1e-13;

/// One number that the stepped system remembers.
#[derive(Debug, Clone, Copy)]
enum Memory {
    /// A state of a unit.
    State { unit: usize, state: usize },
    /// A derivative of an output (0: its value) at a past communication point (0: the latest).
    Point { unit: usize, output: usize, point: usize, order: usize },
}

/// A derivative of an output at a communication point.
#[derive(Debug, Clone, Copy)]
struct Remembered {
    unit: usize,
    output: usize,
    point: usize,
    order: usize,
}

impl From<Remembered> for Memory {
    fn from(Remembered { unit, output, point, order }: Remembered) -> Self {
        Self::Point { unit, output, point, order }
    }
}

/// The stepped system.
pub struct Stepped<'a> {
    units: &'a [LinearUnit],
    /// The steps of different units.
    maps: Vec<UnitMap>,
    /// Which of them each unit has.
    kind: Vec<usize>,
    links: Vec<Links>,
    degree: usize,
    schedule: &'a Schedule,
    size: f64,
}

impl<'a> Stepped<'a> {
    /// Offsets of conversions do not matter for small motions.
    ///
    /// # Errors
    /// A unit is too fast for the step, or its eigenvalues cannot be found.
    pub fn new(units: &'a [LinearUnit], stepping: &'a Stepping) -> Result<Self, LinearError> {
        Self::with(units, stepping, false)
    }

    /// As [`Stepped::new`], for [`Stepped::open`] with inputs that are not connected.
    ///
    /// # Errors
    /// As [`Stepped::new`].
    pub fn with_free_inputs(
        units: &'a [LinearUnit],
        stepping: &'a Stepping,
    ) -> Result<Self, LinearError> {
        Self::with(units, stepping, true)
    }

    fn with(
        units: &'a [LinearUnit],
        stepping: &'a Stepping,
        free: bool,
    ) -> Result<Self, LinearError> {
        let mut links = stepping.links.clone();
        for link in links.iter_mut().flat_map(|unit| &mut unit.reals) {
            link.offset = 0.0;
        }
        let Stepping { degree, schedule, step, .. } = stepping;
        let (mut maps, mut kind, mut different) = (Vec::new(), Vec::new(), Vec::new());
        for (unit, links) in units.iter().zip(&links) {
            let offered = links.offered.as_slice();
            let degree = if links.reals.iter().any(|link| link.limit > 3) { 5 } else { 3 };
            let alike = |&(other, known): &(&LinearUnit, (usize, &[usize]))| {
                known == (degree, offered) && unit.steps_like(other)
            };
            kind.push(match different.iter().position(alike) {
                Some(place) => place,
                None => {
                    maps.push(UnitMap::new(unit, degree, offered, *step, free)?);
                    different.push((unit, (degree, offered)));
                    maps.len() - 1
                }
            });
        }
        Ok(Self { units, maps, kind, links, degree: *degree, schedule, size: *step })
    }

    fn units_at_rest(&self) -> Vec<SteppedUnit<'_>> {
        let units = self.kind.iter().zip(&self.links);
        units.map(|(&kind, links)| SteppedUnit::new(&self.maps[kind], &links.offered)).collect()
    }

    /// Which derivatives of each output follow from the states alone, per unit and output, up to the
    /// first that does not.
    fn determined(&self) -> Vec<Vec<usize>> {
        let mut units = self.units_at_rest();
        let mut found = Vec::new();
        for (unit, links) in units.iter_mut().zip(&self.links) {
            let mut least = vec![COEFFICIENTS; links.offered.len()];
            for input in 0..links.real_inputs() {
                for order in 0..COEFFICIENTS {
                    unit.clear();
                    let taylor = Taylor(std::array::from_fn(|k| f64::from(u8::from(k == order))));
                    unit.force(input, taylor);
                    for (least, output) in least.iter_mut().zip(unit.outputs()) {
                        let largest = output.0.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                        let first =
                            output.0.iter().position(|x| x.abs() > NOTHING * largest.max(1e-300));
                        *least = (*least).min(first.unwrap_or(COEFFICIENTS));
                    }
                }
            }
            unit.clear();
            found.push(least);
        }
        found
    }

    /// Everything that the system may remember. Of earlier points only what an algorithm uses; of the latest
    /// too, unless `all` are wanted.
    fn memories(&self, machine: &mut Machine, all: bool) -> Vec<Memory> {
        let mut memories = Vec::new();
        for (unit, linear) in self.units.iter().enumerate() {
            memories.extend((0..linear.states.len()).map(|state| Memory::State { unit, state }));
        }
        for mut family in self.families() {
            // a point that is used later is needed before
            let mut needed = false;
            for point in (1..POINTS).rev() {
                family.iter_mut().for_each(|memory| memory.0.point = point);
                needed |= machine.acts(&family);
                if needed {
                    memories.extend(family.iter().map(|it| Memory::from(it.0)));
                }
            }
            family.iter_mut().for_each(|memory| memory.0.point = 0);
            family.retain(|(it, _)| it.order >= machine.determined[it.unit][it.output]);
            if all || needed || machine.acts(&family) {
                memories.extend(family.iter().map(|it| Memory::from(it.0)));
            }
        }
        memories
    }

    /// The derivatives of outputs that are alike: of one order, in units and variables whose names differ in
    /// their numbers only. Each with a value of its own, so that no sum of them vanishes.
    fn families(&self) -> Vec<Vec<(Remembered, f64)>> {
        let mut families: IndexMap<_, Vec<(Remembered, f64)>> = IndexMap::new();
        let mut value: f64 = 0.0;
        for (unit, links) in self.links.iter().enumerate() {
            for (output, &offered) in links.offered.iter().enumerate() {
                let LinearUnit { name, outputs, .. } = &self.units[unit];
                let names = (stem(name), stem(&outputs[output].name));
                for order in 0..=offered {
                    value = (value + 0.618_033_988_749_895).fract();
                    let remembered = Remembered { unit, output, point: 0, order };
                    let family = families.entry((names.clone(), order)).or_default();
                    family.push((remembered, 1.0 + value));
                }
            }
        }
        families.into_values().collect()
    }

    /// The map between communication points.
    ///
    /// # Errors
    /// A step gives values that are not finite.
    pub fn map(&self) -> Result<Mat<f64>, LinearError> {
        Ok(self.map_with_lanes()?.0)
    }

    /// The map, and which of its coordinates belong to units that step alike.
    fn map_with_lanes(&self) -> Result<(Mat<f64>, Lanes), LinearError> {
        let determined = self.determined();
        let mut machine = Machine::new(self, &determined);
        let memories = self.memories(&mut machine, false);
        let columns: Vec<Vec<f64>> = memories
            .iter()
            .map(|memory| machine.step_from(&[(*memory, 1.0)], None, &memories))
            .collect();
        self.check(&columns, &memories)?;
        let used = used(&columns, &[], &[]);
        let map = Mat::from_fn(used.len(), used.len(), |i, j| columns[used[j]][used[i]]);
        Ok((map, self.lanes(used.iter().map(|&k| memories[k]))))
    }

    /// The states of units that step alike, and outputs of which there are as many.
    fn lanes(&self, memories: impl Iterator<Item = Memory>) -> Lanes {
        let alike = lanes::most_alike(self.units);
        let mut families: IndexMap<(String, String, usize, usize), Vec<usize>> = IndexMap::new();
        for (k, memory) in memories.enumerate() {
            let key = match memory {
                Memory::State { unit, state } if alike.contains(&unit) => {
                    (String::new(), String::new(), state, 0)
                }
                Memory::State { .. } => continue,
                Memory::Point { unit, output, point, order } => {
                    let LinearUnit { name, outputs, .. } = &self.units[unit];
                    (stem(name), stem(&outputs[output].name), point, order)
                }
            };
            families.entry(key).or_default().push(k);
        }
        Lanes::new(alike.len(), families.into_values())
    }

    fn check(&self, columns: &[Vec<f64>], memories: &[Memory]) -> Result<(), LinearError> {
        let Some(row) = columns.iter().find_map(|it| it.iter().position(|x| !x.is_finite())) else {
            return Ok(());
        };
        let (Memory::State { unit, .. } | Memory::Point { unit, .. }) = memories[row];
        Err(LinearError::Overflow { instance: self.units[unit].name.clone(), step: self.size })
    }

    /// The map between communication points with inputs and outputs: everything that the system
    /// remembers, the free inputs held over a step, and the outputs at its end.
    ///
    /// # Errors
    /// A step gives values that are not finite.
    pub fn open(
        &self,
        system: &LinearSystem,
        inputs: &[Port],
        outputs: &[Port],
    ) -> Result<StateSpace, LinearError> {
        let determined = self.determined();
        let mut machine = Machine::new(self, &determined);
        let memories = self.memories(&mut machine, true);
        let seen = |machine: &Machine| -> Vec<f64> {
            outputs.iter().map(|port| machine.output(*port)).collect()
        };
        let (mut columns, mut c) = (Vec::new(), Vec::new());
        for memory in &memories {
            columns.push(machine.step_from(&[(*memory, 1.0)], None, &memories));
            c.push(seen(&machine));
        }
        let (mut forced, mut d) = (Vec::new(), Vec::new());
        for port in inputs {
            forced.push(machine.step_from(&[], Some(*port), &memories));
            d.push(seen(&machine));
        }
        self.check(&columns, &memories)?;
        self.check(&forced, &memories)?;
        let used = used(&columns, &c, &forced);
        let (n, m, p) = (used.len(), inputs.len(), outputs.len());
        Ok(StateSpace {
            states: used.iter().map(|&k| self.name(memories[k])).collect(),
            inputs: inputs.iter().map(|port| system.input_name(*port)).collect(),
            outputs: outputs.iter().map(|port| system.output_name(*port)).collect(),
            a: Mat::from_fn(n, n, |i, j| columns[used[j]][used[i]]),
            b: Mat::from_fn(n, m, |i, j| forced[j][used[i]]),
            c: Mat::from_fn(p, n, |i, j| c[used[j]][i]),
            d: Mat::from_fn(p, m, |i, j| d[j][i]),
        })
    }

    fn name(&self, memory: Memory) -> String {
        match memory {
            Memory::State { unit, state } => {
                format!("{}.{}", self.units[unit].name, self.units[unit].states[state])
            }
            Memory::Point { unit, output, point, order } => {
                let unit = &self.units[unit];
                let derivative = match order {
                    0 => String::new(),
                    order => format!(", derivative {order}"),
                };
                let name = &unit.outputs[output].name;
                format!("{}.{name}, {point} steps ago{derivative}", unit.name)
            }
        }
    }

    /// Multipliers z of the map: a mode's signals grow by z from one communication point to the next.
    ///
    /// # Errors
    /// They cannot be found.
    pub fn multipliers(&self) -> Result<Vec<c64>, LinearError> {
        let (map, lanes) = self.map_with_lanes()?;
        lanes.eigenvalues(&map)
    }
}

/// A name without the number at its end.
fn stem(name: &str) -> String {
    name.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned()
}

/// Memories that are both read and written, found by repeatedly leaving out the others. `outputs` read each of
/// them, and `inputs` write to all.
fn used(columns: &[Vec<f64>], outputs: &[Vec<f64>], inputs: &[Vec<f64>]) -> Vec<usize> {
    let shown = |k: usize| outputs.get(k).is_some_and(|it| it.iter().any(|x| *x != 0.0));
    let driven = |k: usize| inputs.iter().any(|it| it[k] != 0.0);
    let mut used: Vec<usize> = (0..columns.len()).collect();
    loop {
        let before = used.len();
        let read = |&k: &usize| shown(k) || used.iter().any(|&i| columns[k][i] != 0.0);
        let kept: Vec<usize> = used.iter().copied().filter(read).collect();
        let written = |&i: &usize| driven(i) || kept.iter().any(|&k| columns[k][i] != 0.0);
        used = kept.iter().copied().filter(written).collect();
        if used.len() == before {
            return used;
        }
    }
}

/// Steps from unit vectors of the memory.
struct Machine<'a> {
    stepped: &'a Stepped<'a>,
    determined: &'a [Vec<usize>],
    units: Vec<SteppedUnit<'a>>,
    /// Outputs of each unit at the latest points.
    past: Vec<Vec<Vec<Taylor>>>,
    exchange: Exchange,
    coupling: Coupling<SteppedUnit<'a>>,
}

impl<'a> Machine<'a> {
    fn new(stepped: &'a Stepped<'a>, determined: &'a [Vec<usize>]) -> Self {
        let exchange = Exchange::new(stepped.links.clone(), stepped.degree);
        let coupling = Coupling::new(stepped.schedule, &exchange, &Arc::default());
        let nothing = determined.iter().map(|outputs| vec![Taylor::ZERO; outputs.len()]).collect();
        let past = vec![nothing; POINTS];
        Self { stepped, determined, units: stepped.units_at_rest(), past, exchange, coupling }
    }

    /// An output now, connected or not.
    fn output(&self, Port { unit, index }: Port) -> f64 {
        let (linear, stepped) = (&self.stepped.units[unit], &self.units[unit]);
        linear.c.times(index, |j| stepped.states[j])
            + linear.d.times(index, |j| stepped.input(j, 0))
    }

    /// Whether earlier points change a step.
    fn acts(&mut self, points: &[(Remembered, f64)]) -> bool {
        let start: Vec<(Memory, f64)> =
            points.iter().map(|&(point, value)| (point.into(), value)).collect();
        self.step_from(&start, None, &[]);
        let outputs =
            |k| self.exchange.outputs(UnitIndex(k)).reals.iter().flat_map(|it| it.0.iter());
        (0..self.units.len())
            .any(|k| self.units[k].states.iter().chain(outputs(k)).any(|x| *x != 0.0))
    }

    /// The memory one step after these values, and everything else zero; `held` is one over the step.
    fn step_from(
        &mut self,
        start: &[(Memory, f64)],
        held: Option<Port>,
        all: &[Memory],
    ) -> Vec<f64> {
        self.units.iter_mut().for_each(SteppedUnit::clear);
        let past = &mut self.past;
        past.iter_mut().flatten().for_each(|outputs| outputs.fill(Taylor::ZERO));
        for &(memory, value) in start {
            match memory {
                Memory::State { unit, state } => {
                    self.units[unit].states[state] = value;
                    let outputs = self.units[unit].outputs();
                    for ((point, now), &free) in
                        past[0][unit].iter_mut().zip(outputs).zip(&self.determined[unit])
                    {
                        point.0[..free].copy_from_slice(&now.0[..free]);
                    }
                }
                Memory::Point { unit, output, point, order } => {
                    past[point][unit][output][order] = value;
                }
            }
        }
        let size = self.stepped.size;
        for (point, outputs) in past.iter().enumerate().rev() {
            for (unit, outputs) in self.units.iter_mut().zip(outputs) {
                unit.preset.copy_from_slice(outputs);
                unit.is_preset = true;
            }
            let Ok(()) = if point == POINTS - 1 {
                self.exchange.start(0.0, &mut self.units)
            } else {
                self.exchange.read_outputs(0.0, &mut self.units, size)
            };
        }
        self.units.iter_mut().for_each(|unit| unit.is_preset = false);
        if let Some(Port { unit, index }) = held {
            self.units[unit].held = Some((index, 1.0));
        }
        let Ok(()) = self.coupling.step(&mut self.exchange, &mut self.units, 0.0, size);
        // earlier points move back by one
        past.rotate_right(1);
        for (k, latest) in past[0].iter_mut().enumerate() {
            latest.clone_from(&self.exchange.outputs(UnitIndex(k)).reals);
        }
        all.iter()
            .map(|memory| match *memory {
                Memory::State { unit, state } => self.units[unit].states[state],
                Memory::Point { unit, output, point, order } => past[point][unit][output][order],
            })
            .collect()
    }
}
