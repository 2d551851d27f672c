//! events.csv: what happened in a run besides its signals, with simulated times.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::EVENTS;
use crate::growing::{Growing, Position};

/// Events that are written; a run that has more only counts them.
const MAX_EVENTS: u64 = 100_000;

/// EventKind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// A unit's message of status `fmi2OK`.
    Message,
    /// A unit's message of a worse status, or a call that returned `fmi2Warning`.
    Warning,
    /// A remark of the master, about loops or about imperfect units.
    Note,
    /// A step that was taken back.
    Rejected,
    /// A step that was tried again in smaller parts.
    Retry,
    /// A checkpoint was written.
    Checkpoint,
    /// The run went on from a checkpoint.
    Resumed,
    /// A step that ended later than real time allows.
    Overrun,
    /// The user ended the run.
    Interrupted,
    /// A unit ended the run.
    Terminated,
    /// The run failed.
    Failed,
}

impl EventKind {
    /// As written in events.csv.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Message => "message",
            Self::Warning => "warning",
            Self::Note => "note",
            Self::Rejected => "rejected",
            Self::Retry => "retry",
            Self::Checkpoint => "checkpoint",
            Self::Resumed => "resumed",
            Self::Overrun => "overrun",
            Self::Interrupted => "interrupted",
            Self::Terminated => "terminated",
            Self::Failed => "failed",
        }
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Simulated time (s).
    pub time: f64,
    /// What it is.
    pub kind: EventKind,
    /// The instance that it concerns; empty: the run.
    pub instance: String,
    /// Description for readers, one line.
    pub text: String,
}

/// How far the log has got, for a checkpoint.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogState {
    position: Position,
    counts: BTreeMap<EventKind, u64>,
}

/// The log: columns time, kind, instance, text; one line per event.
pub struct EventLog {
    file: Growing,
    counts: BTreeMap<EventKind, u64>,
}

impl EventLog {
    /// Begins the log in the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(folder: &Path) -> io::Result<Self> {
        let header = line(["time", "kind", "instance", "text"])?;
        let file = Growing::create(Self::path(folder), &header)?;
        Ok(Self { file, counts: BTreeMap::new() })
    }

    /// Goes on with a log from an earlier state; events after it are cut off.
    ///
    /// # Errors
    /// The file cannot be written, or is not the one that the state is of.
    pub fn resume(folder: &Path, state: &LogState) -> io::Result<Self> {
        let file = Growing::resume(Self::path(folder), state.position)?;
        Ok(Self { file, counts: state.counts.clone() })
    }

    /// Where the log of a folder is once it is complete.
    #[must_use]
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(EVENTS)
    }

    /// Adds an event.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, event: &Event) -> io::Result<()> {
        *self.counts.entry(event.kind).or_default() += 1;
        if self.file.records() >= MAX_EVENTS {
            return Ok(());
        }
        let last = self.file.records() + 1 == MAX_EVENTS;
        let text = if last { "further events are counted only" } else { event.text.as_str() };
        // an event is one line, whatever a unit says
        let text = text.trim_end().replace(['\n', '\r'], " ");
        let time = ryu::Buffer::new().format(event.time).to_owned();
        let bytes = line([time.as_str(), event.kind.as_str(), &event.instance, &text])?;
        self.file.record(|buffer| buffer.extend_from_slice(&bytes))
    }

    /// Number of events by their kind.
    #[must_use]
    pub fn counts(&self) -> &BTreeMap<EventKind, u64> {
        &self.counts
    }

    /// Puts all events on the disk and tells how far the log got.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn state(&mut self) -> io::Result<LogState> {
        Ok(LogState { position: self.file.position()?, counts: self.counts.clone() })
    }

    /// Puts all events on the disk and gives the log its name; more may follow.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn publish(&mut self) -> io::Result<()> {
        self.file.publish()
    }

    /// Completes the log and gives it its name.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn finish(self) -> io::Result<PathBuf> {
        self.file.finish()
    }
}

/// One line of CSV, quoted where needed.
pub(super) fn line<'a>(fields: impl IntoIterator<Item = &'a str>) -> io::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
    writer.write_record(fields)?;
    writer.into_inner().map_err(|error| error.into_error())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_an_event_is_one_line_and_a_flood_is_counted() {
        let folder = tempfile::tempdir().unwrap();
        let mut log = EventLog::create(folder.path()).unwrap();
        let mut event = Event {
            time: 0.5,
            kind: EventKind::Warning,
            instance: "a".into(),
            text: "odd, \"very\"\nodd\n".into(),
        };
        log.add(&event).unwrap();
        event.kind = EventKind::Message;
        for _ in 0..MAX_EVENTS + 10 {
            log.add(&event).unwrap();
        }
        assert_eq!(log.counts()[&EventKind::Message], MAX_EVENTS + 10);
        let text = std::fs::read_to_string(log.finish().unwrap()).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next().unwrap(), "time,kind,instance,text");
        assert_eq!(lines.next().unwrap(), "0.5,warning,a,\"odd, \"\"very\"\" odd\"");
        assert_eq!(lines.clone().count() as u64, MAX_EVENTS - 1);
        assert_eq!(lines.last().unwrap(), "0.5,message,a,further events are counted only");
    }
}
