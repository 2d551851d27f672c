//! All signals between the units with their history, and the inputs and outputs of each unit.

mod given;
mod jumps;
mod layout;
mod state;

use std::ops::Range;

pub use given::Course;
pub use state::ExchangeState;

use given::Given;
use layout::{Form, Source, lay_out, most_inputs, sources, whole_inputs};

use super::index::{InputIndex, OutputIndex, SignalIndex, UnitIndex};
use super::links::{Input, Links, RealLink, Size, UnitValues, copy_held};
use super::signal::{Effect, Signal};
use super::unit::Unit;

/// The output that a signal represents.
#[derive(Debug, Clone, Copy)]
struct Origin {
    unit: UnitIndex,
    output: OutputIndex,
    size: Size,
    /// Its discontinuity at every communication point.
    always: Effect,
}

/// All signals between the units and their history: flat lists, allocated once.
pub struct Exchange {
    pub(super) now: ExchangeState,
    /// per signal
    origins: Vec<Origin>,
    /// the signals of unit k are `first[k]..first[k + 1]`
    first: Vec<usize>,
    /// all Real inputs of all units
    sources: Vec<Vec<Source>>,
    links: Vec<Links>,
    pub(super) inputs: Vec<UnitValues>,
    /// the units with outputs that are not Real
    givers: Vec<UnitIndex>,
    /// per unit, the Real inputs that no Real output feeds
    whole_inputs: Vec<Vec<InputIndex>>,
    /// per unit, whether jumps can reach it
    reachable: Vec<bool>,
    jumped: Vec<(Input, Effect)>,
    given: Vec<Given>,
}

impl Exchange {
    /// Lays out the signals. `degree` is that of the extrapolation, unless a link has its own.
    #[must_use]
    pub fn new(links: Vec<Links>, degree: usize) -> Self {
        let (forms, places) = lay_out(&links, degree);
        let (mut first, mut signals, mut origins) = (vec![0], Vec::new(), Vec::new());
        for (unit, forms) in forms.iter().enumerate() {
            for &Form { output, degree, held, kinks } in forms {
                let size = links[unit].sizes.get(output.0).copied().unwrap_or_default();
                let offered = links[unit].offered[output];
                let smooth = Signal::new(offered, degree);
                signals.push(match held {
                    true => Signal::held(),
                    false if links[unit].bends => smooth.with_bends(),
                    false => smooth,
                });
                let always = if kinks { Effect::Kink } else { Effect::None };
                origins.push(Origin { unit: UnitIndex(unit), output, size, always });
            }
            first.push(signals.len());
        }
        let signal_of = |link: &RealLink| {
            SignalIndex(first[link.unit] + places[&(link.unit, Form::of(link, degree))])
        };
        let outputs: Vec<UnitValues> = links.iter().map(Links::new_outputs).collect();
        let held = |unit: &UnitValues| UnitValues { reals: Vec::new(), ..unit.clone() };
        let begin: Vec<UnitValues> = outputs.iter().map(held).collect();
        let before = begin.clone();
        let givers = (0..links.len()).filter(|&k| links[k].has_held_outputs()).map(UnitIndex);
        Self {
            sources: links.iter().map(|unit| sources(unit, signal_of)).collect(),
            now: ExchangeState { signals, outputs, begin, before },
            origins,
            first,
            inputs: links.iter().map(Links::new_inputs).collect(),
            givers: givers.collect(),
            whole_inputs: links.iter().map(whole_inputs).collect(),
            reachable: jumps::reachable(&links),
            jumped: Vec::with_capacity(most_inputs(&links)),
            given: Vec::new(),
            links,
        }
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

    /// Reads all outputs at the start and begins the history with them.
    ///
    /// # Errors
    /// A unit fails.
    pub fn start<U: Unit>(&mut self, time: f64, units: &mut [U]) -> Result<(), U::Error> {
        for (k, unit) in units.iter_mut().enumerate() {
            unit.receive(time, &mut self.now.outputs[k])?;
            for s in self.range(UnitIndex(k)) {
                let now = self.now.outputs[k].reals[self.origins[s].output];
                self.now.signals[s].restart(now);
            }
        }
        let ExchangeState { outputs, begin, before, .. } = &mut self.now;
        for &k in &self.givers {
            copy_held(&mut begin[k], &outputs[k]);
            copy_held(&mut before[k], &outputs[k]);
        }
        Ok(())
    }

    /// Sets all inputs at the start to the values of the outputs there. No unit may be read after
    /// that and before its first step.
    ///
    /// # Errors
    /// A unit fails.
    pub fn preset_inputs<U: Unit>(&mut self, units: &mut [U]) -> Result<(), U::Error> {
        self.extrapolate(0.0);
        for (k, unit) in units.iter_mut().enumerate() {
            self.fill(UnitIndex(k), 0.0);
            unit.preset(&self.inputs[k])?;
        }
        Ok(())
    }

    /// Marks a Real output that jumps with the first step of its unit.
    pub fn expect_jump(&mut self, k: UnitIndex, output: OutputIndex) {
        for s in self.range(k).filter(|&s| self.origins[s].output == output) {
            self.now.signals[s].expect_jump();
        }
    }

    /// Reads all outputs at a communication point that all units have reached by a step of that size.
    ///
    /// # Errors
    /// A unit fails.
    pub fn read_outputs<U: Unit>(
        &mut self,
        time: f64,
        units: &mut [U],
        size: f64,
    ) -> Result<(), U::Error> {
        for (k, unit) in units.iter_mut().enumerate() {
            unit.receive(time, &mut self.now.outputs[k])?;
            self.accept(UnitIndex(k), size);
        }
        Ok(())
    }

    /// A unit's latest outputs.
    #[must_use]
    pub fn outputs(&self, k: UnitIndex) -> &UnitValues {
        &self.now.outputs[k]
    }

    /// Where the inputs come from, with the derivatives that they take in fact.
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

    /// Sends values only, without derivatives, to a unit from now on.
    pub fn hold_inputs(&mut self, k: UnitIndex) {
        self.sources[k].iter_mut().for_each(|source| source.limit = 0);
        self.hold_given(k);
    }

    /// Represents every signal over the next step by data up to its beginning.
    #[inline]
    pub fn extrapolate(&mut self, size: f64) {
        let ExchangeState { signals, outputs, begin, before } = &mut self.now;
        for (signal, origin) in signals.iter_mut().zip(&self.origins) {
            signal.extrapolate(size);
            if origin.always != Effect::None {
                signal.set_effect(origin.always);
            }
        }
        for &k in &self.givers {
            std::mem::swap(&mut begin[k], &mut before[k]);
            copy_held(&mut begin[k], &outputs[k]);
        }
    }

    /// Computes a unit's inputs from the present representation of the signals.
    #[inline]
    pub fn fill(&mut self, k: UnitIndex, size: f64) {
        let inputs = &mut self.inputs[k];
        for source in &self.sources[k] {
            let p = self.now.signals[source.signal].polynomial(source.limit, size);
            let term = p.scaled(source.factor, source.offset);
            let input = &mut inputs.reals[source.input];
            if source.first {
                *input = term;
            } else {
                *input += term;
            }
        }
        if self.reachable[k] {
            self.fill_held(k);
            self.find_effects(k);
        }
    }

    /// Takes the outputs that a unit has returned after a step of that size.
    #[inline]
    pub fn accept(&mut self, k: UnitIndex, size: f64) {
        for s in self.range(k) {
            let now = self.now.outputs[k].reals[self.origins[s].output];
            self.now.signals[s].advance(now, size);
        }
    }

    /// Takes the outputs that a unit has returned after it repeated the step.
    #[inline]
    pub fn accept_again(&mut self, k: UnitIndex) {
        for s in self.range(k) {
            self.now.signals[s].revise(self.now.outputs[k].reals[self.origins[s].output]);
        }
    }

    /// Represents a unit's signals by interpolation: it has stepped to the end of the step.
    #[inline]
    pub fn interpolate(&mut self, k: UnitIndex, size: f64) {
        let range = self.range(k);
        for signal in &mut self.now.signals[range] {
            signal.interpolate(size);
        }
    }

    #[inline]
    fn range(&self, k: UnitIndex) -> Range<usize> {
        self.first[k.0]..self.first[k.0 + 1]
    }

    /// The unit whose output a signal is, and which of its Real outputs.
    #[inline]
    #[must_use]
    pub fn origin(&self, signal: SignalIndex) -> (UnitIndex, OutputIndex) {
        (self.origins[signal].unit, self.origins[signal].output)
    }

    /// A signal with its history.
    #[inline]
    #[must_use]
    pub fn signal(&self, signal: SignalIndex) -> &Signal {
        &self.now.signals[signal]
    }

    /// The signals that feed a unit's Real inputs: which input, which signal, with what factor.
    pub fn sources(
        &self,
        k: UnitIndex,
    ) -> impl Iterator<Item = (InputIndex, SignalIndex, f64)> + '_ {
        self.sources[k].iter().map(|source| (source.input, source.signal, source.factor))
    }

