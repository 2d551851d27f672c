//! Replaces workers on systems where they do not work.

use std::process::ExitCode;
use std::sync::Arc;

use super::Isolation;
use crate::answer::Answer;
use crate::description::ModelDescription;
use crate::exchange::{Received, Sent, StepLayout};
use crate::fault::{FmuError, FmuFault};
use crate::logger::Message;
use crate::package::Package;
use crate::request::{Identity, Reply, Request};

/// There are no workers on this system.
pub(crate) enum Worker {}

/// Turns this program into a worker if it was started as one. On this system it never is.
#[must_use]
pub fn serve_if_worker() -> Option<ExitCode> {
    None
}

impl Worker {
    pub(crate) fn start(
        _package: &Arc<Package>,
        _isolation: &Isolation,
        _identity: &Identity,
        name: &str,
    ) -> Result<Self, FmuError> {
        Err(FmuFault::CannotIsolate { instance: name.to_owned() }.into())
    }

    pub(crate) fn perform(&mut self, _request: &Request) -> Reply {
        match *self {}
    }

    pub(crate) fn lay_out(&mut self, _layout: &StepLayout) -> Answer {
        match *self {}
    }

    pub(crate) fn send(&mut self, _sent: &Sent) -> Answer {
        match *self {}
    }

    pub(crate) fn receive(&mut self, _received: &mut Received) -> Answer {
        match *self {}
    }

    pub(crate) fn begin_step(&mut self, _time: f64, _size: f64, _save: Option<usize>) -> Answer {
        match *self {}
    }

    pub(crate) fn do_step(&mut self, _time: f64, _size: f64, _save: Option<usize>) -> Answer {
        match *self {}
    }

    pub(crate) fn take_messages(&mut self, _description: &ModelDescription) -> Vec<Message> {
        match *self {}
    }

    pub(crate) fn loss(&self, _: &str, _: Option<f64>, _: Vec<Message>) -> FmuFault {
        match *self {}
    }
}
