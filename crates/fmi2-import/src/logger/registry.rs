//! Which instance a message belongs to. FMUs may pass anything to the logger: the environment of another
//! instance or a number, no name or a wrong one. So pointers are only compared, never dereferenced.
//!
//! Three things identify the instance: the environment, the name, and the instance that this thread is
//! calling. If two agree, they are right. Otherwise the name counts more than the call, and the call more
//! than the environment, since FMUs with a static copy of the callbacks use the environment of the last
//! instance. Messages of unknown instances are kept as [`Stray`]s.

use std::cell::Cell;
use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, Weak};

use super::{Message, Sink};

/// Largest number of strays that are kept until they are taken.
const STRAYS: usize = 1000;
/// Freed instances whose names are remembered, for messages that come late.
const FREED: usize = 1000;

/// Identifies an instance: an address that is never reused and never dereferenced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Badge(usize);

impl Badge {
    /// Of no instance in this process.
    pub(crate) const NONE: Self = Self(0);

    pub(super) fn new() -> Self {
        // zeros, for FMUs that dereference it
        let place: &'static [usize; 4] = Box::leak(Box::new([0; 4]));
        Self(std::ptr::from_ref(place).expose_provenance())
    }

    pub(super) fn of(environment: *const std::ffi::c_void) -> Self {
        Self(environment.addr())
    }

    pub(super) fn environment(self) -> *mut std::ffi::c_void {
        std::ptr::with_exposed_provenance_mut(self.0)
    }
}

thread_local! {
    static CALLED: Cell<Badge> = const { Cell::new(Badge::NONE) };
}

/// Notes that this thread is about to call the instance with this badge.
#[inline]
pub(crate) fn calls(badge: Badge) {
    CALLED.set(badge);
}

/// A message of an instance that is unknown or was freed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stray {
    /// Name of the instance, or what is known about it.
    pub instance: String,
    /// The message as it arrived.
    pub message: Message,
}

/// An instance that exists or was freed.
struct Entry {
    name: String,
    sink: Weak<Sink>,
}

#[derive(Default)]
struct Registry {
    entries: HashMap<Badge, Entry>,
    /// of existing instances
    by_name: HashMap<String, Vec<Badge>>,
    /// freed instances whose names are known, the earliest first
    freed: VecDeque<Badge>,
    strays: Vec<Stray>,
    /// strays beyond those kept
    dropped: u64,
}

static REGISTRY: LazyLock<Mutex<Registry>> = LazyLock::new(Mutex::default);

fn registry() -> MutexGuard<'static, Registry> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn enter(badge: Badge, name: &str, sink: &Arc<Sink>) {
    let mut registry = registry();
    let entry = Entry { name: name.to_owned(), sink: Arc::downgrade(sink) };
    registry.entries.insert(badge, entry);
    registry.by_name.entry(name.to_owned()).or_default().push(badge);
}

pub(super) fn leave(badge: Badge, name: &str) {
    let mut registry = registry();
    if let Some(badges) = registry.by_name.get_mut(name) {
        badges.retain(|it| *it != badge);
        if badges.is_empty() {
            registry.by_name.remove(name);
        }
    }
    if let Some(entry) = registry.entries.get_mut(&badge) {
        // a reference would keep the sink's memory
        entry.sink = Weak::new();
        registry.freed.push_back(badge);
    }
    if registry.freed.len() > FREED
        && let Some(earliest) = registry.freed.pop_front()
    {
        registry.entries.remove(&earliest);
    }
}

pub(super) fn stray(instance: String, message: Message) {
    let mut registry = registry();
    if registry.strays.len() < STRAYS {
        registry.strays.push(Stray { instance, message });
    } else {
        registry.dropped += message.count;
    }
}

/// Takes the messages of instances that are unknown or were freed.
pub fn take_strays() -> Vec<Stray> {
    let mut registry = registry();
    let mut strays = std::mem::take(&mut registry.strays);
    let dropped = Message::dropped(std::mem::take(&mut registry.dropped));
    strays.extend(dropped.map(|message| Stray { instance: UNKNOWN.to_owned(), message }));
    strays
}

const UNKNOWN: &str = "unknown instance";