    /// The signals of a unit's Real outputs.
    pub fn signals(&self, k: UnitIndex) -> impl Iterator<Item = SignalIndex> + use<> {
        self.range(k).map(SignalIndex)
    }

    /// Replaces value and derivatives of a signal at the end of the step by assumed ones, and
    /// interpolates up to there.
    #[inline]
    pub fn assume(&mut self, signal: SignalIndex, end: [f64; 3], size: f64) {
        self.now.signals[signal].assume(end, size);
    }

    /// Number of signals.
    #[must_use]
    pub fn signal_count(&self) -> usize {
        self.now.signals.len()
    }

    /// Signals that some unit takes for which `chosen` is true of source and target.
    pub fn signals_between(
        &self,
        chosen: impl Fn(UnitIndex, UnitIndex) -> bool,
    ) -> Vec<SignalIndex> {
        let mut found: Vec<SignalIndex> = Vec::new();
        for (target, sources) in self.sources.iter().enumerate() {
            let mine = sources.iter().map(|source| source.signal);
            let target = UnitIndex(target);
            found.extend(mine.filter(|&signal| chosen(self.origins[signal].unit, target)));
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The units whose outputs feed inputs of a unit, some of them more than once.
    pub fn feeders(&self, to: UnitIndex) -> impl Iterator<Item = UnitIndex> + '_ {
        self.links[to].units()
    }

    /// The error of a signal that a relative tolerance allows.
    #[inline]
    #[must_use]
    pub fn allowed_error(&self, signal: SignalIndex, tolerance: f64) -> f64 {
        let size = self.origins[signal].size;
        let value = self.signal(signal).now()[0].abs();
        tolerance * size.fixed.unwrap_or(value.max(size.nominal))
    }

    /// The error of a signal's extrapolation at the end of the step. Zero for a signal that jumps at
    /// the beginning of the step: a smaller step would not predict it better.
    #[inline]
    #[must_use]
    pub fn prediction_error(&self, signal: SignalIndex) -> f64 {
        let signal = self.signal(signal);
        if signal.is_held() || signal.jumps() {
            return 0.0;
        }
        (signal.now()[0] - signal.predicted()[0]).abs()
    }
}
