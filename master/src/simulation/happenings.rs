//! Events, jumps of inputs and conditions while a simulation runs.
//!
//! A communication step in which something is due is divided there, so that it happens at its time: `[tₙ, tₑ]`, then
//! `[tₑ, tₙ₊₁]`. Points closer together than [`SNAP`] steps are one. Where values jump, the units first make
//! [`SHORT_STEPS`] very short steps: FMI does not allow reading outputs after a change without a step, and an algorithm
//! may pass outputs on one step later. After these, all signals have their values after the jump, and the history before
//! is discarded. The error is that of wrong inputs during [`SHORT_STEPS`] · [`SHORT`] steps.
//!
//! If a unit cannot vary its step, or steps only every so many communication steps, nothing is divided: what is due takes
//! effect at the next communication point, and the history is discarded after the step that begins there.
//!
//! Conditions are located within a step ([`locate`](super::locate)). Where units do not allow that, they are checked
//! after each communication step, and an event whose condition has become true happens at the beginning of the next.

use serde::{Deserialize, Serialize};

use super::Simulation;
use super::story::{Due, Happening, Outcome, Story};
use crate::error::Error;
use crate::participant::{Participant, Slot};
use crate::system::{InstanceIndex, System};
use coupling::Unit as _;
use fmi2_import::span::between;

/// Points closer together than this fraction of the communication step are one.
pub(super) const SNAP: f64 = 1e-5;
/// Number of very short steps after a jump: jumps pass on through as many units that feed outputs through.
const SHORT_STEPS: u32 = 3;
/// Length of each as a fraction of the communication step.
const SHORT: f64 = 1e-6;

/// What has happened so far, for a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct HappeningsState {
    /// number of entries of the agenda that are done
    done: usize,
    /// per watch, whether its outcome has followed
    over: Vec<bool>,
    /// events that happen at the beginning of the next step, with the reason
    pending: Vec<(usize, String)>,
    /// per watch, values of its signals at the last communication point
    before: Vec<Vec<f64>>,
    /// of the files with signals
    checksum: u32,
}

/// What happens during a run.
pub(super) struct Happenings<'a> {
    story: &'a Story,
    system: &'a System,
    /// per watch, the places of its signals
    slots: Vec<Vec<(InstanceIndex, Slot)>>,
    state: HappeningsState,
    /// whether steps can be divided
    pub(super) divides: bool,
    /// whether they can be repeated too, so that conditions are located within them
    pub(super) locates: bool,
    /// from when on conditions are checked that have not become true (s)
    watched_from: f64,
    /// the communication step (s)
    pub(super) step: f64,
    /// sentences about events since they were last taken
    news: Vec<(f64, String)>,
    pub(super) stopped: Option<String>,
}

/// A signal that meets the condition of a watch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Met {
    watch: usize,
    /// which of its signals
    place: usize,
    value: f64,
}

impl Met {
    /// Whether it is the same signal of the same condition.
    pub(super) fn is_like(self, other: Self) -> bool {
        (self.watch, self.place) == (other.watch, other.place)
    }
}

impl<'a> Happenings<'a> {
    pub(super) fn new(
        story: &'a Story,
        system: &'a System,
        participants: &[Participant],
        step: f64,
    ) -> Self {
        let slot = |port: &crate::system::Port| {
            Some((port.instance, participants.get(port.instance.0)?.slot(port.variable)?))
        };
        let slots: Vec<Vec<_>> =
            story.watches.iter().map(|it| it.ports.iter().filter_map(slot).collect()).collect();
        let before = slots.iter().map(|slots| vec![f64::NAN; slots.len()]).collect();
        let varies = participants.iter().all(|it| it.capabilities().variable_step);
        let divides = varies && system.instances.iter().all(|it| it.every == 1);
        let restores = participants.iter().all(|it| it.capabilities().restore);
        let state = HappeningsState {
            done: 0,
            over: vec![false; story.watches.len()],
            pending: Vec::new(),
            before,
            checksum: story.checksum(),
        };
        let mut happenings = Self {
            story,
            system,
            slots,
            state,
            divides,
            locates: divides && restores,
            watched_from: f64::INFINITY,
            step,
            news: Vec::new(),
            stopped: None,
        };
        happenings.find_watched();
        happenings
    }

