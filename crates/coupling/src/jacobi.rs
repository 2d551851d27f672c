//! Jacobi: all inputs from data at the step's beginning, then all units step.
//!
//! The units are independent during a step. With inputs extrapolated to degree N the coupling is
//! of order N + 1 until the units' own errors show (Kübler & Schiehlen 2000, "Two methods of
//! simulator coupling"). It needs only plain steps; it uses `canInterpolateInputs` and output
//! derivatives where units have them.

use std::sync::Arc;

use super::algorithm::Algorithm;
use super::exchange::Exchange;
use super::index::UnitIndex;
use super::unit::Unit;
use super::workers::{Phase, Task, Workers};

/// All inputs from the beginning of the step, then all units step.
pub struct Jacobi {
    phase: Phase,
    workers: Arc<Workers>,
}

impl Jacobi {
    /// Steps these units.
    #[must_use]
    pub fn new(members: Vec<UnitIndex>, workers: Arc<Workers>) -> Self {
        Self { phase: Phase::new(members), workers }
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
        self.workers.step(exchange, units, &self.phase, Task { time, size, again: false })?;
        for &k in &self.phase.members {
            exchange.accept(k, size);
        }
        Ok(())
    }

    fn members(&self) -> &[UnitIndex] {
        &self.phase.members
    }
}
