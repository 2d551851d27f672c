//! Starting again when a unit does not keep what its description declares.
//!
//! An instance that has returned `fmi2Error` may not be continued, and values may have passed between the
//! units by then. So all instances are freed and made again, and the unit is not asked for that any more.

use std::collections::HashSet;
use std::time::Duration;

use crate::error::Error;
use crate::initialize::InitializeError;
use crate::system::System;
use fmi2_import::instance::{BrokenPromise, Instance, Offer};
use fmi2_import::logger::Message;

/// What earlier attempts to start have shown.
#[derive(Default)]
pub(super) struct Attempts {
    count: u32,
    forgone: HashSet<(usize, Offer)>,
    messages: Vec<(usize, Vec<Message>)>,
    limits: Vec<String>,
}

impl Attempts {
    /// Learns from an attempt that failed after so long.
    ///
    /// # Errors
    /// The error itself, if another attempt would fail as well.
    pub(super) fn learn(
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
        let alike = system.instances.iter().enumerate();
        let alike = alike.filter(|(_, plan)| plan.package.path() == path);
        let known = self.forgone.len();
        self.forgone.extend(alike.map(|(k, _)| (k, promise.offer)));
        if self.forgone.len() == known {
            return Err(error);
        }
        self.count += 1;
        self.messages.push((index, promise.messages));
        self.limits.push(format!(
            "{} declares that it can be asked by {}, which {}: all units were started again without, \
             after {:.3} s, and {}",
            promise.instance,
            promise.call,
            promise.how,
            took.as_secs_f64(),
            match promise.offer {
                Offer::OutputDerivatives => "derivatives of its outputs are taken from history",
                Offer::States => "its steps are made once, with extrapolated inputs",
                Offer::Directional => "differences are taken instead of its derivatives",
            }
        ));
        Ok(())
    }

    /// Tells fresh instances.
    pub(super) fn tell(&self, instances: &mut [Instance]) {
        for &(k, offer) in &self.forgone {
            instances[k].forgo(offer);
        }
        for (k, messages) in &self.messages {
            instances[*k].inherit(messages.clone());
        }
    }

    /// Whether this is not the first attempt.
    pub(super) fn any(&self) -> bool {
        self.count > 0
    }

    /// What it cost, in sentences.
    pub(super) fn limits(self) -> Vec<String> {
        self.limits
    }
}
