//! Gauss-Seidel: the units step one after the other.
//!
//! An input whose source comes later in the sequence is extrapolated, as in
//! [Jacobi](super::Jacobi); one whose source has already stepped is interpolated between both ends
//! of the step, which is more exact and more stable. One pass, no iteration. The sequence matters:
//! units whose outputs react at once to their inputs (feed-through) step late, those with smooth
//! outputs first. Neighbours in the sequence that do not feed each other may step at once.

use std::sync::Arc;

use super::crew::{Phase, Task};
use super::{Algorithm, Crew, Exchange, Unit};

/// Units step one after the other; who steps later sees the ends of those before.
pub struct GaussSeidel {
    order: Vec<usize>,
    phases: Vec<Phase>,
    crew: Arc<Crew>,
}

impl GaussSeidel {
    /// Steps the units in the order given.
    #[must_use]
    pub fn new(exchange: &Exchange, order: Vec<usize>, crew: Arc<Crew>) -> Self {
        let phases = Phase::divide(exchange, &order);
        Self { order, phases, crew }
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
            self.crew.step(exchange, units, phase, Task { time, size, again: false })?;
            for &k in &phase.members {
                exchange.take(k, size);
                exchange.interpolate(k, size);
            }
        }
        Ok(())
    }

    fn members(&self) -> &[usize] {
        &self.order
    }
}
