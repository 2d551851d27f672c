//! What can go wrong inside of a unit, said with instance, call, time and variables.

use std::time::Duration;

use thiserror::Error;

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
}

impl FmuError {
    /// Whether the unit has only left something undone that it need not do: the instance goes on.
    #[must_use]
    pub fn is_refusal(&self) -> bool {
        match &*self.0 {
            FmuFault::Status { status, .. } => status == "fmi2Discard",
            FmuFault::Lacks { .. } => true,
            _ => false,
        }
    }

    /// Whether the unit has ended the simulation in an orderly way.
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

#[cold]
pub(super) fn fail<T>(fault: FmuFault) -> Result<T, FmuError> {
    Err(fault.into())
}

/// What went wrong inside of a unit.
#[derive(Debug, Error)]
pub enum FmuFault {
    /// `fmi2Instantiate` returned nothing.
    #[error("unit {instance} refused to be instantiated{}", said(messages))]
    Refused {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// A call ended with Error, Fatal or an unknown status.
    #[error(
        "unit {instance}: {call} returned {status}{}{}{}",
        at(*time), about(variables), said(messages)
    )]
    Status {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function.
        call: &'static str,
        /// Its status by name.
        status: String,
        /// Simulated time of the call (s), from the start on.
        time: Option<f64>,
        /// Variables that the call was about, if few.
        variables: Vec<String>,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// A value that the Enumeration which takes it does not have.
    #[error(
        "unit {instance}: output {variable} is {value} at {time} s, which is no item of {target}"
    )]
    NoItem {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Name of the output variable.
        variable: String,
        /// The value that names no item.
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
        last_successful.map(|t| format!("; it got to {t} s")).unwrap_or_default(),
        if *.terminated { "; it asks to end the simulation" } else { "" },
        said(messages)
    )]
    Discarded {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Time at the step's beginning (s).
        time: f64,
        /// The step (s).
        size: f64,
        /// Until when the unit got (s), if it says so.
        last_successful: Option<f64>,
        /// Whether the unit asks to end the simulation.
        terminated: bool,
        /// Whether the unit can save its state, so that the step could be tried in parts.
        can_retry: bool,
        /// Messages that the FMU logged in this call, oldest first.
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
        /// How long it was given.
        limit: Duration,
    },
    /// Its process was ended by a signal.
    #[error(
        "unit {instance} crashed: signal {signal} ({}) in {call}{}{}",
        signal_name(*signal), at(*time), said(messages)
    )]
    Crashed {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function that it was in.
        call: &'static str,
        /// Number of the signal.
        signal: i32,
        /// Simulated time (s), from the start on.
        time: Option<f64>,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// Its process ended by itself.
    #[error(
        "unit {instance} ended its process with status {code} in {call}{}{}",
        at(*time), said(messages)
    )]
    Exited {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function that it was in.
        call: &'static str,
        /// Exit status of the process.
        code: i32,
        /// Simulated time (s), from the start on.
        time: Option<f64>,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// A call took too long and was ended with its process.
    #[error(
        "unit {instance} was ended: {call}{} took longer than {} s{}",
        at(*time), limit.as_secs_f64(), said(messages)
    )]
    TimedOut {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function that it was in.
        call: &'static str,
        /// How long it was given.
        limit: Duration,
        /// Simulated time (s), from the start on.
        time: Option<f64>,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// The user ended the run while a call did not return, which ended with its process.
    #[error(
        "unit {instance} was ended: {call}{} had not returned{}", at(*time), said(messages)
    )]
    GivenUp {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function that it was in.
        call: &'static str,
        /// Simulated time (s), from the start on.
        time: Option<f64>,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// The connection to its process broke.
    #[error("unit {instance}: the connection to its process broke in {call}{}: {why}{}",
        at(*time), said(messages))]
    Broken {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function that it was in.
        call: &'static str,
        /// What ended the connection to the worker, in words.
        why: String,
        /// Simulated time (s), from the start on.
        time: Option<f64>,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// No process for it.
    #[error("unit {instance}: no process can be started for it")]
    NoProcess {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// Processes of their own for units do not work on this system.
    #[error("unit {instance} cannot have a process of its own: that works on Linux only")]
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
    /// Its steps return `fmi2Warning` and change nothing, and it has said that it has terminated.
    #[error(
        "unit {instance} has stopped computing: it has said that it has terminated, its steps return \
         fmi2Warning, and no Real output has changed since {since} s{}",
        said(messages)
    )]
    Stalled {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Time since which nothing has changed (s).
        since: f64,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// An output is NaN or infinite.
    #[error("unit {instance}: {variable} is {value} at {time} s{}", said(messages))]
    NotFinite {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Output or derivative that is not finite.
        variable: String,
        /// NaN, inf or -inf.
        value: f64,
        /// When (s).
        time: f64,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// The unit lacks a function that is needed.
    #[error("unit {instance} lacks the function {call}, which is needed here")]
    Lacks {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// The C function.
        call: &'static str,
    },
    /// A report beyond the standard is not offered.
    #[error("unit {instance} offers no reports (its library lacks fmi2_export_report)")]
    NoReports {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
    /// A request for a report is not answered.
    #[error("unit {instance} gives no answer to \"{request}\"{}", said(messages))]
    Unanswered {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Name of the report that was requested.
        request: String,
        /// Messages that the FMU logged in this call, oldest first.
        messages: Vec<Message>,
    },
    /// A saved state that was freed or is another instance's.
    #[error("unit {instance} holds no such saved state")]
    NoState {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
    /// More bytes for a saved state than are to be had.
    #[error("unit {instance} wants {size} bytes for its saved state, which are not to be had")]
    StateTooLarge {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
        /// Bytes wanted.
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
    /// A fatal error of another instance of the same unit.
    #[error("unit {instance} cannot be used any more after a fatal error of its library")]
    Dead {
        /// Instance name, as passed to `fmi2Instantiate`.
        instance: String,
    },
}

impl FmuFault {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Refused { .. } => {
                "a unit refuses when its modelDescription.xml and its binary do not belong together \
             (different GUID) or its resources are missing; package it again"
            }
            Self::NotFinite { .. } => {
                "the model has left the range that it is valid in: check parameters and start values, \
             or take a smaller step"
            }
            Self::NoItem { .. } => {
                "the two sides count different items: ask who made the units which value means what"
            }
            Self::Discarded { terminated: true, .. } => "the unit has ended the simulation itself",
            Self::Discarded { can_retry: true, .. } => {
                "take a smaller step (--step); with \"on_discard\": \"retry\" under \"algorithm\", such \
             steps are tried in parts"
            }
            Self::Discarded { .. } => {
                "take a smaller step (--step); a unit that can save its state would be tried in parts"
            }
            Self::Status { status, .. } if status == "fmi2Fatal" => {
                "the unit gave up for good: check its parameters and inputs, or ask who made it"
            }
            Self::Status { call: "fmi2SetRealInputDerivatives", .. } => {
                "the unit declares that it takes derivatives of inputs (canInterpolateInputs) and does not: \
             give its instance \"input_derivatives\": 0 in the scenario, then its inputs are held over a \
             step"
            }
            Self::Status { call: "fmi2GetRealOutputDerivatives", .. } => {
                "the unit declares derivatives of outputs (maxOutputDerivativeOrder) and fails to give them: \
             with \"derivatives\": false under \"algorithm\" they are taken from history"
            }
            Self::Status { call: "fmi2GetDirectionalDerivative", .. } => {
                "the unit declares directional derivatives (providesDirectionalDerivative) and fails to give \
             them: with \"iteration\": { \"jacobian\": \"steps\" } under \"algorithm\" Newton's method \
             takes differences of steps"
            }
            Self::Stalled { .. } => {
                "the unit has ended on its own: its messages in events.csv say why; results from that time \
             on are worth nothing"
            }
            Self::Status { .. } => {
                "check the unit's parameters and inputs; a smaller step may help"
            }
            Self::Crashed { signal: 9, .. } => {
                "who did not end it by hand should look at the memory: the system ends processes that \
             want too much of it"
            }
            Self::Crashed { .. } => {
                "the unit has a fault: ask who made it, or run it under a debugger; parameters, inputs \
             or a smaller step may avoid it"
            }
            Self::Exited { .. } => {
                "a unit must not end its process: its license, resources or another program that it \
             needs may be missing"
            }
            Self::TimedOut { call, .. } if *call == "fmi2DoStep" => {
                "if the step is no endless loop, allow more time (--step-timeout)"
            }
            Self::TimedOut { .. } => {
                "if it is no endless loop, allow more time (isolation.call_timeout in the scenario)"
            }
            Self::Hanging { .. } => "if the unit still works on the step, allow more time",
            Self::NoProcess { .. } => {
                "check the limits of processes and memory, or run without --isolate"
            }
            Self::CannotIsolate { .. } => "run without --isolate",
            Self::Lacks { .. } => {
                "the unit's binary is incomplete; `maglev validate` lists what is missing"
            }
            _ => return None,
        })
    }
}

impl FmuFault {
    /// Whether the unit's process ended, in whatever way.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        matches!(
            self,
            Self::Crashed { .. }
                | Self::Exited { .. }
                | Self::TimedOut { .. }
                | Self::GivenUp { .. }
                | Self::Broken { .. }
        )
    }

    /// Whether values that have left all bounds may be the reason.
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

