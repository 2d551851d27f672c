//! Conditions that become true within a step.
//!
//! The communication point before the step is marked, and the step is made. If a condition is true at its end, the units
//! return to the mark and make steps of other sizes, until the time is known to [`WIDTH`] communication steps. There the
//! units stay: an event happens, or the run ends. A condition that holds for a part of a step only, and no longer at its
//! end, is not seen.

use super::Simulation;
use crate::error::Error;
use coupling::Bracket;
use fmi2_import::instance::FmuError;

/// The time of a condition is known to this fraction of the communication step.
const WIDTH: f64 = 1e-6;

impl Simulation<'_> {
    /// Makes a step. Returns the time (s) to which it was made instead, if a condition became true before its end.
    pub(super) fn watched_step(&mut self, time: f64, size: f64) -> Result<Option<f64>, Error> {
        let watches = self.happenings.watches(time + size);
        self.attempt_step(time, size, watches).map_err(|source| self.failed(time, source))
    }

    fn attempt_step(
        &mut self,
        time: f64,
        size: f64,
        watches: bool,
    ) -> Result<Option<f64>, FmuError> {
        let Self { stepper, participants, happenings, .. } = self;
        if watches {
            stepper.mark(participants)?;
        }
        stepper.step(participants, time, size)?;
        if !watches {
            return Ok(None);
        }
        let Some(mut first) = happenings.first_met(time + size, participants) else {
            happenings.observe(time + size, participants);
            return Ok(None);
        };
        let width = WIDTH * happenings.step;
        let mut bracket = Bracket::new(size, width, happenings.excess(first, participants));
        let mut reached = size;
        while let Some(shorter) = bracket.next() {
            stepper.go_back(participants)?;
            stepper.step(participants, time, shorter)?;
            reached = shorter;
            let met = happenings.first_met(time + shorter, participants);
            let same = met.is_none_or(|met| met.is_like(first));
            first = met.unwrap_or(first);
            let [_, excess] = happenings.excess(first, participants);
            bracket.take(shorter, met.is_some(), excess, same);
        }
        if reached != bracket.upper() {
            reached = bracket.upper();
            stepper.go_back(participants)?;
            stepper.step(participants, time, reached)?;
        }
        happenings.observe(time + reached, participants);
        Ok(Some(time + reached))
    }
}
