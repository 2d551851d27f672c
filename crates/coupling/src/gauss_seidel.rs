//! Gauss-Seidel: the units step one after the other.
//!
//! An input whose source comes later in the order is extrapolated, as in
//! [Jacobi](super::Jacobi); one whose source has already stepped is interpolated between both ends
//! of the step, which is more exact and more stable. One pass, no iteration. The order matters:
//! units with direct feed-through step late, units with smooth outputs first. Neighbours in the order
//! that do not feed each other may step at the same time.

use std::sync::Arc;

use super::algorithm::Algorithm;
use super::exchange::Exchange;
use super::index::UnitIndex;
use super::unit::Unit;
use super::workers::{Phase, Task, Workers};

/// Units step one after the other. Later ones see where earlier ones have ended.
pub struct GaussSeidel {
    order: Vec<UnitIndex>,
    phases: Vec<Phase>,
    workers: Arc<Workers>,
}

impl GaussSeidel {
    /// Steps the units in the order given.
    #[must_use]
    pub fn new(exchange: &Exchange, order: Vec<UnitIndex>, workers: Arc<Workers>) -> Self {
        let phases = Phase::divide(exchange, &order);
        Self { order, phases, workers }
    }
}

impl<U: Unit> Algorithm<U> for GaussSeidel {
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        for phase in &self.phases {
            self.workers.step(exchange, units, phase, Task { time, size, again: false })?;
            for &k in &phase.members {
                exchange.accept(k, size);
                exchange.interpolate(k, size);
            }
        }
        Ok(())
    }

    fn members(&self) -> &[UnitIndex] {
        &self.order
    }
}
