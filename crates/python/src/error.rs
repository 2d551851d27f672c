//! Errors as exceptions of `maglev_cosim._errors`, with the text that the command prints.

use maglev::Error;
use pyo3::prelude::*;

/// What an exception says.
pub struct Failure {
    /// Name of its class in `maglev_cosim._errors`.
    class: &'static str,
    causes: Vec<String>,
    help: Option<String>,
}

/// A run failed, or a unit does.
const RUN: &str = "RunError";
/// Something else is at work; try again later.
const BUSY: &str = "BusyError";
/// What was given is invalid.
const INPUT: &str = "InputError";

impl Failure {
    /// Something that was given is invalid.
    pub fn input(text: impl Into<String>, help: Option<&str>) -> Self {
        Self { class: INPUT, causes: vec![text.into()], help: help.map(str::to_owned) }
    }
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        let error = error.into();
        let class = if error.exit_status() == 1 { RUN } else { INPUT };
        Self { class, causes: error.chain(), help: error.help().map(str::to_owned) }
    }
}

impl Failure {
    /// A saved state does not fit.
    pub fn of_state(error: &master::StateError) -> Self {
        Self { class: INPUT, causes: results::causes(error), help: None }
    }

    /// Another process works on a study.
    pub fn busy(error: &study::StudyError) -> Self {
        Self { class: BUSY, ..Self::of_study(error) }
    }

    /// A study cannot be used.
    pub fn of_study(error: &study::StudyError) -> Self {
        let failed =
            matches!(error, study::StudyError::Accuracy { source, .. } if source.is_failed_run());
        let class = if failed { RUN } else { INPUT };
        Self { class, causes: error.chain(), help: error.help().map(str::to_owned) }
    }

    /// Results cannot be read.
    pub fn of_results(error: &results::ReadError) -> Self {
        let help = error.help().map(str::to_owned);
        Self { class: INPUT, causes: results::causes(error), help }
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        Python::attach(|py| {
            let Failure { class, causes, help } = failure;
            let made = py
                .import("maglev_cosim._errors")
                .and_then(|module| module.getattr(class))
                .and_then(|class| class.call1((causes, help)));
            made.map_or_else(|error| error, PyErr::from_value)
        })
    }
}
