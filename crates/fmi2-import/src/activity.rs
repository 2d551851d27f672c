//! What code of an FMU a process is running, as far as it is known.
//!
//! It is stored as a number, since signal handlers and shared memory can hold nothing else.

use std::fmt;

use crate::functions::Call;

/// Code of an FMU that a process is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// None that this program has called.
    None,
    /// The initialisers of its library, which run while it is loaded.
    Loading,
    /// A function of the C interface.
    Call(Call),
}

impl Activity {
    /// The number of [`Activity::None`].
    pub(crate) const IDLE: u32 = u32::MAX;
    /// The number of [`Activity::Loading`].
    pub(crate) const LOADING: u32 = u32::MAX - 1;

    /// The activity with a number. FMUs may overwrite shared memory, so every number is possible.
    pub(crate) fn from_number(number: u32) -> Self {
        match number {
            Self::LOADING => Self::Loading,
            number => Call::from_number(number).map_or(Self::None, Self::Call),
        }
    }

    /// Name for messages.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::None => "no call",
            Self::Loading => "dlopen",
            Self::Call(call) => call.name(),
        }
    }
}

impl fmt::Display for Activity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