fn at(time: Option<f64>) -> String {
    time.map(|time| format!(" at {time} s")).unwrap_or_default()
}

pub(crate) fn signal_name(number: i32) -> &'static str {
    // those that a fault of a program raises, by their numbers on Linux
    match number {
        4 => "SIGILL",
        6 => "SIGABRT",
        7 => "SIGBUS",
        8 => "SIGFPE",
        9 => "SIGKILL",
        11 => "SIGSEGV",
        14 => "SIGALRM",
        15 => "SIGTERM",
        24 => "SIGXCPU",
        31 => "SIGSYS",
        _ => "of another kind",
    }
}

fn about(variables: &[String]) -> String {
    if variables.is_empty() { String::new() } else { format!(" for {}", variables.join(", ")) }
}

/// What a unit said: the first of its gravest messages, for these name the cause, or else the last.
fn said(messages: &[Message]) -> String {
    const SHOWN: usize = 3;
    let gravity = |message: &Message| match message.status.as_str() {
        "fmi2OK" => 0,
        "fmi2Warning" => 1,
        _ => 2,
    };
    let highest = messages.iter().map(gravity).max().unwrap_or(0);
    let mut shown: Vec<&str> = messages
        .iter()
        .filter(|message| gravity(message) == highest)
        .map(|message| message.text.as_str())
        .collect();
    if highest == 0 {
        shown.drain(..shown.len().saturating_sub(SHOWN));
    }
    let more = match shown.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!("; and {more} more like these"),
    };
    shown.truncate(SHOWN);
    if shown.is_empty() { String::new() } else { format!("; it says: {}{more}", shown.join("; ")) }
}
