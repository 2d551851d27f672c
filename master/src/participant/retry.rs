//! A step that the unit discards is tried again in parts.
//!
//! The state before every step is saved. When the unit discards the step, it is put back and the
//! same step is made in 2 equal parts, then 4, 8 … up to [`MAX_PARTS`]. Each part gets the same
//! input functions: with τ the part's beginning within the step, p(τ), p'(τ), p''(τ) and p'''(τ)
//! of each input's polynomial. So the result is what the unit would have given with a smaller
//! communication step of its own, and nobody else notices.

use super::Participant;
use super::rate::shifted;
use crate::coupling::signal::Taylor;
use fmi2_import::instance::{FmuError, FmuFault, StateId};
use fmi2_import::logger;
use fmi2_import::span::{parts, plain};

/// Into how many parts a discarded step is divided at most.
pub const MAX_PARTS: u32 = 1024;

/// What a retry needs.
#[derive(Debug)]
pub(super) struct Retry {
    /// saved before the step
    state: StateId,
    /// of the step, at its beginning
    pub(super) inputs: Vec<Taylor>,
}

/// A step that the unit discarded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejection {
    /// Time at the step's beginning (s).
    pub time: f64,
    /// The whole step (s).
    pub size: f64,
    /// Into how many parts it was divided in the end.
    pub parts: u32,
    /// Whether all parts were made.
    pub made: bool,
}

impl std::fmt::Display for Rejection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { size, parts, made, .. } = self;
        let size = plain(*size);
        let outcome = if *made { "made" } else { "not to be made" };
        write!(f, "the unit discarded the step of {size} s; it was {outcome} in {parts} parts")
    }
}

impl Participant {
    /// Saves the state before every step from now on, and tries steps that the unit discards in
    /// parts. Returns whether the unit can do that: it must be able to save its state and to take
    /// steps of any size.
    ///
    /// # Errors
    /// The unit cannot save its state, though it says so.
    pub fn retry_discarded_steps(&mut self) -> Result<bool, FmuError> {
        if !self.capabilities.restore || !self.capabilities.variable_step {
            return Ok(false);
        }
        let saved = self.instance.save_state(None);
        let (state, answer) = match saved {
            Ok(state) => (Some(state), Ok(())),
            Err(error) => (None, Err(error)),
        };
        self.instance.unless_refused(answer)?;
        let Some(state) = state else { return Ok(false) };
        self.instance.save_before_steps(Some(state));
        let inputs = vec![[0.0; 4]; self.traffic.real_inputs.len()];
        self.retry = Some(Retry { state, inputs });
        Ok(true)
    }

    /// Takes the list of steps that the unit discarded since the last call.
    pub fn take_rejections(&mut self) -> Vec<Rejection> {
        std::mem::take(&mut self.rejections)
    }

    /// Makes a step that has just failed in parts, if it can be.
    #[cold]
    pub(super) fn step_in_parts(
        &mut self,
        time: f64,
        size: f64,
        error: FmuError,
    ) -> Result<(), FmuError> {
        let Some(retry) = self.retry.take() else { return Err(error) };
        self.instance.save_before_steps(None);
        let mut rejection = Rejection { time, size, parts: 1, made: false };
        let mut outcome = Err(error);
        while let Err(error) = &outcome
            && asks_for_less(error)
            && rejection.parts < MAX_PARTS
        {
            rejection.parts *= 2;
            outcome = self.make_parts(&retry, rejection);
        }
        rejection.made = outcome.is_ok();
        if rejection.parts > 1 {
            self.rejections.push(rejection);
            logger::note_arrival();
        }
        self.instance.save_before_steps(Some(retry.state));
        self.retry = Some(retry);
        outcome
    }

    fn make_parts(&mut self, retry: &Retry, step: Rejection) -> Result<(), FmuError> {
        self.instance.restore_state(retry.state)?;
        for (begin, part) in parts(step.time, step.size, step.parts) {
            let tau = begin - step.time;
            self.fill(|k, _| shifted(&retry.inputs[k], tau));
            self.send_values()?;
            self.instance.do_step(begin, part)?;
        }
        Ok(())
    }
}

/// Whether a smaller step may help.
fn asks_for_less(error: &FmuError) -> bool {
    matches!(error.fault(), FmuFault::Discarded { terminated: false, .. })
}
