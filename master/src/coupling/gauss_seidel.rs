//! Gauss-Seidel: the units step one after the other.
//!
//! An input whose source comes later in the sequence is extrapolated, as in
//! [Jacobi](super::Jacobi); one whose source has already stepped is interpolated between both ends
//! of the step, which is more exact and more stable. One pass, no iteration. The sequence matters:
//! units whose outputs react at once to their inputs (feed-through) step late, those with smooth
//! outputs first.

use super::{Algorithm, Exchange, Unit};

/// Units step one after the other; who steps later sees the ends of those before.
#[derive(Debug, Clone)]
pub struct GaussSeidel {
    order: Vec<usize>,
    rank: Vec<usize>,
}

impl GaussSeidel {
    /// Steps the units in the order given: a permutation of `0..n`.
    #[must_use]
    pub fn new(order: Vec<usize>) -> Self {
        let mut rank = vec![0; order.len()];
        for (position, &unit) in order.iter().enumerate() {
            rank[unit] = position;
        }
        Self { order, rank }
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
        exchange.extrapolate(size);
        for &k in &self.order {
            let unit = &mut units[k];
            exchange.send(k, unit, size)?;
            unit.step(time, size)?;
            exchange.receive(k, unit, time + size)?;
            exchange.interpolate(k, size);
        }
        Ok(())
    }

    fn interpolates(&self, source: usize, target: usize) -> bool {
        self.rank[source] < self.rank[target]
    }
}
