//! All signals between the units, their history, and what each unit gets and gives.

use std::ffi::CString;

use serde::{Deserialize, Serialize};

use super::Unit;
use super::signal::{Signal, Taylor};

/// Inputs of one unit for one step, in the order of its [`Links`].
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Real inputs as polynomials over the step.
    pub reals: Vec<Taylor>,
    /// Integer and Enumeration inputs, held.
    pub integers: Vec<i32>,
    /// Boolean inputs, held.
    pub booleans: Vec<i32>,
    /// String inputs, held.
    pub strings: Vec<CString>,
}

/// Outputs of one unit that feed inputs.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outputs {
    /// Real outputs with the derivatives that the unit offers.
    pub reals: Vec<Taylor>,
    /// Integer and Enumeration outputs.
    pub integers: Vec<i32>,
    /// Boolean outputs.
    pub booleans: Vec<i32>,
    /// String outputs.
    pub strings: Vec<CString>,
}

impl Clone for Outputs {
    fn clone(&self) -> Self {
        Self {
            reals: self.reals.clone(),
            integers: self.integers.clone(),
            booleans: self.booleans.clone(),
            strings: self.strings.clone(),
        }
    }

    // keeps the memory, unlike the derived one: steps do not allocate
    fn clone_from(&mut self, other: &Self) {
        self.reals.clone_from(&other.reals);
        self.integers.clone_from(&other.integers);
        self.booleans.clone_from(&other.booleans);
        self.strings.clone_from(&other.strings);
    }
}

impl Outputs {
    fn of(links: &Links) -> Self {
        Self {
            reals: vec![[0.0; 4]; links.offered.len()],
            integers: vec![0; links.integer_outputs],
            booleans: vec![0; links.boolean_outputs],
            strings: vec![CString::default(); links.string_outputs],
        }
    }

    fn is_like(&self, other: &Self) -> bool {
        let size =
            |it: &Self| (it.reals.len(), it.integers.len(), it.booleans.len(), it.strings.len());
        size(self) == size(other)
    }
}

/// A Real input's source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealLink {
    /// Which unit.
    pub unit: usize,
    /// Which of its Real outputs.
    pub output: usize,
    /// Input = factor · output + offset.
    pub factor: f64,
    /// Input = factor · output + offset.
    pub offset: f64,
    /// Highest derivative that the input takes; 0: values only.
    pub limit: usize,
    /// Degree of the extrapolation, if not that of all.
    pub degree: Option<usize>,
}

/// The source of an input that is held over the step: unit and output.
pub type HeldLink = (usize, usize);

/// What change of a Real output counts as large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// A tolerance is relative to the value or to this, whichever is larger.
    pub nominal: f64,
    /// What a tolerance is relative to instead.
    pub fixed: Option<f64>,
}

impl Default for Size {
    fn default() -> Self {
        Self { nominal: 1.0, fixed: None }
    }
}

/// Where one unit's inputs come from and which outputs it has.
#[derive(Debug, Clone, Default)]
pub struct Links {
    /// One source per Real input.
    pub reals: Vec<RealLink>,
    /// One source per Integer input.
    pub integers: Vec<HeldLink>,
    /// One source per Boolean input.
    pub booleans: Vec<HeldLink>,
    /// One source per String input.
    pub strings: Vec<HeldLink>,
    /// Highest derivative on offer, per Real output.
    pub offered: Vec<usize>,
    /// Sizes of the Real outputs; of those left out the default.
    pub sizes: Vec<Size>,
    /// Number of Integer outputs.
    pub integer_outputs: usize,
    /// Number of Boolean outputs.
    pub boolean_outputs: usize,
    /// Number of String outputs.
    pub string_outputs: usize,
}

/// A signal's number: one per Real output and degree that it is extrapolated with.
pub type SignalId = usize;

struct Source {
    signal: SignalId,
    limit: usize,
    factor: f64,
    offset: f64,
}

/// Whose output a signal is.
#[derive(Debug, Clone, Copy)]
struct Origin {
    unit: usize,
    output: usize,
    size: Size,
}

/// Everything of an [`Exchange`] that changes from step to step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ExchangeState {
    signals: Vec<Signal>,
    outputs: Vec<Outputs>,
}

/// All signals between the units and their history: flat, made once, no allocation after.
pub struct Exchange {
    /// those of unit k are `first[k]..first[k + 1]`
    signals: Vec<Signal>,
    origins: Vec<Origin>,
    first: Vec<usize>,
    /// all Real inputs of all units
    sources: Vec<Vec<Source>>,
    links: Vec<Links>,
    pub(super) inputs: Vec<Inputs>,
    pub(super) outputs: Vec<Outputs>,
}

