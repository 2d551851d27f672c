//! Messages of units and events of the run, for events.csv and the summary.

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

/// Most messages of units in the summary.
const MAX_MESSAGES: usize = 200;
/// Most messages of one instance in the summary, so that a flood leaves room for the others.
const MAX_OF_ONE: u64 = 100;

/// Collects messages and events: all for events.csv, the first messages for the summary.
pub(super) struct Journal {
    log: EventLog,
    kept: Kept,
    /// number of messages of all units that have been taken
    heard: u64,
    /// messages that the observer gets
    level: LogLevel,
}

/// What a journal remembers, also in a checkpoint.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Kept {
    /// for the summary
    messages: Vec<FmuMessage>,
    /// per instance, whether the observer got its first warning
    warned: Vec<bool>,
    /// per instance, whether it reported that it has terminated
    ended: Vec<bool>,
    /// per instance, whether its first step with `fmi2Warning` is logged
    warned_steps: Vec<bool>,
    /// per instance, steps that it discarded
    discarded: Vec<u64>,
    /// per instance, messages that it has sent
    sent: Vec<u64>,
    /// messages of unknown instances
    strays: u64,
}

/// Whether a unit reports in a message that it has terminated or was terminated.
fn reports_end(message: &Message) -> bool {
    message.text.to_ascii_lowercase().contains("terminated")
}

/// The journal's part of a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct JournalState {
    log: LogState,
    kept: Kept,
}

/// The journal's part of the summary.
pub(super) struct JournalSummary {
    pub(super) messages: Vec<FmuMessage>,
    /// number of events by their kind
    pub(super) events: BTreeMap<EventKind, u64>,
    /// per instance, steps that it discarded
    pub(super) discarded: Vec<u64>,
    /// per instance, messages that it has sent
    pub(super) sent: Vec<u64>,
    /// number of messages that are not in `messages`
    pub(super) omitted: u64,
}

impl Journal {
    pub(super) fn create(folder: &Path) -> io::Result<Self> {
        Ok(Self::of(EventLog::create(folder)?, Kept::default()))
    }

    pub(super) fn resume(folder: &Path, state: JournalState) -> io::Result<Self> {
        Ok(Self::of(EventLog::resume(folder, &state.log)?, state.kept))
    }

    fn of(log: EventLog, kept: Kept) -> Self {
        // drop what an earlier run in this process has left
        logger::take_strays();
        Self { log, kept, heard: 0, level: LogLevel::default() }
    }

    /// Selects the messages of units that the observer gets.
    pub(super) fn showing(self, level: LogLevel) -> Self {
        Self { level, ..self }
    }

    pub(super) fn state(&mut self) -> io::Result<JournalState> {
        Ok(JournalState { log: self.log.state()?, kept: self.kept.clone() })
    }

    /// Logs an event of the run itself.
    pub(super) fn note(
        &mut self,
        time: f64,
        kind: EventKind,
        text: impl Into<String>,
    ) -> io::Result<()> {
        self.log.add(&Event { time, kind, instance: String::new(), text: text.into() })
    }

    /// Whether units have sent messages since the last time.
    #[inline]
    pub(super) fn has_news(&self) -> bool {
        self.heard != logger::arrived()
    }

