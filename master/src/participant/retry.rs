//! A step that the unit discards is repeated in parts.
//!
//! The state before every step is saved. When the unit discards the step, the state is restored and the
//! same step is made in 2 equal parts, then 4, 8 … up to [`MAX_PARTS`]. Each part gets the same
//! input functions: with τ the part's beginning within the step, p(τ), p'(τ), p''(τ) and p'''(τ)
//! of each input's polynomial. The result is that of a smaller communication step for this unit, and
//! the other units are not affected.

use super::Participant;
use coupling::Taylor;
use fmi2_import::instance::{FmuError, FmuFault, StateId};
use fmi2_import::logger;
use fmi2_import::span::{parts, plain};

/// Largest number of parts of a discarded step.
pub const MAX_PARTS: u32 = 1024;

/// What is needed to repeat a step.
#[derive(Debug)]
pub(super) struct Retry {
    /// saved before the step
    state: StateId,
    /// of the step
    pub(super) inputs: Vec<Taylor>,
}

/// A step that the unit discarded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejection {
    /// Time at the step's beginning (s).
    pub time: f64,
    /// The whole step (s).
    pub size: f64,
    /// Number of parts in the last attempt.
    pub parts: u32,
    /// Whether all parts succeeded.
    pub made: bool,
}

impl std::fmt::Display for Rejection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { size, parts, made, .. } = self;
        let size = plain(*size);
        let outcome = if *made { "it was made" } else { "it also failed" };
        write!(f, "the unit discarded the step of {size} s; {outcome} in {parts} parts")
    }
}

impl Participant {
    /// Saves the state before every step from now on, and repeats steps that the unit discards in
    /// parts. False if the unit cannot save its state or cannot vary its step.
    ///
    /// # Errors
    /// The unit fails to save its state.
    pub fn retry_discarded_steps(&mut self) -> Result<bool, FmuError> {
        if !self.capabilities.restore || !self.capabilities.variable_step {
            return Ok(false);
        }
        let (state, answer) = match self.instance.save_state(None) {
            Ok(state) => (Some(state), Ok(())),
            Err(error) => (None, Err(error)),
        };
        self.instance.unless_refused(answer)?;
        let Some(state) = state else { return Ok(false) };
        self.instance.save_before_steps(Some(state));
        let inputs = vec![Taylor::ZERO; self.variables.inputs.reals.len()];
        self.retry = Some(Retry { state, inputs });
        Ok(true)
    }

    /// Takes the list of steps that the unit discarded since the last call.
    pub fn take_rejections(&mut self) -> Vec<Rejection> {
        std::mem::take(&mut self.rejections)
    }

    /// Repeats a step that has just failed in parts, if possible.
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
            self.fill(|k, _| retry.inputs[k].shifted(tau));
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