/// The signals of each unit: its outputs with the general degree, then with those asked for besides.
fn lay_out(links: &[Links], degree: usize) -> Vec<Vec<(usize, usize)>> {
    let mut wanted: Vec<Vec<(usize, usize)>> = links
        .iter()
        .map(|unit| (0..unit.offered.len()).map(|output| (output, degree)).collect())
        .collect();
    for link in links.iter().flat_map(|unit| &unit.reals) {
        let signal = (link.output, link.degree.unwrap_or(degree));
        if !wanted[link.unit].contains(&signal) {
            wanted[link.unit].push(signal);
        }
    }
    wanted
}

impl Exchange {
    /// Lays out the signals; `degree` is that of the extrapolation where a link has no other.
    #[must_use]
    pub fn new(links: Vec<Links>, degree: usize) -> Self {
        let wanted = lay_out(&links, degree);
        let (mut first, mut signals, mut origins) = (vec![0], Vec::new(), Vec::new());
        for (unit, list) in wanted.iter().enumerate() {
            for &(output, degree) in list {
                let size = links[unit].sizes.get(output).copied().unwrap_or_default();
                signals.push(Signal::new(links[unit].offered[output], degree));
                origins.push(Origin { unit, output, size });
            }
            first.push(signals.len());
        }
        let signal_of = |link: &RealLink| {
            let signal = (link.output, link.degree.unwrap_or(degree));
            let place = wanted[link.unit].iter().position(|it| *it == signal).unwrap_or(0);
            first[link.unit] + place
        };
        let source = |link: &RealLink| Source {
            signal: signal_of(link),
            limit: link.limit,
            factor: link.factor,
            offset: link.offset,
        };
        let sources = links.iter().map(|unit| unit.reals.iter().map(source).collect()).collect();
        let inputs = links
            .iter()
            .map(|unit| Inputs {
                reals: vec![[0.0; 4]; unit.reals.len()],
                integers: vec![0; unit.integers.len()],
                booleans: vec![0; unit.booleans.len()],
                strings: vec![CString::default(); unit.strings.len()],
            })
            .collect();
        let outputs = links.iter().map(Outputs::of).collect();
        Self { signals, origins, first, sources, links, inputs, outputs }
    }

    /// Number of units.
    #[must_use]
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Whether there is no unit.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// What has to be kept to go on from this communication point later.
    #[must_use]
    pub fn state(&self) -> ExchangeState {
        ExchangeState { signals: self.signals.clone(), outputs: self.outputs.clone() }
    }

    /// The same into memory that is there already.
    pub fn keep(&self, state: &mut ExchangeState) {
        state.signals.clone_from(&self.signals);
        state.outputs.clone_from(&self.outputs);
    }

    /// Goes back to a state; false, and nothing is changed, if it is not of the same connections.
    #[must_use]
    pub fn restore(&mut self, state: &ExchangeState) -> bool {
        let alike = self.signals.len() == state.signals.len()
            && self.signals.iter().zip(&state.signals).all(|(a, b)| a.is_like(b))
            && self.outputs.len() == state.outputs.len()
            && self.outputs.iter().zip(&state.outputs).all(|(a, b)| a.is_like(b));
        if alike {
            self.signals.clone_from(&state.signals);
            self.outputs.clone_from(&state.outputs);
        }
        alike
    }

    /// Reads all outputs at the start and begins the history with them.
    ///
    /// # Errors
    /// A unit's.
    pub fn start<U: Unit>(&mut self, time: f64, units: &mut [U]) -> Result<(), U::Error> {
        for (k, unit) in units.iter_mut().enumerate() {
            unit.receive(time, &mut self.outputs[k])?;
            for s in self.signals_of(k) {
                self.signals[s].restart(self.outputs[k].reals[self.origins[s].output]);
            }
        }
        Ok(())
    }

    /// Reads all outputs at a communication point that all units have reached by a step of that size.
    ///
    /// # Errors
    /// A unit's.
    pub fn go_on<U: Unit>(
        &mut self,
        time: f64,
        units: &mut [U],
        size: f64,
    ) -> Result<(), U::Error> {
        for (k, unit) in units.iter_mut().enumerate() {
            unit.receive(time, &mut self.outputs[k])?;
            self.take(k, size);
        }
        Ok(())
    }

    /// A unit's latest outputs.
    #[must_use]
    pub fn outputs(&self, k: usize) -> &Outputs {
        &self.outputs[k]
    }

    /// Where the inputs come from, with the derivatives that they turned out to take.
    #[must_use]
    pub fn links(&self) -> Vec<Links> {
        let mut links = self.links.clone();
        for (unit, sources) in links.iter_mut().zip(&self.sources) {
            for (link, source) in unit.reals.iter_mut().zip(sources) {
                link.limit = source.limit;
            }
        }
        links
    }

    /// Sets the highest derivative that each Real input of a unit takes.
    pub fn limit(&mut self, k: usize, highest: impl IntoIterator<Item = usize>) {
        for (source, limit) in self.sources[k].iter_mut().zip(highest) {
            source.limit = limit;
        }
    }

