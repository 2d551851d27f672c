//! events.csv: the events of a run with their simulated times.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::EVENTS;
use crate::growing::{Growing, Position};

/// Most events that are written. Further events are only counted.
const MAX_EVENTS: u64 = 100_000;

/// What kind of event it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// A message of a unit with status `fmi2OK`.
    Message,
    /// A message of a unit with a worse status, or a call that returned `fmi2Warning`.
    Warning,
    /// A remark of the master, about loops or imperfect units.
    Note,
    /// An event of the scenario.
    Event,
    /// A step that was rejected and undone.
    Rejected,
    /// A step that was repeated in smaller steps.
    Retry,
    /// A checkpoint was written.
    Checkpoint,
    /// The run continued from a checkpoint.
    Resumed,
    /// A step that finished later than real time requires.
    Overrun,
    /// The user stopped the run.
    Interrupted,
    /// A stop condition of the scenario ended the run.
    Stopped,
    /// A unit terminated the run.
    Terminated,
    /// The run failed.
    Failed,
}

impl EventKind {
    /// The name in events.csv.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Message => "message",
            Self::Warning => "warning",
            Self::Note => "note",
            Self::Event => "event",
            Self::Rejected => "rejected",
            Self::Retry => "retry",
            Self::Checkpoint => "checkpoint",
            Self::Resumed => "resumed",
            Self::Overrun => "overrun",
            Self::Interrupted => "interrupted",
            Self::Stopped => "stopped",
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
    /// Its kind.
    pub kind: EventKind,
    /// The instance that it concerns; empty if it concerns the run.
    pub instance: String,
    /// Description in one line.
    pub text: String,
}

/// The state of the log, for a checkpoint.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogState {
    position: Position,
    counts: BTreeMap<EventKind, u64>,
}

/// Writes events.csv: columns time, kind, instance, text; one line per event.
pub struct EventLog {
    file: Growing,
    counts: BTreeMap<EventKind, u64>,
}

impl EventLog {
    /// Starts the log in the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(folder: &Path) -> io::Result<Self> {
        let header = line(["time", "kind", "instance", "text"])?;
        let file = Growing::create(Self::path(folder), &header)?;
        Ok(Self { file, counts: BTreeMap::new() })
    }

    /// Continues a log from an earlier state and removes later events.
    ///
    /// # Errors
    /// The file cannot be written, or does not belong to the state.
    pub fn resume(folder: &Path, state: &LogState) -> io::Result<Self> {
        let file = Growing::resume(Self::path(folder), state.position)?;
        Ok(Self { file, counts: state.counts.clone() })
    }

    /// Path of the complete log in a folder.
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
        let text = if last { "further events are only counted" } else { event.text.as_str() };
        // a unit's message may have several lines
        let text = text.trim_end().replace(['\n', '\r'], " ");
        let time = ryu::Buffer::new().format(event.time).to_owned();
        let bytes = line([time.as_str(), event.kind.as_str(), &event.instance, &text])?;
        self.file.record(|buffer| buffer.extend_from_slice(&bytes))
    }

    /// Number of events of each kind.
    #[must_use]
    pub fn counts(&self) -> &BTreeMap<EventKind, u64> {
        &self.counts
    }

    /// Waits until all events are on the disk, and returns the state.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn state(&mut self) -> io::Result<LogState> {
        Ok(LogState { position: self.file.position()?, counts: self.counts.clone() })
    }

    /// Waits until all events are on the disk, and gives the file its final name. More may follow.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn publish(&mut self) -> io::Result<()> {
        self.file.publish()
    }

    /// Completes the log and gives the file its final name.
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
        assert_eq!(lines.last().unwrap(), "0.5,message,a,further events are only counted");
    }
}
