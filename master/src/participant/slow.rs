//! Units that make one step in every so many communication steps.
//!
//! With n communication steps of size h, the unit steps from t to t + n·h. It exchanges values at its own
//! communication points only. Its inputs are the polynomials at t, up to the derivative that it takes
//! and that the algorithm extrapolates. Its outputs are those at t until it has reached t + n·h, where
//! they change like those of a sampled system.
//!
//! The step is made in the last of the n communication steps. Until then the instance stays at t and
//! is not called, so its state can be saved and restored in between.

use serde::{Deserialize, Serialize};

use super::Participant;
use coupling::{PLACES, UnitValues};
use fmi2_import::instance::FmuError;
use fmi2_import::span::between;

/// State of a unit that does not step in every communication step.
#[derive(Debug)]
pub(super) struct Slow {
    /// communication steps per step
    every: u32,
    now: Between,
    saved: [Between; PLACES],
    /// whether inputs have been sent and the step has begun
    begun: bool,
}

/// Progress of a slow unit between its communication points.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Between {
    /// communication steps since its last point
    waited: u32,
    /// time of that point
    begin: f64,
    /// at that point
    inputs: UnitValues,
}

impl Slow {
    /// Whether the unit is between its points and is not called.
    #[inline]
    pub(super) fn waits(&self) -> bool {
        self.now.waited > 0
    }

    /// Takes inputs at one of its points.
    pub(super) fn take(&mut self, inputs: &UnitValues) {
        if !self.waits() {
            self.now.inputs.clone_from(inputs);
        }
    }

    /// Stores the start of its step; true if the next communication step ends it.
    fn enter(&mut self, time: f64) -> bool {
        if !self.waits() {
            self.now.begin = time;
        }
        self.now.waited + 1 == self.every
    }

    pub(super) fn save(&mut self, place: usize) {
        self.saved[place].clone_from(&self.now);
    }

    pub(super) fn restore(&mut self, place: usize) {
        self.now.clone_from(&self.saved[place]);
        self.begun = false;
    }
}

impl Participant {
    /// Sets the number of communication steps per step of the unit.
    pub fn set_every(&mut self, every: u32) {
        self.slow = (every > 1).then(|| Slow {
            every,
            now: Between::default(),
            saved: Default::default(),
            begun: false,
        });
        // in most communication steps, its outputs do not depend on its inputs
        self.capabilities.directional &= every <= 1;
    }

    /// Begins the unit's step in its last communication step.
    pub(super) fn begin_slow_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let Some(slow) = &mut self.slow else { return Ok(()) };
        if !slow.enter(time) {
            return Ok(());
        }
        slow.begun = true;
        let (begin, inputs) = (slow.now.begin, std::mem::take(&mut slow.now.inputs));
        let sent = self.send_inputs(&inputs);
        if let Some(slow) = &mut self.slow {
            slow.now.inputs = inputs;
        }
        sent?;
        let size = self.own_size(begin, between(begin, time + size));
        self.instance.begin_step(begin, size)
    }

    /// Makes the unit's step in its last communication step.
    pub(super) fn slow_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        if self.slow.as_ref().is_some_and(|slow| !slow.begun) {
            self.begin_slow_step(time, size)?;
        }
        let Some(slow) = &mut self.slow else { return Ok(()) };
        if !std::mem::take(&mut slow.begun) {
            slow.now.waited += 1;
            return Ok(());
        }
        slow.now.waited = 0;
        let begin = slow.now.begin;
        self.one_step(begin, between(begin, time + size))
    }

    /// Progress between the unit's points, for a checkpoint.
    #[must_use]
    pub fn between(&self) -> Option<Between> {
        self.slow.as_ref().map(|slow| slow.now.clone())
    }

    /// Restores such progress, after the state of the instance; false if it does not fit this unit.
    ///
    /// # Errors
    /// The outputs cannot be read.
    pub fn restore_between(&mut self, between: Option<&Between>) -> Result<bool, FmuError> {
        let (Some(slow), Some(between)) = (&mut self.slow, between) else {
            return Ok(self.slow.is_none() && between.is_none());
        };
        slow.now.clone_from(between);
        slow.begun = false;
        // held until its next point
        self.receive_values(between.begin)?;
        self.receive_strings()?;
        Ok(true)
    }
}