    /// Represents every signal over the coming step by data up to its beginning.
    #[inline]
    pub fn extrapolate(&mut self, size: f64) {
        for signal in &mut self.signals {
            signal.extrapolate(size);
        }
    }

    /// Makes a unit's inputs of the signals as they stand now.
    #[inline]
    pub fn fill(&mut self, k: usize, size: f64) {
        let inputs = &mut self.inputs[k];
        for (input, source) in inputs.reals.iter_mut().zip(&self.sources[k]) {
            let p = self.signals[source.signal].polynomial(source.limit, size);
            let a = source.factor;
            *input = [a * p[0] + source.offset, a * p[1], a * p[2], a * p[3]];
        }
        let links = &self.links[k];
        for (input, &(unit, output)) in inputs.integers.iter_mut().zip(&links.integers) {
            *input = self.outputs[unit].integers[output];
        }
        for (input, &(unit, output)) in inputs.booleans.iter_mut().zip(&links.booleans) {
            *input = self.outputs[unit].booleans[output];
        }
        for (input, &(unit, output)) in inputs.strings.iter_mut().zip(&links.strings) {
            input.clone_from(&self.outputs[unit].strings[output]);
        }
    }

    /// Takes over the outputs that a unit has given after a step of that size.
    #[inline]
    pub fn take(&mut self, k: usize, size: f64) {
        for s in self.signals_of(k) {
            self.signals[s].advance(self.outputs[k].reals[self.origins[s].output], size);
        }
    }

    /// Takes over the outputs after the unit has made the same step again.
    #[inline]
    pub fn take_again(&mut self, k: usize) {
        for s in self.signals_of(k) {
            self.signals[s].revise(self.outputs[k].reals[self.origins[s].output]);
        }
    }

    /// Represents a unit's signals by interpolation: it has stepped to the end of the step.
    #[inline]
    pub fn interpolate(&mut self, k: usize, size: f64) {
        for signal in &mut self.signals[self.first[k]..self.first[k + 1]] {
            signal.interpolate(size);
        }
    }

    fn signals_of(&self, k: usize) -> std::ops::Range<SignalId> {
        self.first[k]..self.first[k + 1]
    }

    /// The unit whose output a signal is, and which of its Real outputs.
    #[must_use]
    pub fn origin(&self, signal: SignalId) -> (usize, usize) {
        (self.origins[signal].unit, self.origins[signal].output)
    }

    /// A signal.
    #[must_use]
    pub fn signal(&self, signal: SignalId) -> &Signal {
        &self.signals[signal]
    }

    /// The signals that feed a unit's Real inputs, with the factor of each.
    pub fn sources(&self, k: usize) -> impl Iterator<Item = (SignalId, f64)> + '_ {
        self.sources[k].iter().map(|source| (source.signal, source.factor))
    }

    /// The signals that are a unit's Real outputs.
    pub fn signals(&self, k: usize) -> impl Iterator<Item = SignalId> + use<> {
        self.signals_of(k)
    }

    /// Puts value and first derivative at the end of the step in the place of a signal's own, and
    /// represents it by interpolation up to there.
    pub fn suppose(&mut self, signal: SignalId, end: [f64; 2], size: f64) {
        self.signals[signal].suppose(end, size);
    }

    /// Number of signals.
    #[must_use]
    pub fn signal_count(&self) -> usize {
        self.signals.len()
    }

    /// Signals that some unit takes for which `chosen` holds of source and target.
    pub fn signals_between(&self, chosen: impl Fn(usize, usize) -> bool) -> Vec<SignalId> {
        let mut found: Vec<SignalId> = Vec::new();
        for (target, sources) in self.sources.iter().enumerate() {
            let mine = sources.iter().map(|source| source.signal);
            found.extend(mine.filter(|&signal| chosen(self.origins[signal].unit, target)));
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Whether an output of one unit feeds an input of another.
    #[must_use]
    pub fn feeds(&self, from: usize, to: usize) -> bool {
        let links = &self.links[to];
        let held = [&links.integers, &links.booleans, &links.strings];
        links.reals.iter().any(|link| link.unit == from)
            || held.into_iter().flatten().any(|&(unit, _)| unit == from)
    }

    /// What an error of a signal may be for a relative tolerance.
    #[must_use]
    pub fn allowed(&self, signal: SignalId, tolerance: f64) -> f64 {
        let size = self.origins[signal].size;
        let value = self.signals[signal].now()[0].abs();
        tolerance * size.fixed.unwrap_or(value.max(size.nominal))
    }

    /// By how much a signal was extrapolated wrongly up to the end of the step.
    #[must_use]
    pub fn surprise(&self, signal: SignalId) -> f64 {
        let signal = &self.signals[signal];
        (signal.now()[0] - signal.predicted()[0]).abs()
    }
}
