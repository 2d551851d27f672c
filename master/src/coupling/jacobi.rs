//! Jacobi: all inputs from data at the step's beginning, then all units step.
//!
//! The units are independent during a step. With inputs extrapolated to degree N the coupling is
//! of order N + 1 until the units' own errors show (Kübler & Schiehlen 2000, "Two methods of
//! simulator coupling"). Needs nothing of a unit but steps; uses `canInterpolateInputs` and output
//! derivatives where they are on offer.

use super::{Algorithm, Exchange, Unit};

/// All inputs from the beginning of the step, then all units step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Jacobi;

impl<U: Unit> Algorithm<U> for Jacobi {
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        exchange.extrapolate(size);
        for (k, unit) in units.iter_mut().enumerate() {
            exchange.send(k, unit, size)?;
            unit.begin_step(time, size)?;
        }
        for unit in units.iter_mut() {
            unit.step(time, size)?;
        }
        for (k, unit) in units.iter_mut().enumerate() {
            exchange.receive(k, unit, time + size)?;
        }
        Ok(())
    }

    fn interpolates(&self, _source: usize, _target: usize) -> bool {
        false
    }
}
