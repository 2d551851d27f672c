//! What happens in a run besides its signals: messages of units and events.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Observer;
use fmi2_import::instance::{FmuError, FmuFault};
use fmi2_import::logger::{self, Message, Stray};
use fmi2_import::{Call, fmi2Status, status_with_name};
use master::participant::Participant;
use results::summary::FmuMessage;
use results::{Event, EventKind, EventLog, LogState};
use scenario::LogLevel;

/// Messages of units kept for the summary.
const MAX_MESSAGES: usize = 200;
/// Of these of one instance, so that a flood of one leaves room for the others.
const MAX_OF_ONE: u64 = 100;

/// Gathers messages and events: all of them for events.csv, the first for the summary.
pub(super) struct Journal {
    log: EventLog,
    messages: Vec<FmuMessage>,
    /// per instance, whether the observer knows that it warns
    warned: Vec<bool>,
    /// per instance, whether it has said that it has terminated
    ended: Vec<bool>,
    /// per instance, whether it is known that a step returned a warning
    warned_steps: Vec<bool>,
    /// per instance, steps that it discarded
    discarded: Vec<u64>,
    /// per instance, messages that it has sent
    sent: Vec<u64>,
    /// messages of unknown instances
    strays: u64,
    /// messages of all units that have been listened to
    heard: u64,
    /// which messages the observer gets
    level: LogLevel,
}

/// Whether a unit says in a message that it has terminated, or has been.
fn says_ended(message: &Message) -> bool {
    message.text.to_ascii_lowercase().contains("terminated")
}

/// The part of a journal that a checkpoint keeps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct JournalState {
    log: LogState,
    messages: Vec<FmuMessage>,
    warned: Vec<bool>,
    ended: Vec<bool>,
    warned_steps: Vec<bool>,
    discarded: Vec<u64>,
    sent: Vec<u64>,
    strays: u64,
}

/// What a journal tells in the summary.
pub(super) struct Told {
    pub(super) messages: Vec<FmuMessage>,
    /// number of events by their kind
    pub(super) events: BTreeMap<EventKind, u64>,
    /// per instance, steps that it discarded
    pub(super) discarded: Vec<u64>,
    /// per instance, messages that it has sent
    pub(super) sent: Vec<u64>,
    /// messages that are not among those told
    pub(super) omitted: u64,
}

impl Journal {
    pub(super) fn create(folder: &Path) -> io::Result<Self> {
        let mut log = EventLog::create(folder)?;
        let (messages, warned, ended, warned_steps, discarded, sent) = Default::default();
        let state = JournalState {
            log: log.state()?,
            messages,
            warned,
            ended,
            warned_steps,
            discarded,
            sent,
            strays: 0,
        };
        Ok(Self::of(log, state))
    }

    pub(super) fn resume(folder: &Path, state: JournalState) -> io::Result<Self> {
        let log = EventLog::resume(folder, &state.log)?;
        Ok(Self::of(log, state))
    }

