//! What changes in an exchange from step to step, to save and restore.

use serde::{Deserialize, Serialize};

use super::Exchange;
use crate::links::UnitValues;
use crate::signal::Signal;

/// Everything in an [`Exchange`] that changes from step to step and is needed to continue.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExchangeState {
    pub(super) signals: Vec<Signal>,
    pub(crate) outputs: Vec<UnitValues>,
    /// values that are not Real at the beginning of the current step
    pub(super) begin: Vec<UnitValues>,
    /// the same for the step before
    pub(super) before: Vec<UnitValues>,
}

impl Clone for ExchangeState {
    fn clone(&self) -> Self {
        Self {
            signals: self.signals.clone(),
            outputs: self.outputs.clone(),
            begin: self.begin.clone(),
            before: self.before.clone(),
        }
    }

    // reuses the memory, unlike the derived one: steps do not allocate
    fn clone_from(&mut self, other: &Self) {
        self.signals.clone_from(&other.signals);
        self.outputs.clone_from(&other.outputs);
        self.begin.clone_from(&other.begin);
        self.before.clone_from(&other.before);
    }
}

impl ExchangeState {
    /// Whether both states belong to the same connections.
    fn is_like(&self, other: &Self) -> bool {
        let like = |a: &[UnitValues], b: &[UnitValues]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.lengths() == b.lengths())
        };
        self.signals.len() == other.signals.len()
            && self.signals.iter().zip(&other.signals).all(|(a, b)| a.is_like(b))
            && like(&self.outputs, &other.outputs)
            && like(&self.begin, &other.begin)
            && like(&self.before, &other.before)
    }
}

impl Exchange {
    /// The state at this communication point. [`clone_from`](Clone::clone_from) reuses memory.
    #[must_use]
    pub fn state(&self) -> &ExchangeState {
        &self.now
    }

    /// Restores a state. False, and nothing changes, if it belongs to other connections.
    #[must_use]
    pub fn restore(&mut self, state: &ExchangeState) -> bool {
        let alike = self.now.is_like(state);
        if alike {
            self.now.clone_from(state);
        }
        alike
    }
}
