//! Jacobi: all inputs from data at the step's beginning, then all units step.
//!
//! The units are independent during a step. With inputs extrapolated to degree N the coupling is
//! of order N + 1 until the units' own errors show (Kübler & Schiehlen 2000, "Two methods of
//! simulator coupling"). Needs nothing of a unit but steps; uses `canInterpolateInputs` and output
//! derivatives where they are on offer.

use std::sync::Arc;

use super::crew::{Phase, Task};
use super::{Algorithm, Crew, Exchange, Unit};

/// All inputs from the beginning of the step, then all units step.
pub struct Jacobi {
    phase: Phase,
    crew: Arc<Crew>,
}

impl Jacobi {
    /// Steps these units.
    #[must_use]
    pub fn new(_: &Exchange, members: Vec<usize>, crew: Arc<Crew>) -> Self {
        Self { phase: Phase::new(members), crew }
    }
}

impl<U: Unit> Algorithm<U> for Jacobi {
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        self.crew.step(exchange, units, &self.phase, Task { time, size, again: false })?;
        for &k in &self.phase.members {
            exchange.take(k, size);
        }
        Ok(())
    }

    fn members(&self) -> &[usize] {
        &self.phase.members
    }
}
