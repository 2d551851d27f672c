//! The interface of coupling algorithms.

use results::summary::Iteration;

use super::exchange::Exchange;
use super::index::UnitIndex;
use super::unit::Unit;

/// A way to step some units, its members, over one communication step.
///
/// Before the step, all signals are extrapolated, except for those of units that have stepped already:
/// they are interpolated. After it, the signals of the members have reached the end of the step.
pub trait Algorithm<U: Unit>: Send {
    /// Steps the members from `time` by `size` and updates their signals.
    ///
    /// # Errors
    /// The first failure in the order of the members.
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error>;

    /// The units that it steps.
    fn members(&self) -> &[UnitIndex];

    /// Convergence of its iterations; `None` if it does not iterate.
    fn iteration(&self) -> Option<&Iteration> {
        None
    }

    /// What it remembers from step to step, for a checkpoint. Most algorithms remember nothing.
    fn state(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Restores such a state; false if it does not fit this algorithm.
    fn restore(&mut self, state: &[u8]) -> bool {
        state.is_empty()
    }
}
