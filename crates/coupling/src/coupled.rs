//! All units over one step: one algorithm after the other, in the order of the [`Schedule`].

use std::sync::Arc;

use super::algorithm::Algorithm;
use super::exchange::Exchange;
use super::gauss_seidel::GaussSeidel;
use super::iterated::Iterated;
use super::jacobi::Jacobi;
use super::newton::Newton;
use super::schedule::{Schedule, StepGroup};
use super::unit::Unit;
use super::workers::Workers;
use results::summary::Iteration;
use scenario::algorithm::AlgorithmName;

/// The algorithms that together step all units.
pub struct Coupling<U> {
    algorithms: Vec<Box<dyn Algorithm<U>>>,
}

impl<U: Unit> Coupling<U> {
    /// Creates the algorithms of a schedule.
    #[must_use]
    pub fn new(schedule: &Schedule, exchange: &Exchange, workers: &Arc<Workers>) -> Self {
        let create = |group: &StepGroup| -> Box<dyn Algorithm<U>> {
            let (members, workers) = (group.members.clone(), Arc::clone(workers));
            let settings = group.iteration;
            match group.name {
                AlgorithmName::Jacobi => Box::new(Jacobi::new(members, workers)),
                AlgorithmName::GaussSeidel => {
                    Box::new(GaussSeidel::new(exchange, members, workers))
                }
                AlgorithmName::Iterated => {
                    Box::new(Iterated::new(exchange, members, settings, workers))
                }
                AlgorithmName::Newton => {
                    Box::new(Newton::new(exchange, members, settings, workers))
                }
            }
        };
        Self { algorithms: schedule.groups.iter().map(create).collect() }
    }

    /// Steps all units from `time` by `size` and updates their signals.
    ///
    /// # Errors
    /// The first failure in the order of the schedule.
    pub fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        exchange.extrapolate(size);
        exchange.fill_given(time, size);
        let last = self.algorithms.len().saturating_sub(1);
        for (n, algorithm) in self.algorithms.iter_mut().enumerate() {
            algorithm.step(exchange, units, time, size)?;
            for &k in algorithm.members().iter().filter(|_| n < last) {
                exchange.interpolate(k, size);
            }
        }
        Ok(())
    }

    /// Convergence of the algorithms that iterate, in the order of the schedule.
    pub fn iterations(&self) -> impl Iterator<Item = &Iteration> {
        self.algorithms.iter().filter_map(|algorithm| algorithm.iteration())
    }

    /// Whether all iterations of the last step converged.
    #[must_use]
    pub fn converged(&self) -> bool {
        self.iterations().all(|iteration| iteration.settled)
    }

    /// What the algorithms remember from step to step, for a checkpoint.
    #[must_use]
    pub fn state(&self) -> Vec<Vec<u8>> {
        self.algorithms.iter().map(|algorithm| algorithm.state()).collect()
    }

    /// Restores such a state; false if it does not fit these algorithms.
    #[must_use]
    pub fn restore(&mut self, state: &[Vec<u8>]) -> bool {
        self.algorithms.len() == state.len()
            && self.algorithms.iter_mut().zip(state).all(|(it, state)| it.restore(state))
    }
}