/// Delivers a message to its instance, or to the strays. `name` is the instance name that the FMU gave.
pub(super) fn deliver(environment: Badge, name: Option<&str>, message: Message) {
    let found = registry().find(environment, name, CALLED.get());
    // the registry is unlocked here, since dropping the last reference to a sink locks it
    match found {
        Ok(sink) => sink.push(message),
        Err(instance) => stray(instance, message),
    }
}

impl Registry {
    /// The sink of the instance that a message belongs to, or the name of the instance that it seems to be
    /// of.
    fn find(
        &self,
        environment: Badge,
        name: Option<&str>,
        called: Badge,
    ) -> Result<Arc<Sink>, String> {
        let known = |badge: Badge| self.entries.contains_key(&badge).then_some(badge);
        let (environment, called) = (known(environment), known(called));
        let namesakes = name.and_then(|name| self.by_name.get(name)).map_or(&[][..], Vec::as_slice);
        let namesake = [environment, called]
            .into_iter()
            .flatten()
            .find(|badge| namesakes.contains(badge))
            .or_else(|| namesakes.last().copied());
        let agreed = if environment == called { environment } else { None };
        let badge = agreed.or(namesake).or(called).or(environment).or_else(|| self.only());
        match badge.and_then(|badge| self.entries.get(&badge)) {
            Some(entry) => entry.sink.upgrade().ok_or_else(|| entry.name.clone()),
            None => Err(match name.filter(|name| !name.is_empty()) {
                Some(name) => format!("{UNKNOWN} \"{name}\""),
                None => UNKNOWN.to_owned(),
            }),
        }
    }

    /// The only instance in this process, such as that of a worker.
    fn only(&self) -> Option<Badge> {
        let mut alive = self.by_name.values().flatten();
        alive.next().copied().filter(|_| alive.next().is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Instances a and b, and c, which was freed.
    fn registry_of_two() -> (Registry, Vec<Arc<Sink>>) {
        let mut registry = Registry::default();
        let sinks = [Sink::new("test a"), Sink::new("test b")];
        for sink in &sinks {
            let name = sink.name().to_owned();
            let entry = Entry { name: name.clone(), sink: Arc::downgrade(sink) };
            registry.entries.insert(sink.badge(), entry);
            registry.by_name.entry(name).or_default().push(sink.badge());
        }
        let gone = Entry { name: "test c".to_owned(), sink: Weak::new() };
        registry.entries.insert(Badge(7), gone);
        (registry, sinks.into())
    }

    #[test]
    fn issue_a_message_finds_its_instance_by_what_is_right() {
        let (registry, sinks) = registry_of_two();
        let (a, b, gone) = (sinks[0].badge(), sinks[1].badge(), Badge(7));
        let find = |environment, name: Option<&str>, called| {
            let found = registry.find(environment, name, called);
            found.map(|sink| sink.name().to_owned()).unwrap_or_else(|name| name)
        };
        let (odd, none) = (Badge(1), Badge::NONE);
        for (environment, name, called, expected) in [
            (a, Some("test a"), none, "test a"),
            (a, None, none, "test a"),
            (a, Some("nobody"), none, "test a"),
            // numbers and null for an environment
            (odd, Some("test b"), none, "test b"),
            (none, Some("test b"), a, "test b"),
            (odd, None, b, "test b"),
            (odd, Some("nobody"), b, "test b"),
            // the environment of another instance
            (a, Some("test b"), none, "test b"),
            (a, Some("test b"), b, "test b"),
            (a, None, b, "test b"),
            (a, Some("nobody"), b, "test b"),
            // a static name
            (a, Some("test b"), a, "test a"),
            // of an instance that was freed, and of an unknown one
            (gone, Some("test c"), none, "test c"),
            (gone, None, none, "test c"),
            (odd, None, none, "unknown instance"),
            (odd, Some(""), none, "unknown instance"),
            (none, Some("nobody"), none, "unknown instance \"nobody\""),
        ] {
            let found = find(environment, name, called);
            assert_eq!(found, expected, "{environment:?} {name:?} {called:?}");
        }
    }

    #[test]
    fn issue_an_unknown_message_belongs_to_the_only_instance_in_the_process() {
        let (mut registry, sinks) = registry_of_two();
        registry.by_name.remove("test b");
        let found = registry.find(Badge(2), Some("nobody"), Badge::NONE).ok();
        assert_eq!(found.map(|sink| sink.badge()), Some(sinks[0].badge()));
    }
}
