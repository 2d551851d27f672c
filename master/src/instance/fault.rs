//! What can go wrong inside of a unit, said with instance, call, time and variables.

use thiserror::Error;

use super::PENDING_LIMIT;
use crate::logger::Message;

/// A [`UnitFault`], boxed since it is rare and large.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct UnitError(Box<UnitFault>);

impl UnitError {
    /// What went wrong.
    #[must_use]
    pub fn fault(&self) -> &UnitFault {
        &self.0
    }
}

impl From<UnitFault> for UnitError {
    fn from(fault: UnitFault) -> Self {
        Self(Box::new(fault))
    }
}

#[cold]
pub(super) fn fail<T>(fault: UnitFault) -> Result<T, UnitError> {
    Err(fault.into())
}

/// What went wrong inside of a unit.
#[derive(Debug, Error)]
pub enum UnitFault {
    /// `fmi2Instantiate` returned nothing.
    #[error("unit {instance} refused to be instantiated{}", said(messages))]
    Refused {
        /// Name of the instance.
        instance: String,
        /// What the unit said.
        messages: Vec<Message>,
    },
    /// A call ended with Error, Fatal or an unknown status.
    #[error(
        "unit {instance}: {call} returned {status}{}{}{}",
        at(*time), about(variables), said(messages)
    )]
    Status {
        /// Name of the instance.
        instance: String,
        /// The C function.
        call: &'static str,
        /// Its status by name.
        status: String,
        /// Simulated time of the call (s), from the start on.
        time: Option<f64>,
        /// Variables that the call was about, if few.
        variables: Vec<String>,
        /// What the unit said.
        messages: Vec<Message>,
    },
    /// A step was discarded.
    #[error(
        "unit {instance}: fmi2DoStep returned fmi2Discard at {time} s: it could not finish the step \
         of {size} s{}{}{}",
        last_successful.map(|t| format!("; it got to {t} s")).unwrap_or_default(),
        if *.terminated { "; it asks to end the simulation" } else { "" },
        said(messages)
    )]
    Discarded {
        /// Name of the instance.
        instance: String,
        /// Time at the step's beginning (s).
        time: f64,
        /// The step (s).
        size: f64,
        /// Until when the unit got (s), if it says so.
        last_successful: Option<f64>,
        /// Whether the unit asks to end the simulation.
        terminated: bool,
        /// What the unit said.
        messages: Vec<Message>,
    },
    /// A step was still pending after [`PENDING_LIMIT`].
    #[error(
        "unit {instance}: fmi2DoStep at {time} s is still pending after {} s", PENDING_LIMIT.as_secs()
    )]
    Hanging {
        /// Name of the instance.
        instance: String,
        /// Time at the step's beginning (s).
        time: f64,
    },
    /// An output is NaN or infinite.
    #[error("unit {instance}: {variable} is {value} at {time} s{}", said(messages))]
    NotFinite {
        /// Name of the instance.
        instance: String,
        /// Name of the variable.
        variable: String,
        /// NaN, inf or -inf.
        value: f64,
        /// When (s).
        time: f64,
        /// What the unit said.
        messages: Vec<Message>,
    },
    /// The unit lacks a function that is needed.
    #[error("unit {instance} lacks the function {call}, which is needed here")]
    Lacks {
        /// Name of the instance.
        instance: String,
        /// The C function.
        call: &'static str,
    },
    /// A report beyond the standard is not offered.
    #[error("unit {instance} offers no reports (its library lacks fmi2_export_report)")]
    NoReports {
        /// Name of the instance.
        instance: String,
    },
    /// A request for a report is not answered.
    #[error("unit {instance} gives no answer to \"{request}\"{}", said(messages))]
    Unanswered {
        /// Name of the instance.
        instance: String,
        /// What was asked.
        request: String,
        /// What the unit said.
        messages: Vec<Message>,
    },
    /// A saved state that was freed or is another instance's.
    #[error("unit {instance} holds no such saved state")]
    NoState {
        /// Name of the instance.
        instance: String,
    },
    /// A text cannot be a C string.
    #[error("unit {instance}: {what} contains a zero byte")]
    ZeroByte {
        /// Name of the instance.
        instance: String,
        /// Which text.
        what: String,
    },
    /// A fatal error of another instance of the same unit.
    #[error("unit {instance} cannot be used any more after a fatal error of its library")]
    Dead {
        /// Name of the instance.
        instance: String,
    },
}

fn at(time: Option<f64>) -> String {
    time.map(|time| format!(" at {time} s")).unwrap_or_default()
}

fn about(variables: &[String]) -> String {
    if variables.is_empty() { String::new() } else { format!(" for {}", variables.join(", ")) }
}

fn said(messages: &[Message]) -> String {
    let grave: Vec<_> = messages.iter().filter(|message| message.grave).collect();
    let shown = if grave.is_empty() { messages.iter().collect() } else { grave };
    let texts: Vec<String> =
        shown.iter().rev().take(3).rev().map(|message| message.text.clone()).collect();
    if texts.is_empty() { String::new() } else { format!("; it says: {}", texts.join("; ")) }
}