    /// Finds out from when on a condition can become true.
    fn find_watched(&mut self) {
        let open = self.story.watches.iter().zip(&self.state.over).filter(|(_, over)| !**over);
        self.watched_from = open.map(|(watch, _)| watch.after).fold(f64::INFINITY, f64::min);
    }

    /// Whether a condition that is located can become true up to a time.
    #[inline]
    pub(super) fn watches(&self, end: f64) -> bool {
        self.locates && self.watched_from < end + SNAP * self.step
    }

    /// Sentences, if units do not allow what events and conditions need.
    pub(super) fn limits(&self, start: f64) -> Vec<String> {
        let off_grid = |due: &&Due| {
            let steps = (due.time - start) / self.step;
            (steps - steps.round()).abs() > SNAP
        };
        let due = self.story.agenda.iter().find(off_grid).filter(|_| !self.divides);
        let due = due.map(|Due { time, .. }| {
            format!(
                "events and changes of inputs between communication points, the first at {time} s, take effect at \
                 the next communication point: a unit needs equal steps (canHandleVariableCommunicationStepSize, or \
                 \"every\")"
            )
        });
        let checked = (!self.slots.is_empty() && !self.locates).then(|| {
            let why = if self.divides {
                "a unit cannot save its state (canGetAndSetFMUstate)"
            } else {
                "a unit needs equal steps (canHandleVariableCommunicationStepSize, or \"every\")"
            };
            format!(
                "conditions are checked at communication points, not located between them: {why}"
            )
        });
        due.into_iter().chain(checked).collect()
    }

    /// Time of the next entry of the agenda (s).
    #[inline]
    fn next(&self) -> f64 {
        self.story.agenda.get(self.state.done).map_or(f64::INFINITY, |due| due.time)
    }

    /// Whether nothing happens in a step.
    #[inline]
    pub(super) fn is_quiet(&self, time: f64, end: f64) -> bool {
        let snap = SNAP * self.step;
        let later =
            if self.divides { self.next() >= end - snap } else { self.next() > time + snap };
        later && self.state.pending.is_empty() && !self.watches(end)
    }

    /// Takes what is due up to a time: events by their position, with the reason, and whether a value jumps.
    fn take_due(&mut self, time: f64) -> (Vec<(usize, String)>, bool) {
        let mut events = std::mem::take(&mut self.state.pending);
        let mut jump = false;
        while self.next() <= time + SNAP * self.step {
            match self.story.agenda[self.state.done].what {
                Happening::Event(event) => events.push((event, String::new())),
                Happening::Jump => jump = true,
                Happening::Kink => {}
            }
            self.state.done += 1;
        }
        (events, jump)
    }

    /// Checks the conditions at a communication point.
    #[inline]
    pub(super) fn observe(&mut self, time: f64, participants: &[Participant]) {
        if !self.slots.is_empty() {
            self.check(time, participants);
        }
    }

    fn check(&mut self, time: f64, participants: &[Participant]) {
        for k in 0..self.slots.len() {
            if let Some(met) = self.met_by(k, time, participants) {
                self.conclude(met);
            }
        }
        for (slots, before) in self.slots.iter().zip(&mut self.state.before) {
            for (&(instance, slot), before) in slots.iter().zip(before) {
                *before = participants[instance].value(slot);
            }
        }
    }

    /// The first signal that meets the condition of a watch whose outcome has not followed yet.
    fn met_by(&self, watch: usize, time: f64, participants: &[Participant]) -> Option<Met> {
        let it = &self.story.watches[watch];
        if self.state.over[watch] || time < it.after - SNAP * self.step {
            return None;
        }
        let mut signals = self.slots[watch].iter().zip(&self.state.before[watch]).enumerate();
        signals.find_map(|(place, (&(instance, slot), &before))| {
            let value = participants[instance].value(slot);
            it.comparison.holds(it.limit, before, value).then_some(Met { watch, place, value })
        })
    }

    /// The first condition that is true since the values before.
    pub(super) fn first_met(&self, time: f64, participants: &[Participant]) -> Option<Met> {
        (0..self.slots.len()).find_map(|watch| self.met_by(watch, time, participants))
    }

    /// What a signal exceeds its limit by, before and now.
    pub(super) fn excess(&self, met: Met, participants: &[Participant]) -> [f64; 2] {
        let Met { watch, place, .. } = met;
        let (limit, (instance, slot)) = (self.story.watches[watch].limit, self.slots[watch][place]);
        [self.state.before[watch][place], participants[instance].value(slot)].map(|it| it - limit)
    }

