//! The messages of one instance until the master takes them.

use std::sync::{Arc, Mutex, PoisonError};

use fmi2_sys as sys;

use super::registry::{self, Badge};
#[cfg(target_os = "linux")]
use super::ring::Ring;
use super::{Message, callbacks, expand};
use crate::description::ModelDescription;

/// Largest number of messages that are kept: the first ones, which name the cause of a flood.
const KEPT: usize = 100;

/// The first messages of a flood and the number of the others.
#[derive(Debug, Default)]
pub(super) struct Flood {
    kept: Vec<Message>,
    dropped: u64,
}

impl Flood {
    fn push(&mut self, message: Message) {
        if self.kept.len() < KEPT {
            self.kept.push(message);
        } else {
            self.dropped += message.count;
        }
    }

    fn take(&mut self) -> Vec<Message> {
        let mut messages = std::mem::take(&mut self.kept);
        messages.extend(Message::dropped(std::mem::take(&mut self.dropped)));
        messages
    }
}

/// Where messages are stored until they are taken.
enum Store {
    /// For the master in this process.
    Here(Flood),
    /// For a master in another process.
    #[cfg(target_os = "linux")]
    Ring(&'static Ring),
}

/// Receives the messages of one instance. It is found by its [`Badge`], which is the
/// `componentEnvironment`, or by its name, since FMUs may pass back anything.
pub(crate) struct Sink {
    badge: Badge,
    name: String,
    messages: Mutex<Store>,
}

impl Sink {
    /// A sink for the instance with this name in this process.
    pub(crate) fn new(name: &str) -> Arc<Self> {
        Self::with(name, Store::Here(Flood::default()))
    }

    /// A sink whose messages another process reads from the ring.
    #[cfg(target_os = "linux")]
    pub(crate) fn into_ring(name: &str, ring: &'static Ring) -> Arc<Self> {
        Self::with(name, Store::Ring(ring))
    }

    fn with(name: &str, store: Store) -> Arc<Self> {
        let messages = Mutex::new(store);
        let sink = Arc::new(Self { badge: Badge::new(), name: name.to_owned(), messages });
        registry::enter(sink.badge, name, &sink);
        sink
    }

    #[cfg(test)]
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Identifies the instance.
    pub(crate) fn badge(&self) -> Badge {
        self.badge
    }

    /// The callback functions that send messages to this sink.
    pub(crate) fn callbacks(&self) -> sys::fmi2CallbackFunctions {
        callbacks(self.badge)
    }

    pub(super) fn push(&self, message: Message) {
        match &mut *self.messages.lock().unwrap_or_else(PoisonError::into_inner) {
            Store::Here(flood) => flood.push(message),
            #[cfg(target_os = "linux")]
            Store::Ring(ring) => ring.push(message),
        }
    }

    /// Takes all messages, with variable references expanded.
    pub(crate) fn take(&self, description: &ModelDescription) -> Vec<Message> {
        let mut messages = match &mut *self.messages.lock().unwrap_or_else(PoisonError::into_inner)
        {
            Store::Here(flood) => flood.take(),
            #[cfg(target_os = "linux")]
            Store::Ring(ring) => ring.take(),
        };
        for message in &mut messages {
            message.text = expand(&message.text, description);
        }
        messages
    }
}

impl Drop for Sink {
    /// Messages that were not taken become strays.
    fn drop(&mut self) {
        registry::leave(self.badge, &self.name);
        let store = self.messages.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Store::Here(flood) = store {
            for message in flood.take() {
                registry::stray(self.name.clone(), message);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_the_first_messages_of_a_flood_are_kept_and_the_others_counted() {
        let mut flood = Flood::default();
        for k in 0..1000 {
            flood.push(Message::new(sys::fmi2Status::fmi2Error, String::new(), format!("m{k}")));
        }
        let taken = flood.take();
        assert_eq!(taken.len(), KEPT + 1);
        assert_eq!((taken[0].text.as_str(), taken[KEPT - 1].text.as_str()), ("m0", "m99"));
        assert!(taken[KEPT].text.starts_with("900 more messages"), "{}", taken[KEPT].text);
        assert_eq!(taken.iter().map(|it| it.count).sum::<u64>(), 1000);
        assert!(flood.take().is_empty());
    }
}
