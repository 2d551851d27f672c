//! Iterated Gauss-Seidel: the step is repeated, from saved states, until its inputs agree with its
//! outputs (dynamic iteration, waveform relaxation: Lelarasmee 1982; Kübler & Schiehlen 2000).
//!
//! `sweeps.rs` defines unknowns and sweeps, `acceleration.rs` computes the next iterate. At
//! the end all inputs are interpolated, with an error of O(h⁴) where the sources provide first
//! derivatives: the coupling is of order 4 for any degree of extrapolation; with `order` 6 of O(h⁶), where
//! they provide second derivatives too. It is implicit, hence
//! stable at steps where explicit couplings are not. A step whose first sweep already ends within
//! the tolerance of its prediction costs one step of each unit.
//!
//! It needs saved states, and for its order output derivatives and interpolated inputs.

use std::sync::Arc;

use super::acceleration::Accelerator;
use super::algorithm::Algorithm;
use super::exchange::Exchange;
use super::index::UnitIndex;
use super::sweeps::Sweeps;
use super::unit::Unit;
use super::workers::Workers;
use results::summary::Iteration;
use scenario::algorithm::IterationSettings;

/// Sweeps until the step's inputs agree with its outputs.
pub struct Iterated {
    sweeps: Sweeps,
    accelerator: Option<Accelerator>,
}

impl Iterated {
    /// Sweeps over the units in the order given.
    #[must_use]
    pub fn new(
        exchange: &Exchange,
        order: Vec<UnitIndex>,
        settings: IterationSettings,
        workers: Arc<Workers>,
    ) -> Self {
        Self { sweeps: Sweeps::new(exchange, order, settings, workers), accelerator: None }
    }
}

impl<U: Unit> Algorithm<U> for Iterated {
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        let sweeps = &mut self.sweeps;
        sweeps.begin(exchange, units, time, size)?;
        let settings = sweeps.settings;
        let accelerator = self.accelerator.get_or_insert_with(|| {
            Accelerator::new(settings.acceleration, settings.relaxation, sweeps.x.len())
        });
        accelerator.begin();
        let mut residual = sweeps.residual();
        let mut count = 1;
        while residual > 1.0 && count < settings.sweeps {
            accelerator.next(&mut sweeps.x, &sweeps.image, &sweeps.scales);
            sweeps.repeat(exchange, units, time, size)?;
            residual = sweeps.residual();
            count += 1;
        }
        sweeps.end(count, residual);
        Ok(())
    }

    fn members(&self) -> &[UnitIndex] {
        &self.sweeps.order
    }

    fn iteration(&self) -> Option<&Iteration> {
        Some(&self.sweeps.iteration)
    }
}
