//! Messages of units during a run, of which only those matter that report an end.

use fmi2_import::instance::{FmuError, FmuFault};
use fmi2_import::logger::{self, Message};
use master::participant::Participant;

/// Takes the messages of units.
pub(crate) struct Listener {
    /// number of messages of all units that have been taken
    heard: u64,
    /// per instance, its messages that report its end
    ends: Vec<Vec<Message>>,
}

impl Listener {
    pub(crate) fn new(instances: usize) -> Self {
        // drop what an earlier run in this process has left
        logger::take_strays();
        Self { heard: 0, ends: vec![Vec::new(); instances] }
    }

    /// Takes new messages, if there are any.
    ///
    /// # Errors
    /// A unit has stalled after it reported that it has terminated.
    #[inline]
    pub(crate) fn listen(&mut self, participants: &mut [Participant]) -> Result<(), FmuError> {
        if self.heard == logger::arrived() {
            return Ok(());
        }
        self.take(participants)
    }

    #[cold]
    fn take(&mut self, participants: &mut [Participant]) -> Result<(), FmuError> {
        self.heard = logger::arrived();
        for (participant, ends) in participants.iter_mut().zip(&mut self.ends) {
            participant.take_rejections();
            participant.take_odd_values();
            participant.take_refusal();
            let instance = participant.instance_mut();
            instance.take_earlier_messages();
            let running = instance.is_running();
            let messages = instance.take_messages().into_iter();
            ends.extend(messages.filter(|it| running && reports_end(it)));
            participant.take_stall();
            if let Some(stall) = participant.stall().filter(|_| !ends.is_empty()) {
                let instance = participant.instance().name().to_owned();
                let messages = std::mem::take(ends);
                return Err(FmuFault::Stalled { instance, since: stall.since, messages }.into());
            }
        }
        logger::take_strays();
        Ok(())
    }
}

/// Whether a unit reports in a message that it has terminated or was terminated.
pub(crate) fn reports_end(message: &Message) -> bool {
    message.text.to_ascii_lowercase().contains("terminated")
}