    /// Takes the units' messages. The observer gets the first severe one of each instance, and
    /// everything that may make its results invalid.
    pub(super) fn listen(
        &mut self,
        time: f64,
        participants: &mut [Participant],
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        self.heard = logger::arrived();
        for list in [&mut self.kept.warned, &mut self.kept.ended, &mut self.kept.warned_steps] {
            list.resize(participants.len(), false);
        }
        self.kept.discarded.resize(participants.len(), 0);
        self.kept.sent.resize(participants.len(), 0);
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
                && !std::mem::replace(&mut self.kept.warned[k], true)
            {
                let call = instance.warnings().first();
                let name = call.map_or("a call", Call::name);
                let silent = format!("{name} returned fmi2Warning");
                let text = grave.map_or(silent.as_str(), |message| message.text.as_str());
                // at the other levels, show() has passed on the message if there was one
                let unseen = self.level > LogLevel::Warning && grave.is_none();
                if self.level == LogLevel::Warning || unseen {
                    observer.message(&format!("unit {} warns: {text}", instance.name()));
                }
                // a warning of a step is logged separately
                if grave.is_none() && call != Some(Call::fmi2DoStep) {
                    self.warn(time, instance.name(), silent)?;
                }
            }
            let name = instance.name().to_owned();
            // only while it is running: after fmi2Terminate the message is expected
            let ended =
                messages.iter().find(|message| instance.is_running() && reports_end(message));
            if let Some(message) = ended
                && !std::mem::replace(&mut self.kept.ended[k], true)
            {
                observer.warning(&format!(
                    "unit {name} reports that it has terminated while the run continues: {}",
                    message.text
                ));
            }
            for message in earlier.into_iter().chain(messages) {
                let known = self.kept.sent[k];
                self.kept.sent[k] += message.count;
                self.keep(time, &name, known, message)?;
            }
        }
        self.listen_to_strays(time, observer)
    }

    /// Takes messages of unknown instances and of instances that no longer exist.
    pub(super) fn listen_to_strays(
        &mut self,
        time: f64,
        observer: &mut dyn Observer,
    ) -> io::Result<()> {
        for Stray { instance, message } in logger::take_strays() {
            if message.is_severe() && self.kept.strays == 0 {
                observer.notice(&format!("{instance} warns: {}", message.text));
            }
            let known = self.kept.strays;
            self.kept.strays += message.count;
            self.keep(time, &instance, known, message)?;
        }
        Ok(())
    }

    /// Logs the first step that returned `fmi2Warning`, refused derivatives, and a stall.
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
            && !std::mem::replace(&mut self.kept.warned_steps[k], true)
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

    /// The error of a unit that has stalled after it reported that it has terminated.
    pub(super) fn ended(&self, participants: &[Participant]) -> Result<(), FmuError> {
        for (participant, ended) in participants.iter().zip(&self.kept.ended) {
            if let Some(stall) = participant.stall().filter(|_| *ended) {
                let instance = participant.instance().name().to_owned();
                let said = self.kept.messages.iter().filter(|message| message.instance == instance);
                let said = said.map(original).filter(reports_end).collect();
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
            self.kept.discarded[k] += 1;
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

    /// Logs a message of an instance that has sent `known` messages before.
    fn keep(&mut self, time: f64, instance: &str, known: u64, message: Message) -> io::Result<()> {
        let kind = if message.is_severe() { EventKind::Warning } else { EventKind::Message };
        let text = format!("[{}] {}", message.status, message.text);
        self.log.add(&Event { time, kind, instance: instance.to_owned(), text })?;
        if self.kept.messages.len() < MAX_MESSAGES && known < MAX_OF_ONE && message.count == 1 {
            self.kept.messages.push(FmuMessage {
                time,
                instance: instance.to_owned(),
                status: message.status.to_string(),
                text: message.text,
            });
        }
        Ok(())
    }

    /// The journal's part of the summary.
    pub(super) fn summary(&self) -> JournalSummary {
        let Kept { messages, discarded, sent, strays, .. } = &self.kept;
        JournalSummary {
            omitted: sent.iter().sum::<u64>() + strays - messages.len() as u64,
            messages: messages.clone(),
            events: self.log.counts().clone(),
            discarded: discarded.clone(),
            sent: sent.clone(),
        }
    }

    /// Writes events.csv with all events until now. More may follow.
    pub(super) fn publish(&mut self) -> io::Result<()> {
        self.log.publish()
    }
}

/// A message of the summary in the form in which the unit sent it.
fn original(message: &FmuMessage) -> Message {
    Message {
        status: status_with_name(&message.status).unwrap_or(fmi2Status::fmi2OK),
        category: String::new(),
        text: message.text.clone(),
        count: 1,
    }
}

/// Passes on the messages that the level selects, except for `Warning`, which shows the first only.
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
