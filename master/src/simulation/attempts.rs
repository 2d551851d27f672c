//! Restarts after a unit fails at something that its description declares.
//!
//! An instance that has returned `fmi2Error` can no longer be used, and values may have passed between
//! the units by then. So all instances are freed and created again, and that capability of the unit is
//! not used any more.

use std::collections::HashSet;
use std::time::Duration;

use crate::error::Error;
use crate::initialize::InitializeError;
use crate::system::{InstanceIndex, System};
use fmi2_import::instance::{BrokenPromise, Instance, Offer};
use fmi2_import::logger::Message;

/// Results of failed attempts to start.
#[derive(Default)]
pub(super) struct Attempts {
    count: u32,
    forgone: HashSet<(InstanceIndex, Offer)>,
    messages: Vec<(InstanceIndex, Vec<Message>)>,
    limits: Vec<String>,
}

impl Attempts {
    /// Adds an attempt that failed after some time.
    ///
    /// # Errors
    /// The same error, if another attempt would fail in the same way.
    pub(super) fn add(
        &mut self,
        system: &System,
        error: Error,
        took: Duration,
    ) -> Result<(), Error> {
        let promise = match &error {
            Error::Step { source, .. } | Error::Initialize(InitializeError::Unit(source)) => {
                BrokenPromise::of(source)
            }
            _ => None,
        };
        let Some(promise) = promise else { return Err(error) };
        let Some(index) = system.find(&promise.instance) else { return Err(error) };
        let path = system.instances[index].package.path();
        let alike = system.indexed().filter(|(_, setup)| setup.package.path() == path);
        let known = self.forgone.len();
        self.forgone.extend(alike.map(|(k, _)| (k, promise.offer)));
        if self.forgone.len() == known {
            return Err(error);
        }
        self.count += 1;
        self.messages.push((index, promise.messages));
        self.limits.push(format!(
            "{} declares that it supports {}, which {}: all units were started again without it \
             after {:.3} s, and {}",
            promise.instance,
            promise.call,
            promise.how,
            took.as_secs_f64(),
            match promise.offer {
                Offer::OutputDerivatives => "derivatives of its outputs are computed from history",
                Offer::States => "its steps are not repeated, and its inputs are extrapolated",
                Offer::Directional => "differences are used instead of its derivatives",
            }
        ));
        Ok(())
    }

    /// Passes the results to new instances.
    pub(super) fn apply_to(&self, instances: &mut [Instance]) {
        for &(k, offer) in &self.forgone {
            instances[k].forgo(offer);
        }
        for (k, messages) in &self.messages {
            instances[*k].inherit(messages.clone());
        }
    }

    /// Whether there were failed attempts.
    pub(super) fn any(&self) -> bool {
        self.count > 0
    }

    /// Consequences for the run, in sentences.
    pub(super) fn limits(self) -> Vec<String> {
        self.limits
    }
}
