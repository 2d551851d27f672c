//! How units are stepped together. One file per algorithm, behind [`Algorithm`].
//!
//! An algorithm sees units through [`Unit`] and signals through [`Exchange`]; neither knows FMI, so
//! algorithms are tested on plain functions. FMI 2.0 forbids reading an output after an input was
//! set without a step between, so the outputs at a communication point are those that the unit
//! gives at the end of its step.
//!
//! A [`Coupling`] puts algorithms, each with the units that are its members, one after the other;
//! a [`Control`] chooses the size of its steps.

pub(crate) mod acceleration;
mod control;
mod coupled;
mod crew;
mod exchange;
mod gauss_seidel;
mod interface;
mod iterated;
mod jacobi;
mod layout;
mod links;
mod newton;
mod power;
pub mod signal;

use results::summary::Iteration;

pub use control::Control;
pub use coupled::{Block, Blueprint, Coupling};
pub use crew::Crew;
pub use exchange::{Exchange, ExchangeState, SignalId};
pub use gauss_seidel::GaussSeidel;
pub use iterated::Iterated;
pub use jacobi::Jacobi;
pub use links::{
    HeldLink, Input, Inputs, IntegerLink, Links, Outputs, RealLink, Size, Whole, WholeLink,
    WholeOutput,
};
pub use newton::Newton;
pub use power::PowerMeter;

/// What a unit can do besides being stepped on. An algorithm takes units as they are: what it does
/// with one that lacks a capability stands with the algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Capabilities {
    /// Its state can be saved and restored, so that a step can be made again.
    pub restore: bool,
    /// Its steps may be of any size.
    pub variable_step: bool,
    /// It gives derivatives of its outputs with respect to its inputs.
    pub directional: bool,
}

/// What an algorithm needs of a unit. `Error` is its error.
pub trait Unit: Send {
    /// Why a unit fails.
    type Error: Send;

    /// What it can do besides being stepped on.
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    /// Takes the inputs of the coming step.
    ///
    /// # Errors
    /// The unit refuses them.
    fn send(&mut self, inputs: &Inputs) -> Result<(), Self::Error>;

    /// Takes the inputs at the start, their values only; no step needs to follow.
    ///
    /// # Errors
    /// The unit refuses them.
    fn preset(&mut self, inputs: &Inputs) -> Result<(), Self::Error> {
        let _ = inputs;
        Ok(())
    }

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

    /// Keeps the present state in one of a few numbered places; only asked of units with
    /// [`Capabilities::restore`].
    ///
    /// # Errors
    /// The unit fails.
    fn save(&mut self, place: usize) -> Result<(), Self::Error> {
        let _ = place;
        Ok(())
    }

    /// Returns to the state that was saved last in that place.
    ///
    /// # Errors
    /// The unit fails.
    fn restore(&mut self, place: usize) -> Result<(), Self::Error> {
        let _ = place;
        Ok(())
    }

    /// Derivatives of all Real outputs with respect to one Real input, at the end of the last step;
    /// only asked of units with [`Capabilities::directional`]. Inputs and outputs are those of the
    /// unit's [`Links`], in that order.
    ///
    /// # Errors
    /// The unit fails.
    fn directional(&mut self, input: usize, column: &mut [f64]) -> Result<(), Self::Error> {
        let _ = input;
        column.fill(0.0);
        Ok(())
    }
}

/// Number of places for saved states that a unit needs.
pub const PLACES: usize = 2;
/// Where iterations save the states at a step's beginning.
const ITERATION: usize = 0;
/// Where step control does, around iterations.
const CONTROL: usize = 1;

/// A way to step some units, its members, over one communication step.
///
/// Before, all signals are represented by extrapolation; those of units that have stepped already
/// by interpolation. After, those of the members are at the end of the step.
pub trait Algorithm<U: Unit>: Send {
    /// Steps the members from `time` over `size`, and the exchange with them.
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

    /// The units that it steps.
    fn members(&self) -> &[usize];

    /// How its iterations went, of algorithms that iterate.
    fn iteration(&self) -> Option<&Iteration> {
        None
    }

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
