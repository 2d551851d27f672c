//! What algorithms need of a unit.

use super::index::InputIndex;
use super::links::UnitValues;

/// What a unit can do beyond plain steps. Each algorithm documents what it does without a capability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Capabilities {
    /// Its state can be saved and restored, so that a step can be repeated.
    pub restore: bool,
    /// Its steps may have any size.
    pub variable_step: bool,
    /// It computes derivatives of its outputs with respect to its inputs.
    pub directional: bool,
}

/// A unit that can be stepped.
pub trait Unit: Send {
    /// Why a call to the unit failed.
    type Error: Send;

    /// What it can do beyond plain steps.
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    /// Takes the inputs of the next step.
    ///
    /// # Errors
    /// The unit refuses them.
    fn send(&mut self, inputs: &UnitValues) -> Result<(), Self::Error>;

    /// Takes the values of the inputs at the start, without their derivatives. A step need not follow.
    ///
    /// # Errors
    /// The unit refuses them.
    fn preset(&mut self, inputs: &UnitValues) -> Result<(), Self::Error> {
        let _ = inputs;
        Ok(())
    }

    /// Begins the step that the next [`step`](Self::step) finishes. Units in processes of their own
    /// compute while others begin their steps.
    ///
    /// # Errors
    /// The unit fails.
    #[inline]
    fn begin_step(&mut self, time: f64, size: f64) -> Result<(), Self::Error> {
        let _ = (time, size);
        Ok(())
    }

    /// Advances from `time` by `size`.
    ///
    /// # Errors
    /// The unit fails.
    fn step(&mut self, time: f64, size: f64) -> Result<(), Self::Error>;

    /// Writes the outputs at `time`, the end of its last step.
    ///
    /// # Errors
    /// The unit fails, or a value cannot be used.
    fn receive(&mut self, time: f64, outputs: &mut UnitValues) -> Result<(), Self::Error>;

    /// Saves the state in one of [`PLACES`] places. Called only if [`Capabilities::restore`] is true.
    ///
    /// # Errors
    /// The unit fails.
    fn save(&mut self, place: usize) -> Result<(), Self::Error> {
        let _ = place;
        Ok(())
    }

    /// Restores the state that was last saved in that place.
    ///
    /// # Errors
    /// The unit fails.
    fn restore(&mut self, place: usize) -> Result<(), Self::Error> {
        let _ = place;
        Ok(())
    }

    /// Derivatives of all Real outputs with respect to one Real input at the end of the last step.
    /// Called only if [`Capabilities::directional`] is true. Inputs and outputs are numbered as in the
    /// unit's [`Links`](super::Links).
    ///
    /// # Errors
    /// The unit fails.
    fn directional(&mut self, input: InputIndex, column: &mut [f64]) -> Result<(), Self::Error> {
        let _ = input;
        column.fill(0.0);
        Ok(())
    }
}

/// Number of places for saved states that a unit needs.
pub const PLACES: usize = 3;
/// Place of the states at the beginning of a step that is iterated.
pub(super) const ITERATION: usize = 0;
/// Place of the states at the beginning of a step of variable size.
pub(super) const CONTROL: usize = 1;
/// Place of the states at a [`Mark`](super::Mark).
pub(super) const MARK: usize = 2;
