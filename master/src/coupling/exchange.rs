//! All signals between the units and their history, and what each unit gets and gives.
//!
//! What is not Real is held over a step from its beginning on, as Real signals that change at
//! communication points only are. A unit with held inputs, or one that such a unit feeds, *feels* their
//! changes: its outputs jump or kink at the beginning of the step ([`Effect`]).

use std::ffi::CString;

use serde::{Deserialize, Serialize};

use super::Unit;
use super::layout::{Form, Source, feels, lay_out, most_inputs, sources, whole_inputs};
use super::links::{Input, Inputs, Links, Outputs, RealLink, Size, WholeOutput};
use super::signal::{Effect, Signal};

/// A signal's number: one per Real output and way to represent it over a step.
pub type SignalId = usize;

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
    begin: Vec<Outputs>,
    before: Vec<Outputs>,
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
    /// what is not Real at the beginning of the current step, and of the step before; only of the
    /// units that give such things
    begin: Vec<Outputs>,
    before: Vec<Outputs>,
    givers: Vec<usize>,
    /// per unit, the Real inputs that no Real output feeds
    whole_inputs: Vec<Vec<usize>>,
    /// per unit, whether it feels jumps
    feels: Vec<bool>,
    felt: Vec<(Input, Effect)>,
}

impl Exchange {
    /// Lays out the signals; `degree` is that of the extrapolation where a link has no other.
    #[must_use]
    pub fn new(links: Vec<Links>, degree: usize) -> Self {
        let (forms, places) = lay_out(&links, degree);
        let (mut first, mut signals, mut origins) = (vec![0], Vec::new(), Vec::new());
        for (unit, forms) in forms.iter().enumerate() {
            for &Form { output, degree, held } in forms {
                let size = links[unit].sizes.get(output).copied().unwrap_or_default();
                let offered = links[unit].offered[output];
                signals.push(if held { Signal::held() } else { Signal::new(offered, degree) });
                origins.push(Origin { unit, output, size });
            }
            first.push(signals.len());
        }
        let signal_of =
            |link: &RealLink| first[link.unit] + places[&(link.unit, Form::of(link, degree))];
        let sources = links.iter().map(|unit| sources(unit, signal_of)).collect();
        let inputs = links
            .iter()
            .map(|unit| Inputs {
                reals: vec![[0.0; 4]; unit.real_inputs()],
                integers: vec![0; unit.integers.len()],
                booleans: vec![0; unit.booleans.len()],
                strings: vec![CString::default(); unit.strings.len()],
            })
            .collect();
        let outputs: Vec<Outputs> = links.iter().map(Outputs::of).collect();
        let held = |unit: &Outputs| Outputs { reals: Vec::new(), ..unit.clone() };
        let begin: Vec<Outputs> = outputs.iter().map(held).collect();
        let givers = (0..links.len()).filter(|&k| links[k].has_held_outputs()).collect();
        let (feels, felt) = (feels(&links), Vec::with_capacity(most_inputs(&links)));
        let before = begin.clone();
        let whole_inputs = links.iter().map(whole_inputs).collect();
        Self {
            signals,
            origins,
            first,
            sources,
            links,
            inputs,
            outputs,
            begin,
            before,
            givers,
            whole_inputs,
            feels,
            felt,
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

    /// What has to be kept to go on from this communication point later.
    #[must_use]
    pub fn state(&self) -> ExchangeState {
        ExchangeState {
            signals: self.signals.clone(),
            outputs: self.outputs.clone(),
            begin: self.begin.clone(),
            before: self.before.clone(),
        }
    }

    /// The same into memory that is there already.
    pub fn keep(&self, state: &mut ExchangeState) {
        state.signals.clone_from(&self.signals);
        state.outputs.clone_from(&self.outputs);
        state.begin.clone_from(&self.begin);
        state.before.clone_from(&self.before);
    }

    /// Goes back to a state; false, and nothing is changed, if it is not of the same connections.
    #[must_use]
    pub fn restore(&mut self, state: &ExchangeState) -> bool {
        let like = |a: &[Outputs], b: &[Outputs]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is_like(b))
        };
        let alike = self.signals.len() == state.signals.len()
            && self.signals.iter().zip(&state.signals).all(|(a, b)| a.is_like(b))
            && like(&self.outputs, &state.outputs)
            && like(&self.begin, &state.begin)
            && like(&self.before, &state.before);
        if alike {
            self.signals.clone_from(&state.signals);
            self.outputs.clone_from(&state.outputs);
            self.begin.clone_from(&state.begin);
            self.before.clone_from(&state.before);
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
        for &k in &self.givers {
            self.begin[k].keep_held(&self.outputs[k]);
            self.before[k].keep_held(&self.outputs[k]);
        }
        Ok(())
    }

    /// Sets all inputs at the start to what the outputs have given there. No unit may be read after
    /// that and before its first step.
    ///
    /// # Errors
    /// A unit's.
    pub fn hand_over<U: Unit>(&mut self, units: &mut [U]) -> Result<(), U::Error> {
        self.extrapolate(0.0);
        for (k, unit) in units.iter_mut().enumerate() {
            self.fill(k, 0.0);
            unit.preset(&self.inputs[k])?;
        }
        Ok(())
    }

    /// Notes that a unit's Real output is from before a jump that the unit makes with its first step.
    pub fn expect_jump(&mut self, k: usize, output: usize) {
        for s in self.signals_of(k) {
            if self.origins[s].output == output {
                self.signals[s].expect_jump();
            }
        }
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
        let highest: Vec<usize> = highest.into_iter().collect();
        for source in &mut self.sources[k] {
            source.limit = highest.get(source.input).copied().unwrap_or(source.limit);
        }
    }

    /// Represents every signal over the coming step by data up to its beginning.
    #[inline]
    pub fn extrapolate(&mut self, size: f64) {
        for signal in &mut self.signals {
            signal.extrapolate(size);
        }
        for &k in &self.givers {
            std::mem::swap(&mut self.begin[k], &mut self.before[k]);
            self.begin[k].keep_held(&self.outputs[k]);
        }
    }

    /// Makes a unit's inputs of the signals as they stand now.
    #[inline]
    pub fn fill(&mut self, k: usize, size: f64) {
        let inputs = &mut self.inputs[k];
        for source in &self.sources[k] {
            let p = self.signals[source.signal].polynomial(source.limit, size);
            let a = source.factor;
            let term = [a * p[0] + source.offset, a * p[1], a * p[2], a * p[3]];
            let input = &mut inputs.reals[source.input];
            if source.first {
                *input = term;
            } else {
                input.iter_mut().zip(term).for_each(|(input, term)| *input += term);
            }
        }
        if self.feels[k] {
            self.fill_held(k);
            self.feel(k);
        }
    }

    /// The inputs that come from what is not Real.
    fn fill_held(&mut self, k: usize) {
        let (inputs, links, begin) = (&mut self.inputs[k], &self.links[k], &self.begin);
        for &input in &self.whole_inputs[k] {
            inputs.reals[input][0] = 0.0;
        }
        for link in &links.wholes {
            let value = f64::from(begin[link.from.0].whole(link.from));
            inputs.reals[link.input][0] += link.factor * value + link.offset;
        }
        for (input, link) in inputs.integers.iter_mut().zip(&links.integers) {
            *input = link.convert(begin[link.from.0].whole(link.from));
        }
        for (input, &(unit, output)) in inputs.booleans.iter_mut().zip(&links.booleans) {
            *input = begin[unit].booleans[output];
        }
        for (input, &(unit, output)) in inputs.strings.iter_mut().zip(&links.strings) {
            input.clone_from(&begin[unit].strings[output]);
        }
    }

    /// What the jumps of a unit's inputs at the beginning of the step do to its outputs.
    fn feel(&mut self, k: usize) {
        let Self { signals, sources, links, felt, begin, before, .. } = self;
        let links = &links[k];
        felt.clear();
        let of = |source: &Source| (Input::Real(source.input), signals[source.signal].felt());
        felt.extend(sources[k].iter().map(of));
        let effect = |changed: bool| if changed { Effect::Jump } else { Effect::None };
        let whole =
            |from: WholeOutput| effect(begin[from.0].whole(from) != before[from.0].whole(from));
        felt.extend(links.wholes.iter().map(|link| (Input::Real(link.input), whole(link.from))));
        let integers = links.integers.iter().enumerate();
        felt.extend(integers.map(|(k, link)| (Input::Integer(k), whole(link.from))));
        for (k, &(unit, output)) in links.booleans.iter().enumerate() {
            let changed = begin[unit].booleans[output] != before[unit].booleans[output];
            felt.push((Input::Boolean(k), effect(changed)));
        }
        for (k, &(unit, output)) in links.strings.iter().enumerate() {
            let changed = begin[unit].strings[output] != before[unit].strings[output];
            felt.push((Input::String(k), effect(changed)));
        }
        felt.retain(|(_, effect)| *effect != Effect::None);
        let mine = self.first[k]..self.first[k + 1];
        for (signal, origin) in signals[mine.clone()].iter_mut().zip(&self.origins[mine]) {
            let output = origin.output;
            let reaction = |&(input, effect): &(Input, Effect)| match effect {
                effect if links.is_direct(output, input) => effect,
                Effect::Jump => Effect::Kink,
                _ => Effect::None,
            };
            let mut worst = Effect::None;
            for effect in felt.iter().map(reaction) {
                worst = worst.max(effect);
                if worst == Effect::Jump {
                    break;
                }
            }
            signal.react(worst);
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

    /// The signals that feed a unit's Real inputs: which input, which signal, with what factor.
    pub fn sources(&self, k: usize) -> impl Iterator<Item = (usize, SignalId, f64)> + '_ {
        self.sources[k].iter().map(|source| (source.input, source.signal, source.factor))
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

    /// The units whose outputs feed inputs of a unit, some of them more than once.
    pub fn feeders(&self, to: usize) -> impl Iterator<Item = usize> + '_ {
        self.links[to].units()
    }

    /// What an error of a signal may be for a relative tolerance.
    #[must_use]
    pub fn allowed(&self, signal: SignalId, tolerance: f64) -> f64 {
        let size = self.origins[signal].size;
        let value = self.signals[signal].now()[0].abs();
        tolerance * size.fixed.unwrap_or(value.max(size.nominal))
    }

    /// By how much a signal was extrapolated wrongly up to the end of the step. What jumps at the
    /// beginning of a step, a smaller one would not predict better: no surprise.
    #[must_use]
    pub fn surprise(&self, signal: SignalId) -> f64 {
        let signal = &self.signals[signal];
        if signal.is_held() || signal.jumps() {
            return 0.0;
        }
        (signal.now()[0] - signal.predicted()[0]).abs()
    }
}
