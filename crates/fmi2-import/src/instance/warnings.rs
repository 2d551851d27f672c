//! Calls of an instance that returned `fmi2Warning`.

use fmi2_sys::fmi2Status as Status;

use crate::functions::Call;
use crate::logger;

/// Calls that returned `fmi2Warning`, and the refusal of derivatives of inputs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Warnings {
    count: u64,
    first: Option<Call>,
    steps: u64,
    first_step: Option<f64>,
    refused: Option<Refusal>,
}

/// An FMU declares that it accepts derivatives of inputs, but does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refusal {
    status: Status,
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "fmi2SetRealInputDerivatives returned {}, although the unit declares canInterpolateInputs: \
             from now on its inputs are constant over a step, which makes the coupling of order 1",
            self.status
        )
    }
}

impl Warnings {
    pub(super) fn note(&mut self, call: Call, time: Option<f64>) {
        if call == Call::fmi2DoStep {
            self.steps += 1;
            if self.first_step.is_none() {
                self.first_step = time;
                logger::note_arrival();
            }
        }
        self.count += 1;
        if self.first.is_none() {
            self.first = Some(call);
            logger::note_arrival();
        }
    }

    /// Whether a warning after so many steps refuses derivatives of inputs: only the first time that
    /// the FMU gets any. A later warning is about values.
    pub(super) fn may_refuse(&self, steps: u64) -> bool {
        steps == 0 || self.refused.is_some()
    }

    pub(super) fn refuse(&mut self, status: Status) {
        if self.refused.is_none() {
            self.refused = Some(Refusal { status });
            logger::note_arrival();
        }
    }

    /// Number of calls that returned `fmi2Warning`.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The C function of the first of them.
    #[must_use]
    pub fn first(&self) -> Option<Call> {
        self.first
    }

    /// Number of steps that returned `fmi2Warning`.
    #[inline]
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Beginning of the first of them (s).
    #[must_use]
    pub fn first_step(&self) -> Option<f64> {
        self.first_step
    }

    /// How the FMU refused derivatives of inputs, if it did.
    #[must_use]
    pub fn refusal(&self) -> Option<Refusal> {
        self.refused
    }
}