    fn of(log: EventLog, state: JournalState) -> Self {
        // what an earlier run of this process has left is not of this one
        logger::take_strays();
        let JournalState { messages, warned, ended, warned_steps, discarded, sent, strays, .. } =
            state;
        let level = LogLevel::default();
        Self {
            log,
            messages,
            warned,
            ended,
            warned_steps,
            discarded,
            sent,
            strays,
            heard: 0,
            level,
        }
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
            ended: self.ended.clone(),
            warned_steps: self.warned_steps.clone(),
            discarded: self.discarded.clone(),
            sent: self.sent.clone(),
            strays: self.strays,
        })
    }

    /// Notes an event of the run itself.
    pub(super) fn note(
        &mut self,
        time: f64,
        kind: EventKind,
        text: impl Into<String>,
    ) -> io::Result<()> {
        self.log.add(&Event { time, kind, instance: String::new(), text: text.into() })
    }

    /// Whether a unit has said something since the last time.
    #[inline]
    pub(super) fn has_news(&self) -> bool {
        self.heard != logger::arrived()
    }

    /// Takes the units' messages and tells the first grave one of each unit, and whatever may mean that
    /// its results are worth nothing.
    pub(super) fn listen(
        &mut self,
        time: f64,
        participants: &mut [Participant],
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        self.heard = logger::arrived();
        for list in [&mut self.warned, &mut self.ended, &mut self.warned_steps] {
            list.resize(participants.len(), false);
        }
        self.discarded.resize(participants.len(), 0);
        self.sent.resize(participants.len(), 0);
        for (k, participant) in participants.iter_mut().enumerate() {
            self.keep_rejections(k, participant)?;
            self.keep_odd_values(participant, observer)?;
            self.keep_warnings(time, k, participant, observer)?;
            let instance = participant.instance_mut();
            let earlier = instance.take_earlier_messages();
            let messages = instance.take_messages();
            for messages in [&earlier, &messages] {
                show(self.level, instance.name(), messages, observer);
            }
            let grave = earlier.iter().chain(&messages).find(|message| message.is_severe());
            if (instance.warnings().count() > 0 || grave.is_some())
                && !std::mem::replace(&mut self.warned[k], true)
            {
                let call = instance.warnings().first();
                let name = call.map_or("a call", Call::name);
                let silent = format!("{name} returned fmi2Warning");
                let text = grave.map_or(silent.as_str(), |message| message.text.as_str());
                // others have been shown the message, if there was one
                let unseen = self.level > LogLevel::Warning && grave.is_none();
                if self.level == LogLevel::Warning || unseen {
                    observer.message(&format!("unit {} warns: {text}", instance.name()));
                }
                // a step's is an event of its own
                if grave.is_none() && call != Some(Call::fmi2DoStep) {
                    self.warn(time, instance.name(), silent)?;
                }
            }
            let name = instance.name().to_owned();
            // told while it is running: when it is terminated, that is no news
            let ended =
                messages.iter().find(|message| instance.is_running() && says_ended(message));
            if let Some(message) = ended
                && !std::mem::replace(&mut self.ended[k], true)
            {
                observer.warning(&format!(
                    "unit {name} says that it has terminated while the run continues: {}",
                    message.text
                ));
            }
            for message in earlier.into_iter().chain(messages) {
                let known = self.sent[k];
                self.sent[k] += message.count;
                self.keep(time, &name, known, message)?;
            }
        }
        self.listen_to_strays(time, observer)
    }

    /// Takes messages of which it is not known whose they are, and of instances that are gone.
    pub(super) fn listen_to_strays(
        &mut self,
        time: f64,
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        for Stray { instance, message } in logger::take_strays() {
            if message.is_severe() && self.strays == 0 {
                observer.notice(&format!("{instance} warns: {}", message.text));
            }
            let known = self.strays;
            self.strays += message.count;
            self.keep(time, &instance, known, message)?;
        }
        Ok(())
    }

    /// Takes note of a first step that returned `fmi2Warning`, of refused derivatives and of a stall.
    fn keep_warnings(
        &mut self,
        time: f64,
        k: usize,
        participant: &mut Participant,
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        if let Some(refusal) = participant.take_refusal() {
            let name = participant.instance().name();
            observer.warning(&format!("unit {name}: {refusal}"));
            self.warn(time, name, refusal.to_string())?;
        }
        if let Some(first) = participant.instance().warnings().first_step()
            && !std::mem::replace(&mut self.warned_steps[k], true)
        {
            let text = format!("fmi2DoStep returned fmi2Warning, first in the step from {first} s");
            self.warn(time, participant.instance().name(), text)?;
        }
        if let Some(stall) = participant.take_stall() {
            let name = participant.instance().name();
            observer.warning(&format!("unit {name}: {stall}"));
            self.warn(time, name, stall.to_string())?;
        }
        Ok(())
    }

    /// The error of a unit that has stalled and has said that it has terminated.
    pub(super) fn ended(&self, participants: &[Participant]) -> Result<(), FmuError> {
        for (participant, ended) in participants.iter().zip(&self.ended) {
            if let Some(stall) = participant.stall().filter(|_| *ended) {
                let instance = participant.instance().name().to_owned();
                let said = self.messages.iter().filter(|message| message.instance == instance);
                let said = said.map(repeated).filter(says_ended).collect();
                return Err(
                    FmuFault::Stalled { instance, since: stall.since, messages: said }.into()
                );
            }
        }
        Ok(())
    }

    fn warn(&mut self, time: f64, instance: &str, text: String) -> io::Result<()> {
        self.log.add(&Event { time, kind: EventKind::Warning, instance: instance.to_owned(), text })
    }

    fn keep_rejections(&mut self, k: usize, participant: &mut Participant) -> io::Result<()> {
        for rejection in participant.take_rejections() {
            self.discarded[k] += 1;
            self.log.add(&Event {
                time: rejection.time,
                kind: EventKind::Retry,
                instance: participant.instance().name().to_owned(),
                text: rejection.to_string(),
            })?;
        }
        Ok(())
    }

    fn keep_odd_values(
        &mut self,
        participant: &mut Participant,
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        for odd in participant.take_odd_values() {
            let instance = participant.instance().name();
            observer.notice(&format!("at {} s {instance}.{odd}", odd.time));
            self.log.add(&Event {
                time: odd.time,
                kind: EventKind::Warning,
                instance: instance.to_owned(),
                text: odd.to_string(),
            })?;
        }
        Ok(())
    }

    /// Keeps a message of an instance that has sent so many before.
    fn keep(&mut self, time: f64, instance: &str, known: u64, message: Message) -> io::Result<()> {
        let kind = if message.is_severe() { EventKind::Warning } else { EventKind::Message };
        let text = format!("[{}] {}", message.status, message.text);
        self.log.add(&Event { time, kind, instance: instance.to_owned(), text })?;
        if self.messages.len() < MAX_MESSAGES && known < MAX_OF_ONE && message.count == 1 {
            self.messages.push(FmuMessage {
                time,
                instance: instance.to_owned(),
                status: message.status.to_string(),
                text: message.text,
            });
        }
        Ok(())
    }

    /// What the summary is to know.
    pub(super) fn told(&self) -> Told {
        let Self { log, messages, discarded, sent, strays, .. } = self;
        Told {
            omitted: sent.iter().sum::<u64>() + strays - messages.len() as u64,
            messages: messages.clone(),
            events: log.counts().clone(),
            discarded: discarded.clone(),
            sent: sent.clone(),
        }
    }

    /// Completes events.csv as far as it is; more may follow.
    pub(super) fn publish(&mut self) -> io::Result<()> {
        self.log.publish()
    }
}

/// A message of the summary as the unit sent it.
fn repeated(message: &FmuMessage) -> Message {
    Message {
        status: status_with_name(&message.status).unwrap_or(fmi2Status::fmi2OK),
        category: String::new(),
        text: message.text.clone(),
        count: 1,
    }
}

/// Shows what other levels than that of the first warnings let pass.
fn show(level: LogLevel, instance: &str, messages: &[Message], observer: &mut dyn Observer) {
    let passes = |message: &&Message| match level {
        LogLevel::Error => [fmi2Status::fmi2Error, fmi2Status::fmi2Fatal].contains(&message.status),
        LogLevel::Warning => false,
        LogLevel::Info | LogLevel::Debug => true,
    };
    for Message { status, category, text, .. } in messages.iter().filter(passes) {
        let category = if category.is_empty() { "" } else { &format!(" {category}") };
        observer.message(&format!("unit {instance} [{status}{category}] {text}"));
    }
}
