//! How units are stepped together. One file per algorithm, behind [`Algorithm`].
//!
//! An algorithm sees units through [`Unit`] and signals through [`Exchange`]; neither knows FMI, so
//! algorithms are tested on plain functions. FMI 2.0 forbids reading an output after an input was
//! set without a step between, so the outputs at a communication point are those that the unit
//! gives at the end of its step.

mod gauss_seidel;
mod jacobi;
pub mod signal;

use std::ffi::CString;

use serde::{Deserialize, Serialize};

pub use gauss_seidel::GaussSeidel;
pub use jacobi::Jacobi;
use signal::{Signal, Taylor};

/// What an algorithm needs of a unit. `E` is its error.
pub trait Unit {
    /// Why a unit fails.
    type Error;

    /// Takes the inputs of the coming step.
    ///
    /// # Errors
    /// The unit refuses them.
    fn send(&mut self, inputs: &Inputs) -> Result<(), Self::Error>;

    /// Begins the step that the next [`step`](Self::step) ends, for units that work elsewhere while
    /// others begin theirs.
    ///
    /// # Errors
    /// The unit fails.
    #[inline]
    fn begin_step(&mut self, time: f64, size: f64) -> Result<(), Self::Error> {
        let _ = (time, size);
        Ok(())
    }

    /// Advances from `time` over `size`.
    ///
    /// # Errors
    /// The unit fails.
    fn step(&mut self, time: f64, size: f64) -> Result<(), Self::Error>;

    /// Gives the outputs at the end of its last step, which is `time`.
    ///
    /// # Errors
    /// The unit fails, or a value is unusable.
    fn receive(&mut self, time: f64, outputs: &mut Outputs) -> Result<(), Self::Error>;
}

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
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
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

impl Outputs {
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
}

/// The source of an input that is held over the step: unit and output.
pub type HeldLink = (usize, usize);

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
    /// Number of Integer outputs.
    pub integer_outputs: usize,
    /// Number of Boolean outputs.
    pub boolean_outputs: usize,
    /// Number of String outputs.
    pub string_outputs: usize,
}

struct Source {
    signal: u32,
    limit: u32,
    factor: f64,
    offset: f64,
}

/// All signals between the units and their history: flat, made once, no allocation after.
pub struct Exchange {
    /// all Real outputs of all units; those of unit k are `first[k]..first[k + 1]`
    signals: Vec<Signal>,
    first: Vec<usize>,
    /// all Real inputs of all units
    sources: Vec<Vec<Source>>,
    links: Vec<Links>,
    inputs: Vec<Inputs>,
    outputs: Vec<Outputs>,
}

/// Everything of an [`Exchange`] that changes from step to step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExchangeState {
    signals: Vec<Signal>,
    outputs: Vec<Outputs>,
}

impl Exchange {
    /// What has to be kept to go on from this communication point later.
    #[must_use]
    pub fn state(&self) -> ExchangeState {
        ExchangeState { signals: self.signals.clone(), outputs: self.outputs.clone() }
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

    /// Lays out the signals; `degree` is that of the extrapolation.
    #[must_use]
    pub fn new(links: Vec<Links>, degree: usize) -> Self {
        let mut first = vec![0];
        let mut signals = Vec::new();
        for unit in &links {
            signals.extend(unit.offered.iter().map(|&offered| Signal::new(offered, degree)));
            first.push(signals.len());
        }
        let sources = links
            .iter()
            .map(|unit| {
                unit.reals
                    .iter()
                    .map(|link| Source {
                        signal: u32::try_from(first[link.unit] + link.output).unwrap_or(u32::MAX),
                        limit: u32::try_from(link.limit).unwrap_or(3),
                        factor: link.factor,
                        offset: link.offset,
                    })
                    .collect()
            })
            .collect();
        let inputs = links
            .iter()
            .map(|unit| Inputs {
                reals: vec![[0.0; 4]; unit.reals.len()],
                integers: vec![0; unit.integers.len()],
                booleans: vec![0; unit.booleans.len()],
                strings: vec![CString::default(); unit.strings.len()],
            })
            .collect();
        let outputs = links
            .iter()
            .map(|unit| Outputs {
                reals: vec![[0.0; 4]; unit.offered.len()],
                integers: vec![0; unit.integer_outputs],
                booleans: vec![0; unit.boolean_outputs],
                strings: vec![CString::default(); unit.string_outputs],
            })
            .collect();
        Self { signals, first, sources, links, inputs, outputs }
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
    /// A unit's.
    pub fn start<U: Unit>(&mut self, time: f64, units: &mut [U]) -> Result<(), U::Error> {
        for (k, unit) in units.iter_mut().enumerate() {
            unit.receive(time, &mut self.outputs[k])?;
            let signals = &mut self.signals[self.first[k]..self.first[k + 1]];
            for (signal, now) in signals.iter_mut().zip(&self.outputs[k].reals) {
                signal.restart(*now);
            }
        }
        Ok(())
    }

    /// Sets the highest derivative that each Real input of a unit takes.
    pub fn limit(&mut self, k: usize, highest: impl IntoIterator<Item = usize>) {
        for (source, limit) in self.sources[k].iter_mut().zip(highest) {
            source.limit = u32::try_from(limit).unwrap_or(3);
        }
    }

    /// Represents every signal over the coming step by data up to its beginning.
    #[inline]
    pub fn extrapolate(&mut self, size: f64) {
        for signal in &mut self.signals {
            signal.extrapolate(size);
        }
    }

    /// Sends a unit its inputs as the signals stand now.
    ///
    /// # Errors
    /// The unit's.
    #[inline]
    pub fn send<U: Unit>(&mut self, k: usize, unit: &mut U, size: f64) -> Result<(), U::Error> {
        let inputs = &mut self.inputs[k];
        for (input, source) in inputs.reals.iter_mut().zip(&self.sources[k]) {
            let p = self.signals[source.signal as usize].polynomial(source.limit as usize, size);
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
        unit.send(inputs)
    }

    /// Reads a unit's outputs after its step, which ended at `time`.
    ///
    /// # Errors
    /// The unit's.
    #[inline]
    pub fn receive<U: Unit>(&mut self, k: usize, unit: &mut U, time: f64) -> Result<(), U::Error> {
        unit.receive(time, &mut self.outputs[k])?;
        let signals = &mut self.signals[self.first[k]..self.first[k + 1]];
        for (signal, now) in signals.iter_mut().zip(&self.outputs[k].reals) {
            signal.advance(*now);
        }
        Ok(())
    }

    /// Represents a unit's signals by interpolation: it has stepped to the end of the step.
    #[inline]
    pub fn interpolate(&mut self, k: usize, size: f64) {
        for signal in &mut self.signals[self.first[k]..self.first[k + 1]] {
            signal.interpolate(size);
        }
    }
}

/// A way to step all units over one communication step.
pub trait Algorithm<U: Unit> {
    /// Steps all units from `time` over `size`, and the exchange with them.
    ///
    /// # Errors
    /// The first unit's that fails.
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error>;

    /// Whether the source has stepped before the target sends for its inputs.
    fn interpolates(&self, source: usize, target: usize) -> bool;

    /// What the algorithm itself remembers from step to step, for a checkpoint; most remember
    /// nothing.
    fn state(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Goes back to such a state; false if it is not one of this algorithm's.
    fn restore(&mut self, state: &[u8]) -> bool {
        state.is_empty()
    }
}

#[cfg(test)]
mod tests;
