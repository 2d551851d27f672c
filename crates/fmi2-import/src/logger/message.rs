//! A message that an FMU logged.

use fmi2_sys::fmi2Status as Status;

/// A message of an FMU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Status that it came with.
    pub status: Status,
    /// Category, empty if the FMU gave none.
    pub category: String,
    /// The formatted message, without a trailing line break.
    pub text: String,
    /// Number of messages that it stands for: 1, or all that were dropped in a flood.
    pub count: u64,
}

impl Message {
    pub(crate) fn new(status: Status, category: String, text: String) -> Self {
        Self { status, category, text, count: 1 }
    }

    /// Stands for messages that were not kept; `None` if there were none.
    pub(crate) fn dropped(count: u64) -> Option<Self> {
        let noun = if count == 1 { "message" } else { "messages" };
        let text = format!("{count} more {noun} dropped: a flood, of which the first are kept");
        let message = Self::new(Status::fmi2OK, String::new(), text);
        (count > 0).then_some(Self { count, ..message })
    }

    /// Whether the status is worse than `fmi2OK`.
    #[must_use]
    pub fn is_severe(&self) -> bool {
        self.status != Status::fmi2OK
    }
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "[{}] {}", self.status, self.text)
    }
}
