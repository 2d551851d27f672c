//! What a call to an FMU returned.

use fmi2_sys::fmi2Status as Status;
use serde::{Deserialize, Serialize};

use crate::functions::Call;

/// Result of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Outcome {
    /// The function returned this `fmi2Status`.
    Status(u32),
    /// The library has no such function.
    Lacks,
    /// The process that the call was made in has ended.
    Lost,
}

/// A call and its result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[must_use]
pub(crate) struct Answer {
    pub(crate) call: Call,
    pub(crate) outcome: Outcome,
}

impl Answer {
    pub(crate) const fn new(call: Call, status: Status) -> Self {
        Self { call, outcome: Outcome::Status(status.0) }
    }

    pub(crate) const fn good(call: Call) -> Self {
        Self::new(call, Status::fmi2OK)
    }

    #[inline]
    pub(crate) fn is_good(self) -> bool {
        self.outcome == Outcome::Status(Status::fmi2OK.0)
    }

    /// Whether the FMU can be used as if the call had returned `fmi2OK`.
    #[inline]
    pub(crate) fn can_continue(self) -> bool {
        self.is_good() || self.is(Status::fmi2Warning) || self.refuses_derivatives()
    }

    /// Whether the FMU ignored derivatives of inputs. It can be used further without them.
    pub(crate) fn refuses_derivatives(self) -> bool {
        self.call == Call::fmi2SetRealInputDerivatives
            && (self.is(Status::fmi2Warning) || self.is(Status::fmi2Discard))
    }

    /// The more severe of two answers; the later one if they are equally severe.
    #[inline]
    pub(crate) fn or_worse(self, next: Self) -> Self {
        if next.is_good() || self.severity() > next.severity() { self } else { next }
    }

    /// Only the most severe answer of an exchange is kept. A failure is the most severe, then what
    /// changes how the instance is treated.
    #[cold]
    fn severity(self) -> u8 {
        match self.call {
            _ if self.is_good() => 0,
            _ if !self.can_continue() => 4,
            Call::fmi2SetRealInputDerivatives => 3,
            Call::fmi2DoStep => 2,
            _ => 1,
        }
    }

    #[inline]
    pub(crate) fn is(self, status: Status) -> bool {
        self.outcome == Outcome::Status(status.0)
    }
}
