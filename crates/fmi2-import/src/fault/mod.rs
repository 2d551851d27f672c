//! What an FMU can do wrong, with instance, call, time and variables.

mod help;
mod loss;
mod words;

use std::time::Duration;

use fmi2_sys::fmi2Status as Status;
use thiserror::Error;

pub use self::loss::Loss;
use self::words::{about, at, logged, lost};
use crate::activity::Activity;
use crate::functions::Call;
use crate::logger::Message;
use crate::span::plain;

/// A [`FmuFault`], boxed since it is rare and large.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct FmuError(Box<FmuFault>);

impl FmuError {
    /// What went wrong.
    #[must_use]
    pub fn fault(&self) -> &FmuFault {
        &self.0
    }

    /// Whether the FMU only refused something optional. The instance can be used further.
    pub(crate) fn is_refusal(&self) -> bool {
        matches!(
            *self.0,
            FmuFault::Status { status: Status::fmi2Discard, .. } | FmuFault::Lacks { .. }
        )
    }

    /// Whether the FMU ended the simulation in an orderly way.
    #[must_use]
    pub fn asks_to_end(&self) -> bool {
        matches!(*self.0, FmuFault::Discarded { terminated: true, .. })
    }
}

impl From<FmuFault> for FmuError {
    fn from(fault: FmuFault) -> Self {
        Self(Box::new(fault))
    }
}

/// The messages of an error and its causes, outermost first.
#[must_use]
pub fn causes(error: &dyn std::error::Error) -> Vec<String> {
    std::iter::successors(Some(error), |error| error.source()).map(ToString::to_string).collect()
}

#[cold]
pub(crate) fn fail<T>(fault: FmuFault) -> Result<T, FmuError> {
    Err(fault.into())
}

/// What an FMU did wrong.
#[derive(Debug, Error)]
pub enum FmuFault {
    /// `fmi2Instantiate` returned nothing.
    #[error("unit {instance} refused to be instantiated{}", logged(messages))]
    Refused {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// A call returned `fmi2Discard`, `fmi2Error`, `fmi2Fatal` or an unknown status.
    #[error(
        "unit {instance}: {call} returned {status}{}{}{}",
        at(*time), about(variables), logged(messages)
    )]
    Status {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function.
        call: Call,
        /// The status that it returned.
        status: Status,
        /// Simulated time of the call (s), from the start on.
        time: Option<f64>,
        /// Names of the variables of the call, if they are few.
        variables: Vec<String>,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// An output has a value that the connected Enumeration input does not have.
    #[error(
        "unit {instance}: output {variable} is {value} at {time} s, which is not an item of {target}"
    )]
    NoItem {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Name of the output variable.
        variable: String,
        /// The value that no item has.
        value: i32,
        /// `instance.variable` of the input.
        target: String,
        /// Simulated time (s).
        time: f64,
    },
    /// A step was discarded.
    #[error(
        "unit {instance}: fmi2DoStep returned fmi2Discard at {time} s: it could not finish the step \
         of {} s{}{}{}",
        plain(*size),
        last_successful.map(|t| format!("; it reached {t} s")).unwrap_or_default(),
        if *.terminated { "; it asks to end the simulation" } else { "" },
        logged(messages)
    )]
    Discarded {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Time at the step's beginning (s).
        time: f64,
        /// The step (s).
        size: f64,
        /// Time that the FMU reached (s), if it reports it.
        last_successful: Option<f64>,
        /// Whether the FMU asks to end the simulation.
        terminated: bool,
        /// Whether the FMU can save its state, so that the step can be repeated in parts.
        can_retry: bool,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// A step was still pending after the limit.
    #[error(
        "unit {instance}: fmi2DoStep at {time} s is still pending after {} s", limit.as_secs_f64()
    )]
    Hanging {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Time at the step's beginning (s).
        time: f64,
        /// The limit.
        limit: Duration,
    },
    /// Its process ended or was killed during a call.
    #[error("unit {instance}{}{}", lost(how, *call, *time), logged(messages))]
    Lost {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// How the process ended.
        how: Loss,
        /// The code that was running.
        call: Activity,
        /// Simulated time (s), from the start on.
        time: Option<f64>,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// No process can be started for it.
    #[error("unit {instance}: cannot start a process for it")]
    NoProcess {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// Isolation does not work on this system.
    #[error("unit {instance} cannot run in a process of its own: isolation works on Linux only")]
    CannotIsolate {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
    /// Its binary cannot be loaded in its process.
    #[error("unit {instance} cannot be loaded in its process: {}", causes.join("; because "))]
    Unloadable {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The worker's chain of causes, outermost first.
        causes: Vec<String>,
    },
    /// It reported that it has terminated; since then its steps return `fmi2Warning` and change nothing.
    #[error(
        "unit {instance} has stopped computing: it reported that it has terminated, its steps return \
         fmi2Warning, and no Real output has changed since {since} s{}",
        logged(messages)
    )]
    Stalled {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Time of the last change (s).
        since: f64,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// An output is NaN or infinite.
    #[error("unit {instance}: {variable} is {value} at {time} s{}", logged(messages))]
    NotFinite {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Name of the output.
        variable: String,
        /// NaN, inf or -inf.
        value: f64,
        /// Simulated time (s).
        time: f64,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// Its library does not export a function that the run needs.
    #[error("unit {instance} does not export {call}, which this run needs")]
    Lacks {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function.
        call: Call,
    },
    /// It does not give reports, which are an extension of the standard.
    #[error("unit {instance} offers no reports (its library lacks fmi2_export_report)")]
    NoReports {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
    /// It did not answer the request for a report.
    #[error("unit {instance} did not answer the request \"{request}\"{}", logged(messages))]
    Unanswered {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Name of the report that was requested.
        request: String,
        /// What it logged, oldest first.
        messages: Vec<Message>,
    },
    /// A saved state was freed or belongs to another instance.
    #[error("unit {instance} has no such saved state")]
    NoState {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
    /// The bytes of a saved state cannot be allocated.
    #[error("cannot allocate {size} bytes for the saved state of unit {instance}")]
    StateTooLarge {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Number of bytes.
        size: usize,
    },
    /// A text cannot be a C string.
    #[error("unit {instance}: {what} contains a zero byte")]
    ZeroByte {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The text that contains a zero byte, in words.
        what: String,
    },
    /// Another instance of the same library failed fatally.
    #[error("unit {instance} cannot be used any more after a fatal error in its library")]
    Dead {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
}

impl FmuFault {
    /// Whether the FMU ended its process, or it was killed.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        matches!(self, Self::Lost { .. })
    }

    /// Whether values that grow without bound may be the cause.
    #[must_use]
    pub fn may_be_numeric(&self) -> bool {
        matches!(
            self,
            Self::NotFinite { .. }
                | Self::Status { .. }
                | Self::Discarded { terminated: false, .. }
        )
    }
}
