//! The error type of a unit: the text for the importer's log, and the status that it gets.

use std::fmt::Display;

/// Which FMI status an [`Error`] becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// `fmi2Error`: this call failed.
    Invalid,
    /// `fmi2Discard`: not possible now; a smaller step or another value may work.
    Discard,
    /// `fmi2Discard` with `fmi2Terminated`: the simulation has come to its end, as a result.
    Terminated,
    /// `fmi2Fatal`: every instance of the unit is unusable from now on.
    Fatal,
}

/// Reason of a failed call, as a message for the user of the simulation.
///
/// The kit hands the text to the importer's logger and maps the [`ErrorKind`] on the status. A good
/// message says what failed, where, when, and how to fix it.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    kind: ErrorKind,
    message: String,
}

impl Error {
    /// An error that the importer sees as `fmi2Error`.
    pub fn invalid(message: impl Display) -> Self {
        Self { kind: ErrorKind::Invalid, message: message.to_string() }
    }

    /// A refusal that the importer sees as `fmi2Discard`: it may try a smaller step.
    ///
    /// A [`Model::step`](crate::Model::step) that returns it must leave its state as it was at the
    /// beginning of the step.
    pub fn discard(message: impl Display) -> Self {
        Self { kind: ErrorKind::Discard, message: message.to_string() }
    }

    /// The end of the simulation as a result, such as a contact that the model does not describe. The importer sees
    /// `fmi2Discard`, and true for `fmi2Terminated`.
    ///
    /// A [`Model::step`](crate::Model::step) that returns it must leave its state as it was at the beginning of the
    /// step.
    pub fn terminated(message: impl Display) -> Self {
        Self { kind: ErrorKind::Terminated, message: message.to_string() }
    }

    /// A failure that corrupted every instance in the process (`fmi2Fatal`). Rarely appropriate.
    pub fn fatal(message: impl Display) -> Self {
        Self { kind: ErrorKind::Fatal, message: message.to_string() }
    }

    /// An `fmi2Error` from another error with all of its causes: `what: cause: cause of that`.
    #[must_use]
    pub fn caused(error: &(dyn std::error::Error + 'static)) -> Self {
        let mut message = error.to_string();
        let mut source = error.source();
        while let Some(cause) = source {
            message.push_str(": ");
            message.push_str(&cause.to_string());
            source = cause.source();
        }
        Self { kind: ErrorKind::Invalid, message }
    }

    /// Adds a context in front: `context: message`.
    #[must_use]
    pub fn context(mut self, context: impl Display) -> Self {
        self.message = format!("{context}: {}", self.message);
        self
    }

    /// Which FMI status the error becomes.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The message for the log.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}