    /// Notes what follows from a condition that has become true.
    fn conclude(&mut self, met: Met) {
        self.state.over[met.watch] = true;
        let watch = &self.story.watches[met.watch];
        let port = watch.ports[met.place];
        let unit = self.system.variable(port).unit.as_ref();
        let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
        let (name, limit) = (self.system.port_name(port), watch.limit);
        let reason =
            format!("{name} {} {limit}{unit}: it is {:.6}{unit}", watch.comparison, met.value);
        match &watch.outcome {
            Outcome::Event(event) => self.state.pending.push((*event, reason)),
            Outcome::Stop(stop) => {
                self.stopped.get_or_insert_with(|| format!("{stop}: {reason}"));
            }
        }
        self.find_watched();
    }

    pub(super) fn state(&self) -> HappeningsState {
        self.state.clone()
    }

    /// Restores such a state; false if it does not fit this scenario.
    pub(super) fn restore(&mut self, state: &HappeningsState) -> bool {
        let lengths = |it: &HappeningsState| it.before.iter().map(Vec::len).collect::<Vec<_>>();
        let fits = state.over.len() == self.state.over.len()
            && state.checksum == self.state.checksum
            && state.done <= self.story.agenda.len()
            && state.pending.iter().all(|(event, _)| *event < self.story.events.len())
            && lengths(state) == lengths(&self.state);
        if fits {
            self.state.clone_from(state);
            (self.stopped, self.news) = (None, Vec::new());
            self.find_watched();
        }
        fits
    }
}

impl Simulation<'_> {
    /// The stop condition that has become true, in words. The run should end then.
    #[must_use]
    pub fn stopped(&self) -> Option<&str> {
        self.happenings.stopped.as_deref()
    }

    /// Takes the times (s) and sentences about the events of the last step.
    pub fn take_news(&mut self) -> Vec<(f64, String)> {
        std::mem::take(&mut self.happenings.news)
    }

    /// Makes a communication step in which something may happen.
    #[cold]
    pub(super) fn eventful_step(&mut self, time: f64, size: f64) -> Result<(), Error> {
        let end = time + size;
        let snap = SNAP * self.happenings.step;
        let mut now = time;
        let mut discard = false;
        loop {
            let (events, mut jump) = self.happenings.take_due(now);
            jump |= self.make_changes(now)?;
            for (event, reason) in events {
                self.apply(now, event, &reason)?;
                jump = true;
            }
            if jump && self.happenings.divides {
                now = self.start_anew(now)?;
            }
            discard |= jump && !self.happenings.divides;
            let next = self.happenings.next();
            let last = !self.happenings.divides || next >= end - snap;
            let part = match last {
                true if now == time => size,
                true => between(now, end),
                false => between(now, next),
            };
            let sooner = self.watched_step(now, part)?;
            if sooner.is_some() && self.happenings.stopped.is_some() {
                self.ended = sooner;
                break;
            }
            // an event that close to the end happens at the beginning of the next step
            match sooner.filter(|sooner| *sooner < end - snap) {
                Some(sooner) => now = sooner,
                None if last => break,
                None => now = next,
            }
        }
        if discard {
            self.stepper.begin_anew();
        }
        Ok(())
    }

    /// Makes very short steps and discards the history. Returns the time that is then reached.
    fn start_anew(&mut self, time: f64) -> Result<f64, Error> {
        let mut now = time;
        for k in 1..=SHORT_STEPS {
            let next = time + f64::from(k) * SHORT * self.happenings.step;
            let stepped = self.stepper.short_step(&mut self.participants, now, between(now, next));
            stepped.map_err(|source| self.failed(now, source))?;
            now = next;
        }
        self.stepper.begin_anew();
        Ok(now)
    }

    fn apply(&mut self, time: f64, event: usize, reason: &str) -> Result<(), Error> {
        let event = &self.happenings.story.events[event];
        for (port, value) in &event.changes {
            let instance = self.participants[port.instance].instance_mut();
            let set = instance.set(port.variable.0, value);
            set.map_err(|source| Error::Step { time, source })?;
        }
        let why = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
        let text = format!("{}: {}{why}", event.name, event.text);
        self.happenings.news.push((time, text));
        Ok(())
    }
}
