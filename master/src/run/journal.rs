//! What happens in a run besides its signals: messages of units and events.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Observer;
use crate::logger::{self, Message};
use crate::participant::Participant;
use crate::record::{Event, EventLog, Kind, LogState};
use crate::scenario::LogLevel;
use crate::summary::UnitMessage;

/// Messages of units kept for the summary.
const MAX_MESSAGES: usize = 200;

/// Gathers messages and events: all of them for events.csv, the first for the summary.
pub(super) struct Journal {
    log: EventLog,
    messages: Vec<UnitMessage>,
    /// per instance, whether the observer knows that it warns
    warned: Vec<bool>,
    /// per instance, steps that it discarded
    discarded: Vec<u64>,
    /// messages of all units that have been listened to
    heard: u64,
    /// which messages the observer gets
    level: LogLevel,
}

/// The part of a journal that a checkpoint keeps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct JournalState {
    log: LogState,
    messages: Vec<UnitMessage>,
    warned: Vec<bool>,
    discarded: Vec<u64>,
}

/// What a journal tells in the summary.
pub(super) struct Told {
    pub(super) messages: Vec<UnitMessage>,
    /// number of events by their kind
    pub(super) events: BTreeMap<Kind, u64>,
    /// per instance, steps that it discarded
    pub(super) discarded: Vec<u64>,
}

impl Journal {
    pub(super) fn create(folder: &Path) -> io::Result<Self> {
        let log = EventLog::create(folder)?;
        let (messages, warned, discarded) = Default::default();
        Ok(Self { log, messages, warned, discarded, heard: 0, level: LogLevel::default() })
    }

    pub(super) fn resume(folder: &Path, state: JournalState) -> io::Result<Self> {
        let log = EventLog::resume(folder, &state.log)?;
        let JournalState { messages, warned, discarded, .. } = state;
        Ok(Self { log, messages, warned, discarded, heard: 0, level: LogLevel::default() })
    }

    /// Sets which messages of units the observer gets.
    pub(super) fn showing(self, level: LogLevel) -> Self {
        Self { level, ..self }
    }

    pub(super) fn state(&mut self) -> io::Result<JournalState> {
        Ok(JournalState {
            log: self.log.state()?,
            messages: self.messages.clone(),
            warned: self.warned.clone(),
            discarded: self.discarded.clone(),
        })
    }

    /// Notes an event of the run itself.
    pub(super) fn note(
        &mut self,
        time: f64,
        kind: Kind,
        text: impl Into<String>,
    ) -> io::Result<()> {
        self.log.add(&Event { time, kind, instance: String::new(), text: text.into() })
    }

    /// Whether a unit has said something since the last time.
    #[inline]
    pub(super) fn has_news(&self) -> bool {
        self.heard != logger::arrived()
    }

    /// Takes the units' messages and tells the first grave one of each unit.
    pub(super) fn listen(
        &mut self,
        time: f64,
        participants: &mut [Participant],
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        self.heard = logger::arrived();
        self.warned.resize(participants.len(), false);
        self.discarded.resize(participants.len(), 0);
        for (k, participant) in participants.iter_mut().enumerate() {
            self.keep_rejections(k, participant)?;
            let instance = participant.instance_mut();
            let messages = instance.take_messages();
            show(self.level, instance.name(), &messages, observer);
            let grave = messages.iter().find(|message| message.grave);
            if (instance.warned() || grave.is_some())
                && !std::mem::replace(&mut self.warned[k], true)
            {
                let silent = "a call returned fmi2Warning";
                let text = grave.map_or(silent, |message| message.text.as_str());
                // others have been shown the message, if there was one
                let unseen = self.level > LogLevel::Warning && grave.is_none();
                if self.level == LogLevel::Warning || unseen {
                    observer.message(&format!("unit {} warns: {text}", instance.name()));
                }
                if grave.is_none() {
                    self.log.add(&Event {
                        time,
                        kind: Kind::Warning,
                        instance: instance.name().to_owned(),
                        text: silent.to_owned(),
                    })?;
                }
            }
            let name = instance.name().to_owned();
            for message in messages {
                self.keep(time, &name, message)?;
            }
        }
        Ok(())
    }

    fn keep_rejections(&mut self, k: usize, participant: &mut Participant) -> io::Result<()> {
        for rejection in participant.take_rejections() {
            self.discarded[k] += 1;
            self.log.add(&Event {
                time: rejection.time,
                kind: Kind::Retry,
                instance: participant.instance().name().to_owned(),
                text: rejection.to_string(),
            })?;
        }
        Ok(())
    }

    fn keep(&mut self, time: f64, instance: &str, message: Message) -> io::Result<()> {
        let kind = if message.grave { Kind::Warning } else { Kind::Message };
        let text = format!("[{}] {}", message.status, message.text);
        self.log.add(&Event { time, kind, instance: instance.to_owned(), text })?;
        if self.messages.len() < MAX_MESSAGES {
            self.messages.push(UnitMessage {
                time,
                instance: instance.to_owned(),
                status: message.status,
                text: message.text,
            });
        }
        Ok(())
    }

    /// What the summary is to know.
    pub(super) fn told(&self) -> Told {
        let (messages, discarded) = (self.messages.clone(), self.discarded.clone());
        Told { messages, events: self.log.counts().clone(), discarded }
    }

    /// Completes events.csv as far as it is; more may follow.
    pub(super) fn publish(&mut self) -> io::Result<()> {
        self.log.publish()
    }
}

/// Shows what other levels than that of the first warnings let pass.
fn show(level: LogLevel, instance: &str, messages: &[Message], observer: &mut dyn Observer) {
    let passes = |message: &&Message| match level {
        LogLevel::Error => ["fmi2Error", "fmi2Fatal"].contains(&message.status.as_str()),
        LogLevel::Warning => false,
        LogLevel::Info | LogLevel::Debug => true,
    };
    for Message { status, category, text, .. } in messages.iter().filter(passes) {
        let category = if category.is_empty() { "" } else { &format!(" {category}") };
        observer.message(&format!("unit {instance} [{status}{category}] {text}"));
    }
}
